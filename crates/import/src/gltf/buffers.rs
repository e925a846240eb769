//! The bytes behind buffers and buffer views.

use super::findings::Findings;
use super::json::Json;
use super::uri::{self, Uri};
use crate::Limits;
use crate::blob::{Blob, MOST_IN_MEMORY};
use std::path::Path;

/// What is known of a buffer.
#[derive(Clone, Debug)]
pub(super) enum Bytes {
    /// Its bytes.
    Known(Blob),
    /// It should be there and is not; an error has been reported.
    Missing,
    /// The file leaves open where it is.
    Elsewhere,
}

/// The bytes of all buffers.
#[derive(Debug, Default)]
pub(super) struct Buffers {
    data: Vec<Bytes>,
}

impl Buffers {
    /// The bytes of a buffer.
    pub(super) fn get(&self, buffer: usize) -> &Bytes {
        self.data.get(buffer).unwrap_or(&Bytes::Missing)
    }

    /// Bytes of all buffers.
    pub(super) fn total(&self) -> u64 {
        let length = |bytes: &Bytes| if let Bytes::Known(bytes) = bytes { bytes.len() } else { 0 };
        self.data.iter().map(length).sum()
    }
}

/// Where buffers come from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sources<'a> {
    /// The BIN chunk of a GLB.
    pub(super) bin: Option<&'a Blob>,
    /// Whether the file is a GLB.
    pub(super) is_glb: bool,
    /// Folder of the document.
    pub(super) directory: &'a Path,
    /// Bounds on files.
    pub(super) limits: &'a Limits,
}

/// Loads every buffer of the document.
pub(super) fn load(root: &Json<'_>, sources: &Sources<'_>, findings: &mut Findings) -> Buffers {
    let list = root.list("buffers").iter().enumerate();
    Buffers { data: list.map(|(i, buffer)| load_one(buffer, i, sources, findings)).collect() }
}

fn load_one(buffer: &Json<'_>, index: usize, sources: &Sources<'_>, findings: &mut Findings) -> Bytes {
    let place = format!("/buffers/{index}");
    let bytes = match (buffer.at("uri").text(), sources.bin) {
        (Some(uri), _) => load_uri(uri, sources, &place, findings),
        (None, Some(bin)) if index == 0 => Bytes::Known(bin.clone()),
        (None, None) if index == 0 && sources.is_glb && buffer.get("extensions").is_none() => {
            let what = "the buffer is the GLB's BIN chunk, which is missing";
            findings.error("BUFFER_MISSING_GLB_DATA", what, &place, "");
            Bytes::Missing
        }
        _ => Bytes::Elsewhere,
    };
    check_length(buffer, &bytes, &place, findings);
    bytes
}

fn load_uri(uri: &str, sources: &Sources<'_>, place: &str, findings: &mut Findings) -> Bytes {
    let place = format!("{place}/uri");
    match uri::resolve(uri, sources.directory) {
        Uri::Data { media_type, bytes } => {
            let known = ["application/octet-stream", "application/gltf-buffer"];
            if !known.iter().any(|name| media_type.eq_ignore_ascii_case(name)) {
                let what = format!("the media type of a buffer's data URI is \"{}\"", shorten(media_type));
                let hint = "application/octet-stream and application/gltf-buffer are allowed";
                findings.error("BUFFER_DATA_URI_MIME_TYPE_INVALID", what, &place, hint);
            }
            Bytes::Known(bytes.into())
        }
        Uri::File(path) => match Blob::open(&path, sources.limits.file_bytes, MOST_IN_MEMORY) {
            Ok(bytes) => Bytes::Known(bytes),
            Err(error) => {
                let what = format!("the file \"{}\" cannot be read: {error}", path.display());
                findings.error("IO_ERROR", what, &place, "external files stand beside the document");
                Bytes::Missing
            }
        },
        Uri::Remote => {
            let what = format!("\"{}\" is no relative file name", shorten(uri));
            findings.warn("NON_RELATIVE_URI", what, &place, "nothing is fetched from elsewhere");
            Bytes::Missing
        }
        Uri::Invalid(why) => {
            let what = format!("the URI \"{}\" is invalid: {why}", shorten(uri));
            findings.error("INVALID_URI", what, &place, "");
            Bytes::Missing
        }
    }
}

/// A buffer has at least the length that it declares; a GLB's chunk at most 3 bytes more.
fn check_length(buffer: &Json<'_>, bytes: &Bytes, place: &str, findings: &mut Findings) {
    let (Some(declared), Bytes::Known(bytes)) = (buffer.index("byteLength"), bytes) else { return };
    let is_bin = buffer.get("uri").is_none();
    let declared = declared as u64;
    if bytes.len() < declared {
        let what = format!("the buffer has {} bytes, fewer than the declared {declared}", bytes.len());
        findings.error("BUFFER_BYTE_LENGTH_MISMATCH", what, place, "the data is cut off");
    } else if is_bin && bytes.len() > declared.next_multiple_of(4) {
        let what =
            format!("the BIN chunk has {} bytes more than the buffer declares", bytes.len() - declared);
        findings.warn("BUFFER_GLB_CHUNK_TOO_BIG", what, place, "they are ignored");
    }
}

/// The beginning of a text, for messages.
pub(super) fn shorten(text: &str) -> String {
    let mut short: String = text.chars().take(60).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    short
}
