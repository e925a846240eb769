//! Meshes and instances as words: a record for each, and what triangles' corners have.

use super::Words;
use crate::placement::Placements;
use crate::stream::is_clear;
use crate::veil::VeilIndex;
use vastlight_math::Vec3;
use vastlight_scene::{Mesh, Scene};

/// Words of a mesh. What it has not begins at `u32::MAX`.
pub const MESH_WORDS: usize = 12;
/// The words of `corners` where its triangles (three words each), positions, normals, tangents (four words), colours (four)
/// and sets of texture coordinates (two words, four sets) begin.
pub const TRIANGLES: usize = 0;
/// See [`TRIANGLES`].
pub const POSITIONS: usize = 1;
/// See [`TRIANGLES`].
pub const NORMALS: usize = 2;
/// See [`TRIANGLES`].
pub const TANGENTS: usize = 3;
/// See [`TRIANGLES`].
pub const COLORS: usize = 4;
/// See [`TRIANGLES`].
pub const UVS: usize = 5;
/// The word of `tables` where its parts begin: first triangle and material, two words each.
pub const PARTS: usize = 9;
/// How many parts there are.
pub const PART_COUNT: usize = 10;
/// What rays may pass some of its surfaces: 1 any, 2 shadow rays of the integrator `whitted`, or both.
pub const VEILED: usize = 11;

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

/// Most sets of texture coordinates that are handed over.
const SETS: usize = 4;

/// Appends all meshes: parts, then records to `tables`, corners to `corners`. Gives where the records begin.
pub(crate) fn put_meshes(tables: &mut Words, corners: &mut Words, scene: &Scene, veils: &VeilIndex) -> u32 {
    let used = |mesh: usize| !scene.instances().of_mesh(mesh as u32).is_empty();
    let mut records = Words::default();
    for (number, mesh) in scene.meshes().iter().enumerate() {
        if !used(number) {
            records.u32s(&[u32::MAX; MESH_WORDS]);
            continue;
        }
        put_corners(&mut records, corners, mesh);
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

fn put_corners(record: &mut Words, corners: &mut Words, mesh: &Mesh) {
    record.u32(corners.offset());
    corners.u32s(mesh.triangles.as_flattened());
    let mut attribute = |there: bool, put: &dyn Fn(&mut Words)| {
        record.u32(if there { corners.offset() } else { u32::MAX });
        put(corners);
    };
    let vec3s = |values: &[Vec3], words: &mut Words| values.iter().for_each(|v| words.vec3(*v));
    attribute(true, &|words| vec3s(&mesh.positions, words));
    attribute(!mesh.normals.is_empty(), &|words| vec3s(&mesh.normals, words));
    attribute(!mesh.tangents.is_empty(), &|words| {
        mesh.tangents.iter().for_each(|v| words.f32s(&v.to_array()))
    });
    attribute(!mesh.colors.is_empty(), &|words| mesh.colors.iter().for_each(|v| words.f32s(&v.to_array())));
    for set in 0..SETS {
        let uvs = mesh.uvs.get(set).map_or(&[][..], Vec::as_slice);
        attribute(!uvs.is_empty(), &|words| uvs.iter().for_each(|v| words.vec2(*v)));
    }
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
