//! The body of a binary PLY, in either byte order.

use super::Stopped;
use super::header::{ByteOrder, Element, Kind, Property};
use super::vertices::{Lane, Slot, Vertices};
use crate::ImportError;
use crate::scan::Source;
use std::io::Read;
use vastlight_scene::MeshSink;

/// Bytes of vertices that are read at a time.
const BLOCK_BYTES: usize = 1 << 17;

pub(super) fn read_vertices<R: Read>(
    source: &mut Source<R>,
    element: &Element,
    order: ByteOrder,
    vertices: &mut Vertices,
    sink: &mut dyn MeshSink,
) -> Result<(), Stopped> {
    let Some(columns) = fixed_columns(element, vertices) else {
        return Err(source.byte_error("lists as properties of vertices are not supported").into());
    };
    let stride: usize = element.properties.iter().map(scalar_bytes).sum();
    let block_rows = (BLOCK_BYTES / stride.max(1)).max(1) as u64;
    let mut done = 0;
    while done < element.count {
        let rows = block_rows.min(element.count - done) as usize;
        let Some(bytes) = source.take(rows * stride)? else { return Err(ended(source, element).into()) };
        vertices.grow(rows);
        for &(offset, kind, slot) in &columns {
            fill(bytes, stride, offset, kind, order, vertices.lane(slot, 0));
        }
        sink.vertices(&vertices.take())?;
        done += rows as u64;
    }
    Ok(())
}

/// Byte offset, type and destination of each wanted property; `None` if a list makes rows of different length.
fn fixed_columns(element: &Element, vertices: &Vertices) -> Option<Vec<(usize, Kind, Slot)>> {
    let (mut columns, mut offset) = (Vec::new(), 0);
    for (property, slot) in element.properties.iter().zip(&vertices.slots) {
        let Property::Scalar { kind, .. } = property else { return None };
        columns.extend(slot.map(|slot| (offset, *kind, slot)));
        offset += kind.bytes();
    }
    Some(columns)
}

fn scalar_bytes(property: &Property) -> usize {
    match property {
        Property::Scalar { kind, .. } => kind.bytes(),
        Property::List { .. } => 0,
    }
}

/// Converts one column of a block of rows.
fn fill(rows: &[u8], stride: usize, offset: usize, kind: Kind, order: ByteOrder, lane: Lane<'_>) {
    match (kind, order) {
        (Kind::F32, ByteOrder::Little) => copy(rows, stride, offset, lane, f32::from_le_bytes),
        (Kind::F32, ByteOrder::Big) => copy(rows, stride, offset, lane, f32::from_be_bytes),
        (Kind::F64, ByteOrder::Little) => copy(rows, stride, offset, lane, |b| f64::from_le_bytes(b) as f32),
        (Kind::F64, ByteOrder::Big) => copy(rows, stride, offset, lane, |b| f64::from_be_bytes(b) as f32),
        (Kind::U8, _) => copy(rows, stride, offset, lane, |[b]: [u8; 1]| f32::from(b)),
        _ => {
            let size = kind.bytes();
            let outputs = lane.values.iter_mut().skip(lane.offset).step_by(lane.step);
            for (row, out) in rows.chunks_exact(stride).zip(outputs) {
                *out = integer(&row[offset..offset + size], kind, order) as f32;
            }
        }
    }
}

fn copy<const N: usize>(
    rows: &[u8],
    stride: usize,
    offset: usize,
    lane: Lane<'_>,
    convert: impl Fn([u8; N]) -> f32,
) {
    let outputs = lane.values.iter_mut().skip(lane.offset).step_by(lane.step);
    for (row, out) in rows.chunks_exact(stride).zip(outputs) {
        if let Some(bytes) = row[offset..].first_chunk::<N>() {
            *out = convert(*bytes);
        }
    }
}

/// One number as an integer; floats are cut.
fn integer(bytes: &[u8], kind: Kind, order: ByteOrder) -> i64 {
    let mut b = [0_u8; 8];
    match order {
        ByteOrder::Little => b[..bytes.len()].copy_from_slice(bytes),
        ByteOrder::Big => b.iter_mut().zip(bytes.iter().rev()).for_each(|(out, &byte)| *out = byte),
    }
    let [b0, b1, b2, b3, ..] = b;
    match kind {
        Kind::I8 => i64::from(b0 as i8),
        Kind::U8 => i64::from(b0),
        Kind::I16 => i64::from(i16::from_le_bytes([b0, b1])),
        Kind::U16 => i64::from(u16::from_le_bytes([b0, b1])),
        Kind::I32 => i64::from(i32::from_le_bytes([b0, b1, b2, b3])),
        Kind::U32 => i64::from(u32::from_le_bytes([b0, b1, b2, b3])),
        Kind::F32 => f32::from_le_bytes([b0, b1, b2, b3]) as i64,
        Kind::F64 => f64::from_le_bytes(b) as i64,
    }
}

/// Calls `sink` with the numbers of property `wanted` of each row.
pub(super) fn read_lists<R: Read>(
    source: &mut Source<R>,
    element: &Element,
    order: ByteOrder,
    wanted: usize,
    sink: &mut impl FnMut(&[i64]) -> Result<(), String>,
) -> Result<(), ImportError> {
    // A row without properties takes no bytes: there is nothing to read, however many there are.
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut items = Vec::new();
    let mut done = 0;
    while done < element.count {
        let window = source.window()?;
        let mut used = 0;
        let mut refused = None;
        while done < element.count {
            match read_row(&window[used..], element, order, wanted, &mut items) {
                Ok(Some(length)) => used += length,
                Ok(None) => break,
                Err(what) => refused = Some(what),
            }
            refused = refused.or_else(|| sink(&items).err());
            if refused.is_some() {
                break;
            }
            done += 1;
        }
        source.advance(used);
        if let Some(what) = refused {
            return Err(source.byte_error(what));
        }
        if done < element.count && !source.fill()? {
            return Err(ended(source, element));
        }
    }
    Ok(())
}

/// Reads a row; returns its length, or `None` if the window ends before the row does.
#[inline]
fn read_row(
    window: &[u8],
    element: &Element,
    order: ByteOrder,
    wanted: usize,
    items: &mut Vec<i64>,
) -> Result<Option<usize>, String> {
    let mut at = 0;
    for (i, property) in element.properties.iter().enumerate() {
        let (count, item) = match *property {
            Property::Scalar { kind, .. } => {
                at += kind.bytes();
                continue;
            }
            Property::List { count, item, .. } => (count, item),
        };
        let Some(bytes) = window.get(at..at + count.bytes()) else { return Ok(None) };
        let length = integer(bytes, count, order);
        let length = usize::try_from(length).map_err(|_| "a list has a negative length".to_owned())?;
        at += count.bytes();
        let list_bytes = length.saturating_mul(item.bytes());
        let Some(list) = window.get(at..at.saturating_add(list_bytes)) else { return Ok(None) };
        if i == wanted {
            items.clear();
            push_items(list, item, order, items);
        }
        at += list_bytes;
    }
    Ok((at <= window.len()).then_some(at))
}

#[inline]
fn push_items(list: &[u8], item: Kind, order: ByteOrder, items: &mut Vec<i64>) {
    let words = list.as_chunks::<4>().0;
    match (item, order) {
        (Kind::I32, ByteOrder::Little) => {
            items.extend(words.iter().map(|&w| i64::from(i32::from_le_bytes(w))))
        }
        (Kind::U32, ByteOrder::Little) => {
            items.extend(words.iter().map(|&w| i64::from(u32::from_le_bytes(w))))
        }
        _ => items.extend(list.chunks_exact(item.bytes()).map(|b| integer(b, item, order))),
    }
}

fn ended<R: Read>(source: &Source<R>, element: &Element) -> ImportError {
    source.byte_error(format!("the file ends within the element \"{}\"", element.name))
}
