//! Trees built on the software adapter against those of the CPU's builders: the same to the last node, over sizes around those of
//! workgroups and adversarial boxes, in poisoned buffers.

use crate::common::software;
use crate::trace::{alone, closest as closest_hits, rays, same, sheet, soup, tracer};
use std::collections::BTreeMap;
use vastlight_accel::wide::{Block8, Boxes, MeshBvh, MeshView, Node8, validate_nodes};
use vastlight_accel::{
    BinaryTree, BuildConfig, ClusterConfig, Clusters, Node, Reference, Report, Scratch, Violation, validate,
};
use vastlight_gpu::build::boxes::{box_words, boxes};
use vastlight_gpu::build::clusters::{DeviceClusters, cluster_boxes};
use vastlight_gpu::build::codes::{Rounding, codes};
use vastlight_gpu::build::hlbvh2;
use vastlight_gpu::build::regions::{self, CellTree};
use vastlight_gpu::build::wide::{self, Wide};
use vastlight_gpu::build::{Builder, Count, DeviceTree, record, record_refit, tree_of_words};
use vastlight_gpu::trace::DeviceTracer;
use vastlight_gpu::{Executor, GpuError, Recording, Results, build};
use vastlight_math::rng::{hash_words, unit_f32};
use vastlight_math::{Aabb, Ray, Vec3};
use vastlight_scene::Scene;
use vastlight_trace::{AcceptAll, Hit, Layout, Tracer, TracerConfig};

/// Nothing, one, and around multiples of a leaf, a workgroup, a tile and a level of boxes.
const SIZES: [usize; 17] = [0, 1, 2, 7, 8, 9, 16, 17, 255, 256, 257, 2047, 2048, 2049, 8193, 33_000, 100_003];

/// Numbers in [0, 1).
fn noise(i: usize, salt: u32) -> f32 {
    unit_f32((hash_words(&[i as u32, salt]) >> 32) as u32)
}

fn point(i: usize, salt: u32) -> Vec3 {
    Vec3::new(noise(i, salt), noise(i, salt + 1), noise(i, salt + 2)) * 2.0 - 1.0
}

/// `n` boxes of this size.
fn many(n: usize, size: f32) -> Vec<Aabb> {
    let around = |i| Aabb::from_points([point(i, 1), point(i, 1) + point(i, 5) * size]);
    (0..n).map(around).collect()
}

/// Boxes that are hard in one way each.
fn adversarial() -> Vec<(&'static str, Vec<Aabb>)> {
    let scaled = |boxes: Vec<Aabb>, by: Vec3| -> Vec<Aabb> {
        boxes.into_iter().map(|b| Aabb { min: b.min * by, max: b.max * by }).collect()
    };
    let mut one_huge = many(3000, 1e-3);
    one_huge.push(Aabb { min: Vec3::splat(-1e6), max: Vec3::splat(1.1e6) });
    let grown = |i: usize| Aabb { min: Vec3::splat(-(i as f32)), max: Vec3::splat(i as f32) };
    let far = |i: usize| Aabb::point(Vec3::X * 2.0_f32.powi(i as i32 / 2 - 60));
    let crowded = |i: usize| point(i, 3) * point(i, 3).length_squared().powi(3);
    let mut broken = many(900, 0.1);
    broken[3] = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
    broken[500] = Aabb { min: Vec3::NAN, max: Vec3::NAN };
    broken[700] = Aabb::EMPTY;
    vec![
        ("all equal", vec![grown(1); 5000]),
        ("equal centres", (0..777).map(grown).collect()),
        ("two places", (0..999).map(|i| Aabb::point(Vec3::splat((i % 2) as f32))).collect()),
        ("few places", (0..3000).map(|i| Aabb::point((point(i, 3) * 2.0).round())).collect()),
        ("one huge", one_huge),
        ("flat", scaled(many(3000, 0.1), Vec3::new(1.0, 0.0, 1.0))),
        ("line", scaled(many(3000, 0.1), Vec3::X)),
        ("crowded", (0..5000).map(|i| Aabb::point(crowded(i))).collect()),
        ("doubling", (0..200).map(far).collect()),
        ("tiny", scaled(many(2000, 0.1), Vec3::splat(1e-30))),
        ("large", scaled(many(2000, 0.1), Vec3::splat(1e36))),
        ("not finite", broken),
    ]
}

fn cases() -> Vec<(String, Vec<Aabb>)> {
    let sizes = SIZES.map(|n| (format!("{n} boxes"), many(n, 0.05)));
    let hard = adversarial().into_iter().map(|(name, boxes)| (name.to_owned(), boxes));
    sizes.into_iter().chain(hard).collect()
}

fn words(boxes: &[Aabb]) -> Vec<u32> {
    boxes.iter().flat_map(box_words).collect()
}

/// What a recording of a tree brings back.
struct Downloads([vastlight_gpu::Download; 3]);

impl Downloads {
    fn new(recording: &mut Recording, tree: &DeviceTree) -> Self {
        let words = build::NODE_WORDS * u64::from(tree.most_nodes());
        let nodes = recording.download(tree.nodes, words);
        Self([nodes, recording.download(tree.pairs, 1), recording.download(tree.order, tree.count.into())])
    }

    fn tree(&self, results: &Results) -> BinaryTree {
        let [nodes, pairs, order] = self.0.map(|download| results.words(download));
        tree_of_words(&nodes, pairs[0], order)
    }
}

/// The tree that the device builds.
fn built(executor: &mut Executor, builder: Builder, boxes: &[Aabb], leaf: u32) -> BinaryTree {
    let mut recording = Recording::new();
    let input = recording.upload("boxes", &words(boxes));
    let count = boxes.len() as u32;
    let tree = record(&mut recording, builder, input, (count, leaf), &mut Vec::new()).expect("few");
    let downloads = Downloads::new(&mut recording, &tree);
    downloads.tree(&executor.run(&recording).expect("runs"))
}

/// The tree that the CPU builds.
fn expected(name: &str, boxes: &[Aabb], max_leaf: u32) -> BinaryTree {
    let name = match name {
        "hlbvh2" => {
            let (extents, codes) = codes(boxes, Rounding::Nearest);
            return over_cells(boxes, hlbvh2::top(extents, &codes), (&codes, 15), max_leaf as usize);
        }
        "grid-sah" => {
            let (extents, codes) = codes(boxes, Rounding::Cut);
            let tree = regions::tree(extents, &codes, 0, max_leaf);
            return over_cells(boxes, tree, (&codes, 0), max_leaf as usize);
        }
        "morton-queues" => "morton",
        same => same,
    };
    of_cpu(name, boxes, max_leaf)
}

/// The tree of the builder of this name.
fn of_cpu(name: &str, boxes: &[Aabb], max_leaf: u32) -> BinaryTree {
    let mut references: Vec<Reference> = boxes.iter().zip(0..).map(|(b, i)| Reference::new(b, i)).collect();
    let config = BuildConfig { max_leaf, ..BuildConfig::default() };
    vastlight_accel::build(name, &mut references, None, &config, &mut Scratch::default()).expect("built")
}

/// The tree whose upper part is over cells, the codes but for some lower bits, by the CPU.
fn over_cells(boxes: &[Aabb], upper: CellTree, (codes, bits): (&[u32], u32), leaf: usize) -> BinaryTree {
    let mut sorted: Vec<(u32, u32)> = codes.iter().copied().zip(0..).collect();
    sorted.sort_unstable();
    let mut placed = Vec::new();
    let mut middles: BTreeMap<(usize, usize), usize> =
        upper.splits.iter().map(|s| ((s[0] as usize, s[1] as usize), s[2] as usize)).collect();
    for (cell, held) in upper.cells {
        let start = sorted.partition_point(|(code, _)| code >> bits < cell);
        placed.extend(&sorted[start..start + held as usize]);
        split(&placed, (placed.len() - held as usize, placed.len()), leaf, &mut middles);
    }
    let mut tree = BinaryTree { nodes: Vec::new(), prims: placed.iter().map(|pair| pair.1).collect() };
    if !boxes.is_empty() {
        let root = Node { bounds: Aabb::EMPTY, left: 0, first: 0, count: boxes.len() as u32 };
        tree.nodes.push(root);
        number(&mut tree, 0, &middles);
    }
    refitted(&tree, &seen(boxes))
}

/// A tree's elements with those of each leaf in the order of their numbers.
fn sorted_leaves(tree: &BinaryTree) -> Vec<u32> {
    let mut prims = tree.prims.clone();
    let leaves = tree.nodes.iter().filter(|node| node.is_leaf());
    leaves.for_each(|leaf| prims[leaf.first as usize..][..leaf.count as usize].sort_unstable());
    prims
}

/// Finds the splits of a run of codes.
fn split(
    codes: &[(u32, u32)],
    (first, end): (usize, usize),
    leaf: usize,
    middles: &mut BTreeMap<(usize, usize), usize>,
) {
    let length = end - first;
    if length <= leaf {
        return;
    }
    let differ = codes[first].0 ^ codes[end - 1].0;
    let goes_left = |pair: &(u32, u32)| pair.0 & 1 << differ.ilog2() == 0;
    let mut left = if differ == 0 { length / 2 } else { codes[first..end].partition_point(goes_left) };
    if length <= 2 * leaf {
        left = left.clamp(length - leaf, leaf);
    }
    middles.insert((first, end), first + left);
    split(codes, (first, first + left), leaf, middles);
    split(codes, (first + left, end), leaf, middles);
}

/// Adds what is below a node, depth first.
fn number(tree: &mut BinaryTree, node: usize, middles: &BTreeMap<(usize, usize), usize>) {
    let Node { first, count, .. } = tree.nodes[node];
    if let Some(&middle) = middles.get(&(first as usize, (first + count) as usize)) {
        let (left, middle) = (tree.nodes.len(), middle as u32);
        tree.nodes[node].left = left as u32;
        let child = |first, count| Node { bounds: Aabb::EMPTY, left: 0, first, count };
        tree.nodes.extend([child(first, middle - first), child(middle, first + count - middle)]);
        number(tree, left, middles);
        number(tree, left + 1, middles);
    }
}

/// The boxes as builders see them.
fn seen(boxes: &[Aabb]) -> Vec<Aabb> {
    boxes.iter().map(|b| Reference::new(b, 0).bounds()).collect()
}

#[test]
fn trees_are_valid_and_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (name, boxes) in cases() {
        let leaves = if boxes.len() < 1000 { [1, 3, 8].as_slice() } else { &[8] };
        for (&leaf, (builder_name, builder)) in leaves.iter().flat_map(|l| Builder::ALL.map(|b| (l, b))) {
            let tree = built(&mut executor, builder, &boxes, leaf);
            validate(&tree, &seen(&boxes), leaf)
                .unwrap_or_else(|e| panic!("{name} {builder_name} {leaf}: {e}"));
            let expected = expected(builder_name, &boxes, leaf);
            assert!(tree.nodes == expected.nodes, "{name} {builder_name} {leaf}: nodes");
            let alike = match builder {
                Builder::GridSah => sorted_leaves(&tree) == sorted_leaves(&expected),
                _ => tree.prims == expected.prims,
            };
            assert!(alike, "{name} {builder_name} {leaf}: order");
        }
    }
}

/// Whether a cell of the finest grid holds more than a leaf may of boxes with different centres.
fn has_full_cells(boxes: &[Aabb], leaf: usize) -> bool {
    let mut cells: BTreeMap<u32, Vec<Vec3>> = BTreeMap::new();
    for (code, b) in codes(boxes, Rounding::Cut).1.into_iter().zip(seen(boxes)) {
        cells.entry(code).or_default().push(b.min + b.max);
    }
    cells.values().any(|centres| centres.len() > leaf && centres.iter().any(|c| *c != centres[0]))
}

#[test]
fn grids_give_the_tree_of_the_builder_of_that_name_on_the_cpu() {
    let Some(mut executor) = software() else { return };
    let mut others = Vec::new();
    for (name, boxes) in cases() {
        for leaf in [1, 4, 8] {
            let tree = built(&mut executor, Builder::GridSah, &boxes, leaf);
            let expected = of_cpu("grid-sah", &boxes, leaf);
            let same = tree.nodes == expected.nodes && sorted_leaves(&tree) == sorted_leaves(&expected);
            // A grid of its own parts what halves do not.
            assert_eq!(same, !has_full_cells(&boxes, leaf as usize), "{name} {leaf}");
            others.extend((leaf == 8 && !same).then_some(name.clone()));
        }
    }
    assert_eq!(others, ["one huge", "line", "crowded", "doubling"]);
}

#[test]
fn trees_are_the_same_each_time() {
    let Some(mut executor) = software() else { return };
    let boxes = many(20_000, 0.05);
    for (_, builder) in Builder::ALL {
        let [a, b] = [0, 1].map(|_| built(&mut executor, builder, &boxes, 4));
        assert!(bytemuck::cast_slice::<Node, u32>(&a.nodes) == bytemuck::cast_slice::<Node, u32>(&b.nodes));
        assert!(a.prims == b.prims);
    }
}

#[test]
fn a_box_that_differs_is_found() {
    let Some(mut executor) = software() else { return };
    let boxes = many(5000, 0.05);
    let mut other = boxes.clone();
    other[4321].max.x += 0.5;
    for (name, builder) in Builder::ALL {
        let tree = built(&mut executor, builder, &other, 8);
        assert!(tree.nodes != expected(name, &boxes, 8).nodes);
        let outside = Violation::Box { node: 0, below: "primitive 4321".into() };
        let mut larger = seen(&boxes);
        larger[4321].max.x += 1.0;
        let found = validate(&tree, &larger, 8).expect_err("too large");
        assert_eq!(std::mem::discriminant(&found), std::mem::discriminant(&outside), "{found}");
    }
}

#[test]
fn a_build_has_few_dispatches_besides_its_sort() {
    for (count, most) in [(0, 9), (1, 9), (1_000_000, 9), (4_000_000, 10), (5_000_000, 12)] {
        let (mut recording, mut stages) = (Recording::new(), Vec::new());
        let boxes = recording.buffer("boxes", 6 * u64::from(count));
        record(&mut recording, Builder::Morton, boxes, (count, 8), &mut stages).expect("fits");
        assert_eq!(recording.check(), Ok(()));
        let sort = if count < 1 << 14 { 4 * 3 } else { 4 * 5 };
        assert!(recording.dispatches() <= most + sort, "{count}: {}", recording.dispatches());
        assert!(count == 0 || stages.last() == Some(&("nodes", recording.commands().len())));
    }
    let mut recording = Recording::new();
    let boxes = recording.buffer("boxes", 6);
    let count = build::MAX_ELEMENTS + 1;
    let error =
        record(&mut recording, Builder::Morton, boxes, (count, 8), &mut Vec::new()).expect_err("many");
    assert!(matches!(error, GpuError::Limit { .. }), "{error}");
}

#[test]
fn builds_have_as_many_dispatches_as_the_documents_say() {
    for (name, dispatches) in [("morton", 133), ("hlbvh2", 356), ("grid-sah", 497)] {
        let mut recording = Recording::new();
        let boxes = recording.buffer("boxes", 6_000_000);
        let builder = Builder::of_name(name).expect("a builder");
        let tree = record(&mut recording, builder, boxes, (1_000_000, 8), &mut Vec::new()).expect("fits");
        wide::record(&mut recording, &tree, 250_000).expect("fits");
        assert_eq!(recording.check(), Ok(()));
        // The boxes of triangles take one more.
        assert_eq!(recording.dispatches(), dispatches, "{name}");
    }
    let mut recording = Recording::new();
    let [positions, triangles, boxes] = [3, 3, 6].map(|words| recording.buffer("mesh", words * 1_000_000));
    let parts = [positions, triangles];
    build::parts::record(&mut recording, parts, boxes, (1_000_000, 2_000_000)).expect("fits");
    assert_eq!((recording.dispatches(), recording.check()), (1 + 2 * 8, Ok(())));
}

#[test]
fn codes_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    let cases: Vec<_> = cases().into_iter().filter(|(_, boxes)| !boxes.is_empty()).collect();
    let roundings = [Rounding::Nearest, Rounding::Cut];
    for ((name, boxes), rounding) in cases.iter().flat_map(|case| roundings.map(|r| (case, r))) {
        let (mut recording, n) = (Recording::new(), boxes.len() as u32);
        let input = recording.upload("boxes", &words(boxes));
        let found = build::codes::record(&mut recording, input, Count::exactly(n), rounding).expect("few");
        let extents = recording.download(found.extents, 6);
        let keys = recording.download(found.pairs.keys, n.into());
        let numbers = found.pairs.payloads.map(|numbers| recording.download(numbers, n.into()));
        let results = executor.run(&recording).expect("runs");
        let ([min, max], expected) = codes(boxes, rounding);
        assert!(results.words(keys) == expected, "{name}");
        assert!(results.words(numbers.expect("some")).into_iter().eq(0..n), "{name}");
        let around = [min, max].map(|p| p.to_array()).concat();
        let found: Vec<f32> = results
            .words(extents)
            .iter()
            .map(|&word| f32::from_bits(if word >> 31 == 0 { !word } else { word ^ 1 << 31 }))
            .collect();
        assert!(found == around, "{name}");
    }
}

/// Corners of triangles, some of them odd.
fn corners(n: usize) -> Vec<Vec3> {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3e38, -0.0, 1e-40];
    let corner = |i: usize| {
        let mut p = point(i, 20);
        if i.is_multiple_of(97) {
            p[i % 3] = odd[i / 97 % 6];
        }
        p
    };
    (0..n).map(corner).collect()
}

#[test]
fn boxes_of_triangles_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    let positions = corners(5000);
    for n in [0, 1, 255, 256, 257, 5000] {
        let vertex = |i: usize, k| (hash_words(&[i as u32, k]) % 5000) as u32;
        let triangles: Vec<[u32; 3]> = (0..n).map(|i| [0, 1, 2].map(|k| vertex(i, k))).collect();
        let mut recording = Recording::new();
        let inputs = [recording.upload("positions", &positions), recording.upload("triangles", &triangles)];
        let found = build::boxes::record(&mut recording, inputs[0], inputs[1], n as u32).expect("few");
        let found = recording.download(found, 6 * n as u64);
        let found = executor.run(&recording).expect("runs").words(found);
        assert!(found == boxes(&positions, &triangles), "{n}");
        // As those of whole boxes, where all is finite.
        for (found, triangle) in found.chunks_exact(6).zip(&triangles) {
            let corners = triangle.map(|i| positions[i as usize]);
            if corners.iter().all(|p| p.is_finite() && p.abs().max_element() < 1e30) {
                assert_eq!(found, box_words(&Aabb::from_points(corners)));
            }
        }
    }
}

/// A sheet of triangles that waves in time.
fn waving(side: u32, time: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let vertex = |i: u32| {
        let (x, y) = ((i % side) as f32, (i / side) as f32);
        Vec3::new(x, y, 3.0 * (0.3 * x + time).sin() * (0.2 * y - time).cos())
    };
    let corners = (0..side - 1).flat_map(|y| (0..side - 1).map(move |x| y * side + x));
    let triangles = corners.flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]]);
    ((0..side * side).map(vertex).collect(), triangles.collect())
}

#[test]
fn trees_over_clusters_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    let (first, triangles) = waving(90, 0.0);
    let mesh = MeshView { positions: &first, triangles: &triangles };
    let clusters =
        Clusters::new(&mesh, &ClusterConfig { max_count: 20, max_size: 20, ..ClusterConfig::DEFAULT });
    let count = triangles.len() as u32;
    assert!((count / 40..count / 5).contains(&(clusters.len() as u32)));
    let mut before = None;
    for time in [0.0, 1.0] {
        let positions = waving(90, time).0;
        for (name, builder) in Builder::ALL {
            let mut recording = Recording::new();
            let mesh = [recording.upload("positions", &positions), recording.upload("triangles", &triangles)];
            let [first, order] = build::clusters::words(&clusters).map(|w| recording.upload("clusters", &w));
            let on_device = DeviceClusters { first, order, count: clusters.len() as u32 };
            let tree =
                build::clusters::record(&mut recording, builder, mesh, (count, &on_device), &mut Vec::new());
            let downloads = Downloads::new(&mut recording, &tree.expect("few"));
            let tree = downloads.tree(&executor.run(&recording).expect("runs"));
            let corners = |&t: &u32| triangles[t as usize].map(|i| positions[i as usize]);
            let around = |i| Aabb::from_points(clusters.triangles(i).iter().flat_map(corners));
            let whole: Vec<Aabb> = (0..clusters.len() as u32).map(around).collect();
            let of_words = cluster_boxes(&clusters, &boxes(&positions, &triangles));
            assert!(of_words == words(&whole));
            validate(&tree, &whole, 1).unwrap_or_else(|e| panic!("{name} at {time}: {e}"));
            let expected = expected(name, &whole, 1);
            assert!(tree.nodes == expected.nodes && tree.prims == expected.prims, "{name} at {time}");
            if builder == Builder::Morton {
                assert!(before.replace(tree.nodes.clone()).is_none_or(|before| before != tree.nodes));
            }
        }
    }
}

/// Where a ray meets a triangle, in double precision (Moeller, Trumbore 1997).
fn meets([a, b, c]: [Vec3; 3], origin: Vec3, direction: Vec3) -> Option<f64> {
    let [a, b, c, origin, direction] = [a, b, c, origin, direction].map(Vec3::as_dvec3);
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let q = (origin - a).cross(ab);
    let scale = 1.0 / ab.dot(p);
    let (u, v, t) = ((origin - a).dot(p) * scale, direction.dot(q) * scale, ac.dot(q) * scale);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0).then_some(t)
}

/// Whether a ray may meet a box.
fn enters(b: &Aabb, origin: Vec3, direction: Vec3) -> bool {
    let (a, b) = ((b.min - 1e-5 - origin) / direction, (b.max + 1e-5 - origin) / direction);
    a.min(b).max_element() <= a.max(b).min_element()
}

/// The closest hit among the triangles in the leaves of a tree whose boxes a ray enters, and how many it tested.
fn closest(
    tree: &BinaryTree,
    triangles: &[[Vec3; 3]],
    origin: Vec3,
    direction: Vec3,
) -> (Option<u32>, usize) {
    let (mut open, mut best, mut tested) = (vec![0], (f64::INFINITY, None), 0);
    while let Some(node) = open.pop().map(|i: u32| &tree.nodes[i as usize]) {
        if !enters(&node.bounds, origin, direction) {
            continue;
        }
        if !node.is_leaf() {
            open.extend([node.left, node.left + 1]);
            continue;
        }
        for &prim in &tree.prims[node.first as usize..(node.first + node.count) as usize] {
            tested += 1;
            if let Some(t) = meets(triangles[prim as usize], origin, direction)
                && t < best.0
            {
                best = (t, Some(prim));
            }
        }
    }
    (best.1, tested)
}

#[test]
fn hits_are_those_of_all_triangles() {
    let Some(mut executor) = software() else { return };
    let triangle = |i: usize| [30, 40, 50].map(|salt| point(i, 1) + point(i, salt) * 0.2);
    let triangles: Vec<[Vec3; 3]> = (0..2000).map(triangle).collect();
    let boxes: Vec<Aabb> = triangles.iter().map(|&t| Aabb::from_points(t)).collect();
    let bounds = Aabb { min: Vec3::splat(-9.0), max: Vec3::splat(9.0) };
    let root = Node { bounds, left: 0, first: 0, count: 2000 };
    let all = BinaryTree { nodes: vec![root], prims: (0..2000).collect() };
    for (_, builder) in Builder::ALL {
        let tree = built(&mut executor, builder, &boxes, 4);
        let (mut hits, mut tests) = (0, 0);
        for i in 0..1000 {
            let (origin, direction) = (point(i, 60) * 2.0, point(i, 70));
            let (found, tested) = closest(&tree, &triangles, origin, direction);
            assert_eq!(found, closest(&all, &triangles, origin, direction).0);
            (hits, tests) = (hits + usize::from(found.is_some()), tests + tested);
        }
        assert!(hits > 200 && tests < 1000 * 2000 / 4, "{hits} hits, {tests} tests");
    }
}

/// A tree's boxes from the bottom up.
fn refitted(tree: &BinaryTree, boxes: &[Aabb]) -> BinaryTree {
    let mut tree = tree.clone();
    for i in (0..tree.nodes.len()).rev() {
        let Node { left, first, count, .. } = tree.nodes[i];
        let prims = &tree.prims[first as usize..(first + count) as usize];
        let of_leaf = || prims.iter().fold(Aabb::EMPTY, |b, &prim| b.union(boxes[prim as usize]));
        let of_children = || tree.nodes[left as usize].bounds.union(tree.nodes[left as usize + 1].bounds);
        tree.nodes[i].bounds = if left == 0 { of_leaf() } else { of_children() };
    }
    tree
}

#[test]
fn refitted_boxes_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for n in SIZES {
        let boxes = many(n, 0.05);
        let moved: Vec<Aabb> = boxes
            .iter()
            .enumerate()
            .map(|(i, b)| Aabb { min: b.min + point(i, 9), max: b.max + point(i, 9) })
            .collect();
        let mut recording = Recording::new();
        let inputs = [&boxes, &moved].map(|boxes| recording.upload("boxes", &words(boxes)));
        let fits = (n as u32, 8);
        let tree = record(&mut recording, Builder::Morton, inputs[0], fits, &mut Vec::new()).expect("few");
        record_refit(&mut recording, &tree, inputs[1]).expect("few");
        let downloads = Downloads::new(&mut recording, &tree);
        let tree = downloads.tree(&executor.run(&recording).expect("runs"));
        let before = expected("morton", &boxes, 8);
        let after = refitted(&before, &moved);
        assert!(tree.nodes == after.nodes && tree.prims == after.prims, "{n}");
        validate(&tree, &moved, 8).expect("valid");
        assert!(n == 0 || tree.nodes != before.nodes, "they moved");
    }
}

/// The wide tree that the device makes of a binary one, with room for so many nodes, and how many there would be.
fn collapsed(
    executor: &mut Executor,
    builder: Builder,
    boxes: &[Aabb],
    room: u32,
) -> (Wide, BinaryTree, u32) {
    let mut recording = Recording::new();
    let input = recording.upload("boxes", &words(boxes));
    let fits = (boxes.len() as u32, 4);
    let tree = record(&mut recording, builder, input, fits, &mut Vec::new()).expect("few");
    let wide = wide::record(&mut recording, &tree, room).expect("few");
    let binary = Downloads::new(&mut recording, &tree);
    let nodes = recording.download(wide.nodes, wide::WIDE_WORDS * u64::from(room.max(1)));
    let leaves = recording.download(wide.leaves, 2 * boxes.len() as u64);
    let counts = [wide.node_count, wide.leaf_count].map(|count| recording.download(count, 1));
    let results = executor.run(&recording).expect("runs");
    let [node_count, leaf_count] = counts.map(|count| results.words(count)[0]);
    let nodes: Vec<Node8> = bytemuck::pod_collect_to_vec(&results.words(nodes));
    let leaves: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&results.words(leaves));
    let nodes = nodes.into_iter().take(node_count as usize).collect();
    let leaves = leaves.into_iter().take(leaf_count as usize).collect();
    (Wide { nodes, leaves }, binary.tree(&results), node_count)
}

fn valid(wide: &Wide, tree: &BinaryTree, boxes: &[Aabb]) -> Result<Report, Violation> {
    let leaf = |leaf: usize| {
        let [first, count] = *wide.leaves.get(leaf)?;
        let prims = tree.prims.get(first as usize..(first + count) as usize)?;
        Some(prims.iter().map(|&prim| (prim, boxes[prim as usize])).collect())
    };
    validate_nodes(&wide.nodes, wide.root(), boxes.len(), Boxes::Nested, leaf, |_, _| false)
}

#[test]
fn wide_trees_are_valid_and_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (name, boxes) in cases() {
        let builders = if boxes.len() < 3000 { &Builder::ALL[..] } else { &Builder::ALL[2..] };
        for &(builder_name, builder) in builders {
            let (wide, tree, _) = collapsed(&mut executor, builder, &boxes, boxes.len() as u32);
            let report =
                valid(&wide, &tree, &seen(&boxes)).unwrap_or_else(|e| panic!("{name} {builder_name}: {e}"));
            assert_eq!(report.references, boxes.len());
            assert!(wide == wide::collapse(&tree), "{name} {builder_name}");
        }
    }
}

#[test]
fn wide_trees_that_differ_or_do_not_fit_are_found() {
    let Some(mut executor) = software() else { return };
    let boxes = many(3000, 0.05);
    let (wide, tree, all) = collapsed(&mut executor, Builder::Morton, &boxes, 3000);
    assert!(valid(&wide, &tree, &seen(&boxes)).is_ok() && all > 100);
    let mut other = wide.clone();
    other.nodes[50].planes[1][0][0] += 1.0;
    assert!(valid(&other, &tree, &seen(&boxes)).is_err() && other != wide::collapse(&tree));
    let mut other = wide.clone();
    other.leaves[7][1] += 1;
    assert!(valid(&other, &tree, &seen(&boxes)).is_err());
    let (part, _, wanted) = collapsed(&mut executor, Builder::Morton, &boxes, 60);
    assert_eq!((part.nodes.len(), wanted), (60, all));
    assert!(part.nodes == wide.nodes[..60]);
    assert!(valid(&part, &tree, &seen(&boxes)).is_err());
}

/// The mesh of a scene over the tree that the device builds over its triangles.
fn mesh_of(executor: &mut Executor, builder: Builder, scene: &Scene) -> MeshBvh {
    let mesh = &scene.meshes()[0];
    let count = mesh.triangles.len() as u32;
    let mut recording = Recording::new();
    let positions = recording.upload("positions", &mesh.positions);
    let triangles = recording.upload("triangles", &mesh.triangles);
    let input = build::boxes::record(&mut recording, positions, triangles, count).expect("few");
    let tree = record(&mut recording, builder, input, (count, 8), &mut Vec::new()).expect("few");
    let wide = wide::record(&mut recording, &tree, count).expect("few").download(&mut recording);
    let order = recording.download(tree.order, count.into());
    let results = executor.run(&recording).expect("runs");
    let wide = wide.wide(&results).expect("room");
    let view = MeshView { positions: &mesh.positions, triangles: &mesh.triangles };
    let bvh = MeshBvh::over_nodes(&view, &wide.nodes, &wide.leaves, &results.words(order));
    let report = bvh.validate(&view).expect("valid");
    assert_eq!(report.references, count as usize);
    bvh
}

/// How many of some rays meet another triangle through trees of the device than through one of the CPU, by the tracer of
/// the CPU and by that of the device, and how many meet any.
fn other_hits(executor: &mut Executor, scene: &Scene, bvh: &MeshBvh, rays: &[Ray]) -> (usize, usize) {
    let mut expected = vec![Hit::MISS; rays.len()];
    tracer(scene, Layout::Wide).closest(rays, &AcceptAll, &mut expected);
    let over = |layout| {
        let config = TracerConfig { layout, ..TracerConfig::default() };
        Tracer::over_meshes(scene, vec![bvh.clone()], &config).expect("a tracer")
    };
    let mut found = vec![Hit::MISS; rays.len()];
    over(Layout::Wide).closest(rays, &AcceptAll, &mut found);
    let device = DeviceTracer::new(executor, &over(Layout::Compact)).expect("fits");
    let on_device = closest_hits(executor, &device, rays);
    device.release(executor);
    let other = |(expected, found): &(&Hit, &Hit)| !same(expected, found);
    let others = expected.iter().zip(&found).chain(expected.iter().zip(&on_device)).filter(other).count();
    (others, expected.iter().filter(|hit| hit.is_hit()).count())
}

#[test]
fn rays_through_wide_trees_meet_what_they_meet_through_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    let mut small = sheet(65);
    small.positions.iter_mut().for_each(|p| *p *= 2.0_f32.powi(-30));
    let sized = [("soup", soup(3000, Vec3::splat(0.125)), 1.0), ("sheet", sheet(65), 1.0)];
    for (name, mesh, size) in sized.into_iter().chain([("small", small, 2.0_f32.powi(-30))]) {
        let scene = alone(mesh);
        let scaled = |ray: Ray| Ray { origin: ray.origin * size, t_min: 0.0, ..ray };
        let rays: Vec<Ray> = rays(4000).into_iter().map(scaled).collect();
        for (builder_name, builder) in Builder::ALL {
            let bvh = mesh_of(&mut executor, builder, &scene);
            let (others, met) = other_hits(&mut executor, &scene, &bvh, &rays);
            assert!(others == 0 && met > 500, "{name} {builder_name}: {others} others, {met} hits");
            let mut broken = bvh;
            let full = broken.blocks.iter_mut().filter(|block| block.prims[1] != Block8::NO_PRIM);
            full.for_each(|block| block.prims.swap(0, 1));
            let (others, _) = other_hits(&mut executor, &scene, &broken, &rays);
            assert!(others > 100, "{name} {builder_name}: numbers that differ are found");
        }
    }
}
