//! Images: where their bytes stand, what format they have, and decoding them in parallel.

use super::accessor::{Data, Fault};
use super::blob::read_file;
use super::buffers::shorten;
use super::findings::Findings;
use super::json::Json;
use super::uri::{self, Uri};
use crate::{ErrorKind, Limits};
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::Path;
use vastlight_scene::{Image, Texels};

/// Decodes all images of the document, also those that nothing uses, so that their errors are found. None is decoded
/// if all together are beyond the limits.
pub(super) fn load_all(
    root: &Json<'_>,
    data: &Data,
    directory: &Path,
    limits: &Limits,
    findings: &mut Findings,
) -> Vec<Image> {
    let source = Source { data, directory, limits };
    let list = root.list("images");
    let sizes = list.par_iter().enumerate().map(|(i, json)| source.decoded_bytes(json, i));
    let total = sizes.reduce(|| 0, u64::saturating_add);
    if let Err(error) = limits.check_all_images(total, "/images") {
        findings.error("IMAGES_TOO_LARGE", error.what, &error.place, &error.hint);
        return list.iter().enumerate().map(|(i, json)| placeholder(json, i)).collect();
    }
    let decoded: Vec<(Image, Findings)> = list
        .par_iter()
        .enumerate()
        .map(|(i, json)| {
            let mut findings = Findings::default();
            let image = source.decode(json, i, &mut findings);
            (image.unwrap_or_else(|| placeholder(json, i)), findings)
        })
        .collect();
    let mut images = Vec::new();
    for (image, found) in decoded {
        findings.append(found);
        images.push(image);
    }
    images
}

/// Where images come from.
#[derive(Clone, Copy)]
struct Source<'a> {
    data: &'a Data,
    directory: &'a Path,
    limits: &'a Limits,
}

impl Source<'_> {
    /// The file of an image.
    fn bytes(&self, json: &Json<'_>, index: usize, findings: &mut Findings) -> Option<Cow<'_, [u8]>> {
        let place = format!("/images/{index}");
        match json.index("bufferView") {
            Some(view) => match self.data.view_bytes(view) {
                Ok(bytes) => Some(bytes),
                Err(fault) => {
                    findings.fault("IMAGE_WITHOUT_DATA", Fault { place, ..fault });
                    None
                }
            },
            None => {
                let uri = json.at("uri").text()?;
                Some(Cow::Owned(load_uri(uri, self.directory, self.limits, &place, findings)?))
            }
        }
    }

    /// Bytes of an image's texels as its header says; 0 if it says nothing, which decoding will report.
    fn decoded_bytes(&self, json: &Json<'_>, index: usize) -> u64 {
        let bytes = self.bytes(json, index, &mut Findings::default());
        bytes.map_or(0, |bytes| crate::texels::decoded_bytes(&bytes, "").unwrap_or(0))
    }

    fn decode(&self, json: &Json<'_>, index: usize, findings: &mut Findings) -> Option<Image> {
        let bytes = self.bytes(json, index, findings)?;
        let place = format!("/images/{index}");
        check_declared(json, &bytes, &place, findings);
        match crate::decode_image(&bytes, &name_of(json, index), self.limits) {
            Ok(image) => Some(image),
            Err(error) if error.kind == ErrorKind::UnknownFormat => {
                let what = "the image has an unknown format";
                findings.warn("IMAGE_UNRECOGNIZED_FORMAT", what, &place, "it is shown in magenta");
                None
            }
            Err(error) => {
                findings.error("IMAGE_DATA_INVALID", error.what, &place, "");
                None
            }
        }
    }
}

fn name_of(json: &Json<'_>, index: usize) -> String {
    let uri = json.at("uri").text().filter(|uri| !uri.starts_with("data:"));
    let name = json.at("name").text().filter(|name| !name.is_empty());
    name.or(uri).map_or_else(|| format!("image {index}"), str::to_owned)
}

/// One magenta texel.
fn placeholder(json: &Json<'_>, index: usize) -> Image {
    let texels = Texels::U8(vec![255, 0, 255]);
    Image { name: name_of(json, index), width: 1, height: 1, channels: 3, texels }
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
            if media_type_of(&bytes).is_some_and(|actual| !actual.eq_ignore_ascii_case(media_type)) {
                let what =
                    format!("the data URI of an image says \"{}\", which it is not", shorten(media_type));
                findings.error("INVALID_URI", what, &place, "");
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
            findings.warn("NON_RELATIVE_URI", what, &place, "the image is shown in magenta");
            None
        }
        Uri::Invalid(why) => {
            let what = format!("the URI \"{}\" is invalid: {why}", shorten(uri));
            findings.error("INVALID_URI", what, &place, "");
            None
        }
    }
}

/// The declared format is the actual one.
fn check_declared(json: &Json<'_>, bytes: &[u8], place: &str, findings: &mut Findings) {
    let (Some(declared), Some(actual)) = (json.at("mimeType").text(), media_type_of(bytes)) else { return };
    if declared != actual {
        let what = format!("the image is declared as {}, it is {actual}", shorten(declared));
        findings.error("IMAGE_MIME_TYPE_INVALID", what, place, "");
    }
}

/// The format by its first bytes.
fn media_type_of(bytes: &[u8]) -> Option<&'static str> {
    let starts = |magic: &[u8]| bytes.starts_with(magic);
    match () {
        () if starts(b"\x89PNG\r\n\x1a\n") => Some("image/png"),
        () if starts(b"\xff\xd8\xff") => Some("image/jpeg"),
        () if starts(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") => Some("image/webp"),
        () if starts(b"\xabKTX 20\xbb\r\n\x1a\n") => Some("image/ktx2"),
        () => None,
    }
}
