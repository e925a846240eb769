//! Tangents for meshes that need them and have none: MikkTSpace (M. Mikkelsen 2008), as glTF asks for.
//!
//! Vertices whose triangles disagree about the tangent (mirrored texture coordinates, seams) are split. glTF's `v` grows
//! downwards while normal maps count upwards, so the sign of the bitangent is the opposite of MikkTSpace's.

use crate::{Material, Mesh, Texture};
use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};
use vastlight_math::{Vec2, Vec3, Vec4, real};

/// Tangents closer than this (one minus the cosine) are one tangent.
const SAME: f32 = 1e-4;

/// For each material the texture coordinate set that its tangents follow, where a mesh has it, else they follow the first;
/// `None` where tangents do not matter.
pub(crate) fn tangent_sets(materials: &[Material], textures: &[Texture]) -> Vec<Option<u32>> {
    let uv_set = |texture: u32| textures.get(texture as usize).map_or(0, |t| t.uv_set);
    let of = |m: &Material| {
        let map = m.normal_map.or(m.clearcoat_normal_map).map(|n| uv_set(n.texture));
        let stretched = || (m.anisotropy != 0.0).then(|| m.anisotropy_texture.map_or(0, uv_set));
        map.or_else(stretched)
    };
    materials.iter().map(of).collect()
}

/// Whether [`derive`] has anything to do for a mesh whose indices are in range.
pub(crate) fn are_missing(mesh: &Mesh, sets: &[Option<u32>]) -> bool {
    !faces_without_tangents(mesh, sets).is_empty()
}

/// Derives the tangents that are missing: all, or those that are zero. Afterwards none has a sign of zero.
pub(crate) fn derive(mesh: &mut Mesh, sets: &[Option<u32>]) {
    let faces = faces_without_tangents(mesh, sets);
    if !faces.is_empty() {
        mesh.tangents.resize(mesh.positions.len(), Vec4::ZERO);
        let mut work = Work { mesh, corners: vec![None; 3 * faces.len()], faces: &faces };
        // The error type has no values.
        if generate_tangents(&mut work).is_ok() {
            let corners = work.corners;
            assign(mesh, &faces, &corners);
        }
    }
    for tangent in &mut mesh.tangents {
        if tangent.w == 0.0 || !tangent.is_finite() {
            *tangent = Vec4::W;
        }
    }
}

/// A triangle, and the texture coordinates that its tangents follow.
struct Face {
    triangle: u32,
    set: u32,
}

fn faces_without_tangents(mesh: &Mesh, sets: &[Option<u32>]) -> Vec<Face> {
    let set_of = |triangle: u32| {
        let wanted = sets.get(mesh.material_of(triangle) as usize).copied().flatten()?;
        let is_there = |set: &u32| mesh.uvs.get(*set as usize).is_some_and(|uvs| !uvs.is_empty());
        [wanted, 0].into_iter().find(is_there)
    };
    let missing = |triangle: u32| {
        let corners = mesh.triangles[triangle as usize];
        mesh.tangents.is_empty() || corners.iter().all(|&v| mesh.tangents[v as usize] == Vec4::ZERO)
    };
    if sets.iter().all(Option::is_none) || mesh.uvs.is_empty() {
        return Vec::new();
    }
    (0..mesh.triangles.len() as u32)
        .filter(|&triangle| missing(triangle))
        .filter_map(|triangle| set_of(triangle).map(|set| Face { triangle, set }))
        .collect()
}

/// Writes the corners' tangents to the vertices; a vertex with several tangents is split.
fn assign(mesh: &mut Mesh, faces: &[Face], corners: &[Option<Vec4>]) {
    // The next copy of the same vertex; itself at the end of the chain.
    let mut next: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for (face, tangents) in faces.iter().zip(corners.chunks_exact(3)) {
        for (corner, tangent) in tangents.iter().enumerate() {
            let Some(tangent) = *tangent else { continue };
            let vertex = mesh.triangles[face.triangle as usize][corner];
            let vertex = vertex_with(mesh, &mut next, vertex, tangent);
            mesh.triangles[face.triangle as usize][corner] = vertex;
        }
    }
}

/// The copy of `vertex` that has this tangent: one that is there, or a new one.
fn vertex_with(mesh: &mut Mesh, next: &mut Vec<u32>, vertex: u32, tangent: Vec4) -> u32 {
    let mut at = vertex;
    loop {
        let there = mesh.tangents[at as usize];
        if there == Vec4::ZERO {
            mesh.tangents[at as usize] = tangent;
            return at;
        }
        let same = there.w == tangent.w && there.truncate().dot(tangent.truncate()) > 1.0 - SAME;
        if same {
            return at;
        }
        if next[at as usize] == at {
            break;
        }
        at = next[at as usize];
    }
    let Ok(copy) = u32::try_from(mesh.positions.len()) else { return at };
    duplicate(mesh, vertex as usize);
    mesh.tangents[copy as usize] = tangent;
    next[at as usize] = copy;
    next.push(copy);
    copy
}

fn duplicate(mesh: &mut Mesh, vertex: usize) {
    fn again<T: Copy>(values: &mut Vec<T>, i: usize) {
        if let Some(&value) = values.get(i) {
            values.push(value);
        }
    }
    again(&mut mesh.positions, vertex);
    again(&mut mesh.normals, vertex);
    again(&mut mesh.tangents, vertex);
    again(&mut mesh.colors, vertex);
    mesh.uvs.iter_mut().for_each(|set| again(set, vertex));
}

/// What MikkTSpace reads and writes.
struct Work<'a> {
    mesh: &'a Mesh,
    faces: &'a [Face],
    corners: Vec<Option<Vec4>>,
}

/// The same bits on every platform.
struct Portable;

impl Ops for Portable {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    fn acos(x: f32) -> f32 {
        real::acos(x)
    }
}

impl Work<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.triangles[self.faces[face].triangle as usize][corner] as usize
    }
}

impl Geometry<Portable> for Work<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        let normal = match self.mesh.normals.get(self.vertex(face, corner)) {
            Some(&normal) => normal,
            None => {
                let [a, b, c] = self.mesh.corners(self.faces[face].triangle);
                (b - a).cross(c - a)
            }
        };
        normal.normalize_or(Vec3::Z).to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        let uv = self.mesh.uvs[self.faces[face].set as usize][self.vertex(face, corner)];
        if uv.is_finite() { uv.to_array() } else { Vec2::ZERO.to_array() }
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        self.corners[3 * face + corner] = space.and_then(|space| {
            let [x, y, z, sign] = space.tangent_encoded();
            let tangent = Vec3::new(x, y, z).try_normalize()?;
            Some(tangent.extend(-sign))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{NormalMap, Part};

    /// A unit square in the plane z = 0, `u` along x, `v` downwards; the second triangle's `u` is mirrored if asked.
    fn square(mirrored: bool) -> Mesh {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
        let uvs = positions.iter().map(|p| Vec2::new(p.x, 1.0 - p.y)).collect::<Vec<_>>();
        let mut mesh = Mesh {
            normals: vec![Vec3::Z; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            positions,
            uvs: vec![uvs],
            ..Mesh::default()
        };
        if mirrored {
            // The corner at y = 1, x = 0 moves to the other side of the diagonal in the texture.
            mesh.uvs[0][3] = Vec2::new(1.5, 0.9);
        }
        mesh
    }

    fn bumpy() -> Vec<Option<u32>> {
        let map = Some(NormalMap { texture: 0, scale: 1.0 });
        tangent_sets(&[Material { normal_map: map, ..Material::new("bumpy") }], &[])
    }

    #[test]
    fn tangents_follow_u_and_bitangents_point_up() {
        let mut mesh = square(false);
        derive(&mut mesh, &bumpy());
        assert_eq!(mesh.positions.len(), 4);
        for t in &mesh.tangents {
            assert!((t.truncate() - Vec3::X).length() < 1e-6, "{t}");
            let bitangent = Vec3::Z.cross(t.truncate()) * t.w;
            assert!((bitangent - Vec3::Y).length() < 1e-6, "{bitangent}");
        }
    }

    #[test]
    fn mirrored_triangles_split_their_vertices() {
        let mut mesh = square(true);
        derive(&mut mesh, &bumpy());
        assert_eq!(mesh.positions.len(), 6);
        assert_eq!((mesh.normals.len(), mesh.tangents.len(), mesh.uvs[0].len()), (6, 6, 6));
        let signs = |t: usize| mesh.triangles[t].map(|v| mesh.tangents[v as usize].w);
        assert_eq!((signs(0), signs(1)), ([1.0; 3], [-1.0; 3]));
        for (triangle, expected) in [(0, [0, 1, 2]), (1, [0, 2, 3])] {
            let original = square(true);
            assert_eq!(mesh.corners(triangle), expected.map(|v: usize| original.positions[v]));
        }
    }

    #[test]
    fn only_what_needs_tangents_gets_them_and_given_ones_stay() {
        let plain = tangent_sets(&[Material::new("plain")], &[]);
        let mut mesh = square(false);
        derive(&mut mesh, &plain);
        assert!(mesh.tangents.is_empty());

        let mut sets = plain;
        sets.extend(bumpy());
        let mut mesh = square(false);
        mesh.parts = vec![Part { first_triangle: 0, material: 1 }];
        let given = Vec3::Y.extend(1.0);
        mesh.tangents = vec![given; 4];
        derive(&mut mesh, &sets);
        assert_eq!(mesh.tangents, vec![given; 4]);
        // Zero stands for a tangent that the file did not have.
        mesh.tangents = vec![Vec4::ZERO; 4];
        derive(&mut mesh, &sets);
        assert!(mesh.tangents.iter().all(|t| (t.truncate() - Vec3::X).length() < 1e-6));
    }

    /// So a mesh with texture coordinates has tangents wherever its material looks at them.
    #[test]
    fn the_first_texture_coordinates_stand_in_for_others() {
        let (mut mesh, mut expected) = (square(false), square(false));
        derive(&mut mesh, &[Some(3)]);
        derive(&mut expected, &[Some(0)]);
        assert!(!mesh.tangents.is_empty());
        assert_eq!(mesh, expected);
    }

    #[test]
    fn nonsense_is_survived() {
        let mut mesh = square(false);
        mesh.uvs[0][1] = Vec2::splat(f32::NAN);
        mesh.normals[2] = Vec3::splat(f32::INFINITY);
        mesh.triangles.push([0, 0, 0]);
        derive(&mut mesh, &bumpy());
        assert!(mesh.tangents.iter().all(|t| t.is_finite() && t.w != 0.0));
    }
}
