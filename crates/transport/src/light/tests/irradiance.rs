//! Irradiance from lights at a place against closed forms and quadrature.

use super::*;
use std::sync::Arc;
use vastlight_scene::{
    AlphaMode, Channel, Encoding, Filter, IesProfile, Image, Light, LightKind, ScalarInput, Texels, Texture,
};

/// Lambert 1760: irradiance from a uniform polygon above the horizon, per radiance.
fn lambert(corners: &[Vec3], from: Vec3, normal: Vec3) -> f32 {
    let directions: Vec<Vec3> = corners.iter().map(|c| (*c - from).normalize()).collect();
    let edge = |i: usize| {
        let (a, b) = (directions[i], directions[(i + 1) % directions.len()]);
        a.cross(b).normalize().dot(normal) * a.angle_between(b)
    };
    0.5 * (0..directions.len()).map(edge).sum::<f32>().abs()
}

#[test]
fn square_agrees_with_lambert() {
    let mut desc = dark(vec![Material::emitter("lamp", Vec3::new(2.0, 4.0, 8.0), false)]);
    let map = Affine3::from_translation(Vec3::new(0.0, 1.0, 0.0)) * Affine3::from_rotation_x(PI / 2.0);
    add_mesh(&mut desc, &square(), 0, map);
    let corners: Vec<Vec3> = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .iter()
        .map(|[x, y]| map.transform_point3(Vec3::new(*x, *y, 0.0)))
        .collect();
    with_lights(desc, 1 << 20, |_, lights| {
        let tilted = Vec3::new(0.3, 0.9, -0.2).normalize();
        for from in
            [Vec3::ZERO, Vec3::new(0.3, 0.6, 0.2), Vec3::new(3.0, -1.0, 0.5), Vec3::new(0.0, -40.0, 9.0)]
        {
            for normal in [Vec3::Y, tilted] {
                // Stay where the whole square is above the horizon.
                if corners.iter().all(|c| (*c - from).dot(normal) > 0.0) {
                    let found = irradiance(lights, from, normal, 4096);
                    let expected = lambert(&corners, from, normal);
                    assert_near(found.x, 2.0 * expected, 5e-3, "red");
                    assert_near(found.z, 8.0 * expected, 5e-3, "blue");
                }
            }
        }
        assert_eq!(
            irradiance(lights, Vec3::new(0.2, 1.5, 0.1), Vec3::NEG_Y, 64),
            Vec3::ZERO,
            "behind it is dark"
        );
    });
}

/// A sphere of `rows` x 2 `rows` quads; the front is outside.
fn sphere(rows: u32) -> Vec<[Vec3; 3]> {
    let at = |i: u32, j: u32| {
        let (s, c) = (PI * i as f32 / rows as f32).sin_cos();
        let (sp, cp) = (PI * j as f32 / rows as f32).sin_cos();
        Vec3::new(s * cp, c, s * sp)
    };
    let quads = (0..rows).flat_map(|i| (0..2 * rows).map(move |j| (i, j)));
    quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

#[test]
fn inside_a_bright_sphere_all_irradiances_are_pi() {
    for (scale, two_sided) in [(Vec3::splat(-3.0), false), (Vec3::splat(3.0), true)] {
        let mut desc = dark(vec![Material::emitter("wall", Vec3::ONE, two_sided)]);
        // A mirrored instance keeps its outside, so only turning the triangles makes a one-sided wall shine inwards.
        let mut corners = sphere(12);
        if !two_sided {
            corners.iter_mut().for_each(|t| t.swap(1, 2));
        }
        add_mesh(&mut desc, &corners, 0, Affine3::from_scale(scale));
        with_lights(desc, 1 << 20, |_, lights| {
            for from in [Vec3::ZERO, Vec3::new(1.5, 1.0, -1.0)] {
                for normal in [Vec3::Y, Vec3::new(0.6, -0.8, 0.0)] {
                    assert_near(irradiance(lights, from, normal, 16_384).y, PI, 1e-2, "furnace");
                }
            }
        });
    }
}

#[test]
fn light_and_direction_sampling_agree_on_average() {
    // Irradiance by light samples, by cosine samples that hit the lights, and by the balance heuristic of both.
    with_lights(mixed_lights(), 1 << 20, |scene, lights| {
        let materials = MaterialTable::new(scene);
        let normal = Vec3::new(0.1, 0.9, 0.3).normalize();
        let from = Vec3::new(0.2, -0.3, 0.1);
        let frame = vastlight_math::Frame::from_z(normal);
        let point = crate::ShadingPoint::default();
        let seen = |d: Vec3| {
            // Lights do not hide each other here: everything along the direction counts.
            let mut sum = (lights.environment(d), lights.pdf_environment(from, normal, d));
            for (i, t, p) in all_hits(scene, from, d) {
                let instance = scene.instances().get(i as usize).expect("an instance");
                let material = scene.meshes()[instance.mesh as usize].material_of(t);
                let map = instance.world_from_object;
                let [a, b, c] = scene.meshes()[instance.mesh as usize].corners(t);
                let front = (map.matrix3.inverse().transpose() * (b - a).cross(c - a)).dot(d) < 0.0;
                if front || materials.is_two_sided(material) {
                    sum.0 += materials.emission(material, &point);
                }
                sum.1 += lights.pdf_hit(from, normal, i, t, p);
            }
            sum
        };
        let n = 20_000;
        let (mut by_light, mut by_direction, mut by_both) = (0.0, 0.0, 0.0);
        for i in 0..n {
            let mut u = Sampler::new([7, 7], i, 1);
            let d = frame.to_outer(vastlight_math::warp::cosine_hemisphere(u.next_2d()));
            let (radiance, pdf_light) = seen(d);
            let pdf_cosine = d.dot(normal) / PI;
            by_direction += radiance.x * PI;
            by_both += radiance.x * d.dot(normal) / (pdf_cosine + pdf_light);
            if let Some(s) = lights.sample(from, normal, u.next_1d(), u.next_2d()) {
                let cosine = s.wi.dot(normal).max(0.0);
                by_light += s.radiance.x * cosine / s.pdf;
                // All lights along this direction, as the balance heuristic over "any light" has it.
                let (radiance, pdf_light) = seen(s.wi);
                by_both += radiance.x * cosine / (cosine / PI + pdf_light);
            }
        }
        let n = n as f32;
        assert_near(by_light / n, by_direction / n, 2e-2, "light against direction");
        assert_near(by_both / n, by_direction / n, 2e-2, "both against direction");
    });
}

/// A description with one textured square lamp; the texture has two columns, the left of them black or transparent.
fn half_lit(alpha_mode: AlphaMode, left: [f32; 4], right: [f32; 4]) -> SceneDesc {
    let mut lamp = Material::emitter("lamp", Vec3::ONE, false);
    lamp.emission.texture = Some(0);
    lamp.alpha = ScalarInput { factor: 1.0, texture: Some((0, Channel::A)) };
    lamp.alpha_mode = alpha_mode;
    let mut desc = dark(vec![lamp]);
    let texels = Texels::F32([left, right].concat());
    desc.images.push(Image { name: "halves".into(), width: 2, height: 1, channels: 4, texels });
    desc.textures.push(Texture { filter: Filter::Nearest, ..Texture::new(0, Encoding::Linear) });
    // Texture coordinates are the positions: 0..1 is the right half of one copy... of a square scaled to fit.
    let unit: Vec<[Vec3; 3]> =
        square().iter().map(|t| t.map(|p| (p + Vec3::new(1.0, 1.0, 0.0)) * 0.5)).collect();
    let down = Affine3::from_translation(Vec3::Y) * Affine3::from_rotation_x(PI / 2.0);
    add_mesh(&mut desc, &unit, 0, down);
    desc
}

#[test]
fn textures_and_alpha_scale_the_emission() {
    let right_half: Vec<Vec3> = [[0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 1.0]]
        .iter()
        .map(|[x, z]| Vec3::new(*x, 1.0, *z))
        .collect();
    let expected = lambert(&right_half, Vec3::ZERO, Vec3::Y);
    let white = [3.0, 3.0, 3.0, 1.0];
    for (mode, left, factor) in [
        (AlphaMode::Opaque, [0.0; 4], 3.0),
        (AlphaMode::Mask(0.5), [3.0, 3.0, 3.0, 0.0], 3.0),
        (AlphaMode::Blend, [3.0, 3.0, 3.0, 0.0], 3.0),
    ] {
        with_lights(half_lit(mode, left, white), 1 << 20, |_, lights| {
            assert_near(irradiance(lights, Vec3::ZERO, Vec3::Y, 8192).x, factor * expected, 1e-2, "textured");
        });
    }
    let faint = [3.0, 3.0, 3.0, 0.25];
    with_lights(half_lit(AlphaMode::Blend, [0.0; 4], faint), 1 << 20, |_, lights| {
        assert_near(irradiance(lights, Vec3::ZERO, Vec3::Y, 8192).x, 0.75 * expected, 1e-2, "blended");
    });
    with_lights(half_lit(AlphaMode::Opaque, [0.0; 4], [0.0; 4]), 1 << 20, |_, lights| {
        assert_eq!(irradiance(lights, Vec3::ZERO, Vec3::Y, 64), Vec3::ZERO, "a black texture is no light");
    });
}

pub(super) fn lamp(kind: LightKind, map: Affine3) -> Light {
    Light {
        name: String::new(),
        kind,
        world_from_light: map,
        intensity: Vec3::new(6.0, 3.0, 1.0),
        range: f32::INFINITY,
        profile: None,
    }
}

#[test]
fn lights_without_surface_agree_with_their_formulas() {
    let mut desc = dark(Vec::new());
    let above = Affine3::from_translation(Vec3::new(0.0, 2.0, 0.0));
    // -z of this light points down, its x stays x.
    let down = above * Affine3::from_rotation_x(-PI / 2.0);
    desc.lights.push(lamp(LightKind::Point, above));
    with_lights(desc.clone(), 1 << 20, |_, lights| {
        let from = Vec3::new(1.0, 0.0, 0.5);
        let d = Vec3::new(0.0, 2.0, 0.0) - from;
        let expected = 6.0 * d.y / d.length().powi(3);
        assert_near(irradiance(lights, from, Vec3::Y, 64).x, expected, 1e-4, "point");
    });
    desc.lights[0] = lamp(LightKind::Spot { inner: 0.2, outer: 0.5 }, down);
    with_lights(desc.clone(), 1 << 20, |_, lights| {
        assert_near(irradiance(lights, Vec3::ZERO, Vec3::Y, 16).y, 3.0 / 4.0, 1e-4, "spot");
        assert_eq!(irradiance(lights, Vec3::new(3.0, 0.0, 0.0), Vec3::Y, 16), Vec3::ZERO);
    });
    let profile = IesProfile {
        vertical: vec![0.0, 45.0, 90.0],
        horizontal: vec![0.0, 90.0, 180.0, 270.0, 360.0],
        candela: [[1.0, 0.8, 0.0], [1.0, 0.4, 0.0], [1.0, 0.2, 0.0], [1.0, 0.4, 0.0], [1.0, 0.8, 0.0]]
            .concat(),
        peak_candela: 500.0,
    };
    desc.lights[0] = Light { profile: Some(Arc::new(profile)), ..lamp(LightKind::Point, down) };
    with_lights(desc.clone(), 1 << 20, |_, lights| {
        for (x, factor) in [(0.0, 1.0), (2.0, 0.8), (-2.0, 0.2)] {
            let from = Vec3::new(x, 0.0, 0.0);
            let d = Vec3::new(0.0, 2.0, 0.0) - from;
            let expected = 6.0 * factor * d.y / d.length().powi(3);
            assert_near(irradiance(lights, from, Vec3::Y, 64).x, expected, 1e-3, "profile");
        }
    });
    desc.lights = vec![lamp(LightKind::Directional, down), lamp(LightKind::Directional, above)];
    with_lights(desc, 1 << 20, |_, lights| {
        let tilted = Vec3::new(0.0, 0.8, 0.6);
        assert_near(irradiance(lights, Vec3::ZERO, Vec3::Y, 16).z, 1.0, 1e-4, "directional");
        assert_near(irradiance(lights, Vec3::ZERO, tilted, 4096).z, 1.4, 1e-2, "two directional");
        assert_eq!(lights.environment(Vec3::Y), Vec3::ZERO);
    });
}

#[test]
fn point_lights_are_chosen_as_often_as_their_probability_says() {
    let mut desc = dark(Vec::new());
    let mut rng = Rng::new(8);
    for i in 0..40 {
        let place = Vec3::new(rng.next_1d() * 10.0 - 5.0, 1.0 + rng.next_1d(), rng.next_1d() * 10.0 - 5.0);
        let kind = if i % 3 == 0 { LightKind::Spot { inner: 0.5, outer: 0.8 } } else { LightKind::Point };
        let down = Affine3::from_translation(place) * Affine3::from_rotation_x(-PI / 2.0);
        desc.lights.push(lamp(kind, down));
    }
    let places: Vec<Vec3> = desc.lights.iter().map(|l| l.world_from_light.translation).collect();
    with_lights(desc, 1 << 20, |_, lights| {
        let n = 40_000;
        let (mut observed, mut expected) = (vec![0.0; 41], vec![0.0; 41]);
        for _ in 0..n {
            match lights.sample(Vec3::ZERO, Vec3::Y, rng.next_1d(), rng.next_2d()) {
                Some(s) => {
                    let at = s.wi * s.distance;
                    let chosen = (0..40).min_by(|&a, &b| {
                        places[a].distance_squared(at).total_cmp(&places[b].distance_squared(at))
                    });
                    let chosen = chosen.expect("forty lights");
                    observed[chosen] += 1.0;
                    expected[chosen] = f64::from(s.pdf) * f64::from(n);
                }
                None => observed[40] += 1.0,
            }
        }
        expected[40] = f64::from(n) - expected[..40].iter().sum::<f64>();
        let p = vastlight_math::stats::chi_square(&observed, &expected).p;
        assert!(p > 1e-3, "{p}");
        expected[..40].rotate_left(5);
        assert!(vastlight_math::stats::chi_square(&observed, &expected).p < 1e-6, "negative control");
    });
}
