//! Checks of the document as a whole: versions, extensions, scenes.

use crate::gltf::extensions::{self, Support};
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;

/// Checks `asset`, `extensionsUsed` and `extensionsRequired`.
pub(super) fn check(root: &Json<'_>, findings: &mut Findings) {
    check_version(root.at("asset"), findings);
    check_used(root, findings);
    check_required(root, findings);
}

/// `major.minor`
fn parse_version(text: &str) -> Option<(u32, u32)> {
    let (major, minor) = text.split_once('.')?;
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    if digits(major) && digits(minor) { Some((major.parse().ok()?, minor.parse().ok()?)) } else { None }
}

fn check_version(asset: &Json<'_>, findings: &mut Findings) {
    let mut version_of = |key: &str| {
        let text = asset.at(key).text()?;
        let version = parse_version(text);
        if version.is_none() {
            let what = format!("\"{}\" is no version such as 2.0", crate::gltf::buffers::shorten(text));
            findings.error("PATTERN_MISMATCH", what, &format!("/asset/{key}"), "");
        }
        version
    };
    let (version, min_version) = (version_of("version"), version_of("minVersion"));
    let place = "/asset/version";
    match version {
        Some((major, minor)) if major != 2 => {
            let what = format!("the file is of glTF {major}.{minor}");
            findings.error("UNKNOWN_ASSET_MAJOR_VERSION", what, place, "only glTF 2.0 is read");
        }
        Some((_, minor)) if minor > 0 => {
            let what = format!("the file is of glTF 2.{minor}");
            findings.warn("UNKNOWN_ASSET_MINOR_VERSION", what, place, "it is read as glTF 2.0");
        }
        _ => {}
    }
    if let (Some(version), Some(min_version)) = (version, min_version)
        && min_version > version
    {
        let what = "minVersion is greater than version";
        findings.error("ASSET_MIN_VERSION_GREATER_THAN_VERSION", what, "/asset/minVersion", "");
    }
}

/// One warning for each extension that is not supported, or only in part.
fn check_used(root: &Json<'_>, findings: &mut Findings) {
    let required: Vec<&str> = root.list("extensionsRequired").iter().filter_map(Json::text).collect();
    for (i, name) in root.list("extensionsUsed").iter().enumerate() {
        let Some(name) = name.text() else { continue };
        let place = format!("/extensionsUsed/{i}");
        if !well_named(name) {
            let what = format!("\"{name}\" is no name of an extension, such as KHR_lights_punctual");
            findings.warn("INVALID_EXTENSION_NAME_FORMAT", what, &place, "");
        }
        match extensions::support(name) {
            Support::Full => {}
            Support::Partial(note) => {
                findings.warn("PARTLY_SUPPORTED_EXTENSION", format!("{name}: {note}"), &place, "");
            }
            Support::None if required.contains(&name) => {}
            Support::None => {
                let what = format!("the extension {name} is not supported");
                findings.warn("UNSUPPORTED_EXTENSION", what, &place, "it is ignored");
            }
        }
    }
}

fn check_required(root: &Json<'_>, findings: &mut Findings) {
    let used = root.list("extensionsUsed");
    for (i, name) in root.list("extensionsRequired").iter().enumerate() {
        let Some(text) = name.text() else { continue };
        let place = format!("/extensionsRequired/{i}");
        if !used.contains(name) {
            let what = format!("{text} is required, but not in extensionsUsed");
            findings.error("UNUSED_EXTENSION_REQUIRED", what, &place, "");
        }
        if matches!(extensions::support(text), Support::None) {
            let what = format!("the file requires the extension {text}, which is not supported");
            let hint = "export the file without it; docs/gltf.md lists what is read";
            findings.error("UNSUPPORTED_REQUIRED_EXTENSION", what, &place, hint);
        }
    }
}

/// A prefix of capitals and digits, an underscore, and a name.
fn well_named(name: &str) -> bool {
    let Some((prefix, rest)) = name.split_once('_') else { return false };
    !prefix.is_empty()
        && prefix.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit())
        && !rest.is_empty()
        && rest.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}
