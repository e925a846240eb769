//! Trees over moving meshes: sound after every update, their hits those of brute force, the same for any threads; and as good as
//! fresh ones, also after many frames.

mod common;
#[path = "common/moving.rs"]
mod moving;
#[path = "common/walk.rs"]
mod walk;

use common::{Soup, inputs, noise, point};
use moving::Moving;
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use vastlight_accel::build::NAMES;
use vastlight_accel::ray::ScaledRay;
use vastlight_accel::update::{DynamicMesh, Method, Region, Stages, UpdateConfig, UpdateError, refit};
use vastlight_accel::wide::{Block8, MeshBvh, MeshView};
use vastlight_accel::{BuildConfig, Scratch};
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::{Level, Portable};
use walk::{MISS, closest_hit, meet};

const METHODS: [Method; 3] = [Method::Refit, Method::Rotate, Method::Clustered];

/// Small relatives of the scenes that are measured.
fn scenes() -> Vec<Moving> {
    vec![
        moving::bodies(12, 8),
        moving::explosion(24, 40),
        moving::waves(40),
        moving::twist(6, 16),
        moving::dust(2000),
    ]
}

/// Frames forwards, backwards, in jumps, and standing still.
fn frames() -> Vec<f32> {
    let forwards = (1..50).map(|f| f as f32);
    let backwards = (1..30).map(|f| 50.0 - 1.5 * f as f32);
    let jumps = (0..24).map(|i| (noise(i, 3) * 120.0).floor());
    forwards.chain(backwards).chain(jumps).chain([7.0, 7.0, 0.0, 1e4]).collect()
}

fn dynamic(name: &str, mesh: &MeshView<'_>) -> DynamicMesh {
    DynamicMesh::new(name, mesh, &BuildConfig::default(), &mut Scratch::default()).expect("built").0
}

/// Compares closest hits of rays at and past the mesh with those of all its triangles; gives the number of hits.
fn compare_hits(bvh: &MeshBvh, mesh: &MeshView<'_>, rays: usize, what: &str) -> usize {
    let all: Vec<Block8> = (0..mesh.triangles.len() as u32)
        .map(|i| Block8::new([(i, mesh.corners(i).map(|p| p * bvh.scale))]))
        .collect();
    let around = Aabb::from_points(mesh.positions.iter().copied());
    let mut hits = 0;
    for i in 0..rays {
        let from = around.center() + point(i, 60) * around.size().max(Vec3::splat(1e-3));
        let triangle = (noise(i, 70) * mesh.triangles.len() as f32) as u32;
        let at = mesh.corners(triangle).iter().sum::<Vec3>() / 3.0;
        let direction = if i % 3 == 0 { point(i, 80) } else { at - from };
        let scaled = ScaledRay::new(from * bvh.scale, direction * bvh.scale);
        let Some(ray) = scaled.and_then(|ray| ray.for_triangles(bvh.extent)) else { continue };
        let mut expected = MISS;
        all.iter().for_each(|block| meet(Portable, block, &ray.1, &mut expected));
        assert_eq!(closest_hit(bvh, &ray), expected, "{what}, ray {i}");
        hits += usize::from(expected != MISS);
    }
    hits
}

#[test]
fn trees_stay_sound_and_their_hits_right() {
    let mut hits = 0;
    for mut scene in scenes() {
        for method in METHODS {
            scene.go_to(0.0);
            let mut mesh = dynamic("", &scene.view());
            for (step, frame) in frames().into_iter().enumerate() {
                scene.go_to(frame);
                let what = format!("{}, {method:?}, step {step}, frame {frame}", scene.name);
                mesh.update(&scene.view(), method, &UpdateConfig::default()).expect("updated");
                let report = mesh.validate(&scene.view()).unwrap_or_else(|v| panic!("{what}: {v}"));
                assert_eq!(report.references, scene.triangles.len(), "{what}");
                if step % 25 == 24 {
                    hits += compare_hits(mesh.bvh(), &scene.view(), 24, &what);
                }
            }
        }
    }
    assert!(hits > 500, "{hits}");
}

#[test]
fn faults_of_a_wide_tree_change_hits() {
    // Negative control: a tree whose boxes are those of an earlier frame loses hits, and is found out.
    let mut scene = moving::bodies(12, 8);
    let old = dynamic("", &scene.view());
    scene.go_to(9.0);
    let mut new = dynamic("", &scene.view());
    new.update(&scene.view(), Method::Refit, &UpdateConfig::default()).expect("updated");
    let mut mixed = new.bvh().clone();
    mixed.nodes = old.bvh().nodes.clone();
    assert!(mixed.validate(&scene.view()).is_err());
    let view = scene.view();
    assert!(std::panic::catch_unwind(|| compare_hits(&mixed, &view, 60, "old boxes")).is_err());
}

#[test]
fn any_input_may_become_any_other() {
    let all: Vec<_> = inputs().into_iter().filter(|(_, triangles)| triangles.len() <= 3000).collect();
    for (from, triangles) in &all {
        let mut soup = Soup::new(triangles);
        let mut mesh = dynamic("", &soup.view());
        for (to, others) in &all {
            for (place, position) in soup.positions.iter_mut().enumerate() {
                let other = others.get(place / 3 % others.len().max(1)).map_or(Vec3::ZERO, |t| t[place % 3]);
                *position = other;
            }
            for method in METHODS {
                let what = format!("{from} to {to}, {method:?}");
                let report = mesh.update(&soup.view(), method, &UpdateConfig::default()).expect("updated");
                let shares = [report.rebuilt, report.migrated, report.rotated, report.collapsed];
                assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)), "{what}: {report:?}");
                mesh.validate(&soup.view()).unwrap_or_else(|violation| panic!("{what}: {violation}"));
            }
        }
    }
}

#[test]
fn threads_and_levels_make_no_difference() {
    for mut scene in [moving::bodies(16, 12), moving::explosion(32, 60)] {
        let mut found = Vec::new();
        for threads in [1, 2, 5] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            for level in Level::available() {
                scene.go_to(0.0);
                let config = BuildConfig { level, ..BuildConfig::default() };
                let new = || DynamicMesh::new("", &scene.view(), &config, &mut Scratch::default());
                let mut mesh = pool.install(new).expect("built").0;
                for frame in 1..30 {
                    scene.go_to(frame as f32);
                    let update = || mesh.update(&scene.view(), Method::Clustered, &UpdateConfig::default());
                    pool.install(update).expect("updated");
                }
                let bvh = mesh.bvh();
                found.push((bvh.nodes.to_vec(), bvh.blocks.to_vec(), bvh.root));
            }
        }
        assert!(found.windows(2).all(|pair| pair[0] == pair[1]), "{}", scene.name);
    }
}

/// Cost of a fresh tree.
fn fresh_cost(mesh: &MeshView<'_>) -> f64 {
    dynamic("", mesh).cost()
}

#[test]
fn quality_does_not_decay_over_many_frames() {
    for mut scene in [moving::bodies(16, 12), moving::explosion(32, 60), moving::twist(6, 24)] {
        scene.go_to(0.0);
        let mut mesh = dynamic("", &scene.view());
        let mut most_bytes = 0;
        for step in 1..=320 {
            // Forwards, backwards, and forwards again.
            let frame = [step, 200 - step, step - 200][(step / 100).clamp(0, 2) as usize];
            scene.go_to(frame as f32);
            mesh.update(&scene.view(), Method::Clustered, &UpdateConfig::default()).expect("updated");
            let bytes = mesh.bytes();
            if step <= 100 {
                most_bytes = most_bytes.max(bytes);
            }
            assert!(
                bytes <= most_bytes * 5 / 4,
                "{}, step {step}: {bytes} bytes after {most_bytes}",
                scene.name
            );
            if step % 40 == 0 {
                let (cost, fresh) = (mesh.cost(), fresh_cost(&scene.view()));
                assert!(cost < 1.25 * fresh, "{}, step {step}: {cost} against {fresh}", scene.name);
                let near = mesh.locality();
                assert!(
                    near > 0.5,
                    "{}, step {step}: {near} of the nodes are near their parents",
                    scene.name
                );
                let (leaves, of_fresh) = (mesh.leaves(), dynamic("", &scene.view()).leaves());
                assert!(
                    (leaves as f64) < 1.18 * of_fresh as f64,
                    "{}, step {step}: {leaves} leaves against {of_fresh}",
                    scene.name
                );
            }
        }
        mesh.validate(&scene.view()).expect("sound");
    }
}

/// The mean cost over some frames, in parts of the fresh tree's.
fn mean_cost(mut scene: Moving, method: Method, config: &UpdateConfig) -> f64 {
    scene.go_to(0.0);
    let mut mesh = dynamic("", &scene.view());
    let (mut sum, mut count) = (0.0, 0);
    for frame in 1..=60 {
        scene.go_to(frame as f32);
        mesh.update(&scene.view(), method, config).expect("updated");
        if frame % 10 == 0 {
            sum += mesh.cost() / fresh_cost(&scene.view());
            count += 1;
        }
    }
    sum / f64::from(count)
}

#[test]
fn every_stage_is_of_use() {
    // Negative controls: without one of the stages trees are worse.
    let config = UpdateConfig::default();
    let stages = config.stages;
    let cost =
        |stages| mean_cost(moving::bodies(24, 12), Method::Clustered, &UpdateConfig { stages, ..config });
    let all = cost(stages);
    assert!(all < 1.15, "{all}");
    for (what, without, factor) in [
        ("rebuild", Stages { rebuild: false, ..stages }, 2.0),
        ("part", Stages { part: false, ..stages }, 5.0),
        ("migrate", Stages { migrate: false, ..stages }, 1.02),
        ("rebuild and migrate", Stages { rebuild: false, migrate: false, ..stages }, 4.0),
    ] {
        let worse = cost(without);
        assert!(worse > factor * all, "without {what}: {worse} against {all}");
    }
    let refitted = mean_cost(moving::bodies(24, 12), Method::Refit, &config);
    let rotated = mean_cost(moving::bodies(24, 12), Method::Rotate, &config);
    assert!(rotated < refitted && all < 0.5 * rotated, "{all} {rotated} {refitted}");
}

#[test]
fn a_still_mesh_is_left_alone() {
    let mut scene = moving::explosion(32, 60);
    scene.go_to(20.0);
    let mut mesh = dynamic("", &scene.view());
    let before = (mesh.bvh().nodes.to_vec(), mesh.bvh().blocks.to_vec());
    let config = UpdateConfig {
        stages: Stages { rotate: false, part: false, ..UpdateConfig::default().stages },
        ..UpdateConfig::default()
    };
    let report = mesh.update(&scene.view(), Method::Clustered, &config).expect("updated");
    assert_eq!([report.rebuilt, report.migrated, report.rotated, report.collapsed], [0.0; 4]);
    assert!((mesh.bvh().nodes.to_vec(), mesh.bvh().blocks.to_vec()) == before);
}

#[test]
fn any_wide_tree_can_be_refitted() {
    let mut hits = 0;
    for mut scene in scenes() {
        for name in NAMES {
            for split_budget in [None, Some(1.0), Some(2.0)] {
                scene.go_to(12.0);
                let config = BuildConfig { split_budget, ..BuildConfig::default() };
                let built = MeshBvh::build(name, &scene.view(), &config, &mut Scratch::default());
                let mut bvh = built.expect("built").0;
                let fresh = bvh.clone();
                scene.go_to(17.0);
                refit(&mut bvh, &scene.view());
                let what = format!("{}, {name}, {split_budget:?}", scene.name);
                bvh.validate(&scene.view()).unwrap_or_else(|violation| panic!("{what}: {violation}"));
                assert!(bvh.blocks[..] != fresh.blocks[..]);
                hits += compare_hits(&bvh, &scene.view(), 6, &what);
                scene.go_to(12.0);
                refit(&mut bvh, &scene.view());
                assert!(bvh.blocks[..] == fresh.blocks[..] && bvh.extent == fresh.extent, "{what}");
            }
        }
    }
    assert!(hits > 200, "{hits}");
}

#[test]
fn refit_of_no_triangles_and_of_one() {
    for count in [0, 1, 8, 9] {
        let soup = Soup::new(&(0..count).map(|i| [1, 5, 9].map(|salt| point(i, salt))).collect::<Vec<_>>());
        let mut bvh = soup.build("");
        let before = bvh.clone();
        refit(&mut bvh, &soup.view());
        assert!(bvh.nodes[..] == before.nodes[..] && bvh.blocks[..] == before.blocks[..]);
        assert_eq!((bvh.bounds, bvh.scale), (before.bounds, before.scale));
    }
}

#[test]
fn deep_trees_are_built_afresh() {
    // Distances that grow so evenly that much of what migrates ends up in one long row.
    let mesh = |center: &dyn Fn(usize) -> Vec3, size: f32| {
        let triangle = |i: usize| [10, 20, 30].map(|salt| center(i) + point(i, salt) * size);
        Soup::new(&(0..100_000).map(triangle).collect::<Vec<_>>())
    };
    let mut tree = dynamic("", &mesh(&|i| point(i, 1), 1.0).view());
    let row = mesh(&|i| Vec3::X * 1.0005_f32.powi(i as i32), 0.1);
    let reports = [0; 3].map(|_| {
        let report = tree.update(&row.view(), Method::Clustered, &UpdateConfig::default()).expect("updated");
        tree.validate(&row.view()).expect("sound");
        (report.depth, report.rebuilt)
    });
    assert!(reports[1].0 > 160 && reports[1].1 == 1.0 && reports[2].0 < 60, "{reports:?}");
}

#[test]
fn another_mesh_is_an_error() {
    let scene = moving::bodies(2, 4);
    let mut mesh = dynamic("", &scene.view());
    let fewer = MeshView { triangles: &scene.triangles[1..], positions: &scene.positions };
    let error = mesh.update(&fewer, Method::Clustered, &UpdateConfig::default()).expect_err("other");
    assert!(matches!(error, UpdateError::OtherMesh { .. }));
    let fewer = MeshView { triangles: &scene.triangles, positions: &scene.positions[1..] };
    assert!(mesh.update(&fewer, Method::Refit, &UpdateConfig::default()).is_err());
    mesh.validate(&scene.view()).expect("as it was");
}

/// A movement: which triangles, whereto, and how the tree follows.
type Edit = (usize, usize, [f32; 3], u32, usize);

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    let offset = [-2.0_f32..2.0, -2.0_f32..2.0, -2.0_f32..2.0];
    let one = (0_usize..400, 1_usize..200, offset, 0_u32..12, 0_usize..6);
    proptest::collection::vec(one, 1..40)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_movements_leave_sound_trees(count in 0_usize..400, edits in edits(), name in 0..NAMES.len(), least in 0_u32..70) {
        let triangles: Vec<_> =
            (0..count).map(|i| [10, 20, 30].map(|salt| point(i, 1) + point(i, salt) * 0.1)).collect();
        let mut soup = Soup::new(&triangles);
        let mut mesh = dynamic(NAMES[name], &soup.view());
        for (step, &(first, length, offset, shrink, how)) in edits.iter().enumerate() {
            let run = (3 * first).min(3 * count)..(3 * (first + length)).min(3 * count);
            for p in &mut soup.positions[run] {
                *p = *p * 0.5_f32.powi(shrink as i32 - 1) + Vec3::from(offset);
            }
            let method = METHODS[how.min(2)];
            let region = if how % 2 == 0 { Region::Leaves } else { Region::Overlap };
            let max_overlap = if how == 4 { 0.0 } else { 0.5 };
            let config = UpdateConfig { least, region, max_overlap, gain: 0.0, ..UpdateConfig::default() };
            mesh.update(&soup.view(), method, &config).expect("updated");
            if let Err(violation) = mesh.validate(&soup.view()) {
                panic!("step {step}: {violation}");
            }
        }
        if count > 0 {
            compare_hits(mesh.bvh(), &soup.view(), 6, "at the end");
        }
    }
}
