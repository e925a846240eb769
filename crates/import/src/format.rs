//! Which format a file has.

use crate::blob::open_within;
use crate::sequence::first_file;
use crate::{ErrorKind, ImportError, Limits};
use std::io::Read;
use std::path::Path;

/// Formats of scene files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneFormat {
    /// glTF 2.0, as JSON or as GLB.
    Gltf,
    /// Wavefront OBJ with MTL.
    Obj,
    /// Stanford PLY.
    Ply,
    /// Stereolithography, text or binary.
    Stl,
}

const KNOWN: &str = "vastlight reads glTF, GLB, OBJ, PLY and STL";
const HEAD_BYTES: u64 = 1024;

/// The format of the file at `path`: by its first bytes where they are unmistakable, else by its extension, else by a
/// look at the content. That of a sequence of files is that of its first.
///
/// # Errors
/// The file cannot be opened, is empty, too large or of an unknown format.
pub fn detect(path: &Path, limits: &Limits) -> Result<SceneFormat, ImportError> {
    let path = &first_file(path, limits)?;
    let place = path.display().to_string();
    if path.is_dir() {
        return Err(
            ImportError::new(ErrorKind::Io, "this is a directory", place).with_hint("name a scene file")
        );
    }
    let (file, bytes) = open_within(path, limits)?;
    let mut head = Vec::new();
    file.take(HEAD_BYTES).read_to_end(&mut head).map_err(|e| ImportError::io(&e, path))?;
    if head.is_empty() {
        return Err(ImportError::malformed("the file is empty", place));
    }
    let by_content = || by_content(&head, bytes);
    let found = by_signature(&head).or_else(|| by_extension(path)).or_else(by_content);
    let unknown =
        || ImportError::new(ErrorKind::UnknownFormat, "unknown scene format", place).with_hint(KNOWN);
    found.ok_or_else(unknown)
}

fn by_signature(head: &[u8]) -> Option<SceneFormat> {
    if head.starts_with(b"glTF") {
        return Some(SceneFormat::Gltf);
    }
    let is_ply = head.starts_with(b"ply\n") || head.starts_with(b"ply\r");
    is_ply.then_some(SceneFormat::Ply)
}

fn by_extension(path: &Path) -> Option<SceneFormat> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "gltf" | "glb" | "vrm" => Some(SceneFormat::Gltf),
        "obj" => Some(SceneFormat::Obj),
        "ply" => Some(SceneFormat::Ply),
        "stl" => Some(SceneFormat::Stl),
        _ => None,
    }
}

fn by_content(head: &[u8], file_bytes: u64) -> Option<SceneFormat> {
    let text = String::from_utf8_lossy(head);
    let first_word = text.split_whitespace().next().unwrap_or_default();
    if first_word.starts_with('{') && text.contains("\"asset\"") {
        return Some(SceneFormat::Gltf);
    }
    if first_word == "solid" && text.contains("facet") {
        return Some(SceneFormat::Stl);
    }
    if let Some(count) = head.get(80..84) {
        let count = u32::from_le_bytes([count[0], count[1], count[2], count[3]]);
        if 84 + 50 * u64::from(count) == file_bytes {
            return Some(SceneFormat::Stl);
        }
    }
    let is_vertex = |line: &str| {
        let mut words = line.split_whitespace();
        words.next() == Some("v") && words.take(3).filter(|w| w.parse::<f32>().is_ok()).count() == 3
    };
    text.lines().any(is_vertex).then_some(SceneFormat::Obj)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn detect_bytes(extension: &str, bytes: &[u8]) -> Result<SceneFormat, ImportError> {
        let mut file = tempfile::Builder::new().suffix(extension).tempfile().expect("temporary file");
        file.write_all(bytes).expect("written");
        detect(file.path(), &Limits::default())
    }

    #[test]
    fn signatures_win_over_extensions() {
        assert_eq!(detect_bytes(".obj", b"glTF\x02\0\0\0"), Ok(SceneFormat::Gltf));
        assert_eq!(detect_bytes(".stl", b"ply\nformat ascii 1.0\n"), Ok(SceneFormat::Ply));
    }

    #[test]
    fn content_decides_without_an_extension() {
        assert_eq!(detect_bytes("", b"{\"asset\":{}}"), Ok(SceneFormat::Gltf));
        assert_eq!(detect_bytes("", b"# made by hand\nv 1 2 3\n"), Ok(SceneFormat::Obj));
        assert_eq!(detect_bytes("", b"solid x\n facet normal 0 0 1\n"), Ok(SceneFormat::Stl));
        assert_eq!(detect_bytes("", &[0; 84]), Ok(SceneFormat::Stl));
    }

    #[test]
    fn unknown_and_empty_files_are_errors() {
        let kind = |result: Result<SceneFormat, ImportError>| result.expect_err("refused").kind;
        assert_eq!(kind(detect_bytes(".3ds", b"MM")), ErrorKind::UnknownFormat);
        assert_eq!(kind(detect_bytes(".obj", b"")), ErrorKind::Malformed);
        assert_eq!(kind(detect(Path::new("/nonexistent.obj"), &Limits::default())), ErrorKind::Io);
    }
}
