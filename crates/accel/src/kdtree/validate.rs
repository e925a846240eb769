//! Whether a kd-tree is what it should be: every box in every leaf that it reaches into and in no other, and threads
//! that meet every leaf from front to back for every octant.

use super::{KdNode, KdTree};
use crate::Reference;
use vastlight_math::{Aabb, Vec3};

/// What a sound tree holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KdReport {
    /// Nodes, leaves included.
    pub nodes: usize,
    /// Leaves.
    pub leaves: usize,
    /// References in leaves.
    pub references: usize,
    /// Nodes on the longest way from the root to a leaf.
    pub levels: usize,
    /// Largest leaf.
    pub largest_leaf: usize,
}

/// What is wrong with a tree.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KdViolation {
    /// A node's children or items do not exist, or stand where they must not.
    #[error("node {node}: {what}")]
    Shape {
        /// The node.
        node: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// A box reaches into a leaf's cell and is not in the leaf, or the other way round.
    #[error("leaf {node}: box {item} is {} it, its cell says otherwise", if *.is_in { "in" } else { "not in" })]
    Coverage {
        /// The leaf.
        node: usize,
        /// The box.
        item: u32,
        /// Whether the leaf has it.
        is_in: bool,
    },
    /// A node's bounds do not contain what is below, or reach out of the parent's.
    #[error("node {node}: its bounds are not those of what is below")]
    Bounds {
        /// The node.
        node: usize,
    },
    /// Threads do not meet the nodes from front to back.
    #[error("node {node}: its thread for octant {octant} leads astray")]
    Thread {
        /// The node.
        node: usize,
        /// The octant.
        octant: usize,
    },
}

impl KdTree {
    /// [`validate()`] of the tree over `boxes`.
    ///
    /// # Errors
    /// The first violation.
    pub fn validate(&self, boxes: &[Aabb]) -> Result<KdReport, KdViolation> {
        validate(&self.nodes, boxes, |items| self.items.get(items).map(<[u32]>::to_vec))
    }
}

/// Checks a tree over `boxes`; `items_of` gives the numbers of the boxes in a leaf with these items, or none if there
/// are no such items.
///
/// # Errors
/// The first violation.
pub fn validate(
    nodes: &[KdNode],
    boxes: &[Aabb],
    items_of: impl Fn(std::ops::Range<usize>) -> Option<Vec<u32>>,
) -> Result<KdReport, KdViolation> {
    // What the builder sees: boxes pulled into the finite range, empty ones left out.
    let all: Vec<(u32, Aabb)> = (0..)
        .zip(boxes)
        .filter(|(_, bounds)| !bounds.is_empty())
        .map(|(i, bounds)| (i, Reference::new(bounds, i).bounds()))
        .collect();
    if nodes.is_empty() {
        return match all.first() {
            Some(&(item, _)) => Err(KdViolation::Coverage { node: 0, item, is_in: false }),
            None => Ok(KdReport::default()),
        };
    }
    let mut report = KdReport::default();
    let everywhere = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
    let mut waiting = vec![Visit { node: 0, level: 1, cell: everywhere, inside: all }];
    while let Some(visit) = waiting.pop() {
        report.nodes += 1;
        report.levels = report.levels.max(visit.level);
        let node = &nodes[visit.node];
        visit.check_bounds(node)?;
        if node.is_leaf() {
            let mut items = items_of(node.items())
                .ok_or(KdViolation::Shape { node: visit.node, what: "has items that do not exist" })?;
            items.sort_unstable();
            visit.check_items(&items)?;
            report.leaves += 1;
            report.references += items.len();
            report.largest_leaf = report.largest_leaf.max(items.len());
        } else {
            waiting.extend(visit.children(node, nodes.len())?);
        }
    }
    if report.nodes != nodes.len() {
        return Err(KdViolation::Shape { node: report.nodes, what: "is not reached" });
    }
    (0..8).try_for_each(|octant| check_threads(nodes, octant))?;
    Ok(report)
}

/// A node, its cell, and the boxes that reach into the cell, in ascending order.
struct Visit {
    node: usize,
    level: usize,
    cell: Aabb,
    inside: Vec<(u32, Aabb)>,
}

impl Visit {
    fn check_bounds(&self, node: &KdNode) -> Result<(), KdViolation> {
        let around = |b: Aabb, (_, other): &(u32, Aabb)| b.union(other.intersection(self.cell));
        let expected = self.inside.iter().fold(Aabb::EMPTY, around);
        if node.bounds == expected { Ok(()) } else { Err(KdViolation::Bounds { node: self.node }) }
    }

    fn check_items(&self, items: &[u32]) -> Result<(), KdViolation> {
        let expected = self.inside.iter().map(|(i, _)| *i);
        let missing = expected.clone().find(|i| items.binary_search(i).is_err());
        if let Some(item) = missing {
            return Err(KdViolation::Coverage { node: self.node, item, is_in: false });
        }
        let foreign = items.iter().find(|i| self.inside.binary_search_by_key(*i, |(j, _)| *j).is_err());
        match foreign {
            Some(&item) => Err(KdViolation::Coverage { node: self.node, item, is_in: true }),
            None if items.len() != self.inside.len() => {
                Err(KdViolation::Shape { node: self.node, what: "has an item twice" })
            }
            None => Ok(()),
        }
    }

    fn children(self, node: &KdNode, nodes: usize) -> Result<[Self; 2], KdViolation> {
        let (axis, cut, lower) = (node.axis(), node.cut(), node.lower());
        let shape = |what| Err(KdViolation::Shape { node: self.node, what });
        if lower <= self.node || lower + 1 >= nodes {
            return shape("has children that do not exist, or in front of it");
        }
        if !(self.cell.min[axis] < cut && cut < self.cell.max[axis]) {
            return shape("has a plane outside its cell");
        }
        let (mut below, mut above) = (self.cell, self.cell);
        below.max[axis] = cut;
        above.min[axis] = cut;
        let part = |child: usize, cell: Aabb| {
            let inside = self.inside.iter().filter(|(_, b)| reaches(b, &cell)).copied().collect();
            Self { node: lower + child, level: self.level + 1, cell, inside }
        };
        Ok([part(0, below), part(1, above)])
    }
}

/// Whether a box reaches into a cell: they share more than a face. What is flat in a face belongs to the cell below.
fn reaches(bounds: &Aabb, cell: &Aabb) -> bool {
    (0..3).all(|k| {
        let (lower, upper) = (bounds.min[k], bounds.max[k]);
        let flat_inside = lower == upper && cell.min[k] < lower && lower <= cell.max[k];
        flat_inside || (lower < cell.max[k] && upper > cell.min[k])
    })
}

/// A walk by threads that enters every fork by its near child meets every node as a walk with a stack does.
fn check_threads(nodes: &[KdNode], octant: usize) -> Result<(), KdViolation> {
    let mut here = 0;
    let mut stack = Vec::new();
    loop {
        let node = &nodes[here];
        if !node.is_leaf() {
            let below_first = octant >> node.axis() & 1 == 0;
            let (near, far) = if below_first { (0, 1) } else { (1, 0) };
            stack.push(node.lower() + far);
            // The thread of a near child leads to the far one; that of the far child is checked when a leaf ends.
            let near = node.lower() + near;
            if nodes[near].next[octant] as usize != node.lower() + far {
                return Err(KdViolation::Thread { node: near, octant });
            }
            if nodes[node.lower() + far].next[octant] != node.next[octant] {
                return Err(KdViolation::Thread { node: node.lower() + far, octant });
            }
            here = near;
            continue;
        }
        let expected = stack.pop();
        let thread = node.next[octant];
        match expected {
            Some(next) if thread as usize == next => here = next,
            None if thread == KdNode::END => return Ok(()),
            _ => return Err(KdViolation::Thread { node: here, octant }),
        }
    }
}
