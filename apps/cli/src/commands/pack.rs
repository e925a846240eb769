//! `vastlight pack SCENE... -o FILE.vls`: one or several scenes as a store.

use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use crate::interrupt;
use crate::progress::{ProgressKind, Reporter};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;
use vastlight::film::check_writable;
use vastlight::store::{PackConfig, PageStrategy, StoreSize};
use vastlight::{Error, PackControl, human_bytes, pack_input, pack_within, peak_rss_bytes};

/// Pack a scene to a store (.vls), which is rendered within any memory budget; a pack that was stopped goes on when it is
/// started again
#[derive(Args, Debug)]
pub(crate) struct Pack {
    #[command(flatten)]
    scene: SceneArguments,
    /// More scenes for the same store
    #[arg(value_name = "SCENE")]
    more: Vec<String>,
    /// Progress on stderr
    #[arg(long, value_name = "KIND", default_value = "auto")]
    progress: ProgressKind,
    /// The store: .vls
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Acceleration structure by name
    #[arg(long, value_name = "NAME", default_value = "")]
    accel: String,
    /// Most references to triangles, as a multiple of the triangles: more make rays faster among long thin triangles, and the
    /// store larger
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    split_budget: f32,
    /// What a page is: subtrees of one tree, or the published blocks of triangles in Morton order
    #[arg(long, value_name = "NAME", default_value = PageStrategy::NAMES[0], value_parser = PageStrategy::NAMES)]
    strategy: String,
    /// Most bytes of a page of geometry
    #[arg(long, value_name = "BYTES", default_value_t = PackConfig::default().page_bytes)]
    page_bytes: usize,
    /// Most bytes of a tile of a texture
    #[arg(long, value_name = "BYTES", default_value_t = PackConfig::default().tile_bytes)]
    tile_bytes: usize,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Pack, common: &Common, start: Instant) -> Result<Exit, Error> {
    let place = arguments.output.display().to_string();
    if !arguments.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("vls")) {
        return Err(Error::usage("stores end in .vls", place, ""));
    }
    check_writable(&arguments.output)?;
    let sources: Vec<String> = [&arguments.scene.scene].into_iter().chain(&arguments.more).cloned().collect();
    let input = pack_input(&sources, &arguments.scene.options(common)?, common.memory)?;
    let reporter = Reporter::new(arguments.progress, common.quiet);
    let control = PackControl {
        memory: common.memory,
        cancel: interrupt::flag()?,
        progress: &|p| reporter.update_pack(p, start.elapsed()),
    };
    let size = pack_within(input, &arguments.output, &arguments.config(), control);
    reporter.finish();
    let size = size?;
    let seconds = start.elapsed().as_secs_f64();
    if !common.quiet {
        eprintln!("{place}: {}", in_words(&size, seconds));
    }
    if arguments.json {
        let peak = peak_rss_bytes();
        println!("{}", json!({"pack": place, "size": size, "seconds": seconds, "peak_rss_bytes": peak}));
    }
    Ok(Exit::Done)
}

impl Pack {
    fn config(&self) -> PackConfig {
        PackConfig {
            accel: self.accel.clone(),
            split_budget: Some(self.split_budget),
            strategy: PageStrategy::from_name(&self.strategy).unwrap_or_default(),
            page_bytes: self.page_bytes,
            tile_bytes: self.tile_bytes,
        }
    }
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
