//! Pictures of the stream tracer on the software adapter against the CPU's.

use crate::common::software;
use crate::path::{Picture, difference, gather, settings};
use crate::path_scenes::{demo, mirrors, plates};
use vastlight_gpu::Executor;
use vastlight_gpu::path::DeviceRenderer;
use vastlight_math::Vec3;
use vastlight_scene::Scene;
use vastlight_trace::{Tracer, TracerConfig};
use vastlight_transport::{Integrator, Lights, MaterialTable, RenderSettings, Renderer};

fn whitted(scene: &Scene) -> RenderSettings {
    RenderSettings { integrator: Integrator::Whitted, ..settings(scene) }
}

pub(crate) fn with_renderer<T>(
    scene: &Scene,
    settings: &RenderSettings,
    call: impl FnOnce(&Renderer<'_>) -> T,
) -> T {
    let config = TracerConfig { accel: "kd-threaded".to_owned(), ..TracerConfig::default() };
    let tracer = Tracer::new(scene, &config).expect("built");
    let materials = MaterialTable::new(scene);
    let lights = Lights::new(scene, &materials);
    call(&Renderer::new(scene, &tracer, &materials, &lights, settings.clone()))
}

fn on_cpu(scene: &Scene, settings: &RenderSettings, spp: u32) -> Picture {
    with_renderer(scene, settings, |renderer| {
        gather(settings, |sink| renderer.render_tile(settings.region(), 0..spp, sink).expect("rendered"))
    })
}

fn on_device(
    executor: &mut Executor,
    scene: &Scene,
    settings: &RenderSettings,
    (spp, capacity): (u32, u32),
) -> Picture {
    with_renderer(scene, settings, |renderer| {
        let mut device = DeviceRenderer::new(executor, renderer, capacity).expect("fits");
        gather(settings, |sink| device.render_tile(settings.region(), 0..spp, sink).expect("rendered"))
    })
}

/// Mean square of a picture.
pub(crate) fn power(picture: &Picture) -> f64 {
    let squares = picture.radiance.iter().map(|r| f64::from(r.length_squared()));
    squares.sum::<f64>() / picture.radiance.len() as f64
}

/// Whether albedo, object and material of first surfaces are the same.
fn near(a: &(Vec3, u32, u32), b: &(Vec3, u32, u32)) -> bool {
    (a.1, a.2) == (b.1, b.2) && (a.0 - b.0).abs().max_element() < 1e-3
}

#[test]
fn pictures_are_those_of_the_cpu_and_not_those_of_another_seed() {
    let Some(mut executor) = software() else { return };
    for (name, scene) in
        [("cornell", demo("cornell", None)), ("still-life", demo("still-life", None)), ("mirrors", mirrors())]
    {
        let settings = whitted(&scene);
        let cpu = on_cpu(&scene, &settings, 4);
        let device = on_device(&mut executor, &scene, &settings, (4, 10_000));
        let other = on_cpu(&scene, &RenderSettings { seed: 9, ..settings.clone() }, 4);
        let [share, control] = [&device, &other].map(|p| difference(&cpu, p) / power(&cpu));
        assert!(share < 0.02 * control, "{name}: {share}, control {control}");
        let rays = [&cpu, &device].map(|p| (p.stats.rays + p.stats.shadow_rays) as f64);
        assert!((rays[0] / rays[1] - 1.0).abs() < 5e-3, "{name}: {:?} {:?}", cpu.stats, device.stats);
        assert_eq!(cpu.stats.samples, device.stats.samples);
        let differ = cpu.first_surfaces().zip(device.first_surfaces()).filter(|(a, b)| !near(a, b)).count();
        assert!(differ <= 3, "{name}: {differ} first surfaces");
    }
}

#[test]
fn a_scene_that_differs_is_found() {
    let Some(mut executor) = software() else { return };
    let (scene, mut other) = (mirrors(), mirrors().into_desc());
    other.materials[1].ior = 1.5;
    let (other, settings) = (Scene::new(other).expect("a scene"), whitted(&scene));
    let device = on_device(&mut executor, &scene, &settings, (2, 10_000));
    let [same, differs] = [&scene, &other].map(|scene| difference(&on_cpu(scene, &settings, 2), &device));
    assert!(differs > 20.0 * same, "{same} {differs}");
}

/// A wave of so many rays that it has to start again with a half of its samples, and with a half of these.
#[test]
fn waves_whose_rays_want_more_slots_start_again_with_fewer_samples() {
    let Some(mut executor) = software() else { return };
    let scene = plates(4);
    let settings = RenderSettings { width: 16, height: 9, max_depth: 12, ..whitted(&scene) };
    let cpu = on_cpu(&scene, &settings, 4);
    // The rays of a sample, on average, are far more than its slots, which are four and few besides.
    assert!(cpu.stats.rays + cpu.stats.shadow_rays > 20 * cpu.stats.samples, "{:?}", cpu.stats);
    let whole = on_device(&mut executor, &scene, &settings, (4, 576));
    let share = difference(&cpu, &whole) / power(&cpu);
    assert!(share < 1e-3, "{share}");
    let few = on_device(&mut executor, &scene, &settings, (4, 40));
    assert!(few == whole);
}

/// Waves of any size, and every depth.
#[test]
fn pictures_do_not_depend_on_how_waves_are_cut() {
    let Some(mut executor) = software() else { return };
    let scene = mirrors();
    let settings = RenderSettings { width: 24, height: 13, ..whitted(&scene) };
    let whole = on_device(&mut executor, &scene, &settings, (7, 20_000));
    for capacity in [5, 257, 2184] {
        assert!(on_device(&mut executor, &scene, &settings, (7, capacity)) == whole, "{capacity}");
    }
    for max_depth in [0, 1, 2, 40] {
        let settings = RenderSettings { max_depth, ..settings.clone() };
        let (cpu, device) =
            (on_cpu(&scene, &settings, 2), on_device(&mut executor, &scene, &settings, (2, 20_000)));
        let share = difference(&cpu, &device) / power(&cpu).max(1e-9);
        assert!(share < 1e-3, "{max_depth}: {share}");
    }
}
