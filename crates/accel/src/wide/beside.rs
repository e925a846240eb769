//! Two trees under one root: over instances that stand still, which is never touched, and over those that move, which is
//! built anew whenever they do. So the cost of a moment follows what moves.

use super::{ChildRef, InstanceBvh, Node8, TopBvh, WideNode};
use crate::{BuildConfig, BuildError, Scratch};
use rayon::prelude::*;
use vastlight_math::Aabb;

/// The part of an [`InstanceBvh`] that stands still, as it was before movers were put beside it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Still {
    nodes: usize,
    root: Option<(ChildRef, Aabb)>,
    levels: usize,
}

impl InstanceBvh {
    /// What to remember of a tree over what stands still. `bounds` are those it was built with.
    #[must_use]
    pub fn still(&self, bounds: impl Fn(u32) -> Aabb) -> Still {
        let around = |root: ChildRef| match self.nodes.get(root.index()) {
            Some(node) if !root.is_leaf() => {
                let slots = (0..8).filter(|&slot| node.child(root.index(), slot) != ChildRef::NONE);
                slots.map(|slot| node.bounds(slot)).fold(Aabb::EMPTY, Aabb::union)
            }
            _ => bounds(root.index() as u32),
        };
        let root = self.root.map(|root| (root, around(root)));
        Still { nodes: self.nodes.len(), root, levels: self.levels }
    }

    /// What is below a root with its boxes: the children of its node, or itself.
    fn opened(&self, (root, bounds): (ChildRef, Aabb)) -> Vec<(ChildRef, Aabb)> {
        match self.nodes.get(root.index()) {
            Some(node) if !root.is_leaf() => {
                let slots = (0..8).map(|slot| (node.child(root.index(), slot), slot));
                slots
                    .filter(|(child, _)| *child != ChildRef::NONE)
                    .map(|(child, slot)| (child, node.bounds(slot)))
                    .collect()
            }
            _ => vec![(root, bounds)],
        }
    }

    /// The children of a root over two trees, of which both are opened, or one, as far as there is room: a visit less a ray
    /// (6 % of the rays of `demo:bodies`).
    fn joined(&self, [a, b]: [(ChildRef, Aabb); 2]) -> Vec<(ChildRef, Aabb)> {
        let (opened_a, opened_b) = (self.opened(a), self.opened(b));
        let ways = [(opened_a.clone(), opened_b.clone()), (opened_a, vec![b]), (vec![a], opened_b)];
        let fitting = ways.into_iter().find(|(a, b)| a.len() + b.len() <= 8);
        fitting.map_or_else(|| vec![a, b], |(a, b)| [a, b].concat())
    }

    /// Puts a tree over `movers` beside what stands still, in the place of the last such tree. Movers whose box is empty are
    /// left out; `bounds` are as in [`InstanceBvh::build`].
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()).
    pub fn put_beside(
        &mut self,
        still: &Still,
        (name, movers): (&str, &[u32]),
        bounds: impl Fn(u32) -> Aabb + Sync,
        config: &BuildConfig,
    ) -> Result<(), BuildError> {
        let boxes: Vec<Aabb> = movers.par_iter().with_min_len(64).map(|&i| bounds(i)).collect();
        let top = TopBvh::build(name, &boxes, |_| 1.0, config, &mut Scratch::default())?;
        let child = |child: ChildRef| match child {
            ChildRef::NONE => child,
            child if child.is_leaf() => ChildRef::leaf(movers[child.index()]),
            child => ChildRef::node((child.index() + still.nodes) as u32),
        };
        self.nodes.truncate(still.nodes);
        for node in &top.nodes {
            self.nodes.push(node, child);
        }
        let all = boxes.into_iter().filter(|b| !b.is_empty()).fold(Aabb::EMPTY, Aabb::union);
        let moving = top.root.map(|root| (child(root), all));
        (self.root, self.levels) = (still.root.map(|(root, _)| root), still.levels);
        match (still.root, moving) {
            (Some(still), Some(moving)) => {
                let mut node = Node8::EMPTY;
                for (slot, (child, bounds)) in self.joined([still, moving]).into_iter().enumerate() {
                    node.set(slot, child, &bounds);
                }
                self.root = Some(ChildRef::node(self.nodes.len() as u32));
                self.nodes.push(&node, |child| child);
                self.levels = 1 + self.levels.max(top.levels);
            }
            (None, Some((root, _))) => (self.root, self.levels) = (Some(root), top.levels),
            (_, None) => {}
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wide::{Boxes, validate_nodes};
    use vastlight_math::Vec3;

    fn boxes(count: usize, moved: &[u32], by: f32) -> Vec<Aabb> {
        let place = |i: u32| {
            let shift = if moved.contains(&i) { by } else { 0.0 };
            Vec3::new((i * 7 % 97) as f32, (i * 13 % 89) as f32 + shift, (i * 29 % 83) as f32)
        };
        (0..count as u32).map(|i| Aabb { min: place(i), max: place(i) + 0.5 }).collect()
    }

    fn reached(nodes: &[Node8], from: ChildRef, found: &mut [bool]) {
        if from != ChildRef::NONE && !from.is_leaf() {
            found[from.index()] = true;
            nodes[from.index()].children.iter().for_each(|child| reached(nodes, *child, found));
        }
    }

    /// Checks the tree, and gives its levels.
    fn check(bvh: &InstanceBvh, boxes: &[Aabb]) -> usize {
        let mut nodes: Vec<Node8> =
            (0..bvh.nodes.len()).filter_map(|i| Some(bvh.nodes.get(i)?.to_wide(i))).collect();
        let mut found = vec![false; nodes.len()];
        reached(&nodes, bvh.root.unwrap_or(ChildRef::NONE), &mut found);
        // The two roots whose children the joint root took.
        assert!(found.iter().filter(|found| !**found).count() <= 2);
        nodes.iter_mut().zip(&found).filter(|(_, found)| !**found).for_each(|(node, _)| *node = Node8::EMPTY);
        let leaf = |i: usize| Some(vec![(i as u32, *boxes.get(i)?)]);
        validate_nodes(&nodes, bvh.root, boxes.len(), Boxes::Rounded, leaf, |_, _| false).expect("sound");
        // Rays have room for so many levels.
        let levels = bvh.root.map_or(0, |root| levels(&nodes, root));
        assert!(levels <= bvh.levels);
        levels
    }

    fn levels(nodes: &[Node8], root: ChildRef) -> usize {
        if root == ChildRef::NONE || root.is_leaf() {
            return 0;
        }
        let below = nodes[root.index()].children.into_iter().map(|child| levels(nodes, child));
        1 + below.max().unwrap_or(0)
    }

    #[test]
    fn movers_are_found_beside_what_stands_still() {
        let config = BuildConfig::default();
        for (count, movers) in [
            (500, (0..500).step_by(17).collect::<Vec<u32>>()),
            (2, vec![1]),
            (1, vec![0]),
            (40, (0..40).collect()),
            (8, vec![0, 3, 6]),
            (300_000, vec![5, 150_000, 299_999]),
        ] {
            let mut now = boxes(count, &[], 0.0);
            let rests = |i: u32| if movers.contains(&i) { Aabb::EMPTY } else { now[i as usize] };
            let mut bvh = InstanceBvh::build("", count, rests, |_| 1.0, &config).expect("built");
            let still = bvh.still(|i| now[i as usize]);
            let bytes = bvh.bytes();
            for by in [0.0, 50.0, -30.0] {
                now = boxes(count, &movers, by);
                let bounds = |i: u32| now[i as usize];
                bvh.put_beside(&still, ("", &movers), bounds, &config).expect("built");
                let levels = check(&bvh, &now);
                assert!(count > 8 || levels <= 1, "one node holds what stands still and what moves");
                assert!(bvh.bytes() <= bytes + 256 * (movers.len() + 1), "no tree stays behind");
            }
            // Nobody moves any more.
            bvh.put_beside(&still, ("", &[]), |_| Aabb::EMPTY, &config).expect("built");
            assert_eq!(bvh.root, still.root.map(|(root, _)| root));
        }
    }
}
