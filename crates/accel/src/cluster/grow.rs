//! Greedy growing: clusters are made one after the other, each from one triangle by taking in the neighbour with which it
//! has the largest value, while that is above zero; K. V. Garanzha's thesis of 2014, chapter 3.2.
//!
//! The first triangles come in an order that a hash of their numbers gives. Deviation: a large mesh is grown in parts,
//! each by one thread, whose borders no cluster crosses; the parts follow from the mesh alone.

use super::connect::{Link, Neighbours, parts_of};
use super::measure::Measure;
use crate::wide::MeshView;
use rayon::prelude::*;
use vastlight_math::rng::hash_u32;

/// Meshes with more triangles are grown in parts of at most so many.
const PART: usize = 1 << 16;

/// The clusters of a mesh, as lists of triangles.
pub(super) fn grow<M: Measure>(measure: &M, mesh: &MeshView<'_>, links: &[Link]) -> Vec<Vec<u32>> {
    let count = mesh.triangles.len();
    let neighbours = Neighbours::new(count, links);
    let parts = parts_of(mesh, PART);
    let mut part_of = vec![0; count];
    for (part, number) in parts.iter().zip(0_u32..) {
        part.iter().for_each(|&triangle| part_of[triangle as usize] = number);
    }
    let of_part = |(number, mut triangles): (usize, Vec<u32>)| {
        triangles.sort_unstable_by_key(|&triangle| hash_u32(triangle));
        let mut grower = Grower {
            measure,
            neighbours: &neighbours,
            part_of: &part_of,
            part: number as u32,
            taken: Taken::new(&triangles),
            room: M::Room::default(),
        };
        let mut clusters = Vec::new();
        for &triangle in &triangles {
            if grower.taken.is_free(triangle) {
                clusters.push(grower.cluster(triangle));
            }
        }
        clusters
    };
    parts.into_par_iter().enumerate().flat_map_iter(of_part).collect()
}

/// Which triangles of a part are in a cluster: bits, by place in a sorted list.
struct Taken {
    sorted: Vec<u32>,
    bits: Vec<bool>,
}

impl Taken {
    fn new(triangles: &[u32]) -> Self {
        let mut sorted = triangles.to_vec();
        sorted.sort_unstable();
        Self { bits: vec![false; sorted.len()], sorted }
    }

    fn place(&self, triangle: u32) -> usize {
        self.sorted.partition_point(|&t| t < triangle)
    }

    fn is_free(&self, triangle: u32) -> bool {
        !self.bits[self.place(triangle)]
    }

    fn take(&mut self, triangle: u32) {
        let place = self.place(triangle);
        self.bits[place] = true;
    }
}

struct Grower<'a, M: Measure> {
    measure: &'a M,
    neighbours: &'a Neighbours,
    part_of: &'a [u32],
    part: u32,
    taken: Taken,
    room: M::Room,
}

impl<M: Measure> Grower<'_, M> {
    /// Grows a cluster from a triangle.
    fn cluster(&mut self, first: u32) -> Vec<u32> {
        let mut kept = self.measure.single(first);
        let (mut cluster, mut border) = (vec![first], Vec::new());
        self.taken.take(first);
        self.look_around(first, &mut border);
        while let Some(best) = self.best(&kept, &border) {
            let (triangle, single) = border.swap_remove(best);
            kept = self.measure.join([kept, single], 0.0);
            cluster.push(triangle);
            self.taken.take(triangle);
            self.look_around(triangle, &mut border);
        }
        cluster
    }

    /// Adds the free neighbours of a triangle to the border of a cluster.
    fn look_around(&self, triangle: u32, border: &mut Vec<(u32, M::Kept)>) {
        for &other in self.neighbours.of(triangle) {
            let within = self.part_of[other as usize] == self.part;
            if within && self.taken.is_free(other) && border.iter().all(|(known, _)| *known != other) {
                border.push((other, self.measure.single(other)));
            }
        }
    }

    /// The place of the border's triangle with which a cluster has the largest value, if that is above zero; the
    /// lowest number where several have.
    fn best(&mut self, kept: &M::Kept, border: &[(u32, M::Kept)]) -> Option<usize> {
        let mut best: Option<(f32, u32, usize)> = None;
        for (place, (triangle, single)) in border.iter().enumerate() {
            let value = self.measure.value([kept, single], 0.0, &mut self.room);
            let better =
                best.is_none_or(|(most, number, _)| value > most || value == most && *triangle < number);
            if value > 0.0 && better {
                best = Some((value, *triangle, place));
            }
        }
        best.map(|(_, _, place)| place)
    }
}
