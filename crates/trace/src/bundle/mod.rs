//! Bundles: up to 64 rays that go much the same way share one walk.
//!
//! The walk tests nodes against intervals that hold all origins and directions of the bundle, eight boxes at once, as
//! S. Boulos, I. Wald, P. Shirley 2006, "Geometric and arithmetic culling methods for entire ray packets"; only at a leaf is every ray
//! tested, eight rays at once, with the leaf's box, and those that meet it with the leaf's triangles. The intervals
//! may be wide: then the walk is slow, not wrong. A ray's hit is found by the same test of the same triangles as alone.

mod space;

use crate::instance::MeshSpace;
use crate::judge::Judge;
use crate::mesh::Leaves;
use crate::paged::{Begin, End, Missing, Turn};
use crate::patch::Patch;
use crate::reach::{Meeting, meet};
use crate::tree::{InPages, Nodes, Over, Subtree, Tree, Visitor};
use crate::walk::Answers;
use crate::{Hit, Tracer};
use space::{NOWHERE, Place, Space};
use vastlight_accel::ray::TriangleRay;
use vastlight_accel::wide::{ChildRef, Leaf, MeshKeys, WideNode};
use vastlight_math::{Aabb, Ray};
use vastlight_paging::Table;
use vastlight_simd::Simd8;

/// Most rays of a bundle.
pub(crate) const RAYS: usize = 64;
/// Half of the fewest rays that are worth a bundle.
const FEWEST: usize = 8;
/// Groups of eight rays.
const GROUPS: usize = RAYS / 8;
/// Tests of nodes and of pairs of groups with leaves, for each ray, after which a bundle gives up.
const TESTS_PER_RAY: usize = 24;
/// Directions of rays that are tried as a bundle differ by at most this part of their length.
const LARGEST_SPREAD: f32 = 0.25;

/// How many of the first rays of a patch may go together: all that fit, half of them if the others lead away, or none.
#[inline(always)]
pub(crate) fn count(rays: &[Ray], patch: &Patch) -> usize {
    let count = patch.count.min(RAYS);
    let half = count.div_ceil(2);
    let near = patch.directions(rays, 0..half);
    let spread = |d: &Aabb| d.size().max_element();
    let longest = near.min.abs().max(near.max.abs()).max_element();
    if half < FEWEST || spread(&near) > LARGEST_SPREAD * longest {
        0
    } else if spread(&near.union(patch.directions(rays, half..count))) > 1.5 * spread(&near) {
        half
    } else {
        count
    }
}

/// A child that waits: where the first ray may enter it, and its slot.
#[derive(Clone, Copy, Debug)]
struct Entry {
    near: f32,
    child: ChildRef,
    node: u32,
    slot: u32,
}

impl Entry {
    const ROOT: u32 = u32::MAX;

    /// The root of a tree, which stands in no slot.
    fn root(child: ChildRef) -> Self {
        Self { near: 0.0, child, node: Self::ROOT, slot: 0 }
    }

    /// The box of the child, `root` that of the tree.
    #[inline(always)]
    fn bounds<S: Simd8>(&self, simd: S, nodes: &impl Nodes, root: &Aabb) -> Aabb {
        let node = if self.node == Self::ROOT { None } else { nodes.node(simd, self.node as usize) };
        node.map_or(*root, |node| node.bounds(self.slot as usize % 8))
    }
}

/// A bundle on its way, and its memory.
#[derive(Debug)]
pub(crate) struct Bundle {
    world: Space,
    mesh: Space,
    waiting: Vec<Entry>,
    best: [Hit; RAYS],
    /// Where each hit is and what is missing, and before which turn subtrees are left out, in scenes of pages.
    ends: [End; RAYS],
    restarts: [Turn; RAYS],
    /// The page and the subtree through which the bundle goes.
    page: u32,
    subtree: u32,
    /// How far each ray reaches.
    reach: [f32; RAYS],
    /// By lane of `mesh`, as far as `ready` says.
    triangles: [TriangleRay; RAYS],
    ready: u64,
    /// Tests that may still be made.
    tests: usize,
}

impl Default for Bundle {
    fn default() -> Self {
        Self {
            world: Space::default(),
            mesh: Space::default(),
            waiting: Vec::new(),
            best: [Hit::MISS; RAYS],
            ends: [End::COMPLETE; RAYS],
            restarts: [Turn::FIRST; RAYS],
            page: Hit::NONE,
            subtree: 0,
            reach: [NOWHERE; RAYS],
            triangles: [TriangleRay::default(); RAYS],
            ready: 0,
            tests: 0,
        }
    }
}

/// Rays of a batch that go together.
pub(crate) struct Job<'a, F, const ANY: bool> {
    pub(crate) tracer: &'a Tracer,
    pub(crate) pages: &'a Table,
    /// The batch.
    pub(crate) rays: &'a [Ray],
    /// Those of the bundle, at most [`RAYS`].
    pub(crate) patch: Patch,
    pub(crate) filter: &'a F,
}

impl Bundle {
    /// Traces all rays of the job. False if they turn out not to go together: then nothing is answered.
    #[inline(always)]
    pub(crate) fn trace<S: Simd8, F: Judge, A: Answers, const ANY: bool>(
        &mut self,
        simd: S,
        job: &Job<'_, F, ANY>,
        answers: &mut A,
    ) -> bool {
        let count = job.patch.count.min(RAYS);
        self.tests = TESTS_PER_RAY * count;
        let mut chosen = 0;
        for i in 0..count {
            let ray = &job.rays[job.patch.index(i)];
            let Begin { best, found, restart } = answers.begin(job.patch.index(i));
            (self.best[i], self.reach[i]) = (best, if best.is_hit() { best.t } else { ray.t_max });
            if F::PAGED {
                (self.ends[i], self.restarts[i]) = (End { found, ..End::COMPLETE }, restart);
            }
            let in_order = ray.t_min <= ray.t_max && ray.t_max >= 0.0;
            chosen |= u64::from(in_order) << i;
        }
        self.waiting.clear();
        match job.tracer.top.root {
            // A scene of one instance needs no boxes here.
            Some(root) if root.is_leaf() => {
                self.cross_instance(simd, job, root.index(), chosen);
            }
            Some(root) => self.cross_top(simd, job, root, chosen),
            None => {}
        }
        if self.tests == 0 {
            return false;
        }
        for (i, (hit, end)) in self.best.iter().zip(&self.ends).enumerate().take(count) {
            answers.set(job.patch.index(i), hit, end);
        }
        true
    }

    /// The next leaf above `floor` among those that wait, of the top level or of a mesh; none either if the bundle gives
    /// up.
    #[inline(always)]
    fn next_leaf<S: Simd8, const TOP: bool>(
        &mut self,
        simd: S,
        nodes: &impl Nodes,
        floor: usize,
    ) -> Option<Entry> {
        let space = if TOP { &self.world } else { &self.mesh };
        while self.waiting.len() > floor && self.tests > 0 {
            let entry = self.waiting.pop()?;
            if entry.near > space.last {
                continue;
            }
            self.tests -= 1;
            if entry.child.is_leaf() {
                return Some(entry);
            }
            descend(simd, space, nodes, entry.child, &mut self.waiting);
        }
        None
    }

    /// Walks among instances.
    #[inline(always)]
    fn cross_top<S: Simd8, F: Judge, const ANY: bool>(
        &mut self,
        simd: S,
        job: &Job<'_, F, ANY>,
        root: ChildRef,
        chosen: u64,
    ) {
        let tracer = job.tracer;
        let (extent, margin_factor) = (tracer.places.extent, tracer.places.margin_factor);
        let place = Place { placed: None, moving: None, extent, margin_factor };
        self.world.load(simd, &place, (job.rays, &job.patch), chosen, &self.reach);
        self.waiting.push(Entry::root(root));
        let nodes = &tracer.top.nodes;
        while let Some(entry) = self.next_leaf::<S, true>(simd, nodes, 0) {
            let lanes = self.world.meeting(simd, &entry.bounds(simd, nodes, &Aabb::EMPTY));
            let rays = self.rays_of(lanes);
            if rays != 0 && self.cross_instance(simd, job, entry.child.index(), rays) {
                self.shorten_in_world::<S, ANY>(simd, lanes);
            }
        }
    }

    /// The rays in lanes of the world, as bits.
    #[inline(always)]
    fn rays_of(&self, mut lanes: u64) -> u64 {
        let mut rays = 0;
        while lanes != 0 {
            rays |= 1 << self.world.member(lanes.trailing_zeros() as usize);
            lanes &= lanes - 1;
        }
        rays
    }

    /// Walks through the mesh of an instance; whether any ray hit it.
    #[inline(always)]
    fn cross_instance<S: Simd8, F: Judge, const ANY: bool>(
        &mut self,
        simd: S,
        job: &Job<'_, F, ANY>,
        instance: usize,
        rays: u64,
    ) -> bool {
        let mut room = None;
        let Some(placed) = job.tracer.places.get(instance, &mut room) else { return false };
        let mesh = &job.tracer.meshes[placed.mesh as usize];
        let (Some(root), true) = (mesh.root(), rays != 0) else { return false };
        let MeshSpace { bounds, extent, .. } = mesh.space();
        let moving = placed.moves.then_some((&job.tracer.places, instance));
        let place = Place { placed: Some(placed), moving, extent, margin_factor: 1.0 };
        self.mesh.load(simd, &place, (job.rays, &job.patch), rays, &self.reach);
        self.ready = 0;
        let task = Task { job, instance: instance as u32, extent };
        let (nodes, memory) = (mesh.nodes(), mesh.memory());
        if F::PAGED {
            // Known once the bundle comes to a page; a mesh beside them has none.
            self.page = Hit::NONE;
        }
        match mesh.leaves() {
            Leaves::Blocks(leaves) => {
                self.cross(simd, &task, &Over { nodes, leaves, memory }, (root, &bounds))
            }
            Leaves::Pages(mesh) => {
                let leaves = InPages { mesh, pages: job.pages };
                self.cross(simd, &task, &Over { nodes, leaves, memory }, (root, &bounds))
            }
            // What is in pages stands still.
            Leaves::Keys(_) if F::PAGED => false,
            Leaves::Keys(keys) => self.cross(simd, &task, &Over::all_times(keys), (root, &bounds)),
        }
    }

    /// Walks through what is below the root of a tree, whose box is given; whether any ray hit it.
    #[inline(always)]
    fn cross<S: Simd8, F: Judge, const ANY: bool>(
        &mut self,
        simd: S,
        task: &Task<'_, '_, F, ANY>,
        tree: &impl Tree,
        (root, bounds): (ChildRef, &Aabb),
    ) -> bool {
        let floor = self.waiting.len();
        let mut found_any = false;
        self.waiting.push(Entry::root(root));
        while let Some(entry) = self.next_leaf::<S, false>(simd, tree, floor) {
            self.tests = self.tests.saturating_sub(self.mesh.groups() / 2);
            let bounds = entry.bounds(simd, tree, bounds);
            let met = self.mesh.meeting(simd, &bounds);
            let mut visit = Visit { bundle: self, task, met, bounds };
            if met != 0 && tree.visit(simd, &mut visit, entry.child.index()) {
                found_any = true;
                self.mesh.shortened(simd);
            }
        }
        found_any
    }

    /// Tests the rays in some lanes with triangles; whether one was hit.
    #[inline(always)]
    fn meet<S: Simd8, F: Judge, const ANY: bool>(
        &mut self,
        simd: S,
        task: &Task<'_, '_, F, ANY>,
        leaf: &impl Leaf,
        mut lanes: u64,
    ) -> bool {
        let mut found_any = false;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % RAYS;
            lanes &= lanes - 1;
            if self.ready >> lane & 1 == 0 {
                self.triangles[lane] = self.mesh.triangle_ray(lane, task.extent);
                self.ready |= 1 << lane;
            }
            let mut reach = self.mesh.reach(lane);
            let i = self.mesh.member(lane);
            let ray = (&self.triangles[lane], task.job.patch.index(i));
            let (best, found) = (&mut self.best[i], &mut self.ends[i].found);
            let mut meeting = Meeting { best, found, unknown: None };
            let place = (leaf, task.instance, self.page);
            let met = meet(simd, place, ray, task.job.filter, &mut reach, &mut meeting);
            if F::PAGED
                && let Some(attributes) = meeting.unknown
            {
                self.miss(task, lane, attributes);
            }
            if met {
                self.reach[i] = if ANY { NOWHERE } else { self.best[i].t };
                self.mesh.shorten(lane, if ANY { NOWHERE } else { reach.t_max });
                found_any = true;
            }
        }
        found_any
    }

    /// The turn of the subtree through which the bundle goes, for the ray in a lane.
    fn turn<F: Judge, const ANY: bool>(&self, task: &Task<'_, '_, F, ANY>, lane: usize) -> Turn {
        let tracer = task.job.tracer;
        let mesh = &tracer.meshes[tracer.places.mesh(task.instance as usize) as usize];
        let Leaves::Pages(mesh) = mesh.leaves() else { return Turn::NEVER };
        let ray = &task.job.rays[task.job.patch.index(self.mesh.member(lane))];
        let subtree = (self.subtree, &mesh.roots[self.subtree as usize]);
        Turn::in_world(tracer, ray, task.instance, subtree)
    }

    /// Notes that the ray in a lane misses the page of this subtree, or attributes of it.
    #[cold]
    fn miss<F: Judge, const ANY: bool>(&mut self, task: &Task<'_, '_, F, ANY>, lane: usize, attributes: u32) {
        let (i, turn) = (self.mesh.member(lane), self.turn(task, lane));
        if turn >= self.restarts[i] {
            self.ends[i].missing.or(Missing { turn, page: self.page, attributes });
        }
    }

    /// Whether the turn of this subtree is over for the rays in all of these lanes.
    #[inline(always)]
    fn is_over<F: Judge, const ANY: bool>(&self, task: &Task<'_, '_, F, ANY>, mut lanes: u64) -> bool {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % RAYS;
            lanes &= lanes - 1;
            let restart = self.restarts[self.mesh.member(lane)];
            if restart == Turn::FIRST || self.turn(task, lane) >= restart {
                return false;
            }
        }
        true
    }

    /// Takes the hits in an instance into account among instances.
    #[inline(always)]
    fn shorten_in_world<S: Simd8, const ANY: bool>(&mut self, simd: S, mut lanes: u64) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % RAYS;
            lanes &= lanes - 1;
            let t_scale = self.world.reach(lane).t_scale;
            self.world.shorten(lane, self.reach[self.world.member(lane)] / t_scale);
        }
        self.world.shortened(simd);
    }
}

/// Puts the children of a node that rays may meet aside, the nearest on top.
#[inline(always)]
fn descend<S: Simd8>(simd: S, space: &Space, nodes: &impl Nodes, node: ChildRef, waiting: &mut Vec<Entry>) {
    let number = node.index();
    let Some(node) = nodes.node(simd, number) else { return };
    let (mut hits, near) = space.may_meet(simd, &node);
    let near = simd.to_array(near);
    let bottom = waiting.len();
    while hits != 0 {
        let slot = hits.trailing_zeros() as usize % 8;
        hits &= hits - 1;
        let entry = Entry {
            near: near[slot],
            child: node.child(number, slot),
            node: number as u32,
            slot: slot as u32,
        };
        let mut place = waiting.len();
        waiting.push(entry);
        while place > bottom && waiting[place - 1].near < entry.near {
            waiting.swap(place, place - 1);
            place -= 1;
        }
    }
}

/// A job in the mesh of an instance.
struct Task<'t, 'j, F, const ANY: bool> {
    job: &'t Job<'j, F, ANY>,
    instance: u32,
    /// Largest coordinate of the mesh.
    extent: f32,
}

/// A bundle at a leaf with this box, which the rays in the lanes `met` meet.
struct Visit<'v, 't, 'j, F, const ANY: bool> {
    bundle: &'v mut Bundle,
    task: &'v Task<'t, 'j, F, ANY>,
    met: u64,
    bounds: Aabb,
}

impl<F: Judge, const ANY: bool> Visit<'_, '_, '_, F, ANY> {
    /// Notes that the page is missing for all rays that meet the leaf.
    #[cold]
    fn missing_page(&mut self) {
        let mut lanes = self.met;
        while lanes != 0 {
            self.bundle.miss(self.task, lanes.trailing_zeros() as usize % RAYS, Hit::NONE);
            lanes &= lanes - 1;
        }
    }
}

impl<S: Simd8, F: Judge, const ANY: bool> Visitor<S> for Visit<'_, '_, '_, F, ANY> {
    #[inline(always)]
    fn triangles(&mut self, simd: S, triangles: &impl Leaf) -> bool {
        self.bundle.meet(simd, self.task, triangles, self.met)
    }

    #[inline(always)]
    fn moving(&mut self, simd: S, keys: &MeshKeys, leaf: usize) -> bool {
        let (mut lanes, mut found_any, job) = (self.met, false, self.task.job);
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % RAYS;
            lanes &= lanes - 1;
            let ray = &job.rays[job.patch.index(self.bundle.mesh.member(lane))];
            let block = keys.block(simd, leaf, &keys.between(ray.time));
            found_any |= block.is_some_and(|block| self.bundle.meet(simd, self.task, &block, 1 << lane));
        }
        found_any
    }

    #[inline(always)]
    fn subtree(&mut self, simd: S, subtree: &Subtree<'_>) -> bool {
        let Subtree { number, root, page } = subtree;
        if F::PAGED {
            (self.bundle.page, self.bundle.subtree) = (root.page, *number);
            let filter = self.task.job.filter;
            if filter.is_done(root.page) || self.bundle.is_over(self.task, self.met) {
                return false;
            }
            match page {
                Some(_) => filter.uses(root.page),
                None => self.missing_page(),
            }
        }
        let Some(page) = page else { return false };
        self.bundle.cross(simd, self.task, page, (root.node(), &self.bounds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patch::Strip;
    use vastlight_math::Vec3;

    fn rays(direction: impl Fn(usize) -> [f32; 2]) -> Vec<Ray> {
        let ray = |i: usize| {
            let [x, y] = direction(i);
            Ray::new(Vec3::ZERO, Vec3::new(x, y, -1.0))
        };
        (0..100).map(ray).collect()
    }

    #[test]
    fn compact_blocks_go_together_lines_by_half_and_wide_beams_not() {
        let block = rays(|i| [(i % 8) as f32 * 1e-3, (i / 8) as f32 * 1e-3]);
        let count =
            |rays: &[Ray]| Strip::row(0..rays.len()).patch(0, RAYS).map_or(0, |p| super::count(rays, &p));
        assert_eq!([count(&block), count(&block[..20]), count(&block[..14])], [64, 20, 0]);
        assert_eq!(count(&rays(|i| [i as f32 * 1e-3, 0.0])), 32);
        assert_eq!(count(&rays(|i| [(i % 7) as f32 * 0.1, 0.0])), 0);
        assert_eq!(count(&rays(|i| [if i % 2 == 0 { f32::NAN } else { 0.0 }, 0.0])), 64);
        assert_eq!(count(&[]), 0);
    }
}
