//! Newton's experiment: a beam of white light through a slit, a glass prism, a spectrum on a white screen.

use super::{GenerateOptions, builder::Builder, extrude::extrude, palette::srgb, solids};
use crate::{Camera, Environment, Light, LightKind, Material, ScalarInput, SceneDesc};
use vastlight_math::{Affine3, Frame, Vec2, Vec3};

/// Edge and height of the prism.
const EDGE: f32 = 1.0;
const TALL: f32 = 0.9;
/// Where the beam comes from, and the middle of the face that it meets.
const SOURCE: Vec3 = Vec3::new(-4.0, 0.75, -1.98);
const TARGET: Vec3 = Vec3::new(-0.25, 0.34, -0.03);

/// An equilateral prism of a dense flint (index 1.62, Abbe number 14, so that the colours part on a table) stands on a white table; a spot
/// light passes a slit on its left; behind it on the right stands the screen.
pub(super) fn prism(_: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let white = b.material(Material::diffuse("white", Vec3::splat(0.85)));
    let black = b.material(Material {
        roughness: ScalarInput::new(0.5),
        ..Material::diffuse("black", srgb(0x101010))
    });
    let glass = b.material(Material { dispersion: 20.0 / 14.0, ..Material::glass("flint", 1.62, 0.0) });
    b.object("table", white, &solids::floor(14.0, 10.0));
    let triangle = [[-0.5, -0.288_675], [0.5, -0.288_675], [0.0, 0.577_35]].map(Vec2::from_array);
    let upright = Affine3::from_cols(Vec3::X, Vec3::Z, Vec3::NEG_Y, Vec3::new(0.0, TALL * 0.5 + 0.002, 0.0));
    let body = extrude(&triangle.map(|p| p * EDGE), TALL).faceted().transformed(&upright);
    b.object("prism", glass, &body);
    slit(&mut b, black);
    b.object(
        "screen",
        white,
        &solids::block(Vec3::new(-2.4, 0.0, -0.05), Vec3::new(2.4, 1.9, 0.05), 0.01)
            .turned(-62_f32.to_radians())
            .at(2.7, 0.0, -1.3),
    );
    let forward = (TARGET - SOURCE).normalize();
    let frame = Frame::from_z(-forward);
    b.desc.lights.push(Light {
        name: "beam".into(),
        kind: LightKind::Spot { inner: 0.028, outer: 0.034 },
        world_from_light: Affine3::from_cols(frame.x, frame.y, frame.z, SOURCE),
        intensity: Vec3::splat(2600.0),
        range: f32::INFINITY,
        profile: None,
    });
    b.desc.environment = Some(Environment::Constant(Vec3::splat(0.09)));
    b.desc.cameras.push(Camera::look_at(
        "desk",
        Vec3::new(0.35, 1.7, 3.7),
        Vec3::new(0.95, 0.42, -0.6),
        36_f32.to_radians(),
    ));
    b.desc
}

/// Two plates that leave an upright slit of 14 mm for the beam.
fn slit(b: &mut Builder, material: u32) {
    let (width, gap, height) = (0.7, 0.007, 1.3);
    let along = (TARGET - SOURCE).with_y(0.0).normalize();
    let at = SOURCE + (TARGET - SOURCE) * 0.45;
    let map = Affine3::from_cols(Vec3::Y.cross(along), Vec3::Y, along, at.with_y(0.0));
    for (name, side) in [("left plate", -1.0), ("right plate", 1.0)] {
        let (near, far): (f32, f32) = (side * gap, side * (gap + width));
        let (low, high) = (Vec3::new(near.min(far), 0.0, -0.02), Vec3::new(near.max(far), height, 0.02));
        b.object(name, material, &solids::block(low, high, 0.004).transformed(&map));
    }
}
