//! Clusters part the triangles into connected sets, and trees over them are sound and give the hits of brute force in every frame.

mod common;
#[path = "common/deforming.rs"]
mod deforming;
#[path = "common/moving.rs"]
mod moving;
#[path = "common/walk.rs"]
mod walk;

use common::{Soup, inputs, point};
use deforming::by_name;
use moving::Moving;
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use vastlight_accel::build::NAMES;
use vastlight_accel::cluster::{Generator, Heuristic, PUBLISHED_LEAF, stop_leaves};
use vastlight_accel::wide::{MeshBvh, MeshView};
use vastlight_accel::{
    BuildConfig, BuildError, ClusterConfig, Clusters, Reference, Scratch, Violation, build, validate,
};
use vastlight_math::{Aabb, Vec3};
use vastlight_simd::Level;
use walk::{Closest, Hit};

const KINDS: [(Heuristic, Generator); 4] = [
    (Heuristic::Acc, Generator::Merging),
    (Heuristic::Acc, Generator::Growing),
    (Heuristic::Naive, Generator::Merging),
    (Heuristic::Error, Generator::Merging),
];

fn config((heuristic, generator): (Heuristic, Generator), most: u32) -> ClusterConfig {
    ClusterConfig { heuristic, generator, max_count: most, max_size: most }
}

fn view<'a>(moving: &'a Moving, positions: &'a [Vec3]) -> MeshView<'a> {
    MeshView { positions, triangles: &moving.triangles }
}

/// Rays from random points of a cube as large as the mesh to points near vertices.
fn rays(mesh: &MeshView<'_>, count: usize) -> Vec<[Vec3; 2]> {
    let around = Aabb::from_points(mesh.positions.iter().copied());
    if around.is_empty() {
        return vec![[Vec3::ZERO, Vec3::ONE]; count];
    }
    let size = around.size().max_element();
    let ray = |i: usize| {
        let origin = around.center() + point(2 * i, 3) * size;
        let target = mesh.positions[(i * 7919) % mesh.positions.len()] + point(2 * i + 1, 3) * (size * 0.01);
        [origin, target - origin]
    };
    (0..count).map(ray).collect()
}

fn hits(bvh: &MeshBvh, rays: &[[Vec3; 2]], every_block: bool) -> Vec<Hit> {
    Level::detect().dispatch(Closest { bvh, rays, every_block }).hits
}

/// Checks a tree, and its hits against those of all triangles of another one, of which the number of hits is given.
fn check(bvh: &MeshBvh, mesh: &MeshView<'_>, what: &str) -> usize {
    let report = bvh.validate(mesh).unwrap_or_else(|violation| panic!("{what}: {violation}"));
    assert_eq!(report.references, mesh.triangles.len(), "{what}");
    let plain = MeshBvh::build("", mesh, &BuildConfig::default(), &mut Scratch::default()).expect("built").0;
    assert_eq!((bvh.extent, bvh.scale, bvh.bounds), (plain.extent, plain.scale, plain.bounds), "{what}");
    let rays = rays(mesh, 100);
    let expected = hits(&plain, &rays, true);
    assert_eq!(hits(bvh, &rays, false), expected, "{what}");
    expected.iter().filter(|hit| hit.1 != u32::MAX).count()
}

/// A name, positions, triangles.
type Named = (&'static str, Vec<Vec3>, Vec<[u32; 3]>);

/// Meshes of all kinds of connections.
fn meshes() -> Vec<Named> {
    let soup = |triangles: &[[Vec3; 3]]| Soup::new(triangles);
    let mut meshes: Vec<_> = inputs()
        .into_iter()
        .filter(|(_, triangles)| triangles.len() < 3000)
        .map(|(name, triangles)| (name, soup(&triangles).positions, soup(&triangles).triangles))
        .collect();
    let points: Vec<Vec3> = (0..400).map(|i| point(i, 9)).collect();
    let fan = |i: u32| [0, 1, 2 + i];
    let strip = |i: u32| [i, i + 1, i + 2];
    meshes.push(("edge of many", points.clone(), (0..300).map(fan).collect()));
    meshes.push(("tangle", points.clone(), (0..390).map(strip).collect()));
    meshes.push(("duplicates", points.clone(), vec![[0, 1, 2]; 700]));
    meshes.push(("points", points.clone(), vec![[5, 5, 5]; 100]));
    meshes.push(("needles", points.clone(), (0..300).map(|i| [i, i, i + 1]).collect()));
    meshes.push(("unused vertices", points, vec![[7, 8, 9]]));
    for (name, triangles) in [("statue", 900), ("cloth", 1000), ("bodies", 1800)] {
        let moving = by_name(name, triangles);
        meshes.push((name, moving.at(0.3), moving.triangles));
    }
    meshes
}

#[test]
fn clusters_part_the_triangles_of_any_mesh() {
    for (name, positions, triangles) in meshes() {
        let mesh = MeshView { positions: &positions, triangles: &triangles };
        for kind in KINDS {
            for most in [0, 1, 10, 50, 1000] {
                let what = format!("{name}, {kind:?}, {most}");
                let clusters = Clusters::new(&mesh, &config(kind, most));
                let report =
                    clusters.validate(&mesh).unwrap_or_else(|violation| panic!("{what}: {violation}"));
                assert_eq!((report.clusters, clusters.is_empty()), (clusters.len(), triangles.is_empty()));
                assert_eq!(clusters.of_triangle().len(), triangles.len(), "{what}");
                let (bvh, _) = clusters
                    .build("", &mesh, &BuildConfig::default(), &mut Scratch::default())
                    .unwrap_or_else(|error| panic!("{what}: {error}"));
                check(&bvh, &mesh, &what);
            }
        }
    }
}

#[test]
fn trees_of_all_builders_are_sound_in_every_frame() {
    for (name, triangles) in [("statue", 6000), ("cloth", 5000), ("bodies", 4000)] {
        let moving = by_name(name, triangles);
        let first = moving.at(0.0);
        for most in [50, 400] {
            let clusters = Clusters::new(&view(&moving, &first), &config(KINDS[0], most));
            assert!(clusters.len() * 5 < moving.triangles.len(), "{name}: {} clusters", clusters.len());
            let mut scratch = Scratch::default();
            let mut bvh = None;
            for (builder, time) in NAMES.into_iter().zip([0.0, 0.3, 1.0, 0.2, 0.6, 0.0, 0.8]) {
                let positions = moving.at(time);
                let mesh = view(&moving, &positions);
                let config = BuildConfig { optimize: u32::from(time > 0.5), ..BuildConfig::default() };
                let (fresh, _) = clusters.build(builder, &mesh, &config, &mut scratch).expect("built");
                let found = check(&fresh, &mesh, &format!("{name}, {builder}, {most}"));
                assert!(found > 40, "{found} rays hit");
                // In the memory of another frame it is the same.
                let reused = bvh.get_or_insert_with(|| fresh.clone());
                clusters.rebuild(builder, &mesh, &config, &mut scratch, reused).expect("built");
                assert_eq!((&reused.nodes[..], &reused.blocks[..]), (&fresh.nodes[..], &fresh.blocks[..]));
                assert_eq!(
                    (reused.root, reused.levels, reused.bounds),
                    (fresh.root, fresh.levels, fresh.bounds)
                );
            }
        }
    }
}

#[test]
fn wrong_trees_are_found() {
    let moving = by_name("cloth", 3000);
    let (first, later) = (moving.at(0.0), moving.at(1.0));
    let mesh = view(&moving, &first);
    let clusters = Clusters::new(&mesh, &ClusterConfig::DEFAULT);
    let built =
        || clusters.build("", &mesh, &BuildConfig::default(), &mut Scratch::default()).expect("built").0;
    let mut old = built();
    assert!(old.validate(&view(&moving, &later)).is_err(), "a tree of another frame");
    let rays = rays(&mesh, 300);
    let expected = hits(&old, &rays, true);
    let node = old.root.map_or(0, |root| root.index());
    old.nodes[node].planes[0][1] = [-10.0; 8];
    assert_ne!(hits(&old, &rays, false), expected, "boxes that contain nothing lose hits");
    let mut cut = built();
    let inner = cut.nodes[node].children.into_iter().find(|child| !child.is_leaf());
    cut.root = Some(inner.expect("a node below the root"));
    let violation = cut.validate(&mesh).expect_err("nodes that nothing leads to");
    assert!(matches!(violation, Violation::Shape { what: "is not reached", .. }), "{violation}");
    // Clusters of other triangles are not connected.
    let shuffled: Vec<[u32; 3]> =
        (0..moving.triangles.len()).map(|i| moving.triangles[(i * 7919) % moving.triangles.len()]).collect();
    let shuffled = MeshView { positions: &first, triangles: &shuffled };
    assert!(matches!(clusters.validate(&shuffled), Err(Violation::Shape { what: "is not connected", .. })));
}

#[test]
fn clusters_and_trees_do_not_depend_on_threads() {
    // So many triangles that they are merged, and grown, in parts.
    let moving = by_name("statue", 150_000);
    let first = moving.at(0.0);
    let mesh = view(&moving, &first);
    let found = [1, 2].map(|threads| {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let clusters = Clusters::new(&mesh, &ClusterConfig::DEFAULT);
            clusters.validate(&mesh).expect("sound");
            let grown = Clusters::new(&mesh, &config(KINDS[1], 50));
            grown.validate(&mesh).expect("sound");
            Level::available().into_iter().map(move |level| {
                let config = BuildConfig { level, ..BuildConfig::default() };
                let bvh = clusters.build("", &mesh, &config, &mut Scratch::default()).expect("built").0;
                (bvh.nodes.to_vec(), bvh.blocks.to_vec())
            })
        })
    });
    let found: Vec<_> = found.into_iter().flatten().collect();
    assert!(found.windows(2).all(|pair| pair[0] == pair[1]));
    for kind in KINDS {
        let moving = by_name("bodies", 5000);
        let first = moving.at(0.0);
        let of = |threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| Clusters::new(&view(&moving, &first), &config(kind, 50)).of_triangle().to_vec())
        };
        assert_eq!(of(1), of(2), "{kind:?}");
    }
}

#[test]
fn more_room_makes_fewer_clusters() {
    for name in ["statue", "cloth", "bodies"] {
        let moving = by_name(name, 20_000);
        let first = moving.at(0.0);
        let mesh = view(&moving, &first);
        let count = |kind, most| Clusters::new(&mesh, &config(kind, most)).len();
        for kind in &KINDS[..2] {
            let counts = [10, 50, 100, 200].map(|most| count(*kind, most));
            assert!(counts.windows(2).all(|w| w[0] > w[1]), "{name}, {kind:?}: {counts:?}");
        }
        // The others have as many as these.
        let acc = count(KINDS[0], 50);
        assert_eq!([count(KINDS[2], 50), count(KINDS[3], 50)], [acc; 2], "{name}");
    }
}

#[test]
fn a_mesh_without_shared_vertices_is_all_single_triangles() {
    let triangles: Vec<[Vec3; 3]> = (0..500).map(|i| [10, 20, 30].map(|salt| point(i, salt))).collect();
    let soup = Soup::new(&triangles);
    let report = Clusters::new(&soup.view(), &ClusterConfig::DEFAULT).validate(&soup.view()).expect("sound");
    assert_eq!((report.clusters, report.singles, report.largest), (500, 500, 1));
}

#[test]
fn another_mesh_is_built_without_clusters_and_unknown_builders_are_errors() {
    let moving = by_name("cloth", 3000);
    let first = moving.at(0.0);
    let mesh = view(&moving, &first);
    let clusters = Clusters::new(&mesh, &ClusterConfig::DEFAULT);
    // Without clusters triangles may be cut, which are counted below.
    let config = BuildConfig { split_budget: Some(1.0), ..BuildConfig::default() };
    let mut scratch = Scratch::default();
    let fewer = MeshView { triangles: &moving.triangles[1..], ..mesh };
    let few = MeshView { positions: &first[..3], triangles: &[[0, 1, 2]] };
    // As many triangles, over fewer vertices than the clusters name.
    let equal = vec![[0, 1, 2]; moving.triangles.len()];
    let small = MeshView { positions: &first[..3], triangles: &equal };
    for other in [fewer, few, small] {
        let (bvh, _) = clusters.build("", &other, &config, &mut scratch).expect("built");
        check(&bvh, &other, "another mesh");
    }
    let error = clusters.build("quantum", &mesh, &config, &mut scratch).expect_err("unknown");
    assert_eq!(error, BuildError::UnknownBuilder("quantum".into()));
}

#[test]
fn published_leaves_have_at_most_32_triangles_or_one_cluster() {
    let moving = by_name("bodies", 20_000);
    let positions = moving.at(0.5);
    let mesh = view(&moving, &positions);
    let clusters = Clusters::new(&mesh, &ClusterConfig::DEFAULT);
    let weight = |cluster: u32| clusters.triangles(cluster).len() as u32;
    let tree =
        clusters.published_tree("", &mesh, &BuildConfig::default(), &mut Scratch::default()).expect("built");
    let boxes: Vec<Aabb> = (0..clusters.len() as u32)
        .map(|c| Aabb::from_points(clusters.triangles(c).iter().flat_map(|&t| mesh.corners(t))))
        .collect();
    validate(&tree, &boxes, PUBLISHED_LEAF).expect("sound");
    let total = |first: u32, count: u32| -> u32 {
        tree.prims[first as usize..(first + count) as usize].iter().map(|&c| weight(c)).sum()
    };
    for node in &tree.nodes {
        let stops = node.count == 1 || total(node.first, node.count) <= PUBLISHED_LEAF;
        assert_eq!(node.is_leaf(), stops, "{node:?}");
    }
    assert!(tree.nodes.iter().any(|node| node.is_leaf() && node.count > 1));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_triangles_over_any_vertices_are_parted_and_traced(
        triangles in prop::collection::vec([0..40_u32, 0..40_u32, 0..40_u32], 0..200),
        most in 1..200_u32,
        kind in 0..4_usize,
        builder in 0..NAMES.len(),
        seed in 0..1000_u64,
    ) {
        let positions: Vec<Vec3> = (0..40).map(|i| point(i, seed)).collect();
        let mesh = MeshView { positions: &positions, triangles: &triangles };
        let clusters = Clusters::new(&mesh, &config(KINDS[kind], most));
        clusters.validate(&mesh).expect("sound");
        let moved: Vec<Vec3> = (0..40).map(|i| point(i, seed + 5000) * 3.0).collect();
        let mesh = MeshView { positions: &moved, triangles: &triangles };
        let built = clusters.build(NAMES[builder], &mesh, &BuildConfig::default(), &mut Scratch::default());
        check(&built.expect("built").0, &mesh, "any mesh");
    }

    #[test]
    fn leaves_stop_at_the_highest_nodes_that_are_light(count in 0..300_usize, most in 0..40_u32, seed in 0..100_u64) {
        let boxes: Vec<Aabb> = (0..count).map(|i| Aabb::point(point(i, seed))).collect();
        let mut references: Vec<Reference> =
            boxes.iter().zip(0..).map(|(b, i)| Reference::new(b, i)).collect();
        let config = BuildConfig { max_leaf: 1, ..BuildConfig::default() };
        let mut tree = build("", &mut references, None, &config, &mut Scratch::default()).expect("built");
        stop_leaves(&mut tree, |prim| prim % 5, most);
        validate(&tree, &boxes, u32::MAX).expect("sound");
        for node in &tree.nodes {
            let run = &tree.prims[node.first as usize..(node.first + node.count) as usize];
            let total: u32 = run.iter().map(|prim| prim % 5).sum();
            prop_assert!(node.is_leaf() == (node.count == 1 || node.count <= most && total <= most));
        }
    }
}
