//! From the bytes of a file to its JSON text and, in GLB, its binary chunk.

use super::findings::Findings;

/// The parts of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Container<'a> {
    /// The JSON text.
    pub(super) json: &'a [u8],
    /// The BIN chunk of a GLB.
    pub(super) bin: Option<&'a [u8]>,
    /// Whether the file is a GLB.
    pub(super) is_glb: bool,
}

const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// Splits a file. Findings are errors where the container is broken; then `None` is returned.
pub(super) fn split<'a>(bytes: &'a [u8], expect_glb: bool, findings: &mut Findings) -> Option<Container<'a>> {
    if bytes.starts_with(MAGIC) || expect_glb {
        split_glb(bytes, findings)
    } else {
        Some(Container { json: bytes, bin: None, is_glb: false })
    }
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes([four[0], four[1], four[2], four[3]]))
}

/// The header, then chunk after chunk.
fn split_glb<'a>(bytes: &'a [u8], findings: &mut Findings) -> Option<Container<'a>> {
    let total = check_header(bytes, findings)?;
    let mut chunks = Chunks::default();
    let mut at = 12;
    while at < total.min(bytes.len()) {
        let (Some(length), Some(kind)) = (u32_at(bytes, at), u32_at(bytes, at + 4)) else {
            findings.error(
                "GLB_UNEXPECTED_END_OF_CHUNK_HEADER",
                "the file ends within a chunk header",
                &byte(at),
                "",
            );
            return None;
        };
        let length = length as usize;
        check_length(length, at, total, findings);
        let Some(data) = bytes.get(at + 8..).and_then(|rest| rest.get(..length)) else {
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
    finish(&chunks, bytes.len(), total, findings)
}

fn byte(at: usize) -> String {
    format!("byte {at}")
}

/// Magic, version and length; returns the declared length.
fn check_header(bytes: &[u8], findings: &mut Findings) -> Option<usize> {
    let (Some(magic), Some(version), Some(length)) =
        (bytes.get(..4), u32_at(bytes, 4), u32_at(bytes, 8).map(|n| n as usize))
    else {
        findings.error(
            "GLB_UNEXPECTED_END_OF_HEADER",
            "the file ends within the GLB header",
            "byte 0",
            "the file is empty or cut off",
        );
        return None;
    };
    if magic != MAGIC {
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

fn check_length(length: usize, at: usize, total: usize, findings: &mut Findings) {
    if !length.is_multiple_of(4) {
        let what = format!("the chunk's length {length} is not a multiple of 4");
        findings.error("GLB_CHUNK_LENGTH_UNALIGNED", what, &byte(at), "");
    }
    if length > total.saturating_sub(at + 8) {
        let what = format!("the chunk of {length} bytes does not fit the file's declared length {total}");
        findings.error("GLB_CHUNK_TOO_BIG", what, &byte(at), "");
    }
}

fn finish<'a>(
    chunks: &Chunks<'a>,
    actual: usize,
    total: usize,
    findings: &mut Findings,
) -> Option<Container<'a>> {
    if actual < total {
        let what = format!("the header declares {total} bytes, the file has {actual}");
        findings.error("GLB_LENGTH_MISMATCH", what, "byte 8", "the file is cut off");
    } else if actual > total {
        let what = format!("{} bytes follow the end of the GLB", actual - total);
        findings.warn("GLB_EXTRA_DATA", what, &byte(total), "they are ignored");
    }
    let json = chunks.json.filter(|json| !json.is_empty())?;
    Some(Container { json, bin: chunks.bin, is_glb: true })
}

/// The chunks found so far.
#[derive(Default)]
struct Chunks<'a> {
    json: Option<&'a [u8]>,
    bin: Option<&'a [u8]>,
    count: usize,
}

impl<'a> Chunks<'a> {
    fn add(&mut self, kind: u32, data: &'a [u8], at: usize, findings: &mut Findings) {
        let place = byte(at);
        if self.count == 0 && kind != JSON {
            let what = format!("the first chunk is of type 0x{kind:08x}, not JSON");
            findings.error("GLB_UNEXPECTED_FIRST_CHUNK", what, &place, "");
        }
        if kind == BIN && self.count > 1 && self.bin.is_none() {
            findings.error("GLB_UNEXPECTED_BIN_CHUNK", "the BIN chunk is not the second chunk", &place, "");
        }
        match kind {
            JSON if data.is_empty() => {
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

    fn keep_json(&mut self, data: &'a [u8], place: &str, findings: &mut Findings) {
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
