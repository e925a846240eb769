//! Where caustics come from: boxes around the surfaces that send light on in narrow lobes.
//!
//! The space is cut between boxes until there are enough parts; each surface point belongs to one. Boxes of instances are all
//! that is known, so that it does not matter whether meshes are in memory, in pages, or have no triangles at all.

use crate::material::MaterialTable;
use rayon::prelude::*;
use std::collections::BinaryHeap;
use vastlight_math::{Aabb, Vec3};
use vastlight_scene::{Mesh, Scene};

/// Boxes at most.
const MOST: usize = 64;

/// Part of its longest edge that a box is wider on each side, so that flat ones have an inside.
const MARGIN: f32 = 1e-3;

/// A part of the space, and what of it may hold caustic-making surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cell {
    /// The part: from `min` on, up to before `max`. All parts together are the space.
    region: Aabb,
    /// Around the surfaces in it, and a little more.
    pub(crate) bounds: Aabb,
}

impl Cell {
    /// Whether a point belongs to the cell.
    pub(crate) fn has(&self, p: Vec3) -> bool {
        p.cmpge(self.region.min).all() && p.cmplt(self.region.max).all()
    }
}

/// The cells of a scene; none where nothing makes caustics.
pub(crate) fn cells(scene: &Scene, materials: &MaterialTable<'_>) -> Vec<Cell> {
    let boxes = boxes(scene, materials);
    if boxes.is_empty() {
        return Vec::new();
    }
    let everywhere = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
    let mut waiting = BinaryHeap::from([Piece::new(everywhere, boxes, 0)]);
    let (mut whole, mut count) = (Vec::new(), 1);
    while waiting.len() + whole.len() < MOST {
        let Some(piece) = waiting.pop() else { break };
        if piece.boxes.len() == 1 {
            whole.push(piece);
        } else {
            waiting.extend(piece.cut(&mut count));
        }
    }
    let mut cells: Vec<Piece> = waiting.into_iter().chain(whole).collect();
    cells.sort_unstable_by_key(|piece| piece.number);
    cells.iter().map(|piece| Cell { region: piece.region, bounds: widened(piece.bounds) }).collect()
}

/// Those of the instances with a material that may send light on in a narrow lobe.
fn boxes(scene: &Scene, materials: &MaterialTable<'_>) -> Vec<Aabb> {
    let focuses: Vec<bool> = (0..scene.materials().len() as u32).map(|m| materials.may_focus(m)).collect();
    let of_mesh = |mesh: &Mesh| match mesh.parts.as_slice() {
        [] => focuses[0],
        parts => parts.iter().any(|part| focuses[part.material as usize]),
    };
    let meshes: Vec<bool> = scene.meshes().iter().map(of_mesh).collect();
    let instances = scene.instances();
    let chosen = (0..instances.len()).into_par_iter().filter(|&i| meshes[instances.mesh(i) as usize]);
    let bounds =
        chosen.map(|i| scene.extents()[instances.mesh(i) as usize].bounds.transformed(instances.map(i)));
    bounds.filter(|bounds| !bounds.is_empty()).collect()
}

fn widened(bounds: Aabb) -> Aabb {
    let size = bounds.size().max_element();
    let far = bounds.min.abs().max(bounds.max.abs()).max_element();
    let margin = Vec3::splat((MARGIN * size).max(8.0 * f32::EPSILON * far));
    Aabb { min: bounds.min - margin, max: bounds.max + margin }
}

/// A cell that may still be cut.
struct Piece {
    region: Aabb,
    bounds: Aabb,
    boxes: Vec<Aabb>,
    number: u32,
}

impl Piece {
    fn new(region: Aabb, boxes: Vec<Aabb>, number: u32) -> Self {
        let bounds = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
        Self { region, bounds, boxes, number }
    }

    /// Both halves, or the one that holds anything.
    fn cut(self, count: &mut u32) -> impl Iterator<Item = Self> + use<> {
        let axis = self.bounds.longest_axis();
        let at = self.bounds.center()[axis];
        let (mut low, mut high) = (self.region, self.region);
        (low.max[axis], high.min[axis]) = (at, at);
        let first = *count;
        *count += 2;
        [low, high].into_iter().zip(first..).filter_map(move |(region, number)| {
            let cut = self.boxes.iter().map(|b| b.intersection(region));
            let boxes: Vec<Aabb> = cut.filter(|b| !b.is_empty()).collect();
            (!boxes.is_empty()).then(|| Self::new(region, boxes, number))
        })
    }
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let by_size = self.bounds.half_area().total_cmp(&other.bounds.half_area());
        by_size.then(other.number.cmp(&self.number))
    }
}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Piece {}
