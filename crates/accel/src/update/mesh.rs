//! A mesh that moves: a binary tree that is updated, and what rays walk.

use super::adapt::{Found, Sought, adapt};
use super::leaves::Leaves;
use super::tidy::{tidy_nodes, tidy_wide};
use super::tree::{DynamicTree, NONE};
use super::wide::WideMap;
use super::{Method, UpdateConfig, UpdateReport};
use super::{migrate::migrate, rebuild, regroup::regroup, rotate::rotate};
use crate::wide::{ChildRef, Clock, MeshBuild, MeshBvh, MeshView, whole_tree};
use crate::{BuildConfig, BuildError, Scratch, Violation};
use vastlight_math::Aabb;
use vastlight_simd::Level;

/// Trees deeper than this are rebuilt.
const DEEPEST: u32 = 160;

/// Blocks and wide nodes are laid out afresh where so many, as a share of all, are free.
const LOOSE: f64 = 0.2;

/// Why nothing was updated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UpdateError {
    /// Triangles or vertices are not those of the mesh.
    #[error(
        "a mesh of {triangles} triangles and {vertices} vertices is not the one that the tree was made for, of {own_triangles} and {own_vertices}"
    )]
    OtherMesh {
        /// Triangles of the mesh that was given.
        triangles: usize,
        /// Its vertices.
        vertices: usize,
        /// Triangles of the tree.
        own_triangles: usize,
        /// Vertices of the mesh that the tree was made for.
        own_vertices: usize,
    },
}

/// A mesh made traceable, that can be updated.
#[derive(Clone, Debug)]
pub struct DynamicMesh {
    tree: DynamicTree,
    leaves: Leaves,
    wide: WideMap,
    bvh: MeshBvh,
    /// Numbers of triangles and vertices.
    size: [usize; 2],
    level: Level,
}

impl DynamicMesh {
    /// Builds with the builder `name`, without cutting triangles.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn new(
        name: &str,
        mesh: &MeshView<'_>,
        config: &BuildConfig,
        scratch: &mut Scratch,
    ) -> Result<(Self, MeshBuild), BuildError> {
        let config = BuildConfig { max_leaf: config.max_leaf.clamp(1, 8), ..*config };
        let (tree, runs, mut clock) = whole_tree(name, mesh, &config, scratch)?;
        let quality =
            if config.measure { crate::quality(&tree) } else { crate::quality::counts(&tree.nodes) };
        let (leaves, blocks) = Leaves::new(&tree, &runs, mesh, &config);
        let tree = DynamicTree::new(&tree, &runs);
        let bvh = MeshBvh { blocks, ..MeshBvh::default() };
        let size = [mesh.triangles.len(), mesh.positions.len()];
        let mut new = Self { tree, leaves, wide: WideMap::default(), bvh, size, level: config.level };
        new.fill(mesh);
        adapt(&new.tree, &new.leaves.boxes, &UpdateConfig::default(), Sought::default());
        clock.lap("blocks");
        new.collapse();
        new.refit();
        new.save_leaves();
        clock.lap("collapse");
        Ok((new, MeshBuild { triangles: mesh.triangles.len(), quality, stages: clock.stages }))
    }

    /// What rays walk.
    #[must_use]
    pub fn bvh(&self) -> &MeshBvh {
        &self.bvh
    }

    /// Follows the triangles of `mesh` to new positions.
    ///
    /// # Errors
    /// The mesh has other numbers of triangles or vertices.
    pub fn update(
        &mut self,
        mesh: &MeshView<'_>,
        method: Method,
        config: &UpdateConfig,
    ) -> Result<UpdateReport, UpdateError> {
        let [own_triangles, own_vertices] = self.size;
        let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
        if [triangles, vertices] != self.size {
            return Err(UpdateError::OtherMesh { triangles, vertices, own_triangles, own_vertices });
        }
        let mut clock = Clock::start();
        let mut report = UpdateReport::default();
        self.tidy(config);
        clock.lap("tidy");
        self.fill(mesh);
        clock.lap("blocks");
        let clustered = method == Method::Clustered;
        let sought = Sought {
            migrating: clustered && config.stages.migrate,
            exploded: clustered && config.stages.rebuild,
            bursts: clustered && config.stages.part,
            rotating: method == Method::Rotate || clustered && config.stages.rotate,
            always: method == Method::Rotate,
        };
        let found = adapt(&self.tree, &self.leaves.boxes, config, sought);
        report.depth = found.depth as usize;
        clock.lap("adapt");
        self.change(found, config, &mut report, &mut clock);
        report.collapsed = self.collapse() as f64 / self.wide.used().max(1) as f64;
        clock.lap("collapse");
        self.refit();
        clock.lap("boxes");
        report.cost = config.measure.then(|| self.tree.cost().0);
        report.stages = clock.stages;
        Ok(report)
    }

    /// Changes the tree where `found` says.
    fn change(&mut self, found: Found, config: &UpdateConfig, report: &mut UpdateReport, clock: &mut Clock) {
        let Self { tree, leaves, bvh, .. } = self;
        if found.depth > DEEPEST {
            rebuild::rebuild_all(tree, leaves, &mut bvh.blocks, tree.root);
            report.rebuilt = 1.0;
            clock.lap("rebuild");
            return;
        }
        let mut migrating = leaves.part_all(tree, &mut bvh.blocks, &found.migrating);
        clock.lap("part");
        // What was parted counts: it may be many times what was there.
        let all = tree.used().max(1) as f64;
        if !found.exploded.is_empty() {
            let made = rebuild::rebuild(tree, leaves, &mut bvh.blocks, &found, config);
            report.rebuilt = 2.0 * made.len() as f64 / all;
            let mut is_new = vec![false; tree.links.len()];
            made.iter().for_each(|&node| is_new[node as usize] = true);
            migrating.retain(|&node| !is_new[node as usize]);
        }
        clock.lap("rebuild");
        if config.stages.migrate {
            report.migrated = migrate(tree, leaves, &mut bvh.blocks, &migrating) as f64 / all;
        }
        clock.lap("migrate");
        report.rotated = rotate(tree, &found.rotating) as f64 / all;
        clock.lap("rotate");
        regroup(tree, leaves, &mut bvh.blocks, &found.scattered);
        clock.lap("regroup");
    }

    /// Lays everything out afresh where it has been scattered.
    fn tidy(&mut self, config: &UpdateConfig) {
        let Self { tree, leaves, wide, bvh, .. } = self;
        if tree.changed as f64 > config.tidy * tree.links.len() as f64 {
            tidy_nodes(tree, wide);
            tree.changed = 0;
            if leaves.looseness().max(wide.looseness()) > LOOSE {
                tidy_wide(tree, leaves, wide, bvh);
            }
        }
    }

    /// Finds scale and extent, and fills the blocks.
    fn fill(&mut self, mesh: &MeshView<'_>) {
        self.bvh.scale_to(mesh);
        self.leaves.refill(&mut self.bvh.blocks, mesh.positions, self.bvh.scale, self.level);
    }

    /// Gives what rays walk the boxes of the binary nodes.
    fn refit(&mut self) {
        self.wide.refit(&self.tree, &mut self.bvh.nodes);
        self.bvh.bounds = if self.tree.root == NONE { Aabb::EMPTY } else { self.tree.bounds(self.tree.root) };
    }

    fn save_leaves(&mut self) {
        for leaf in 0..self.tree.links.len() as u32 {
            if self.tree.is_leaf(leaf) {
                self.leaves.save(&mut self.tree, leaf);
            }
        }
    }

    /// Brings the wide nodes' children up to date; gives how many nodes that took.
    fn collapse(&mut self) -> usize {
        let Self { tree, wide, bvh, .. } = self;
        let planned = wide.collapse(tree, &mut bvh.nodes, self.level);
        bvh.root = match tree.root {
            NONE => None,
            root if tree.is_leaf(root) => Some(ChildRef::leaf(tree.block(root) as u32)),
            root => Some(ChildRef::node(tree.link(root).wide)),
        };
        if planned > 0 {
            bvh.levels = levels(bvh);
        }
        planned
    }

    /// Checks the binary tree, and the wide one.
    ///
    /// # Errors
    /// The first violation.
    pub fn validate(&self, mesh: &MeshView<'_>) -> Result<crate::Report, Violation> {
        self.tree.validate(&self.bvh.blocks)?;
        self.bvh.validate(mesh)
    }

    /// Leaves, each a block of triangles.
    #[must_use]
    pub fn leaves(&self) -> usize {
        self.leaves.used()
    }

    /// `C(root)` of the binary tree, in the measure of [`crate::Quality`].
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.tree.cost().0
    }

    /// Share of binary nodes that stand within 64 places of their parents in memory.
    #[must_use]
    pub fn locality(&self) -> f64 {
        self.tree.locality()
    }

    /// Memory of all that is kept.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bvh.bytes() + self.tree.bytes() + self.leaves.bytes() + self.wide.bytes()
    }
}

/// Nodes on the longest way from the root to a block.
fn levels(bvh: &MeshBvh) -> usize {
    let mut longest = 0;
    let mut waiting: Vec<(ChildRef, usize)> = bvh.root.map(|root| (root, 0)).into_iter().collect();
    while let Some((child, above)) = waiting.pop() {
        longest = longest.max(above);
        if !child.is_leaf() {
            waiting.extend(bvh.nodes[child.index()].children.map(|child| (child, above + 1)));
        }
    }
    longest
}
