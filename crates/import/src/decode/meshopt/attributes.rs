//! Attribute streams: blocks of elements, each byte of an element coded apart as differences to the element before.

use super::{Bytes, Fault};

const GROUP: usize = 16;
const BLOCK_BYTES: usize = 8192;
const BLOCK_ELEMENTS: usize = 256;

/// Widths in bits that a group's two-bit header chooses from.
const WIDTHS_V0: [u32; 4] = [0, 2, 4, 8];
const WIDTHS_V1: [[u32; 4]; 2] = [[0, 1, 2, 4], [1, 2, 4, 8]];

/// How the four bytes of a channel depend on the element before.
#[derive(Clone, Copy, Debug)]
enum Delta {
    Bytes,
    Shorts,
    /// Exclusive or of words, rotated left by some bits.
    Words(u32),
}

pub(super) fn decode(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, Fault> {
    if stride == 0 || stride > BLOCK_ELEMENTS || !stride.is_multiple_of(4) {
        return Err("the stride of attributes is not a multiple of 4 up to 256");
    }
    let mut stream = Bytes(bytes);
    let version = match stream.byte()? {
        0xa0 => 0,
        0xa1 => 1,
        _ => return Err("this is no attribute stream of a known version"),
    };
    let tail_bytes = stride + version * stride / 4;
    let padded = tail_bytes.max(if version == 0 { 32 } else { 24 });
    let body = stream.0.len().checked_sub(padded).ok_or("the stream is too short")?;
    let (body, tail) = stream.0.split_at(body);
    let tail = &tail[padded - tail_bytes..];
    let mut previous = tail[..stride].to_vec();
    let deltas: Vec<Delta> = match version {
        0 => vec![Delta::Bytes; stride / 4],
        _ => tail[stride..].iter().map(|&channel| delta(channel)).collect::<Result<_, _>>()?,
    };
    let block = ((BLOCK_BYTES / stride) & !(GROUP - 1)).min(BLOCK_ELEMENTS);
    let mut stream = Bytes(body);
    let mut elements = vec![0; plausible(count, stride, body.len())?];
    for out in elements.chunks_mut(block * stride) {
        decode_block(&mut stream, out, stride, &mut previous, version, &deltas)?;
    }
    if stream.0.is_empty() { Ok(elements) } else { Err("the stream is too long") }
}

/// The size of the result, unless the stream is too short for it: every 64 elements take a byte of headers at least
/// (a byte for 256 elements in version 1, where all of a byte's values may be zero).
fn plausible(count: usize, stride: usize, body_bytes: usize) -> Result<usize, Fault> {
    let least = count.div_ceil(BLOCK_ELEMENTS) * (stride / 4);
    if least > body_bytes { Err("the stream is too short") } else { Ok(count * stride) }
}

fn delta(channel: u8) -> Result<Delta, Fault> {
    match channel & 3 {
        0 => Ok(Delta::Bytes),
        1 => Ok(Delta::Shorts),
        2 => Ok(Delta::Words(u32::from(channel >> 4))),
        _ => Err("unknown kind of channel"),
    }
}

fn decode_block(
    stream: &mut Bytes<'_>,
    out: &mut [u8],
    stride: usize,
    previous: &mut [u8],
    version: usize,
    deltas: &[Delta],
) -> Result<(), Fault> {
    let count = out.len() / stride;
    let control = stream.take(version * stride / 4)?;
    let mut planes = [[0_u8; BLOCK_ELEMENTS]; 4];
    for (channel, &delta) in deltas.iter().enumerate() {
        for (j, plane) in planes.iter_mut().enumerate() {
            let choice = control.get(channel).map(|c| (c >> (2 * j)) & 3);
            match choice {
                None => groups(stream, plane, count, WIDTHS_V0)?,
                Some(2) => plane.fill(0),
                Some(3) => plane[..count].copy_from_slice(stream.take(count)?),
                Some(first) => groups(stream, plane, count, WIDTHS_V1[usize::from(first)])?,
            }
        }
        let lanes = &mut previous[channel * 4..channel * 4 + 4];
        let at = channel * 4;
        match delta {
            Delta::Bytes => add_bytes(&planes, lanes, out, at, stride),
            Delta::Shorts => add_shorts(&planes, lanes, out, at, stride),
            Delta::Words(rotation) => xor_words(&planes, lanes, out, at, stride, rotation),
        }
    }
    Ok(())
}

/// One byte of each of `count` elements, in groups of 16 with a width each.
fn groups(
    stream: &mut Bytes<'_>,
    plane: &mut [u8; BLOCK_ELEMENTS],
    count: usize,
    widths: [u32; 4],
) -> Result<(), Fault> {
    let group_count = count.div_ceil(GROUP);
    let header = stream.take(group_count.div_ceil(4))?;
    for (i, out) in plane.as_chunks_mut::<GROUP>().0.iter_mut().take(group_count).enumerate() {
        let choice = (header[i / 4] >> (2 * (i % 4))) & 3;
        match widths[usize::from(choice)] {
            0 => out.fill(0),
            8 => out.copy_from_slice(stream.take(GROUP)?),
            width => narrow_group(stream, out, width)?,
        }
    }
    Ok(())
}

/// Values of 1, 2 or 4 bits; the largest of them stands for a byte that follows the group.
fn narrow_group(stream: &mut Bytes<'_>, out: &mut [u8; GROUP], width: u32) -> Result<(), Fault> {
    let packed = stream.take(GROUP * width as usize / 8)?;
    let mask = (1_u8 << width) - 1;
    let per_byte = 8 / width as usize;
    for (i, value) in out.iter_mut().enumerate() {
        let byte = packed[i / per_byte];
        let place = (i % per_byte) as u32 * width;
        // Single bits start at the low end, wider values at the high one.
        let shift = if width == 1 { place } else { 8 - width - place };
        let coded = (byte >> shift) & mask;
        *value = if coded == mask { stream.byte()? } else { coded };
    }
    Ok(())
}

fn add_bytes(planes: &[[u8; BLOCK_ELEMENTS]; 4], lanes: &mut [u8], out: &mut [u8], at: usize, stride: usize) {
    for (i, element) in out.chunks_exact_mut(stride).enumerate() {
        for (j, lane) in lanes.iter_mut().enumerate() {
            let coded = planes[j][i];
            *lane = lane.wrapping_add((coded >> 1) ^ 0_u8.wrapping_sub(coded & 1));
            element[at + j] = *lane;
        }
    }
}

fn add_shorts(
    planes: &[[u8; BLOCK_ELEMENTS]; 4],
    lanes: &mut [u8],
    out: &mut [u8],
    at: usize,
    stride: usize,
) {
    for (i, element) in out.chunks_exact_mut(stride).enumerate() {
        for (j, lane) in lanes.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let coded = u16::from_le_bytes([planes[2 * j][i], planes[2 * j + 1][i]]);
            let difference = (coded >> 1) ^ 0_u16.wrapping_sub(coded & 1);
            *lane = u16::from_le_bytes(*lane).wrapping_add(difference).to_le_bytes();
            element[at + 2 * j..at + 2 * j + 2].copy_from_slice(lane);
        }
    }
}

fn xor_words(
    planes: &[[u8; BLOCK_ELEMENTS]; 4],
    lanes: &mut [u8],
    out: &mut [u8],
    at: usize,
    stride: usize,
    rotation: u32,
) {
    let Some(lane) = lanes.first_chunk_mut::<4>() else { return };
    for (i, element) in out.chunks_exact_mut(stride).enumerate() {
        let coded = u32::from_le_bytes([planes[0][i], planes[1][i], planes[2][i], planes[3][i]]);
        *lane = (u32::from_le_bytes(*lane) ^ coded.rotate_right(rotation)).to_le_bytes();
        element[at..at + 4].copy_from_slice(lane);
    }
}
