//! Acceleration structures: builders, wide layouts, validation.
//!
//! The way of the data: boxes become [`Reference`]s, a builder ([`build()`]) orders them into a [`BinaryTree`], the
//! tree is collapsed to eight-wide nodes ([`wide`]) over blocks of eight triangles or over whole instances, and
//! [`wide::traverse`] brings a ray to the leaves it may hit. Builders see boxes alone; build loop, heuristic, layout
//! and traversal know nothing of each other's insides. [`compact`] holds a finished tree in a sixth of the memory. [`kdtree`] is another structure over the same boxes, which rays
//! walk without a stack.
//!
//! # Why hits do not depend on the tree
//! What the triangle test says of a ray and a triangle depends on these two alone, and its hits are close to the
//! triangle, not merely to its box ([`triangle`]). Box tests use a margin that covers this distance and their own
//! rounding ([`ray`]). A builder may cut a triangle's box into boxes of parts ([`Clip`]): the parts cover the triangle,
//! so one of them is at the hit, and every box on the way to it contains the hit's `t`. A tracer drops what is behind
//! its closest hit, hence never that leaf before the closest of all hits is found. So hits do not depend on the tree,
//! the layout or the instructions.

pub mod build;
pub mod cluster;
pub mod compact;
pub mod kdtree;
mod memory;
mod quality;
pub mod ray;
mod reference;
pub mod sort;
mod tree;
pub mod triangle;
pub mod update;
mod upward;
mod validate;
pub mod wide;

pub use build::{BuildConfig, BuildError, Clip, Scratch, build};
pub use cluster::{ClusterConfig, Clusters};
pub use memory::Pages;
pub use quality::{Quality, quality, quality_with};
pub use reference::Reference;
pub use tree::{BinaryTree, Node};
pub use validate::{Report, Violation, validate, validate_parts};
