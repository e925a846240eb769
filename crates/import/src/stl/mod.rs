//! Stereolithography files, text and binary. Equal corners are welded; the stored normals are not used, because they
//! say no more than the winding does.

mod ascii;
mod binary;
mod weld;

#[cfg(test)]
mod tests;

use crate::scan::Source;
use crate::{ImportError, Limits, LoadOptions, single_mesh_scene};
use std::io::Read;
use std::path::Path;
use vastlight_scene::{Diagnostics, Mesh, SceneDesc};

const HEADER_BYTES: usize = 80;
const FACET_BYTES: u64 = 50;

/// Reads an STL file as a scene of one mesh.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<SceneDesc, ImportError> {
    let file_bytes = std::fs::metadata(path).map_err(|e| ImportError::io(&e, path))?.len();
    let source = Source::open(path, &options.limits)?;
    let mesh = read(source, file_bytes, &options.limits)?;
    let mut diagnostics = Diagnostics::default();
    if mesh.triangles.is_empty() {
        diagnostics.warn("the file has no triangles", path.display().to_string(), "");
    }
    Ok(single_mesh_scene(mesh, path, diagnostics))
}

/// Reads a mesh from a source of `file_bytes` bytes.
fn read<R: Read>(mut source: Source<R>, file_bytes: u64, limits: &Limits) -> Result<Mesh, ImportError> {
    while source.window()?.len() < 4 * HEADER_BYTES {
        if !source.fill()? {
            break;
        }
    }
    if is_ascii(source.window()?, file_bytes) {
        ascii::read(source, limits)
    } else {
        binary::read(source, file_bytes, limits)
    }
}

/// Text starts with "solid", but so do some binary files: those have exactly the size that their count says, or no
/// facet within the first lines.
fn is_ascii(head: &[u8], file_bytes: u64) -> bool {
    let count = head.get(HEADER_BYTES..HEADER_BYTES + 4).and_then(|b| b.first_chunk::<4>());
    let exact = count.is_some_and(|&c| {
        HEADER_BYTES as u64 + 4 + FACET_BYTES * u64::from(u32::from_le_bytes(c)) == file_bytes
    });
    let lower = head[..head.len().min(4 * HEADER_BYTES)].to_ascii_lowercase();
    let contains = |word: &[u8]| lower.windows(word.len()).any(|w| w == word);
    lower.trim_ascii_start().starts_with(b"solid")
        && !exact
        && (contains(b"facet") || contains(b"endsolid") || !lower.contains(&0))
}
