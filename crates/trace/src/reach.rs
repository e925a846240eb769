//! How far a ray may still go in one space, and the rule by which a triangle's hit becomes its closest.

use crate::Hit;
use crate::judge::Judge;
use crate::paged::{Found, Verdict};
use vastlight_accel::ray::TriangleRay;
use vastlight_accel::triangle::intersect;
use vastlight_accel::wide::Leaf;
use vastlight_math::Vec3;
use vastlight_simd::Simd8;

/// The part of a ray that counts, in units of one space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    pub(crate) t_min: f32,
    pub(crate) t_max: f32,
    /// Parameters here times this are those of the given ray.
    pub(crate) t_scale: f32,
}

/// What becomes of a ray's closest hit at a leaf.
pub(crate) struct Meeting<'b> {
    pub(crate) best: &'b mut Hit,
    /// Where it is, in scenes of pages.
    pub(crate) found: &'b mut Found,
    /// A page of attributes without which a hit was not decided.
    pub(crate) unknown: Option<u32>,
}

/// Tests the triangles of a leaf in an instance and a page. A closer hit becomes the best and shortens `reach`; whether there was
/// one. `index` is the ray's number in its batch.
#[inline(always)]
pub(crate) fn meet<S: Simd8, F: Judge>(
    simd: S,
    (leaf, instance, page): (&impl Leaf, u32, u32),
    (ray, index): (&TriangleRay, usize),
    filter: &F,
    reach: &mut Reach,
    Meeting { best, found, unknown }: &mut Meeting<'_>,
) -> bool {
    let hits = intersect(simd, leaf, ray);
    let mut lanes = hits.lanes;
    let mut met = false;
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
        let place = || Found { corners: corners(leaf, lane), page, place: leaf.place(lane) };
        match if F::ACCEPTS_ALL { Verdict::Counts } else { filter.judge(index, &hit, place) } {
            Verdict::Counts => {
                (**best, reach.t_max, met) = (hit, t, true);
                if F::PAGED {
                    **found = place();
                }
            }
            Verdict::Passes => {}
            Verdict::Unknown(page) => *unknown = Some(page),
        }
    }
    met
}

/// The corners of the triangle in a lane.
#[inline(always)]
fn corners(leaf: &impl Leaf, lane: usize) -> [Vec3; 3] {
    leaf.corners().map(|[x, y, z]| Vec3::new(x[lane], y[lane], z[lane]))
}
