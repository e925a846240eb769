//! The published top level of a scene in pages: a grid over the boxes of all subtrees in pages, under all instances.
//!
//! K. Garanzha, thesis of 2014, 6.3. A leaf of a tree in a cell is a subtree of a page, under an instance: the ray goes to the
//! instance's space, is tested with the subtree's own box there (an oriented box in the world), and goes on in the page. All else is
//! as with a tree over instances, the turns of rays included (`crate::paged`): a ray walks the cells from that of its restart on.
//! A subtree in several cells may be walked more than once; that changes no hit.

use crate::instance::Places;
use crate::mesh::{Leaves, MeshTree};
use vastlight_accel::ray::box_margin;
use vastlight_accel::wide::{GridBvh, InstanceBvh, InstanceNodes};
use vastlight_accel::{BuildConfig, BuildError};

/// The farthest origins of rays that are walked cell by cell, in units of the scene's largest coordinate.
const FARTHEST: f32 = 8.0;

/// A grid, whose nodes are with the tracer.
#[derive(Debug)]
pub(crate) struct GridTop {
    pub(crate) cells: GridBvh,
    /// By number of a leaf: instance and subtree.
    pub(crate) entries: Vec<[u32; 2]>,
}

impl GridTop {
    /// The grid of so many cells along each axis, and its trees; none where a mesh is not in pages.
    pub(crate) fn build(
        accel: &str,
        (places, meshes): (&Places, &[MeshTree]),
        per_axis: u32,
        build: &BuildConfig,
    ) -> Result<Option<(Self, InstanceBvh)>, BuildError> {
        let mut entries = Vec::new();
        for instance in 0..places.len() as u32 {
            let Leaves::Pages(mesh) = meshes[places.mesh(instance as usize) as usize].leaves() else {
                return Ok(None);
            };
            entries.extend((0..mesh.roots.len() as u32).map(|subtree| [instance, subtree]));
        }
        let bounds = |entry: u32| {
            let [instance, subtree] = entries[entry as usize];
            match meshes[places.mesh(instance as usize) as usize].leaves() {
                Leaves::Pages(mesh) => places.part(instance, mesh.roots[subtree as usize].bounds()),
                Leaves::Blocks(_) | Leaves::Keys(_) => places.bounds(instance),
            }
        };
        let margin = box_margin((1.0 + FARTHEST) * places.extent, places.margin_factor);
        let size = (per_axis as usize, margin);
        let mut cells = GridBvh::build(accel, entries.len(), bounds, size, build)?;
        let (nodes, levels) = (std::mem::take(&mut cells.nodes), cells.levels);
        let trees = InstanceBvh { nodes: InstanceNodes::Small(nodes), levels, ..InstanceBvh::default() };
        Ok(Some((Self { cells, entries }, trees)))
    }

    /// Memory of all but the trees' nodes.
    pub(crate) fn bytes(&self) -> usize {
        self.cells.bytes() + size_of_val(&self.entries[..])
    }
}
