//! A still life of glass and metal on a table, lit by one small lamp whose caustics lie between the things.

mod cloth;
mod gems;
mod vessels;

use super::palette::{brushed, fabric, gold, srgb, stone};
use super::{GenerateOptions, builder::Builder, lathe, shape::Shape, solids, textures};
use crate::{Camera, ColorInput, Encoding, Environment, Material, Projection, SceneDesc};
use vastlight_math::{Frame, Vec2, Vec3, real::sin_cos};

/// The scene; metres, the table top at y = 0.
pub(super) fn still_life(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    room(&mut b, options.seed);
    lamps(&mut b);
    vessels::goblet(&mut b, Vec3::new(-0.135, 0.0, -0.03));
    vessels::decanter(&mut b, Vec3::new(0.1, 0.004, -0.16));
    metals(&mut b);
    gems::gems(&mut b, options.seed);
    lemons(&mut b, options.seed);
    let clear = b.material(Material::glass("clear glass", 1.5, 0.0));
    b.object("glass ball", clear, &solids::sphere(0.036, 80).at(0.2, 0.0362, 0.04));
    b.desc.environment = Some(Environment::Constant(Vec3::new(0.05, 0.055, 0.07)));
    b.desc.cameras.push(camera());
    b.desc
}

fn camera() -> Camera {
    let (eye, target) = (Vec3::new(0.05, 0.34, 0.98), Vec3::new(0.0, 0.078, -0.03));
    let mut camera = Camera::look_at("table", eye, target, 20.5_f32.to_radians());
    camera.projection = Projection::Perspective {
        vertical_fov: 20.5_f32.to_radians(),
        lens_radius: 0.004,
        focus_distance: (Vec3::new(0.0, 0.02, 0.07) - eye).dot((target - eye).normalize()),
    };
    camera
}

/// Table and wall.
fn room(b: &mut Builder, seed: u64) {
    let planks = textures::planks("walnut", srgb(0x7a5232), srgb(0x3a2314), 5, seed as u32 ^ 17);
    let walnut = b.texture(planks, Encoding::Srgb, Vec2::new(1.1, 0.75));
    let table = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(walnut) },
        ..stone("walnut table", Vec3::ONE, 0.38)
    });
    let top = solids::block(Vec3::new(-0.9, -0.04, -0.6), Vec3::new(0.9, 0.0, 0.42), 0.006);
    b.object("table", table, &top);
    let plaster =
        textures::paint("plaster", 256, |uv| textures::mottled(uv, srgb(0x4d5a5c), 0.35, seed as u32));
    let plaster = b.texture(plaster, Encoding::Srgb, Vec2::splat(1.7));
    let wall = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(plaster) },
        ..stone("wall", Vec3::ONE, 0.9)
    });
    let mut shape = Shape::default();
    let corner = |x: f32, y: f32| Vec3::new(x, y, -0.75);
    shape.flat_quad([corner(-3.0, -0.8), corner(3.0, -0.8), corner(3.0, 2.5), corner(-3.0, 2.5)]);
    b.object("wall", wall, &shape);
    let linen = textures::weave("linen", srgb(0xd8cdb8), srgb(0xc9bba2), 64, seed as u32);
    let linen = b.texture(linen, Encoding::Srgb, Vec2::splat(0.06));
    let cloth = fabric("linen", Vec3::ONE);
    let cloth = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(linen) },
        sheen_color: ColorInput::new(Vec3::splat(0.2)),
        ..cloth
    });
    b.object("cloth", cloth, &cloth::runner(seed));
}

/// The small key lamp behind the things, and a large dim window to the right.
fn lamps(b: &mut Builder) {
    let key = b.material(Material::emitter("key lamp", Vec3::new(1.0, 0.83, 0.62) * 820.0, false));
    let at = Vec3::new(-0.62, 0.86, -0.42);
    b.object("key lamp", key, &disc(at, Vec3::new(0.0, 0.0, 0.02), 0.055));
    let window = b.material(Material::emitter("window", Vec3::new(0.72, 0.85, 1.0) * 9.0, false));
    let center = Vec3::new(1.25, 0.75, 0.5);
    let frame = Frame::from_z_and_tangent((Vec3::new(0.0, 0.1, 0.0) - center).normalize(), Vec3::Z);
    let mut panes = Shape::default();
    for (i, j) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        let middle = center + frame.x * (0.16 * i) + frame.y * (0.21 * j);
        let (x, y) = (frame.x * 0.145, frame.y * 0.195);
        panes.flat_quad([middle - x - y, middle + x - y, middle + x + y, middle - x + y]);
    }
    b.object("window", window, &panes);
}

/// A round lamp that faces `target`.
fn disc(center: Vec3, target: Vec3, radius: f32) -> Shape {
    let frame = Frame::from_z((target - center).normalize());
    let mut shape = Shape::default();
    let hub = shape.vertex(center, frame.z, Vec2::ZERO);
    let rim: Vec<u32> = (0..32)
        .map(|i| {
            let (s, c) = sin_cos(std::f32::consts::TAU * i as f32 / 32.0);
            shape.vertex(center + (frame.x * c + frame.y * s) * radius, frame.z, Vec2::new(c, s))
        })
        .collect();
    for i in 0..32 {
        shape.triangle(hub, rim[i], rim[(i + 1) % 32]);
    }
    shape
}

/// A gold band, a chrome ball, a brass tray under the decanter.
fn metals(b: &mut Builder) {
    let gold = b.material(gold("gold", 0.06));
    let (outer, inner, height) = (0.047, 0.0445, 0.021);
    let mut profile: Vec<Vec2> = vec![Vec2::new(inner, 0.0004), Vec2::new(outer - 0.0012, 0.0004)];
    profile.extend((0..=8).map(|i| {
        let (s, c) = sin_cos((i as f32 / 8.0 - 0.5) * 2.2);
        Vec2::new(outer - 0.002 + 0.003 * c, height * (0.5 + 0.48 * s / 0.891))
    }));
    profile.extend([Vec2::new(outer - 0.0012, height), Vec2::new(inner, height), Vec2::new(inner, 0.0004)]);
    b.object("gold band", gold, &lathe::lathe(&profile, 160).at(0.02, 0.0, 0.115));
    let chrome = b.material(Material::metal("chrome", Vec3::new(0.72, 0.73, 0.74), 0.02));
    b.object("chrome ball", chrome, &solids::sphere(0.03, 64).at(-0.045, 0.03, -0.07));
    let brass = b.material(brushed("brass", Vec3::new(0.80, 0.58, 0.28), 0.24));
    let tray = [
        [0.0, 0.0],
        [0.115, 0.0],
        [0.118, 0.001],
        [0.128, 0.011],
        [0.131, 0.012],
        [0.131, 0.0135],
        [0.127, 0.0135],
        [0.116, 0.0035],
        [0.113, 0.0025],
        [0.0, 0.0025],
    ];
    let tray: Vec<Vec2> = tray.map(Vec2::from_array).to_vec();
    b.object("tray", brass, &lathe::lathe(&tray, 128).at(0.1, 0.0003, -0.16));
}

/// Two lemons with pitted skin.
fn lemons(b: &mut Builder, seed: u64) {
    let skin = b.material(Material {
        specular: crate::ScalarInput::new(0.8),
        ..stone("lemon", srgb(0xe9b91c), 0.42)
    });
    let seed = seed as u32;
    let lemon = lathe::lathe(
        &lathe::smooth_profile(
            &[
                [0.0, -0.041],
                [0.006, -0.039],
                [0.018, -0.03],
                [0.028, -0.008],
                [0.0275, 0.01],
                [0.017, 0.029],
                [0.008, 0.036],
                [0.006, 0.041],
                [0.0, 0.043],
            ]
            .map(Vec2::from_array),
            8,
        ),
        72,
    );
    let pitted = super::shape::displaced(lemon, |p| {
        0.00035 * super::noise::noise(p * 820.0, seed) + 0.0012 * super::noise::noise(p * 42.0, seed + 1)
    });
    for (at, lean, turn) in
        [(Vec3::new(-0.215, 0.0275, 0.065), 1.45, 0.5), (Vec3::new(-0.262, 0.0272, 0.005), 1.6, 2.2)]
    {
        let (s, c) = sin_cos(lean);
        let up = Vec3::new(s * sin_cos(turn).1, c, s * sin_cos(turn).0);
        b.object("lemon", skin, &pitted.clone().transformed(&super::shape::stand(at, up)));
    }
}
