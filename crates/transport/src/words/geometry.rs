//! Meshes and instances as words: a record for each.

use super::Words;
use super::pages::Attributes;
use crate::placement::Placements;
use crate::stream::is_clear;
use crate::veil::VeilIndex;
use vastlight_scene::{Mesh, Scene};
use vastlight_trace::Tracer;

/// Words of a mesh.
pub const MESH_WORDS: usize = 6;
/// Which attributes its vertices have: see `AttributeLayout`.
pub const ATTRIBUTES: usize = 0;
/// What positions in its pages are to be multiplied with.
pub const UNSCALE: usize = 1;
/// The first block of its triangles in their own order, `u32::MAX` for none: see [`pages`](super::pages).
pub const FIRST_BLOCK: usize = 2;
/// The word of `tables` where its parts begin: first triangle and material, two words each.
pub const PARTS: usize = 3;
/// How many parts there are.
pub const PART_COUNT: usize = 4;
/// What rays may pass some of its surfaces: 1 any, 2 shadow rays of the integrator `whitted`, or both.
pub const VEILED: usize = 5;

/// Words of an instance.
pub const INSTANCE_WORDS: usize = 26;
/// Columns of the map to the world.
pub const MAP: usize = 0;
/// Columns of the map of normals.
pub const NORMAL_MAP: usize = 12;
/// 1, or -1 where it is mirrored.
pub const HANDEDNESS: usize = 21;
/// Norm, spread and translation of the map, for error bounds.
pub const NORM: usize = 22;
/// Its mesh.
pub const MESH: usize = 25;

/// Appends all meshes: parts, then records. Gives where the records begin.
pub(super) fn put_meshes(
    tables: &mut Words,
    (scene, tracer): (&Scene, &Tracer),
    veils: &VeilIndex,
    attributes: &Attributes,
) -> u32 {
    let mut records = Words::default();
    for (number, mesh) in scene.meshes().iter().enumerate() {
        records.u32(attributes.layouts.get(number).copied().unwrap_or_default().0);
        records.f32(tracer.unscale(number as u32));
        records.u32(attributes.first_blocks[number]);
        records.u32s(&[tables.offset(), mesh.parts.len() as u32]);
        mesh.parts.iter().for_each(|part| tables.u32s(&[part.first_triangle, part.material]));
        records.u32(u32::from(veils.has_veils(number)) | u32::from(has_clear(scene, mesh)) << 1);
    }
    let first = tables.offset();
    tables.u32s(&records.finish());
    first
}

/// Whether shadow rays of `whitted` pass some surface of a mesh.
fn has_clear(scene: &Scene, mesh: &Mesh) -> bool {
    let clear = |material: u32| scene.materials().get(material as usize).is_some_and(is_clear);
    if mesh.parts.is_empty() { clear(0) } else { mesh.parts.iter().any(|part| clear(part.material)) }
}

/// Appends all instances.
pub(crate) fn put_instances(tables: &mut Words, scene: &Scene, placements: &Placements) {
    let instances = scene.instances();
    for (number, map) in instances.maps().iter().enumerate() {
        for column in [map.x_axis, map.y_axis, map.z_axis, map.translation] {
            tables.vec3(column);
        }
        placements.get(map, number as u32).put(tables);
        tables.u32(instances.mesh(number));
    }
}
