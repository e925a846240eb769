//! Merging in pairs: of all links of the dual graph the one whose ends are the best cluster together goes first; K. V.
//! Garanzha's thesis of 2014, chapter 3.2, after M. Garland, A. Willmott, P. Heckbert 2001, "Hierarchical face
//! clustering on polygonal surfaces".
//!
//! Deviation: a large mesh is merged in parts first, each by one thread, and then across the parts' borders, where
//! clusters of different parts still make acceptable ones. The parts follow from the mesh alone.

use super::connect::{Link, join_equal, parts_of, places_in};
use super::measure::Measure;
use super::queue::BucketQueue;
use crate::wide::MeshView;
use rayon::prelude::*;

/// Meshes with more triangles are merged in parts of at most half as many.
const WHOLE: usize = 1 << 17;
/// No link.
const NONE: u32 = u32::MAX;

/// When merging ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Until {
    /// No two neighbours have a value above zero together.
    NonePositive,
    /// There are no more than so many clusters, or no neighbours.
    Count(usize),
}

/// Merges the triangles of a mesh while two neighbours have a value above zero together; gives what is kept of each cluster.
pub(super) fn merge_acceptable<M: Measure>(measure: &M, mesh: &MeshView<'_>, links: &[Link]) -> Vec<M::Kept> {
    let count = mesh.triangles.len();
    let single = |&t: &u32| measure.single(t);
    if count <= WHOLE {
        let nodes = (0..count as u32).map(|t| single(&t)).collect();
        return Merger::new(measure, nodes, links.to_vec(), Until::NonePositive).run().kept;
    }
    let parts = parts_of(mesh, WHOLE / 2);
    let merged: Vec<Merged<M::Kept>> = parts
        .par_iter()
        .zip(links_by_part(&parts, links, count))
        .map(|(part, links)| {
            Merger::new(measure, part.iter().map(single).collect(), links, Until::NonePositive).run()
        })
        .collect();
    let (mut cluster_of, mut nodes) = (vec![0; count], Vec::new());
    for (part, merged) in parts.iter().zip(merged) {
        for (&triangle, cluster) in part.iter().zip(merged.cluster_of) {
            cluster_of[triangle as usize] = nodes.len() as u32 + cluster;
        }
        nodes.extend(merged.kept);
    }
    let links = renumber(links, |triangle| cluster_of[triangle as usize]);
    Merger::new(measure, nodes, links, Until::NonePositive).run().kept
}

/// Merges the triangles of a mesh until there are no more than `most` clusters; gives the cluster of each triangle.
pub(super) fn merge_to_count<M: Measure>(
    measure: &M,
    triangles: usize,
    links: &[Link],
    most: usize,
) -> Vec<u32> {
    let nodes = (0..triangles as u32).into_par_iter().map(|t| measure.single(t)).collect();
    Merger::new(measure, nodes, links.to_vec(), Until::Count(most)).run().cluster_of
}

/// The links within each part, their ends counted within it.
fn links_by_part(parts: &[Vec<u32>], links: &[Link], count: usize) -> Vec<Vec<Link>> {
    let place = places_in(parts, count);
    let mut found = vec![Vec::new(); parts.len()];
    for link in links {
        let [a, b] = link.ends.map(|end| place[end as usize]);
        if a.0 == b.0 {
            found[a.0 as usize].push(Link { ends: [a.1, b.1], ..*link });
        }
    }
    found
}

/// Links between what their ends are part of.
fn renumber(links: &[Link], number: impl Fn(u32) -> u32 + Sync) -> Vec<Link> {
    let between = |link: &Link| {
        let [a, b] = link.ends.map(&number);
        (a != b).then(|| Link { ends: [a.min(b), a.max(b)], ..*link })
    };
    let mut found = links.par_iter().filter_map(between).collect();
    join_equal(&mut found);
    found
}

/// What merging gave.
struct Merged<K> {
    /// By node.
    cluster_of: Vec<u32>,
    /// By cluster; clusters are in the order of their first nodes.
    kept: Vec<K>,
}

/// A dual graph whose nodes become fewer.
struct Merger<'a, M: Measure> {
    measure: &'a M,
    until: Until,
    /// By node; none where it is part of another.
    kept: Vec<Option<M::Kept>>,
    /// By node: what it is part of.
    parent: Vec<u32>,
    /// By node: its links.
    of_node: Vec<Vec<u32>>,
    links: Vec<Link>,
    queue: BucketQueue,
    /// By node: the link to it from the node that grows.
    seen: Vec<u32>,
    clusters: usize,
    room: M::Room,
}

impl<'a, M: Measure> Merger<'a, M> {
    fn new(measure: &'a M, nodes: Vec<M::Kept>, links: Vec<Link>, until: Until) -> Self {
        let count = nodes.len();
        let mut of_node = vec![Vec::with_capacity(4); count];
        for (link, number) in links.iter().zip(0..) {
            link.ends.iter().for_each(|&end| of_node[end as usize].push(number));
        }
        let value = |room: &mut M::Room, link: &Link| {
            measure.value(link.ends.map(|end| &nodes[end as usize]), link.length, room)
        };
        let values: Vec<f32> = links.par_iter().with_min_len(256).map_init(M::Room::default, value).collect();
        let mut merger = Self {
            measure,
            until,
            queue: BucketQueue::new(links.len()),
            kept: nodes.into_iter().map(Some).collect(),
            parent: (0..count as u32).collect(),
            of_node,
            links,
            seen: vec![NONE; count],
            clusters: count,
            room: M::Room::default(),
        };
        values.iter().zip(0..).for_each(|(&value, link)| merger.enqueue(link, value));
        merger
    }

    /// Puts a link to where its value belongs.
    fn enqueue(&mut self, link: u32, value: f32) {
        if value > 0.0 || self.until != Until::NonePositive {
            self.queue.set(link, value);
        } else {
            self.queue.remove(link);
        }
    }

    fn run(mut self) -> Merged<M::Kept> {
        while self.until != Until::Count(self.clusters)
            && let Some(link) = self.queue.pop()
        {
            self.merge(link);
        }
        let mut number = vec![NONE; self.parent.len()];
        let (mut cluster_of, mut kept) =
            (Vec::with_capacity(number.len()), Vec::with_capacity(self.clusters));
        for node in 0..self.parent.len() {
            let root = self.root(node);
            if number[root] == NONE {
                number[root] = kept.len() as u32;
                kept.extend(self.kept[root].take());
            }
            cluster_of.push(number[root]);
        }
        Merged { cluster_of, kept }
    }

    /// What a node is part of in the end.
    fn root(&mut self, mut node: usize) -> usize {
        while self.parent[node] as usize != node {
            self.parent[node] = self.parent[self.parent[node] as usize];
            node = self.parent[node] as usize;
        }
        node
    }

    /// Makes one node of a link's ends, and evaluates the links of that.
    fn merge(&mut self, link: u32) {
        let Link { ends: [a, b], length } = self.links[link as usize];
        // The one with more links stays.
        let fewer = self.of_node[a as usize].len() < self.of_node[b as usize].len();
        let (stays, goes) = if fewer { (b, a) } else { (a, b) };
        let (Some(one), Some(other)) = (self.kept[stays as usize].take(), self.kept[goes as usize].take())
        else {
            return;
        };
        self.kept[stays as usize] = Some(self.measure.join([one, other], length));
        self.parent[goes as usize] = stays;
        self.clusters -= 1;
        self.move_links(link, stays, goes);
        for i in 0..self.of_node[stays as usize].len() {
            self.evaluate(self.of_node[stays as usize][i]);
        }
    }

    fn evaluate(&mut self, link: u32) {
        let Link { ends, length } = self.links[link as usize];
        if let [Some(a), Some(b)] = ends.map(|end| self.kept[end as usize].as_ref()) {
            let value = self.measure.value([a, b], length, &mut self.room);
            self.enqueue(link, value);
        }
    }

    /// The links of `goes` become those of `stays`; `within` joined them.
    fn move_links(&mut self, within: u32, stays: u32, goes: u32) {
        let mut links = std::mem::take(&mut self.of_node[stays as usize]);
        let moved = std::mem::take(&mut self.of_node[goes as usize]);
        links.retain(|&link| link != within);
        for &link in &links {
            let other = self.other_end(link, stays);
            self.seen[other as usize] = link;
        }
        for link in moved.into_iter().filter(|&link| link != within) {
            let other = self.other_end(link, goes);
            let known = self.seen[other as usize];
            if known == NONE {
                self.links[link as usize].ends = [stays, other];
                links.push(link);
            } else {
                self.links[known as usize].length += self.links[link as usize].length;
                self.queue.remove(link);
                self.of_node[other as usize].retain(|&l| l != link);
            }
        }
        for &link in &links {
            let other = self.other_end(link, stays);
            self.seen[other as usize] = NONE;
        }
        self.of_node[stays as usize] = links;
    }

    fn other_end(&self, link: u32, end: u32) -> u32 {
        let [a, b] = self.links[link as usize].ends;
        if a == end { b } else { a }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;
    use vastlight_math::rng::hash_to_unit;

    /// Sets of nodes, whose value follows from what is in them and from how much they share.
    struct Sets;

    impl Measure for Sets {
        type Kept = Vec<u32>;
        type Room = ();

        fn single(&self, triangle: u32) -> Vec<u32> {
            vec![triangle]
        }

        fn value(&self, pair: [&Vec<u32>; 2], shared: f32, (): &mut ()) -> f32 {
            let mut all = pair.map(|set| set.as_slice()).concat();
            all.sort_unstable();
            hash_to_unit(&all) * 3.0 - 1.0 - 0.02 * all.len() as f32 + 1e-2 * shared
        }

        fn join(&self, pair: [Vec<u32>; 2], _shared: f32) -> Vec<u32> {
            pair.concat()
        }
    }

    /// The same by looking at every pair each time.
    fn plain(nodes: u32, links: &[Link], until: Until) -> Vec<Vec<u32>> {
        let mut sets: Vec<Vec<u32>> = (0..nodes).map(|node| vec![node]).collect();
        loop {
            if until == Until::Count(sets.len()) {
                break;
            }
            let mut shared = BTreeMap::<[usize; 2], f32>::new();
            let set_of = |node: u32| sets.iter().position(|set| set.contains(&node)).expect("in a set");
            for link in links {
                let [a, b] = link.ends.map(set_of);
                if a != b {
                    *shared.entry([a.min(b), a.max(b)]).or_default() += link.length;
                }
            }
            let value = |(pair, length): (&[usize; 2], &f32)| {
                (Sets.value(pair.map(|set| &sets[set]), *length, &mut ()), *pair)
            };
            let Some((best, [a, b])) = shared.iter().map(value).max_by(|a, b| a.0.total_cmp(&b.0)) else {
                break;
            };
            if until == Until::NonePositive && best <= 0.0 {
                break;
            }
            let joined = sets.remove(b);
            sets[a].extend(joined);
        }
        sets.iter_mut().for_each(|set| set.sort_unstable());
        sets.sort();
        sets
    }

    proptest! {
        #[test]
        fn the_best_pair_is_merged_first(
            pairs in prop::collection::vec((0..30_u32, 0..30_u32, 0..8_u8), 0..70),
            count in prop::option::of(1..20_usize),
        ) {
            let mut links: Vec<Link> = pairs
                .iter()
                .filter(|(a, b, _)| a != b)
                .map(|&(a, b, length)| Link { ends: [a.min(b), a.max(b)], length: f32::from(length) })
                .collect();
            join_equal(&mut links);
            let until = count.map_or(Until::NonePositive, Until::Count);
            let nodes = (0..30).map(|t| Sets.single(t)).collect();
            let merged = Merger::new(&Sets, nodes, links.clone(), until).run();
            for (node, &cluster) in merged.cluster_of.iter().enumerate() {
                prop_assert!(merged.kept[cluster as usize].contains(&(node as u32)));
            }
            let mut sets = merged.kept;
            sets.iter_mut().for_each(|set| set.sort_unstable());
            sets.sort();
            prop_assert_eq!(sets, plain(30, &links, until));
        }
    }

    #[test]
    fn parts_hold_the_links_within() {
        let link = |a, b| Link { ends: [a, b], length: 1.0 };
        let links = [link(0, 1), link(0, 2), link(1, 3), link(2, 3)];
        let parts = [vec![0, 2], vec![1, 3]];
        assert_eq!(links_by_part(&parts, &links, 4), [vec![link(0, 1)], vec![link(0, 1)]]);
        assert_eq!(renumber(&links, |node| node / 2), [Link { ends: [0, 1], length: 2.0 }]);
    }
}
