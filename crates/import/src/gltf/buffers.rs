//! The bytes behind buffers and buffer views.

use super::findings::Findings;
use super::json::Json;
use super::model::View;
use super::uri::{self, Uri};
use crate::Limits;
use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

/// The bytes of all buffers; `None` where a buffer has none.
#[derive(Debug, Default)]
pub(super) struct Buffers<'a> {
    data: Vec<Option<Cow<'a, [u8]>>>,
}

impl Buffers<'_> {
    /// The bytes of a buffer.
    pub(super) fn get(&self, buffer: usize) -> Option<&[u8]> {
        self.data.get(buffer)?.as_deref()
    }

    /// The bytes of a view, if its buffer has them.
    pub(super) fn view(&self, view: &View) -> Option<&[u8]> {
        self.get(view.buffer)?.get(view.offset..view.offset.checked_add(view.length)?)
    }

    /// Bytes of all buffers.
    pub(super) fn total(&self) -> u64 {
        self.data.iter().flatten().map(|bytes| bytes.len() as u64).sum()
    }
}

/// Loads every buffer of the document.
pub(super) fn load<'a>(
    root: &Json<'_>,
    bin: Option<&'a [u8]>,
    directory: &Path,
    limits: &Limits,
    findings: &mut Findings,
) -> Buffers<'a> {
    let mut data = Vec::new();
    for (i, buffer) in root.list("buffers").iter().enumerate() {
        let place = format!("/buffers/{i}");
        let bytes = match buffer.at("uri").text() {
            Some(uri) => load_uri(uri, directory, limits, &place, findings).map(Cow::Owned),
            None if i == 0 => bin.map(Cow::Borrowed),
            None => None,
        };
        data.push(
            bytes.and_then(|bytes| check_length(buffer, bytes, i == 0 && bin.is_some(), &place, findings)),
        );
    }
    Buffers { data }
}

fn load_uri(
    uri: &str,
    directory: &Path,
    limits: &Limits,
    place: &str,
    findings: &mut Findings,
) -> Option<Vec<u8>> {
    let place = format!("{place}/uri");
    match uri::resolve(uri, directory) {
        Uri::Data { media_type, bytes } => {
            let known = ["application/octet-stream", "application/gltf-buffer"];
            if !known.iter().any(|name| media_type.eq_ignore_ascii_case(name)) {
                let what = format!("the media type of a buffer's data URI is \"{media_type}\"");
                let hint = "application/octet-stream and application/gltf-buffer are allowed";
                findings.error("BUFFER_DATA_URI_MIME_TYPE_INVALID", what, &place, hint);
            }
            Some(bytes)
        }
        Uri::File(path) => match read_file(&path, limits.file_bytes) {
            Ok(bytes) => Some(bytes),
            Err(error) => {
                let what = format!("the file \"{}\" cannot be read: {error}", path.display());
                findings.error("IO_ERROR", what, &place, "external files stand beside the document");
                None
            }
        },
        Uri::Remote => {
            let what = format!("\"{}\" is no relative file name", shorten(uri));
            findings.warn("NON_RELATIVE_URI", what, &place, "nothing is fetched from elsewhere");
            None
        }
        Uri::Invalid(why) => {
            let what = format!("the URI \"{}\" is invalid: {why}", shorten(uri));
            findings.error("INVALID_URI", what, &place, "");
            None
        }
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

/// A buffer has at least the length that it declares; a GLB's chunk at most 3 bytes more.
fn check_length<'a>(
    buffer: &Json<'_>,
    bytes: Cow<'a, [u8]>,
    is_bin: bool,
    place: &str,
    findings: &mut Findings,
) -> Option<Cow<'a, [u8]>> {
    let declared = buffer.index("byteLength")?;
    if bytes.len() < declared {
        let what = format!("the buffer has {} bytes, fewer than the declared {declared}", bytes.len());
        findings.error("BUFFER_BYTE_LENGTH_MISMATCH", what, place, "the data is cut off");
    } else if is_bin && buffer.get("uri").is_none() && bytes.len() > declared.next_multiple_of(4) {
        let what =
            format!("the BIN chunk has {} bytes more than the buffer declares", bytes.len() - declared);
        findings.warn("BUFFER_GLB_CHUNK_TOO_BIG", what, place, "they are ignored");
    }
    Some(bytes)
}
