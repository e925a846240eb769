//! Light from infinity: orientation, densities, irradiance against quadrature.

use super::*;
use vastlight_math::warp;
use vastlight_scene::{Image, Sky, Texels};

fn map_scene(width: u32, height: u32, rotation: f32, texel: impl Fn(u32, u32) -> Vec3) -> SceneDesc {
    let mut desc = dark(Vec::new());
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let texels = Texels::F32(pixels.flat_map(|(x, y)| texel(x, y).to_array()).collect());
    desc.images.push(Image { name: "map".into(), width, height, channels: 3, texels });
    desc.environment = Some(Environment::Map { image: 0, rotation, strength: 2.0 });
    desc
}

fn sky_scene(sky: Sky) -> SceneDesc {
    SceneDesc { environment: Some(Environment::Sky(sky)), ..dark(Vec::new()) }
}

/// A map with a sun, black parts and a dim ground.
fn patchy(x: u32, y: u32) -> Vec3 {
    match (x, y) {
        (20, 5) => Vec3::new(300.0, 250.0, 200.0),
        (x, y) if x % 7 == 2 || y == 3 => Vec3::ZERO,
        (_, y) if y > 8 => Vec3::splat(0.1),
        (x, y) => Vec3::new(0.2, 0.4, 0.5 + (x * y % 5) as f32 * 0.2),
    }
}

/// Irradiance by the midpoint rule over the hemisphere around the normal; the sun's disc is added by the caller.
fn quadrature(lights: &Lights, normal: Vec3, n: usize) -> Vec3 {
    let frame = vastlight_math::Frame::from_z(normal);
    let cells = (0..n * n).map(|i| Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32);
    let sum: Vec3 = cells.map(|u| lights.environment(frame.to_outer(warp::cosine_hemisphere(u)))).sum();
    sum * (PI / (n * n) as f32)
}

/// The direction at an azimuth from -z towards +x and an elevation.
fn towards(azimuth: f32, elevation: f32) -> Vec3 {
    let up = elevation.cos();
    Vec3::new(up * azimuth.sin(), elevation.sin(), -up * azimuth.cos())
}

#[test]
fn maps_are_seen_the_right_way_round() {
    // Left to right: red, green (the centre is between texels 1 and 2), blue, white; the upper row brighter.
    let colors = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
    let texel = |x: u32, y: u32| colors[x as usize] * if y == 0 { 1.0 } else { 0.5 };
    let azimuth = |a: f32, up: f32| Vec3::new(a.sin(), up, -a.cos()).normalize();
    with_lights(map_scene(4, 2, 0.0, texel), 1, |_, lights| {
        let at = |turn: f32| lights.environment(azimuth(turn * PI, 1.0));
        assert!(at(-0.75).distance(Vec3::X * 2.0) < 1e-4, "left, behind: {}", at(-0.75));
        assert!(at(-0.25).distance(Vec3::Y * 2.0) < 1e-4, "left of -z: {}", at(-0.25));
        assert!(at(0.25).distance(Vec3::Z * 2.0) < 1e-4, "right of -z: {}", at(0.25));
        assert!(lights.environment(Vec3::NEG_Z).distance(Vec3::new(0.0, 0.75, 0.75)) < 1e-4);
        assert!(lights.environment(azimuth(0.25 * PI, -1.0)).z < 1.01);
    });
    // Rotated by a quarter turn about +y, the centre is seen along -x.
    with_lights(map_scene(4, 2, PI / 2.0, texel), 1, |_, lights| {
        let turned = Affine3::from_rotation_y(PI / 2.0).transform_vector3(azimuth(-0.25 * PI, 1.0));
        assert!(lights.environment(turned).distance(Vec3::Y * 2.0) < 1e-4);
        assert!(lights.environment(Vec3::NEG_X).distance(Vec3::new(0.0, 0.75, 0.75)) < 1e-4);
    });
}

#[test]
fn map_samples_follow_their_density_and_irradiance() {
    with_lights(map_scene(32, 16, 0.7, patchy), 1, |scene, lights| {
        for normal in [Vec3::Y, Vec3::ZERO, Vec3::new(0.0, -0.6, 0.8)] {
            let p = chi_square_of(scene, lights, Vec3::ZERO, normal, 0.0);
            assert!(p > 1e-3, "{normal}: {p}");
        }
        assert!(chi_square_of(scene, lights, Vec3::ZERO, Vec3::Y, 0.3) < 1e-6, "negative control");
        for normal in [Vec3::Y, Vec3::NEG_Y, Vec3::new(0.48, 0.6, -0.64)] {
            let (found, expected) =
                (irradiance(lights, Vec3::ZERO, normal, 16_384), quadrature(lights, normal, 512));
            assert_near(found.x, expected.x, 1e-2, "red");
            assert_near(found.z, expected.z, 1e-2, "blue");
        }
    });
}

#[test]
fn large_odd_and_broken_maps_are_survived() {
    // Larger than the density's limit, and neither side a multiple of the other.
    let big = |x: u32, y: u32| {
        if (x / 40 + y / 40).is_multiple_of(9) { Vec3::splat(5.0) } else { Vec3::splat(0.01) }
    };
    with_lights(map_scene(2101, 1003, 0.0, big), 1, |_, lights| {
        let normal = Vec3::new(0.6, 0.8, 0.0);
        let (found, expected) =
            (irradiance(lights, Vec3::ZERO, normal, 16_384), quadrature(lights, normal, 512));
        assert_near(found.x, expected.x, 1e-2, "reduced");
    });
    let broken = |x: u32, y: u32| match (x + y) % 4 {
        0 => Vec3::splat(f32::NAN),
        1 => Vec3::splat(f32::INFINITY),
        2 => Vec3::splat(-5.0),
        _ => Vec3::ONE,
    };
    for (w, h) in [(1, 1), (3, 1), (1, 5), (16, 8)] {
        with_lights(map_scene(w, h, f32::NAN, broken), 1, |_, lights| {
            for i in 0..100 {
                let mut u = Sampler::new([0, 0], i, 0);
                let wi = warp::uniform_sphere(u.next_2d());
                assert!(lights.environment(wi).is_finite() && lights.environment(wi).min_element() >= 0.0);
                assert!(lights.pdf_environment(Vec3::ZERO, Vec3::Y, wi).is_finite());
            }
        });
    }
    with_lights(map_scene(1, 1, 0.0, |_, _| Vec3::ONE), 1, |_, lights| {
        assert_near(irradiance(lights, Vec3::ZERO, Vec3::Y, 4096).x, 2.0 * PI, 1e-2, "one texel");
    });
}

#[test]
fn constant_background_gives_pi() {
    let desc =
        SceneDesc { environment: Some(Environment::Constant(Vec3::new(1.0, 2.0, 3.0))), ..dark(Vec::new()) };
    with_lights(desc, 1, |scene, lights| {
        let found = irradiance(lights, Vec3::ZERO, Vec3::new(0.0, 0.6, 0.8), 64);
        assert!(found.distance(Vec3::new(1.0, 2.0, 3.0) * PI) < 1e-3, "{found}");
        for normal in [Vec3::X, Vec3::ZERO] {
            assert!(chi_square_of(scene, lights, Vec3::ZERO, normal, 0.0) > 1e-3);
        }
    });
}

#[test]
fn sky_and_sun_agree_with_quadrature() {
    for (elevation, turbidity) in [(0.8, 3.0), (0.15, 6.0)] {
        let sky =
            Sky { sun_azimuth: 2.2, sun_elevation: elevation, turbidity, sun_disc: false, ..Sky::default() };
        let with_sun = Sky { sun_disc: true, ..sky };
        for normal in [Vec3::Y, Vec3::new(0.6, 0.64, -0.48), Vec3::NEG_Y] {
            let (sky_found, sky_expected) = with_lights(sky_scene(sky), 1, |_, lights| {
                (irradiance(lights, Vec3::ZERO, normal, 4096), quadrature(lights, normal, 128))
            });
            assert_near(sky_found.x, sky_expected.x, 1e-2, "sky red");
            assert_near(sky_found.z, sky_expected.z, 1e-2, "sky blue");
            // The sun: its radiance at the centre times its projected solid angle.
            with_lights(sky_scene(with_sun), 1, |_, lights| {
                let sun = towards(sky.sun_azimuth, elevation);
                let half_angle = 0.5_f32 * 0.533_f32.to_radians();
                let disc =
                    lights.environment(sun) * (PI * half_angle.sin().powi(2) * sun.dot(normal).max(0.0));
                let found = irradiance(lights, Vec3::ZERO, normal, 8192);
                assert_near(found.x, sky_expected.x + disc.x, 1.5e-2, "sun and sky");
            });
        }
    }
}

#[test]
fn sky_samples_follow_their_density() {
    let sky = Sky { sun_disc: false, ..Sky::default() };
    with_lights(sky_scene(sky), 1, |scene, lights| {
        for normal in [Vec3::Y, Vec3::ZERO] {
            let p = chi_square_of(scene, lights, Vec3::ZERO, normal, 0.0);
            assert!(p > 1e-3, "{normal}: {p}");
        }
        assert!(chi_square_of(scene, lights, Vec3::ZERO, Vec3::Y, 0.3) < 1e-6, "negative control");
    });
}

#[test]
fn a_clear_day_has_the_documented_brightness_and_colour() {
    with_lights(sky_scene(Sky::default()), 1, |_, lights| {
        let day = irradiance(lights, Vec3::ZERO, Vec3::Y, 4096);
        assert!((2.8..3.6).contains(&day.y), "about pi: {day}");
        let zenith = lights.environment(Vec3::Y);
        assert!(zenith.z > 1.5 * zenith.x, "blue above: {zenith}");
    });
    let evening = Sky { sun_azimuth: 2.2, sun_elevation: 0.05, ..Sky::default() };
    with_lights(sky_scene(evening), 1, |_, lights| {
        let glow = lights.environment(towards(evening.sun_azimuth, 0.1));
        assert!(glow.x > 3.0 * glow.z, "red at sunset: {glow}");
    });
    for elevation in [-0.3, f32::NAN, 1e9, -1e9] {
        let night =
            Sky { sun_elevation: elevation, turbidity: f32::INFINITY, strength: f32::NAN, ..Sky::default() };
        with_lights(sky_scene(night), 1, |_, lights| {
            assert!(lights.environment(Vec3::new(0.0, 0.6, 0.8)).is_finite());
            let _ = lights.sample(Vec3::ZERO, Vec3::Y, 0.99, Vec2::splat(0.5));
        });
    }
}
