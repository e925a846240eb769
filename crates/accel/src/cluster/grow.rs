//! Greedy growing: clusters are made one after the other, each from one triangle by taking in the neighbour with which it
//! has the largest value, while that is above zero; K. V. Garanzha's thesis of 2014, chapter 3.2.
//!
//! The first triangles come in an order that a hash of their numbers gives. Deviation: a large mesh is grown in parts,
//! each by one thread, whose borders no cluster crosses; the parts follow from the mesh alone.

use super::connect::{Link, Neighbours, parts_of, places_in};
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
    let places = places_in(&parts, count);
    let of_part = |(number, mut triangles): (usize, Vec<u32>)| {
        triangles.sort_unstable_by_key(|&triangle| hash_u32(triangle));
        let mut grower = Grower {
            measure,
            neighbours: &neighbours,
            places: &places,
            part: number as u32,
            taken: vec![false; triangles.len()],
            room: M::Room::default(),
        };
        let mut clusters = Vec::new();
        for &triangle in &triangles {
            if grower.is_free(triangle) {
                clusters.push(grower.cluster(triangle));
            }
        }
        clusters
    };
    parts.into_par_iter().enumerate().flat_map_iter(of_part).collect()
}

struct Grower<'a, M: Measure> {
    measure: &'a M,
    neighbours: &'a Neighbours,
    /// By triangle: its part, and its place there.
    places: &'a [(u32, u32)],
    part: u32,
    /// By place in the part: whether the triangle is in a cluster.
    taken: Vec<bool>,
    room: M::Room,
}

impl<M: Measure> Grower<'_, M> {
    /// Grows a cluster from a triangle.
    fn cluster(&mut self, first: u32) -> Vec<u32> {
        let mut kept = self.measure.single(first);
        let (mut cluster, mut border) = (vec![first], Vec::new());
        self.take(first);
        self.look_around(first, &mut border);
        while let Some(best) = self.best(&kept, &border) {
            let (triangle, single) = border.swap_remove(best);
            kept = self.measure.join([kept, single], 0.0);
            cluster.push(triangle);
            self.take(triangle);
            self.look_around(triangle, &mut border);
        }
        cluster
    }

    /// Whether a triangle is one of the part, and in no cluster.
    fn is_free(&self, triangle: u32) -> bool {
        let (part, place) = self.places[triangle as usize];
        part == self.part && !self.taken[place as usize]
    }

    fn take(&mut self, triangle: u32) {
        self.taken[self.places[triangle as usize].1 as usize] = true;
    }

    /// Adds the free neighbours of a triangle to the border of a cluster.
    fn look_around(&self, triangle: u32, border: &mut Vec<(u32, M::Kept)>) {
        for &other in self.neighbours.of(triangle) {
            if self.is_free(other) && border.iter().all(|(known, _)| *known != other) {
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
