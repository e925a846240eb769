use super::*;
use crate::texels::decode_image;
use crate::texels::rows::{ImageBytes, ImageFile, ImageSize};
use ::image::{ImageFormat, load_from_memory_with_format};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

/// A file, and the texels that libjpeg-turbo makes of it as a PNG file; `samples/make.py` made them.
macro_rules! sample {
    ($name:literal) => {
        (
            $name,
            include_bytes!(concat!("samples/", $name, ".jpg")).as_slice(),
            include_bytes!(concat!("samples/", $name, ".png")).as_slice(),
        )
    };
}

type Sample = (&'static str, &'static [u8], &'static [u8]);

const SAMPLES: [Sample; 8] = [
    sample!("444"),
    sample!("422"),
    sample!("420"),
    sample!("420-restart"),
    sample!("420-progressive"),
    sample!("grey"),
    sample!("grey-progressive"),
    sample!("rgb"),
];

fn texels_of(image: &Image) -> &[u8] {
    let Texels::U8(texels) = &image.texels else { panic!("8 bits") };
    texels
}

fn decoded(bytes: &[u8]) -> Image {
    decode_image(bytes, "test", &Limits::default()).expect("decodes")
}

fn file(bytes: &[u8]) -> ImageFile {
    ImageFile {
        bytes: ImageBytes::Part(bytes.to_vec().into()),
        name: "test".into(),
        limits: Limits::default(),
    }
}

/// The largest and the mean difference.
fn differences(a: &[u8], b: &[u8]) -> (u8, f64) {
    assert_eq!(a.len(), b.len());
    let of = || a.iter().zip(b).map(|(a, b)| a.abs_diff(*b));
    (of().max().unwrap_or(0), of().map(f64::from).sum::<f64>() / a.len() as f64)
}

#[test]
fn texels_are_those_of_libjpeg() {
    for (name, jpeg, png) in SAMPLES {
        let theirs = load_from_memory_with_format(png, ImageFormat::Png).expect("a PNG file");
        let ours = decoded(jpeg);
        assert_eq!((ours.width, ours.height), (theirs.width(), theirs.height()), "{name}");
        let (most, mean) = differences(texels_of(&ours), theirs.as_bytes());
        assert!(most <= 2 && mean < 0.05, "{name}: {most}, {mean}");
    }
}

/// Texels of noise and slopes, `channels` numbers each.
fn noise(width: u16, height: u16, channels: usize) -> Vec<u8> {
    let value = |i: usize| {
        let (texel, c) = (i / channels, i % channels);
        let (x, y) = (texel % usize::from(width), texel / usize::from(width));
        let hash = ((x / 2 * 7919 + y / 3 * 104_729 + c * 7) as u32).wrapping_mul(2_654_435_761) >> 24;
        if c == 0 { hash as u8 } else { (x * 5 + y * 3 * c) as u8 }
    };
    (0..usize::from(width) * usize::from(height) * channels).map(value).collect()
}

const FACTORS: [SamplingFactor; 6] = [
    SamplingFactor::F_1_1,
    SamplingFactor::F_2_1,
    SamplingFactor::F_1_2,
    SamplingFactor::F_2_2,
    SamplingFactor::F_4_1,
    SamplingFactor::F_4_2,
];

/// A file in every way that the encoder knows, with a name.
fn made(width: u16, height: u16) -> Vec<(String, Vec<u8>)> {
    let kinds = [(ColorType::Luma, 1), (ColorType::Rgb, 3), (ColorType::Cmyk, 4), (ColorType::CmykAsYcck, 4)];
    let mut files = Vec::new();
    for (kind, channels) in kinds {
        for factor in &FACTORS[..if channels == 4 { 4 } else { FACTORS.len() }] {
            for (progressive, restart) in [(false, 0), (false, 3), (true, 0)] {
                let mut bytes = Vec::new();
                let mut encoder = Encoder::new(&mut bytes, 80);
                encoder.set_sampling_factor(*factor);
                encoder.set_progressive(progressive);
                encoder.set_restart_interval(restart);
                encoder.encode(&noise(width, height, channels), width, height, kind).expect("encoded");
                let name = format!("{width} x {height}, {kind:?}, {factor:?}, {progressive}, {restart}");
                files.push((name, bytes));
            }
        }
    }
    files
}

fn by_rows(bytes: &[u8]) -> Result<Image, ImportError> {
    let start = rows(Box::new(Cursor::new(bytes.to_vec())), "test", &Limits::default());
    let Rows { mut image, mut next, .. } = start?;
    let mut texels = image.texels.none_like();
    (0..image.height).try_for_each(|_| next(&mut texels))?;
    image.texels = texels;
    Ok(image)
}

#[test]
fn rows_are_the_image_for_every_kind_and_size() {
    for (width, height) in [(1, 1), (2, 3), (8, 8), (17, 9), (33, 47)] {
        for (name, bytes) in made(width, height) {
            let whole = decoded(&bytes);
            assert_eq!((whole.width, whole.height), (u32::from(width), u32::from(height)), "{name}");
            assert!(by_rows(&bytes).expect("decodes") == whole, "{name}");
        }
    }
}

/// Scans, restarts and their order are how numbers are written, not what they are.
#[test]
fn progressive_and_restarted_files_have_the_texels_of_plain_ones() {
    for kinds in made(50, 41).chunks_exact(3) {
        let [plain, restarted, progressive] = [0, 1, 2].map(|i| decoded(&kinds[i].1));
        assert!(plain == restarted, "{}", kinds[1].0);
        assert!(plain == progressive, "{}", kinds[2].0);
    }
}

/// The decoder reads such files differently with and without restarts.
#[test]
fn inks_with_four_samples_for_one_are_refused() {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 80);
    encoder.set_sampling_factor(SamplingFactor::F_4_1);
    encoder.encode(&noise(50, 41, 4), 50, 41, ColorType::Cmyk).expect("encoded");
    let refused = decode_image(&bytes, "test", &Limits::default()).map(|_| ()).expect_err("refused");
    assert_eq!(refused.kind, ErrorKind::Unsupported);
}

/// What the encoder was given comes back, for colours that are inks too.
#[test]
fn colors_come_back() {
    let (width, height) = (40, 24);
    let slope = |channels: usize| -> Vec<u8> {
        let texel = |i: usize| (i / channels % 40 * 4 + i / channels / 40 * 3 + i % channels * 20) as u8;
        (0..width * height * channels).map(texel).collect()
    };
    for (kind, channels) in [(ColorType::Rgb, 3), (ColorType::Cmyk, 4), (ColorType::CmykAsYcck, 4)] {
        let (mut bytes, given) = (Vec::new(), slope(channels));
        let encoder = Encoder::new(&mut bytes, 95);
        encoder.encode(&given, width as u16, height as u16, kind).expect("encoded");
        let expected: Vec<u8> = match channels {
            3 => given,
            // The encoder takes 255 as all of an ink.
            _ => given
                .as_chunks::<4>()
                .0
                .iter()
                .flat_map(|&[c, m, y, k]| [c, m, y].map(|ink| left(ink, k)))
                .collect(),
        };
        let (most, mean) = differences(texels_of(&decoded(&bytes)), &expected);
        assert!(most <= 16 && mean < 2.0, "{kind:?}: {most}, {mean}");
    }
}

fn left(ink: u8, black: u8) -> u8 {
    let [ink, black] = [ink, black].map(|x| 1.0 - f64::from(x) / 255.0);
    (255.0 * ink * black).round() as u8
}

/// The negative control of the comparison with libjpeg: the nearest sample instead of its filter is seen.
#[test]
fn another_filter_would_be_seen() {
    let (_, jpeg, png) = sample!("420");
    let theirs = load_from_memory_with_format(png, ImageFormat::Png).expect("a PNG file");
    let (mut scanlines, image) =
        Scanlines::start(Cursor::new(jpeg), "test", &Limits::default()).expect("starts");
    scanlines.planes.iter_mut().for_each(Plane::take_nearest);
    let mut texels = Vec::new();
    (0..image.height).for_each(|_| scanlines.next(&mut texels, "test").expect("decodes"));
    let (most, mean) = differences(&texels, theirs.as_bytes());
    assert!(most > 2 && mean > 0.05, "{most}, {mean}");
}

#[test]
fn a_file_that_ends_early_is_one_clear_error() {
    for (name, jpeg, _) in SAMPLES {
        for cut in [jpeg.len() / 2, jpeg.len() * 3 / 4, jpeg.len() - 40, jpeg.len() - 2] {
            let error = decode_image(&jpeg[..cut], "test", &Limits::default()).expect_err(name);
            assert!(
                error.kind == ErrorKind::Malformed && error.what.contains("ends before"),
                "{name}: {error}"
            );
            assert_eq!(by_rows(&jpeg[..cut]).expect_err(name), error);
        }
    }
}

#[test]
fn the_header_says_what_rows_take() {
    let large = |progressive| {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, 50);
        encoder.set_sampling_factor(SamplingFactor::F_2_2);
        encoder.set_progressive(progressive);
        encoder.encode(&vec![90; 800 * 4000 * 3], 800, 4000, ColorType::Rgb).expect("encoded");
        bytes
    };
    let (plain, progressive) = (large(false), large(true));
    let whole = 800 * 4000 * 3;
    let size = |bytes: &[u8]| file(&bytes[..bytes.len().min(1500)]).size();
    assert_eq!(size(&plain).decoded_bytes, whole);
    assert!(size(&plain).working_bytes < 2 << 20);
    // One and a half numbers a texel, of two bytes, twice; 4000 is a multiple of 16.
    let numbers = 800 * 4000 * 3 / 2;
    assert_eq!(size(&progressive).working_bytes, 4 * numbers + size(&plain).working_bytes);
    let limits = Limits { decoded_bytes: 4 * numbers - 1, ..Limits::default() };
    let refused = decode_image(&progressive, "test", &limits).map(|_| ()).expect_err("too large");
    assert_eq!(refused.kind, ErrorKind::Limit);
    let refused = ImageFile { limits, ..file(&progressive) }.load(true).map(|_| ()).expect_err("too large");
    assert_eq!(refused.kind, ErrorKind::Limit);
    assert_eq!(size(&[]), ImageSize::default());
}
