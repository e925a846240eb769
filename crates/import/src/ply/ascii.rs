//! The body of a text PLY: words, wherever lines end.

use super::Stopped;
use super::header::{Element, Property};
use super::vertices::Vertices;
use crate::ImportError;
use crate::number::{parse_f32, parse_i64};
use crate::scan::Source;
use std::io::Read;
use vastlight_scene::MeshSink;

/// Vertices that are made room for at a time.
const BLOCK_ROWS: u64 = 4096;

pub(super) fn read_vertices<R: Read>(
    source: &mut Source<R>,
    element: &Element,
    vertices: &mut Vertices,
    sink: &mut dyn MeshSink,
) -> Result<(), Stopped> {
    let slots = vertices.slots.clone();
    let mut done = 0;
    while done < element.count {
        let rows = BLOCK_ROWS.min(element.count - done) as usize;
        vertices.grow(rows);
        for row in 0..rows {
            for (property, slot) in element.properties.iter().zip(&slots) {
                match (property, slot) {
                    (Property::List { .. }, _) => drop(list(source, element, &mut Vec::new(), false)?),
                    (_, None) => drop(number(source, element)?),
                    (_, &Some(slot)) => {
                        let value = number(source, element)?;
                        let lane = vertices.lane(slot, row);
                        lane.values[lane.offset] = value;
                    }
                }
            }
        }
        sink.vertices(&vertices.take())?;
        done += rows as u64;
    }
    Ok(())
}

/// Calls `sink` with the numbers of property `wanted` of each row.
pub(super) fn read_lists<R: Read>(
    source: &mut Source<R>,
    element: &Element,
    wanted: usize,
    sink: &mut impl FnMut(&[i64]) -> Result<(), String>,
) -> Result<(), ImportError> {
    // A row without properties takes no bytes: there is nothing to read, however many there are.
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut items = Vec::new();
    for _ in 0..element.count {
        for (i, property) in element.properties.iter().enumerate() {
            match property {
                Property::Scalar { .. } => drop(word(source, element)?),
                Property::List { .. } => list(source, element, &mut items, i == wanted)?,
            }
        }
        sink(&items).map_err(|what| source.error(what))?;
    }
    Ok(())
}

#[inline]
fn word<'s, R: Read>(source: &'s mut Source<R>, element: &Element) -> Result<&'s [u8], ImportError> {
    if source.find_word()? {
        return source.word();
    }
    Err(source.error(format!("the file ends within the element \"{}\"", element.name)))
}

fn number<R: Read>(source: &mut Source<R>, element: &Element) -> Result<f32, ImportError> {
    parse_f32(word(source, element)?).ok_or_else(|| source.error("this is not a number"))
}

fn integer<R: Read>(source: &mut Source<R>, element: &Element) -> Result<i64, ImportError> {
    parse_i64(word(source, element)?).ok_or_else(|| source.error("this is not an integer"))
}

/// Reads a list; its numbers replace `items` if they are wanted.
fn list<R: Read>(
    source: &mut Source<R>,
    element: &Element,
    items: &mut Vec<i64>,
    wanted: bool,
) -> Result<(), ImportError> {
    let count = integer(source, element)?;
    if count < 0 {
        return Err(source.error("a list has a negative length"));
    }
    if wanted {
        items.clear();
    }
    for _ in 0..count {
        if wanted {
            items.push(integer(source, element)?);
        } else {
            word(source, element)?;
        }
    }
    Ok(())
}
