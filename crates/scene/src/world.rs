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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Instance, MeshExtent};
    use vastlight_math::{Affine3, Vec3};

    #[test]
    fn parts_of_which_something_changed_are_found_again() {
        let place = |i: u32| Instance {
            world_from_object: Affine3::from_translation(Vec3::X * i as f32),
            mesh: i / 1000,
            name: 0,
        };
        let mut instances = Instances::new((0..3000).map(place).collect(), 3).expect("valid");
        let extent = |size: f32| MeshExtent {
            bounds: Aabb { min: Vec3::splat(-size), max: Vec3::splat(size) },
            triangles: 1,
        };
        let mut extents = vec![extent(1.0); 3];
        let mut world = WorldBounds::new(&instances, &extents);
        for (moved, to, mesh, size) in
            [(2999, Vec3::Y * 50.0, 1, 1.0), (0, Vec3::NEG_Z * 9.0, 2, 77.0), (1500, Vec3::X * 1e5, 0, 0.5)]
        {
            instances.put(moved, Affine3::from_translation(to));
            extents[mesh as usize] = extent(size);
            world.update(&instances, &extents, &Change { meshes: vec![mesh], instances: vec![moved] });
            let fresh = WorldBounds::new(&instances, &extents);
            assert_eq!((world.all, &world.parts), (fresh.all, &fresh.parts));
        }
        instances.put(7, Affine3::from_scale(Vec3::ZERO));
        world.update(&instances, &extents, &Change { instances: vec![7], ..Change::default() });
        assert_eq!(world.all, WorldBounds::new(&instances, &extents).all);
    }
}
