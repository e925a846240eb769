//! Cutting a wide tree into pages.
//!
//! The tree is walked from its root, children in order. A subtree that fits the page that is being filled goes there as a
//! whole; else, if it is small, a new page is begun for it; else it is cut at its root, which then stands above all
//! pages. Large subtrees are packed side by side.

use super::mesh::{CompactError, PageRoot};
use super::write::{PackedPage, PageBytes, Refusal, Writer};
use crate::wide::{ChildRef, MeshBvh, Node8};
use rayon::prelude::*;
use vastlight_math::Aabb;

/// Subtrees of at most this many triangles are packed by one thread.
const SERIAL: u32 = 1 << 16;
/// Bytes that a triangle needs at least, where there are many.
const LEAST_BYTES: usize = 6;
/// Bytes that a triangle needs about.
const LIKELY_BYTES: usize = 12;
/// A page is closed rather than filled with pieces smaller than this part of it.
const SMALLEST_PART: usize = 16;

/// Pages, and the tree above them.
#[derive(Debug, Default)]
pub(super) struct Packed {
    pub(super) pages: Vec<PackedPage>,
    pub(super) shares: PageBytes,
    pub(super) nodes: Vec<Node8>,
    pub(super) roots: Vec<PageRoot>,
}

impl Packed {
    /// Takes in what stands below `root` of `other`; gives the reference of `root` here.
    fn splice(&mut self, mut other: Self, root: ChildRef) -> ChildRef {
        let (pages, nodes, roots) =
            (self.pages.len() as u32, self.nodes.len() as u32, self.roots.len() as u32);
        let moved = |child: ChildRef| match child {
            ChildRef::NONE => child,
            leaf if leaf.is_leaf() => ChildRef::leaf(leaf.index() as u32 + roots),
            node => ChildRef::node(node.index() as u32 + nodes),
        };
        for node in &mut other.nodes {
            node.children = node.children.map(moved);
        }
        self.nodes.append(&mut other.nodes);
        self.roots.extend(other.roots.iter().map(|root| root.moved(pages)));
        self.pages.append(&mut other.pages);
        self.shares = self.shares.add(other.shares);
        moved(root)
    }
}

/// Packs a mesh into pages of at most `slot` bytes. Gives the root too.
pub(super) fn pack(mesh: &MeshBvh, slot: usize) -> Result<(Packed, Option<ChildRef>), CompactError> {
    let Some(root) = mesh.root else { return Ok((Packed::default(), None)) };
    let counts = counts(mesh);
    let mut parts = Vec::new();
    collect_parts(mesh, &counts, (root, mesh.bounds), &mut parts);
    let pack_part = |(part, bounds): &(ChildRef, Aabb)| {
        let mut packer =
            Packer { mesh, counts: &counts, slot, writer: Writer::new(mesh, slot), out: Packed::default() };
        let root = packer.place(*part, bounds)?;
        packer.close();
        Ok((packer.out, root))
    };
    let packed = parts.par_iter().map(pack_part).collect::<Result<Vec<_>, CompactError>>()?;
    let mut out = Packed::default();
    let root = join(mesh, &counts, root, &mut packed.into_iter(), &mut out);
    Ok((out, Some(root)))
}

/// Triangles below each node.
fn counts(mesh: &MeshBvh) -> Vec<u32> {
    let mut counts = vec![0; mesh.nodes.len()];
    // Children stand behind their parents.
    for (index, node) in mesh.nodes.iter().enumerate().rev() {
        counts[index] = node.children.iter().map(|&child| count(mesh, &counts, child)).sum();
    }
    counts
}

fn count(mesh: &MeshBvh, counts: &[u32], child: ChildRef) -> u32 {
    match child {
        ChildRef::NONE => 0,
        leaf if leaf.is_leaf() => mesh.blocks[leaf.index()].used().count() as u32,
        node => counts[node.index()],
    }
}

fn is_part(mesh: &MeshBvh, counts: &[u32], child: ChildRef) -> bool {
    child.is_leaf() || count(mesh, counts, child) <= SERIAL
}

fn collect_parts(
    mesh: &MeshBvh,
    counts: &[u32],
    (child, bounds): (ChildRef, Aabb),
    parts: &mut Vec<(ChildRef, Aabb)>,
) {
    if is_part(mesh, counts, child) {
        parts.push((child, bounds));
        return;
    }
    let node = &mesh.nodes[child.index()];
    for slot in (0..8).filter(|&slot| node.children[slot] != ChildRef::NONE) {
        collect_parts(mesh, counts, (node.children[slot], node.bounds(slot)), parts);
    }
}

/// Puts the packed parts together, under the nodes that are above all of them.
fn join(
    mesh: &MeshBvh,
    counts: &[u32],
    child: ChildRef,
    parts: &mut std::vec::IntoIter<(Packed, ChildRef)>,
    out: &mut Packed,
) -> ChildRef {
    if is_part(mesh, counts, child) {
        return parts.next().map_or(ChildRef::NONE, |(part, root)| out.splice(part, root));
    }
    let place = out.nodes.len();
    let mut node = mesh.nodes[child.index()];
    out.nodes.push(node);
    for child in node.children.iter_mut().filter(|child| **child != ChildRef::NONE) {
        *child = join(mesh, counts, *child, parts, out);
    }
    out.nodes[place] = node;
    ChildRef::node(place as u32)
}

struct Packer<'a> {
    mesh: &'a MeshBvh,
    counts: &'a [u32],
    slot: usize,
    writer: Writer<'a>,
    out: Packed,
}

impl Packer<'_> {
    /// Puts what is below `child`, which has this box, into pages; gives the reference above them.
    fn place(&mut self, child: ChildRef, bounds: &Aabb) -> Result<ChildRef, CompactError> {
        let triangles = count(self.mesh, self.counts, child) as usize;
        let small = child.is_leaf() || triangles * LIKELY_BYTES < self.slot / SMALLEST_PART;
        loop {
            if triangles * LEAST_BYTES <= self.writer.room() {
                match self.writer.add(child, bounds) {
                    Ok(place) => {
                        self.out.roots.push(PageRoot::new(self.out.pages.len() as u32, place, bounds));
                        return Ok(ChildRef::leaf(self.out.roots.len() as u32 - 1));
                    }
                    Err(Refusal::Lattice(block)) => return Err(self.off_lattice(block)),
                    Err(Refusal::Page) => {}
                }
            }
            if self.writer.is_empty() || !small {
                break;
            }
            self.close();
        }
        if child.is_leaf() {
            return Err(CompactError::Slot { bytes: self.slot });
        }
        let place = self.out.nodes.len();
        let mut node = self.mesh.nodes[child.index()];
        self.out.nodes.push(node);
        for slot in 0..8 {
            if node.children[slot] != ChildRef::NONE {
                node.children[slot] = self.place(node.children[slot], &node.bounds(slot))?;
            }
        }
        self.out.nodes[place] = node;
        Ok(ChildRef::node(place as u32))
    }

    fn close(&mut self) {
        if self.writer.is_empty() {
            return;
        }
        let (page, shares) = self.writer.finish();
        self.out.pages.push(page);
        self.out.shares = self.out.shares.add(shares);
    }

    fn off_lattice(&self, block: usize) -> CompactError {
        CompactError::Lattice { triangle: self.mesh.blocks[block].prims[0] }
    }
}
