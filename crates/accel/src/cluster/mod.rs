//! Clusters of connected triangles, made once, over which trees are built anew for each frame of an animation; K. V.
//! Garanzha's thesis of 2014, chapter 3.
//!
//! Triangles that share edges move together. [`Clusters::new`] makes clusters of them that look like discs or balls
//! ([`Heuristic::Acc`]), from the positions of the first frame. In each frame their boxes are refreshed, and any builder builds
//! over boxes that are an order of magnitude fewer than the triangles: [`Clusters::build`], [`Clusters::rebuild`].

mod acc;
mod build;
mod connect;
mod error;
mod grow;
mod measure;
mod merge;
mod naive;
mod queue;
mod sphere;
mod treelet;
mod validate;

use crate::wide::MeshView;
use acc::Acc;
use error::Error;
use merge::{merge_acceptable, merge_to_count};
use naive::Naive;
use rayon::prelude::*;
use std::borrow::Cow;
use treelet::Treelets;
use vastlight_math::{Aabb, Vec3};

pub use build::{PUBLISHED_LEAF, stop_leaves};
pub use validate::ClusterReport;

/// What clusters should look like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Heuristic {
    /// Discs or balls of densely connected triangles.
    #[default]
    Acc,
    /// Boxes full of triangles; as many clusters as [`Heuristic::Acc`] gives.
    Naive,
    /// Flat discs, after Garland, Willmott and Heckbert; as many clusters as [`Heuristic::Acc`] gives.
    Error,
}

impl Heuristic {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Acc, Self::Naive, Self::Error];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Acc => "acc",
            Self::Naive => "naive",
            Self::Error => "error",
        }
    }

    /// The one of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|heuristic| heuristic.name() == name)
    }
}

/// How clusters that are acceptable to [`Heuristic::Acc`] are found. The others are always merged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Generator {
    /// All at once: the best pair of neighbours becomes one cluster.
    #[default]
    Merging,
    /// One after the other: each takes in the best of its neighbours.
    Growing,
}

/// How to make clusters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClusterConfig {
    /// What clusters should look like.
    pub heuristic: Heuristic,
    /// How they are found.
    pub generator: Generator,
    /// About the most vertices of a cluster.
    pub max_count: u32,
    /// About the largest sphere around a cluster: its area, in units of that around a mean triangle.
    pub max_size: u32,
}

impl ClusterConfig {
    /// What serves rays and builds best together, by the thesis.
    pub const DEFAULT: Self =
        Self { heuristic: Heuristic::Acc, generator: Generator::Merging, max_count: 50, max_size: 50 };
}

impl Default for ClusterConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Clusters of a mesh's triangles. Each triangle is in one of them; what is in a cluster is connected by shared edges.
#[derive(Clone, Debug, Default)]
pub struct Clusters {
    /// By triangle.
    of_triangle: Vec<u32>,
    /// Where a cluster's triangles start in `order`, and the end of all.
    first: Vec<u32>,
    order: Vec<u32>,
    treelets: Treelets,
    /// The vertices that triangles name are fewer than this.
    vertices: usize,
}

impl Clusters {
    /// Makes clusters of a mesh as it is in the first frame. They are numbered along a curve through space, and do not
    /// depend on the number of threads.
    #[must_use]
    pub fn new(mesh: &MeshView<'_>, config: &ClusterConfig) -> Self {
        let scale = mesh.scale(&mesh.bounds());
        let positions: Cow<'_, [Vec3]> = if scale == 1.0 {
            Cow::Borrowed(mesh.positions)
        } else {
            mesh.positions.par_iter().map(|&p| p * scale).collect()
        };
        let mesh = MeshView { positions: &positions, triangles: mesh.triangles };
        Self::of_lists(&mesh, lists(&mesh, config))
    }

    /// The clusters with these triangles.
    fn of_lists(mesh: &MeshView<'_>, mut lists: Vec<Vec<u32>>) -> Self {
        lists.par_iter_mut().for_each(|list| list.sort_unstable());
        along_curve(mesh, &mut lists);
        let mut clusters = Self { treelets: Treelets::new(mesh, &mut lists), ..Self::default() };
        clusters.of_triangle = vec![0; mesh.triangles.len()];
        clusters.first.push(0);
        for (list, number) in lists.iter().zip(0..) {
            list.iter().for_each(|&triangle| clusters.of_triangle[triangle as usize] = number);
            clusters.order.extend_from_slice(list);
            clusters.first.push(clusters.order.len() as u32);
        }
        clusters.vertices =
            mesh.triangles.par_iter().flatten_iter().max().map_or(0, |&most| most as usize + 1);
        clusters
    }

    /// Number of clusters.
    #[must_use]
    pub fn len(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    /// Whether there is none, as of a mesh without triangles.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The cluster of each triangle.
    #[must_use]
    pub fn of_triangle(&self) -> &[u32] {
        &self.of_triangle
    }

    /// The triangles of a cluster; none of a cluster that does not exist.
    #[must_use]
    pub fn triangles(&self, cluster: u32) -> &[u32] {
        let at = |place: usize| self.first.get(place).map(|&first| first as usize);
        match (at(cluster as usize), at(cluster as usize + 1)) {
            (Some(first), Some(end)) => &self.order[first..end],
            _ => &[],
        }
    }

    /// Memory of the clusters and of what is known beforehand of their part of a tree.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let own = [&self.of_triangle, &self.first, &self.order].map(|list| size_of_val(list.as_slice()));
        own.iter().sum::<usize>() + self.treelets.bytes()
    }
}

/// The triangles of each cluster.
fn lists(mesh: &MeshView<'_>, config: &ClusterConfig) -> Vec<Vec<u32>> {
    let links = connect::links(mesh);
    let acceptable = acceptable(mesh, &links, config);
    let (count, most) = (mesh.triangles.len(), acceptable.len());
    let cluster_of = match config.heuristic {
        Heuristic::Acc => return acceptable,
        Heuristic::Naive => merge_to_count(&Naive { mesh: *mesh }, count, &links, most),
        Heuristic::Error => merge_to_count(&Error::new(*mesh), count, &links, most),
    };
    let mut lists = vec![Vec::new(); cluster_of.iter().max().map_or(0, |&most| most as usize + 1)];
    cluster_of.iter().zip(0..).for_each(|(&cluster, triangle)| lists[cluster as usize].push(triangle));
    lists
}

/// The clusters that are acceptable to [`Heuristic::Acc`].
fn acceptable(mesh: &MeshView<'_>, links: &[connect::Link], config: &ClusterConfig) -> Vec<Vec<u32>> {
    let acc = Acc::new(*mesh, config);
    match config.generator {
        Generator::Merging => {
            merge_acceptable(&acc, mesh, links).into_iter().map(|kept| kept.triangles).collect()
        }
        Generator::Growing => grow::grow(&acc, mesh, links),
    }
}

/// Orders lists by the Morton codes of the centres of their boxes, so that what is near in space is near in memory.
fn along_curve(mesh: &MeshView<'_>, lists: &mut Vec<Vec<u32>>) {
    let center = |list: &Vec<u32>| Aabb::from_points(list.iter().flat_map(|&t| mesh.corners(t))).center();
    let bounds = mesh.bounds();
    let unit = 1023.0 / bounds.size().max_element();
    let unit = if unit.is_finite() { unit } else { 0.0 };
    let code = |list: Vec<u32>| {
        let cell = ((center(&list) - bounds.min) * unit).to_array().map(|x| spread(x as u32));
        (cell[0] | cell[1] << 1 | cell[2] << 2, list.first().copied(), list)
    };
    let mut keyed: Vec<_> = std::mem::take(lists).into_par_iter().map(code).collect();
    keyed.par_sort_unstable_by_key(|&(code, first, _)| (code, first));
    lists.extend(keyed.into_iter().map(|(_, _, list)| list));
}

/// The lowest ten bits, each with two zeros in front.
fn spread(x: u32) -> u32 {
    (0..10).fold(0, |code, bit| code | (x >> bit & 1) << (3 * bit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_have_the_bits_of_three_axes() {
        assert_eq!((spread(0b11), spread(0b1000), spread(1023)), (0b1001, 1 << 9, 0x0924_9249));
    }
}
