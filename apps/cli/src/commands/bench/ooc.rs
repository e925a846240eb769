//! `vastlight bench ooc STORE`: frames through caches of a part of the store.

use crate::arguments::{Common, SceneArguments};
use crate::commands::render::PictureArguments;
use crate::exit::Exit;
use crate::interrupt;
use clap::{Args, ValueEnum};
use serde_json::json;
use vastlight::accel::wide::GridBvh;
use vastlight::math::Affine3;
use vastlight::paging::PolicyKind;
use vastlight::scene::{Camera, Scene};
use vastlight::trace::TopLevel;
use vastlight::transport::Integrator;
use vastlight::{
    CacheCounts, Control, Error, OocFigures, PagingRequest, RenderRequest, measure_ooc, peak_rss_bytes,
};

/// Frames of a scene in a store (.vls) through caches that hold a part of it
#[derive(Args, Debug)]
pub(crate) struct Ooc {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    picture: PictureArguments,
    /// Parts of the pages that may be in memory at once, the first to compare the others with
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [1.0, 0.333, 0.1, 0.05, 0.02, 0.01, 0.001])]
    cache_fraction: Vec<f32>,
    /// From where: far sees the whole bounds, near is the camera chosen, or one nearer than far where the scene has none
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values = ["far", "near"])]
    view: Vec<View>,
    /// How light is computed
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values = ["primary", "direct", "path"])]
    mode: Vec<Mode>,
    /// Batches of paths for each thread: some wait for pages while others compute
    #[arg(long, value_name = "N", default_value_t = PagingRequest::default().batches_per_thread)]
    batches: usize,
    /// Paths of a batch [default: what the memory allows]
    #[arg(long, value_name = "N")]
    batch_paths: Option<u64>,
    /// Which page leaves when room is needed: lfu (as published), clock, lru-2 or s3-fifo
    #[arg(long, value_name = "NAME", default_value = PolicyKind::default().name(), value_parser = policy)]
    policy: PolicyKind,
    /// What is above the pages: tree, or as published grid:N, with N cells along each axis
    #[arg(long, value_name = "TOP", default_value = "tree", value_parser = top_level)]
    top: TopLevel,
    /// Trace every ray by itself, as with a grid
    #[arg(long)]
    single_rays: bool,
    /// Read past the kernel's page cache, so that the disk is the level behind the cache
    #[arg(long)]
    bypass: bool,
    /// Frames after the first; the best counts
    #[arg(long, value_name = "N", default_value_t = 1)]
    repeat: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum View {
    Far,
    Near,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// Camera rays alone
    Primary,
    /// Direct light
    Direct,
    /// Paths of three bounces
    Path,
}

impl View {
    fn camera(self, own: &Camera, scene: &Scene) -> Camera {
        let far = Camera::framing(&scene.bounds());
        match self {
            Self::Far => far,
            Self::Near if own.world_from_camera != far.world_from_camera => own.clone(),
            Self::Near => {
                let to_center = scene.bounds().center() - far.world_from_camera.translation;
                let nearer = Affine3::from_translation(to_center * 0.7);
                Camera { world_from_camera: nearer * far.world_from_camera, ..far }
            }
        }
    }

    fn name(self) -> &'static str {
        if self == Self::Far { "far" } else { "near" }
    }
}

impl Mode {
    pub(super) fn apply(self, request: &mut RenderRequest) {
        let (integrator, depth) = match self {
            Self::Primary => (Integrator::Primary, 1),
            Self::Direct => (Integrator::Direct, 2),
            Self::Path => (Integrator::Path, 4),
        };
        (request.settings.integrator, request.settings.max_depth) = (integrator, depth);
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Direct => "direct",
            Self::Path => "path",
        }
    }
}

fn policy(name: &str) -> Result<PolicyKind, String> {
    let known = PolicyKind::ALL.into_iter().find(|kind| kind.name() == name);
    known.ok_or_else(|| format!("known are {}", PolicyKind::ALL.map(PolicyKind::name).join(", ")))
}

fn top_level(name: &str) -> Result<TopLevel, String> {
    let cells = |n: &str| n.parse().ok().filter(|n| (1..=GridBvh::MOST_PER_AXIS as u32).contains(n));
    match name.strip_prefix("grid:") {
        None if name == "tree" => Ok(TopLevel::Tree),
        Some(n) if let Some(n) = cells(n) => Ok(TopLevel::Grid(n)),
        _ => Err(format!("known are tree and grid:1 to grid:{}", GridBvh::MOST_PER_AXIS)),
    }
}

pub(crate) fn run(arguments: &Ooc, common: &Common) -> Result<Exit, Error> {
    let cancel = interrupt::flag()?;
    let mut options = arguments.scene.options(common)?;
    options.bypass_kernel_cache = arguments.bypass;
    let open = vastlight::open(&arguments.scene.scene, &options)?;
    let strategy = open.stored.as_ref().map_or("", |stored| stored.strategy.name());
    let control = Control::new(cancel, &|_| {});
    let top = match arguments.top {
        TopLevel::Tree => "tree".to_owned(),
        TopLevel::Grid(n) => format!("grid:{n}"),
    };
    for &view in &arguments.view {
        for &mode in &arguments.mode {
            let mut request = arguments.picture.request(&open.scene, Vec::new())?;
            request.settings.camera = view.camera(&request.settings.camera, &open.scene);
            mode.apply(&mut request);
            request.paging.batches_per_thread = arguments.batches;
            request.paging.paths_per_batch = arguments.batch_paths;
            request.paging.policy = arguments.policy;
            (request.tracer.top, request.tracer.single_rays) = (arguments.top, arguments.single_rays);
            let camera = request.settings.camera.name.clone();
            let mut whole_ms = None;
            let print = |figures: &OocFigures| {
                let whole_ms = *whole_ms.get_or_insert(figures.frame_ms);
                print_line((strategy, &top, &camera), view, mode, figures, figures.frame_ms / whole_ms);
            };
            measure_ooc(&open, &request, &arguments.cache_fraction, arguments.repeat, &control, print)?;
        }
    }
    Ok(Exit::Done)
}

fn print_line(
    (strategy, top, camera): (&str, &str, &str),
    view: View,
    mode: Mode,
    figures: &OocFigures,
    slowdown: f64,
) {
    let (geometry, attributes) = (&figures.paging.geometry, &figures.paging.attributes);
    let tiles = figures.paging.tiles.as_ref();
    let of_tiles = tiles.map_or(0, |tiles| tiles.bytes_read);
    let bytes_read = geometry.bytes_read + attributes.bytes_read + of_tiles;
    let line = json!({
        "bench": "ooc",
        "strategy": strategy,
        "top": top,
        "view": view.name(),
        "camera": camera,
        "mode": mode.name(),
        "cache_fraction": figures.cache_fraction,
        "slowdown": slowdown,
        "hit_rate": geometry.hit_rate(),
        "attribute_hit_rate": attributes.hit_rate(),
        "tile_hit_rate": tiles.map(CacheCounts::hit_rate),
        "bytes_read": bytes_read,
        "bytes_per_ray": bytes_read as f64 / figures.rays.max(1) as f64,
        "structure_bytes": figures.structure_bytes,
        "frame_ms": figures.frame_ms,
        "cold_ms": figures.cold_ms,
        "rays": figures.rays,
        "stall_ms": geometry.stall_ms + attributes.stall_ms + tiles.map_or(0.0, |tiles| tiles.stall_ms),
        "resident_pages": geometry.resident_pages,
        "peak_rss_bytes": peak_rss_bytes(),
    });
    println!("{line}");
}
