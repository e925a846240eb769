//! One process unit of the plant site: what stands where, and the mesh of it all.

use super::pile::Pile;
use super::{Finishes, cables, frame, piping, vessels};
use crate::Mesh;
use crate::generate::chance::Chance;
use vastlight_math::Vec2;

/// From unit to unit in metres.
pub(super) const PITCH: f32 = 16.0;

/// What a unit is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Floors with upright vessels through them.
    Process,
    /// One high column beside a low platform.
    Tower,
    /// A storage tank.
    Tank,
    /// Levels of beams for pipes.
    Rack,
    /// Floors with lying vessels.
    Drums,
}

/// A round footprint that floors and pipes leave free.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hole {
    pub(super) center: Vec2,
    pub(super) radius: f32,
}

/// Measures of a unit around its middle; `Vec2` is (x, z).
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) kind: Kind,
    pub(super) half: Vec2,
    /// Heights of the floors above the ground, upwards.
    pub(super) floors: Vec<f32>,
    /// Whether floors can be walked on.
    pub(super) decked: bool,
    pub(super) holes: Vec<Hole>,
}

impl Plan {
    fn new(chance: &mut Chance) -> Self {
        let kind = match chance.below(12) {
            0..=3 => Kind::Process,
            4 | 5 => Kind::Tower,
            6 => Kind::Tank,
            7..=9 => Kind::Rack,
            _ => Kind::Drums,
        };
        let half = Vec2::new(chance.range(5.5, 6.3), chance.range(5.5, 6.3));
        let (count, step) = match kind {
            Kind::Process => (2 + chance.below(3), [3.9, 5.2]),
            Kind::Tower => (1 + chance.below(2), [4.2, 5.4]),
            Kind::Tank => (0, [0.0, 0.0]),
            Kind::Rack => (2 + chance.below(3), [2.6, 3.4]),
            Kind::Drums => (2 + chance.below(2), [4.2, 5.4]),
        };
        let base = if kind == Kind::Rack { 2.4 } else { 0.0 };
        let mut floors = Vec::new();
        for _ in 0..count {
            floors.push(floors.last().copied().unwrap_or(base) + chance.range(step[0], step[1]));
        }
        let holes = match kind {
            Kind::Process => upright(chance),
            Kind::Tower => vec![Hole { center: Vec2::ZERO, radius: chance.range(1.0, 1.9) }],
            Kind::Tank => vec![Hole { center: Vec2::ZERO, radius: chance.range(4.2, 5.2) }],
            Kind::Rack | Kind::Drums => Vec::new(),
        };
        Self { kind, half, floors, decked: kind != Kind::Rack, holes }
    }

    /// Lines of columns along x (0) or z (1).
    pub(super) fn lines(&self, axis: usize) -> [f32; 3] {
        [-self.half[axis], 0.0, self.half[axis]].map(|at| at * if axis == 0 { 1.0 } else { 0.98 })
    }

    /// Whether something upright stands within `margin` of a place.
    pub(super) fn is_hole(&self, at: Vec2, margin: f32) -> bool {
        self.holes.iter().any(|hole| (at - hole.center).length() < hole.radius + margin)
    }

    /// The pieces of the line at `x` from -end to end (in z) that no hole cuts out.
    pub(super) fn spans(&self, x: f32, end: f32) -> Vec<[f32; 2]> {
        let mut cuts: Vec<[f32; 2]> = self
            .holes
            .iter()
            .filter_map(|hole| {
                let (reach, dx) = (hole.radius + 0.12, x - hole.center.x);
                let half = (reach * reach - dx * dx).max(0.0).sqrt();
                (half > 0.0).then_some([hole.center.y - half, hole.center.y + half])
            })
            .collect();
        cuts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (mut spans, mut low) = (Vec::new(), -end);
        for [from, to] in cuts {
            spans.push([low, from]);
            low = low.max(to);
        }
        spans.push([low, end]);
        spans.retain(|[low, high]| high - low > 0.05);
        spans
    }
}

/// One to three upright vessels that do not touch.
fn upright(chance: &mut Chance) -> Vec<Hole> {
    let mut holes: Vec<Hole> = Vec::new();
    for _ in 0..2 + chance.below(3) {
        let center = Vec2::new(chance.range(-3.4, 3.4), chance.range(-3.4, 3.4));
        let radius = chance.range(0.6, 1.5);
        if holes.iter().all(|h| (h.center - center).length() > h.radius + radius + 0.8) {
            holes.push(Hole { center, radius });
        }
    }
    holes
}

/// A unit around its middle of `triangles` triangles, less a cable at most.
pub(super) fn unit(f: &Finishes, triangles: usize, chance: &Chance) -> Mesh {
    let plan = Plan::new(&mut chance.part(0));
    let mut pile = Pile::default();
    frame::frame(&mut pile, f, &plan, &mut chance.part(1));
    vessels::vessels(&mut pile, f, &plan, &mut chance.part(2));
    piping::piping(&mut pile, f, &plan, triangles - triangles / 14, &chance.part(3));
    cables::cables(&mut pile, f, &plan, triangles, &chance.part(4));
    pile.into_mesh("process unit")
}
