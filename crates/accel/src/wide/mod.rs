//! Eight-wide trees: what rays are traced through.

mod collapse;
mod direct;
mod layout;
mod mesh;
mod top;
pub mod traverse;
mod validate;

pub use layout::{Block8, ChildRef, Leaf, LeafLanes, Node8, WideNode};
pub(crate) use mesh::extent;
pub use mesh::{MeshBuild, MeshBvh, MeshView};
pub use top::TopBvh;
pub(crate) use validate::validate_blocks;
pub use validate::{Boxes, validate_nodes};
