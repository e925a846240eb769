//! `vastlight bench path SCENE`.

use crate::arguments::{Common, SceneArguments};
use crate::commands::render::PictureArguments;
use crate::exit::Exit;
use crate::interrupt;
use clap::Args;
use serde_json::json;
use std::time::Instant;
use vastlight::trace::Layout;
use vastlight::{Control, Error, check_request, peak_rss_bytes};

/// Render without writing: samples a second, and the time from process start to the first whole picture
#[derive(Args, Debug)]
pub(crate) struct Path {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    picture: PictureArguments,
    /// Times it is rendered; the best rate and the first process's first picture count
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeat: u32,
    /// How meshes lie in memory: compact is what a store has
    #[arg(long, value_name = "NAME", default_value = Layout::NAMES[0], value_parser = Layout::NAMES)]
    layout: String,
}

pub(crate) fn run(arguments: &Path, common: &Common, start: Instant) -> Result<Exit, Error> {
    let cancel = interrupt::flag()?;
    let open = arguments.scene.open(common)?;
    let load_ms = start.elapsed().as_secs_f64() * 1e3;
    let mut request = arguments.picture.request(&open.scene, Vec::new())?;
    request.paging.memory = common.memory;
    request.device = common.device_request();
    request.tracer.layout = Layout::from_name(&arguments.layout).unwrap_or_default();
    check_request(&open, &request, 0)?;
    let control = Control::new(cancel, &|_| {});
    let first = vastlight::render(&open, &request, &control)?.stats;
    let first_image_ms = load_ms + first.build_ms + first.prepare_ms + first.first_pass_ms;
    let mut best = first;
    for _ in 1..arguments.repeat {
        let stats = vastlight::render(&open, &request, &control)?.stats;
        if stats.msamples_per_s > best.msamples_per_s {
            best = stats;
        }
    }
    let line = json!({
        "bench": "path",
        "device": best.device,
        "adapter": best.adapter,
        "simd": best.simd,
        "threads": best.threads,
        "width": best.width,
        "height": best.height,
        "spp": best.spp_done,
        "samples": best.samples,
        "msamples_per_s": best.msamples_per_s,
        "mrays_per_s": (best.rays + best.shadow_rays) as f64 / 1e3 / best.render_ms.max(1e-6),
        "first_image_ms": first_image_ms,
        "load_ms": load_ms,
        "build_ms": best.build_ms,
        "render_ms": best.render_ms,
        "non_finite": best.non_finite,
        "peak_rss_bytes": peak_rss_bytes(),
    });
    println!("{line}");
    Ok(if best.ending == vastlight::Ending::Interrupted { Exit::Interrupted } else { Exit::Done })
}
