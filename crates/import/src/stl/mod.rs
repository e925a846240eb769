//! Stereolithography files, text and binary, streamed block by block to whoever takes the mesh. Equal corners are welded; the stored
//! normals are not used, because they say no more than the winding does.

mod ascii;
mod binary;
mod facets;
mod weld;

#[cfg(test)]
mod tests;

use crate::scan::Source;
use crate::single::{Stopped, streamed_mesh};
use crate::{FileSize, ImportError, Limits, LoadOptions, Streamed, single_mesh_scene};
use std::fs::File;
use std::io::Read;
use std::path::Path;
use vastlight_scene::{Diagnostics, Mesh, MeshSink, SceneDesc, SceneStream};

const HEADER_BYTES: usize = 80;
const FACET_BYTES: u64 = 50;
/// Bytes of a facet in text, about.
const TEXT_FACET_BYTES: u64 = 250;
/// Text files of more bytes are streamed: how many facets they have is not known before.
const MOST_TEXT_AT_ONCE: u64 = 16 << 20;

/// Reads an STL file as a scene of one mesh.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<SceneDesc, ImportError> {
    let (file, mut mesh) = (StlFile::open(path, options)?, Mesh::default());
    let colored = file.reader()?.survey()?.is_some_and(|(_, colored)| colored);
    file.reader()?.read(colored, &mut mesh).map_err(Stopped::into_import)?;
    let mut diagnostics = Diagnostics::default();
    if mesh.triangles.is_empty() {
        warn_no_triangles(&mut diagnostics, path);
    }
    Ok(single_mesh_scene(mesh, path, diagnostics))
}

/// An STL file as a scene of one mesh that is read block by block.
pub(crate) fn stream(path: &Path, options: &LoadOptions) -> Result<Streamed, ImportError> {
    let file = StlFile::open(path, options)?;
    let survey = file.reader()?.survey()?;
    if survey.is_none() && file.bytes <= MOST_TEXT_AT_ONCE {
        return Ok(SceneStream::from(load(path, options)?).into());
    }
    let mut diagnostics = Diagnostics::default();
    if survey.is_some_and(|(count, _)| count == 0) {
        warn_no_triangles(&mut diagnostics, path);
    }
    let colored = survey.is_some_and(|(_, colored)| colored);
    let read = move |sink: &mut dyn MeshSink| Ok(file.reader()?.read(colored, sink)?);
    let triangles = survey.map(|(count, _)| u64::from(count));
    Ok(streamed_mesh(path, colored, triangles, diagnostics, Box::new(read)))
}

/// What a file says of its size.
pub(crate) fn file_size(path: &Path, options: &LoadOptions) -> Result<FileSize, ImportError> {
    let file = StlFile::open(path, options)?;
    let facet_bytes = if file.reader()?.is_text()? { TEXT_FACET_BYTES } else { FACET_BYTES };
    // Small files are read as a whole.
    let streaming_bytes = weld::TABLE_BYTES.min(file.bytes.saturating_mul(2));
    Ok(FileSize { streaming_bytes, triangles: file.bytes / facet_bytes, ..FileSize::default() })
}

fn warn_no_triangles(diagnostics: &mut Diagnostics, path: &Path) {
    diagnostics.warn("the file has no triangles", path.display().to_string(), "");
}

/// A file that may be read several times.
struct StlFile {
    path: Box<Path>,
    bytes: u64,
    limits: Limits,
}

impl StlFile {
    fn open(path: &Path, options: &LoadOptions) -> Result<Self, ImportError> {
        let bytes = std::fs::metadata(path).map_err(|e| ImportError::io(&e, path))?.len();
        Ok(Self { path: path.into(), bytes, limits: options.limits })
    }

    fn reader(&self) -> Result<Reader<'_, File>, ImportError> {
        let source = Source::open(&self.path, &self.limits)?;
        Ok(Reader { source, file_bytes: self.bytes, limits: &self.limits })
    }
}

/// Reads a file of so many bytes from its start.
struct Reader<'a, R> {
    source: Source<R>,
    file_bytes: u64,
    limits: &'a Limits,
}

impl<R: Read> Reader<'_, R> {
    /// How many facets a binary file has, and whether with colours; nothing of text.
    fn survey(mut self) -> Result<Option<(u32, bool)>, ImportError> {
        if self.is_text()? { Ok(None) } else { binary::survey(self).map(Some) }
    }

    /// Gives a sink the mesh.
    fn read(mut self, colored: bool, sink: &mut dyn MeshSink) -> Result<(), Stopped> {
        if self.is_text()? {
            ascii::read(self.source, self.limits, sink)
        } else {
            binary::read(self, colored, sink)
        }
    }

    fn is_text(&mut self) -> Result<bool, ImportError> {
        while self.source.window()?.len() < 4 * HEADER_BYTES {
            if !self.source.fill()? {
                break;
            }
        }
        Ok(is_ascii(self.source.window()?, self.file_bytes))
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
