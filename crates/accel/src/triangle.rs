//! The watertight ray/triangle test of Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection", for eight
//! triangles at once.
//!
//! Deviations: no fused operations and no double precision. An edge function is the difference of two rounded products,
//! whose sign is exact for the rounded corners and exactly opposite for the triangle on the edge's other side; zero
//! counts as inside on both sides, so a ray through an edge or a corner cannot slip through. A hit must lie in the triangle's
//! own box grown by a margin (see [`crate::ray`]), and `t` is clamped to that box: this binds what rounding can do to
//! triangles seen edge-on.

use crate::ray::TriangleRay;
use crate::wide::Block8;
use vastlight_simd::Simd8;

/// Hits of the lanes whose bit is set; other lanes hold nothing of meaning.
#[derive(Clone, Copy, Debug)]
pub struct LaneHits {
    /// Lane `i` as bit `i`.
    pub lanes: u32,
    /// Ray parameters, in the space of the ray.
    pub t: [f32; 8],
    /// Weights of the second corners.
    pub u: [f32; 8],
    /// Weights of the third corners.
    pub v: [f32; 8],
}

impl LaneHits {
    /// No hit in any lane.
    pub const NONE: Self = Self { lanes: 0, t: [0.0; 8], u: [0.0; 8], v: [0.0; 8] };
}

/// The lanes of `block` whose triangle the line of `ray` meets, wherever along it. Every level gives the same bits.
#[inline(always)]
#[must_use]
pub fn intersect<S: Simd8>(simd: S, block: &Block8, ray: &TriangleRay) -> LaneHits {
    let s = simd;
    let [x, y, z] = ray.axes;
    let origin = ray.boxes.origin.map(|o| s.splat(o));
    let (shear_x, shear_y) = (s.splat(ray.shear[0]), s.splat(ray.shear[1]));
    let corner = |i: usize| {
        let at = |axis: usize| s.sub(s.load(&block.corners[i][axis]), origin[axis]);
        let (dx, dy, dz) = (at(x), at(y), at(z));
        (s.sub(dx, s.mul(shear_x, dz)), s.sub(dy, s.mul(shear_y, dz)), dz)
    };
    let (ax, ay, az) = corner(0);
    let (bx, by, bz) = corner(1);
    let (cx, cy, cz) = corner(2);

    let edge = |px, py, qx, qy| s.sub(s.mul(px, qy), s.mul(py, qx));
    let (u, v, w) = (edge(cx, cy, bx, by), edge(ax, ay, cx, cy), edge(bx, by, ax, ay));
    let zero = s.splat(0.0);
    let inside = s.or(s.le(zero, s.min(s.min(u, v), w)), s.le(s.max(s.max(u, v), w), zero));
    let determinant = s.add(s.add(u, v), w);
    let crossed = s.and(inside, s.ne(determinant, zero));
    if s.bits(crossed) == 0 {
        return LaneHits::NONE;
    }

    let depth = s.add(s.add(s.mul(u, az), s.mul(v, bz)), s.mul(w, cz));
    let t = s.mul(s.div(depth, determinant), s.splat(ray.shear[2]));
    let (enter, leave) = own_box(s, block, ray);
    let lanes = s.bits(s.and(crossed, s.le(enter, leave)));
    LaneHits {
        lanes,
        t: s.to_array(s.min(s.max(t, enter), leave)),
        u: s.to_array(s.div(v, determinant)),
        v: s.to_array(s.div(w, determinant)),
    }
}

/// Where the ray enters and leaves each triangle's own box, grown by the margin.
#[inline(always)]
fn own_box<S: Simd8>(s: S, block: &Block8, ray: &TriangleRay) -> (S::F, S::F) {
    let slab = |axis: usize| {
        let [a, b, c] = std::array::from_fn(|corner| s.load(&block.corners[corner][axis]));
        let (lower, upper) = (s.min(s.min(a, b), c), s.max(s.max(a, b), c));
        let (origin, reciprocal) = (s.splat(ray.boxes.origin[axis]), s.splat(ray.boxes.reciprocal[axis]));
        let margin = s.splat(ray.own_margin[axis]);
        let (p, q) = (s.mul(s.sub(lower, origin), reciprocal), s.mul(s.sub(upper, origin), reciprocal));
        (s.sub(s.min(p, q), margin), s.add(s.max(p, q), margin))
    };
    let (x, y, z) = (slab(0), slab(1), slab(2));
    (s.max(s.max(x.0, y.0), z.0), s.min(s.min(x.1, y.1), z.1))
}
