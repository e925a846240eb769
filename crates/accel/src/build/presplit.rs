//! Budgeted splitting of triangles in front of any builder: D. K. Bogolepov's thesis, 2014, chapter 4.3.
//!
//! A reference asks for as many cuts as make its parts no longer than 1/128 of the scene. If all together ask for more
//! than the budget holds, every request is scaled down, so that the number of references never exceeds the budget.
//! A reference is cut into slabs of equal width along its longest axis, and the box of each slab is tightened to
//! what is inside. A second pass with what is left of the budget cuts wide parts along another axis.
//!
//! Deviations: the ratio is clamped to 1, as the thesis's table shows but its formula does not. A caller may ask for cuts
//! that pay alone: then a reference stays whole where its parts' boxes would not be much smaller together, as with
//! triangles that are large but neither long nor oblique.

use super::Clip;
use crate::Reference;
use rayon::prelude::*;
use vastlight_math::Aabb;

/// Parts need not be shorter than the scene over this.
pub(crate) const PORTIONS: f32 = 128.0;
const PASSES: usize = 2;
/// References that one thread works on at a time.
const CHUNK: usize = 1 << 13;

/// Cuts `references` into parts, which `clip` tightens, so that they are at most `most` afterwards. Parts of a reference
/// cover what it covered; one takes its place, the others stand at the end. Cuts are kept where the areas of the parts add
/// up to at most `keep` of the whole's: [`f32::INFINITY`] keeps all.
pub fn presplit(references: &mut Vec<Reference>, clip: &dyn Clip, most: usize, keep: f32) {
    let width = scene_extent(references) / PORTIONS;
    if !(width > 0.0 && width.is_finite()) {
        return;
    }
    for _ in 0..PASSES {
        let room = most.saturating_sub(references.len()) as u64;
        let wanted: u64 = references.par_iter().with_min_len(CHUNK).map(|r| requested(r, width)).sum();
        if room == 0 || wanted == 0 {
            return;
        }
        let granted = |reference: &Reference| {
            let requested = requested(reference, width);
            if wanted <= room { requested } else { requested * room / wanted }
        };
        let parts: Vec<Vec<Reference>> = references
            .par_chunks_mut(CHUNK)
            .map(|chunk| {
                let mut parts = Vec::new();
                for reference in chunk {
                    cut(reference, granted(reference), clip, keep, &mut parts);
                }
                parts
            })
            .collect();
        parts.iter().for_each(|p| references.extend_from_slice(p));
    }
}

/// The longest side of the box around all.
fn scene_extent(references: &[Reference]) -> f32 {
    references
        .par_iter()
        .with_min_len(CHUNK)
        .fold(|| Aabb::EMPTY, |a, r| a.union(r.bounds()))
        .reduce(|| Aabb::EMPTY, Aabb::union)
        .size()
        .max_element()
}

/// How many cuts make the parts of a reference no longer than `width`.
fn requested(reference: &Reference, width: f32) -> u64 {
    (reference.bounds().size().max_element() / width) as u64
}

/// Cuts `reference` with `cuts` planes; it becomes one of its parts, the others go to `parts`.
fn cut(reference: &mut Reference, cuts: u64, clip: &dyn Clip, keep: f32, parts: &mut Vec<Reference>) {
    if cuts == 0 {
        return;
    }
    let (whole, prim) = (reference.bounds(), reference.prim());
    let axis = whole.longest_axis();
    let (start, end) = (whole.min[axis], whole.max[axis]);
    let plane = |i: u64| match i {
        0 => start,
        i if i > cuts => end,
        i => start + (end - start) * (i as f32 / (cuts + 1) as f32),
    };
    let first = parts.len();
    let mut area = 0.0;
    for i in 0..=cuts {
        let mut slab = whole;
        (slab.min[axis], slab.max[axis]) = (plane(i), plane(i + 1));
        let part = clip.clip(prim, &slab);
        if !part.is_empty() {
            area += part.half_area();
            parts.push(Reference::new(&part, prim));
        }
    }
    if parts.len() == first || area > keep * whole.half_area() {
        parts.truncate(first);
    } else {
        *reference = parts.swap_remove(first);
    }
}
