//! Where everything lies in the binary chunk.

use std::ops::Range;
use vastlight_math::Aabb;
use vastlight_scene::{Mesh, Scene};

/// A mesh's run of triangles with one material, over the range of vertices that it uses.
#[derive(Clone, Debug)]
pub(super) struct Primitive {
    pub(super) material: u32,
    pub(super) triangles: Range<usize>,
    pub(super) first_vertex: u32,
    pub(super) vertices: u32,
    pub(super) bounds: Aabb,
    pub(super) short_indices: bool,
}

impl Primitive {
    /// Bytes of the indices, padded to four.
    pub(super) fn index_bytes(&self) -> u64 {
        let size = if self.short_indices { 2 } else { 4 };
        (self.triangles.len() as u64 * 3 * size).next_multiple_of(4)
    }
}

/// The primitives of every mesh and the offsets of what follows the vertices.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) primitives: Vec<Vec<Primitive>>,
    /// Offset of each mesh's data.
    pub(super) meshes: Vec<u64>,
    /// Offset and length of each image; length 0 for one that no texture uses.
    pub(super) images: Vec<(u64, u64)>,
    /// Length of the chunk, a multiple of four.
    pub(super) bytes: u64,
}

impl Layout {
    pub(super) fn new(scene: &Scene, images: &[Vec<u8>]) -> Self {
        let primitives: Vec<Vec<Primitive>> = scene.meshes().iter().map(split).collect();
        let mut bytes = 0;
        let mut meshes = Vec::with_capacity(primitives.len());
        for (mesh, primitives) in scene.meshes().iter().zip(&primitives) {
            meshes.push(bytes);
            bytes += mesh.positions.len() as u64 * vertex_bytes(mesh);
            bytes += primitives.iter().map(Primitive::index_bytes).sum::<u64>();
        }
        let mut place = |image: &Vec<u8>| {
            let at = bytes;
            bytes += (image.len() as u64).next_multiple_of(4);
            (at, image.len() as u64)
        };
        let images = images.iter().map(&mut place).collect();
        Self { primitives, meshes, images, bytes }
    }
}

/// Names and sizes in bytes of a mesh's attributes, in file order.
pub(super) fn attributes(mesh: &Mesh) -> Vec<(String, &'static str, u64)> {
    let mut list = vec![("POSITION".to_owned(), "VEC3", 12)];
    if !mesh.normals.is_empty() {
        list.push(("NORMAL".into(), "VEC3", 12));
    }
    if !mesh.tangents.is_empty() {
        list.push(("TANGENT".into(), "VEC4", 16));
    }
    let sets = mesh.uvs.iter().filter(|set| !set.is_empty()).enumerate();
    list.extend(sets.map(|(i, _)| (format!("TEXCOORD_{i}"), "VEC2", 8)));
    if !mesh.colors.is_empty() {
        list.push(("COLOR_0".into(), "VEC4", 16));
    }
    list
}

fn vertex_bytes(mesh: &Mesh) -> u64 {
    attributes(mesh).iter().map(|(_, _, size)| size).sum()
}

fn split(mesh: &Mesh) -> Vec<Primitive> {
    let ends = mesh.parts.iter().skip(1).map(|p| p.first_triangle as usize);
    let starts = std::iter::once(0).chain(ends.clone());
    starts
        .zip(ends.chain([mesh.triangles.len()]))
        .filter(|(start, end)| start < end)
        .map(|(start, end)| primitive(mesh, start..end))
        .collect()
}

fn primitive(mesh: &Mesh, triangles: Range<usize>) -> Primitive {
    let run = &mesh.triangles[triangles.clone()];
    let (low, high) = run.iter().flatten().fold((u32::MAX, 0), |(l, h), &i| (l.min(i), h.max(i)));
    let bounds = Aabb::from_points(mesh.positions[low as usize..=high as usize].iter().copied());
    let vertices = high - low + 1;
    Primitive {
        material: mesh.material_of(triangles.start as u32),
        triangles,
        first_vertex: low,
        vertices,
        bounds,
        short_indices: vertices <= 65_535,
    }
}
