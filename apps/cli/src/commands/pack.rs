//! `vastlight pack SCENE... -o FILE.vls`: one or several scenes as a store.

use crate::arguments::{Common, SceneArguments};
use crate::commands::write::{self, FileKind, StoreOptions, kind_of};
use crate::exit::Exit;
use crate::progress::ProgressKind;
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;
use vastlight::store::{PackConfig, PageStrategy};
use vastlight::{Error, parse_bytes};

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
    /// The store: .vls; or a file for other programs: .glb, .ply, .obj
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
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes, default_value_t = PackConfig::default().page_bytes as u64)]
    page_bytes: u64,
    /// Most bytes of a tile of a texture
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes, default_value_t = PackConfig::default().tile_bytes as u64)]
    tile_bytes: u64,
    /// One JSON object on stdout
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Pack, common: &Common, start: Instant) -> Result<Exit, Error> {
    let (target, load) = (&arguments.output, arguments.scene.options(common)?);
    match kind_of(target)? {
        FileKind::Store => {
            let sources: Vec<String> =
                [&arguments.scene.scene].into_iter().chain(&arguments.more).cloned().collect();
            let (config, progress) = (arguments.config(), arguments.progress);
            let options = StoreOptions { config, progress, json: arguments.json };
            write::store(&sources, &load, target, &options, common, start)?;
        }
        FileKind::Exchange if arguments.more.is_empty() => {
            write::exchange(&arguments.scene.scene, &load, target, common)?;
        }
        FileKind::Exchange => {
            let place = target.display().to_string();
            return Err(Error::usage("several scenes go into a store", place, "name a .vls file"));
        }
    }
    Ok(Exit::Done)
}

impl Pack {
    fn config(&self) -> PackConfig {
        PackConfig {
            accel: self.accel.clone(),
            split_budget: Some(self.split_budget),
            strategy: PageStrategy::from_name(&self.strategy).unwrap_or_default(),
            page_bytes: self.page_bytes as usize,
            tile_bytes: self.tile_bytes as usize,
        }
    }
}
