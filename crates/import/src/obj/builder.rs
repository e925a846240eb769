//! Corners of OBJ faces to shared vertices and triangles.

use super::normals;
use crate::polygon::Triangulator;
use vastlight_math::{Vec2, Vec3, Vec4};
use vastlight_scene::Mesh;

/// "No such index" in a corner.
pub(super) const NONE: u32 = u32::MAX;

/// Corners at one position that are searched for an equal one; beyond this, vertices are no longer shared.
const MAX_CHAIN: usize = 64;

/// Where a vertex gets its normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NormalSource {
    /// From the triangle.
    Flat,
    /// Index of a `vn`.
    Given(u32),
    /// Smoothed over the faces of a smoothing group.
    Group(u32),
}

/// What makes a vertex: equal corners share one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub(super) position: u32,
    /// Index of a `vt`, or [`NONE`].
    pub(super) uv: u32,
    pub(super) normal: NormalSource,
}

/// The whole file as one mesh under construction.
#[derive(Debug, Default)]
pub(super) struct Builder {
    /// Statements `v`, `vt`, `vn` as they stand in the file.
    pub(super) positions: Vec<Vec3>,
    pub(super) colors: Vec<Vec4>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
    /// Vertices so far, and for each the next one at the same position.
    pub(super) corners: Vec<Corner>,
    pub(super) next: Vec<u32>,
    /// For each position its first vertex.
    pub(super) first: Vec<u32>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) triangulator: Triangulator,
    polygon: Vec<Vec3>,
    vertices: Vec<u32>,
}

impl Builder {
    /// Adds a polygon of at least three corners whose indices are in range.
    pub(super) fn face(&mut self, corners: &[Corner]) {
        self.vertices.clear();
        self.polygon.clear();
        self.first.resize(self.positions.len(), NONE);
        for &corner in corners {
            let vertex = self.vertex(corner);
            self.vertices.push(vertex);
        }
        if let &[a, b, c] = self.vertices.as_slice() {
            self.triangles.push([a, b, c]);
            return;
        }
        self.polygon.extend(corners.iter().map(|c| self.positions[c.position as usize]));
        let (triangles, vertices) = (&mut self.triangles, &self.vertices);
        self.triangulator.triangulate(&self.polygon, |t| triangles.push(t.map(|i| vertices[i as usize])));
    }

    /// The vertex of a corner, a new one if there is none.
    fn vertex(&mut self, corner: Corner) -> u32 {
        let first = self.first[corner.position as usize];
        let (mut at, mut length) = (first, 0);
        while at != NONE {
            if self.corners[at as usize] == corner {
                return at;
            }
            at = self.next[at as usize];
            length += 1;
        }
        let vertex = self.corners.len() as u32;
        self.corners.push(corner);
        if length < MAX_CHAIN {
            self.next.push(first);
            self.first[corner.position as usize] = vertex;
        } else {
            self.next.push(NONE);
        }
        vertex
    }

    /// The mesh of the whole file, without name and parts; and what cut its polygons.
    pub(super) fn into_mesh(mut self) -> (Mesh, Triangulator) {
        let smooth = normals::vertex_normals(&mut self);
        let mut mesh = Mesh { triangles: self.triangles, normals: smooth, ..Mesh::default() };
        mesh.positions = self.corners.iter().map(|c| self.positions[c.position as usize]).collect();
        if !self.colors.is_empty() {
            self.colors.resize(self.positions.len(), Vec4::ONE);
            mesh.colors = self.corners.iter().map(|c| self.colors[c.position as usize]).collect();
        }
        if self.corners.iter().any(|c| c.uv != NONE) {
            let uv = |c: &Corner| self.uvs.get(c.uv as usize).copied().unwrap_or_default();
            mesh.uvs.push(self.corners.iter().map(uv).collect());
        }
        (mesh, self.triangulator)
    }
}
