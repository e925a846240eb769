//! Image files row by row, so that an image may be larger than memory: PNG, JPEG and OpenEXR as they are decoded; other formats, and
//! interlaced PNG, are decoded whole when their first row is asked for.

use super::{decode_image, exr, format_of, guarded, header_bytes, jpeg, png};
use crate::blob::{Blob, open_within};
use crate::{ErrorKind, ImportError, Limits};
use ::image::ImageFormat;
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::PathBuf;
use vastlight_scene::{Image, ImageRows, NextRow, SceneDesc, SceneError, Texels};

/// Images with more decoded bytes are worth decoding twice: once to find what is wrong, once to use them.
const WORTH_ROWS: u64 = 1 << 20;

/// Bytes from which a format is known, and whether a PNG is interlaced.
const FIRST_BYTES: u64 = 32;

/// What becomes of large images: decoded with their scene, or row by row when they are needed.
#[derive(Debug)]
pub(crate) struct Deferral {
    from_bytes: u64,
    /// The images whose rows come later, by their number in the scene.
    pub(crate) rows: Vec<ImageRows>,
}

impl Deferral {
    /// All images are decoded with their scene.
    pub(crate) fn never() -> Self {
        Self { from_bytes: u64::MAX, rows: Vec::new() }
    }

    /// Large images come row by row.
    pub(crate) fn of_large() -> Self {
        Self { from_bytes: WORTH_ROWS, rows: Vec::new() }
    }

    /// Adds an image to a scene; its number there.
    pub(crate) fn add(&mut self, (image, later): Loaded, desc: &mut SceneDesc) -> u32 {
        let number = desc.images.len() as u32;
        desc.images.push(image);
        self.rows.extend(later.map(|(file, working_bytes)| file.into_image_rows(number, working_bytes)));
        number
    }

    /// What those of images of these sizes that come by rows take while each thread decodes one of them.
    pub(crate) fn working_bytes(&self, sizes: &[ImageSize]) -> u64 {
        let by_rows = sizes.iter().filter(|size| size.decoded_bytes > self.from_bytes);
        let mut working: Vec<u64> = by_rows.map(|size| size.working_bytes).collect();
        working.sort_unstable();
        let largest = working.iter().rev().take(rayon::current_num_threads());
        largest.fold(0, |sum: u64, &bytes| sum.saturating_add(bytes))
    }

    /// Which images of these sizes come row by row, but for those that must be `whole`.
    ///
    /// # Errors
    /// The others are beyond the limits all together, with those that are decoded on their way.
    pub(crate) fn plan(
        &self,
        sizes: &[ImageSize],
        whole: impl Fn(usize) -> bool,
        limits: &Limits,
        place: &str,
    ) -> Result<Vec<bool>, ImportError> {
        let later = |(i, size): (usize, &ImageSize)| size.decoded_bytes > self.from_bytes && !whole(i);
        let later: Vec<bool> = sizes.iter().enumerate().map(later).collect();
        let total = at_once_bytes(sizes, &later).saturating_add(self.working_bytes(sizes));
        limits.check_all_images(total, place).map(|()| later)
    }
}

/// Bytes of the images of these sizes that do not come `later`.
pub(crate) fn at_once_bytes(sizes: &[ImageSize], later: &[bool]) -> u64 {
    let at_once = sizes.iter().zip(later).filter(|(_, later)| !**later);
    at_once.fold(0, |sum: u64, (size, _)| sum.saturating_add(size.decoded_bytes))
}

/// Bytes that can be read from anywhere.
pub(super) trait Bytes: BufRead + Seek + Send {}
impl<T: BufRead + Seek + Send> Bytes for T {}

/// How large an image is, as its header says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ImageSize {
    /// Of all texels.
    pub(crate) decoded_bytes: u64,
    /// In memory while rows come.
    pub(crate) working_bytes: u64,
}

/// Where the bytes of an image file are.
#[derive(Clone, Debug)]
pub(crate) enum ImageBytes {
    /// In a file.
    File(PathBuf),
    /// In a part of one, or in memory.
    Part(Blob),
}

/// An image without texels, and its file with the bytes that its rows take, if they come later.
pub(crate) type Loaded = (Image, Option<(ImageFile, u64)>);

/// An image file that is decoded row by row.
#[derive(Clone, Debug)]
pub(crate) struct ImageFile {
    pub(crate) bytes: ImageBytes,
    /// Goes into the image and into messages.
    pub(crate) name: String,
    pub(crate) limits: Limits,
}

/// Adds the texels of the next row to what it is given.
type NextTexels = Box<dyn FnMut(&mut Texels) -> Result<(), ImportError> + Send>;

/// An image that is being decoded.
pub(super) struct Rows {
    /// All but its texels.
    pub(super) image: Image,
    /// Bytes that are in memory meanwhile.
    pub(super) working_bytes: u64,
    /// Of these, what waits for what comes later in the file.
    pub(super) held_bytes: u64,
    /// Adds the texels of the next row.
    pub(super) next: NextTexels,
}

impl ImageFile {
    /// The image without texels, and the bytes that its rows take while they come. All of it is decoded once, so that what is wrong
    /// with it is found now.
    ///
    /// # Errors
    /// Those of [`decode_image`].
    fn check(&self) -> Result<(Image, u64), ImportError> {
        let mut rows = self.rows()?;
        let mut row = rows.image.texels.none_like();
        for _ in 0..rows.image.height {
            row.clear();
            (rows.next)(&mut row)?;
        }
        Ok((rows.image, rows.working_bytes))
    }

    /// The rows of the image number `image` of a scene, which take so many bytes while they come.
    fn into_image_rows(self, image: u32, working_bytes: u64) -> ImageRows {
        let open = move || -> Result<NextRow, SceneError> {
            let mut rows = self.rows()?;
            Ok(Box::new(move |out| Ok((rows.next)(out)?)))
        };
        ImageRows { image, working_bytes, open: Box::new(open) }
    }

    /// The image, whole or to come by rows.
    ///
    /// # Errors
    /// Those of [`decode_image`].
    pub(crate) fn load(self, by_rows: bool) -> Result<Loaded, ImportError> {
        if !by_rows {
            return Ok((self.decode()?, None));
        }
        let (image, working_bytes) = self.check()?;
        Ok((image, Some((self, working_bytes))))
    }

    /// The whole image.
    ///
    /// # Errors
    /// Those of [`decode_image`].
    fn decode(&self) -> Result<Image, ImportError> {
        decode_image(&self.all()?, &self.name, &self.limits)
    }

    /// How large the image is, from the header alone; nothing where that says nothing, which decoding will report.
    pub(crate) fn size(&self) -> ImageSize {
        self.known_size().unwrap_or_default()
    }

    fn known_size(&self) -> Result<ImageSize, ImportError> {
        let first = self.first_bytes()?;
        if let Some(Rows { image, working_bytes, .. }) = self.by_rows(&first)? {
            return Ok(ImageSize { decoded_bytes: image.whole_bytes(), working_bytes });
        }
        let decoded_bytes = header_bytes(&first, || self.open(), &self.name)?;
        Ok(ImageSize { decoded_bytes, working_bytes: decoded_bytes })
    }

    /// The first bytes of the file.
    ///
    /// # Errors
    /// It cannot be read.
    pub(crate) fn first_bytes(&self) -> Result<Vec<u8>, ImportError> {
        let mut first = Vec::new();
        self.open()?.take(FIRST_BYTES).read_to_end(&mut first).map_err(|e| self.unreadable(&e))?;
        Ok(first)
    }

    fn open(&self) -> Result<Box<dyn Bytes>, ImportError> {
        match &self.bytes {
            ImageBytes::File(path) => {
                let (file, _) = open_within(path, &self.limits)?;
                Ok(Box::new(BufReader::with_capacity(1 << 16, file)))
            }
            ImageBytes::Part(part) => Ok(Box::new(part.reader())),
        }
    }

    fn all(&self) -> Result<Vec<u8>, ImportError> {
        let mut all = Vec::new();
        self.open()?.read_to_end(&mut all).map_err(|e| self.unreadable(&e))?;
        Ok(all)
    }

    fn unreadable(&self, error: &std::io::Error) -> ImportError {
        ImportError::new(ErrorKind::Io, error.to_string(), &self.name)
    }

    fn rows(&self) -> Result<Rows, ImportError> {
        let Some(rows) = self.by_rows(&self.first_bytes()?)? else { return self.decode().map(whole) };
        self.limits.check_count(rows.held_bytes, self.limits.decoded_bytes, "bytes", &self.name)?;
        Ok(rows)
    }

    /// The rows of a format whose decoder gives them, as the first bytes say; none of another one.
    fn by_rows(&self, first: &[u8]) -> Result<Option<Rows>, ImportError> {
        let name = &self.name;
        // A row at a time, only the sides are limited.
        let limits = Limits { decoded_bytes: u64::MAX, ..self.limits };
        let start = match format_of(first, name) {
            Ok(ImageFormat::Png) if !png::is_interlaced(first) => png::rows,
            Ok(ImageFormat::OpenExr) => exr::rows,
            Ok(ImageFormat::Jpeg) => jpeg::rows,
            _ => return Ok(None),
        };
        let bytes = self.open()?;
        guarded(name, || start(bytes, name, &limits)).map(Some)
    }
}

/// The rows of an image that is decoded.
fn whole(mut image: Image) -> Rows {
    let none = image.texels.none_like();
    let texels = std::mem::replace(&mut image.texels, none);
    let row = image.width as usize * usize::from(image.channels);
    let mut first = 0;
    let next = move |out: &mut Texels| {
        out.append(&texels, first..first + row);
        first += row;
        Ok(())
    };
    Rows { working_bytes: image.whole_bytes(), held_bytes: 0, image, next: Box::new(next) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::{self as ex, WritableImage};
    use ::image::{DynamicImage, ImageBuffer};
    use std::io::Cursor;

    fn file(bytes: &[u8]) -> ImageFile {
        let bytes = ImageBytes::Part(bytes.to_vec().into());
        ImageFile { bytes, name: "test".into(), limits: Limits::default() }
    }

    /// The image of its rows.
    fn by_rows(file: &ImageFile) -> Result<Image, ImportError> {
        let Rows { mut image, mut next, .. } = file.rows()?;
        let mut texels = image.texels.none_like();
        (0..image.height).try_for_each(|_| next(&mut texels))?;
        image.texels = texels;
        Ok(image)
    }

    fn check(bytes: &[u8], what: &str) -> bool {
        let (whole, rows) = (decode_image(bytes, "test", &Limits::default()), by_rows(&file(bytes)));
        let kinds = |a: &ImportError, b: &ImportError| (a.kind, &a.what) == (b.kind, &b.what);
        match (&whole, &rows) {
            (Ok(a), Ok(b)) => assert!(a == b, "{what}: other texels"),
            (Err(a), Err(b)) => assert!(kinds(a, b), "{what}: {a} | {b}"),
            _ => panic!("{what}: {:?} | {:?}", whole.err(), rows.err()),
        }
        assert_eq!(file(bytes).check().err(), rows.err(), "{what}");
        whole.is_ok()
    }

    fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        super::super::tests::encode(image.clone(), format)
    }

    fn pictures() -> Vec<(Vec<u8>, &'static str)> {
        let noise = |x: u32, y: u32| (x * 7919 + y * 104_729).wrapping_mul(2_654_435_761) >> 16;
        let rgb = ImageBuffer::from_fn(37, 23, |x, y| ::image::Rgb([noise(x, y) as u8, x as u8, y as u8]));
        let rgb: DynamicImage = rgb.into();
        let deep = ImageBuffer::from_fn(9, 31, |x, y| ::image::LumaA([noise(x, y) as u16, 500 * x as u16]));
        let deep: DynamicImage = deep.into();
        let png = |image| (encoded(image, ImageFormat::Png), "png");
        let grey = rgb.to_luma8().into();
        vec![
            png(&rgb),
            png(&rgb.to_rgba8().into()),
            png(&deep),
            png(&grey),
            (encoded(&rgb, ImageFormat::Jpeg), "jpeg"),
            (encoded(&rgb, ImageFormat::WebP), "webp"),
            (encoded(&rgb.to_rgb32f().into(), ImageFormat::Hdr), "hdr"),
        ]
    }

    /// An EXR file of 21 x 13 texels with blocks in some order.
    fn exr(blocks: ex::Blocks, line_order: ex::LineOrder) -> Vec<u8> {
        let values = |first: u32| (0..273).map(|i| (first + i) as f32 * 0.5).collect();
        let channel = |(name, first)| ex::AnyChannel::new(name, ex::FlatSamples::F32(values(first)));
        let list = [("R", 0), ("G", 1000), ("B", 7)].into_iter().map(channel).collect();
        let encoding = ex::Encoding { blocks, line_order, ..ex::Encoding::SMALL_LOSSLESS };
        let attributes = ex::LayerAttributes::named("beauty");
        let layer = ex::Layer::new((21, 13), attributes, encoding, ex::AnyChannels::sort(list));
        let mut bytes = Cursor::new(Vec::new());
        ex::Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).expect("encoded");
        bytes.into_inner()
    }

    #[test]
    fn rows_are_the_image_and_errors_are_the_same() {
        let tiles = ex::Blocks::Tiles(ex::Vec2(4, 5));
        let (up, down) = (ex::LineOrder::Increasing, ex::LineOrder::Decreasing);
        let lines = ex::Blocks::ScanLines;
        let exr = [(lines, up), (lines, down), (tiles, up)].map(|(b, order)| (exr(b, order), "exr"));
        for (bytes, what) in pictures().into_iter().chain(exr) {
            assert!(check(&bytes, what));
            for cut in (0..bytes.len()).step_by(bytes.len() / 50 + 1) {
                check(&bytes[..cut], &format!("{what} cut at {cut}"));
            }
            for place in (0..bytes.len()).step_by(bytes.len() / 97 + 1) {
                let mut broken = bytes.clone();
                broken[place] ^= 1 << (place % 8);
                check(&broken, &format!("{what} broken at {place}"));
            }
        }
    }

    #[test]
    fn a_file_that_is_gone_is_an_error_and_sides_are_limited() {
        let gone = ImageFile { bytes: ImageBytes::File("/nonexistent.png".into()), ..file(&[]) };
        assert_eq!(gone.check().expect_err("gone").kind, ErrorKind::Io);
        let bytes = encoded(&DynamicImage::new_rgb8(40, 3), ImageFormat::Png);
        let limits = Limits { image_side: 39, decoded_bytes: 40 * 3 * 3, ..Limits::default() };
        let narrow = ImageFile { limits, ..file(&bytes) };
        assert_eq!(narrow.check().expect_err("too wide").kind, ErrorKind::Limit);
        let limits = Limits { image_side: 40, ..limits };
        assert_eq!(ImageFile { limits, ..narrow }.check().expect("rows").0.width, 40);
    }

    #[test]
    fn rows_that_wait_for_others_are_limited() {
        let bytes = exr(ex::Blocks::ScanLines, ex::LineOrder::Decreasing);
        let check = |decoded_bytes| {
            let limits = Limits { decoded_bytes, ..Limits::default() };
            ImageFile { limits, ..file(&bytes) }.check()
        };
        let whole = 21 * 13 * 3 * 4;
        assert_eq!(check(whole - 1).expect_err("all of them wait").kind, ErrorKind::Limit);
        assert!(check(whole).is_ok());
    }

    #[test]
    fn what_comes_later_counts_as_far_as_it_is_in_memory() {
        let size = |decoded_bytes, working_bytes| ImageSize { decoded_bytes, working_bytes };
        let sizes = [size(10, 10), size(4 << 20, 1000), size(8 << 20, 2000), size(4 << 20, 4 << 20)];
        let plan = |deferral: &Deferral, whole: usize, most: u64| {
            let limits = Limits { all_images_bytes: most, ..Limits::default() };
            deferral.plan(&sizes, |i| i == whole, &limits, "test").ok()
        };
        let at_once: u64 = [4 << 20, 2000, 1000].into_iter().take(rayon::current_num_threads()).sum();
        let (never, later) = (Deferral::never(), Deferral::of_large());
        assert_eq!(plan(&never, 9, 10 + (16 << 20)), Some(vec![false; 4]));
        assert_eq!(plan(&never, 9, 9 + (16 << 20)), None);
        let most = 10 + at_once;
        assert_eq!(plan(&later, 9, most), Some(vec![false, true, true, true]));
        assert_eq!(plan(&later, 9, most - 1), None);
        assert_eq!(plan(&later, 1, most + (4 << 20)), Some(vec![false, false, true, true]));
    }
}
