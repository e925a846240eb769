//! Binary STL: a header of 80 bytes, a count, and 50 bytes a facet; with the two conventions for colours.

use super::facets::Facets;
use super::{FACET_BYTES, HEADER_BYTES, Reader};
use crate::ImportError;
use crate::environment::linear;
use crate::single::Stopped;
use std::io::Read;
use vastlight_math::{Vec3, Vec4};
use vastlight_scene::MeshSink;

/// Colours are used only where at least one facet has one.
const NO_COLOR: u16 = 0;
/// Bit that marks a valid colour after [`Convention::normalized`].
const VALID: u16 = 0x8000;

/// What the two bytes after a facet mean.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Convention {
    /// VisCAM, SolidView: valid if bit 15 is set; blue in the low bits.
    VisCam,
    /// Materialise Magics: `COLOR=` in the header holds the default; valid if bit 15 is clear; red in the low bits.
    Magics(Vec4),
}

impl Convention {
    fn of(header: &[u8]) -> Self {
        let start = header.windows(6).position(|w| w == b"COLOR=").map(|at| at + 6);
        match start.and_then(|at| header.get(at..at + 4)) {
            Some(rgba) => {
                let [r, g, b, a] = [0, 1, 2, 3].map(|i| f32::from(rgba[i]) / 255.0);
                Self::Magics(Vec4::new(linear(r), linear(g), linear(b), a))
            }
            None => Self::VisCam,
        }
    }

    /// VisCAM's layout, or [`NO_COLOR`].
    fn normalized(self, attribute: u16) -> u16 {
        match self {
            Self::VisCam if attribute & VALID != 0 => attribute,
            Self::Magics(_) if attribute & VALID == 0 => {
                let (r, g, b) = (attribute & 31, (attribute >> 5) & 31, (attribute >> 10) & 31);
                VALID | (r << 10) | (g << 5) | b
            }
            _ => NO_COLOR,
        }
    }

    fn color(self, tag: u16) -> Vec4 {
        if tag == NO_COLOR {
            return match self {
                Self::VisCam => Vec4::ONE,
                Self::Magics(default) => default,
            };
        }
        let channel = |shift: u32| linear(f32::from((tag >> shift) & 31) / 31.0);
        Vec4::new(channel(10), channel(5), channel(0), 1.0)
    }
}

/// What stands before the facets.
struct Header {
    convention: Convention,
    count: u32,
}

impl Header {
    fn read<R: Read>(reader: &mut Reader<'_, R>) -> Result<Self, ImportError> {
        let Reader { source, file_bytes, limits } = reader;
        let convention = source.take(HEADER_BYTES)?.map(Convention::of);
        let count = source.take(4)?.and_then(|b| b.first_chunk::<4>()).map(|&c| u32::from_le_bytes(c));
        let (Some(convention), Some(count)) = (convention, count) else {
            return Err(source.byte_error("the file is too short for an STL header"));
        };
        let present = file_bytes.saturating_sub(HEADER_BYTES as u64 + 4) / FACET_BYTES;
        if u64::from(count) > present {
            let what = format!("the header promises {count} triangles, the file has room for {present}");
            return Err(source.byte_error(what));
        }
        limits.check_count(u64::from(count), limits.triangles, "triangles", source.file())?;
        Ok(Self { convention, count })
    }
}

/// How many facets there are, and whether any has a colour: in most files without colours that is known at the end.
pub(super) fn survey<R: Read>(mut reader: Reader<'_, R>) -> Result<(u32, bool), ImportError> {
    let Header { convention, count } = Header::read(&mut reader)?;
    let mut colored = count > 0 && matches!(convention, Convention::Magics(_));
    for _ in 0..count {
        if colored {
            break;
        }
        let Some(facet) = reader.source.take(FACET_BYTES as usize)? else { break };
        colored = tag_of(facet, convention) != NO_COLOR;
    }
    Ok((count, colored))
}

/// Gives a sink the mesh, with colours if it is `colored`.
pub(super) fn read<R: Read>(
    mut reader: Reader<'_, R>,
    colored: bool,
    sink: &mut dyn MeshSink,
) -> Result<(), Stopped> {
    let Header { convention, count } = Header::read(&mut reader)?;
    let Reader { mut source, limits, .. } = reader;
    sink.expect_triangles(count as usize);
    let color = |tag| convention.color(tag);
    let mut facets = Facets::new(source.file(), limits, colored.then_some(&color), sink);
    for _ in 0..count {
        let Some(facet) = source.take(FACET_BYTES as usize)? else {
            return Err(source.byte_error("the file ends within a triangle").into());
        };
        facets.push(corners_of(facet), tag_of(facet, convention))?;
    }
    facets.finish()
}

#[inline]
fn tag_of(facet: &[u8], convention: Convention) -> u16 {
    let (_, rest) = facet.as_chunks::<4>();
    rest.first_chunk::<2>().map_or(NO_COLOR, |&b| convention.normalized(u16::from_le_bytes(b)))
}

#[inline]
fn corners_of(facet: &[u8]) -> [Vec3; 3] {
    let (words, _) = facet.as_chunks::<4>();
    // The first three numbers are the normal.
    [3, 6, 9].map(|first| {
        let [x, y, z] = [0, 1, 2].map(|i| f32::from_le_bytes(words[first + i]));
        Vec3::new(x, y, z)
    })
}
