//! All lights together: helpers of the tests, and the densities of samples.

mod distant;
mod irradiance;
mod lanes;
mod noise;

use super::*;
use std::f32::consts::PI;
use vastlight_math::stats::{SphereGrid, sphere_chi_square_with};
use vastlight_math::{Affine3, Quat, Rng, Sampler};
use vastlight_scene::{Environment, Instance, Material, Mesh, Part, SceneDesc};

/// A description with materials by number and nothing else, in the dark.
fn dark(materials: Vec<Material>) -> SceneDesc {
    SceneDesc { materials, environment: Some(Environment::Constant(Vec3::ZERO)), ..SceneDesc::default() }
}

/// Adds a mesh of one material at one place.
fn add_mesh(desc: &mut SceneDesc, corners: &[[Vec3; 3]], material: u32, map: Affine3) {
    let positions: Vec<Vec3> = corners.iter().flatten().copied().collect();
    let triangles = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let uvs = vec![positions.iter().map(|p| Vec2::new(p.x, p.y)).collect()];
    let parts = vec![Part { first_triangle: 0, material }];
    desc.instances.push(Instance { world_from_object: map, mesh: desc.meshes.len() as u32, name: 0 });
    desc.meshes.push(Mesh { positions, triangles, uvs, parts, ..Mesh::default() });
}

/// A square of side 2 at z = 0 whose front is +z.
fn square() -> [[Vec3; 3]; 2] {
    let p = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    [[p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0)], [p(-1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0)]]
}

/// Runs `test` with the lights of a description.
fn with_lights<T>(desc: SceneDesc, flat_limit: u64, test: impl FnOnce(&Scene, &Lights) -> T) -> T {
    let scene = Scene::new(desc).expect("valid");
    let materials = MaterialTable::new(&scene);
    let lights = Lights::with_flat_limit(&scene, &materials, flat_limit);
    test(&scene, &lights)
}

/// Every triangle that the line from `from` along `d` meets, as (instance, triangle, position).
fn all_hits(scene: &Scene, from: Vec3, d: Vec3) -> Vec<(u32, u32, Vec3)> {
    let mut found = Vec::new();
    for (i, instance) in scene.instances().iter().enumerate() {
        let mesh = &scene.meshes()[instance.mesh as usize];
        for t in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(t).map(|p| instance.world_from_object.transform_point3(p) - from);
            let sides = [a.cross(b).dot(d), b.cross(c).dot(d), c.cross(a).dot(d)];
            let normal = (b - a).cross(c - a);
            let distance = a.dot(normal) / d.dot(normal);
            let inside = sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0);
            if inside && distance > 0.0 {
                found.push((i as u32, t, from + d * distance));
            }
        }
    }
    found
}

/// The density over solid angle of all light samples, by asking for every hit.
fn whole_density(scene: &Scene, lights: &Lights, from: Vec3, normal: Vec3, d: Vec3) -> f32 {
    let surfaces: f32 =
        all_hits(scene, from, d).iter().map(|&(i, t, p)| lights.pdf_hit(from, normal, i, t, p)).sum();
    surfaces + lights.pdf_environment(from, normal, d)
}

/// Probability of the samples' directions under the density, which is made wrong by `tilt`.
fn chi_square_of(scene: &Scene, lights: &Lights, from: Vec3, normal: Vec3, tilt: f32) -> f64 {
    let mut rng = Rng::new(17);
    let sample = |_| {
        let s = lights.sample(from, normal, rng.next_1d(), rng.next_2d())?;
        let density = whole_density(scene, lights, from, normal, s.wi);
        // A sample knows its own light's density, which is part of the whole.
        assert!(s.pdf <= density * 1.01 && s.pdf > 0.0, "{s:?} {density}");
        Some(s.wi)
    };
    let density = |d: Vec3| whole_density(scene, lights, from, normal, d) * (1.0 + tilt * d.x);
    let grid = SphereGrid { rows: 10, columns: 20, quadrature: 16 };
    sphere_chi_square_with(grid, 20_000, sample, density).p
}

/// Mean of radiance times cosine over density: irradiance, if nothing is in the way.
fn irradiance(lights: &Lights, from: Vec3, normal: Vec3, samples: u32) -> Vec3 {
    let sum: Vec3 = (0..samples)
        .filter_map(|i| {
            let mut u = Sampler::new([1, 2], i, 3);
            let s = lights.sample(from, normal, u.next_1d(), u.next_2d())?;
            Some(s.radiance * (s.wi.dot(normal).max(0.0) / s.pdf))
        })
        .sum();
    sum / samples as f32
}

/// Whether two irradiances agree to a fraction.
#[track_caller]
fn assert_near(found: f32, expected: f32, fraction: f32, what: &str) {
    assert!((found - expected).abs() <= fraction * expected.abs(), "{what}: {found}, expected {expected}");
}

fn mixed_lights() -> SceneDesc {
    let mut desc = dark(vec![
        Material::emitter("one-sided", Vec3::new(3.0, 2.0, 1.0), false),
        Material::emitter("two-sided", Vec3::splat(1.5), true),
        Material::diffuse("dark", Vec3::splat(0.5)),
    ]);
    desc.environment = Some(Environment::Constant(Vec3::splat(0.2)));
    let at = |x: f32, y: f32, z: f32| Affine3::from_translation(Vec3::new(x, y, z));
    // Looks down, seen from the origin; the second looks away from it.
    let down = Affine3::from_quat(Quat::from_rotation_x(PI / 2.0));
    add_mesh(&mut desc, &square(), 0, at(0.0, 2.0, 0.0) * down);
    add_mesh(&mut desc, &square(), 0, at(0.0, 5.0, 0.0) * down.inverse());
    add_mesh(&mut desc, &square(), 1, at(2.5, 1.0, 1.0) * Affine3::from_rotation_y(1.0));
    // A mirrored and stretched instance: the front stays the front.
    let mirrored = Affine3::from_scale(Vec3::new(-0.7, 2.0, 1.3));
    add_mesh(&mut desc, &square(), 0, at(-1.0, 1.0, -3.0) * mirrored);
    add_mesh(&mut desc, &square(), 2, at(3.0, 3.0, 3.0));
    desc
}

#[test]
fn surfaces_and_background_follow_the_density() {
    with_lights(mixed_lights(), 1 << 20, |scene, lights| {
        for (from, normal) in [
            (Vec3::ZERO, Vec3::Y),
            (Vec3::ZERO, Vec3::ZERO),
            (Vec3::new(0.5, 1.5, 0.3), Vec3::new(0.6, 0.0, 0.8)),
        ] {
            let p = chi_square_of(scene, lights, from, normal, 0.0);
            assert!(p > 1e-3, "{from} {normal}: {p}");
        }
        let wrong = chi_square_of(scene, lights, Vec3::ZERO, Vec3::Y, 0.3);
        assert!(wrong < 1e-6, "negative control: {wrong}");
    });
}

#[test]
fn shared_trees_follow_the_density() {
    let mut desc = mixed_lights();
    // Every mesh twice, so that sharing pays; with a limit of nothing all of them share.
    for i in 0..desc.instances.len() {
        let copy = desc.instances[i];
        let shift = Affine3::from_translation(Vec3::new(-2.0, 0.5, 0.0)) * Affine3::from_rotation_z(0.4);
        desc.instances.push(Instance { world_from_object: shift * copy.world_from_object, ..copy });
    }
    with_lights(desc, 0, |scene, lights| {
        assert_eq!(lights.report().local, 8, "one leaf for every emissive instance");
        for normal in [Vec3::Y, Vec3::ZERO] {
            let p = chi_square_of(scene, lights, Vec3::ZERO, normal, 0.0);
            assert!(p > 1e-3, "{normal}: {p}");
        }
    });
}

#[test]
fn trees_do_not_depend_on_the_build() {
    let pdfs = || {
        with_lights(noise::scattered(20_000), 1 << 20, |_, lights| {
            (0..2000)
                .map(|i| {
                    let from = Vec3::new((i % 13) as f32 - 6.0, 0.0, (i % 7) as f32);
                    lights.pdf_hit(from, Vec3::Y, 0, i * 10, Vec3::new(0.0, 2.0, 0.0)).to_bits()
                })
                .collect::<Vec<_>>()
        })
    };
    assert_eq!(pdfs(), pdfs());
}

#[test]
fn no_light_no_sample() {
    let mut desc =
        dark(vec![Material::diffuse("dark", Vec3::ONE), Material::emitter("off", Vec3::ZERO, true)]);
    add_mesh(&mut desc, &square(), 0, Affine3::IDENTITY);
    add_mesh(&mut desc, &square(), 1, Affine3::from_translation(Vec3::Z));
    with_lights(desc, 1 << 20, |_, lights| {
        assert_eq!(lights.report().local, 0);
        for normal in [Vec3::Y, Vec3::ZERO] {
            assert_eq!(lights.sample(Vec3::Y, normal, 0.5, Vec2::splat(0.5)), None);
            assert_eq!(lights.pdf_environment(Vec3::Y, normal, Vec3::Y), 0.0);
            assert_eq!(lights.pdf_hit(Vec3::Y, normal, 0, 0, Vec3::ZERO), 0.0);
        }
        assert_eq!(lights.environment(Vec3::Y), Vec3::ZERO);
    });
}

#[test]
fn sections_of_packed_lights_are_among_their_words() {
    use crate::words::lights as place;
    for (desc, flat_limit) in [(mixed_lights(), 1 << 20), (mixed_lights(), 0), (dark(Vec::new()), 0)] {
        with_lights(desc, flat_limit, |_, lights| {
            let words = lights.pack();
            let sections = [place::TREE, place::TRAILS, place::SURFACES, place::MESHES, place::BACKGROUND];
            for section in sections {
                assert!((place::HEADER..=words.len()).contains(&(words[section] as usize)), "{section}");
            }
            assert_eq!(words[place::SURFACE_COUNT] as usize, lights.report().local);
            let radiance = lights.environment(Vec3::Y).to_array().map(f32::to_bits);
            assert_eq!(words[words[place::BACKGROUND] as usize..][..3], radiance);
        });
    }
    assert!(place::PLACES.iter().all(|(_, at)| *at < place::HEADER));
}

#[test]
fn extreme_points_give_finite_numbers() {
    let mut desc = mixed_lights();
    desc.environment = Some(Environment::Sky(vastlight_scene::Sky::default()));
    with_lights(desc, 1 << 20, |scene, lights| {
        let corner = scene.instances().map(0).transform_point3(scene.meshes()[0].corners(0)[0]);
        let places = [Vec3::ZERO, corner, corner + Vec3::splat(1e-7), Vec3::splat(1e12), Vec3::splat(-3e18)];
        let mut rng = Rng::new(4);
        for from in places {
            for normal in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::ZERO] {
                for _ in 0..200 {
                    if let Some(s) = lights.sample(from, normal, rng.next_1d(), rng.next_2d()) {
                        assert!(s.pdf > 0.0 && s.pdf.is_finite() && s.distance > 0.0, "{from} {s:?}");
                        assert!(s.radiance.is_finite() && (s.wi.length() - 1.0).abs() < 1e-5, "{from} {s:?}");
                    }
                    let hit = lights.pdf_hit(from, normal, 0, 0, Vec3::new(0.1, 2.0, 0.1));
                    assert!(hit.is_finite() && hit >= 0.0, "{from} {hit}");
                }
            }
        }
    });
}
