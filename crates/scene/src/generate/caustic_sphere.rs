//! A glass ball on a plane under a small bright lamp: the plainest scene whose light is mostly a caustic.

use super::{GenerateOptions, builder::Builder, shape::Shape, solids};
use crate::{Camera, Environment, Material, SceneDesc};
use vastlight_math::{Frame, Vec3};

/// Ball of radius 1 and index 1.5 at (0, 1.15, 0) over a plane of albedo 0.8; a lamp of 0.2 x 0.2 at (4, 4.5, 0).
pub(super) fn caustic_sphere(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let plane = b.material(Material::diffuse("plane", Vec3::splat(0.8)));
    let glass = b.material(Material::glass("glass", 1.5, 0.0));
    let lamp = b.material(Material::emitter("lamp", Vec3::splat(400.0), false));
    b.object("plane", plane, &solids::floor(20.0, 20.0));
    let (rings, sectors) = tessellation(options.triangles.unwrap_or(320_000) - 4);
    b.object("ball", glass, &solids::ellipsoid(Vec3::ONE, rings, sectors).at(0.0, 1.15, 0.0));
    b.object("lamp", lamp, &square_lamp(Vec3::new(4.0, 4.5, 0.0), Vec3::new(0.0, 1.15, 0.0), 0.2));
    b.desc.environment = Some(Environment::Constant(Vec3::ZERO));
    b.desc.cameras.push(Camera {
        aspect: Some(1.0),
        ..Camera::look_at("above", Vec3::new(0.0, 6.0, 5.0), Vec3::new(-0.4, 0.0, -0.2), 38_f32.to_radians())
    });
    b.desc
}

/// Rings and sectors of a sphere with about so many triangles (2 * sectors * (rings - 1)).
fn tessellation(triangles: u64) -> (u32, u32) {
    let rings = ((triangles as f64 * 0.25).sqrt().round() as u64).max(2);
    let sectors = ((triangles + rings - 1) / (2 * (rings - 1))).max(3);
    (rings as u32, sectors as u32)
}

/// A square of edge `size` at `center` that shines towards `target`.
pub(super) fn square_lamp(center: Vec3, target: Vec3, size: f32) -> Shape {
    let frame = Frame::from_z((target - center).normalize());
    let (x, y) = (frame.x * size * 0.5, frame.y * size * 0.5);
    let mut shape = Shape::default();
    shape.flat_quad([center - x - y, center + x - y, center + x + y, center - x + y]);
    shape
}

/// Squares that shine towards a point: of each the name, the radiance, the middle and the edge.
pub(super) fn square_lamps(b: &mut Builder, target: Vec3, lamps: &[(&str, Vec3, Vec3, f32)]) {
    for &(name, color, at, size) in lamps {
        let lamp = b.material(Material::emitter(name, color, false));
        b.object(name, lamp, &square_lamp(at, target, size));
    }
}
