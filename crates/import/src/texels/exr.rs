//! OpenEXR: the first layer with colour (or luminance), any channel type, largest level, as linear floats.

use super::guarded;
use crate::{ImportError, Limits};
use ::exr::block::{self, UncompressedBlock, reader::ChunksReader};
use ::exr::meta::{attribute::SampleType, header::Header};
use half::f16;
use std::io::Cursor;
use vastlight_scene::{Image, Texels};

pub(super) fn decode(bytes: &[u8], name: &str, limits: &Limits) -> Result<Image, ImportError> {
    guarded(name, || decode_unguarded(bytes, name, limits))
}

/// Bytes of the texels, from the headers.
pub(super) fn decoded_bytes(bytes: &[u8], name: &str) -> Result<u64, ImportError> {
    guarded(name, || {
        let reader = block::read(Cursor::new(bytes), false).map_err(|e| broken(&e, name))?;
        let (layer, channels) = pick_layer(reader.headers(), name)?;
        let (width, height) = (reader.headers()[layer].layer_size.0, reader.headers()[layer].layer_size.1);
        Ok((width as u64).saturating_mul(height as u64).saturating_mul(4 * channels.len() as u64))
    })
}

fn broken(error: &::exr::error::Error, name: &str) -> ImportError {
    ImportError::malformed(format!("the image cannot be decoded: {error}"), name)
}

fn decode_unguarded(bytes: &[u8], name: &str, limits: &Limits) -> Result<Image, ImportError> {
    let reader = block::read(Cursor::new(bytes), false).map_err(|e| broken(&e, name))?;
    let (layer, channels) = pick_layer(reader.headers(), name)?;
    let mut target = Target::new(&reader.headers()[layer], layer, channels, name, limits)?;
    let chunks = reader.filter_chunks(false, |_, _, b| b.layer == layer && b.level.0 == 0 && b.level.1 == 0);
    let store = |_: &_, block: UncompressedBlock| {
        target.store(&block);
        Ok(())
    };
    let chunks = chunks.map_err(|e| broken(&e, name))?;
    chunks.decompress_parallel(false, store).map_err(|e| broken(&e, name))?;
    Ok(target.image)
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

/// The image that grows from decompressed blocks.
struct Target {
    image: Image,
    /// For each picked channel: where its samples start within a line of a block that is one texel wide, and its type.
    channels: Vec<(usize, SampleType)>,
    /// Bytes of one texel over all channels of the layer.
    texel_bytes: usize,
    layer: usize,
}

impl Target {
    fn new(
        header: &Header,
        layer: usize,
        picked: Vec<usize>,
        name: &str,
        limits: &Limits,
    ) -> Result<Self, ImportError> {
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
        let count = header.layer_size.0 * header.layer_size.1 * picked.len();
        let image = Image {
            name: name.to_owned(),
            width: width as u32,
            height: height as u32,
            channels: picked.len() as u8,
            texels: Texels::F32(vec![0.0; count]),
        };
        Ok(Self { image, channels, texel_bytes, layer })
    }

    /// Copies a block; what lies outside the image or is short is left out.
    fn store(&mut self, block: &UncompressedBlock) {
        let Texels::F32(texels) = &mut self.image.texels else { return };
        let (width, step) = (self.image.width as usize, self.channels.len());
        let (x, y) = (block.index.pixel_position.0, block.index.pixel_position.1);
        let block_width = block.index.pixel_size.0;
        let line_bytes = block_width * self.texel_bytes;
        if block.index.layer != self.layer || line_bytes == 0 || x + block_width > width {
            return;
        }
        for (row, line) in block.data.chunks_exact(line_bytes).enumerate() {
            let first = ((y + row) * width + x) * step;
            let Some(out) = texels.get_mut(first..first + block_width * step) else { return };
            for (c, &(start, kind)) in self.channels.iter().enumerate() {
                let samples = &line[start * block_width..];
                let samples = &samples[..block_width * kind.bytes_per_sample()];
                copy_samples(samples, kind, out.iter_mut().skip(c).step_by(step));
            }
        }
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
