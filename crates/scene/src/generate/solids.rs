//! Boxes, spheres, discs and grids.

use super::shape::Shape;
use std::f32::consts::{PI, TAU};
use vastlight_math::{Vec2, Vec3, real::sin_cos};

/// An axis-aligned box around the origin with flat faces.
pub(super) fn cuboid(size: Vec3) -> Shape {
    let mut shape = Shape::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            shape.flat_quad(face_corners(size * 0.5, axis, side, 0.0));
        }
    }
    shape
}

/// The corners of one face of a box with these half sizes, drawn in by `inset` on its own plane.
fn face_corners(half: Vec3, axis: usize, side: f32, inset: f32) -> [Vec3; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |su: f32, sv: f32| {
        let mut p = Vec3::ZERO;
        p[axis] = half[axis] * side;
        p[u] = (half[u] - inset) * su;
        p[v] = (half[v] - inset) * sv;
        p
    };
    let mut corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    if side < 0.0 {
        corners.reverse();
    }
    corners
}

/// A box around the origin whose edges are chamfered by `bevel`; normals run smoothly over the chamfers, so that they
/// catch the light like rounded edges. 44 triangles.
pub(super) fn beveled_box(size: Vec3, bevel: f32) -> Shape {
    let half = size * 0.5;
    let bevel = bevel.min(half.min_element() * 0.9);
    let mut shape = Shape::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            shape.flat_quad(face_corners(half, axis, side, bevel));
        }
    }
    // The vertex of face (axis, side) nearest to the box's corner with these signs.
    let positions = shape.positions.clone();
    let nearest = |axis: usize, signs: Vec3| {
        let face = axis * 2 + usize::from(signs[axis] > 0.0);
        (0..4)
            .map(|i| (face * 4 + i) as u32)
            .find(|&i| (positions[i as usize] * signs).cmpge(Vec3::ZERO).all())
            .unwrap_or(0)
    };
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (su, sv) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let signs = |along: f32| {
                let mut s = Vec3::ZERO;
                (s[axis], s[u], s[v]) = (along, su, sv);
                s
            };
            let (low, high) = (signs(-1.0), signs(1.0));
            let quad = [nearest(u, low), nearest(v, low), nearest(v, high), nearest(u, high)];
            let [a, b, c, d] = quad;
            if su * sv > 0.0 { shape.quad(a, b, c, d) } else { shape.quad(d, c, b, a) }
        }
    }
    for corner in 0..8_u32 {
        let sign = |bit: u32| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let signs = Vec3::new(sign(0), sign(1), sign(2));
        let [a, b, c] = [0, 1, 2].map(|axis| nearest(axis, signs));
        if signs.x * signs.y * signs.z > 0.0 { shape.triangle(a, b, c) } else { shape.triangle(c, b, a) }
    }
    shape
}

/// A chamfered box between two opposite corners.
pub(super) fn block(low: Vec3, high: Vec3, bevel: f32) -> Shape {
    let center = (low + high) * 0.5;
    beveled_box(high - low, bevel).at(center.x, center.y, center.z)
}

/// A sphere of latitude rings around the origin with `2 * rings * (rings - 1) * 2` triangles.
pub(super) fn sphere(radius: f32, rings: u32) -> Shape {
    let rings = rings.max(2);
    ellipsoid(Vec3::splat(radius), rings, rings * 2)
}

/// An ellipsoid with these half axes: `rings` bands of `sectors` around y.
pub(super) fn ellipsoid(half: Vec3, rings: u32, sectors: u32) -> Shape {
    let (rings, sectors) = (rings.max(2), sectors.max(3));
    let mut shape = Shape::default();
    for ring in 0..=rings {
        let (s, c) = if ring == rings { (0.0, -1.0) } else { sin_cos(PI * ring as f32 / rings as f32) };
        for sector in 0..=sectors {
            // The seam's two columns share positions to the bit.
            let (sa, ca) = sin_cos(TAU * (sector % sectors) as f32 / sectors as f32);
            let unit = Vec3::new(s * sa, c, s * ca);
            let uv = Vec2::new(
                TAU * half.x * sector as f32 / sectors as f32,
                PI * half.y * ring as f32 / rings as f32,
            );
            shape.vertex(unit * half, (unit / half).normalize(), uv);
        }
    }
    let index = |ring: u32, sector: u32| ring * (sectors + 1) + sector;
    for ring in 0..rings {
        for sector in 0..sectors {
            let (a, b) = (index(ring, sector), index(ring + 1, sector));
            let (c, d) = (index(ring + 1, sector + 1), index(ring, sector + 1));
            if ring > 0 {
                shape.triangle(a, b, d);
            }
            if ring + 1 < rings {
                shape.triangle(b, c, d);
            }
        }
    }
    shape
}

/// A horizontal rectangle around the origin at y = 0, facing up.
pub(super) fn floor(width: f32, depth: f32) -> Shape {
    let (x, z) = (width * 0.5, depth * 0.5);
    let mut shape = Shape::default();
    shape.flat_quad([
        Vec3::new(-x, 0.0, z),
        Vec3::new(x, 0.0, z),
        Vec3::new(x, 0.0, -z),
        Vec3::new(-x, 0.0, -z),
    ]);
    shape
}

/// A grid of `columns` x `rows` cells over the unit square; `point` gives position and normal. Texture coordinates
/// are the square's.
pub(super) fn grid(columns: u32, rows: u32, point: impl Fn(f32, f32) -> (Vec3, Vec3)) -> Shape {
    let mut shape = Shape::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let (u, v) = (column as f32 / columns as f32, row as f32 / rows as f32);
            let (p, n) = point(u, v);
            shape.vertex(p, n, Vec2::new(u, v));
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let b = a + columns + 1;
            shape.quad(a, b, b + 1, a + 1);
        }
    }
    shape
}
