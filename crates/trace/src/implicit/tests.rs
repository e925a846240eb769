//! Crossings against marching in tiny steps.

use super::*;
use vastlight_math::Vec3;
use vastlight_scene::{Julia, Metaball, Metaballs};

/// Numbers in [-1, 1), the same each time.
struct Random(u64);

impl Random {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }
}

fn metaballs(count: usize, seed: u64) -> ImplicitShape {
    let mut random = Random(seed);
    let ball = |i: usize| Metaball {
        center: random.vector().as_vec3(),
        radius: (0.7 + 0.3 * random.number()) as f32,
        strength: if i % 4 == 3 { -0.5 } else { 1.0 },
    };
    ImplicitShape::Metaballs(Metaballs { balls: (0..count).map(ball).collect(), threshold: 0.3 })
}

fn julia(iterations: u32) -> ImplicitShape {
    ImplicitShape::Julia(Julia { c: [-0.2, 0.6, 0.2, 0.2], slice: 0.0, iterations })
}

/// All crossings of a line.
fn crossings(shape: &ImplicitShape, line: &Line) -> Vec<f64> {
    let mut found = Vec::new();
    let mut visit = |s| {
        found.push(s);
        ControlFlow::Continue(())
    };
    let all = match shape {
        ImplicitShape::Metaballs(shape) => {
            metaballs::cross(shape, line, &mut metaballs::Scratch::default(), &mut visit)
        }
        ImplicitShape::Julia(shape) => julia::cross(shape, line, &mut visit),
    };
    assert_eq!(all, ControlFlow::Continue(()));
    found
}

/// Brackets of the crossings that steps of this length see.
fn marched(shape: &ImplicitShape, line: &Line, step: f64) -> Vec<(f64, f64)> {
    let inside = |s: f64| shape.field(line.at(s)).0 >= 0.0;
    let (mut found, mut from, mut was) = (Vec::new(), line.from, inside(line.from));
    while from < line.to {
        let to = (from + step).min(line.to);
        let is = inside(to);
        if is != was {
            found.push((from, to));
        }
        (from, was) = (to, is);
    }
    found
}

/// Lines through the shape's neighbourhood; every other one grazes: it goes along the surface beside a point of it.
fn lines(shape: &ImplicitShape, count: usize, seed: u64) -> Vec<Line> {
    let mut random = Random(seed);
    let mut lines = Vec::new();
    while lines.len() < count {
        let (origin, target) = (random.vector() * 2.5, random.vector());
        let direction = (target - origin).normalize();
        let line = Line { origin, direction, from: 0.0, to: 6.0 };
        lines.push(line);
        let Some(&(s, _)) = marched(shape, &line, 1e-2).first() else { continue };
        let beside = shape.project(line.at(s));
        let along = beside.normal.cross(random.vector()).normalize();
        let lift = beside.normal.normalize() * (random.number() * 1e-4);
        let origin = beside.position + lift - along * 3.0;
        lines.push(Line { origin, direction: along, from: 0.0, to: 6.0 });
    }
    lines
}

/// Compares crossings with marching: every crossing that steps see is there, and there is none where the sign does not
/// change.
fn check(shape: &ImplicitShape, count: usize, step: f64) -> usize {
    let mut total = 0;
    for line in lines(shape, count, 5) {
        let (found, seen) = (crossings(shape, &line), marched(shape, &line, step));
        let starts_inside = shape.field(line.origin).0 >= 0.0;
        assert!(found.is_sorted() && (found.len() % 2 == 1) == starts_inside, "{line:?}: {found:?}");
        assert!(found.len() >= seen.len(), "{line:?}: {found:?} but {seen:?}");
        for &(from, to) in &seen {
            let within = found.iter().filter(|&&s| s >= from - 1e-9 && s <= to + 1e-9).count();
            assert!(within % 2 == 1, "{line:?}: {within} crossings in {from} to {to}");
        }
        for &s in &found {
            let inside = |s: f64| shape.field(line.at(s)).0 >= 0.0;
            assert_ne!(inside(s - 2e-9), inside(s + 2e-9), "{line:?}: nothing changes at {s}");
        }
        total += found.len();
    }
    total
}

#[test]
fn no_crossing_of_metaballs_is_missed() {
    for (count, seed) in [(1, 1), (3, 2), (12, 3), (40, 4)] {
        assert!(check(&metaballs(count, seed), 300, 1e-3) > 20, "{count}");
    }
}

#[test]
fn no_crossing_of_julia_sets_is_missed() {
    for iterations in [1, 4, 8, 11] {
        assert!(check(&julia(iterations), 120, 1e-3) > 120, "{iterations}");
    }
}

#[test]
fn marching_sees_what_is_wrong() {
    // The negative control: crossings of a neighbouring shape are not where this one changes.
    let (right, wrong) = (julia(8), julia(9));
    let wrong_somewhere = lines(&right, 60, 5).iter().any(|line| {
        let found = crossings(&wrong, line);
        let inside = |s: f64| right.field(line.at(s)).0 >= 0.0;
        found.iter().any(|&s| inside(s - 2e-9) == inside(s + 2e-9))
    });
    assert!(wrong_somewhere);
}

#[test]
fn from_the_inside_there_is_always_a_way_out() {
    let mut random = Random(11);
    for shape in [metaballs(12, 3), julia(9)] {
        let mut count = 0;
        for _ in 0..4000 {
            let origin = random.vector();
            if shape.field(origin).0 <= 0.0 {
                continue;
            }
            let line = Line { origin, direction: random.vector().normalize(), from: 0.0, to: 9.0 };
            assert!(crossings(&shape, &line).len() % 2 == 1, "{line:?}");
            count += 1;
        }
        assert!(count > 50);
    }
}

#[test]
fn a_ball_is_a_sphere() {
    let ball = Metaball { center: Vec3::new(1.0, 2.0, 3.0), radius: 2.0, strength: 1.0 };
    let shape = ImplicitShape::Metaballs(Metaballs { balls: vec![ball], threshold: 0.125 });
    let radius = (4.0_f64 * 0.5).sqrt();
    let line = Line { origin: DVec3::new(-5.0, 2.5, 3.0), direction: DVec3::X, from: 0.0, to: 99.0 };
    let half = (radius * radius - 0.25).sqrt();
    let found = crossings(&shape, &line);
    assert!((found[0] - (6.0 - half)).abs() < 1e-9 && (found[1] - (6.0 + half)).abs() < 1e-9, "{found:?}");
}
