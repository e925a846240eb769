//! Threaded kd-trees as words, in the manner of [`crate::words`].
//!
//! The tree holds nodes of [`KD_NODE_WORDS`] words (box, plane or number of items, link, threads by octant): in the place of the first
//! a header, then those over the instances and those of every mesh, numbered through; behind them the numbers of instances in
//! leaves, their boxes, and the instances. The blocks are of eight triangles, numbered through: corners by corner, axis
//! and lane, then the triangles' numbers.

use crate::words::{KD_BLOCK_WORDS, KD_NODE_WORDS, TracerWords, header};
use crate::{TraceError, Tracer};
use vastlight_accel::kdtree::KdNode;
use vastlight_math::Aabb;

/// Numbers of nodes and blocks stay below this.
const NUMBERS: usize = 1 << 30;
/// Coordinates beyond this, of boxes around nothing, are brought to it: devices need not know infinity.
const FARTHEST: f32 = 1e30;

impl Tracer {
    /// A tracer over threaded kd-trees as words.
    ///
    /// # Errors
    /// It has none, or there are 2^30 nodes or blocks of triangles.
    pub fn threaded_words(&self) -> Result<TracerWords, TraceError> {
        self.refuse_implicit_surfaces()?;
        let Some(kd) = self.kd.as_ref().filter(|kd| !kd.stacked) else {
            return Err(TraceError::Words("there are no threaded kd-trees"));
        };
        let (mut tree, mut blocks) = (vec![0; KD_NODE_WORDS], Vec::new());
        let root = push_nodes(&mut tree, &kd.top.nodes, 0);
        let mut roots = Vec::with_capacity(kd.meshes.len());
        for mesh in &kd.meshes {
            let first_block = blocks.len() / KD_BLOCK_WORDS;
            roots.push((push_nodes(&mut tree, &mesh.nodes, first_block as u32), mesh.extent));
            blocks.extend_from_slice(bytemuck::cast_slice(&mesh.blocks));
            if tree.len() / KD_NODE_WORDS >= NUMBERS || blocks.len() / KD_BLOCK_WORDS >= NUMBERS {
                return Err(TraceError::Words("there are too many nodes or blocks of triangles"));
            }
        }
        tree[header::ITEMS] = tree.len() as u32;
        tree.extend_from_slice(&kd.top.items);
        tree[header::BOXES] = tree.len() as u32;
        tree.extend(kd.boxes.iter().flat_map(box_words));
        self.put_instances(&mut tree, root, &roots);
        Ok(TracerWords { tree, blocks, levels: 0 })
    }
}

fn box_words(bounds: &Aabb) -> [u32; 6] {
    let ([a, b, c], [d, e, f]) = (bounds.min.to_array(), bounds.max.to_array());
    [a, b, c, d, e, f].map(|x| x.clamp(-FARTHEST, FARTHEST).to_bits())
}

/// Appends the nodes of a tree, whose leaves' items begin at `first_item`; gives the root, `u32::MAX` without nodes.
fn push_nodes(tree: &mut Vec<u32>, nodes: &[KdNode], first_item: u32) -> u32 {
    let first = (tree.len() / KD_NODE_WORDS) as u32;
    for node in nodes {
        tree.extend(box_words(&node.bounds));
        // The index is in the lower bits, and has room for all.
        tree.extend([node.cut_or_count, node.link + if node.is_leaf() { first_item } else { first }]);
        tree.extend(node.next.map(|next| if next == KdNode::END { next } else { next + first }));
    }
    if nodes.is_empty() { u32::MAX } else { first }
}
