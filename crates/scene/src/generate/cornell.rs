//! The Cornell box with the colours measured at Cornell University (reflectances and light converted to linear RGB).

use super::{GenerateOptions, builder::Builder, shape::Shape};
use crate::{Camera, Environment, Material, SceneDesc};
use vastlight_math::Vec3;

/// The box is 0.55 m wide; the published coordinates are millimetres from a corner.
pub(super) fn cornell(_: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let white = b.material(Material::diffuse("white", Vec3::new(0.725, 0.71, 0.68)));
    let red = b.material(Material::diffuse("red", Vec3::new(0.63, 0.065, 0.05)));
    let green = b.material(Material::diffuse("green", Vec3::new(0.14, 0.45, 0.091)));
    let lamp = b.material(Material::emitter("lamp", Vec3::new(17.0, 12.0, 4.0), false));
    let quad = |corners: [[f32; 3]; 4]| {
        let mut shape = Shape::default();
        shape.flat_quad(corners.map(point));
        shape
    };
    let (w, h, d) = (552.8, 548.8, 559.2);
    b.object("floor", white, &quad([[w, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, d], [549.6, 0.0, d]]));
    b.object("ceiling", white, &quad([[556.0, h, 0.0], [556.0, h, d], [0.0, h, d], [0.0, h, 0.0]]));
    b.object("back wall", white, &quad([[549.6, 0.0, d], [0.0, 0.0, d], [0.0, h, d], [556.0, h, d]]));
    b.object("right wall", green, &quad([[0.0, 0.0, d], [0.0, 0.0, 0.0], [0.0, h, 0.0], [0.0, h, d]]));
    b.object("left wall", red, &quad([[w, 0.0, 0.0], [549.6, 0.0, d], [556.0, h, d], [556.0, h, 0.0]]));
    b.object(
        "short block",
        white,
        &block(165.0, [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]]),
    );
    b.object(
        "tall block",
        white,
        &block(330.0, [[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]]),
    );
    let y = h - 0.4;
    b.object(
        "lamp",
        lamp,
        &quad([[343.0, y, 227.0], [343.0, y, 332.0], [213.0, y, 332.0], [213.0, y, 227.0]]),
    );
    b.desc.environment = Some(Environment::Constant(Vec3::ZERO));
    // A 25 mm square film behind a 35 mm lens.
    let fov = 2.0 * vastlight_math::real::atan(12.5 / 35.0);
    let (eye, target) = (point([278.0, 273.0, -800.0]), point([278.0, 273.0, 0.0]));
    b.desc.cameras.push(Camera { aspect: Some(1.0), ..Camera::look_at("front", eye, target, fov) });
    b.desc
}

/// Published millimetres (x to the left, z away from the viewer) to metres with the viewer at +z.
fn point([x, y, z]: [f32; 3]) -> Vec3 {
    Vec3::new(278.0 - x, y, 279.6 - z) * 0.001
}

/// A block from its footprint, whose corners run counter-clockwise in published coordinates.
fn block(height: f32, footprint: [[f32; 2]; 4]) -> Shape {
    let mut shape = Shape::default();
    let at = |i: usize, y: f32| point([footprint[i % 4][0], y, footprint[i % 4][1]]);
    shape.flat_quad([0, 1, 2, 3].map(|i| at(i, height)));
    shape.flat_quad([3, 2, 1, 0].map(|i| at(i, 0.0)));
    for i in 0..4 {
        shape.flat_quad([at(i, height), at(i, 0.0), at(i + 1, 0.0), at(i + 1, height)]);
    }
    shape
}
