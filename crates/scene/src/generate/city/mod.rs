//! A city of blocks: buildings put together from facade modules, trees, cars and lamps, all of them instances.
//!
//! A handful of meshes is placed again and again, from the middle outwards, until the triangles are used up: ten
//! million instances are a matter of the number asked for (about 100 triangles an instance).

mod blocks;
mod modules;

use super::builder::Builder;
use super::{GenerateOptions, textures};
use crate::{Camera, Environment, SceneDesc, Sky};
use vastlight_math::{Affine3, Vec3};

/// Triangles of a city of its own size.
const USUAL: u64 = 4_000_000;

/// The scene.
pub(super) fn city(options: &GenerateOptions) -> SceneDesc {
    let mut b = Builder::default();
    let kit = modules::Kit::new(&mut b, options.seed);
    let mut site = Site { left: options.triangles.unwrap_or(USUAL), kit, b };
    site.ground();
    blocks::blocks(&mut site, options.seed);
    blocks::bollards(&mut site);
    let mut desc = site.b.desc;
    desc.environment = Some(Environment::Sky(Sky {
        sun_azimuth: -2.25,
        sun_elevation: 0.52,
        turbidity: 3.5,
        ground_albedo: Vec3::splat(0.22),
        strength: 2.0,
        sun_disc: true,
    }));
    let (eye, target) = (Vec3::new(36.0, 27.0, 96.0), Vec3::new(31.0, 12.0, 0.0));
    desc.cameras.push(Camera::look_at("above the street", eye, target, 46_f32.to_radians()));
    desc
}

/// A city that grows until its triangles are used up.
struct Site {
    b: Builder,
    kit: modules::Kit,
    left: u64,
}

impl Site {
    /// Places a mesh; false once the triangles are used up.
    fn place(&mut self, mesh: u32, place: Affine3) -> bool {
        let count = self.b.desc.meshes[mesh as usize].triangles.len() as u64;
        if self.left < count {
            return false;
        }
        self.left -= count;
        self.b.place(mesh, place);
        true
    }

    /// A box between two corners from a unit box.
    fn slab(&mut self, mesh: u32, low: Vec3, high: Vec3) -> bool {
        let place = Affine3::from_translation((low + high) * 0.5) * Affine3::from_scale(high - low);
        self.place(mesh, place)
    }

    /// Asphalt to the horizon.
    fn ground(&mut self) {
        let reach = 4000.0;
        let asphalt = self.kit.asphalt;
        self.slab(asphalt, Vec3::new(-reach, -1.0, -reach), Vec3::new(reach, 0.0, reach));
    }
}
