//! What `bench build --device gpu` does.

use crate::build::wide::{self, DeviceWide, Wide};
use crate::build::{self, Builder, Count, DeviceTree, boxes, parts};
use crate::error::GpuError;
use crate::recording::{Buffer, Recording, Resident};
use crate::run::Executor;
use std::time::Instant;
use vastlight_accel::BinaryTree;
use vastlight_math::Vec3;

/// Elements for each of which there is room for a wide node, four times what is usual.
const ELEMENTS_PER_WIDE_NODE: u32 = 4;

/// The times of a build.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildFigures {
    /// Best time in milliseconds, from triangles on the device to wide nodes there.
    pub ms: f64,
    /// The first time, when some drivers finish compiling.
    pub first_ms: f64,
    /// Compiling the kernels that were not ready, before the first.
    pub compile_ms: f64,
    /// Stages, in milliseconds: how much longer the best build is that ends with each. They sum to [`Self::ms`].
    pub stages: Vec<(&'static str, f64)>,
    /// New boxes for a finished tree, from the triangles on; none for trees over parts.
    pub refit_ms: Option<f64>,
    /// Dispatches of the build.
    pub dispatches: usize,
    /// Those of its sort.
    pub sort_dispatches: usize,
}

/// A mesh and how to build over it.
#[derive(Clone, Copy, Debug)]
pub struct BuildInput<'a> {
    /// Vertices.
    pub positions: &'a [Vec3],
    /// Three vertices a triangle.
    pub triangles: &'a [[u32; 3]],
    /// What finds the tree.
    pub builder: Builder,
    /// Most triangles in a leaf.
    pub leaf: u32,
    /// Most parts of triangles, as a multiple of the triangles; none leaves these whole.
    pub split_budget: Option<f32>,
}

/// The figures, the tree, whose elements are numbers of triangles, and the wide one over it.
pub type Built = (BuildFigures, BinaryTree, Wide);

/// Builds over a mesh `repeat` times (at least once).
///
/// # Errors
/// There are too many triangles for the device, or it fails.
pub fn build(executor: &mut Executor, input: &BuildInput<'_>, repeat: u32) -> Result<Built, GpuError> {
    let positions = executor.keep("positions", input.positions)?;
    let kept = executor.keep("triangles", input.triangles);
    let triangles = kept.inspect_err(|_| executor.release(positions))?;
    let outcome = build_in(executor, input, repeat, [positions, triangles]);
    [positions, triangles].into_iter().for_each(|room| executor.release(room));
    outcome
}

fn build_in(
    executor: &mut Executor,
    input: &BuildInput<'_>,
    repeat: u32,
    rooms: [Resident; 2],
) -> Result<Built, GpuError> {
    let Recorded { mut recording, tree, owners, wide, stages } = Recorded::new(input, rooms)?;
    let at = |name: &str| stages.iter().position(|stage| stage.0 == name);
    let place = |name: &str| at(name).unwrap_or_default();
    let mut compile_ms = 0.0;
    executor.prepare(&recording.kernels(), &mut |progress| compile_ms += progress.ms)?;
    let parts: Vec<Recording> = stages.iter().map(|stage| recording.up_to(stage.1)).collect();
    let (first_ms, ends) = measured(executor, &parts, (place("collapse"), repeat))?;
    let starts = std::iter::once(0.0).chain(ends.iter().copied());
    let taken = ends.iter().zip(starts).map(|(end, start)| end - start);
    let mut times: Vec<(&'static str, f64)> = stages.iter().map(|stage| stage.0).zip(taken).collect();
    let refit_ms = at("refit").map(|refit| times.remove(refit).1);

    let downloads = [
        recording.download(tree.nodes, build::NODE_WORDS * u64::from(tree.most_nodes())),
        recording.download(tree.pairs, 1),
        recording.download(tree.order, tree.count.into()),
    ];
    let owners = owners.map(|owners| recording.download(owners, tree.count.into()));
    let wide = wide.download(&mut recording);
    let results = executor.run(&recording)?;
    let [nodes, pairs, order] = downloads.map(|download| results.words(download));
    let wide = wide.wide(&results)?;
    let mut tree = build::tree_of_words(&nodes, pairs[0], order);
    if let Some(owners) = owners.map(|owners| results.words(owners)) {
        tree.prims.iter_mut().for_each(|part| *part = owners.get(*part as usize).copied().unwrap_or(*part));
    }
    let figures = BuildFigures {
        ms: times.iter().map(|stage| stage.1).sum(),
        first_ms,
        compile_ms,
        stages: times,
        refit_ms,
        dispatches: parts[place("collapse")].dispatches(),
        sort_dispatches: parts[place("sort")].dispatches() - parts[place("codes")].dispatches(),
    };
    Ok((figures, tree, wide))
}

/// A build, its collapse and a refit, on paper.
struct Recorded {
    recording: Recording,
    tree: DeviceTree,
    /// Triangles of parts.
    owners: Option<Buffer>,
    wide: DeviceWide,
    stages: build::Stages,
}

impl Recorded {
    fn new(input: &BuildInput<'_>, rooms: [Resident; 2]) -> Result<Self, GpuError> {
        let count = u32::try_from(input.triangles.len()).unwrap_or(u32::MAX);
        let (mut recording, mut stages) = (Recording::new(), Vec::new());
        let mesh = rooms.map(|room| recording.resident("mesh", room));
        let triangles = boxes::record(&mut recording, mesh[0], mesh[1], count)?;
        stages.push(("triangles", recording.commands().len()));
        let parts = match input.split_budget {
            Some(budget) => {
                let most = (count, parts::most_parts(count, budget));
                let parts = parts::record(&mut recording, mesh, triangles, most)?;
                stages.push(("split", recording.commands().len()));
                Some(parts)
            }
            None => None,
        };
        let (boxes, number) =
            parts.map_or((triangles, Count::exactly(count)), |parts| (parts.boxes, parts.count));
        let fits = (number, input.leaf);
        let tree = build::record_counted(&mut recording, input.builder, boxes, fits, &mut stages)?;
        let room = number.most / ELEMENTS_PER_WIDE_NODE + 16;
        let wide = wide::record(&mut recording, &tree, room)?;
        stages.push(("collapse", recording.commands().len()));
        if parts.is_none() {
            refit(&mut recording, mesh, &tree)?;
            stages.push(("refit", recording.commands().len()));
        }
        let owners = parts.map(|parts| parts.owners);
        Ok(Self { recording, tree, owners, wide, stages })
    }
}

fn refit(recording: &mut Recording, mesh: [Buffer; 2], tree: &DeviceTree) -> Result<(), GpuError> {
    let triangles = boxes::record(recording, mesh[0], mesh[1], tree.count)?;
    build::record_refit(recording, tree, triangles)
}

/// The time of the first run of one of some parts, and the best times of all, none of which is less than that of one before.
fn measured(
    executor: &mut Executor,
    parts: &[Recording],
    (first, repeat): (usize, u32),
) -> Result<(f64, Vec<f64>), GpuError> {
    let mut run = |part: &Recording| {
        let start = Instant::now();
        executor.run(part).map(|_| start.elapsed().as_secs_f64() * 1e3)
    };
    let first_ms = run(&parts[first])?;
    let mut best = vec![f64::INFINITY; parts.len()];
    for _ in 0..repeat.max(1) {
        for (best, part) in best.iter_mut().zip(parts) {
            *best = best.min(run(part)?);
        }
    }
    for i in 1..best.len() {
        best[i] = best[i].max(best[i - 1]);
    }
    Ok((first_ms, best))
}
