//! Where everything lies in the binary chunk.

use std::ops::Range;
use vastlight_math::Aabb;
use vastlight_scene::{Instances, Mesh, PieceInstance};

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

/// Where a mesh lies, without its data.
#[derive(Debug)]
pub(super) struct MeshLayout {
    pub(super) name: String,
    /// Names, types and sizes in bytes of the attributes, in file order.
    pub(super) attributes: Vec<(String, &'static str, u64)>,
    pub(super) vertices: u64,
    pub(super) primitives: Vec<Primitive>,
    pub(super) offset: u64,
}

/// Where everything lies, and what the nodes place.
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub(super) meshes: Vec<MeshLayout>,
    /// Placements that came with their meshes.
    pub(super) instances: Instances,
    /// Offset and length of each image; length 0 for one that no texture uses.
    pub(super) images: Vec<(u64, u64)>,
    /// Length of the chunk so far, a multiple of four.
    pub(super) bytes: u64,
}

impl Layout {
    /// Puts a mesh after those before it.
    pub(super) fn add(&mut self, mesh: &Mesh, instances: &[PieceInstance]) {
        self.instances.add_mesh(instances);
        let layout = MeshLayout {
            name: mesh.name.clone(),
            attributes: attributes(mesh),
            vertices: mesh.positions.len() as u64,
            primitives: split(mesh),
            offset: self.bytes,
        };
        self.bytes += layout.vertices * layout.attributes.iter().map(|(_, _, size)| size).sum::<u64>();
        self.bytes += layout.primitives.iter().map(Primitive::index_bytes).sum::<u64>();
        self.meshes.push(layout);
    }

    /// Puts images after the meshes.
    pub(super) fn add_images(&mut self, images: &[Vec<u8>]) {
        for image in images {
            self.images.push((self.bytes, image.len() as u64));
            self.bytes += (image.len() as u64).next_multiple_of(4);
        }
    }
}

/// Names, types and sizes in bytes of a mesh's attributes, in file order.
fn attributes(mesh: &Mesh) -> Vec<(String, &'static str, u64)> {
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
