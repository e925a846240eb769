//! The bytes behind buffers and buffer views.

use super::findings::Findings;
use super::json::Json;
use super::uri::{self, Uri};
use crate::Limits;
use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

/// What is known of a buffer.
#[derive(Clone, Debug)]
pub(super) enum Bytes<'a> {
    /// Its bytes.
    Known(Cow<'a, [u8]>),
    /// It should be there and is not; an error has been reported.
    Missing,
    /// The file leaves open where it is.
    Elsewhere,
}

/// The bytes of all buffers.
#[derive(Debug, Default)]
pub(super) struct Buffers<'a> {
    data: Vec<Bytes<'a>>,
}

impl<'a> Buffers<'a> {
    /// The bytes of a buffer.
    pub(super) fn get(&self, buffer: usize) -> &Bytes<'a> {
        self.data.get(buffer).unwrap_or(&Bytes::Missing)
    }

    /// Bytes of all buffers.
    pub(super) fn total(&self) -> u64 {
        let length = |bytes: &Bytes<'_>| if let Bytes::Known(bytes) = bytes { bytes.len() as u64 } else { 0 };
        self.data.iter().map(length).sum()
    }
}

/// Where buffers come from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sources<'a> {
    /// The BIN chunk of a GLB.
    pub(super) bin: Option<&'a [u8]>,
    /// Whether the file is a GLB.
    pub(super) is_glb: bool,
    /// Folder of the document.
    pub(super) directory: &'a Path,
    /// Bounds on files.
    pub(super) limits: &'a Limits,
}

/// Loads every buffer of the document.
pub(super) fn load<'a>(root: &Json<'_>, sources: &Sources<'a>, findings: &mut Findings) -> Buffers<'a> {
    let list = root.list("buffers").iter().enumerate();
    Buffers { data: list.map(|(i, buffer)| load_one(buffer, i, sources, findings)).collect() }
}

fn load_one<'a>(
    buffer: &Json<'_>,
    index: usize,
    sources: &Sources<'a>,
    findings: &mut Findings,
) -> Bytes<'a> {
    let place = format!("/buffers/{index}");
    let bytes = match (buffer.at("uri").text(), sources.bin) {
        (Some(uri), _) => load_uri(uri, sources, &place, findings),
        (None, Some(bin)) if index == 0 => Bytes::Known(Cow::Borrowed(bin)),
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

fn load_uri<'a>(uri: &str, sources: &Sources<'_>, place: &str, findings: &mut Findings) -> Bytes<'a> {
    let place = format!("{place}/uri");
    match uri::resolve(uri, sources.directory) {
        Uri::Data { media_type, bytes } => {
            let known = ["application/octet-stream", "application/gltf-buffer"];
            if !known.iter().any(|name| media_type.eq_ignore_ascii_case(name)) {
                let what = format!("the media type of a buffer's data URI is \"{}\"", shorten(media_type));
                let hint = "application/octet-stream and application/gltf-buffer are allowed";
                findings.error("BUFFER_DATA_URI_MIME_TYPE_INVALID", what, &place, hint);
            }
            Bytes::Known(Cow::Owned(bytes))
        }
        Uri::File(path) => match read_file(&path, sources.limits.file_bytes) {
            Ok(bytes) => Bytes::Known(Cow::Owned(bytes)),
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
fn check_length(buffer: &Json<'_>, bytes: &Bytes<'_>, place: &str, findings: &mut Findings) {
    let (Some(declared), Bytes::Known(bytes)) = (buffer.index("byteLength"), bytes) else { return };
    let is_bin = buffer.get("uri").is_none();
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

/// The JSON text of a file; of a GLB without what stands behind it.
pub(super) fn read_json(path: &Path, limit: u64) -> std::io::Result<Vec<u8>> {
    let mut file = std::fs::File::open(path)?;
    let mut head = Vec::new();
    (&mut file).take(GLB_HEAD as u64).read_to_end(&mut head)?;
    if !head.starts_with(b"glTF") {
        return read_file(path, limit);
    }
    let length =
        head.get(12..16).and_then(|bytes| bytes.first_chunk()).map(|&bytes| u32::from_le_bytes(bytes));
    let mut json = Vec::new();
    file.take(u64::from(length.unwrap_or(0))).read_to_end(&mut json)?;
    Ok(json)
}

/// Bytes of a GLB before its JSON text.
pub(super) const GLB_HEAD: usize = 20;

/// Reads a regular file of at most `limit` bytes.
pub(super) fn read_file(path: &Path, limit: u64) -> std::io::Result<Vec<u8>> {
    let file = std::fs::File::open(path)?;
    let metadata = file.metadata()?;
    if !metadata.is_file() {
        return Err(std::io::Error::other("it is no regular file"));
    }
    if metadata.len() > limit {
        return Err(std::io::Error::other(format!(
            "{} bytes are more than the limit of {limit}",
            metadata.len()
        )));
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(metadata.len() as usize)?;
    file.take(limit).read_to_end(&mut bytes)?;
    Ok(bytes)
}
