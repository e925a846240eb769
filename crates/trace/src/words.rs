//! A scene made traceable, as words: what a device needs to trace the rays that a [`Tracer`] traces.
//!
//! Two arrays of 32-bit words. The *tree* holds wide nodes of [`NODE_WORDS`] words (planes by axis, side and slot, then
//! children), those over the instances and those above every mesh's pages, and behind them the instances. What would be
//! its first node is a header. The *pages* are the bytes of all pages, one behind the other. A child is the number of a
//! node, or with [`LEAF`] set a leaf: above instances an instance's number, above pages the word of the pages where
//! a subtree begins.

use crate::mesh::MeshTree;
use crate::{TraceError, Tracer};
use vastlight_accel::compact::CompactMesh;
use vastlight_accel::wide::{ChildRef, InstanceNodes, Node8, WideNode};

/// Words of a node.
pub const NODE_WORDS: usize = size_of::<Node8>() / 4;
/// Marks children that are leaves.
pub const LEAF: u32 = 1 << 31;
/// Words of an instance: the rows of the map from the world to its mesh's scaled space, the mesh's root and largest
/// coordinate, whether the map changes nothing, and whether rays may pass its surfaces.
pub const INSTANCE_WORDS: usize = 16;

/// What stands where in the header.
pub mod header {
    /// Where rays start: a node, an instance's number as a leaf, or `u32::MAX`.
    pub const ROOT: usize = 0;
    /// The word where the instances begin.
    pub const INSTANCES: usize = 1;
    /// How many instances there are.
    pub const COUNT: usize = 2;
    /// The largest coordinate of the world, as the bits of an f32.
    pub const EXTENT: usize = 3;
    /// How much wider margins of the world's boxes are than those of a mesh, as the bits of an f32.
    pub const MARGIN: usize = 4;
}

/// See the module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TracerWords {
    /// Nodes and instances.
    pub tree: Vec<u32>,
    /// All pages.
    pub pages: Vec<u32>,
    /// Nodes on the longest way from the root to a leaf of a page.
    pub levels: usize,
}

impl TracerWords {
    /// Marks the instances whose surfaces rays may pass, by alpha or otherwise; none are at first.
    pub fn set_veils(&mut self, is_veiled: impl Fn(u32) -> bool) {
        let first = self.tree[header::INSTANCES] as usize;
        for (number, instance) in self.tree[first..].chunks_exact_mut(INSTANCE_WORDS).enumerate() {
            instance[INSTANCE_WORDS - 1] = u32::from(is_veiled(number as u32));
        }
    }
}

impl Tracer {
    /// The tracer as words.
    ///
    /// # Errors
    /// Its meshes are not in the layout [`Compact`](crate::Layout::Compact), pages are not all in memory, there is no tree
    /// over the instances, or there are 2^31 words of pages or more.
    pub fn words(&self) -> Result<TracerWords, TraceError> {
        if self.grid.is_some() || self.kd.is_some() {
            return Err(TraceError::Words("there is no tree over the instances"));
        }
        let (pages, starts) = self.page_words()?;
        let mut tree = vec![0; NODE_WORDS];
        let root = push_top(&mut tree, &self.top.nodes, self.top.root);
        let mut roots = Vec::with_capacity(self.meshes.len());
        for mesh in &self.meshes {
            let MeshTree::Compact(mesh) = mesh else {
                return Err(TraceError::Words("the layout is not compact"));
            };
            roots.push((push_mesh(&mut tree, mesh, &starts)?, mesh.extent));
        }
        tree[header::ROOT] = root;
        tree[header::INSTANCES] = tree.len() as u32;
        tree[header::COUNT] = self.places.len() as u32;
        tree[header::EXTENT] = self.places.extent.to_bits();
        tree[header::MARGIN] = self.places.margin_factor.to_bits();
        self.push_instances(&mut tree, &roots);
        let deepest = self.meshes.iter().map(MeshTree::levels).max().unwrap_or(0);
        Ok(TracerWords { tree, pages, levels: self.top.levels + deepest })
    }

    /// All pages in a row, and the word at which each starts.
    fn page_words(&self) -> Result<(Vec<u32>, Vec<u32>), TraceError> {
        let (mut words, mut starts) = (Vec::with_capacity(self.pages.bytes() / 4), Vec::new());
        for number in 0..self.pages.pages() as u32 {
            let Some(page) = self.pages.page(number) else {
                return Err(TraceError::Words("a page is missing"));
            };
            starts.push(words.len() as u32);
            words.extend(bytemuck::pod_collect_to_vec::<u8, u32>(page));
            if words.len() >= LEAF as usize {
                return Err(TraceError::Words("the pages have 8 GiB or more"));
            }
        }
        Ok((words, starts))
    }

    fn push_instances(&self, tree: &mut Vec<u32>, roots: &[(u32, f32)]) {
        let mut room = None;
        for number in 0..self.places.len() {
            let Some(placed) = self.places.get(number, &mut room) else { continue };
            let (root, extent) = roots[placed.mesh as usize];
            tree.extend(placed.rows().as_flattened().iter().map(|x| x.to_bits()));
            tree.extend([root, extent.to_bits(), u32::from(placed.is_identity()), 0]);
        }
    }
}

/// Appends the nodes over the instances; gives the root.
fn push_top(tree: &mut Vec<u32>, nodes: &InstanceNodes, root: Option<ChildRef>) -> u32 {
    let first = (tree.len() / NODE_WORDS) as u32;
    let child = |child: ChildRef| if child.is_leaf() { child.0 } else { child.0 + first };
    match nodes {
        InstanceNodes::Full(nodes) => nodes.iter().for_each(|node| push_node(tree, node, child)),
        InstanceNodes::Small(nodes) => {
            nodes.iter().enumerate().for_each(|(place, node)| push_node(tree, &node.to_wide(place), child));
        }
    }
    root.map_or(ChildRef::NONE.0, child)
}

/// Appends the nodes above a mesh's pages; gives the root.
fn push_mesh(tree: &mut Vec<u32>, mesh: &CompactMesh, starts: &[u32]) -> Result<u32, TraceError> {
    let first = (tree.len() / NODE_WORDS) as u32;
    let child = |child: ChildRef| {
        if !child.is_leaf() {
            return child.0 + first;
        }
        let root = &mesh.roots[child.index()];
        LEAF | (starts[root.page as usize] + root.node().index() as u32)
    };
    if mesh.roots.iter().any(|root| root.page as usize >= starts.len()) {
        return Err(TraceError::Words("a page is missing"));
    }
    mesh.nodes.iter().for_each(|node| push_node(tree, node, child));
    Ok(mesh.root.map_or(ChildRef::NONE.0, child))
}

fn push_node(tree: &mut Vec<u32>, node: &Node8, child: impl Fn(ChildRef) -> u32) {
    tree.extend(node.planes.as_flattened().as_flattened().iter().map(|x| x.to_bits()));
    tree.extend(node.children.map(|c| if c == ChildRef::NONE { c.0 } else { child(c) }));
    tree.extend(node.reserved);
}
