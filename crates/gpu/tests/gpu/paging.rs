//! Pictures on the software adapter through a cache that holds a part of the scene: the same bits as with all of it there.

use crate::common::{answers, probe, software};
use crate::path::{Picture, gather, settings};
use crate::path_scenes::large;
use vastlight_gpu::page::PageStats;
use vastlight_gpu::path::DeviceRenderer;
use vastlight_gpu::{Executor, ExecutorConfig, GpuError};
use vastlight_scene::Scene;
use vastlight_trace::{Layout, Tracer, TracerConfig};
use vastlight_transport::{Lights, MaterialTable, RenderSettings, Renderer};

/// The picture with so much memory on the device, and so much of it in one binding, and what paging did.
fn within(
    executor: &mut Executor,
    scene: &Scene,
    settings: &RenderSettings,
    [budget_bytes, binding_bytes]: [u64; 2],
) -> Result<(Picture, PageStats), GpuError> {
    let config = TracerConfig { layout: Layout::Compact, ..TracerConfig::default() };
    let tracer = Tracer::new(scene, &config).expect("built");
    let materials = MaterialTable::new(scene);
    let lights = Lights::new(scene, &materials);
    let renderer = Renderer::new(scene, &tracer, &materials, &lights, settings.clone());
    let before = executor.config();
    executor.configure(ExecutorConfig { budget_bytes, binding_bytes, ..before });
    let rendered = DeviceRenderer::new(executor, &renderer, 1500).map(|mut device| {
        let tile = settings.region();
        let picture = gather(settings, |sink| device.render_tile(tile, 0..2, sink).expect("rendered"));
        (picture, device.page_stats())
    });
    executor.configure(before);
    rendered
}

const ALL: u64 = u64::MAX;
/// Bytes on the device that leave room for all, for most, for half, for a few pages of this scene; and in one binding.
const BUDGETS: [[u64; 2]; 6] = [
    [16 << 20, ALL],
    [5 << 20, ALL],
    [4 << 20, 1 << 20],
    [3 << 20, ALL],
    [(3 << 20) - (1 << 18), 200 << 10],
    [ALL, 700 << 10],
];

#[test]
fn pictures_do_not_depend_on_what_is_on_the_device() {
    let Some(mut executor) = software() else { return };
    let scene = large();
    let settings = RenderSettings { width: 40, height: 22, ..settings(&scene) };
    let (whole, all) = within(&mut executor, &scene, &settings, [ALL; 2]).expect("fits");
    assert_eq!((all.slot_bytes, all.waits, all.brought), (all.all_bytes, 0, all.pages));
    let mut shares = Vec::new();
    for bounds in BUDGETS {
        let (picture, stats) = within(&mut executor, &scene, &settings, bounds).expect("enough");
        assert!(picture == whole, "{bounds:?}: {stats:?}");
        let share = stats.slot_bytes as f64 / stats.all_bytes as f64;
        assert!(share == 1.0 || stats.waits > 10 && stats.brought > stats.slots, "{stats:?}");
        shares.push(share);
    }
    let [all, most, half, some, few, of_two] = shares[..] else { panic!("{shares:?}") };
    assert!(all == 1.0 && most < 1.0 && half < 0.6 && some < 0.25 && few < 0.15, "{shares:?}");
    assert!((0.2..0.6).contains(&of_two), "two bindings and no more: {shares:?}");
    let refused = within(&mut executor, &scene, &settings, [2 << 20, ALL]).map(drop);
    let refused = refused.expect_err("too little");
    assert!(matches!(refused, GpuError::OutOfMemory { .. }), "{refused}");
}

probe!(PAGES = "page_probe", 3);

/// What is not there is asked for, by the least that asks; and what is there, by those who hold it. Uses are counted up to 31.
#[test]
fn pages_are_asked_for_held_and_counted() {
    const NONE: u32 = u32::MAX;
    let (count, there) = (200_u32, |page: u32| !page.is_multiple_of(3));
    let row = |page: u32| {
        let asker = [NONE, 0, page, page + 7][(page / 2 % 4) as usize];
        [if there(page) { 1000 + page } else { NONE }, asker, page % 33]
    };
    let holds = |page: u32| page % 2;
    let records: Vec<u32> = (0..count).map(holds).collect();
    let table: Vec<u32> = (0..count).flat_map(row).collect();
    let Some(found) = answers(&PAGES, &[&records, &table], count as usize, 4) else { return };
    for (page, found) in (0..count).zip(found.chunks_exact(4)) {
        let [place, asker, uses] = row(page);
        let asked = if !there(page) || holds(page) == 1 { asker.min(page) } else { asker };
        let counted = if there(page) && uses < 31 { uses + 1 } else { uses };
        let expected = [if there(page) { place } else { 0 }, u32::from(!there(page)), asked, counted];
        assert_eq!(found, expected, "{page}");
    }
}
