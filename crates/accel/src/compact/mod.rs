//! The compact layout: pages of quantised nodes and packed triangles, which rays walk through as they are.
//!
//! A mesh is cut into pages, each a few whole subtrees; what is above them is a wide tree with full boxes
//! ([`CompactMesh`]). A page needs nothing outside itself. It is a row of nodes, what is below a node's first child
//! before its second, and behind a node with leaves stands the cluster of their triangles:
//!
//! ```text
//! node       92   eight children: a corner and three powers of two, six planes of 8 bits and a reference of 16 bits each;
//!                 how the cluster is packed
//! anchor     16   where the cluster's vertices and numbers are counted from
//! corners     3   a triangle: vertices of the cluster, leaf by leaf: all first corners, all second, all third
//! vertices        in as few bytes as each needs, at most 192
//! numbers         of the triangles in the mesh, in as few bits as each needs
//! ```
//!
//! A vertex is `anchor + step * offset` along each axis. Positions are multiples of a power of two with at most 24 bits
//! between them (see the lattice of `vastlight-scene`), so this is exact, and a page holds the same floats as any other
//! layout: a vertex that two pages share is the same on both sides. Boxes are rounded outward. So hits are those of
//! other layouts, bit for bit.

mod blocks;
mod cluster;
mod join;
mod mesh;
mod node;
mod pack;
mod page;
mod validate;
mod write;

pub use blocks::{BlockError, BlockSizes};
pub use mesh::{CompactError, CompactMesh, PageRoot};
pub use node::PackedNode;
pub use page::{PackedLeaf, Page, SLACK};
pub use write::{PackedPage, PageBytes};
