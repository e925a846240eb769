//! Images: where their bytes stand, and decoding them in parallel.

use super::accessor::{Data, Fault};
use super::buffers::read_file;
use super::findings::Findings;
use super::json::Json;
use super::uri::{self, Uri};
use crate::{ErrorKind, Limits};
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::Path;
use vastlight_scene::{Image, Texels};

/// Decodes the images of that numbers. One that cannot be decoded becomes a single magenta texel with a finding.
pub(super) fn load_all(
    root: &Json<'_>,
    data: &Data<'_>,
    numbers: &[usize],
    directory: &Path,
    limits: &Limits,
    findings: &mut Findings,
) -> Vec<Image> {
    let decoded: Vec<(Image, Findings)> =
        numbers.par_iter().map(|&i| load_one(root, data, i, directory, limits)).collect();
    let mut images = Vec::new();
    for (image, found) in decoded {
        findings.append(found);
        images.push(image);
    }
    images
}

fn load_one(
    root: &Json<'_>,
    data: &Data<'_>,
    index: usize,
    directory: &Path,
    limits: &Limits,
) -> (Image, Findings) {
    let mut findings = Findings::default();
    let place = format!("/images/{index}");
    let json = root.list("images").get(index);
    let name = json.map_or_else(String::new, |json| name_of(json, index));
    let bytes = json.map_or_else(
        || Err(Fault::new("the image does not exist", &place, "")),
        |json| bytes_of(json, data, directory, limits, &place),
    );
    let image = match bytes {
        Ok(bytes) => match crate::decode_image(&bytes, &name, limits) {
            Ok(image) => image,
            Err(error) if error.kind == ErrorKind::UnknownFormat => {
                let hint = "it is shown in magenta";
                findings.warn("IMAGE_UNRECOGNIZED_FORMAT", "the image has an unknown format", &place, hint);
                placeholder(&name)
            }
            Err(error) => {
                findings.error("IMAGE_DATA_INVALID", error.what, &place, "");
                placeholder(&name)
            }
        },
        Err(fault) => {
            findings.error("IMAGE_WITHOUT_DATA", fault.what, &fault.place, fault.hint);
            placeholder(&name)
        }
    };
    (image, findings)
}

fn name_of(json: &Json<'_>, index: usize) -> String {
    let uri = json.at("uri").text().filter(|uri| !uri.starts_with("data:"));
    let name = json.at("name").text().filter(|name| !name.is_empty());
    name.or(uri).map_or_else(|| format!("image {index}"), str::to_owned)
}

fn placeholder(name: &str) -> Image {
    Image { name: name.to_owned(), width: 1, height: 1, channels: 3, texels: Texels::U8(vec![255, 0, 255]) }
}

/// The encoded bytes of an image.
pub(super) fn bytes_of<'d>(
    json: &Json<'_>,
    data: &'d Data<'_>,
    directory: &Path,
    limits: &Limits,
    place: &str,
) -> Result<Cow<'d, [u8]>, Fault> {
    if let Some(view) = json.index("bufferView") {
        return data.view_bytes(view).map(Cow::Borrowed);
    }
    let place = format!("{place}/uri");
    match uri::resolve(json.at("uri").text().unwrap_or_default(), directory) {
        Uri::Data { bytes, .. } => Ok(Cow::Owned(bytes)),
        Uri::File(path) => read_file(&path, limits.file_bytes).map(Cow::Owned).map_err(|error| {
            let what = format!("the file \"{}\" cannot be read: {error}", path.display());
            Fault::new(what, place, "external files stand beside the document")
        }),
        Uri::Remote => {
            Err(Fault::new("the image is no file beside the document", place, "nothing is fetched"))
        }
        Uri::Invalid(why) => Err(Fault::new(format!("the URI is invalid: {why}"), place, "")),
    }
}
