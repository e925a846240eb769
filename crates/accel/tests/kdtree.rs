//! The threaded kd-tree: sound over degenerate input, the same for any threads, and its walks find what brute force
//! finds, bit by bit.

mod common;
#[path = "common/walk.rs"]
mod walk;

use common::{boxes, inputs, noise, point};
use rayon::ThreadPoolBuilder;
use vastlight_accel::kdtree::traverse::KdRay;
use vastlight_accel::kdtree::{Cuts, KdConfig, KdMesh, KdNode, KdTree, KdViolation, build};
use vastlight_accel::ray::{BoxRay, ScaledRay, TriangleRay};
use vastlight_accel::wide::MeshView;
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::Portable;
use walk::{Hit, MISS, meet};

fn configs() -> [KdConfig; 4] {
    let base = KdConfig::default();
    [
        base,
        KdConfig { cuts: Cuts::SurfaceArea, ..base },
        KdConfig { max_leaf: 1, max_growth: 20.0, spare_levels: 20, ..base },
        KdConfig { max_leaf: 0, max_growth: 0.0, spare_levels: 0, cuts: Cuts::SurfaceArea },
    ]
}

/// A mesh of separate triangles.
fn soup(triangles: &[[Vec3; 3]]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    (triangles.iter().flatten().copied().collect(), indices.collect())
}

fn mesh(triangles: &[[Vec3; 3]], config: &KdConfig) -> KdMesh {
    let (positions, triangles) = soup(triangles);
    KdMesh::build(&MeshView { positions: &positions, triangles: &triangles }, config).expect("built")
}

#[test]
fn trees_are_sound_and_their_size_is_bounded() {
    for (input, triangles) in inputs() {
        let boxes = boxes(&triangles);
        for config in configs() {
            let tree = build(&boxes, &config).expect("built");
            let report = tree.validate(&boxes).unwrap_or_else(|v| panic!("{input}, {config:?}: {v}"));
            assert_eq!((report.references, report.levels), (tree.items.len(), tree.levels), "{input}");
            let most = boxes.len() as f32 * config.max_growth.max(1.0);
            assert!(report.references as f32 <= most, "{input}, {config:?}: {}", report.references);
            let halving = (boxes.len() / config.max_leaf.max(1)).max(1).ilog2() + 1;
            assert!(report.levels as u32 <= halving + config.spare_levels, "{input}: {}", report.levels);
            let (positions, indices) = soup(&triangles);
            let view = MeshView { positions: &positions, triangles: &indices };
            let mesh = KdMesh::build(&view, &config).expect("built");
            let of_mesh = mesh.validate(&view).unwrap_or_else(|v| panic!("{input}, {config:?}: {v}"));
            assert_eq!(of_mesh.references, mesh.references, "{input}");
        }
    }
}

#[test]
fn even_triangles_make_a_balanced_tree() {
    let triangles = &inputs()[5].1;
    let report = build(&boxes(triangles), &KdConfig::default()).expect("built").validate(&boxes(triangles));
    let report = report.expect("sound");
    assert!(report.leaves * 2 > triangles.len() / 8 && report.largest_leaf <= 16, "{report:?}");
}

#[test]
fn boxes_that_are_empty_infinite_or_no_numbers_are_survived() {
    for (input, triangles) in inputs() {
        let mut boxes = boxes(&triangles);
        boxes.push(Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY });
        boxes.push(Aabb::EMPTY);
        boxes.push(Aabb { min: Vec3::splat(-3e38), max: Vec3::splat(3e38) });
        boxes.push(Aabb { min: Vec3::NAN, max: Vec3::NAN });
        for config in configs() {
            let tree = build(&boxes, &config).expect("built");
            tree.validate(&boxes).unwrap_or_else(|v| panic!("{input}, {config:?}: {v}"));
        }
    }
}

#[test]
fn trees_do_not_depend_on_threads() {
    for config in &configs()[..2] {
        for (input, triangles) in inputs() {
            let boxes = boxes(&triangles);
            let built = [1, 2, 5].map(|threads| {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                let tree = pool.install(|| build(&boxes, config)).expect("built");
                (tree.nodes, tree.items)
            });
            assert!(built[0] == built[1] && built[1] == built[2], "{input}");
        }
    }
}

#[test]
fn faults_are_found() {
    let boxes = boxes(&inputs()[5].1);
    let sound = build(&boxes, &KdConfig::default()).expect("built");
    let broken = |change: &dyn Fn(&mut KdTree)| {
        let mut tree = sound.clone();
        change(&mut tree);
        tree.validate(&boxes).expect_err("a fault")
    };
    let leaf = sound.nodes.iter().position(KdNode::is_leaf).expect("a leaf");
    assert!(matches!(broken(&|t| t.nodes[3].next[5] = 0), KdViolation::Thread { octant: 5, .. }));
    assert!(matches!(broken(&|t| t.nodes[leaf].next[2] ^= 1), KdViolation::Thread { octant: 2, .. }));
    assert!(matches!(broken(&|t| t.nodes[leaf].cut_or_count -= 1), KdViolation::Coverage { .. }));
    assert!(matches!(broken(&|t| t.items[3] = t.items[4]), KdViolation::Coverage { .. }));
    assert!(matches!(broken(&|t| t.nodes[9].bounds.max.x += 1.0), KdViolation::Bounds { .. }));
    assert!(matches!(broken(&|t| t.nodes[0].link = 0), KdViolation::Shape { .. }));
    assert!(matches!(broken(&|t| t.nodes[0].cut_or_count = f32::NAN.to_bits()), KdViolation::Shape { .. }));
    let moved = |t: &mut KdTree| t.nodes[0].cut_or_count = (t.nodes[0].cut() + 0.01).to_bits();
    assert!(matches!(broken(&moved), KdViolation::Bounds { .. }));
    assert!(matches!(KdTree::default().validate(&boxes), Err(KdViolation::Coverage { .. })));
}

/// By threads or with a stack; also counts the leaves on the way.
fn walk(mesh: &KdMesh, (boxes, ray): &(BoxRay, TriangleRay), stacked: bool, leaves: &mut usize) -> Hit {
    let kd_ray = KdRay::new(boxes, 0.0);
    let (mut best, mut stack) = (MISS, Vec::new());
    let mut next = if stacked {
        kd_ray.first_stacked(&mesh.nodes, best.0, &mut stack)
    } else {
        kd_ray.first(&mesh.nodes, best.0)
    };
    while let Some((leaf, span)) = next {
        *leaves += 1;
        mesh.blocks[mesh.nodes[leaf].items()].iter().for_each(|block| meet(Portable, block, ray, &mut best));
        if best.0 < span.safe {
            break;
        }
        next = if stacked {
            kd_ray.after_stacked(&mesh.nodes, best.0, &mut stack)
        } else {
            kd_ray.after(&mesh.nodes, leaf, best.0)
        };
    }
    best
}

/// Rays from everywhere at points of triangles, along axes, from inside, and from corners.
fn rays(triangles: &[[Vec3; 3]], count: usize) -> Vec<(Vec3, Vec3)> {
    let around = Aabb::from_points(triangles.iter().flatten().copied());
    let (center, size) = (around.center(), around.size().max(Vec3::splat(around.size().max_element() * 0.1)));
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
    let ray = |i: usize| {
        let t = triangles[(noise(i, 70) * triangles.len() as f32) as usize % triangles.len()];
        let (u, v) = (noise(i, 71) * 0.5, noise(i, 72) * 0.5);
        let target = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v;
        let far = center + point(i, 73) * size * 2.0;
        match i % 6 {
            0 => (center + point(i, 74) * size * 0.5, target - center - point(i, 74) * size * 0.5),
            1 => {
                let axis = axes[i / 6 % 6];
                (target - axis * size.max_element() * 2.0, axis)
            }
            2 => (t[0] - (t[1] - t[0]) * 2.0, t[1] - t[0]),
            3 => (far, t[i / 6 % 3] - far),
            4 => (far, point(i, 75)),
            _ => (far, target - far),
        }
    };
    (0..count).map(ray).collect()
}

#[test]
fn walks_find_what_brute_force_finds() {
    let mut hits = 0;
    for (input, triangles) in inputs() {
        if triangles.is_empty() {
            assert!(mesh(&triangles, &KdConfig::default()).nodes.is_empty());
            continue;
        }
        let count = (300_000 / triangles.len()).clamp(36, 360);
        for config in configs() {
            let mesh = mesh(&triangles, &config);
            for (origin, direction) in rays(&triangles, count) {
                let scaled = ScaledRay::new(origin * mesh.scale, direction * mesh.scale);
                let Some(ray) = scaled.and_then(|ray| ray.for_triangles(mesh.extent)) else { continue };
                let mut expected = MISS;
                mesh.blocks.iter().for_each(|block| meet(Portable, block, &ray.1, &mut expected));
                let (mut threaded, mut stacked) = (0, 0);
                assert_eq!(walk(&mesh, &ray, false, &mut threaded), expected, "{input}, {config:?}");
                assert_eq!(walk(&mesh, &ray, true, &mut stacked), expected, "{input}, {config:?}, stack");
                assert!(threaded <= stacked, "{input}: threads see bounds, which are tighter than cuts");
                hits += usize::from(expected != MISS);
            }
        }
    }
    assert!(hits > 2000, "{hits}");
}

#[test]
fn walks_end_at_the_closest_hit() {
    let triangles = &inputs()[5].1;
    let mesh = mesh(triangles, &KdConfig::default());
    let leaves = mesh.nodes.iter().filter(|n| n.is_leaf()).count();
    let mut visited = 0;
    let rays = rays(triangles, 600);
    for &(origin, direction) in &rays {
        let ray = ScaledRay::new(origin, direction).and_then(|r| r.for_triangles(mesh.extent)).expect("fine");
        walk(&mesh, &ray, false, &mut visited);
    }
    assert!(visited < rays.len() * 60 && leaves > 3000, "{visited} leaves of {leaves} for {}", rays.len());
}

#[test]
fn a_walk_that_trusts_any_hit_is_found_out() {
    // Negative control: ending at the first hit, wherever it lies, gives other answers than brute force.
    let triangles = &inputs()[6].1;
    let mesh = mesh(triangles, &KdConfig { max_growth: 16.0, ..KdConfig::default() });
    let wrong = rays(triangles, 300).iter().any(|&(origin, direction)| {
        let ray = ScaledRay::new(origin, direction).and_then(|r| r.for_triangles(mesh.extent)).expect("fine");
        let kd_ray = KdRay::new(&ray.0, 0.0);
        let (mut hasty, mut expected) = (MISS, MISS);
        mesh.blocks.iter().for_each(|block| meet(Portable, block, &ray.1, &mut expected));
        let mut next = kd_ray.first(&mesh.nodes, f32::INFINITY);
        while let (Some((leaf, _)), MISS) = (next, hasty) {
            mesh.blocks[mesh.nodes[leaf].items()]
                .iter()
                .for_each(|block| meet(Portable, block, &ray.1, &mut hasty));
            next = kd_ray.after(&mesh.nodes, leaf, f32::INFINITY);
        }
        hasty != expected
    });
    assert!(wrong);
}
