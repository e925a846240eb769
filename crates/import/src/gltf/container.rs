//! From the bytes of a file to its JSON text and, in GLB, its binary chunk.

use super::findings::Findings;
use crate::blob::Blob;

/// The parts of a file.
#[derive(Clone, Debug)]
pub(super) struct Container {
    /// The JSON text.
    pub(super) json: Blob,
    /// The BIN chunk of a GLB.
    pub(super) bin: Option<Blob>,
    /// Whether the file is a GLB.
    pub(super) is_glb: bool,
}

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// Splits a file. Findings are errors where the container is broken; then `None` is returned.
pub(super) fn split(file: &Blob, expect_glb: bool, findings: &mut Findings) -> Option<Container> {
    if file.read(0, 4).is_ok_and(|magic| &*magic == MAGIC) || expect_glb {
        split_glb(file, findings)
    } else {
        Some(Container { json: file.clone(), bin: None, is_glb: false })
    }
}

fn u32_at(file: &Blob, at: u64) -> Option<u32> {
    let four = file.read(at, 4).ok()?;
    four.first_chunk().map(|&four| u32::from_le_bytes(four))
}

/// The header, then chunk after chunk.
fn split_glb(file: &Blob, findings: &mut Findings) -> Option<Container> {
    let total = check_header(file, findings)?;
    let mut chunks = Chunks::default();
    let mut at = 12;
    while at < total.min(file.len()) {
        let (Some(length), Some(kind)) = (u32_at(file, at), u32_at(file, at + 4)) else {
            findings.error(
                "GLB_UNEXPECTED_END_OF_CHUNK_HEADER",
                "the file ends within a chunk header",
                &byte(at),
                "",
            );
            return None;
        };
        let length = u64::from(length);
        check_length(length, at, total, findings);
        let Some(data) = file.part(at + 8, length) else {
            findings.error(
                "GLB_UNEXPECTED_END_OF_CHUNK_DATA",
                "the file ends within a chunk",
                &byte(at),
                "the file is cut off",
            );
            return None;
        };
        chunks.add(kind, data, at, findings);
        at += 8 + length;
    }
    finish(chunks, file.len(), total, findings)
}

fn byte(at: u64) -> String {
    format!("byte {at}")
}

/// Magic, version and length; returns the declared length.
fn check_header(file: &Blob, findings: &mut Findings) -> Option<u64> {
    let (Some(magic), Some(version), Some(length)) =
        (file.read(0, 4).ok(), u32_at(file, 4), u32_at(file, 8).map(u64::from))
    else {
        findings.error(
            "GLB_UNEXPECTED_END_OF_HEADER",
            "the file ends within the GLB header",
            "byte 0",
            "the file is empty or cut off",
        );
        return None;
    };
    if *magic != *MAGIC {
        findings.error(
            "GLB_INVALID_MAGIC",
            "the file does not start with \"glTF\"",
            "byte 0",
            "it is no GLB file",
        );
        return None;
    }
    if version != 2 {
        let hint = "only glTF 2.0 is read";
        findings.error("GLB_INVALID_VERSION", format!("the GLB version is {version}, not 2"), "byte 4", hint);
        return None;
    }
    if length <= 12 {
        let what = format!("the declared length is {length}, too small for any content");
        findings.error("GLB_LENGTH_TOO_SMALL", what, "byte 8", "");
        return None;
    }
    Some(length)
}

fn check_length(length: u64, at: u64, total: u64, findings: &mut Findings) {
    if !length.is_multiple_of(4) {
        let what = format!("the chunk's length {length} is not a multiple of 4");
        findings.error("GLB_CHUNK_LENGTH_UNALIGNED", what, &byte(at), "");
    }
    if length > total.saturating_sub(at + 8) {
        let what = format!("the chunk of {length} bytes does not fit the file's declared length {total}");
        findings.error("GLB_CHUNK_TOO_BIG", what, &byte(at), "");
    }
}

fn finish(chunks: Chunks, actual: u64, total: u64, findings: &mut Findings) -> Option<Container> {
    if actual < total {
        let what = format!("the header declares {total} bytes, the file has {actual}");
        findings.error("GLB_LENGTH_MISMATCH", what, "byte 8", "the file is cut off");
    } else if actual > total {
        let what = format!("{} bytes follow the end of the GLB", actual - total);
        findings.warn("GLB_EXTRA_DATA", what, &byte(total), "they are ignored");
    }
    let json = chunks.json.filter(|json| json.len() > 0)?;
    Some(Container { json, bin: chunks.bin, is_glb: true })
}

/// The chunks found so far.
#[derive(Default)]
struct Chunks {
    json: Option<Blob>,
    bin: Option<Blob>,
    count: usize,
}

impl Chunks {
    fn add(&mut self, kind: u32, data: Blob, at: u64, findings: &mut Findings) {
        let place = byte(at);
        if self.count == 0 && kind != JSON {
            let what = format!("the first chunk is of type 0x{kind:08x}, not JSON");
            findings.error("GLB_UNEXPECTED_FIRST_CHUNK", what, &place, "");
        }
        if kind == BIN && self.count > 1 && self.bin.is_none() {
            findings.error("GLB_UNEXPECTED_BIN_CHUNK", "the BIN chunk is not the second chunk", &place, "");
        }
        match kind {
            JSON if data.len() == 0 => {
                findings.error("GLB_EMPTY_CHUNK", "the JSON chunk is empty", &place, "");
                self.keep_json(data, &place, findings);
            }
            JSON => self.keep_json(data, &place, findings),
            BIN if self.bin.is_some() => duplicate("BIN", &place, findings),
            BIN => self.bin = Some(data),
            _ => findings.warn(
                "GLB_UNKNOWN_CHUNK_TYPE",
                format!("a chunk has the unknown type 0x{kind:08x}"),
                &place,
                "it is ignored",
            ),
        }
        self.count += 1;
    }

    fn keep_json(&mut self, data: Blob, place: &str, findings: &mut Findings) {
        if self.json.is_some() {
            duplicate("JSON", place, findings);
        } else {
            self.json = Some(data);
        }
    }
}

fn duplicate(name: &str, place: &str, findings: &mut Findings) {
    findings.error("GLB_DUPLICATE_CHUNK", format!("there is a second {name} chunk"), place, "");
}
