//! Trees: a trunk that forks into ever thinner branches, and leaves at the twigs.

use super::chance::Chance;
use super::shape::Shape;
use super::tube::tube_with_radii;
use vastlight_math::{Frame, Vec2, Vec3, real::sin_cos};

/// How a tree grows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Growth {
    /// Height in metres, about.
    pub(super) height: f32,
    /// Times that branches fork.
    pub(super) forks: u32,
    /// Leaves at each twig.
    pub(super) leaves: u32,
    /// Length of a leaf in metres.
    pub(super) leaf: f32,
    /// Sides of a branch.
    pub(super) sides: u32,
}

/// A tree at the origin: wood and leaves, the leaves in shades of one green.
pub(super) fn tree(growth: &Growth, chance: &mut Chance) -> [Shape; 2] {
    let mut parts = [Shape::default(), Shape::default()];
    let trunk = Limb {
        start: Vec3::ZERO,
        direction: Vec3::Y,
        length: growth.height * 0.4,
        radius: growth.height * 0.018,
    };
    grow(&mut parts, growth, &trunk, growth.forks, chance);
    parts
}

struct Limb {
    start: Vec3,
    direction: Vec3,
    length: f32,
    radius: f32,
}

fn grow(parts: &mut [Shape; 2], growth: &Growth, limb: &Limb, forks: u32, chance: &mut Chance) {
    const PIECES: usize = 4;
    let mut path = vec![limb.start];
    let mut direction = limb.direction;
    for _ in 0..PIECES {
        // Branches waver, and turn to the light.
        direction = (direction + chance.direction() * 0.16 + Vec3::Y * 0.12).normalize();
        let last = path[path.len() - 1];
        path.push(last + direction * (limb.length / PIECES as f32));
    }
    let thin = 0.62;
    let radii: Vec<f32> =
        (0..=PIECES).map(|i| limb.radius * (1.0 - (1.0 - thin) * i as f32 / PIECES as f32)).collect();
    let sides = (growth.sides >> (growth.forks - forks).min(1)).max(3);
    parts[0].merge(&tube_with_radii(&path, &radii, sides));
    let tip = path[PIECES];
    if forks <= 1 {
        for &knot in &path[1..] {
            sprig(&mut parts[1], growth, knot, direction, growth.leaves / PIECES as u32, chance);
        }
    }
    if forks == 0 {
        return;
    }
    let frame = Frame::from_z(direction);
    let (count, first) = (2 + chance.below(2), chance.range(0.0, 6.3));
    for child in 0..count {
        let (s, c) = sin_cos(first + child as f32 * std::f32::consts::TAU / count as f32);
        let spread = chance.range(0.35, 0.72);
        let outward = (frame.x * c + frame.y * s) * spread + direction;
        let length = limb.length * chance.range(0.58, 0.8);
        let radius = limb.radius * thin * chance.range(0.66, 0.85);
        let limb = Limb { start: tip, direction: outward.normalize(), length, radius };
        grow(parts, growth, &limb, forks - 1, chance);
    }
}

/// A handful of leaves around a point of a twig.
fn sprig(leaves: &mut Shape, growth: &Growth, at: Vec3, along: Vec3, count: u32, chance: &mut Chance) {
    for _ in 0..count {
        let direction = (chance.direction() + along * 0.5 + Vec3::NEG_Y * 0.15).normalize_or(Vec3::X);
        let size = growth.leaf * chance.range(0.7, 1.2);
        let base = at + direction * (size * 0.3);
        let shade = Vec3::new(0.16, 0.34, 0.07) * chance.range(0.55, 1.15);
        let yellow = Vec3::new(0.12, 0.08, 0.0) * chance.unit();
        leaf(leaves, base, direction, size, shade + yellow, chance);
    }
}

/// A leaf of four triangles, folded a little along its middle.
fn leaf(shape: &mut Shape, base: Vec3, direction: Vec3, size: f32, color: Vec3, chance: &mut Chance) {
    let side = direction.cross(Vec3::Y + chance.direction() * 0.7).normalize_or(Vec3::Z);
    let up = side.cross(direction);
    let middle = base + direction * (size * 0.45);
    let tip = base + direction * size - up * (size * 0.12);
    let first = shape.positions.len();
    for (sign, across) in [(1.0, side), (-1.0, -side)] {
        let edge = middle + across * (size * 0.24) + up * (size * 0.07);
        let normal = (up - across * (0.25 * sign * sign)).normalize();
        let corners = [base, edge, tip, middle].map(|p| shape.vertex(p, normal, Vec2::ZERO));
        let [a, b, c, d] = corners;
        if sign > 0.0 { shape.quad(b, c, d, a) } else { shape.quad(b, a, d, c) }
    }
    shape.colors.resize(first, vastlight_math::Vec4::ONE);
    shape.colors.resize(shape.positions.len(), color.extend(1.0));
}
