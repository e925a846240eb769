//! A threaded kd-tree: rays walk it from front to back without a stack.
//!
//! After Z. Chen, G. Zhang, W. Shi, T. Ren, "Improved ray tracing on stream processors" (section E of the project's
//! algorithms): space is cut cyclically along x, y and z, the tree is kept balanced and its depth limited, and its
//! nodes are threaded once, so that a walk that has finished with a leaf finds the next node by itself.
//!
//! The way of the data: boxes become references, [`build()`] cuts them ([`Cuts`]) into parts, the parts are laid out
//! as an array of nodes and threaded for each of the eight octants of ray directions, and [`traverse`] brings a ray
//! from leaf to leaf. [`KdMesh`] is the tree of a mesh, its leaves runs of triangle blocks.
//!
//! # Deviations from the paper
//! - One in-order thread serves only rays whose near child is always the left one. Here a node has a thread for each
//!   octant, to the place where a walk goes on after the node's whole subtree.
//! - Where a cut is, is our choice: the median of the centres, or, for comparison, by the surface-area heuristic.
//! - Builders see boxes: a primitive that is in several leaves is clipped as a box, not as a triangle.

mod build;
mod cut;
mod kind;
mod layout;
mod mesh;
mod thread;
pub mod traverse;
mod validate;

pub use build::{Cuts, KdConfig, build};
pub use kind::{KdKind, NAMES};
pub use layout::{KdNode, KdTree};
pub use mesh::KdMesh;
pub use validate::{KdReport, KdViolation, validate};
