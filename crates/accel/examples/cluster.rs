//! Trees over precomputed clusters beside trees over all triangles, of meshes that move: the time of a frame's build, the published
//! cost of the trees, what rays test in them, rays a second.
//! `cargo run --release -p vastlight-accel --example cluster -- [MESH] [TRIANGLES] [BUILDER] [STAGES]`.
//!
//! Both sides take turns, so that what else the machine does slows down both; the best of several turns counts.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/deforming.rs"]
mod deforming;
#[path = "../tests/common/moving.rs"]
mod moving;
#[path = "../tests/common/walk.rs"]
mod walk;

use deforming::by_name;
use moving::Moving;
use rayon::prelude::*;
use std::time::Instant;
use vastlight_accel::cluster::{Generator, Heuristic, PUBLISHED_LEAF, stop_leaves};
use vastlight_accel::wide::{MeshBuild, MeshBvh, MeshView};
use vastlight_accel::{
    BuildConfig, BuildError, ClusterConfig, Clusters, Reference, Scratch, build, quality, quality_with,
};
use vastlight_math::rng::hash_to_unit;
use vastlight_math::{Aabb, Vec3};
use walk::{Closest, Found};

/// Turns of each frame.
const TURNS: usize = 5;
/// Rays of a frame.
const RAYS: u32 = 1 << 18;
/// The frames, from 0 for the first to 1 for the last.
const TIMES: [f32; 3] = [0.0, 0.4, 1.0];
/// Values of `MaxCount` and `MaxSize`.
const SIZES: [u32; 4] = [10, 50, 100, 200];
/// What is compared at the published optimum.
const OTHERS: [(Heuristic, Generator); 3] = [
    (Heuristic::Acc, Generator::Growing),
    (Heuristic::Naive, Generator::Merging),
    (Heuristic::Error, Generator::Merging),
];

fn main() -> Result<(), BuildError> {
    let mut words = std::env::args().skip(1);
    let (mesh, triangles) = (words.next(), words.next().and_then(|word| word.parse().ok()));
    let (builder, stages) = (words.next().unwrap_or_default(), words.next().is_some());
    let meshes = mesh.as_ref().map_or(vec!["statue", "cloth", "bodies"], |mesh| vec![mesh]);
    for mesh in meshes {
        let moving = by_name(mesh, triangles.unwrap_or(250_000));
        let first = moving.at(TIMES[0]);
        let view = MeshView { positions: &first, triangles: &moving.triangles };
        show(format!("{mesh}, {} triangles, {} vertices", moving.triangles.len(), first.len()));
        let sizes = SIZES.map(|most| (Heuristic::Acc, Generator::Merging, most));
        for (heuristic, generator, most) in sizes.into_iter().chain(OTHERS.map(|(h, g)| (h, g, 50))) {
            let config = ClusterConfig { heuristic, generator, max_count: most, max_size: most };
            let start = Instant::now();
            let clusters = Clusters::new(&view, &config);
            let make = start.elapsed().as_secs_f64();
            let name = format!("{heuristic:?} {generator:?} {most}");
            show(format!("  {name}: {} clusters made in {make:.2} s", clusters.len()));
            compare(&moving, &clusters, &builder, stages)?;
        }
    }
    Ok(())
}

fn show(line: impl std::fmt::Display) {
    #[expect(clippy::print_stdout, reason = "this is what an example does")]
    {
        println!("{line}");
    }
}

/// One side, or the other.
#[derive(Default)]
struct Side<'a> {
    clusters: Option<&'a Clusters>,
    scratch: Scratch,
    bvh: Option<MeshBvh>,
    report: MeshBuild,
    build_ms: f64,
    mrays: f64,
    found: Totals,
}

/// What rays found and tested.
#[derive(Default)]
struct Totals {
    distances: f64,
    tests: [u64; 2],
}

/// Compares the frames of an animation with and without clusters.
fn compare(moving: &Moving, clusters: &Clusters, builder: &str, stages: bool) -> Result<(), BuildError> {
    let mut sides = [Side::default(), Side { clusters: Some(clusters), ..Side::default() }];
    for time in TIMES {
        let positions = moving.at(time);
        let view = MeshView { positions: &positions, triangles: &moving.triangles };
        for side in &mut sides {
            (side.build_ms, side.mrays) = (f64::INFINITY, 0.0);
            // The first build is not measured: it touches memory for the first time.
            side.build(builder, &view)?;
        }
        for _ in 0..TURNS {
            for side in &mut sides {
                let start = Instant::now();
                let report = side.build(builder, &view)?;
                let ms = start.elapsed().as_secs_f64() * 1e3;
                if ms < side.build_ms {
                    (side.build_ms, side.report) = (ms, report);
                }
            }
            sides.iter_mut().for_each(Side::trace);
        }
        let [plain, with] = &mut sides;
        assert!(plain.found.distances == with.found.distances, "the same hits");
        let cost = [plain.cost(builder, &view)?, with.cost(builder, &view)?];
        line(time, [plain, with], cost, stages);
    }
    Ok(())
}

fn line(time: f32, [plain, with]: [&Side<'_>; 2], cost: [f64; 2], stages: bool) {
    let tests = |side: &Side<'_>| side.found.tests.map(|tests| tests as f64 / f64::from(RAYS));
    let sum = |side: &Side<'_>| tests(side).iter().sum::<f64>();
    let size = |side: &Side<'_>| side.bvh.as_ref().map_or([0; 2], |bvh| [bvh.nodes.len(), bvh.blocks.len()]);
    show(format!(
        "    {time:.1}: build {:.2} -> {:.2} ms ({:.2}x faster), cost {:.1} -> {:.1} ({:.2}), tests {:.2?} -> {:.2?} ({:.2}), \
         Mrays/s {:.2} -> {:.2} ({:.2}), size {:?} -> {:?}",
        plain.build_ms,
        with.build_ms,
        plain.build_ms / with.build_ms,
        cost[0],
        cost[1],
        cost[1] / cost[0],
        tests(plain),
        tests(with),
        sum(with) / sum(plain),
        plain.mrays,
        with.mrays,
        with.mrays / plain.mrays,
        size(plain),
        size(with),
    ));
    if stages {
        show(format!("         {:.1?}\n         {:.1?}", plain.report.stages, with.report.stages));
    }
}

impl Side<'_> {
    fn build(&mut self, builder: &str, view: &MeshView<'_>) -> Result<MeshBuild, BuildError> {
        let config = BuildConfig::default();
        let (bvh, report) = match (self.clusters, self.bvh.take()) {
            (Some(clusters), Some(mut bvh)) => {
                let report = clusters.rebuild(builder, view, &config, &mut self.scratch, &mut bvh)?;
                (bvh, report)
            }
            (Some(clusters), None) => clusters.build(builder, view, &config, &mut self.scratch)?,
            (None, _) => MeshBvh::build(builder, view, &config, &mut self.scratch)?,
        };
        self.bvh = Some(bvh);
        Ok(report)
    }

    /// The published cost of the binary tree, with leaves of up to 32 triangles.
    fn cost(&mut self, builder: &str, view: &MeshView<'_>) -> Result<f64, BuildError> {
        if let Some(clusters) = self.clusters {
            let tree = clusters.published_tree(builder, view, &BuildConfig::default(), &mut self.scratch)?;
            return Ok(quality_with(&tree, |cluster| clusters.triangles(cluster).len() as f64).cost);
        }
        let reference = |t: u32| Reference::new(&Aabb::from_points(view.corners(t)), t);
        let mut references: Vec<Reference> = (0..view.triangles.len() as u32).map(reference).collect();
        let mut tree = build(builder, &mut references, None, &BuildConfig::default(), &mut self.scratch)?;
        stop_leaves(&mut tree, |_| 1, PUBLISHED_LEAF);
        Ok(quality(&tree).cost)
    }

    /// Traces rays from a sphere around the mesh to points in its box.
    fn trace(&mut self) {
        let Some(bvh) = &self.bvh else { return };
        let (center, size) = (bvh.bounds.center(), bvh.bounds.size());
        let ray = |i: u32| {
            let unit = |k: u32| Vec3::from([0, 1, 2].map(|axis| hash_to_unit(&[i, k, axis]) * 2.0 - 1.0));
            let origin = center + unit(0).normalize_or(Vec3::X) * size.length();
            [origin, (center + unit(1) * 0.5 * size - origin).normalize()]
        };
        let rays: Vec<[Vec3; 2]> = (0..RAYS).into_par_iter().map(ray).collect();
        let (start, level) = (Instant::now(), BuildConfig::default().level);
        let chunks = rays.par_chunks(4096);
        let found: Vec<Found> =
            chunks.map(|rays| level.dispatch(Closest { bvh, rays, every_block: false })).collect();
        self.mrays = self.mrays.max(rays.len() as f64 / start.elapsed().as_secs_f64() / 1e6);
        let hits = found.iter().flat_map(|found| &found.hits).filter(|hit| hit.1 != u32::MAX);
        self.found = Totals {
            distances: hits.map(|hit| f64::from(hit.0)).sum(),
            tests: [0, 1].map(|kind| found.iter().map(|found| found.tests[kind]).sum()),
        };
    }
}
