//! A quaternion Julia set of brushed gold over a dark plinth: a fractal surface without triangles. Its constant goes around a
//! circle with time.

use super::caustic_sphere::square_lamps;
use super::{GenerateOptions, builder::Builder, lathe, palette::srgb, solids};
use crate::{Camera, Conductor, Environment, ImplicitShape, Julia, Material, ScalarInput, SceneDesc};
use std::f32::consts::TAU;
use vastlight_math::{Vec2, Vec3, real::sin_cos};

/// The constant at time 0, and how far from its mean it goes in its last two components.
const CONSTANT: [f32; 4] = [-0.2, 0.6, 0.2, 0.2];
const CIRCLE: f32 = 0.12;
/// Seconds after which all is as before.
const PERIOD: f32 = 24.0;

/// The set is about 2.4 wide, its middle 1.75 above the floor; three lamps around it.
pub(super) fn julia(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let metal = b.material(Material {
        conductor: Conductor::named("gold"),
        ..Material::metal("gold", Vec3::ONE, 0.3)
    });
    let floor = b.material(Material {
        roughness: ScalarInput::new(0.3),
        ..Material::diffuse("floor", srgb(0x3a4048))
    });
    let plinth = b.material(Material {
        roughness: ScalarInput::new(0.15),
        specular: ScalarInput::new(1.0),
        ..Material::diffuse("plinth", srgb(0x14161a))
    });
    b.object("floor", floor, &solids::floor(60.0, 60.0));
    b.object("plinth", plinth, &lathe::lathe(&profile(), 128));
    b.implicit("julia set", metal, ImplicitShape::Julia(set_at(options.time)));
    let last = b.desc.instances.len() - 1;
    b.desc.instances[last].world_from_object.translation = Vec3::new(0.0, 1.75, 0.0);
    let (key, rim) = (Vec3::new(42.0, 38.0, 33.0), Vec3::new(26.0, 34.0, 48.0));
    let lamps = [
        ("key", key, Vec3::new(-3.4, 4.6, 3.6), 2.0),
        ("rim", rim, Vec3::new(4.6, 4.6, -2.2), 2.0),
        ("low", rim * 0.4, Vec3::new(4.4, 1.4, 4.4), 1.6),
    ];
    square_lamps(&mut b, Vec3::new(0.0, 1.6, 0.0), &lamps);
    b.desc.environment = Some(Environment::Constant(Vec3::new(0.22, 0.25, 0.3)));
    b.desc.cameras.push(Camera::look_at(
        "front",
        Vec3::new(1.2, 2.6, 5.6),
        Vec3::new(0.0, 1.52, 0.0),
        34_f32.to_radians(),
    ));
    b.desc
}

/// The set at a moment.
fn set_at(time: f32) -> Julia {
    let (sin, cos) = sin_cos(TAU * (time / PERIOD).fract());
    let [x, y, z, w] = CONSTANT;
    Julia { c: [x, y, z + CIRCLE * (cos - 1.0), w + CIRCLE * sin], slice: 0.0, iterations: 9 }
}

/// A round plinth with a chamfered edge.
fn profile() -> [Vec2; 5] {
    [[0.0, 0.0], [1.25, 0.0], [1.25, 0.46], [1.19, 0.5], [0.0, 0.5]].map(Vec2::from_array)
}
