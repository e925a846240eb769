//! JPEG row by row (ITU-T T.81): blocks by `zune-jpeg`, which gives the samples of each component a row of blocks at a time; how they
//! become texels is in [`upsample`] and [`color`].

mod color;
mod plane;
mod upsample;

#[cfg(test)]
mod tests;

use super::guarded;
use super::rows::{Bytes, Rows};
use crate::{ErrorKind, ImportError, Limits};
use color::Colors;
use plane::Plane;
use std::io::{BufRead, Cursor, Read, Seek};
use vastlight_scene::{Image, Texels};
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::options::DecoderOptions;
use zune_jpeg::{ImageInfo, JpegDecoder, RawImcuRowStatus};

/// Most components of an image that has colours.
const MOST_COMPONENTS: usize = 4;
/// Bytes of markers.
const MARKER: u8 = 0xff;
const SCAN: u8 = 0xda;
const END: u8 = 0xd9;

/// The whole image: its rows, one after the other.
pub(super) fn decode(bytes: &[u8], name: &str, limits: &Limits) -> Result<Image, ImportError> {
    guarded(name, || {
        let (mut scanlines, mut image) = Scanlines::start(Cursor::new(bytes), name, limits)?;
        let mut texels = Vec::new();
        let room = texels.try_reserve_exact(image.whole_bytes() as usize);
        room.map_err(|_| ImportError::limit("there is no memory for the texels", name))?;
        (0..image.height).try_for_each(|_| scanlines.next(&mut texels, name))?;
        image.texels = Texels::U8(texels);
        Ok(image)
    })
}

/// Starts with the first row.
pub(super) fn rows(bytes: Box<dyn Bytes>, name: &str, limits: &Limits) -> Result<Rows, ImportError> {
    let (mut scanlines, image) = Scanlines::start(bytes, name, limits)?;
    let held_bytes = scanlines.held_bytes;
    let working_bytes = held_bytes + row_bytes(&scanlines.planes);
    let name = name.to_owned();
    let next = move |out: &mut Texels| match out {
        Texels::U8(out) => guarded(&name, || scanlines.next(out, &name)),
        Texels::U16(_) | Texels::F32(_) => Ok(()),
    };
    Ok(Rows { image, working_bytes, held_bytes, next: Box::new(next) })
}

/// An image that is being decoded.
struct Scanlines<B> {
    decoder: JpegDecoder<B>,
    planes: Vec<Plane>,
    colors: Colors,
    width: usize,
    /// The next row.
    y: usize,
    /// Bytes of numbers that must all be there before the first row is.
    held_bytes: u64,
}

impl<B: BufRead + Seek> Scanlines<B> {
    /// Reads the header; the image has no texels.
    fn start(mut bytes: B, name: &str, limits: &Limits) -> Result<(Self, Image), ImportError> {
        let in_first_scan = components_of_first_scan(&mut bytes).map_err(|e| unreadable(&e, name))?;
        let most = usize::from(u16::MAX);
        let options = DecoderOptions::default().set_max_width(most).set_max_height(most);
        let mut decoder = JpegDecoder::new_with_options(bytes, options);
        decoder.decode_headers().map_err(|e| broken(&e, name))?;
        let (Some(info), Some(space)) = (decoder.info(), decoder.input_colorspace()) else {
            return Err(malformed("it has no header", name));
        };
        let Some(colors) = Colors::of(space) else {
            return Err(ImportError::unsupported(
                format!("colours of the kind {space:?} in a JPEG image"),
                name,
            ));
        };
        let image = described(&info, colors, name, limits)?;
        let planes = planes(&mut decoder, colors, name)?;
        // All components in one scan come row by row; else all numbers must be there before the first row is.
        let at_once = info.sof.is_sequential_dct() && in_first_scan == Some(planes.len());
        let held_bytes = if at_once { 0 } else { numbers_bytes(&planes) };
        limits.check_count(held_bytes, limits.decoded_bytes, "bytes", name)?;
        let width = image.width as usize;
        Ok((Self { decoder, planes, colors, width, y: 0, held_bytes }, image))
    }

    /// Adds the next row.
    fn next(&mut self, out: &mut Vec<u8>, name: &str) -> Result<(), ImportError> {
        while !self.planes.iter().all(|plane| plane.has(self.y)) {
            self.next_blocks(name)?;
        }
        let mut rows = [&[][..]; MOST_COMPONENTS];
        for (row, plane) in rows.iter_mut().zip(&mut self.planes) {
            *row = plane.texels(self.y, self.width);
        }
        self.colors.convert(&rows, self.width, out);
        self.y += 1;
        Ok(())
    }

    /// Reads the next row of blocks of each component.
    fn next_blocks(&mut self, name: &str) -> Result<(), ImportError> {
        let strides: Vec<usize> = self.planes.iter().map(Plane::width).collect();
        let mut rooms: Vec<&mut [u8]> = self.planes.iter_mut().map(|plane| plane.room(self.y)).collect();
        let read = self.decoder.raw_output().decode_next_imcu_row(&mut rooms, &strides);
        let written = match read.map_err(|e| broken(&e, name))? {
            RawImcuRowStatus::RowReady { rows_written } => rows_written,
            _ => return Err(truncated(name)),
        };
        if written.iter().all(|&rows| rows == 0) {
            return Err(truncated(name));
        }
        self.planes.iter_mut().zip(written).for_each(|(plane, rows)| plane.took(rows));
        Ok(())
    }
}

/// The image without texels.
fn described(info: &ImageInfo, colors: Colors, name: &str, limits: &Limits) -> Result<Image, ImportError> {
    let (width, height, channels) = (u32::from(info.width), u32::from(info.height), colors.channels());
    limits.check_image(u64::from(width), u64::from(height), u64::from(channels), name)?;
    Ok(Image { name: name.to_owned(), width, height, channels, texels: Texels::U8(Vec::new()) })
}

/// The components of an image whose header is read.
fn planes<B: BufRead + Seek>(
    decoder: &mut JpegDecoder<B>,
    colors: Colors,
    name: &str,
) -> Result<Vec<Plane>, ImportError> {
    let session = decoder.raw_output();
    let (count, layout) = (session.num_components().unwrap_or(0), session.layout().unwrap_or_default());
    let infos = layout.get(..count).filter(|infos| infos.len() == colors.components());
    let infos = infos.ok_or_else(|| malformed("its components are not those of its colours", name))?;
    let most = |factor: fn(&_) -> usize| infos.iter().map(factor).max().unwrap_or(1);
    let (across, down) = (most(|i| i.horizontal_sampling_factor), most(|i| i.vertical_sampling_factor));
    if infos.len() == MOST_COMPONENTS && across.max(down) > 2 {
        return Err(ImportError::unsupported(
            "inks of a JPEG image with more than twice the samples of others",
            name,
        ));
    }
    Ok(infos.iter().map(|info| Plane::new(*info, [across, down])).collect())
}

/// Bytes of all numbers of the image, and of those of the scan that is being read.
fn numbers_bytes(planes: &[Plane]) -> u64 {
    let samples: u64 = planes.iter().map(Plane::all_samples).sum();
    2 * samples * size_of::<i16>() as u64
}

/// Bytes of some rows of blocks, as numbers and as samples.
fn row_bytes(planes: &[Plane]) -> u64 {
    let samples: u64 = planes.iter().map(Plane::block_row_samples).sum();
    (1 << 20) + 8 * samples
}

/// How many components the first scan of a file has; none where that cannot be seen, which the decoder will report. Reads the file
/// from its start, and leaves it there.
fn components_of_first_scan(bytes: &mut (impl BufRead + Seek)) -> std::io::Result<Option<usize>> {
    bytes.rewind()?;
    let found = find_first_scan(bytes);
    bytes.rewind()?;
    match found {
        Err(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => Ok(None),
        found => found,
    }
}

fn find_first_scan(bytes: &mut (impl BufRead + Seek)) -> std::io::Result<Option<usize>> {
    let mut before = 0;
    loop {
        let [code] = read(bytes)?;
        let is_marker = std::mem::replace(&mut before, code) == MARKER;
        match code {
            _ if !is_marker => {}
            SCAN => return read(bytes).map(|[_, _, count]| Some(usize::from(count))),
            END => return Ok(None),
            // Markers without data, and what is no marker.
            0 | 1 | MARKER | 0xd0..=0xd8 => {}
            _ => {
                let length = u16::from_be_bytes(read(bytes)?);
                bytes.seek_relative(i64::from(length.saturating_sub(2)))?;
                before = 0;
            }
        }
    }
}

fn read<const N: usize>(bytes: &mut impl Read) -> std::io::Result<[u8; N]> {
    let mut read = [0; N];
    bytes.read_exact(&mut read).map(|()| read)
}

fn unreadable(error: &std::io::Error, name: &str) -> ImportError {
    ImportError::new(ErrorKind::Io, error.to_string(), name)
}

fn broken(error: &DecodeErrors, name: &str) -> ImportError {
    if error.is_recoverable_eof() { truncated(name) } else { malformed(&format!("{error:?}"), name) }
}

fn truncated(name: &str) -> ImportError {
    malformed("the file ends before the image does", name)
}

fn malformed(what: &str, name: &str) -> ImportError {
    ImportError::malformed(format!("the image cannot be decoded: {what}"), name)
}
