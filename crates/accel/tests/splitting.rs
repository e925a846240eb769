//! Trees whose primitives are cut into parts: the parts cover, and the budget is a bound.

use proptest::prelude::*;
use vastlight_accel::build::{NAMES, clip_triangle, presplit};
use vastlight_accel::wide::{MeshBvh, MeshView};
use vastlight_accel::{BuildConfig, Clip, Reference, Scratch, Violation, build, validate_parts};
use vastlight_math::{Aabb, Vec3};

/// Separate triangles.
struct Soup(Vec<[Vec3; 3]>);

impl Clip for Soup {
    fn clip(&self, prim: u32, bounds: &Aabb) -> Aabb {
        clip_triangle(self.0[prim as usize], bounds)
    }
}

impl Soup {
    fn boxes(&self) -> Vec<Aabb> {
        self.0.iter().map(|t| Aabb::from_points(*t)).collect()
    }

    fn references(&self) -> Vec<Reference> {
        self.boxes().iter().zip(0..).map(|(b, i)| Reference::new(b, i)).collect()
    }

    /// Whether points of a triangle are each in one of the boxes.
    fn covered(&self, prim: u32, boxes: &[Aabb]) -> bool {
        let [a, b, c] = self.0[prim as usize].map(Vec3::as_dvec3);
        let point = |i: u32| {
            let (u, v) = (f64::from(i % 20) / 19.0, f64::from(i / 20) / 19.0);
            a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v)
        };
        let slack = 1e-12 * a.abs().max(b.abs()).max(c.abs()).max_element();
        let inside = |p: vastlight_math::glam::DVec3| {
            boxes.iter().any(|b| {
                (p - b.min.as_dvec3()).min_element() >= -slack
                    && (b.max.as_dvec3() - p).min_element() >= -slack
            })
        };
        (0..400).map(point).all(inside)
    }
}

fn triangles(most: usize) -> impl Strategy<Value = Vec<[Vec3; 3]>> {
    let point = || [-1.0_f32..1.0, -1.0_f32..1.0, -1.0_f32..1.0].prop_map(Vec3::from);
    // From needles to large triangles, from points to coincident ones.
    let one = (point(), point(), point(), -24_i32..1)
        .prop_map(|(a, b, c, e)| [a, b, a + (c - a) * 2.0_f32.powi(e)]);
    proptest::collection::vec(one, 0..most)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_budget_is_a_bound_and_parts_cover(
            triangles in triangles(120), budget in 0.0_f32..6.0, keep in prop_oneof![Just(0.55_f32), Just(f32::INFINITY)],
        ) {
        let soup = Soup(triangles);
        let mut references = soup.references();
        let most = (soup.0.len() as f32 * budget.max(1.0)) as usize;
        presplit(&mut references, &soup, most, keep);
        prop_assert!(references.len() <= most.max(soup.0.len()));
        for prim in 0..soup.0.len() as u32 {
            let boxes: Vec<Aabb> =
                references.iter().filter(|r| r.prim() == prim).map(Reference::bounds).collect();
            prop_assert!(soup.covered(prim, &boxes), "{prim}");
        }
    }

    #[test]
    fn trees_of_parts_are_sound(triangles in triangles(200), budget in 0.0_f32..6.0, max_leaf in 1_u32..9) {
        let soup = Soup(triangles);
        let config = BuildConfig { split_budget: Some(budget), max_leaf, ..BuildConfig::default() };
        for name in NAMES {
            let mut references = soup.references();
            let tree = build(name, &mut references, Some(&soup), &config, &mut Scratch::default()).expect("built");
            let covered = |prim: u32, boxes: &[Aabb]| soup.covered(prim, boxes);
            let report = validate_parts(&tree, &soup.boxes(), max_leaf, covered);
            prop_assert!(report.is_ok(), "{name}: {report:?}");
            prop_assert!(tree.prims.len() as f32 <= (soup.0.len() as f32 * budget.max(1.0)), "{name}");
        }
    }
}

/// Needles in all directions.
fn needles(count: usize) -> Vec<[Vec3; 3]> {
    let noise = |i: usize| (i as f32 * 12.9898).sin() * 43_758.547 % 1.0;
    let point = |i: usize| Vec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2));
    (0..count).map(|i| [point(2 * i), point(2 * i + 1), point(2 * i) + Vec3::splat(1e-3)]).collect()
}

#[test]
fn wide_trees_of_parts_are_sound() {
    let triangles = needles(5000);
    let positions: Vec<Vec3> = triangles.iter().flatten().copied().collect();
    let indices: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = MeshView { positions: &positions, triangles: &indices };
    let config = BuildConfig { split_budget: Some(2.0), ..BuildConfig::default() };
    for name in NAMES {
        let (bvh, built) = MeshBvh::build(name, &mesh, &config, &mut Scratch::default()).expect("built");
        let report = bvh.validate(&mesh).unwrap_or_else(|violation| panic!("{name}: {violation}"));
        assert!((5001..=10_000).contains(&built.quality.references), "{name}: {built:?}");
        assert!(report.references > 5000, "{name}: {report:?}");
    }
}

#[test]
fn a_lost_part_is_found() {
    let soup = Soup(needles(50));
    let mut references = soup.references();
    presplit(&mut references, &soup, 200, f32::INFINITY);
    assert!(references.len() > 150);
    references.pop();
    let config = BuildConfig { split_budget: Some(1.0), max_leaf: 1, ..BuildConfig::default() };
    let tree = build("", &mut references, None, &config, &mut Scratch::default()).expect("built");
    let found = validate_parts(&tree, &soup.boxes(), 1, |prim, boxes| soup.covered(prim, boxes));
    assert!(matches!(found, Err(Violation::Coverage { .. } | Violation::Box { .. })), "{found:?}");
}
