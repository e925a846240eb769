//! Finishing pass: Meister, Bittner 2018, "Parallel reinsertion for bounding volume hierarchy optimization".
//!
//! A node is taken out, and put back beside the node where the tree's surface becomes smallest. Each round takes an eighth
//! of the nodes, those with the largest boxes and others in turn, searches the best places of all of them at once, and
//! makes the moves that do not touch each other, the best first.
//!
//! Deviation: moves are made one after the other, since making them takes little time beside searching; so a move into
//! what is meanwhile below the node itself is seen and left out.

use super::BLANK;
use crate::{BinaryTree, Node};
use rayon::prelude::*;
use vastlight_math::Aabb;

/// One in so many nodes is looked at in a round for its large box, and as many in turn.
const PORTION: usize = 16;
const ROOT: usize = 0;

/// Improves `tree` in `rounds` rounds.
pub(super) fn optimize(tree: BinaryTree, rounds: u32) -> BinaryTree {
    if rounds == 0 || tree.nodes.len() < 5 {
        return tree;
    }
    let mut links = Links::new(&tree);
    (0..rounds as usize).for_each(|round| links.round(round));
    links.lay_out(&tree)
}

/// A move: take `node` out and put it beside `target`.
#[derive(Clone, Copy, Debug)]
struct Move {
    node: u32,
    target: u32,
    /// How much smaller the sum of the boxes' half areas becomes.
    gain: f32,
}

/// A tree whose nodes know parent and children; those of leaves are themselves.
struct Links {
    bounds: Vec<Aabb>,
    parents: Vec<u32>,
    children: Vec<[u32; 2]>,
}

impl Links {
    fn new(tree: &BinaryTree) -> Self {
        let mut parents = vec![0; tree.nodes.len()];
        let mut children = Vec::with_capacity(tree.nodes.len());
        for (node, i) in tree.nodes.iter().zip(0_u32..) {
            if node.is_leaf() {
                children.push([i; 2]);
                continue;
            }
            children.push([node.left, node.left + 1]);
            parents[node.left as usize] = i;
            parents[node.left as usize + 1] = i;
        }
        Self { bounds: tree.nodes.iter().map(|n| n.bounds).collect(), parents, children }
    }

    fn is_leaf(&self, node: usize) -> bool {
        self.children[node][0] as usize == node
    }

    fn parent(&self, node: usize) -> usize {
        self.parents[node] as usize
    }

    fn sibling(&self, node: usize) -> usize {
        let [a, b] = self.children[self.parent(node)];
        (if a as usize == node { b } else { a }) as usize
    }

    fn area(&self, node: usize) -> f32 {
        self.bounds[node].half_area()
    }

    /// Searches and makes moves.
    fn round(&mut self, round: usize) {
        let key = |i: usize| u64::from(!self.area(i).to_bits()) << 32 | i as u64;
        let mut largest: Vec<u64> = (1..self.bounds.len()).into_par_iter().map(key).collect();
        largest.par_sort_unstable();
        let (largest, others) = largest.split_at(self.bounds.len() / PORTION);
        let in_turn = others[round % PORTION.min(others.len())..].iter().step_by(PORTION);
        let candidates: Vec<u32> = largest.iter().chain(in_turn).map(|&key| key as u32).collect();
        let candidates =
            candidates.par_iter().with_max_len(64).filter(|&&node| self.parent(node as usize) != ROOT);
        let mut moves: Vec<Move> = candidates.filter_map(|&node| self.best_move(node)).collect();
        moves.par_sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        let mut touched = vec![false; self.bounds.len()];
        moves.iter().for_each(|m| self.make(m, &mut touched));
        self.refit();
    }

    /// The best place for `node`, if one is better than its own.
    fn best_move(&self, node: u32) -> Option<Move> {
        let (own, own_area) = (self.bounds[node as usize], self.area(node as usize));
        let parent = self.parent(node as usize);
        let mut best = Move { node, target: node, gain: 0.0 };
        // What is saved so far on the way up, and the box of what stays below the pivot.
        let mut saved = self.area(parent);
        let mut beside = self.sibling(node as usize);
        let mut stays = self.bounds[beside];
        let mut pivot = parent;
        let mut waiting = Vec::with_capacity(64);
        loop {
            waiting.push((saved, beside));
            while let Some((saved, place)) = waiting.pop() {
                // A node around both is at least as large as the node itself.
                if saved - own_area <= best.gain {
                    continue;
                }
                let gain = saved - self.bounds[place].union(own).half_area();
                if gain > best.gain {
                    best = Move { target: place as u32, gain, ..best };
                }
                if !self.is_leaf(place) {
                    let below = gain + self.area(place);
                    waiting.extend(self.children[place].map(|child| (below, child as usize)));
                }
            }
            if pivot == ROOT {
                break;
            }
            if pivot != parent {
                stays = stays.union(self.bounds[beside]);
                saved += self.area(pivot) - stays.half_area();
            }
            beside = self.sibling(pivot);
            pivot = self.parent(pivot);
        }
        let same = best.target as usize == parent || best.target as usize == self.sibling(node as usize);
        (best.gain > 0.0 && best.gain.is_finite() && !same).then_some(best)
    }

    /// Makes a move unless it touches one made before.
    fn make(&mut self, m: &Move, touched: &mut [bool]) {
        let (node, target) = (m.node as usize, m.target as usize);
        let (parent, sibling) = (self.parent(node), self.sibling(node));
        let (grandparent, above_target) = (self.parent(parent), self.parent(target));
        let all = [node, target, parent, sibling, grandparent, above_target];
        if target == ROOT
            || parent == ROOT
            || all.iter().any(|&i| touched[i])
            || self.is_below(target, parent)
        {
            return;
        }
        all.iter().for_each(|&i| touched[i] = true);
        self.replace_child(grandparent, parent, sibling);
        self.replace_child(above_target, target, parent);
        self.children[parent] = [m.target, m.node];
        self.parents[target] = parent as u32;
        self.parents[node] = parent as u32;
    }

    fn is_below(&self, mut node: usize, above: usize) -> bool {
        while node != above && node != ROOT {
            node = self.parent(node);
        }
        node == above
    }

    fn replace_child(&mut self, parent: usize, old: usize, new: usize) {
        self.parents[new] = parent as u32;
        for child in &mut self.children[parent] {
            if *child as usize == old {
                *child = new as u32;
            }
        }
    }

    /// The nodes, each in front of what is below it.
    fn downward(&self) -> Vec<usize> {
        let mut order = Vec::with_capacity(self.bounds.len());
        let mut waiting = vec![ROOT];
        while let Some(node) = waiting.pop() {
            order.push(node);
            if !self.is_leaf(node) {
                waiting.extend(self.children[node].map(|child| child as usize));
            }
        }
        order
    }

    fn refit(&mut self) {
        for node in self.downward().into_iter().rev() {
            if !self.is_leaf(node) {
                let [a, b] = self.children[node];
                self.bounds[node] = self.bounds[a as usize].union(self.bounds[b as usize]);
            }
        }
    }

    /// The tree, depth first, with the leaves of `old`.
    fn lay_out(&self, old: &BinaryTree) -> BinaryTree {
        let mut counts: Vec<u32> = old.nodes.iter().map(|n| n.count).collect();
        for node in self.downward().into_iter().rev() {
            if !self.is_leaf(node) {
                let [a, b] = self.children[node];
                counts[node] = counts[a as usize] + counts[b as usize];
            }
        }
        let mut nodes = Vec::with_capacity(old.nodes.len());
        let mut prims = Vec::with_capacity(old.prims.len());
        nodes.push(BLANK);
        let mut waiting = vec![(ROOT, 0)];
        while let Some((node, slot)) = waiting.pop() {
            let first = prims.len() as u32;
            nodes[slot] = Node { bounds: self.bounds[node], left: 0, first, count: counts[node] };
            if self.is_leaf(node) {
                let leaf = &old.nodes[node];
                prims.extend_from_slice(&old.prims[leaf.first as usize..(leaf.first + leaf.count) as usize]);
                continue;
            }
            let left = nodes.len();
            nodes[slot].left = left as u32;
            nodes.extend([BLANK; 2]);
            let [a, b] = self.children[node];
            waiting.extend([(b as usize, left + 1), (a as usize, left)]);
        }
        BinaryTree { nodes, prims }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{quality, validate};
    use vastlight_math::Vec3;

    /// A balanced tree over boxes in any order.
    fn balanced(boxes: &[Aabb]) -> BinaryTree {
        let mut nodes = vec![BLANK];
        let mut waiting = vec![(0, 0, boxes.len())];
        while let Some((slot, first, count)) = waiting.pop() {
            let bounds = boxes[first..first + count].iter().fold(Aabb::EMPTY, |a, &b| a.union(b));
            nodes[slot] = Node { bounds, left: 0, first: first as u32, count: count as u32 };
            if count > 1 {
                let left = nodes.len();
                nodes[slot].left = left as u32;
                nodes.extend([BLANK; 2]);
                waiting.extend([(left + 1, first + count / 2, count - count / 2), (left, first, count / 2)]);
            }
        }
        BinaryTree { nodes, prims: (0..boxes.len() as u32).collect() }
    }

    #[test]
    fn a_shuffled_tree_becomes_far_better() {
        let cube = |i: usize| Aabb { min: Vec3::X * i as f32, max: Vec3::X * i as f32 + Vec3::ONE };
        let sorted: Vec<Aabb> = (0..256).map(cube).collect();
        let shuffled: Vec<Aabb> = (0..256).map(|i| cube(i * 77 % 256)).collect();
        let (best, start) = (quality(&balanced(&sorted)).cost, quality(&balanced(&shuffled)).cost);
        let mut last = start;
        for rounds in [1, 16, 96] {
            let tree = optimize(balanced(&shuffled), rounds);
            validate(&tree, &shuffled, 1).expect("sound");
            let cost = quality(&tree).cost;
            assert!(cost <= last, "{cost} after {last}");
            last = cost;
        }
        assert!(last < 0.5 * start && last < 3.0 * best, "{start} {last} {best}");
    }

    #[test]
    fn the_best_place_is_found() {
        // Left: 0 and a stray 10; right: 9 and 11. The stray belongs to the right.
        let cube = |x: f32| Aabb { min: Vec3::X * x, max: Vec3::X * x + Vec3::ONE };
        let tree = balanced(&[cube(0.0), cube(10.0), cube(9.0), cube(11.0)]);
        let links = Links::new(&tree);
        let stray = (1..7).find(|&i| links.bounds[i] == cube(10.0)).expect("a leaf") as u32;
        let found = links.best_move(stray).expect("a move");
        assert!(found.target != stray && links.parent(found.target as usize) != links.parent(stray as usize));
        assert!((found.gain - 18.0).abs() < 1e-4, "{found:?}");
    }
}
