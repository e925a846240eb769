//! Pictures on the software adapter through a cache that holds a part of the scene: the same bits as with all of it there.

use crate::common::software;
use crate::path::{Picture, gather, settings};
use crate::path_scenes::large;
use vastlight_gpu::page::PageStats;
use vastlight_gpu::path::DeviceRenderer;
use vastlight_gpu::{Executor, GpuError};
use vastlight_scene::Scene;
use vastlight_trace::{Layout, Tracer, TracerConfig};
use vastlight_transport::{Lights, MaterialTable, RenderSettings, Renderer};

/// The picture with so much memory on the device, and what paging did.
fn within(
    executor: &mut Executor,
    scene: &Scene,
    settings: &RenderSettings,
    (spp, budget): (u32, u64),
) -> Result<(Picture, PageStats), GpuError> {
    let config = TracerConfig { layout: Layout::Compact, ..TracerConfig::default() };
    let tracer = Tracer::new(scene, &config).expect("built");
    let materials = MaterialTable::new(scene);
    let lights = Lights::new(scene, &materials);
    let renderer = Renderer::new(scene, &tracer, &materials, &lights, settings.clone());
    executor.set_budget(budget);
    let rendered = DeviceRenderer::new(executor, &renderer, 1500).map(|mut device| {
        let tile = settings.region();
        let picture = gather(settings, |sink| device.render_tile(tile, 0..spp, sink).expect("rendered"));
        (picture, device.page_stats())
    });
    executor.set_budget(u64::MAX);
    rendered
}

/// Bytes on the device that leave room for all, for most, for half, for a few pages of this scene.
const BUDGETS: [u64; 5] = [16 << 20, 5 << 20, 4 << 20, 3 << 20, (3 << 20) - (1 << 18)];

#[test]
fn pictures_do_not_depend_on_what_is_on_the_device() {
    let Some(mut executor) = software() else { return };
    let scene = large();
    let settings = RenderSettings { width: 40, height: 22, ..settings(&scene) };
    let (whole, all) = within(&mut executor, &scene, &settings, (2, u64::MAX)).expect("fits");
    assert_eq!((all.slot_bytes, all.waits, all.brought), (all.all_bytes, 0, all.pages));
    let mut shares = Vec::new();
    for budget in BUDGETS {
        let (picture, stats) = within(&mut executor, &scene, &settings, (2, budget)).expect("enough");
        assert!(picture == whole, "{budget}: {stats:?}");
        let share = stats.slot_bytes as f64 / stats.all_bytes as f64;
        assert!(share == 1.0 || stats.waits > 10 && stats.brought > stats.slots, "{stats:?}");
        shares.push(share);
    }
    assert!(shares.is_sorted_by(|a, b| a > b) && shares[0] == 1.0 && shares[4] < 0.15, "{shares:?}");
    let refused = within(&mut executor, &scene, &settings, (2, 2 << 20)).map(drop).expect_err("too little");
    assert!(matches!(refused, GpuError::OutOfMemory { .. }), "{refused}");
}
