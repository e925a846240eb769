//! The box around all instances, kept in parts so that a few that move cost little.

use crate::{Change, Instances, MeshExtent, can_be_placed};
use rayon::prelude::*;
use vastlight_math::Aabb;

/// Instances of a part.
const PART: usize = 512;

/// The box around all instances in world space, with the boxes around parts of them.
#[derive(Clone, Debug)]
pub(crate) struct WorldBounds {
    /// Around all that can be placed; empty for none.
    pub(crate) all: Aabb,
    parts: Vec<Aabb>,
}

impl WorldBounds {
    pub(crate) fn new(instances: &Instances, extents: &[MeshExtent]) -> Self {
        // Parts of a fixed size, so that not even the sign of a zero depends on the threads.
        let parts = (0..instances.len().div_ceil(PART)).into_par_iter();
        let parts: Vec<Aabb> = parts.map(|part| around(part, instances, extents)).collect();
        Self { all: unite(&parts), parts }
    }

    /// The same as new, looking only at parts of which something changed.
    pub(crate) fn update(&mut self, instances: &Instances, extents: &[MeshExtent], change: &Change) {
        let of_meshes = change.meshes.iter().flat_map(|&mesh| instances.of_mesh(mesh));
        let touched = change.instances.iter().copied().chain(of_meshes);
        let mut parts: Vec<usize> = touched.map(|i| i as usize / PART).collect();
        parts.sort_unstable();
        parts.dedup();
        let found: Vec<Aabb> = parts.par_iter().map(|&part| around(part, instances, extents)).collect();
        parts.into_iter().zip(found).for_each(|(part, bounds)| self.parts[part] = bounds);
        self.all = unite(&self.parts);
    }
}

fn unite(parts: &[Aabb]) -> Aabb {
    parts.iter().copied().fold(Aabb::EMPTY, Aabb::union)
}

fn around(part: usize, instances: &Instances, extents: &[MeshExtent]) -> Aabb {
    let numbers = part * PART..instances.len().min((part + 1) * PART);
    let seen = numbers.filter(|&i| can_be_placed(instances.map(i)));
    seen.map(|i| extents[instances.mesh(i) as usize].bounds.transformed(instances.map(i)))
        .fold(Aabb::EMPTY, Aabb::union)
}
