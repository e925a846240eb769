//! The header of an EXR file with its attributes in the order of their names.
//!
//! The library keeps custom attributes in a hash map, so their order differs from run to run. Attributes may stand in
//! any order; sorting them makes the same picture the same bytes, and moves nothing else in the file.

use std::ops::Range;

/// Sorts the attributes of a single-part EXR file's header. A file that cannot be understood stays as it is.
pub(crate) fn sort_attributes(file: &mut [u8]) {
    let Some((span, mut attributes)) = attributes(file) else { return };
    attributes.sort_by(|a, b| file[a.clone()].cmp(&file[b.clone()]));
    let sorted: Vec<u8> = attributes.into_iter().flat_map(|r| file[r].to_vec()).collect();
    file[span].copy_from_slice(&sorted);
}

/// The bytes of all attributes, and of each: name, type and size, then the value.
fn attributes(file: &[u8]) -> Option<(Range<usize>, Vec<Range<usize>>)> {
    const MAGIC_AND_VERSION: usize = 8;
    let mut found = Vec::new();
    let mut at = MAGIC_AND_VERSION;
    while *file.get(at)? != 0 {
        let value_type = text_end(file, at)?;
        let size_at = text_end(file, value_type)?;
        let size = file.get(size_at..size_at + 4)?.try_into().ok().map(u32::from_le_bytes)?;
        let end = size_at + 4 + size as usize;
        found.push(at..end);
        at = end;
    }
    Some((MAGIC_AND_VERSION..at, found))
}

/// The position after the zero that ends a text.
fn text_end(file: &[u8], start: usize) -> Option<usize> {
    file.get(start..)?.iter().position(|&b| b == 0).map(|n| start + n + 1)
}
