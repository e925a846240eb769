//! The structure of one mesh through time: by which method it follows new vertices.

use crate::tracer::milliseconds;
use std::time::Instant;
use vastlight_accel::update::{DynamicMesh, Method, UpdateConfig, UpdateReport, refit};
use vastlight_accel::wide::{MeshBvh, MeshKeys, MeshView};
use vastlight_accel::{BuildConfig, BuildError, ClusterConfig, Clusters, Scratch};

/// How the structure of a mesh follows new vertices. No method changes a hit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpdateMethod {
    /// What the costs that were measured so far let expect the least of.
    #[default]
    Auto,
    /// New boxes for the same tree.
    Refit,
    /// New boxes, and children change places with grandchildren.
    Rotate,
    /// The clustered update of Garanzha's thesis of 2014, chapter 2.
    Clustered,
    /// A new tree each time.
    Rebuild,
}

impl UpdateMethod {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Clustered, Self::Refit, Self::Rotate, Self::Rebuild, Self::Auto];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Refit => "refit",
            Self::Rotate => "rotate",
            Self::Clustered => "clustered",
            Self::Rebuild => "rebuild",
        }
    }

    /// The method of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}

/// What following took and did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FollowReport {
    /// What was done, never [`UpdateMethod::Auto`].
    pub method: UpdateMethod,
    /// Wall time in milliseconds.
    pub ms: f64,
    /// Binary nodes that were rebuilt, as a share of all.
    pub rebuilt: f64,
    /// Subtrees that were put elsewhere, as a share of all nodes.
    pub migrated: f64,
    /// Milliseconds of making clusters before, once for each mesh.
    pub clusters_ms: f64,
}

/// A mesh that moves, with what its method keeps.
#[derive(Debug)]
pub(crate) struct MovingMesh {
    kept: Kept,
    plan: UpdatePlan,
    /// While a shutter is open: what rays walk instead.
    keys: Option<MeshKeys>,
}

#[derive(Debug)]
enum Kept {
    /// What rays walk alone.
    Bvh(MeshBvh),
    /// A binary tree besides.
    Dynamic(Box<DynamicMesh>),
    /// Clusters, over which trees are built.
    Clusters(Box<(Clusters, MeshBvh)>),
}

/// How structures are built.
pub(crate) struct Building<'a> {
    pub(crate) accel: &'a str,
    pub(crate) config: BuildConfig,
    /// Clusters for meshes that are rebuilt.
    pub(crate) clusters: Option<ClusterConfig>,
    pub(crate) scratch: &'a mut Scratch,
}

impl MovingMesh {
    /// A mesh that moves for the first time: its first structure, and what building it took.
    pub(crate) fn new(
        mesh: &MeshView<'_>,
        method: UpdateMethod,
        building: &mut Building<'_>,
    ) -> Result<(Self, FollowReport), BuildError> {
        let start = Instant::now();
        let mut kept = Kept::before(mesh, method, building);
        let clusters_ms = milliseconds(start.elapsed());
        kept.build(mesh, method, building)?;
        let ms = milliseconds(start.elapsed()) - clusters_ms;
        let report =
            FollowReport { method: UpdateMethod::Rebuild, ms, clusters_ms, ..FollowReport::default() };
        let plan = UpdatePlan::new(ms, kept.cost());
        Ok((Self { kept, plan, keys: None }, report))
    }

    /// A mesh that moves while a shutter is open, over the structure that it had.
    pub(crate) fn of(bvh: MeshBvh) -> Self {
        Self { kept: Kept::Bvh(bvh), plan: UpdatePlan::new(0.0, 1.0), keys: None }
    }

    /// Lets rays see the mesh at keys, of which the last pose was the first.
    pub(crate) fn open(&mut self, keys: &[MeshView<'_>]) {
        self.keys = Some(MeshKeys::new(self.bvh(), keys));
    }

    pub(crate) fn keys(&self) -> Option<&MeshKeys> {
        self.keys.as_ref()
    }

    /// Follows the mesh to new vertices; `trace_ms` is what tracing takes until the next ones.
    pub(crate) fn follow(
        &mut self,
        mesh: &MeshView<'_>,
        method: UpdateMethod,
        trace_ms: f64,
        building: &mut Building<'_>,
    ) -> Result<FollowReport, BuildError> {
        let start = Instant::now();
        self.keys = None;
        let chosen = if method == UpdateMethod::Auto { self.plan.choose() } else { method };
        let mut report = FollowReport { method: chosen, ..FollowReport::default() };
        match self.kept.update(mesh, chosen) {
            Some(done) => (report.rebuilt, report.migrated) = (done.rebuilt, done.migrated),
            None => {
                let before = self.kept.cost();
                self.kept.build(mesh, method, building)?;
                report = FollowReport { method: UpdateMethod::Rebuild, rebuilt: 1.0, ..report };
                let built_ms = milliseconds(start.elapsed());
                self.plan.built(built_ms, [before, self.kept.cost()], trace_ms);
            }
        }
        if method == UpdateMethod::Auto {
            let updated_ms = milliseconds(start.elapsed());
            self.plan.updated(report.method, updated_ms, self.kept.cost(), trace_ms);
        }
        report.ms = milliseconds(start.elapsed());
        Ok(report)
    }

    #[inline(always)]
    pub(crate) fn bvh(&self) -> &MeshBvh {
        match &self.kept {
            Kept::Bvh(bvh) => bvh,
            Kept::Dynamic(mesh) => mesh.bvh(),
            Kept::Clusters(kept) => &kept.1,
        }
    }

    /// The clusters over which trees are built.
    pub(crate) fn clusters(&self) -> Option<&Clusters> {
        match &self.kept {
            Kept::Clusters(kept) => Some(&kept.0),
            _ => None,
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        let kept = match &self.kept {
            Kept::Bvh(bvh) => bvh.bytes(),
            Kept::Dynamic(mesh) => mesh.bytes(),
            Kept::Clusters(kept) => kept.0.bytes() + kept.1.bytes(),
        };
        kept + self.keys.as_ref().map_or(0, MeshKeys::bytes)
    }
}

impl Default for Kept {
    fn default() -> Self {
        Self::Bvh(MeshBvh::default())
    }
}

impl Kept {
    /// What is made once, before the first tree.
    fn before(mesh: &MeshView<'_>, method: UpdateMethod, building: &Building<'_>) -> Self {
        match building.clusters {
            Some(config) if method == UpdateMethod::Rebuild => {
                Self::Clusters(Box::new((Clusters::new(mesh, &config), MeshBvh::default())))
            }
            _ => Self::default(),
        }
    }

    /// Builds anew, with what the method needs later. The memory of an old tree is there for the next one.
    fn build(
        &mut self,
        mesh: &MeshView<'_>,
        method: UpdateMethod,
        building: &mut Building<'_>,
    ) -> Result<(), BuildError> {
        let Building { accel, config, scratch, .. } = building;
        if let Self::Clusters(kept) = self {
            let (clusters, bvh) = &mut **kept;
            return clusters.rebuild(accel, mesh, config, scratch, bvh).map(|_| ());
        }
        *self = Self::default();
        *self = match method {
            UpdateMethod::Rebuild | UpdateMethod::Refit => {
                Self::Bvh(MeshBvh::build(accel, mesh, config, scratch)?.0)
            }
            _ => Self::Dynamic(Box::new(DynamicMesh::new(accel, mesh, config, scratch)?.0)),
        };
        Ok(())
    }

    /// Updates what is there; none where it must be built anew.
    fn update(&mut self, mesh: &MeshView<'_>, method: UpdateMethod) -> Option<UpdateReport> {
        let method = match method {
            UpdateMethod::Refit => Method::Refit,
            UpdateMethod::Rotate => Method::Rotate,
            UpdateMethod::Clustered => Method::Clustered,
            UpdateMethod::Rebuild | UpdateMethod::Auto => return None,
        };
        match self {
            Self::Dynamic(dynamic) => dynamic.update(mesh, method, &UpdateConfig::default()).ok(),
            Self::Bvh(bvh) if method == Method::Refit => {
                refit(bvh, mesh);
                Some(UpdateReport::default())
            }
            Self::Bvh(_) | Self::Clusters(_) => None,
        }
    }

    /// The expected cost of a ray; 1 where only new trees come into question.
    fn cost(&self) -> f64 {
        match self {
            Self::Bvh(_) | Self::Clusters(_) => 1.0,
            Self::Dynamic(mesh) => mesh.cost(),
        }
    }
}

/// When a tree that is updated from moment to moment is built anew, and by which method it is updated meanwhile.
///
/// Rays over a tree that was updated `n` times cost `1 + n * slope` times what they do over a fresh one, nearly. Where tracing takes
/// `T`, a build `B` more than an update, builds every `n` moments cost `B / n + T * slope * n / 2` a moment, which is least
/// at `n = sqrt(2 B / (T * slope))`. Times and slopes are measured: the cost of the old tree is compared with that of the
/// new one whenever one is built. Both ways to update are tried, the better one stays until the other promises a tenth less.
///
/// What was slow may burst: as soon as the loss of a moment, by the tree's cost beside that when it was built, is larger than what
/// builds and losses cost a moment so far, it is built (for a steady slope the same rule).
#[derive(Clone, Copy, Debug)]
struct UpdatePlan {
    build_ms: f64,
    ways: [Way; 2],
    /// Which of the ways is in use.
    way: usize,
    /// Updates since the last build, and how many there are before the next.
    updates: u32,
    period: u32,
    /// Builds that followed each other.
    builds: u32,
    /// The tree's cost when it was built, and after the last update as a multiple of it.
    fresh_cost: f64,
    decay: f64,
    /// What rays lost since then, in milliseconds.
    lost_ms: f64,
}

/// What is known of a way to update.
#[derive(Clone, Copy, Debug)]
struct Way {
    method: UpdateMethod,
    ms: f64,
    /// By how much rays get dearer with each update; none before it was tried.
    slope: Option<f64>,
}

/// Updates before the first build that measures.
const FIRST_PERIOD: u32 = 8;
/// Most updates before a build.
const LONGEST_PERIOD: u32 = 128;
/// Builds in a row after which an update is tried again.
const MOST_BUILDS: u32 = 64;

impl UpdatePlan {
    fn new(build_ms: f64, fresh_cost: f64) -> Self {
        let ways = [UpdateMethod::Clustered, UpdateMethod::Refit];
        let ways = ways.map(|method| Way { method, ms: 0.0, slope: None });
        Self {
            build_ms,
            ways,
            way: 0,
            updates: 0,
            period: FIRST_PERIOD,
            builds: 0,
            fresh_cost,
            decay: 1.0,
            lost_ms: 0.0,
        }
    }

    /// What to do at the next moment.
    fn choose(&self) -> UpdateMethod {
        if self.updates >= self.period { UpdateMethod::Rebuild } else { self.ways[self.way].method }
    }

    /// An update took so long, and left a tree of this cost. Tracing took `trace_ms` before.
    fn updated(&mut self, method: UpdateMethod, ms: f64, cost: f64, trace_ms: f64) {
        let Some(way) = self.ways.iter_mut().find(|way| way.method == method) else { return };
        way.ms = if way.ms == 0.0 { ms } else { 0.75 * way.ms + 0.25 * ms };
        self.updates += 1;
        self.builds = 0;
        let fresh_ms = trace_ms / self.decay;
        self.decay = (cost / self.fresh_cost).max(1.0);
        let loss = fresh_ms * (self.decay - 1.0);
        self.lost_ms += loss;
        if loss > (self.build_ms + self.lost_ms) / f64::from(self.updates) {
            self.period = self.updates;
        }
    }

    /// A tree was built; its cost, after that of the old one.
    fn built(&mut self, ms: f64, [old, new]: [f64; 2], trace_ms: f64) {
        self.build_ms = ms;
        if self.updates > 0 {
            let slope = ((old / new - 1.0) / f64::from(self.updates)).max(0.0);
            let known = &mut self.ways[self.way].slope;
            *known = Some(known.map_or(slope, |old| 0.5 * (old + slope)));
        }
        (self.fresh_cost, self.decay, self.lost_ms) = (new, 1.0, 0.0);
        self.updates = 0;
        let untried = self.ways.iter().position(|way| way.slope.is_none());
        if let Some(untried) = untried {
            (self.way, self.period) = (untried, FIRST_PERIOD);
            return;
        }
        let costs = self.ways.map(|way| self.cost(&way, trace_ms));
        let other = 1 - self.way;
        if costs[other].0 < 0.9 * costs[self.way].0 {
            self.way = other;
        }
        self.builds += 1;
        let (cost, period) = costs[self.way];
        let is_dear = cost > self.build_ms;
        self.period = if is_dear && self.builds < MOST_BUILDS { 0 } else { period };
    }

    /// What a moment costs by a way on average, in milliseconds, and the best number of updates between builds.
    fn cost(&self, way: &Way, trace_ms: f64) -> (f64, u32) {
        let dearer = (self.build_ms - way.ms).max(0.0);
        let loss = trace_ms * way.slope.unwrap_or(0.0);
        let best = (2.0 * dearer / loss.max(1e-9)).sqrt().clamp(1.0, f64::from(LONGEST_PERIOD)).round();
        (way.ms + dearer / best + 0.5 * loss * best, best as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moments of a mesh whose rays get dearer by these slopes, clustered and refitted; gives what was done and the loss.
    fn run(slopes: [f64; 2], times: [f64; 4], moments: u32) -> ([u32; 3], f64) {
        run_through(|_| slopes, times, moments)
    }

    /// The same with slopes of each moment.
    fn run_through(
        slopes: impl Fn(u32) -> [f64; 2],
        [update, refit, build, trace]: [f64; 4],
        moments: u32,
    ) -> ([u32; 3], f64) {
        let mut plan = UpdatePlan::new(build, 20.0);
        let (mut done, mut decay, mut total) = ([0; 3], 1.0, 0.0);
        for moment in 0..moments {
            let method = plan.choose();
            let (i, ms) = match method {
                UpdateMethod::Clustered => (0, update),
                UpdateMethod::Refit => (1, refit),
                _ => (2, build),
            };
            let told = trace * decay;
            if i == 2 {
                plan.built(build, [20.0 * decay, 20.0], told);
                decay = 1.0;
            } else {
                decay += slopes(moment)[i];
            }
            plan.updated(method, ms, 20.0 * decay, told);
            done[i] += 1;
            total += ms + trace * decay;
        }
        (done, total)
    }

    #[test]
    fn what_is_cheapest_is_done() {
        // Nothing decays: the cheaper way to update, hardly a build.
        let (done, _) = run([0.0, 0.0], [5.0, 2.0, 30.0, 100.0], 500);
        assert!(done[1] > 450 && done[2] < 10, "{done:?}");
        // Refitted trees decay fast.
        let (done, _) = run([0.0005, 0.1], [5.0, 2.0, 30.0, 500.0], 500);
        assert!(done[0] > 400 && done[2] < 50, "{done:?}");
        // Tracing takes so long that nothing but fresh trees will do.
        let (done, _) = run([0.02, 0.1], [5.0, 2.0, 30.0, 20_000.0], 500);
        assert!(done[2] > 230, "{done:?}");
    }

    #[test]
    fn steady_losses_end_in_a_build_at_the_best_moment() {
        let mut plan = UpdatePlan::new(100.0, 20.0);
        for fresh in [20.0, 50.0] {
            plan.period = LONGEST_PERIOD;
            // The loss of moment n, n, is first larger than the mean of so many moments, (100 + n (n + 1) / 2) / n.
            let decay = |n: u32| 1.0 + 0.01 * f64::from(n);
            for n in 1..=15 {
                assert_ne!(plan.choose(), UpdateMethod::Rebuild, "{n}");
                plan.updated(plan.ways[plan.way].method, 1.0, fresh * decay(n), 100.0 * decay(n - 1));
            }
            assert_eq!(plan.choose(), UpdateMethod::Rebuild);
            plan.built(100.0, [fresh * decay(15), 50.0], 100.0);
        }
    }

    #[test]
    fn what_bursts_after_a_long_rest_is_noticed() {
        for trace in [10.0, 60.0, 600.0] {
            for burst in [20, 75, 140] {
                let slopes = |moment: u32| if moment < burst { [0.0, 0.0] } else { [0.002, 0.5] };
                let (_, total) = run_through(slopes, [6.0, 2.5, 15.0, trace], 300);
                let moving = f64::from(300 - burst);
                let always =
                    |ms: f64, slope: f64| 300.0 * (ms + trace) + trace * slope * 0.5 * moving * moving;
                let best = always(6.0, 0.002).min(always(2.5, 0.5)).min(always(15.0, 0.0));
                assert!(total < 1.06 * best, "{trace} {burst}: {total} against {best}");
            }
        }
    }

    #[test]
    fn the_sum_is_near_the_best_with_hindsight() {
        for trace in [10.0, 100.0, 1000.0, 10_000.0] {
            for slopes in [[0.0, 0.0], [0.001, 0.03], [0.01, 0.01], [0.05, 0.3]] {
                let times = [6.0, 2.5, 28.0, trace];
                let (_, total) = run(slopes, times, 300);
                let always = |ms: f64, slope: f64| {
                    (1..=300).map(|n| ms + trace * (1.0 + slope * f64::from(n))).sum::<f64>()
                };
                let best = always(6.0, slopes[0]).min(always(2.5, slopes[1])).min(always(28.0, 0.0));
                assert!(total < 1.06 * best, "{trace} {slopes:?}: {total} against {best}");
            }
        }
    }
}
