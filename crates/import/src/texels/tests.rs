use super::*;
use ::exr::prelude::{self as ex, WritableImage};
use proptest::prelude::*;

fn decode(bytes: &[u8]) -> Result<Image, ImportError> {
    decode_image(bytes, "test", &Limits::default())
}

/// An image file of a format.
pub(super) fn encode(image: DynamicImage, format: ImageFormat) -> Vec<u8> {
    if format == ImageFormat::Jpeg {
        let (rgb, mut bytes) = (image.into_rgb8(), Vec::new());
        let encoder = jpeg_encoder::Encoder::new(&mut bytes, 90);
        let (width, height) = (rgb.width() as u16, rgb.height() as u16);
        encoder.encode(&rgb, width, height, jpeg_encoder::ColorType::Rgb).expect("encoded");
        return bytes;
    }
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("encoded");
    bytes.into_inner()
}

fn gradient() -> ::image::RgbaImage {
    ::image::RgbaImage::from_fn(5, 3, |x, y| ::image::Rgba([50 * x as u8, 80 * y as u8, 7, 255 - x as u8]))
}

#[test]
fn lossless_formats_keep_every_bit() {
    let image = gradient();
    for format in [ImageFormat::Png, ImageFormat::WebP] {
        let decoded = decode(&encode(image.clone().into(), format)).expect("well formed");
        assert_eq!((decoded.width, decoded.height, decoded.channels), (5, 3, 4));
        assert_eq!(decoded.texels, Texels::U8(image.as_raw().clone()));
    }
    let deep = ::image::ImageBuffer::from_fn(2, 2, |x, y| ::image::Luma([(x * 1000 + y * 7) as u16]));
    let decoded = decode(&encode(deep.clone().into(), ImageFormat::Png)).expect("well formed");
    assert_eq!((decoded.channels, decoded.texels), (1, Texels::U16(deep.into_raw())));
}

#[test]
fn jpeg_is_close() {
    let image = ::image::RgbImage::from_pixel(16, 8, ::image::Rgb([200, 100, 50]));
    let decoded = decode(&encode(image.into(), ImageFormat::Jpeg)).expect("well formed");
    let Texels::U8(texels) = decoded.texels else { panic!("8 bits") };
    assert!(texels.as_chunks::<3>().0.iter().all(|t| t[0].abs_diff(200) < 6 && t[2].abs_diff(50) < 6));
}

#[test]
fn radiance_is_close() {
    let image = ::image::Rgb32FImage::from_pixel(4, 2, ::image::Rgb([0.5, 12.0, 300.0]));
    let decoded = decode(&encode(image.into(), ImageFormat::Hdr)).expect("well formed");
    let Texels::F32(texels) = decoded.texels else { panic!("floats") };
    assert!((texels[2] - 300.0).abs() < 2.0 && (texels[1] - 12.0).abs() < 2.0);
}

/// An EXR file with some channels of any type.
fn exr_file(channels: Vec<(&str, ex::FlatSamples)>, encoding: ex::Encoding) -> Vec<u8> {
    let list = channels.into_iter().map(|(name, samples)| ex::AnyChannel::new(name, samples)).collect();
    let layer =
        ex::Layer::new((3, 2), ex::LayerAttributes::named("beauty"), encoding, ex::AnyChannels::sort(list));
    let mut bytes = Cursor::new(Vec::new());
    ex::Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("encoded");
    bytes.into_inner()
}

fn six(first: f32) -> Vec<f32> {
    (0..6).map(|i| first + i as f32).collect()
}

#[test]
fn exr_channels_of_every_type() {
    let half: Vec<half::f16> = six(10.0).into_iter().map(half::f16::from_f32).collect();
    let tiles = ex::Blocks::Tiles(ex::Vec2(2, 2));
    let encodings = [
        ex::Encoding::UNCOMPRESSED,
        ex::Encoding { compression: ex::Compression::PIZ, ..ex::Encoding::SMALL_LOSSLESS },
        ex::Encoding { blocks: tiles, ..ex::Encoding::SMALL_FAST_LOSSLESS },
    ];
    for encoding in encodings {
        let bytes = exr_file(
            vec![
                ("Z", ex::FlatSamples::F32(six(99.0))),
                ("R", ex::FlatSamples::F16(half.clone())),
                ("G", ex::FlatSamples::F32(six(20.0))),
                ("B", ex::FlatSamples::U32((30..36).collect())),
                ("A", ex::FlatSamples::F32(six(0.0))),
            ],
            encoding,
        );
        let image = decode(&bytes).expect("well formed");
        assert_eq!((image.width, image.height, image.channels), (3, 2, 4));
        let expected: Vec<f32> =
            (0..6_u8).flat_map(|i| [10.0, 20.0, 30.0, 0.0].map(|base: f32| base + f32::from(i))).collect();
        assert_eq!(image.texels, Texels::F32(expected));
    }
}

#[test]
fn exr_layers_in_channel_names_and_luminance() {
    let named = exr_file(
        vec![
            ("Depth.Z", ex::FlatSamples::F32(six(0.0))),
            ("View.Combined.R", ex::FlatSamples::F32(six(1.0))),
            ("View.Combined.G", ex::FlatSamples::F32(six(2.0))),
            ("View.Combined.B", ex::FlatSamples::F32(six(3.0))),
        ],
        ex::Encoding::UNCOMPRESSED,
    );
    let image = decode(&named).expect("well formed");
    let Texels::F32(texels) = image.texels else { panic!("floats") };
    assert_eq!((image.channels, &texels[..3]), (3, &[1.0, 2.0, 3.0][..]));
    let grey = exr_file(vec![("Y", ex::FlatSamples::F32(six(5.0)))], ex::Encoding::UNCOMPRESSED);
    assert_eq!(decode(&grey).expect("well formed").texels, Texels::F32(six(5.0)));
    let depth = exr_file(vec![("Z", ex::FlatSamples::F32(six(5.0)))], ex::Encoding::UNCOMPRESSED);
    assert_eq!(decode(&depth).expect_err("no colour").kind, ErrorKind::Unsupported);
}

/// A small file of each format.
fn samples() -> Vec<Vec<u8>> {
    let rgb = DynamicImage::from(gradient()).into_rgb8();
    let channel = |name, first| (name, ex::FlatSamples::F32(six(first)));
    vec![
        encode(gradient().into(), ImageFormat::Png),
        encode(gradient().into(), ImageFormat::WebP),
        encode(rgb.into(), ImageFormat::Jpeg),
        encode(::image::Rgb32FImage::new(9, 3).into(), ImageFormat::Hdr),
        exr_file(vec![channel("R", 0.0), channel("G", 1.0), channel("B", 2.0)], ex::Encoding::SMALL_LOSSLESS),
    ]
}

#[test]
fn truncations_never_panic() {
    for bytes in samples() {
        assert!(decode(&bytes).is_ok());
        (0..bytes.len()).for_each(|length| drop(decode(&bytes[..length])));
        assert!(decode(&bytes[..bytes.len() / 2]).is_err());
    }
}

#[test]
fn sizes_are_known_from_headers() {
    for bytes in samples() {
        let image = decode(&bytes).expect("well formed");
        let texel_bytes = match image.texels {
            Texels::U8(_) => 1,
            Texels::U16(_) => 2,
            Texels::F32(_) => 4,
        };
        let expected = u64::from(image.width * image.height) * u64::from(image.channels) * texel_bytes;
        let size = |bytes: &[u8]| {
            let bytes = ImageBytes::Part(bytes.to_vec().into());
            ImageFile { bytes, name: "test".into(), limits: Limits::default() }.size()
        };
        assert_eq!(size(&bytes).decoded_bytes, expected);
        assert_eq!(size(&bytes[..10]), ImageSize::default());
    }
}

#[test]
fn limits_are_checked_before_decoding() {
    let limits = Limits { image_side: 2, ..Limits::default() };
    for bytes in samples() {
        assert_eq!(decode_image(&bytes, "test", &limits).expect_err("too large").kind, ErrorKind::Limit);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]
    #[test]
    fn garbage_never_panics(
        at in any::<proptest::sample::Index>(),
        garbage in proptest::collection::vec(any::<u8>(), 1..6),
        which in 0_usize..5,
    ) {
        let mut bytes = samples().swap_remove(which);
        let first = at.index(bytes.len());
        for (byte, &new) in bytes[first..].iter_mut().zip(&garbage) {
            *byte = new;
        }
        let limits = Limits { decoded_bytes: 1 << 24, ..Limits::default() };
        let _ = decode_image(&bytes, "test", &limits);
    }
}
