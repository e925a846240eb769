//! The dual graph of a mesh: triangles are its nodes, edges that two triangles share its links.
//!
//! Vertices are the same where their numbers are. An edge of more than two triangles links them in a row, in the order of
//! their numbers, so that there are never more links than edges of triangles.

use crate::sort::parts;
use crate::wide::MeshView;
use rayon::prelude::*;
use vastlight_math::Vec3;

/// Two neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Link {
    /// The nodes, the lower number first.
    pub(super) ends: [u32; 2],
    /// Length of all edges that they share.
    pub(super) length: f32,
}

/// A side of a triangle: its vertices in order, as one number, and the triangle.
type Side = (u64, u32);

/// The links of a mesh, ordered by their ends; every pair of neighbours is linked once.
pub(super) fn links(mesh: &MeshView<'_>) -> Vec<Link> {
    let mut sides: Vec<Side> = mesh
        .triangles
        .par_iter()
        .enumerate()
        .flat_map_iter(|(triangle, &[a, b, c])| {
            let key = |p: u32, q: u32| u64::from(p.min(q)) << 32 | u64::from(p.max(q));
            [(a, b), (b, c), (c, a)].map(|(p, q)| (key(p, q), triangle as u32))
        })
        .filter(|side| side.0 >> 32 != side.0 & 0xffff_ffff)
        .collect();
    sides.par_sort_unstable();
    // A triangle whose corners are not distinct may have a side twice.
    sides.dedup();
    let position = |vertex: u64| mesh.positions[vertex as usize];
    let between = |pair: &[Side]| {
        let [(side, a), (_, b)] = [pair[0], pair[1]];
        let length = || position(side >> 32).distance(position(side & 0xffff_ffff));
        (side == pair[1].0).then(|| Link { ends: [a.min(b), a.max(b)], length: length() })
    };
    let mut links: Vec<Link> = sides.par_windows(2).filter_map(between).collect();
    join_equal(&mut links);
    links
}

/// Orders links by their ends, and makes one of those with the same ends.
pub(super) fn join_equal(links: &mut Vec<Link>) {
    links.par_sort_unstable_by_key(|link| (link.ends, link.length.to_bits()));
    links.dedup_by(|next, kept| {
        let same = next.ends == kept.ends;
        kept.length += if same { next.length } else { 0.0 };
        same
    });
}

/// Neighbours by node.
pub(super) struct Neighbours {
    /// Where those of a node start, and the end of all.
    first: Vec<u32>,
    all: Vec<u32>,
}

impl Neighbours {
    /// Of `nodes` nodes.
    pub(super) fn new(nodes: usize, links: &[Link]) -> Self {
        let mut first = vec![0; nodes + 1];
        links.iter().flat_map(|link| link.ends).for_each(|end| first[end as usize + 1] += 1);
        (0..nodes).for_each(|node| first[node + 1] += first[node]);
        let (mut next, mut all) = (first.clone(), vec![0; 2 * links.len()]);
        for &Link { ends: [a, b], .. } in links {
            for (from, to) in [(a, b), (b, a)] {
                let place = &mut next[from as usize];
                all[*place as usize] = to;
                *place += 1;
            }
        }
        Self { first, all }
    }

    /// Those of a node.
    pub(super) fn of(&self, node: u32) -> &[u32] {
        let node = node as usize;
        &self.all[self.first[node] as usize..self.first[node + 1] as usize]
    }
}

/// Halves a mesh by its triangles' centroids, across the longest side of the box around these, until no part has more
/// than `most` triangles. Gives the triangles of each part in the order of their numbers.
pub(super) fn parts_of(mesh: &MeshView<'_>, most: usize) -> Vec<Vec<u32>> {
    let centroid = |&t: &u32| mesh.corners(t).into_iter().sum::<Vec3>();
    let mut all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    let mut sizes = Vec::new();
    halve(&mut all, &centroid, most.max(1), &mut sizes);
    parts(&mut all, sizes.into_iter())
        .into_par_iter()
        .map(|part| {
            part.sort_unstable();
            part.to_vec()
        })
        .collect()
}

/// By triangle, of `count`: which part it is in, and its place there.
pub(super) fn places_in(parts: &[Vec<u32>], count: usize) -> Vec<(u32, u32)> {
    let mut places = vec![(0, 0); count];
    for (part, number) in parts.iter().zip(0..) {
        part.iter().zip(0..).for_each(|(&triangle, i)| places[triangle as usize] = (number, i));
    }
    places
}

fn halve(all: &mut [u32], centroid: &impl Fn(&u32) -> Vec3, most: usize, sizes: &mut Vec<usize>) {
    if all.len() <= most {
        sizes.push(all.len());
        return;
    }
    let around = vastlight_math::Aabb::from_points(all.iter().map(centroid));
    let axis = around.longest_axis();
    let middle = all.len() / 2;
    all.select_nth_unstable_by(middle, |a, b| {
        centroid(a)[axis].total_cmp(&centroid(b)[axis]).then_with(|| a.cmp(b))
    });
    let (left, right) = all.split_at_mut(middle);
    halve(left, centroid, most, sizes);
    halve(right, centroid, most, sizes);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
        let positions: Vec<Vec3> =
            (0..9_u8).map(|i| Vec3::new(f32::from(i), f32::from(i * i), 0.0)).collect();
        let links = links(&MeshView { positions: &positions, triangles });
        links.iter().map(|link| link.ends).collect()
    }

    #[test]
    fn neighbours_share_an_edge() {
        assert!(ends(&[]).is_empty() && ends(&[[0, 1, 2]]).is_empty());
        assert_eq!(ends(&[[0, 1, 2], [2, 1, 3], [4, 5, 6]]), [[0, 1]]);
        assert!(ends(&[[0, 1, 2], [2, 3, 4]]).is_empty(), "a vertex alone is no edge");
    }

    #[test]
    fn edges_of_many_equal_and_degenerate_triangles_link_little() {
        assert_eq!(ends(&[[0, 1, 2], [1, 0, 3], [0, 1, 4], [5, 0, 1]]), [[0, 1], [1, 2], [2, 3]]);
        assert_eq!(ends(&[[0, 1, 2]; 4]), [[0, 1], [1, 2], [2, 3]]);
        assert_eq!(ends(&[[0, 0, 0], [0, 1, 0], [0, 1, 2]]), [[1, 2]]);
    }

    #[test]
    fn lengths_of_shared_edges_add_up() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 2.0, 0.0), Vec3::Z];
        let triangles = [[0, 1, 2], [2, 1, 0], [0, 3, 1]];
        let found = links(&MeshView { positions: &positions, triangles: &triangles });
        let whole = 1.0 + 2.0 + 5.0_f32.sqrt();
        assert_eq!(found.iter().map(|l| l.ends).collect::<Vec<_>>(), [[0, 1], [1, 2]]);
        assert!((found[0].length - whole).abs() < 1e-6 && found[1].length == 1.0, "{found:?}");
        let neighbours = Neighbours::new(3, &found);
        assert_eq!((neighbours.of(0), neighbours.of(1), neighbours.of(2)), (&[1][..], &[0, 2][..], &[1][..]));
    }

    #[test]
    fn parts_hold_every_triangle_once() {
        let positions: Vec<Vec3> =
            (0..300_u16).map(|i| Vec3::new(f32::from(i % 17), f32::from(i / 17), 0.0)).collect();
        let triangles: Vec<[u32; 3]> = (0..298).map(|i| [i, i + 1, i + 2]).collect();
        let parts = parts_of(&MeshView { positions: &positions, triangles: &triangles }, 40);
        let mut all: Vec<u32> = parts.iter().flatten().copied().collect();
        all.sort_unstable();
        assert!(parts.len() == 8 && parts.iter().all(|part| part.len() <= 40 && part.is_sorted()));
        assert!(all.iter().copied().eq(0..298));
    }
}
