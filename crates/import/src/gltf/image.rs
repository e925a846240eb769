//! Images: where their bytes stand, what format they have, and decoding them in parallel.

use super::accessor::{Data, Fault};
use super::buffers::shorten;
use super::findings::Findings;
use super::json::Json;
use super::uri::{self, Uri};
use crate::blob::open_file;
use crate::texels::{Deferral, ImageBytes, ImageFile, ImageSize, Loaded};
use crate::{ErrorKind, Limits};
use rayon::prelude::*;
use std::path::Path;
use vastlight_scene::{Image, Texels};

/// Decodes all images of the document, also those that nothing uses, so that their errors are found. None is decoded
/// if all together are beyond the limits; those that come row by row do not count.
pub(super) fn load_all(
    root: &Json<'_>,
    data: &Data,
    directory: &Path,
    limits: &Limits,
    deferral: &Deferral,
    findings: &mut Findings,
) -> Vec<Loaded> {
    let source = Source { data, directory, limits };
    let list = root.list("images");
    let later = match deferral.plan(&source.sizes(list), |_| false, limits, "/images") {
        Ok(later) => later,
        Err(error) => {
            findings.error("IMAGES_TOO_LARGE", error.what, &error.place, &error.hint);
            return list.iter().enumerate().map(|(i, json)| (magenta(json, i), None)).collect();
        }
    };
    let decoded: Vec<(Loaded, Findings)> = list
        .par_iter()
        .zip(&later)
        .enumerate()
        .map(|(i, (json, &later))| {
            let mut findings = Findings::default();
            let image = source.decode(json, i, later, &mut findings);
            (image.unwrap_or_else(|| (magenta(json, i), None)), findings)
        })
        .collect();
    let mut images = Vec::new();
    for (image, found) in decoded {
        findings.append(found);
        images.push(image);
    }
    images
}

/// How large the images of a document are, as far as their headers say.
pub(super) fn sizes(root: &Json<'_>, data: &Data, directory: &Path, limits: &Limits) -> Vec<ImageSize> {
    Source { data, directory, limits }.sizes(root.list("images"))
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
    fn file(&self, json: &Json<'_>, index: usize, findings: &mut Findings) -> Option<ImageFile> {
        let place = format!("/images/{index}");
        let bytes = match json.index("bufferView") {
            Some(view) => match self.data.view_part(view) {
                Ok(part) => ImageBytes::Part(part),
                Err(fault) => {
                    findings.fault("IMAGE_WITHOUT_DATA", Fault { place, ..fault });
                    return None;
                }
            },
            None => load_uri(json.at("uri").text()?, self.directory, self.limits, &place, findings)?,
        };
        Some(ImageFile { bytes, name: name_of(json, index), limits: *self.limits })
    }

    /// How large images are, as their headers say.
    fn sizes(&self, list: &[Json<'_>]) -> Vec<ImageSize> {
        let size = |(i, json)| {
            let file = self.file(json, i, &mut Findings::default());
            file.map_or(ImageSize::default(), |file| file.size())
        };
        list.par_iter().enumerate().map(size).collect()
    }

    fn decode(
        &self,
        json: &Json<'_>,
        index: usize,
        by_rows: bool,
        findings: &mut Findings,
    ) -> Option<Loaded> {
        let file = self.file(json, index, findings)?;
        let place = format!("/images/{index}");
        check_declared(json, &file.first_bytes().unwrap_or_default(), &place, findings);
        match file.load(by_rows) {
            Ok(loaded) => Some(loaded),
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

/// One magenta texel, which stands for an image that cannot be shown.
fn magenta(json: &Json<'_>, index: usize) -> Image {
    let texels = Texels::U8(vec![255, 0, 255]);
    Image { name: name_of(json, index), width: 1, height: 1, channels: 3, texels }
}

fn load_uri(
    uri: &str,
    directory: &Path,
    limits: &Limits,
    place: &str,
    findings: &mut Findings,
) -> Option<ImageBytes> {
    let place = format!("{place}/uri");
    match uri::resolve(uri, directory) {
        Uri::Data { media_type, bytes } => {
            if media_type_of(&bytes).is_some_and(|actual| !actual.eq_ignore_ascii_case(media_type)) {
                let what =
                    format!("the data URI of an image says \"{}\", which it is not", shorten(media_type));
                findings.error("INVALID_URI", what, &place, "");
            }
            Some(ImageBytes::Part(bytes.into()))
        }
        Uri::File(path) => match open_file(&path, limits.file_bytes) {
            Ok(_) => Some(ImageBytes::File(path)),
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
