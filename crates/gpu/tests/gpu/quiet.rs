//! Pictures that have next to no noise, pixel by pixel: what one function gets wrong by little shows in them.

use crate::common::software;
use crate::path::{Picture, on_cpu, on_device, settings};
use crate::path_scenes::{amber, lookups};
use std::collections::BTreeMap;
use vastlight_gpu::Executor;
use vastlight_math::Vec3;
use vastlight_scene::Scene;
use vastlight_transport::RenderSettings;

/// How many pixels show each material, and how many of them differ by more than `tolerance`, by its name.
fn by_material<'s>(
    scene: &'s Scene,
    [cpu, device]: [&Picture; 2],
    tolerance: f32,
) -> BTreeMap<&'s str, [usize; 2]> {
    let mut counts = BTreeMap::new();
    let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= tolerance * (1.0 + a.max_element());
    for ((a, b), (_, _, material)) in cpu.radiance.iter().zip(&device.radiance).zip(cpu.first_surfaces()) {
        let Some(material) = scene.materials().get(material as usize) else { continue };
        let [all, differ] = counts.entry(&*material.name).or_insert([0; 2]);
        *all += 1;
        *differ += usize::from(!near(*a, *b));
    }
    counts
}

fn pictures(executor: &mut Executor, scene: &Scene, width: u32, spp: u32) -> [Picture; 2] {
    let settings = RenderSettings { width, height: width / 2, ..settings(scene) };
    [on_cpu(scene, &settings, spp), on_device(executor, scene, &settings, (spp, 20_000))]
}

/// The names of materials of which more than one pixel in a hundred differs.
fn differing(counts: &BTreeMap<&str, [usize; 2]>) -> Vec<String> {
    let differ = counts.iter().filter(|(_, [all, differ])| 100 * differ > *all);
    differ.map(|(name, [all, differ])| format!("{name}: {differ} of {all}")).collect()
}

#[test]
fn textures_are_read_in_every_way_as_on_the_cpu() {
    let Some(mut executor) = software() else { return };
    let scene = lookups();
    let [cpu, device] = pictures(&mut executor, &scene, 120, 1);
    let counts = by_material(&scene, [&cpu, &device], 4e-6);
    assert!(counts.len() == 10 && counts.values().all(|&[all, _]| all > 150), "{counts:?}");
    assert_eq!(differing(&counts), [""; 0]);
}

#[test]
fn glass_absorbs_as_on_the_cpu() {
    let Some(mut executor) = software() else { return };
    let scene = amber();
    let [cpu, device] = pictures(&mut executor, &scene, 80, 2);
    let counts = by_material(&scene, [&cpu, &device], 1e-4);
    assert!(counts["amber"][0] > 500, "{counts:?}");
    assert_eq!(differing(&counts), [""; 0]);
}
