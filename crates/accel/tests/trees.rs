//! Every builder's tree, binary and wide, is sound over degenerate input, and the same for any threads and level.

mod common;

use common::{Soup, boxes, inputs};
use rayon::ThreadPoolBuilder;
use vastlight_accel::build::NAMES;
use vastlight_accel::wide::{Block8, Boxes, ChildRef, MeshBvh, TopBvh, validate_nodes};
use vastlight_accel::{
    BinaryTree, BuildConfig, BuildError, Reference, Scratch, Violation, build, quality, validate,
};
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::Level;

fn references(boxes: &[Aabb]) -> Vec<Reference> {
    boxes.iter().zip(0..).map(|(b, i)| Reference::new(b, i)).collect()
}

fn tree(name: &str, boxes: &[Aabb], config: &BuildConfig) -> BinaryTree {
    build(name, &mut references(boxes), None, config, &mut Scratch::default()).expect("built")
}

fn configs() -> Vec<BuildConfig> {
    let base = BuildConfig::default();
    let leaf = |max_leaf| BuildConfig { max_leaf, ..base };
    vec![
        base,
        leaf(1),
        leaf(4),
        BuildConfig { traversal_cost: 0.0, ..base },
        BuildConfig { traversal_cost: 1e9, ..base },
        BuildConfig { optimize: 2, ..base },
    ]
}

#[test]
fn binary_trees_are_sound() {
    for name in NAMES {
        for (input, triangles) in inputs() {
            let boxes = boxes(&triangles);
            for config in configs() {
                let tree = tree(name, &boxes, &config);
                let report = validate(&tree, &boxes, config.max_leaf)
                    .unwrap_or_else(|violation| panic!("{name}, {input}, {config:?}: {violation}"));
                assert_eq!(report.references, boxes.len());
                let depth = quality(&tree).depth;
                assert!(depth <= 96, "{name}, {input}: depth {depth}");
            }
        }
    }
}

#[test]
fn trees_do_not_depend_on_threads_or_level() {
    for name in NAMES {
        for (input, triangles) in inputs() {
            let boxes = boxes(&triangles);
            let mut found = Vec::new();
            for threads in [1, 2, 5] {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                for level in Level::available() {
                    let config = BuildConfig { level, optimize: 1, ..BuildConfig::default() };
                    let tree = pool.install(|| tree(name, &boxes, &config));
                    found.push((tree.nodes, tree.prims));
                }
            }
            assert!(found.windows(2).all(|pair| pair[0] == pair[1]), "{name}, {input}");
        }
    }
}

#[test]
fn wide_trees_are_sound() {
    for name in NAMES {
        for (input, triangles) in inputs() {
            let soup = Soup::new(&triangles);
            let report = soup
                .build(name)
                .validate(&soup.view())
                .unwrap_or_else(|violation| panic!("{name}, {input}: {violation}"));
            // Triangles are cut without being told, within bounds.
            let most = if name == "sbvh" { 3 * triangles.len() } else { 2 * triangles.len() };
            assert!((triangles.len()..=most).contains(&report.references), "{name}, {input}: {report:?}");
        }
    }
}

#[test]
fn trees_over_boxes_are_sound_also_where_boxes_are_infinite_or_empty() {
    let each = inputs().into_iter().flat_map(|input| NAMES.map(|name| (name, input.clone())));
    for (name, (input, triangles)) in each {
        let mut all = boxes(&triangles);
        all.push(Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY });
        all.push(Aabb::EMPTY);
        all.push(Aabb { min: Vec3::splat(-3e38), max: Vec3::splat(3e38) });
        let config = BuildConfig { optimize: 1, ..BuildConfig::default() };
        let top = TopBvh::build(name, &all, |_| 1.0, &config, &mut Scratch::default()).expect("built");
        // The empty box is no leaf: count it as the one that is missing.
        let empty = all.len() - 2;
        let leaf = |i: usize| Some(vec![(i as u32, all[i])]);
        match validate_nodes(&top.nodes, top.root, all.len(), Boxes::Nested, leaf, |_, _| false) {
            Err(Violation::Coverage { prim, times: 0 }) if prim == empty => {}
            other => panic!("{name}, {input}: {other:?}"),
        }
    }
}

#[test]
fn the_cost_of_a_large_tree_is_that_of_a_plain_walk() {
    fn cost(tree: &BinaryTree, i: usize) -> f64 {
        let node = &tree.nodes[i];
        if node.is_leaf() {
            return f64::from(node.count);
        }
        let area = |i: usize| f64::from(tree.nodes[i].bounds.half_area());
        let left = node.left as usize;
        2.0 + [left, left + 1].map(|child| cost(tree, child) * area(child) / area(i)).iter().sum::<f64>()
    }
    let config = BuildConfig { max_leaf: 1, ..BuildConfig::default() };
    let tree = tree("hlbvh2", &boxes(&inputs()[5].1), &config);
    assert!(tree.nodes.len() > 1 << 14, "so many that threads share them");
    let (found, expected) = (quality(&tree).cost, cost(&tree, 0));
    assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
}

#[test]
fn faults_are_found() {
    let triangles = &inputs()[5].1;
    let boxes = boxes(triangles);
    let sound = tree("", &boxes, &BuildConfig::default());
    let broken = |change: &dyn Fn(&mut BinaryTree)| {
        let mut tree = sound.clone();
        change(&mut tree);
        validate(&tree, &boxes, 8).expect_err("a fault")
    };
    assert!(matches!(broken(&|t| t.nodes[5].bounds.max.x -= 0.5), Violation::Box { .. }));
    assert!(matches!(
        broken(&|t| t.prims[3] = t.prims[4]),
        Violation::Box { .. } | Violation::Coverage { .. }
    ));
    assert!(matches!(broken(&|t| t.prims[0] = u32::MAX), Violation::Shape { .. }));
    assert!(matches!(broken(&|t| t.nodes[0].left = 3), Violation::Shape { .. }));
    assert!(matches!(broken(&|t| t.nodes[0].left = 1 << 30), Violation::Shape { .. }));
    assert!(validate(&sound, &boxes, 4).is_err(), "leaves of eight are too large for four");

    let soup = Soup::new(triangles);
    let sound = soup.build("");
    let broken = |change: &dyn Fn(&mut MeshBvh)| {
        let mut bvh = sound.clone();
        change(&mut bvh);
        bvh.validate(&soup.view()).expect_err("a fault")
    };
    assert!(matches!(broken(&|b| b.nodes[1].planes[0][1][0] -= 0.5), Violation::Box { .. }));
    assert!(matches!(broken(&|b| b.nodes[0].children[1] = ChildRef::node(1 << 20)), Violation::Shape { .. }));
    assert!(matches!(broken(&|b| b.nodes[0].children[1] = ChildRef::NONE), Violation::Shape { .. }));
    assert!(matches!(broken(&|b| b.blocks[7].corners[1][2][0] += 1e-3), Violation::Shape { .. }));
    assert!(matches!(broken(&|b| b.blocks[7].prims[0] = Block8::NO_PRIM), Violation::Coverage { .. }));
}

#[test]
fn unknown_builders_are_errors_that_name_the_known() {
    let error = build("quantum", &mut Vec::new(), None, &BuildConfig::default(), &mut Scratch::default())
        .expect_err("unknown");
    assert_eq!(error, BuildError::UnknownBuilder("quantum".into()));
    assert!(error.to_string().contains("binned-sah"), "{error}");
}

#[test]
fn scratch_of_another_build_changes_nothing() {
    let mut scratch = Scratch::default();
    let config = BuildConfig::default();
    for (input, triangles) in inputs().iter().rev().chain(&inputs()) {
        let boxes = boxes(triangles);
        let reused = build("", &mut references(&boxes), None, &config, &mut scratch).expect("built");
        let fresh = tree("", &boxes, &config);
        assert_eq!((reused.nodes, reused.prims), (fresh.nodes, fresh.prims), "{input}");
    }
}

/// Small triangles on a wavy sheet, whose builders by codes need no references.
fn sheet(side: usize) -> Soup {
    let corner = |i: usize, j: usize| {
        let (x, z) = (i as f32 / side as f32, j as f32 / side as f32);
        Vec3::new(x, 0.05 * (7.0 * x).sin() * (5.0 * z).cos(), z)
    };
    let cell = |k: usize| {
        let (i, j) = (k / side, k % side);
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)];
        [[a, b, c], [b, d, c]]
    };
    Soup::new(&(0..side * side).flat_map(cell).collect::<Vec<_>>())
}

#[test]
fn trees_without_references_are_sound_and_the_same_for_any_threads_and_level() {
    let mut soup = sheet(200);
    for name in ["morton", "hlbvh2", "hlbvh2-binned", "binned-sah"] {
        let mut found = Vec::new();
        for threads in [1, 3] {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            for level in Level::available() {
                let config = BuildConfig { level, ..BuildConfig::default() };
                let mut scratch = Scratch::default();
                let build = || MeshBvh::build(name, &soup.view(), &config, &mut scratch).expect("built");
                let (bvh, report) = pool.install(build);
                assert!(
                    report.stages.iter().all(|stage| stage.0 != "references"),
                    "{name}: {:?}",
                    report.stages
                );
                assert_eq!(report.quality.references, soup.triangles.len());
                bvh.validate(&soup.view()).unwrap_or_else(|violation| panic!("{name}: {violation}"));
                found.push((bvh.nodes.to_vec(), bvh.blocks.to_vec()));
            }
        }
        assert!(found.windows(2).all(|pair| pair[0] == pair[1]), "{name}");
        assert!(found[0].1.len() * 5 < soup.triangles.len(), "{name}: {} blocks", found[0].1.len());
        // A vertex far away, which no triangle uses, changes little.
        soup.positions.push(Vec3::splat(1e5));
        let far = soup.build(name);
        soup.positions.pop();
        far.validate(&soup.view()).unwrap_or_else(|violation| panic!("{name}: {violation}"));
        assert!(far.blocks.len() < found[0].1.len() * 11 / 10, "{name}: {} blocks", far.blocks.len());
    }
}
