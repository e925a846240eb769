//! Where a part is cut: at the median, or by the surface-area heuristic over bins (I. Wald, V. Havran 2006, "On building
//! fast kd-trees for ray tracing, and on doing that in O(N log N)", with bins instead of a sweep).

use crate::Reference;
use vastlight_math::Aabb;

/// An axis-aligned plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) axis: usize,
    pub(super) cut: f32,
}

impl Plane {
    /// Whether the box has a part below the plane. A box that is flat in the plane is below it.
    pub(super) fn has_below(&self, reference: &Reference) -> bool {
        let [lower, upper] = range(reference, self.axis);
        lower < self.cut || upper <= self.cut
    }

    /// Whether the box has a part above the plane.
    pub(super) fn has_above(&self, reference: &Reference) -> bool {
        range(reference, self.axis)[1] > self.cut
    }

    /// Whether the plane parts `bounds`.
    fn parts(&self, bounds: &Aabb) -> bool {
        bounds.min[self.axis] < self.cut && self.cut < bounds.max[self.axis]
    }
}

/// Lower and upper end of a box along an axis.
fn range(reference: &Reference, axis: usize) -> [f32; 2] {
    let lanes = reference.lanes();
    [lanes[axis], -lanes[axis + 4]]
}

/// The plane across `axis` at the median of the centres; none if it does not part `bounds`.
pub(super) fn median(references: &[Reference], bounds: &Aabb, axis: usize) -> Option<Plane> {
    let mut centers: Vec<f32> = references.iter().map(|r| r.twice_center(axis) * 0.5).collect();
    let middle = centers.len() / 2;
    let (_, cut, _) = centers.select_nth_unstable_by(middle, f32::total_cmp);
    let plane = Plane { axis, cut: *cut };
    plane.parts(bounds).then_some(plane)
}

const BINS: usize = 32;
/// Cost of a step down, in units of testing one box; blocks of eight make boxes cheap.
const STEP: f32 = 2.5;

/// The cheapest plane of all axes; none if a leaf is cheaper.
pub(super) fn surface_area(references: &[Reference], bounds: &Aabb) -> Option<Plane> {
    let leaf = references.len() as f32;
    let mut best = (leaf, None);
    for axis in 0..3 {
        for (cost, plane) in planes(references, bounds, axis) {
            if cost < best.0 && plane.parts(bounds) {
                best = (cost, Some(plane));
            }
        }
    }
    best.1
}

/// The planes between bins along an axis, with their costs.
fn planes(references: &[Reference], bounds: &Aabb, axis: usize) -> impl Iterator<Item = (f32, Plane)> {
    let (start, size) = (bounds.min[axis], bounds.size());
    let scale = BINS as f32 / size[axis];
    let bin = |x: f32| (((x - start) * scale) as usize).min(BINS - 1);
    let (mut starts, mut ends) = ([0_u32; BINS], [0_u32; BINS]);
    for reference in references {
        let [lower, upper] = range(reference, axis);
        starts[bin(lower)] += 1;
        ends[bin(upper)] += 1;
    }
    let (mut below, mut above) = (0, references.len() as u32);
    let (across, around) = (size[(axis + 1) % 3], size[(axis + 2) % 3]);
    let half_area = move |length: f32| across * around + length * (across + around);
    let whole = half_area(size[axis]);
    (1..BINS).map(move |i| {
        below += starts[i - 1];
        above -= ends[i - 1];
        let length = size[axis] * (i as f32 / BINS as f32);
        let parts = half_area(length) * below as f32 + half_area(size[axis] - length) * above as f32;
        (STEP + parts / whole, Plane { axis, cut: start + length })
    })
}
