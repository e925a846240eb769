//! A ray on its way through both levels: instances, then the triangles of their meshes.
//!
//! A flight goes on by single steps (a node, a block of triangles, or the way into an instance), so that several flights of
//! one thread can take turns: while one computes, memory for the others arrives.

use crate::judge::Judge;
use crate::mesh::Leaves;
use crate::paged::{Begin, End, Missing, Turn};
use crate::reach::{Meeting, Reach, meet};
use crate::tree::{Below, InPages, Over, Subtree, Tree, Visitor};
use crate::{Hit, Tracer};
use vastlight_accel::ray::{BoxRay, ScaledRay, TriangleRay};
use vastlight_accel::wide::traverse::{Entry, InstanceMemory, Memory, Prefetch, RayLanes, Waiting};
use vastlight_accel::wide::{Block8, CellWalk, ChildRef, InstanceNode, Leaf, MeshKeys, Node8};
use vastlight_math::Ray;
use vastlight_paging::Table;
use vastlight_simd::Simd8;

/// Where a flight stands: among instances, or in the mesh of one.
const TOP: usize = 0;
const MESH: usize = 1;

/// What both levels have; the nodes and their memory are those of the mesh.
#[derive(Clone, Copy)]
struct Stage<'a, S: Simd8> {
    nodes: &'a [Node8],
    memory: Memory,
    lanes: RayLanes<S>,
    t_max: f32,
    /// Parameters here times this are those of the given ray.
    t_scale: f32,
}

impl<S: Simd8> Stage<'_, S> {
    #[inline(always)]
    fn nowhere(simd: S) -> Self {
        Self {
            nodes: &[],
            memory: Memory::new::<Node8, Block8>(&[], &[]),
            lanes: RayLanes::new(simd, &BoxRay::default(), 0.0),
            t_max: 0.0,
            t_scale: 1.0,
        }
    }
}

/// A ray on its way.
pub(crate) struct Flight<'a, S: Simd8> {
    /// Number of the ray in its batch.
    pub(crate) index: usize,
    /// The closest hit so far.
    pub(crate) best: Hit,
    /// Steps of all rays so far.
    pub(crate) steps: usize,
    ray: Ray,
    stages: [Stage<'a, S>; 2],
    level: usize,
    current: ChildRef,
    waiting: Waiting<'a>,
    /// Entries below wait among instances.
    floor: usize,
    leaves: Leaves<'a>,
    triangles: TriangleRay,
    t_min: f32,
    instance: u32,
    tracer: &'a Tracer,
    pages: &'a Table,
    /// Where the closest hit is, and what is missing, in scenes of pages.
    pub(crate) end: End,
    /// Subtrees before this turn are left out.
    restart: Turn,
    /// The ray in the mesh, in scenes of pages.
    boxes: BoxRay,
    /// The way through the cells of a grid, where there is one.
    cells: CellWalk,
    /// The page and the subtree through which the flight goes.
    page: u32,
    subtree: u32,
}

impl<'a, S: Simd8> Flight<'a, S> {
    /// A flight that goes nowhere yet; `entries` has room for all that can wait.
    #[inline(always)]
    pub(crate) fn grounded(
        simd: S,
        (tracer, pages): (&'a Tracer, &'a Table),
        entries: &'a mut [Entry],
    ) -> Self {
        Self {
            index: 0,
            best: Hit::MISS,
            steps: 0,
            ray: Ray::new(vastlight_math::Vec3::ZERO, vastlight_math::Vec3::ZERO),
            stages: [Stage::nowhere(simd); 2],
            level: TOP,
            current: ChildRef::NONE,
            waiting: Waiting { entries, depth: 0 },
            floor: 0,
            leaves: Leaves::Blocks(&[]),
            triangles: TriangleRay::default(),
            t_min: 0.0,
            instance: Hit::NONE,
            tracer,
            pages,
            end: End::COMPLETE,
            restart: Turn::FIRST,
            boxes: BoxRay::default(),
            cells: CellWalk::default(),
            page: Hit::NONE,
            subtree: 0,
        }
    }

    /// Starts with a ray; false if it is at its end already.
    #[inline(always)]
    pub(crate) fn start<F: Judge>(&mut self, simd: S, ray: &Ray, index: usize, begin: &Begin) -> bool {
        let tracer = self.tracer;
        (self.index, self.best, self.level) = (index, begin.best, TOP);
        (self.end, self.restart) = (End { found: begin.found, ..End::COMPLETE }, begin.restart);
        (self.floor, self.waiting.depth) = (0, 0);
        let t_min = ray.t_min.max(0.0);
        let in_order = ray.t_min <= ray.t_max && t_min <= ray.t_max;
        if !in_order || tracer.top.root.is_none() && tracer.grid.is_none() {
            return false;
        }
        self.ray = Ray { t_min, ..*ray };
        if let Some(root) = tracer.top.root {
            self.current = root;
            if root.is_leaf() {
                // A scene of one instance needs no boxes here.
                return self.enter::<F>(simd);
            }
        }
        let Some(scaled) = ScaledRay::new(ray.origin, ray.direction) else { return false };
        let top = &mut self.stages[TOP];
        top.t_max = (if begin.best.is_hit() { begin.best.t } else { ray.t_max }) / scaled.t_scale;
        top.t_scale = scaled.t_scale;
        let boxes = scaled.for_boxes(tracer.places.extent, tracer.places.margin_factor);
        let t_min = if F::PAGED { t_min.max(self.restart.entry()) } else { t_min };
        top.lanes = RayLanes::new(simd, &boxes, t_min / scaled.t_scale);
        match &tracer.grid {
            None => true,
            Some(grid) => {
                self.cells = CellWalk::new(&grid.cells, (ray.origin, ray.direction), boxes.margin, t_min);
                self.next_cell()
            }
        }
    }

    /// Goes to the next cell of a grid; false if there is none, or no grid.
    #[inline(never)]
    fn next_cell(&mut self) -> bool {
        let Some(grid) = &self.tracer.grid else { return false };
        let t_max = if self.best.is_hit() { self.best.t } else { self.ray.t_max };
        let Some(root) = self.cells.next(&grid.cells, t_max) else { return false };
        self.stages[TOP].t_max = t_max / self.stages[TOP].t_scale;
        (self.level, self.floor, self.current) = (TOP, 0, root);
        true
    }

    /// One step; false at the end of the way. With `ALONE` no other flight takes turns: so must rays where vertices move.
    #[inline(always)]
    pub(crate) fn step<F: Judge, const ANY: bool, const ALONE: bool>(&mut self, simd: S, filter: &F) -> bool {
        self.steps += 1;
        if ALONE && self.level == MESH {
            return self.cross_mesh::<F, ANY>(simd, filter);
        }
        if !self.current.is_leaf() {
            let next = if self.level == TOP {
                self.descend_to_instances::<ALONE, ANY>(simd)
            } else {
                self.descend_in_mesh::<ALONE, ANY>(simd)
            };
            match next {
                Some(next) => self.current = next,
                None => return self.next(),
            }
            return true;
        }
        if self.level == TOP {
            return self.enter::<F>(simd) || self.next();
        }
        if self.test_leaf::<F, ANY>(simd, filter) && ANY {
            return false;
        }
        self.next()
    }

    /// Puts the children of the current node that the ray meets aside but for the nearest, which it gives.
    #[inline(always)]
    fn descend_to_instances<const ALONE: bool, const ANY: bool>(&mut self, simd: S) -> Option<ChildRef> {
        let (stage, place) = (&self.stages[TOP], self.current.index());
        let memory = self.top_memory();
        match self.tracer.top.nodes.get(place)? {
            InstanceNode::Full(node) => {
                let hits = stage.lanes.test(simd, node, stage.t_max);
                self.waiting.descend::<S, ALONE, ANY>(simd, (place, node), hits, &memory)
            }
            InstanceNode::Small(node) => {
                let hits = stage.lanes.test(simd, node, stage.t_max);
                self.waiting.descend::<S, ALONE, ANY>(simd, (place, node), hits, &memory)
            }
        }
    }

    /// The same in a mesh whose vertices stand still.
    #[inline(always)]
    fn descend_in_mesh<const ALONE: bool, const ANY: bool>(&mut self, simd: S) -> Option<ChildRef> {
        let (stage, place) = (&self.stages[MESH], self.current.index());
        let node = &stage.nodes[place];
        let hits = stage.lanes.test(simd, node, stage.t_max);
        self.waiting.descend::<S, ALONE, ANY>(simd, (place, node), hits, &stage.memory)
    }

    #[inline(always)]
    fn top_memory(&self) -> InstanceMemory {
        InstanceMemory::new(&self.tracer.top.nodes, self.tracer.leaf_table())
    }

    /// All steps of a flight alone in a mesh, with its figures in registers; false at the end of the way.
    #[inline(always)]
    fn cross_mesh<F: Judge, const ANY: bool>(&mut self, simd: S, filter: &F) -> bool {
        let (Stage { nodes, memory, .. }, start) = (self.stages[MESH], self.current);
        let found = match self.leaves {
            Leaves::Blocks(leaves) => {
                self.cross::<_, F, ANY>(simd, filter, &Over { nodes, leaves, memory }, start)
            }
            Leaves::Pages(mesh) => {
                let leaves = InPages { mesh, pages: self.pages };
                self.cross::<_, F, ANY>(simd, filter, &Over { nodes, leaves, memory }, start)
            }
            // What is in pages stands still.
            Leaves::Keys(_) if F::PAGED => false,
            Leaves::Keys(keys) => {
                self.cross::<_, F, ANY>(simd, filter, &Over::at(keys, self.ray.time), start)
            }
        };
        !(found && ANY) && self.next()
    }

    /// Walks through a tree from a child of it to the end; whether there was a closer hit. With `ANY` that is the end.
    #[inline(always)]
    fn cross<T: Tree, F: Judge, const ANY: bool>(
        &mut self,
        simd: S,
        filter: &F,
        tree: &T,
        start: ChildRef,
    ) -> bool {
        let (lanes, floor) = (self.stages[MESH].lanes, self.waiting.depth);
        let (mut current, mut found) = (start, false);
        let last = self.steps.saturating_add(tree.most_steps());
        loop {
            self.steps += 1;
            if self.steps > last {
                self.waiting.depth = floor;
                return found;
            }
            let next = if current.is_leaf() {
                found |= tree.visit(simd, &mut Visit::<S, F, ANY> { flight: self, filter }, current.index());
                if found && ANY {
                    return true;
                }
                None
            } else if let Some(node) = tree.node(simd, current.index()) {
                let hits = lanes.test(simd, &node, self.stages[MESH].t_max);
                self.waiting.descend::<S, true, ANY>(simd, (current.index(), &node), hits, tree.memory())
            } else {
                None
            };
            match next.or_else(|| self.waiting.pop(floor, self.stages[MESH].t_max)) {
                Some(next) => current = next,
                None => return found,
            }
        }
    }

    /// Asks the caches for what the next step needs.
    #[inline(always)]
    pub(crate) fn prefetch(&self, simd: S) {
        if self.level == TOP {
            self.top_memory().prefetch(simd, self.current);
        } else {
            self.stages[MESH].memory.prefetch(simd, self.current);
        }
    }

    /// Goes on with the nearest child that waits; false if none does.
    #[inline(always)]
    fn next(&mut self) -> bool {
        loop {
            let t_max = self.stages[self.level & 1].t_max;
            if let Some(next) = self.waiting.pop(self.floor, t_max) {
                self.current = next;
                return true;
            }
            if self.level == TOP || self.waiting.depth == 0 {
                return self.tracer.grid.is_some() && self.next_cell();
            }
            (self.level, self.floor) = (TOP, 0);
            if self.best.is_hit() {
                self.stages[TOP].t_max = self.best.t / self.stages[TOP].t_scale;
            }
        }
    }

    /// Goes from an instance to the root of its mesh; false if the ray cannot hit it.
    #[inline(always)]
    fn enter<F: Judge>(&mut self, simd: S) -> bool {
        let tracer = self.tracer;
        let entry = self.current.index();
        let (instance, subtree) = match &tracer.grid {
            None => (entry, None),
            Some(grid) => match grid.entries.get(entry) {
                Some(&[instance, subtree]) => (instance as usize, Some(subtree)),
                None => return false,
            },
        };
        let mut room = None;
        // Where numbers overflow, a ray meets the box of a slot without child.
        let Some(placed) = tracer.places.at(instance, self.ray.time, &mut room) else { return false };
        let mesh = &tracer.meshes[placed.mesh as usize];
        let (origin, direction) = placed.map_ray(self.ray.origin, self.ray.direction);
        let Some(scaled) = ScaledRay::new(origin, direction) else { return false };
        let (Some(root), Some((boxes, triangles))) = (mesh.root(), scaled.for_triangles(mesh.space().extent))
        else {
            return false;
        };
        let t_max = if self.best.is_hit() { self.best.t } else { self.ray.t_max };
        self.t_min = self.ray.t_min / scaled.t_scale;
        let mut begin = self.t_min;
        if F::PAGED {
            // Known once the flight comes to a page; a mesh beside them has none.
            self.page = Hit::NONE;
            self.boxes = boxes;
            begin = begin.max(self.restart.entry() / scaled.t_scale);
        }
        let root = match (subtree, mesh.leaves()) {
            (Some(subtree), Leaves::Pages(mesh)) => {
                let bounds = mesh.roots[subtree as usize].bounds();
                if !boxes.meets(&bounds, begin, t_max / scaled.t_scale) {
                    return false;
                }
                ChildRef::leaf(subtree)
            }
            _ => root,
        };
        self.stages[MESH] = Stage {
            nodes: mesh.nodes(),
            memory: mesh.memory(),
            lanes: RayLanes::new(simd, &boxes, begin),
            t_max: t_max / scaled.t_scale,
            t_scale: scaled.t_scale,
        };
        (self.triangles, self.leaves, self.instance) = (triangles, mesh.leaves(), instance as u32);
        (self.level, self.floor, self.current) = (MESH, self.waiting.depth, root);
        true
    }

    /// Tests the triangles of the leaf that is next; whether one was hit.
    #[inline(always)]
    fn test_leaf<F: Judge, const ANY: bool>(&mut self, simd: S, filter: &F) -> bool {
        let (leaf, leaves, pages) = (self.current.index(), self.leaves, self.pages);
        let mut visit = Visit::<S, F, ANY> { flight: self, filter };
        match leaves {
            Leaves::Blocks(blocks) => blocks.visit(simd, &mut visit, leaf),
            Leaves::Pages(mesh) => InPages { mesh, pages }.visit(simd, &mut visit, leaf),
            Leaves::Keys(keys) => keys.visit(simd, &mut visit, leaf),
        }
    }

    /// Tests triangles; whether one was hit.
    #[inline(always)]
    fn meet<F: Judge>(&mut self, simd: S, filter: &F, leaf: &impl Leaf) -> bool {
        let stage = &mut self.stages[MESH];
        let mut reach = Reach { t_min: self.t_min, t_max: stage.t_max, t_scale: stage.t_scale };
        let ray = (&self.triangles, self.index);
        let mut meeting = Meeting { best: &mut self.best, found: &mut self.end.found, unknown: None };
        let found = meet(simd, (leaf, self.instance, self.page), ray, filter, &mut reach, &mut meeting);
        stage.t_max = reach.t_max;
        if F::PAGED
            && let Some(attributes) = meeting.unknown
        {
            self.miss(attributes);
        }
        found
    }

    /// The turn of the subtree through which the flight goes.
    fn turn(&self) -> Turn {
        let Leaves::Pages(mesh) = self.leaves else { return Turn::NEVER };
        let subtree = (self.subtree, &mesh.roots[self.subtree as usize]);
        Turn::in_mesh((&self.boxes, self.stages[MESH].t_scale), self.instance, subtree)
    }

    /// Notes that the page of this subtree is missing, or attributes of it.
    #[cold]
    fn miss(&mut self, attributes: u32) {
        self.end.missing.or(Missing { turn: self.turn(), page: self.page, attributes });
    }

    /// Whether the turn of this subtree is over.
    #[inline(always)]
    fn is_over(&self) -> bool {
        self.restart != Turn::FIRST && self.turn() < self.restart
    }
}

/// A flight at a leaf.
struct Visit<'v, 'a, S: Simd8, F, const ANY: bool> {
    flight: &'v mut Flight<'a, S>,
    filter: &'v F,
}

impl<S: Simd8, F: Judge, const ANY: bool> Visitor<S> for Visit<'_, '_, S, F, ANY> {
    #[inline(always)]
    fn triangles(&mut self, simd: S, triangles: &impl Leaf) -> bool {
        self.flight.meet(simd, self.filter, triangles)
    }

    #[inline(always)]
    fn moving(&mut self, simd: S, keys: &MeshKeys, leaf: usize) -> bool {
        let block = keys.block(simd, leaf, &keys.between(self.flight.ray.time));
        block.is_some_and(|block| self.flight.meet(simd, self.filter, &block))
    }

    #[inline(always)]
    fn subtree(&mut self, simd: S, subtree: &Subtree<'_>) -> bool {
        let Subtree { number, root, page } = subtree;
        let flight = &mut *self.flight;
        if F::PAGED {
            (flight.page, flight.subtree) = (root.page, *number);
            if self.filter.is_done(root.page) || flight.is_over() {
                return false;
            }
            match page {
                Some(_) => self.filter.uses(root.page),
                None => flight.miss(Hit::NONE),
            }
        }
        let Some(page) = page else { return false };
        flight.cross::<_, F, ANY>(simd, self.filter, page, root.node())
    }
}
