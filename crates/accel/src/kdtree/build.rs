//! The build loop of the kd-tree: cuts parts until they are small, deep, or not worth a cut.
//!
//! A bound of the references comes from a share that a part hands down: the root may grow by a factor; a cut that
//! makes `m` references of `n` leaves its parts the factor times `n / m`; a part whose factor would fall below one is
//! a leaf. So the leaves together never hold more than the root's factor times its references, whatever the input.

use super::cut::{Plane, median, surface_area};
use super::thread::lay_out;
use super::{KdNode, KdTree};
use crate::{BuildError, Reference};
use vastlight_math::Aabb;

/// How planes are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cuts {
    /// At the median of the centres, along x, y, z in turn.
    #[default]
    Median,
    /// Where the surface-area heuristic is cheapest, along any axis.
    SurfaceArea,
}

/// How to build a kd-tree.
#[derive(Clone, Copy, Debug)]
pub struct KdConfig {
    /// How planes are chosen.
    pub cuts: Cuts,
    /// Parts with so few boxes are not cut. Eight suit blocks of eight triangles.
    pub max_leaf: usize,
    /// Leaves hold at most this many times the number of boxes, at least 1. More gives smaller leaves and takes more
    /// memory.
    pub max_growth: f32,
    /// Levels beyond those that halving to `max_leaf` would need.
    pub spare_levels: u32,
}

impl Default for KdConfig {
    fn default() -> Self {
        Self { cuts: Cuts::Median, max_leaf: 8, max_growth: 4.0, spare_levels: 6 }
    }
}

/// A part of space, or the whole.
pub(super) struct Part {
    /// Around the references, clipped to the cell.
    pub(super) bounds: Aabb,
    pub(super) inside: Inside,
}

/// What is in a part.
pub(super) enum Inside {
    /// Numbers of boxes.
    Boxes(Vec<u32>),
    /// Two parts, lower and upper, on the sides of a plane.
    Cut(Plane, Box<[Part; 2]>),
}

/// Builds over `boxes`. Empty boxes are left out, boxes that are not finite are pulled into the finite range. The tree
/// is the same for any number of threads.
///
/// # Errors
/// Too many boxes.
pub fn build(boxes: &[Aabb], config: &KdConfig) -> Result<KdTree, BuildError> {
    if boxes.len() as f64 * f64::from(config.max_growth.max(1.0)) >= KdNode::INDICES as f64 {
        return Err(BuildError::TooMany(boxes.len()));
    }
    let numbered = boxes.iter().zip(0_u32..).filter(|(bounds, _)| !bounds.is_empty());
    let references: Vec<Reference> = numbered.map(|(bounds, i)| Reference::new(bounds, i)).collect();
    if references.is_empty() {
        return Ok(KdTree::default());
    }
    let levels = (references.len() / config.max_leaf.max(1)).max(1).ilog2() + 1 + config.spare_levels;
    let builder = Builder { config, max_leaf: config.max_leaf.max(1) };
    Ok(lay_out(builder.part(references, Share { levels, axis: 0, growth: config.max_growth.max(1.0) })))
}

/// What a part may still use.
#[derive(Clone, Copy)]
struct Share {
    levels: u32,
    /// The axis whose turn it is.
    axis: usize,
    growth: f32,
}

struct Builder<'a> {
    config: &'a KdConfig,
    max_leaf: usize,
}

/// Parts with so many references are built side by side.
const PARALLEL: usize = 4096;

impl Builder<'_> {
    fn part(&self, references: Vec<Reference>, share: Share) -> Part {
        let bounds = references.iter().fold(Aabb::EMPTY, |b, r| b.union(r.bounds()));
        let Some((plane, [lower, upper])) = self.cut(&references, &bounds, share) else {
            let numbers = references.iter().map(Reference::prim).collect();
            return Part { bounds, inside: Inside::Boxes(numbers) };
        };
        let growth = share.growth * references.len() as f32 / (lower.len() + upper.len()) as f32;
        let share = Share { levels: share.levels - 1, axis: (plane.axis + 1) % 3, growth };
        let side_by_side = references.len() >= PARALLEL;
        drop(references);
        let build = |references| move || self.part(references, share);
        let (lower, upper) = if side_by_side {
            rayon::join(build(lower), build(upper))
        } else {
            (build(lower)(), build(upper)())
        };
        Part { bounds, inside: Inside::Cut(plane, Box::new([lower, upper])) }
    }

    /// The plane of a part and what lies on its sides; none for a leaf.
    fn cut(
        &self,
        references: &[Reference],
        bounds: &Aabb,
        share: Share,
    ) -> Option<(Plane, [Vec<Reference>; 2])> {
        if references.len() <= self.max_leaf || share.levels <= 1 {
            return None;
        }
        if self.config.cuts == Cuts::SurfaceArea {
            let plane = surface_area(references, bounds)?;
            return affordable(plane, references, share);
        }
        (0..3)
            .map(|turn| (share.axis + turn) % 3)
            .filter_map(|axis| median(references, bounds, axis))
            .find_map(|plane| affordable(plane, references, share))
    }
}

/// The references on the sides of `plane`, unless neither side is smaller than the whole or the share does not
/// suffice.
fn affordable(plane: Plane, references: &[Reference], share: Share) -> Option<(Plane, [Vec<Reference>; 2])> {
    let below = references.iter().filter(|r| plane.has_below(r)).count();
    let above = references.iter().filter(|r| plane.has_above(r)).count();
    let count = references.len();
    if (below == count && above == count) || share.growth * (count as f32) < (below + above) as f32 {
        return None;
    }
    let mut sides = [Vec::with_capacity(below), Vec::with_capacity(above)];
    for reference in references {
        if plane.has_below(reference) {
            sides[0].push(clipped(reference, plane, 0));
        }
        if plane.has_above(reference) {
            sides[1].push(clipped(reference, plane, 1));
        }
    }
    Some((plane, sides))
}

/// The part of a reference's box on a side of a plane.
fn clipped(reference: &Reference, plane: Plane, side: usize) -> Reference {
    let mut bounds = reference.bounds();
    if side == 0 {
        bounds.max[plane.axis] = bounds.max[plane.axis].min(plane.cut);
    } else {
        bounds.min[plane.axis] = bounds.min[plane.axis].max(plane.cut);
    }
    Reference::new(&bounds, reference.prim())
}
