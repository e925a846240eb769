//! Eight-wide trees: what rays are traced through.

mod beside;
mod collapse;
mod direct;
mod grid;
mod instances;
mod keys;
mod layout;
mod mesh;
mod quantised;
mod top;
pub mod traverse;
mod validate;

pub use beside::Still;
pub(crate) use collapse::{LeafSlots, Plan, plan, plan_over};
pub use grid::{CellWalk, GridBvh};
pub use instances::{InstanceBvh, InstanceNode, InstanceNodes, SmallNode};
pub use keys::{BlendedNode, MeshKeys};
pub use layout::{Block8, ChildRef, Leaf, LeafLanes, Node8, WideNode};
pub(crate) use mesh::{Clock, extent, whole_tree};
pub use mesh::{MeshBuild, MeshBvh, MeshView};
pub use quantised::QuantisedBoxes;
pub use top::TopBvh;
pub(crate) use validate::validate_blocks;
pub use validate::{Boxes, validate_nodes};
