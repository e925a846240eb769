//! `vastlight bench texture STORE`: what lookups in textures cost through a cache of tiles of one size.

use super::ooc::Mode;
use crate::arguments::{Common, SceneArguments};
use crate::commands::render::PictureArguments;
use crate::exit::Exit;
use crate::interrupt;
use clap::Args;
use serde_json::json;
use vastlight::{Control, Error, OocFigures, measure_ooc, parse_bytes};

/// Frames of a scene in a store (.vls) with all geometry in memory and a cache of tiles of one size; `pack --tile-bytes` chooses the
/// size of tiles
#[derive(Args, Debug)]
pub(crate) struct Texture {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    picture: PictureArguments,
    /// Memory of the cache of tiles
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes, default_value = "100MiB")]
    tile_cache: u64,
    /// How light is computed
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values = ["primary", "direct", "path"])]
    mode: Vec<Mode>,
    /// Read past the kernel's page cache, so that the disk is the level behind the cache
    #[arg(long)]
    bypass: bool,
    /// Frames after the first; the best counts
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeat: u32,
}

pub(crate) fn run(arguments: &Texture, common: &Common) -> Result<Exit, Error> {
    let cancel = interrupt::flag()?;
    let mut options = arguments.scene.options(common)?;
    options.bypass_kernel_cache = arguments.bypass;
    let open = vastlight::open(&arguments.scene.scene, &options)?;
    let stored = open.stored.as_ref().filter(|stored| stored.tiles.pages() > 0);
    let Some(stored) = stored else {
        return Err(Error::usage(
            "no texture is in tiles",
            arguments.scene.shown(),
            "pack a scene with large textures",
        ));
    };
    let tile_bytes = stored.tiles.longest().map_or(0, |(_, entry)| entry.bytes);
    let control = Control::new(cancel, &|_| {});
    for &mode in &arguments.mode {
        let mut request = arguments.picture.request(&open.scene, Vec::new())?;
        mode.apply(&mut request);
        request.paging.tile_memory = Some(arguments.tile_cache);
        let print = |figures: &OocFigures| print_line(mode, (tile_bytes, arguments.tile_cache), figures);
        measure_ooc(&open, &request, &[1.0], arguments.repeat, &control, print)?;
    }
    Ok(Exit::Done)
}

/// Times are of all threads together; a transfer is the wait for a tile.
fn print_line(mode: Mode, (tile_bytes, tile_cache): (u32, u64), figures: &OocFigures) {
    let Some(tiles) = &figures.paging.tiles else { return };
    let line = json!({
        "bench": "texture",
        "mode": mode.name(),
        "tile_bytes": tile_bytes,
        "tile_cache_bytes": tile_cache,
        "filter_ms": figures.filter_ms,
        "transfer_ms": tiles.stall_ms,
        "hit_rate": tiles.hit_rate(),
        "tiles_read": tiles.misses,
        "bytes_read": tiles.bytes_read,
        "resident_tiles": tiles.resident_pages,
        "frame_ms": figures.frame_ms,
        "cold_ms": figures.cold_ms,
        "rays": figures.rays,
    });
    println!("{line}");
}
