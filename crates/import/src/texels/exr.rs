//! OpenEXR: the first layer with colour (or luminance), any channel type, largest level, as linear floats.

use super::guarded;
use super::rows::{Bytes, Rows};
use crate::{ImportError, Limits};
use ::exr::block::{self, UncompressedBlock, reader::ChunksReader};
use ::exr::meta::BlockDescription;
use ::exr::meta::attribute::{LineOrder, SampleType};
use ::exr::meta::header::Header;
use half::f16;
use std::collections::BTreeMap;
use std::io::Cursor;
use vastlight_scene::{Image, Texels};

pub(super) fn decode(bytes: &[u8], name: &str, limits: &Limits) -> Result<Image, ImportError> {
    guarded(name, || decode_unguarded(bytes, name, limits))
}

fn broken(error: &::exr::error::Error, name: &str) -> ImportError {
    ImportError::malformed(format!("the image cannot be decoded: {error}"), name)
}

fn decode_unguarded(bytes: &[u8], name: &str, limits: &Limits) -> Result<Image, ImportError> {
    let reader = block::read(Cursor::new(bytes), false).map_err(|e| broken(&e, name))?;
    let (layer, channels) = pick_layer(reader.headers(), name)?;
    let (picked, image) = Picked::new(&reader.headers()[layer], layer, channels, name, limits)?;
    let row = image.width as usize * usize::from(image.channels);
    let mut texels = vec![0.0; row * image.height as usize];
    let chunks = reader.filter_chunks(false, |_, _, b| b.layer == layer && b.level.0 == 0 && b.level.1 == 0);
    let store = |_: &_, block: UncompressedBlock| {
        for Line { y, first, values } in picked.lines(&block) {
            let out = texels.get_mut(y * row + first..y * row + first + values.len());
            out.into_iter().for_each(|out| out.copy_from_slice(&values));
        }
        Ok(())
    };
    let chunks = chunks.map_err(|e| broken(&e, name))?;
    chunks.decompress_parallel(false, store).map_err(|e| broken(&e, name))?;
    Ok(Image { texels: Texels::F32(texels), ..image })
}

/// Starts with the first row. Rows wait while those above them have not come: a few where the file has them in order.
pub(super) fn rows(bytes: Box<dyn Bytes>, name: &str, limits: &Limits) -> Result<Rows, ImportError> {
    let reader = block::read(bytes, false).map_err(|e| broken(&e, name))?;
    let (layer, channels) = pick_layer(reader.headers(), name)?;
    let (picked, image) = Picked::new(&reader.headers()[layer], layer, channels, name, limits)?;
    let working_bytes = working_bytes(&reader.headers()[layer], &image);
    let chunks = reader.filter_chunks(false, |_, _, b| b.layer == layer && b.level.0 == 0 && b.level.1 == 0);
    let mut blocks = chunks.map_err(|e| broken(&e, name))?.sequential_decompressor(false);
    let row = image.width as usize * usize::from(image.channels);
    let most_waiting = working_bytes / image.row_bytes().max(1);
    let (mut waiting, mut y, name) = (BTreeMap::<usize, Partial>::new(), 0, name.to_owned());
    let next = move |out: &mut Texels| {
        while waiting.get(&y).is_none_or(|partial| partial.missing > 0) {
            let Some(block) = guarded(&name, || blocks.next().transpose().map_err(|e| broken(&e, &name)))?
            else {
                break;
            };
            for line in picked.lines(&block) {
                waiting.entry(line.y).or_insert_with(|| Partial::new(row)).add(&line);
            }
            if waiting.len() as u64 > most_waiting {
                return Err(ImportError::malformed("its rows are not in the order that it says", &name));
            }
        }
        let complete = waiting.remove(&y).unwrap_or_else(|| Partial::new(row));
        y += 1;
        out.append(&Texels::F32(complete.values), 0..row);
        Ok(())
    };
    // At most all rows wait for others.
    let held_bytes = working_bytes.min(image.whole_bytes());
    Ok(Rows { image, working_bytes, held_bytes, next: Box::new(next) })
}

/// Bytes of the rows that wait, which are those of a row of blocks where the file has them in order, and of a block.
fn working_bytes(header: &Header, image: &Image) -> u64 {
    let rows = match header.blocks {
        _ if header.line_order != LineOrder::Increasing => return 2 * image.whole_bytes(),
        BlockDescription::ScanLines => header.compression.scan_lines_per_block() as u64,
        BlockDescription::Tiles(tiles) => tiles.tile_size.1 as u64,
    };
    (1 << 20) + 3 * rows * image.row_bytes()
}

/// A row of which parts have come.
struct Partial {
    values: Vec<f32>,
    /// How many have not.
    missing: usize,
}

impl Partial {
    fn new(row: usize) -> Self {
        Self { values: vec![0.0; row], missing: row }
    }

    fn add(&mut self, line: &Line) {
        let Some(out) = self.values.get_mut(line.first..line.first + line.values.len()) else { return };
        out.copy_from_slice(&line.values);
        self.missing = self.missing.saturating_sub(line.values.len());
    }
}

/// The layer that is read, with the numbers of its channels.
fn pick_layer(headers: &[Header], name: &str) -> Result<(usize, Vec<usize>), ImportError> {
    let found = headers.iter().enumerate().find_map(|(i, header)| Some((i, pick_channels(header)?)));
    found.ok_or_else(|| ImportError::unsupported("the image has no colour or luminance channel", name))
}

/// Numbers of the channels that become R, G, B, (A) or luminance, (A).
fn pick_channels(header: &Header) -> Option<Vec<usize>> {
    let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    let find = |prefix: &str, letter: &str| names.iter().position(|n| *n == format!("{prefix}{letter}"));
    let with_alpha = |prefix: &str, mut found: Vec<usize>| {
        found.extend(find(prefix, "A"));
        found
    };
    let prefixes = || {
        let named = names.iter().filter_map(|n| n.rfind('.').map(|dot| &n[..=dot]));
        std::iter::once("").chain(named)
    };
    let color = |p: &str| Some(with_alpha(p, vec![find(p, "R")?, find(p, "G")?, find(p, "B")?]));
    let grey = |p: &str| Some(with_alpha(p, vec![find(p, "Y")?]));
    prefixes().find_map(color).or_else(|| prefixes().find_map(grey))
}

/// What of the blocks of a layer becomes texels.
struct Picked {
    width: usize,
    /// For each picked channel: where its samples start within a line of a block that is one texel wide, and its type.
    channels: Vec<(usize, SampleType)>,
    /// Bytes of one texel over all channels of the layer.
    texel_bytes: usize,
    layer: usize,
}

/// A part of a row.
struct Line {
    y: usize,
    /// Its first number in the row.
    first: usize,
    values: Vec<f32>,
}

impl Picked {
    /// What is picked of a layer, and the image without texels that it becomes.
    fn new(
        header: &Header,
        layer: usize,
        picked: Vec<usize>,
        name: &str,
        limits: &Limits,
    ) -> Result<(Self, Image), ImportError> {
        if header.deep {
            return Err(ImportError::unsupported("deep images are not supported", name));
        }
        let list = &header.channels.list;
        if list.iter().any(|c| c.sampling.0 != 1 || c.sampling.1 != 1) {
            return Err(ImportError::unsupported("subsampled channels are not supported", name));
        }
        let (width, height) = (header.layer_size.0 as u64, header.layer_size.1 as u64);
        let texel_bytes: usize = list.iter().map(|c| c.sample_type.bytes_per_sample()).sum();
        limits.check_image(width, height, 4 * picked.len() as u64, name)?;
        let start_of =
            |channel: usize| list[..channel].iter().map(|c| c.sample_type.bytes_per_sample()).sum();
        let channels = picked.iter().map(|&c| (start_of(c), list[c].sample_type)).collect();
        let image = Image {
            name: name.to_owned(),
            width: width as u32,
            height: height as u32,
            channels: picked.len() as u8,
            texels: Texels::F32(Vec::new()),
        };
        Ok((Self { width: width as usize, channels, texel_bytes, layer }, image))
    }

    /// The picked numbers of a block by rows; what lies beside the image is left out.
    fn lines<'b>(&'b self, block: &'b UncompressedBlock) -> impl Iterator<Item = Line> + 'b {
        let step = self.channels.len();
        let (x, y) = (block.index.pixel_position.0, block.index.pixel_position.1);
        let width = block.index.pixel_size.0;
        let line_bytes = width * self.texel_bytes;
        let fits = block.index.layer == self.layer && line_bytes > 0 && x + width <= self.width;
        let lines = block.data.chunks_exact(line_bytes.max(1)).enumerate().filter(move |_| fits);
        lines.map(move |(row, line)| {
            let mut values = vec![0.0; width * step];
            for (c, &(start, kind)) in self.channels.iter().enumerate() {
                let samples = &line[start * width..];
                let samples = &samples[..width * kind.bytes_per_sample()];
                copy_samples(samples, kind, values.iter_mut().skip(c).step_by(step));
            }
            Line { y: y + row, first: x * step, values }
        })
    }
}

fn copy_samples<'a>(bytes: &[u8], kind: SampleType, out: impl Iterator<Item = &'a mut f32>) {
    let words = || bytes.as_chunks::<4>().0;
    match kind {
        SampleType::F16 => {
            let halves = bytes.as_chunks::<2>().0;
            out.zip(halves).for_each(|(o, &b)| *o = f16::from_ne_bytes(b).to_f32());
        }
        SampleType::F32 => out.zip(words()).for_each(|(o, &b)| *o = f32::from_ne_bytes(b)),
        SampleType::U32 => out.zip(words()).for_each(|(o, &b)| *o = u32::from_ne_bytes(b) as f32),
    }
}
