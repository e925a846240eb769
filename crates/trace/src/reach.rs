//! How far a ray may still go in one space, and the rule by which a triangle's hit becomes its closest.

use crate::{Hit, HitFilter};
use vastlight_accel::ray::TriangleRay;
use vastlight_accel::triangle::intersect;
use vastlight_accel::wide::Leaf;
use vastlight_simd::Simd8;

/// The part of a ray that counts, in units of one space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    pub(crate) t_min: f32,
    pub(crate) t_max: f32,
    /// Parameters here times this are those of the given ray.
    pub(crate) t_scale: f32,
}

/// Tests the triangles of a leaf. A closer hit becomes `best` and shortens `reach`; whether there was one. `index` is the
/// ray's number in its batch.
#[inline(always)]
pub(crate) fn meet<S: Simd8, F: HitFilter>(
    simd: S,
    (leaf, instance): (&impl Leaf, u32),
    (ray, index): (&TriangleRay, usize),
    filter: &F,
    reach: &mut Reach,
    best: &mut Hit,
) -> bool {
    let hits = intersect(simd, leaf, ray);
    let mut lanes = hits.lanes;
    let mut found = false;
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize % 8;
        lanes &= lanes - 1;
        let t = hits.t[lane];
        if t < reach.t_min || t > reach.t_max {
            continue;
        }
        let prim = leaf.prim(lane);
        // On a tie the lower (instance, triangle) wins, whichever comes first.
        if t == reach.t_max && (instance, prim) >= (best.instance, best.prim) {
            continue;
        }
        let hit = Hit { t: t * reach.t_scale, u: hits.u[lane], v: hits.v[lane], instance, prim };
        if F::ACCEPTS_ALL || filter.accepts(index, &hit) {
            (*best, reach.t_max, found) = (hit, t, true);
        }
    }
    found
}
