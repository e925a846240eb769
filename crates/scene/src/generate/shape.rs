//! A shape: triangles with normals and texture coordinates in metres, before it gets a material and a place.

use crate::{Mesh, Part};
use serde::{Deserialize, Serialize};
use vastlight_math::{Affine3, Vec2, Vec3, Vec4};

/// Triangles of one surface. Normals and uvs are as long as positions; colours are empty or as long.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Shape {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    /// Texture coordinates in metres along the surface.
    pub(super) uvs: Vec<Vec2>,
    pub(super) colors: Vec<Vec4>,
    /// Counter-clockwise seen from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// Adds a vertex and returns its index.
    pub(super) fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
        (self.positions.len() - 1) as u32
    }

    /// Adds the triangle a, b, c.
    pub(super) fn triangle(&mut self, a: u32, b: u32, c: u32) {
        self.triangles.push([a, b, c]);
    }

    /// Adds the quadrilateral a, b, c, d.
    pub(super) fn quad(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.triangles.push([a, b, c]);
        self.triangles.push([a, c, d]);
    }

    /// Adds a flat quadrilateral with its own vertices; texture coordinates run along its first edge.
    pub(super) fn flat_quad(&mut self, corners: [Vec3; 4]) {
        let [a, b, _, d] = corners;
        let normal = (b - a).cross(d - a).normalize_or_zero();
        let u = (b - a).normalize_or_zero();
        let v = u.cross(normal);
        let [ia, ib, ic, id] =
            corners.map(|p| self.vertex(p, normal, Vec2::new((p - a).dot(u), (p - a).dot(v))));
        self.quad(ia, ib, ic, id);
    }

    /// Adds all of `other`.
    pub(super) fn merge(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        let colored = !self.colors.is_empty() || !other.colors.is_empty();
        if colored {
            self.colors.resize(self.positions.len(), Vec4::ONE);
        }
        self.positions.extend_from_slice(&other.positions);
        self.normals.extend_from_slice(&other.normals);
        self.uvs.extend_from_slice(&other.uvs);
        if colored {
            self.colors.extend_from_slice(&other.colors);
            self.colors.resize(self.positions.len(), Vec4::ONE);
        }
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + first)));
    }

    /// This shape after an affine map; a mirroring map keeps the outside outside.
    pub(super) fn transformed(mut self, map: &Affine3) -> Self {
        let normal_map = map.matrix3.inverse().transpose();
        for p in &mut self.positions {
            *p = map.transform_point3(*p);
        }
        for n in &mut self.normals {
            *n = (normal_map * *n).normalize_or_zero();
        }
        if map.matrix3.determinant() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    /// This shape, moved.
    pub(super) fn at(self, x: f32, y: f32, z: f32) -> Self {
        self.transformed(&Affine3::from_translation(Vec3::new(x, y, z)))
    }

    /// This shape, turned about +y (counter-clockwise seen from above).
    pub(super) fn turned(self, angle: f32) -> Self {
        self.transformed(&turn(angle))
    }

    /// This shape with flat faces: every triangle has its own vertices.
    pub(super) fn faceted(&self) -> Self {
        let mut flat = Self::default();
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
            let [a, b, c] = t.map(|i| flat.vertex(self.positions[i as usize], normal, self.uvs[i as usize]));
            flat.triangle(a, b, c);
        }
        flat
    }
}

/// A rotation about +y, counter-clockwise seen from above, with our own sine and cosine.
pub(super) fn turn(angle: f32) -> Affine3 {
    let (s, c) = vastlight_math::real::sin_cos(angle);
    Affine3::from_cols(Vec3::new(c, 0.0, -s), Vec3::Y, Vec3::new(s, 0.0, c), Vec3::ZERO)
}

/// A frame that takes +y to `up` (any length but zero) and stands at `origin`.
pub(super) fn stand(origin: Vec3, up: Vec3) -> Affine3 {
    let frame = vastlight_math::Frame::from_z(up.normalize());
    Affine3::from_cols(frame.y, frame.z, frame.x, origin)
}

/// A mesh that grows shape by shape, each with its material.
#[derive(Clone, Debug, Default)]
pub(super) struct Assembly {
    shape: Shape,
    parts: Vec<Part>,
}

impl Assembly {
    /// Adds a shape with a material.
    pub(super) fn add(&mut self, material: u32, shape: &Shape) -> &mut Self {
        if shape.triangles.is_empty() {
            return self;
        }
        if self.parts.last().is_none_or(|p| p.material != material) {
            self.parts.push(Part { first_triangle: self.shape.triangles.len() as u32, material });
        }
        self.shape.merge(shape);
        self
    }

    /// Makes room for so many vertices (without colours) and triangles.
    pub(super) fn reserve(&mut self, vertices: usize, triangles: usize) {
        self.shape.positions.reserve(vertices);
        self.shape.normals.reserve(vertices);
        self.shape.uvs.reserve(vertices);
        self.shape.triangles.reserve(triangles);
    }

    /// Triangles so far.
    pub(super) fn triangles(&self) -> usize {
        self.shape.triangles.len()
    }

    /// The mesh.
    pub(super) fn into_mesh(self, name: &str) -> Mesh {
        let Shape { positions, normals, uvs, colors, triangles } = self.shape;
        Mesh {
            name: name.into(),
            positions,
            triangles,
            normals,
            tangents: Vec::new(),
            uvs: vec![uvs],
            colors,
            parts: self.parts,
            implicit: None,
        }
    }
}

/// Moves vertices along their normals by `height` of their position, and bends the normals accordingly. Vertices at
/// one place move alike, so closed shapes stay closed where their normals agree.
pub(super) fn displaced(mut shape: Shape, height: impl Fn(Vec3) -> f32) -> Shape {
    let size = vastlight_math::Aabb::from_points(shape.positions.iter().copied()).size().length();
    let e = size * 1e-4;
    for (p, n) in shape.positions.iter_mut().zip(&mut shape.normals) {
        let frame = vastlight_math::Frame::from_z(*n);
        let slope = |t: Vec3| (height(*p + t * e) - height(*p - t * e)) / (2.0 * e);
        let (dx, dy) = (slope(frame.x), slope(frame.y));
        *p += *n * height(*p);
        *n = (frame.z - frame.x * dx - frame.y * dy).normalize_or(frame.z);
    }
    shape
}
