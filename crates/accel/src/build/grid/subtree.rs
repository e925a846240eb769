//! The tasks of one thread: a whole subtree.

use super::bins::Bins;
use super::cells::{COARSEST, Entry, Lattice, Region, TOP, cell_of, entry};
use super::{Builder, RUN};
use crate::Node;
use crate::build::{BLANK, top_down};
use crate::reference::{EMPTY_LANES, unpack};
use vastlight_simd::{Kernel, Simd8};

/// Tasks with at most so many references bin a list of them rather than cells of the grid.
const LIST: u32 = 64;
/// Nodes deeper than this are halved without looking, which bounds the depth of the tree.
const MAX_GRID_DEPTH: u32 = 64;

/// Builds the tree over the references in a region; its numbers of references go to `prims`.
pub(super) struct Subtree<'a, 'b> {
    pub(super) builder: &'a Builder<'b>,
    pub(super) region: Region,
    pub(super) prims: &'a mut [u32],
    pub(super) depth: u32,
}

/// Where a task's references are.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    /// In the grid.
    Grid,
    /// In this one of the two lists.
    List(bool),
}

/// A node that is not split yet.
#[derive(Clone, Copy)]
struct Task {
    slot: usize,
    first: u32,
    count: u32,
    depth: u32,
    region: Region,
    place: Place,
    /// Which of the lattices cells count in.
    lattice: usize,
}

/// Lists of references, two for each task's run: tasks part from one to the other.
struct Lists {
    lists: [Vec<Entry>; 2],
    lattices: Vec<Lattice>,
    tasks: Vec<Task>,
}

impl Kernel for Subtree<'_, '_> {
    type Output = Vec<Node>;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Vec<Node> {
        let Self { builder, region, prims, depth } = self;
        let count = prims.len();
        let mut nodes = Vec::with_capacity(count.min(2 * RUN));
        nodes.push(BLANK);
        let task =
            Task { slot: 0, first: 0, count: count as u32, depth, region, place: Place::Grid, lattice: 0 };
        let mut lists = Lists {
            lists: [vec![0; count], vec![0; count]],
            lattices: vec![builder.lattice],
            tasks: vec![task],
        };
        while let Some(mut task) = lists.tasks.pop() {
            nodes[task.slot] = Node { first: task.first, count: task.count, ..BLANK };
            let parts = if task.count as usize <= builder.max_leaf {
                None
            } else {
                Some(lists.divide(simd, builder, &mut task))
            };
            let Some([left, right]) = parts else {
                lists.fetch(builder, &mut task);
                nodes[task.slot].bounds = lists.leaf(simd, builder, &task, prims);
                continue;
            };
            let slot = nodes.len();
            nodes[task.slot].left = slot as u32;
            nodes.extend([BLANK; 2]);
            lists.tasks.push(Task { slot: slot + 1, ..right });
            lists.tasks.push(Task { slot, ..left });
        }
        for node in (0..nodes.len()).rev() {
            if !nodes[node].is_leaf() {
                let left = nodes[node].left as usize;
                nodes[node].bounds = nodes[left].bounds.union(nodes[left + 1].bounds);
            }
        }
        nodes
    }
}

impl Lists {
    /// Splits a task in two.
    #[inline(always)]
    fn divide<S: Simd8>(&mut self, simd: S, builder: &Builder<'_>, task: &mut Task) -> [Task; 2] {
        while task.depth < MAX_GRID_DEPTH {
            let in_grid = task.place == Place::Grid;
            task.region = task.region.refined(if in_grid { TOP } else { 0 });
            if in_grid && (task.count <= LIST || task.region.level == TOP && task.region.fits_finer()) {
                self.fetch(builder, task);
                continue;
            }
            let mut bins = Bins::new();
            match task.place {
                Place::Grid => builder.grid.bin(simd, &task.region, &mut bins),
                Place::List(side) => bin_list(self.run(side, task), &task.region, &mut bins),
            }
            if let Some(parts) = bins.split(&task.region, &self.lattices[task.lattice]) {
                return self.part(task, parts);
            }
            // All in one cell.
            task.region = bins.tight(&task.region);
            if !in_grid && task.region.level == 0 && !self.lay_new_grid(simd, builder, task) {
                break;
            }
        }
        self.fetch(builder, task);
        halves(task)
    }

    /// A task's list.
    #[inline(always)]
    fn run(&self, side: bool, task: &Task) -> &[Entry] {
        &self.lists[usize::from(side)][task.first as usize..(task.first + task.count) as usize]
    }

    /// Takes a task's references from the grid to a list.
    fn fetch(&mut self, builder: &Builder<'_>, task: &mut Task) {
        if task.place == Place::Grid {
            let run = task.first as usize..(task.first + task.count) as usize;
            builder.gather(&task.region, &mut self.lists[0][run]);
            task.place = Place::List(false);
        }
    }

    /// The tasks of both parts; a list is parted, each half in its old order.
    #[inline(always)]
    fn part(&mut self, task: &Task, [(left, count), (right, rest)]: [(Region, u32); 2]) -> [Task; 2] {
        let mut place = task.place;
        if let Place::List(side) = task.place {
            let run = task.first as usize..(task.first + task.count) as usize;
            let [a, b] = &mut self.lists;
            let (from, to) = if side { (b, a) } else { (a, b) };
            part_list(&from[run.clone()], &mut to[run], &left, &right, count as usize);
            place = Place::List(!side);
        }
        let below = Task { depth: task.depth + 1, place, ..*task };
        let first = task.first + count;
        [Task { region: left, count, ..below }, Task { region: right, first, count: rest, ..below }]
    }

    /// Lays a grid around a task's references alone; false if their centres are one.
    #[inline(always)]
    fn lay_new_grid<S: Simd8>(&mut self, simd: S, builder: &Builder<'_>, task: &mut Task) -> bool {
        self.fetch(builder, task);
        let Place::List(side) = task.place else { return false };
        let run = task.first as usize..(task.first + task.count) as usize;
        let list = &mut self.lists[usize::from(side)][run];
        let reference = |entry: Entry| &builder.references[entry as u32 as usize];
        let mut bounds = top_down::bounds_of(simd, &[]);
        for &entry in &*list {
            let one = top_down::bounds_of(simd, std::slice::from_ref(reference(entry)));
            bounds.centers = top_down::unite(simd, &bounds.centers, &one.centers);
        }
        let lattice = Lattice::new(&bounds);
        if lattice.is_point() {
            return false;
        }
        for slot in list {
            *slot = entry(lattice.cell(reference(*slot)), *slot as u32);
        }
        task.lattice = self.lattices.len();
        task.region = Region { level: COARSEST, min: [0; 3], max: [8; 3] };
        self.lattices.push(lattice);
        true
    }

    /// Writes a leaf's numbers; gives its box.
    #[inline(always)]
    fn leaf<S: Simd8>(
        &self,
        simd: S,
        builder: &Builder<'_>,
        task: &Task,
        prims: &mut [u32],
    ) -> vastlight_math::Aabb {
        let Place::List(side) = task.place else { return vastlight_math::Aabb::EMPTY };
        let mut around = simd.load(&EMPTY_LANES);
        for (prim, &entry) in prims[task.first as usize..].iter_mut().zip(self.run(side, task)) {
            let reference = &builder.references[entry as u32 as usize];
            *prim = reference.prim();
            around = simd.min(around, simd.load(reference.lanes()));
        }
        unpack(&simd.to_array(around))
    }
}

/// The halves of a task whose references are all alike.
fn halves(task: &Task) -> [Task; 2] {
    let count = task.count / 2;
    let below = Task { depth: task.depth + 1, ..*task };
    [Task { count, ..below }, Task { first: task.first + count, count: task.count - count, ..below }]
}

#[inline(always)]
fn bin_list(list: &[Entry], region: &Region, bins: &mut Bins) {
    let [x, y, z] = region.min;
    for &entry in list {
        let cell = |axis: usize| cell_of(entry, axis) >> region.level;
        bins.add(cell(0) - x, cell(1) - y, cell(2) - z);
    }
}

/// Copies `from` to `to`, the `count` entries in `left` first, then those in `right`.
#[inline(always)]
fn part_list(from: &[Entry], to: &mut [Entry], left: &Region, right: &Region, count: usize) {
    // Along the axis of the plane the regions do not overlap.
    let axis = (0..3).find(|&axis| left.max[axis] <= right.min[axis]).unwrap_or(0);
    let (mut next_left, mut next_right) = (0, count);
    for &entry in from {
        let is_left = cell_of(entry, axis) >> left.level < left.max[axis];
        let next = if is_left { next_left } else { next_right };
        if let Some(slot) = to.get_mut(next) {
            *slot = entry;
        }
        next_left += usize::from(is_left);
        next_right += usize::from(!is_left);
    }
}
