//! Acceleration structures: builders, wide layouts, validation.
//!
//! The way of the data: boxes become [`Reference`]s, a builder ([`build()`]) orders them into a [`BinaryTree`], the
//! tree is collapsed to eight-wide nodes ([`wide`]) over blocks of eight triangles or over whole instances, and
//! [`wide::traverse`] brings a ray to the leaves it may hit. Builders see boxes alone; build loop, heuristic, layout
//! and traversal know nothing of each other's insides. [`kdtree`] is another structure over the same boxes, which rays
//! walk without a stack.
//!
//! # Why hits do not depend on the tree
//! A triangle counts as hit if the watertight test of [`triangle`] passes and the hit lies in the triangle's own box,
//! grown by a margin that covers the test's rounding. Every box above the triangle contains its box, and box tests
//! use a larger margin that also covers their own rounding ([`ray`]). So each hit is inside every box on the way to
//! it, whatever the tree, the layout and the instructions.

pub mod build;
pub mod kdtree;
mod memory;
mod quality;
pub mod ray;
mod reference;
pub mod sort;
mod tree;
pub mod triangle;
mod upward;
mod validate;
pub mod wide;

pub use build::{BuildConfig, BuildError, Scratch, build};
pub use memory::Pages;
pub use quality::{Quality, quality, quality_with};
pub use reference::Reference;
pub use tree::{BinaryTree, Node};
pub use validate::{Report, Violation, validate};
