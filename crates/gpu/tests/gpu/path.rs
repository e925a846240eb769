//! Pictures of the software adapter against the CPU's.

use crate::common::software;
use crate::path_scenes::{demo, materials, veils};
use vastlight_gpu::path::DeviceRenderer;
use vastlight_gpu::{DeviceChoice, Executor, GpuError};
use vastlight_math::Vec3;
use vastlight_scene::Scene;
use vastlight_trace::{Layout, Tracer, TracerConfig};
use vastlight_transport::{
    DirectSampling, Integrator, Lights, MaterialTable, RenderSettings, RenderStats, Renderer, Sample,
};

/// Share of the variance between seeds by which pictures of the CPU and of a device may differ.
const TOLERANCE: f64 = 0.05;

/// The sums of a picture's samples, row by row, and the last sample of each pixel.
#[derive(Clone, PartialEq)]
pub(crate) struct Picture {
    pub(crate) radiance: Vec<Vec3>,
    last: Vec<Sample>,
    pub(crate) stats: RenderStats,
}

impl Picture {
    /// Albedo, object and material of first surfaces.
    pub(crate) fn first_surfaces(&self) -> impl Iterator<Item = (Vec3, u32, u32)> {
        self.last.iter().map(|sample| (sample.albedo, sample.object, sample.material))
    }
}

pub(crate) fn settings(scene: &Scene) -> RenderSettings {
    RenderSettings::new(scene.cameras()[0].clone(), 48, 27)
}

pub(crate) type Sink<'s> = &'s mut dyn FnMut([u32; 2], &Sample);

pub(crate) fn gather(
    settings: &RenderSettings,
    render: impl FnOnce(&mut Sink<'_>) -> RenderStats,
) -> Picture {
    let pixels = settings.region().pixels() as usize;
    let (mut radiance, mut last) = (vec![Vec3::ZERO; pixels], vec![Sample::MISS; pixels]);
    let mut add = |[x, y]: [u32; 2], sample: &Sample| {
        let pixel = (y * settings.width + x) as usize;
        radiance[pixel] += sample.radiance;
        last[pixel] = *sample;
    };
    let stats = render(&mut (&mut add as Sink<'_>));
    Picture { radiance, last, stats }
}

/// Calls with a renderer over a layout.
fn with_renderer<T>(
    scene: &Scene,
    settings: &RenderSettings,
    layout: Layout,
    call: impl FnOnce(&Renderer<'_>) -> T,
) -> T {
    let config = TracerConfig { layout, ..TracerConfig::default() };
    let tracer = Tracer::new(scene, &config).expect("built");
    let materials = MaterialTable::new(scene);
    let lights = Lights::new(scene, &materials);
    call(&Renderer::new(scene, &tracer, &materials, &lights, settings.clone()))
}

pub(crate) fn on_cpu(scene: &Scene, settings: &RenderSettings, spp: u32) -> Picture {
    with_renderer(scene, settings, Layout::Compact, |renderer| {
        let tile = settings.region();
        gather(settings, |sink| renderer.render_tile(tile, 0..spp, sink).expect("rendered"))
    })
}

pub(crate) fn on_device(
    executor: &mut Executor,
    scene: &Scene,
    settings: &RenderSettings,
    samples: (u32, u32),
) -> Picture {
    try_on_device(executor, scene, settings, samples).expect("fits")
}

/// A picture, unless the renderer does not fit.
fn try_on_device(
    executor: &mut Executor,
    scene: &Scene,
    settings: &RenderSettings,
    (spp, capacity): (u32, u32),
) -> Result<Picture, GpuError> {
    with_renderer(scene, settings, Layout::Compact, |renderer| {
        let mut device = DeviceRenderer::new(executor, renderer, capacity)?;
        let tile = settings.region();
        Ok(gather(settings, |sink| device.render_tile(tile, 0..spp, sink).expect("rendered")))
    })
}

/// Mean squared difference of two pictures.
pub(crate) fn difference(a: &Picture, b: &Picture) -> f64 {
    let squares = a.radiance.iter().zip(&b.radiance).map(|(a, b)| f64::from((*a - *b).length_squared()));
    squares.sum::<f64>() / a.radiance.len() as f64
}

/// Shares of the variance between two seeds by which a device's picture, and that of another seed, differ.
fn shares(executor: &mut Executor, scene: &Scene, settings: &RenderSettings, spp: u32) -> [f64; 2] {
    let cpu = on_cpu(scene, settings, spp);
    let device = on_device(executor, scene, settings, (spp, 20_000));
    let seeds = [7, 8].map(|seed| on_cpu(scene, &RenderSettings { seed, ..settings.clone() }, spp));
    let variance = 0.5 * difference(&seeds[0], &seeds[1]);
    assert!(variance > 0.0 && cpu.stats.non_finite == device.stats.non_finite);
    let rays = cpu.stats.rays.abs_diff(device.stats.rays) as f64 / cpu.stats.rays as f64;
    assert!(rays < 1e-2, "{:?} {:?}", cpu.stats, device.stats);
    [difference(&cpu, &device) / variance, difference(&cpu, &seeds[0]) / variance]
}

#[test]
fn pictures_are_those_of_the_cpu_and_not_those_of_another_seed() {
    let Some(mut executor) = software() else { return };
    for (name, scene) in [
        ("cornell", demo("cornell", None)),
        ("still-life", demo("still-life", None)),
        ("atrium", demo("atrium", None)),
        ("caustic-sphere", demo("caustic-sphere", Some(2000))),
        ("city", demo("city", Some(200_000))),
        ("plant", demo("plant", Some(400_000))),
        ("statue", demo("statue", Some(20_000))),
        ("terrain", demo("terrain", Some(20_000))),
        ("textured-hall", demo("textured-hall", None)),
        ("veils", veils()),
        ("materials", materials()),
    ] {
        let [device, seed] = shares(&mut executor, &scene, &settings(&scene), 8);
        assert!(device < TOLERANCE, "{name}: {device}");
        assert!(seed > 0.3, "{name}: {seed}");
    }
}

#[test]
fn a_scene_that_differs_is_found() {
    let Some(mut executor) = software() else { return };
    let (scene, mut other) = (materials(), materials().into_desc());
    other.materials[2].base_color.factor *= 0.7;
    let (other, settings) = (Scene::new(other).expect("a scene"), settings(&scene));
    let seeds = [7, 8].map(|seed| on_cpu(&scene, &RenderSettings { seed, ..settings.clone() }, 8));
    let device = on_device(&mut executor, &scene, &settings, (8, 20_000));
    let share = difference(&on_cpu(&other, &settings, 8), &device) / (0.5 * difference(&seeds[0], &seeds[1]));
    assert!(share > TOLERANCE, "{share}");
}

#[test]
fn every_integrator_and_way_of_sampling_is_that_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    let scene = veils();
    let plain = settings(&scene);
    for settings in [
        RenderSettings { integrator: Integrator::Direct, ..plain.clone() },
        RenderSettings { integrator: Integrator::Primary, ..plain.clone() },
        RenderSettings { integrator: Integrator::Ao, ..plain.clone() },
        RenderSettings { direct_sampling: DirectSampling::Bsdf, ..plain.clone() },
        RenderSettings { direct_sampling: DirectSampling::Light, ..plain.clone() },
        RenderSettings { max_depth: 2, ..plain.clone() },
        RenderSettings { max_depth: 0, ..plain.clone() },
        RenderSettings { russian_roulette: false, max_depth: 5, ..plain },
    ] {
        let (cpu, device) =
            (on_cpu(&scene, &settings, 4), on_device(&mut executor, &scene, &settings, (4, 20_000)));
        let scale = cpu.radiance.iter().map(|r| f64::from(r.length_squared())).sum::<f64>();
        let share = difference(&cpu, &device) / (scale / cpu.radiance.len() as f64).max(1e-9);
        assert!(share < 1e-4, "{settings:?}: {share}");
        assert_eq!(cpu.stats.samples, device.stats.samples);
    }
}

#[test]
fn what_is_said_of_first_surfaces_is_that_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    let scene = materials();
    let settings = settings(&scene);
    let (cpu, device) =
        (on_cpu(&scene, &settings, 1), on_device(&mut executor, &scene, &settings, (1, 20_000)));
    let mut differ = 0;
    for (a, b) in cpu.last.iter().zip(&device.last) {
        let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 1e-3 * (1.0 + a.abs().max_element());
        let same = (a.object, a.material, a.coverage) == (b.object, b.material, b.coverage)
            && near(a.albedo, b.albedo)
            && near(a.normal, b.normal)
            && near(a.position, b.position)
            && (a.depth - b.depth).abs() < 1e-3 * (1.0 + a.depth);
        differ += usize::from(!same);
    }
    assert!(cpu.last.iter().filter(|sample| sample.coverage > 0.0).count() > 500);
    assert!(differ <= 3, "{differ}");
}

/// Waves of any size, the last one not full, and pixels cut between them.
#[test]
fn pictures_do_not_depend_on_how_waves_are_cut() {
    let Some(mut executor) = software() else { return };
    let scene = veils();
    let settings = RenderSettings { width: 24, height: 13, ..settings(&scene) };
    let whole = on_device(&mut executor, &scene, &settings, (7, 20_000));
    for capacity in [5, 257, 1000] {
        let cut = on_device(&mut executor, &scene, &settings, (7, capacity));
        assert!(cut == whole, "{capacity}");
    }
}

/// A renderer either does not fit, or renders to the end: in waves of fewer samples than the picture has, where there is less
/// room.
#[test]
fn waves_shrink_to_the_memory_that_there_is() {
    const BLOCK: u64 = 1 << 17;
    const BLOCKS: u64 = 64;
    let Some(mut shared) = software() else { return };
    let scene = demo("cornell", None);
    let integrator = Integrator::Primary;
    let settings = RenderSettings { width: 64, height: 36, integrator, ..settings(&scene) };
    let whole = on_device(&mut shared, &scene, &settings, (2, 20_000));
    drop(shared);
    let mut small = Executor::open(DeviceChoice::Software, Some(BLOCKS * BLOCK)).expect("as before");
    let mut render = |free: u64| {
        let taken: Vec<_> =
            (free..BLOCKS).map(|_| small.allocate("taken", BLOCK).expect("within the budget")).collect();
        let cut = try_on_device(&mut small, &scene, &settings, (2, 1 << 20));
        taken.into_iter().for_each(|resident| small.release(resident));
        assert!(small.held_bytes() <= BLOCKS * BLOCK);
        cut
    };
    assert!(render(BLOCKS).expect("fits") == whole);
    let outcomes: Vec<_> = (8..40).step_by(3).map(&mut render).collect();
    assert!(matches!(outcomes[0], Err(GpuError::OutOfMemory { .. })));
    let fitting: Vec<Picture> = outcomes.into_iter().filter_map(Result::ok).collect();
    assert!(!fitting.is_empty() && fitting.iter().all(|cut| *cut == whole));
}

#[test]
fn what_cannot_be_rendered_is_an_error_and_leaves_nothing() {
    let Some(shared) = software() else { return };
    drop(shared);
    let scene = demo("cornell", None);
    let mut small = Executor::open(DeviceChoice::Software, Some(1 << 20)).expect("as before");
    let mut refused = |settings: &RenderSettings, capacity| {
        with_renderer(&scene, settings, Layout::Compact, |renderer| {
            DeviceRenderer::new(&mut small, renderer, capacity).map(drop).expect_err("refused")
        })
    };
    let plain = settings(&scene);
    let whitted = RenderSettings { integrator: Integrator::Whitted, ..plain.clone() };
    assert!(matches!(refused(&whitted, 100), GpuError::Scene { .. }));
    assert!(matches!(refused(&plain, 100_000), GpuError::OutOfMemory { .. }));
    let all_of_it = small.allocate("all of the budget", 1 << 20).expect("nothing else stays");
    small.release(all_of_it);
    let wide = with_renderer(&scene, &plain, Layout::Wide, |renderer| {
        DeviceRenderer::new(&mut small, renderer, 100).map(drop).expect_err("not in pages")
    });
    assert!(matches!(wide, GpuError::Scene { .. }), "{wide}");
}
