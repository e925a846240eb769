//! Caustics by photons against closed forms, and against paths that find them by chance.

mod common;

use common::{Build, assert_close, look_at, render, shapes, with_renderer};
use std::f64::consts::PI;
use vastlight_math::{Affine3, Frame, Quat, Vec3};
use vastlight_scene::{ColorInput, Light, LightKind, Material, Mesh, ScalarInput, Scene};
use vastlight_transport::bsdf::Wavelength;
use vastlight_transport::photon::{Photon, PhotonMaps, PhotonPlan, PhotonSettings};
use vastlight_transport::{BsdfParams, RenderSettings, Renderer, Sample};

fn floor() -> Affine3 {
    facing(Vec3::Y, 10.0, Vec3::ZERO)
}

/// The map that turns +z of a shape to `normal` and scales it.
fn facing(normal: Vec3, half: f32, at: Vec3) -> Affine3 {
    let turn = Quat::from_rotation_arc(Vec3::Z, normal);
    Affine3::from_scale_rotation_translation(Vec3::splat(half), turn, at)
}

fn ball(radius: f32, at: Vec3) -> Affine3 {
    Affine3::from_scale_rotation_translation(Vec3::splat(radius), Quat::IDENTITY, at)
}

fn mirror() -> Material {
    Material {
        metallic: ScalarInput::new(1.0),
        roughness: ScalarInput::new(0.0),
        base_color: ColorInput::new(Vec3::ONE),
        ..Material::diffuse("mirror", Vec3::ONE)
    }
}

fn point_light(at: Vec3, intensity: f32) -> Light {
    Light {
        name: String::new(),
        kind: LightKind::Point,
        world_from_light: Affine3::from_translation(at),
        intensity: Vec3::splat(intensity),
        range: f32::INFINITY,
        profile: None,
    }
}

fn settings(photons: u32, radius: Option<f32>) -> RenderSettings {
    let camera = look_at(Vec3::new(0.0, 3.0, 6.0), Vec3::new(0.0, 0.3, 0.0), 0.8);
    let caustics = Some(PhotonSettings { photons: Some(photons), radius, ..PhotonSettings::default() });
    RenderSettings { caustics, max_depth: 8, ..RenderSettings::new(camera, 48, 32) }
}

/// All photons of the first pass: power, and the power times the place.
fn landed(scene: &Scene) -> (Vec3, Vec3) {
    with_renderer(scene, settings(1 << 16, Some(1e3)), |renderer| {
        let plan = renderer.photon_plan().expect("in memory").expect("photons are wanted");
        let (maps, _) = renderer.photon_maps(&plan, 0).expect("in memory");
        let (mut power, mut moment) = (Vec3::ZERO, Vec3::ZERO);
        for map in maps.maps() {
            map.near_at(scene.bounds().center(), |near| {
                power += near.flux;
                moment += near.from * near.flux.x;
            });
        }
        (power, moment)
    })
}

/// Mean radiance of the picture with photons.
fn average(scene: &Scene, settings: &RenderSettings, samples: u32) -> f64 {
    average_under(scene, settings, samples, |renderer, plan, sample| {
        renderer.photon_maps(plan, sample).expect("in memory").0
    })
}

/// Mean radiance of the picture where each sample has these photons.
fn average_under(
    scene: &Scene,
    settings: &RenderSettings,
    samples: u32,
    photons: impl Fn(&Renderer<'_>, &PhotonPlan, u32) -> PhotonMaps,
) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    with_renderer(scene, settings.clone(), |renderer: &Renderer<'_>| {
        let plan = renderer.photon_plan().expect("in memory").expect("photons are wanted");
        for sample in 0..samples {
            let maps = photons(renderer, &plan, sample);
            let mut sink = |_: [u32; 2], sample: &Sample| {
                sum += f64::from(sample.radiance.element_sum());
                count += 3;
            };
            renderer
                .render_tile_under(Some(&maps), renderer.settings().region(), sample..sample + 1, &mut sink)
                .expect("in memory");
        }
    });
    sum / f64::from(count)
}

/// Asserts that photons and paths give the same light, and that they would not if photons had brought less.
#[track_caller]
fn assert_same_light(scene: &Scene, paths: u32, tolerance: f64, what: &str) {
    assert_same_light_by(&settings(1 << 15, None), scene, (paths, tolerance), what);
}

#[track_caller]
fn assert_same_light_by(photons: &RenderSettings, scene: &Scene, (paths, tolerance): (u32, f64), what: &str) {
    let alone = RenderSettings { caustics: None, ..photons.clone() };
    let expected = render(scene, &alone, paths).average();
    assert_close(average(scene, photons, 24), expected, tolerance, what);
    // As a control: no photons where paths leave light to them.
    let without = average_under(scene, photons, 24, |_, _, _| PhotonMaps::default());
    assert!(without < expected * (1.0 - 2.0 * tolerance), "{what}: photons bring {expected} - {without}");
}

#[test]
fn a_mirror_passes_on_what_shines_on_it() {
    let (half, height) = (0.5_f64, 1.5_f64);
    let mut build = Build::in_light(Vec3::ZERO);
    build.desc.lights.push(point_light(Vec3::new(0.0, 1.5, 0.0), 7.0));
    build.add(shapes::quad(), mirror(), facing(Vec3::Y, 0.5, Vec3::ZERO));
    build.add(shapes::quad(), Material::diffuse("ceiling", Vec3::ONE), facing(-Vec3::Y, 40.0, Vec3::Y * 4.0));
    let scene = build.finish();
    let solid_angle = 4.0 * (half * half / (height * (2.0 * half * half + height * height).sqrt())).atan();
    let (power, moment) = landed(&scene);
    assert_close(f64::from(power.x), 7.0 * solid_angle, 2e-3, "power of a mirrored point light");
    assert!(moment.y < -0.8 * power.x, "light comes from below: {moment} of {power}");
}

/// Share of light that a plane plate of index `ior` lets pass at a cosine, with all reflections inside.
fn passed_by_plate(cos: f64, ior: f64) -> f64 {
    let inside = (1.0 - (1.0 - cos * cos) / (ior * ior)).sqrt();
    let (s, p) = ((cos - ior * inside) / (cos + ior * inside), (ior * cos - inside) / (ior * cos + inside));
    let reflected = 0.5 * (s * s + p * p);
    (1.0 - reflected).powi(2) / (1.0 - reflected * reflected)
}

#[test]
fn a_plate_of_glass_passes_what_fresnel_says() {
    let mut build = Build::in_light(Vec3::ZERO);
    build.desc.lights.push(point_light(Vec3::new(0.0, 3.0, 0.0), 5.0));
    let plate = Affine3::from_scale_rotation_translation(
        Vec3::new(30.0, 0.05, 30.0),
        Quat::IDENTITY,
        Vec3::new(0.0, 1.0, 0.0),
    );
    build.add(shapes::cube(), Material::glass("plate", 1.5, 0.0), plate);
    build.add(shapes::quad(), Material::diffuse("floor", Vec3::ONE), facing(Vec3::Y, 60.0, Vec3::ZERO));
    let scene = build.finish();
    // Flux through the plate's face: over cosines as far as the plate reaches, hardly less than all.
    let (n, mut expected) = (20_000, 0.0);
    for i in 0..n {
        let cos = (f64::from(i) + 0.5) / f64::from(n);
        // Beyond 30 m at a height of 1.95 m, a square: the missing corner of light is below a percent.
        let reach = if cos > 1.95 / 30.0_f64.hypot(1.95) { 1.0 } else { 0.0 };
        expected += reach * passed_by_plate(cos, 1.5) * 2.0 * PI * 5.0 / f64::from(n);
    }
    let (power, _) = landed(&scene);
    assert_close(f64::from(power.x), expected, 0.012, "power through a plate");
}

/// The photons of a grid of so many rows from each point light.
fn by_grid(scene: &Scene, edge: u32) -> Vec<Photon> {
    let mut settings = settings(1, Some(1e3));
    settings.caustics =
        settings.caustics.map(|caustics| PhotonSettings { grid: Some([edge; 2]), ..caustics });
    with_renderer(scene, settings, |renderer| {
        let plan = renderer.photon_plan().expect("in memory").expect("photons are wanted");
        renderer.photons(&plan, 0).expect("in memory").0
    })
}

#[test]
fn a_grid_brings_as_much_light_as_chance() {
    let mut build = Build::in_light(Vec3::ZERO);
    build.desc.lights.push(point_light(Vec3::new(0.5, 4.0, 0.0), 9.0));
    build.add(shapes::quad(), Material::diffuse("floor", Vec3::ONE), floor());
    build.add(shapes::sphere(4, true), Material::glass("glass", 1.5, 0.0), ball(0.8, Vec3::Y));
    let scene = build.finish();
    let sum = |photons: &[Photon]| photons.iter().map(|photon| photon.flux.x).sum::<f32>();
    let passes = 8;
    let by_chance = with_renderer(&scene, settings(1 << 15, None), |renderer| {
        let plan = renderer.photon_plan().expect("in memory").expect("photons are wanted");
        let pass = |pass| sum(&renderer.photons(&plan, pass).expect("in memory").0);
        (0..passes).map(pass).sum::<f32>() / passes as f32
    });
    let photons = by_grid(&scene, 400);
    let (power, count) = (sum(&photons), photons.len());
    assert_close(f64::from(power), f64::from(by_chance), 4e-3, "power through a ball");
    // A disc in a square: most of the rectangle is the ball.
    assert!(count > 400 * 400 / 2, "the rectangle is laid around the ball: {count} photons landed");
}

#[test]
fn lights_share_a_grid() {
    let mut build = Build::in_light(Vec3::ZERO);
    for i in 0..9 {
        build.desc.lights.push(point_light(Vec3::new(i as f32 - 4.0, 4.0, 0.0), 9.0));
    }
    build.add(shapes::quad(), Material::diffuse("floor", Vec3::ONE), floor());
    build.add(shapes::sphere(4, true), Material::glass("glass", 1.5, 0.0), ball(0.8, Vec3::Y));
    let scene = build.finish();
    let settings = RenderSettings {
        caustics: Some(PhotonSettings { grid: Some([90; 2]), ..PhotonSettings::default() }),
        ..settings(1, None)
    };
    let sent = with_renderer(&scene, settings, |renderer| {
        let plan = renderer.photon_plan().expect("in memory").expect("photons are wanted");
        plan.grid_pass(0, 0).expect("by a grid").photons
    });
    assert_eq!(sent, 90 * 90);
    assert!(by_grid(&scene, 90).len() > 90 * 90 / 2, "every light has a rectangle of its own");
}

/// A prism of 60 degrees with its edge up, along z, of height 1.
fn prism() -> Mesh {
    let corners = [[0.0, 1.0], [-0.577_35, 0.0], [0.577_35, 0.0_f32]];
    let at = |z: f32| corners.map(|[x, y]| Vec3::new(x, y, z));
    let triangles =
        vec![[0, 1, 2], [3, 5, 4], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]];
    Mesh { positions: [at(0.5), at(-0.5)].concat(), triangles, ..Mesh::default() }
}

/// Index of refraction and colour of the wavelength for `u` in a glass.
fn in_glass(u: f32, ior: f32, dispersion: f32) -> (f64, Vec3) {
    let glass = BsdfParams { ior, dispersion, thin: false, ..BsdfParams::diffuse(Vec3::ONE) };
    let mut params = BsdfParams { transmission: 1.0, ..glass };
    Wavelength::new(u, false).apply(&mut params);
    (f64::from(params.ior), params.transmission_tint)
}

#[test]
fn a_prism_parts_colours_as_snell_says() {
    let (incidence, apex) = (50.0_f64.to_radians(), 60.0_f64.to_radians());
    let (ior, dispersion) = (1.5, 20.0 / 30.0);
    // The left face looks up by 150 degrees: the beam goes up by 20.
    let up = (incidence - 30.0_f64.to_radians()) as f32;
    let beam = Vec3::new(up.cos(), up.sin(), 0.0);
    let frame = Frame::from_z(-beam);
    let source = Vec3::new(-0.288_675, 0.5, 0.0) - beam * 3.0;
    let mut build = Build::in_light(Vec3::ZERO);
    build.desc.lights.push(Light {
        kind: LightKind::Spot { inner: 0.008, outer: 0.009 },
        world_from_light: Affine3::from_cols(frame.x, frame.y, frame.z, source),
        ..point_light(source, 100.0)
    });
    let glass = Material { dispersion, ..Material::glass("prism", ior, 0.0) };
    build.add(prism(), glass, Affine3::IDENTITY);
    build.add(shapes::quad(), Material::diffuse("wall", Vec3::ONE), facing(-Vec3::X, 20.0, Vec3::X * 5.0));
    let scene = build.finish();
    // Mean angle of what leaves the prism downwards, by colour: found, and by Snell's law at both faces.
    let (mut expected, mut weights) = ([0.0; 3], [0.0; 3]);
    for i in 0..4000 {
        let (n, color) = in_glass((i as f32 + 0.5) / 4000.0, ior, dispersion);
        let inside = apex - (incidence.sin() / n).asin();
        let exit = (n * inside.sin()).asin();
        for c in 0..3 {
            expected[c] += f64::from(color[c]) * (exit - 30.0_f64.to_radians());
            weights[c] += f64::from(color[c]);
        }
    }
    let (mut found, mut power) = ([0.0; 3], [0.0; 3]);
    let photons = by_grid(&scene, 256);
    assert!(photons.len() > 30_000, "the rectangle is laid around the beam: {} photons", photons.len());
    for photon in photons.iter().filter(|photon| photon.segments == 3) {
        for c in 0..3 {
            found[c] += f64::from(photon.flux[c]) * f64::from(photon.from.y.atan2(-photon.from.x));
            power[c] += f64::from(photon.flux[c]);
        }
    }
    // The beam's intensity times its solid angle, its rim half of it, less what both faces reflect.
    let beam = 100.0 * PI * (0.0085_f64).powi(2);
    assert!(power.iter().all(|&power| power > 0.8 * beam && power < beam), "{power:?} of {beam}");
    let [red, green, blue]: [f64; 3] = std::array::from_fn(|c| (found[c] / power[c]).to_degrees());
    for (c, name) in ["red", "green", "blue"].into_iter().enumerate() {
        let (found, expected) = (found[c] / power[c], expected[c] / weights[c]);
        let apart = (found - expected).abs().to_degrees();
        assert!(apart < 0.1, "{name} is {apart} degrees off {}", expected.to_degrees());
    }
    assert!(red + 0.5 < green && green + 0.5 < blue, "colours part in their order: {red} {green} {blue}");
}

/// A glass or metal thing over a floor, under a lamp that paths find often enough.
fn under_lamp(thing: Material, level: u32) -> Scene {
    Build::in_light(Vec3::ZERO)
        .add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), floor())
        .add(shapes::sphere(level, true), thing, ball(0.8, Vec3::new(0.0, 0.9, 0.0)))
        .add(
            shapes::quad(),
            Material::emitter("lamp", Vec3::splat(20.0), false),
            facing(-Vec3::Y, 1.0, Vec3::new(0.5, 4.0, 0.0)),
        )
        .finish()
}

#[test]
fn a_lens_gives_the_light_that_paths_find() {
    assert_same_light(&under_lamp(Material::glass("glass", 1.5, 0.0), 4), 1024, 0.01, "glass ball");
}

/// Light on its way to one enters the box of another, or leaves one ball for the next.
#[test]
fn balls_in_each_others_way_give_the_light_that_paths_find() {
    let mut build = Build::in_light(Vec3::ZERO);
    build.add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), floor());
    for (x, y) in [(-0.5, 0.6), (0.5, 0.6), (0.0, 1.5), (0.6, 2.0)] {
        let thing = Material::glass("glass", 1.5, 0.0);
        build.add(shapes::sphere(4, true), thing, ball(0.5, Vec3::new(x, y, 0.2 * x)));
    }
    let lamp = Material::emitter("lamp", Vec3::splat(20.0), false);
    build.add(shapes::quad(), lamp, facing(-Vec3::Y, 1.0, Vec3::new(0.5, 4.0, 0.0)));
    assert_same_light(&build.finish(), 1024, 0.01, "four balls");
}

/// Coarse triangles with smooth normals, which scatter power otherwise than radiance.
#[test]
fn smooth_normals_of_coarse_bodies_give_the_light_that_paths_find() {
    assert_same_light(&under_lamp(mirror(), 1), 512, 0.01, "coarse mirror");
}

/// A ball of dark glass around one of another kind.
#[test]
fn nested_volumes_give_the_light_that_paths_find() {
    let dark = Material {
        attenuation_color: Vec3::new(0.9, 0.5, 0.2),
        attenuation_distance: 0.7,
        ..Material::glass("dark", 1.6, 0.0)
    };
    let mut build = Build::in_light(Vec3::ZERO);
    build.add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), floor());
    build.add(shapes::sphere(4, true), dark, ball(0.8, Vec3::new(0.0, 0.9, 0.0)));
    build.add(
        shapes::sphere(4, true),
        Material::glass("kernel", 1.2, 0.0),
        ball(0.5, Vec3::new(0.0, 0.9, 0.0)),
    );
    let lamp = Material::emitter("lamp", Vec3::splat(20.0), false);
    build.add(shapes::quad(), lamp, facing(-Vec3::Y, 1.0, Vec3::new(0.5, 4.0, 0.0)));
    assert_same_light(&build.finish(), 1024, 0.01, "nested balls");
}

/// From the lamp through a ball to the floor and to the eye there are four segments, and five by way of a wall.
#[test]
fn ways_of_photons_are_as_long_as_those_of_paths() {
    let mut build = Build::in_light(Vec3::ZERO);
    let white = Material::diffuse("white", Vec3::splat(0.9));
    build.add(shapes::quad(), white.clone(), floor());
    build.add(shapes::quad(), white, facing(Vec3::Z, 10.0, Vec3::new(0.0, 0.0, -0.9)));
    build.add(
        shapes::sphere(4, true),
        Material::glass("glass", 1.5, 0.0),
        ball(0.8, Vec3::new(0.0, 0.9, 0.0)),
    );
    let lamp = Material::emitter("lamp", Vec3::splat(20.0), false);
    build.add(shapes::quad(), lamp, facing(-Vec3::Y, 0.5, Vec3::new(0.0, 4.0, 0.0)));
    let scene = build.finish();
    let four = RenderSettings { max_depth: 4, ..settings(1 << 15, None) };
    assert_same_light_by(&four, &scene, (1024, 0.01), "four segments");
    let three = RenderSettings { max_depth: 3, ..four.clone() };
    let dark = average_under(&scene, &three, 8, |_, _, _| PhotonMaps::default());
    let reflected = average(&scene, &three, 8) - dark;
    let all = average(&scene, &four, 8) - average_under(&scene, &four, 8, |_, _, _| PhotonMaps::default());
    assert!(
        reflected >= 0.0 && reflected < 0.3 * all,
        "no way through a ball has three: {reflected} of {all}"
    );
}

#[test]
fn rough_glass_gives_the_light_that_paths_find() {
    assert_same_light(&under_lamp(Material::glass("frosted", 1.5, 0.25), 3), 512, 0.01, "frosted ball");
}

#[test]
fn a_mirror_ball_gives_the_light_that_paths_find() {
    assert_same_light(&under_lamp(mirror(), 4), 512, 0.01, "mirror ball");
}

#[test]
fn coated_colour_gives_the_light_that_paths_find() {
    let varnished = Material {
        clearcoat: ScalarInput::new(1.0),
        clearcoat_roughness: ScalarInput::new(0.0),
        roughness: ScalarInput::new(0.5),
        ..Material::diffuse("varnished", Vec3::new(0.5, 0.2, 0.1))
    };
    assert_same_light(&under_lamp(varnished, 3), 512, 0.0025, "varnished ball");
}

#[test]
fn the_sky_through_a_lens_gives_the_light_that_paths_find() {
    let scene = Build::in_light(Vec3::new(1.0, 1.5, 2.0))
        .add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), floor())
        .add(shapes::sphere(3, true), Material::glass("glass", 1.5, 0.0), ball(1.2, Vec3::new(0.0, 1.3, 0.0)))
        .finish();
    assert_same_light(&scene, 256, 0.01, "glass ball under a sky");
}

#[test]
fn a_lamp_inside_of_glass_gives_the_light_that_paths_find() {
    let scene = Build::in_light(Vec3::ZERO)
        .add(shapes::quad(), Material::diffuse("floor", Vec3::splat(0.6)), floor())
        .add(shapes::sphere(4, true), Material::glass("bulb", 1.5, 0.0), ball(0.8, Vec3::new(0.0, 0.9, 0.0)))
        .add(
            shapes::sphere(2, false),
            Material::emitter("filament", Vec3::splat(30.0), false),
            ball(0.3, Vec3::new(0.1, 0.8, 0.0)),
        )
        .finish();
    assert_same_light(&scene, 512, 0.01, "lamp in glass");
}

#[test]
fn photons_do_not_depend_on_threads() {
    let scene = under_lamp(Material::glass("glass", 1.5, 0.0), 3);
    let gather = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| average(&scene, &settings(1 << 14, None), 3).to_bits())
    };
    assert_eq!(gather(1), gather(2));
    let other = RenderSettings { seed: 1, ..settings(1 << 14, None) };
    assert_ne!(gather(1), average(&scene, &other, 3).to_bits(), "another seed gives other photons");
}
