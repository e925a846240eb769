//! Trees over meshes that move: updated from frame to frame rather than built.
//!
//! Chapter 2 of K. V. Garanzha's thesis of 2014 (in Russian), first published as K. Garanzha, "Efficient clustered BVH update
//! algorithm for highly-dynamic models" (2008): boxes are adapted (`adapt`), subtrees whose triangles mix are rebuilt
//! (`rebuild`), subtrees that move as one are put elsewhere (`migrate`); nodes live in an arena that keeps them near their
//! parents (`arena`). Beside it stand two older ways, [`Method::Refit`] and [`Method::Rotate`].
//!
//! What rays walk is kept along (`wide`): wide nodes above changed binary ones are planned afresh, all others only get
//! new boxes.

mod adapt;
mod arena;
mod leaves;
mod mesh;
mod migrate;
mod rebuild;
mod refit;
mod regroup;
mod rotate;
mod tidy;
mod tree;
mod wide;

pub use mesh::{DynamicMesh, UpdateError};
pub use refit::refit;
pub(crate) use refit::refit_scaled;

use std::time::Duration;

/// How a tree follows its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// New boxes, the same tree.
    Refit,
    /// New boxes, and children change places with grandchildren.
    Rotate,
    /// The clustered update.
    Clustered,
}

/// Over what exploded subtrees are rebuilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// Over their leaves, as published.
    Leaves,
    /// Over their leaves, but nodes that are away from all overlap, or small beside it, stay as they are.
    Overlap,
}

/// Which stages run; for comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stages {
    /// Blocks of triangles that flew apart are parted.
    pub part: bool,
    /// Exploded subtrees are rebuilt.
    pub rebuild: bool,
    /// What moved apart is put elsewhere.
    pub migrate: bool,
    /// Children and grandchildren change places.
    pub rotate: bool,
}

/// How to update.
#[derive(Clone, Copy, Debug)]
pub struct UpdateConfig {
    /// Children of a node migrate where its split costs less than `1 - d_m` times what it did when it was made. The thesis
    /// has 0.05; 0.2 gave trees at most 3 % dearer in some 70 % of the time.
    pub d_m: f32,
    /// A node may have exploded where its split costs more than `1 + d_e` times what it did. The thesis has 0.01, and in its
    /// summary `d_m` and `d_e` the other way round, which gives worse trees in more time.
    pub d_e: f32,
    /// It has if its children overlap by more than this part of the smaller one's area.
    pub max_overlap: f32,
    /// Subtrees with fewer triangles neither explode nor migrate; rotations serve them.
    pub least: u32,
    /// Nodes with less than this part of an overlap's area are small beside it ([`Region::Overlap`]).
    pub detail: f32,
    /// A rebuilt subtree replaces the old one if the areas of its nodes add up to less than `1 - gain` times those of the old.
    pub gain: f32,
    /// A leaf is parted where its box, beside those of its triangles, has grown by more than this.
    pub burst: f32,
    /// Over what exploded subtrees are rebuilt.
    pub region: Region,
    /// Stages of [`Method::Clustered`].
    pub stages: Stages,
    /// Nodes are laid out afresh when so many, as a share of all, have changed their places or neighbours.
    pub tidy: f64,
    /// Report the tree's cost.
    pub measure: bool,
}

impl Default for UpdateConfig {
    fn default() -> Self {
        Self {
            d_m: 0.2,
            d_e: 0.01,
            max_overlap: 0.3,
            least: 64,
            detail: 1.0 / 32.0,
            gain: 0.02,
            burst: 0.5,
            region: Region::Overlap,
            stages: Stages { part: true, rebuild: true, migrate: true, rotate: true },
            tidy: 1.0,
            measure: false,
        }
    }
}

/// What an update did.
#[derive(Clone, Debug, Default)]
pub struct UpdateReport {
    /// Time by stage.
    pub stages: Vec<(&'static str, Duration)>,
    /// Nodes that were rebuilt, as a share of all.
    pub rebuilt: f64,
    /// Subtrees that were put elsewhere, as a share of all nodes.
    pub migrated: f64,
    /// Nodes at which children changed places, as a share of all.
    pub rotated: f64,
    /// Wide nodes that were planned afresh, as a share of all.
    pub collapsed: f64,
    /// `C(root)` of the binary tree, in the measure of [`crate::Quality`], where [`UpdateConfig::measure`] asks for it.
    pub cost: Option<f64>,
    /// Nodes on the longest way down the binary tree, before changes.
    pub depth: usize,
}
