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
pub fn intersect<S: Simd8>(s: S, block: &Block8, ray: &TriangleRay) -> LaneHits {
    let shear = Shear::new(s, ray);
    let a = shear.corner(s, &block.corners[0]);
    let b = shear.corner(s, &block.corners[1]);
    let c = shear.corner(s, &block.corners[2]);
    let (u, v, w) = (edge(s, &c, &b), edge(s, &a, &c), edge(s, &b, &a));
    let zero = s.splat(0.0);
    let inside = s.or(s.le(zero, s.min(s.min(u, v), w)), s.le(s.max(s.max(u, v), w), zero));
    let determinant = s.add(s.add(u, v), w);
    let crossed = s.and(inside, s.ne(determinant, zero));
    if s.bits(crossed) == 0 {
        return LaneHits::NONE;
    }

    let depth = s.add(s.add(s.mul(u, a.z), s.mul(v, b.z)), s.mul(w, c.z));
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

/// Corners of eight triangles relative to the ray's origin, sheared so that the ray runs along z.
struct Sheared<S: Simd8> {
    x: S::F,
    y: S::F,
    z: S::F,
}

/// The map from corners to [`Sheared`] ones.
struct Shear<S: Simd8> {
    axes: [usize; 3],
    origin: [S::F; 3],
    x: S::F,
    y: S::F,
}

impl<S: Simd8> Shear<S> {
    #[inline(always)]
    fn new(s: S, ray: &TriangleRay) -> Self {
        let [x, y, z] = ray.axes;
        let o = ray.origin;
        Self {
            axes: ray.axes,
            origin: [s.splat(o[x]), s.splat(o[y]), s.splat(o[z])],
            x: s.splat(ray.shear[0]),
            y: s.splat(ray.shear[1]),
        }
    }

    #[inline(always)]
    fn corner(&self, s: S, corner: &[[f32; 8]; 3]) -> Sheared<S> {
        let x = s.sub(s.load(&corner[self.axes[0]]), self.origin[0]);
        let y = s.sub(s.load(&corner[self.axes[1]]), self.origin[1]);
        let z = s.sub(s.load(&corner[self.axes[2]]), self.origin[2]);
        Sheared { x: s.sub(x, s.mul(self.x, z)), y: s.sub(y, s.mul(self.y, z)), z }
    }
}

/// Twice the signed area of the triangle between the ray and an edge.
#[inline(always)]
fn edge<S: Simd8>(s: S, p: &Sheared<S>, q: &Sheared<S>) -> S::F {
    s.sub(s.mul(p.x, q.y), s.mul(p.y, q.x))
}

/// Where the ray enters and leaves each triangle's own box, grown by the margin.
#[inline(always)]
fn own_box<S: Simd8>(s: S, block: &Block8, ray: &TriangleRay) -> (S::F, S::F) {
    let (x, y, z) = (own_slab(s, block, ray, 0), own_slab(s, block, ray, 1), own_slab(s, block, ray, 2));
    (s.max(s.max(x.0, y.0), z.0), s.min(s.min(x.1, y.1), z.1))
}

#[inline(always)]
fn own_slab<S: Simd8>(s: S, block: &Block8, ray: &TriangleRay, axis: usize) -> (S::F, S::F) {
    let (a, b) = (s.load(&block.corners[0][axis]), s.load(&block.corners[1][axis]));
    let c = s.load(&block.corners[2][axis]);
    let (lower, upper) = (s.min(s.min(a, b), c), s.max(s.max(a, b), c));
    let (origin, reciprocal) = (s.splat(ray.origin[axis]), s.splat(ray.reciprocal[axis]));
    let margin = s.splat(ray.own_margin[axis]);
    let (p, q) = (s.mul(s.sub(lower, origin), reciprocal), s.mul(s.sub(upper, origin), reciprocal));
    (s.sub(s.min(p, q), margin), s.add(s.max(p, q), margin))
}
