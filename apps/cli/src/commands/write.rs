//! Scenes to files: stores and what other programs read, by extension.

use crate::arguments::Common;
use crate::interrupt;
use crate::progress::{ProgressKind, Reporter};
use serde_json::json;
use std::path::Path;
use std::time::Instant;
use vastlight::export::{self, ExportError};
use vastlight::film::check_writable;
use vastlight::scene::{Diagnostics, SceneError, SceneStream};
use vastlight::store::{PackConfig, StoreSize};
use vastlight::{
    Error, ErrorClass, LoadOptions, PackControl, human_bytes, load, pack_input, pack_within, peak_rss_bytes,
    stream,
};

/// Kinds of files that scenes are written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileKind {
    /// A store.
    Store,
    /// What other programs read.
    Exchange,
}

/// The kind of a file by its extension; refuses one that cannot be written.
pub(crate) fn kind_of(target: &Path) -> Result<FileKind, Error> {
    let extension = target.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let kind = match extension.as_str() {
        "vls" => FileKind::Store,
        known if export::FORMATS.contains(&known) => FileKind::Exchange,
        _ => {
            let hint = format!("write to one of .vls, .{}", export::FORMATS.join(", ."));
            return Err(Error::usage("unknown kind of scene file", target.display().to_string(), hint));
        }
    };
    check_writable(target)?;
    Ok(kind)
}

/// How a store is written.
pub(crate) struct StoreOptions {
    pub(crate) config: PackConfig,
    pub(crate) progress: ProgressKind,
    /// Whether one JSON object goes to stdout.
    pub(crate) json: bool,
}

/// Packs scenes to a store.
pub(crate) fn store(
    sources: &[String],
    load: &LoadOptions,
    target: &Path,
    options: &StoreOptions,
    common: &Common,
    start: Instant,
) -> Result<(), Error> {
    let input = pack_input(sources, load, common.memory)?;
    let reporter = Reporter::new(options.progress, common.quiet);
    let control = PackControl {
        memory: common.memory,
        cancel: interrupt::flag()?,
        progress: &|p| reporter.update_pack(p, start.elapsed()),
    };
    let size = pack_within(input, target, &options.config, control);
    reporter.finish();
    let (size, seconds) = (size?, start.elapsed().as_secs_f64());
    let place = target.display().to_string();
    if !common.quiet {
        eprintln!("{place}: {}", in_words(&size, seconds));
    }
    if options.json {
        let peak = peak_rss_bytes();
        println!("{}", json!({"pack": place, "size": size, "seconds": seconds, "peak_rss_bytes": peak}));
    }
    Ok(())
}

/// Writes a scene for other programs: a demo mesh by mesh, a file as a whole.
pub(crate) fn exchange(
    source: &str,
    options: &LoadOptions,
    target: &Path,
    common: &Common,
) -> Result<(), Error> {
    let (lost, triangles) = if source.starts_with("demo:") {
        // What is wrong with the request is found here, in the words of the request.
        stream(source, options)?;
        let make = || -> Result<SceneStream, SceneError> {
            stream(source, options).map_err(|e| SceneError::new(e.what, e.place, ""))
        };
        let written = export::write_stream(&make, target).map_err(|e| write_error(&e))?;
        (written.lost, written.triangles)
    } else {
        let scene = load(source, options)?;
        let lost: Diagnostics = export::write(&scene, target).map_err(|e| write_error(&e))?;
        (lost, scene.unique_triangles())
    };
    if !common.quiet {
        lost.items().iter().for_each(|item| eprintln!("warning: {item}"));
        eprintln!("{}: {triangles} triangles", target.display());
    }
    Ok(())
}

fn write_error(error: &ExportError) -> Error {
    let class = match error {
        ExportError::Implicit { .. } | ExportError::Scene(_) => ErrorClass::Scene,
        _ => ErrorClass::Output,
    };
    Error::new(class, error.to_string(), "", "")
}

fn in_words(size: &StoreSize, seconds: f64) -> String {
    let each = |bytes: u64| bytes as f64 / size.triangles.max(1) as f64;
    format!(
        "{} triangles in {}, {:.1} bytes a triangle (geometry {:.1}, attributes {:.1}), {} resident, {seconds:.1} s, {:.2} Mtri/s",
        size.triangles,
        human_bytes(size.file),
        each(size.file),
        each(size.geometry),
        each(size.attributes),
        human_bytes(size.resident),
        size.triangles as f64 / seconds / 1e6,
    )
}
