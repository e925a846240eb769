//! The watertight ray/triangle test of Woop, Benthin, Wald 2013, "Watertight ray/triangle intersection", for eight
//! triangles at once.
//!
//! Deviations. No fused operations: an edge function is the difference of two rounded products, whose sign is right or
//! zero for the rounded corners and exactly opposite for the triangle on the edge's other side; zero counts as inside
//! on both sides, so a ray through an edge or a corner cannot slip through.
//!
//! The edge functions are also the weights of the hit's place in the triangle. Where the triangle is seen edge-on they
//! are mostly rounding, and the place that they name may be far off the ray. So that place is computed and must be
//! within a tolerance of the ray (see [`crate::ray`]); where it is not, the triangle is tested again with weights in
//! double precision, whose products are exact. Thus every hit is near its triangle, not only near the triangle's
//! box, and a tree may hold a triangle in parts.

use crate::ray::TriangleRay;
use crate::wide::Leaf;
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

/// The lanes of `leaf` whose triangle the line of `ray` meets, wherever along it. Every level gives the same bits.
#[inline(always)]
#[must_use]
pub fn intersect<S: Simd8, L: Leaf>(s: S, leaf: &L, ray: &TriangleRay) -> LaneHits {
    let (shear, corners) = (Shear::new(s, ray), leaf.corners());
    let a = shear.corner(s, &corners[0]);
    let b = shear.corner(s, &corners[1]);
    let c = shear.corner(s, &corners[2]);
    let (u, v, w) = (edge(s, &c, &b), edge(s, &a, &c), edge(s, &b, &a));
    let zero = s.splat(0.0);
    let inside = s.or(s.le(zero, s.min(s.min(u, v), w)), s.le(s.max(s.max(u, v), w), zero));
    let determinant = s.add(s.add(u, v), w);
    let crossed = s.bits(s.and(inside, s.ne(determinant, zero))) & leaf.lanes();
    if crossed == 0 {
        return LaneHits::NONE;
    }

    let depth = weigh(s, [u, v, w], [a.z, b.z, c.z]);
    let hits = LaneHits {
        lanes: crossed,
        t: s.to_array(s.mul(s.div(depth, determinant), s.splat(ray.shear[2]))),
        u: s.to_array(s.div(v, determinant)),
        v: s.to_array(s.div(w, determinant)),
    };
    let tolerance = s.mul(s.abs(determinant), s.splat(ray.tolerance));
    let off_x = s.abs(weigh(s, [u, v, w], [a.x, b.x, c.x]));
    let off_y = s.abs(weigh(s, [u, v, w], [a.y, b.y, c.y]));
    let near = s.bits(s.and(s.le(off_x, tolerance), s.le(off_y, tolerance)));
    if crossed & !near == 0 {
        return hits;
    }
    let corners = [a.to_arrays(s), b.to_arrays(s), c.to_arrays(s)];
    test_again(hits, crossed & !near, &s.to_array(determinant), &corners, ray)
}

/// The lanes `doubtful` of `hits` with weights in double precision.
#[cold]
#[inline(never)]
fn test_again(
    mut hits: LaneHits,
    mut doubtful: u32,
    determinants: &[f32; 8],
    corners: &[[[f32; 8]; 3]; 3],
    ray: &TriangleRay,
) -> LaneHits {
    while doubtful != 0 {
        let lane = doubtful.trailing_zeros() as usize % 8;
        doubtful &= doubtful - 1;
        let corner = |i: usize| corners[i].map(|of_axis| f64::from(of_axis[lane]));
        match exact_hit([corner(0), corner(1), corner(2)], determinants[lane].signum(), ray) {
            Some([t, u, v]) => (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, u, v),
            None => hits.lanes &= !(1 << lane),
        }
    }
    hits
}

/// `t` and the weights of the second and third corner, for sheared corners that are right to the last bit. `sign` is
/// that of the edge functions in single precision: they are all inside or zero, and one that is zero there but a
/// little outside here counts as zero, which keeps shared edges closed.
fn exact_hit([a, b, c]: [[f64; 3]; 3], sign: f32, ray: &TriangleRay) -> Option<[f32; 3]> {
    // Products of two f32 are exact in f64, and so is the sign of their difference.
    let edge = |p: [f64; 3], q: [f64; 3]| ((p[0] * q[1] - p[1] * q[0]) * f64::from(sign)).max(0.0);
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    let sum = u + v + w;
    let place = |axis: usize| (u * a[axis] + v * b[axis] + w * c[axis]) / sum;
    let tolerance = f64::from(ray.tolerance);
    // False for a sum of zero, whose quotients are no numbers.
    let near = place(0).abs() <= tolerance && place(1).abs() <= tolerance;
    near.then(|| [place(2) as f32 * ray.shear[2], (v / sum) as f32, (w / sum) as f32])
}

/// The sum of three values with weights.
#[inline(always)]
fn weigh<S: Simd8>(s: S, weights: [S::F; 3], of: [S::F; 3]) -> S::F {
    s.add(s.add(s.mul(weights[0], of[0]), s.mul(weights[1], of[1])), s.mul(weights[2], of[2]))
}

/// Corners of eight triangles relative to the ray's origin, sheared so that the ray runs along z.
struct Sheared<S: Simd8> {
    x: S::F,
    y: S::F,
    z: S::F,
}

impl<S: Simd8> Sheared<S> {
    #[inline(always)]
    fn to_arrays(&self, s: S) -> [[f32; 8]; 3] {
        [s.to_array(self.x), s.to_array(self.y), s.to_array(self.z)]
    }
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
