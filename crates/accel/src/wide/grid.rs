//! The published top level: a grid of cells, in each a tree over the boxes that reach into it, cut to the cell.
//!
//! K. Garanzha, thesis of 2014, 6.3. Deviations: cells have the shape of the whole, as many of them along each axis; trees
//! are eight wide; and boxes stand in every cell that they come near to, so that no rounding of a ray's way through the
//! cells can lose a hit: rays of at most [`GridBvh::margin`] may be walked cell by cell ([`CellWalk`]), others meet all cells.

use super::instances::Group;
use super::{ChildRef, SmallNode, WideNode};
use crate::{BuildConfig, BuildError, Scratch};
use rayon::prelude::*;
use vastlight_math::glam::DVec3;
use vastlight_math::{Aabb, Vec3};

/// Cells that are built side by side, before their nodes are put to the others.
const WAVE: usize = 1 << 10;

/// Trees in the cells of a grid; their leaves are the numbers of boxes.
#[derive(Clone, Debug, Default)]
pub struct GridBvh {
    /// Wide nodes of all trees.
    pub nodes: Vec<SmallNode>,
    /// Nodes on the longest way from a root to a leaf.
    pub levels: usize,
    /// Boxes in cells, each cell counted.
    pub references: usize,
    /// Roots by cell, x first; none in cells without boxes.
    cells: Vec<ChildRef>,
    per_axis: usize,
    /// Where the cells begin, and the size of one.
    min: DVec3,
    size: DVec3,
    /// Half of how much larger than they are boxes were taken.
    margin: f32,
}

/// Cells that a box reaches into, by axis, first and last.
type CellRange = [[usize; 2]; 3];

impl GridBvh {
    /// Most cells along an axis.
    pub const MOST_PER_AXIS: usize = 256;

    /// Builds with the builder `name` over those of `count` boxes that are not empty, for rays whose margin is at most
    /// `margin`.
    ///
    /// # Errors
    /// Those of [`build()`](crate::build()); too many boxes in cells.
    pub fn build(
        name: &str,
        count: usize,
        bounds: impl Fn(u32) -> Aabb + Sync,
        (per_axis, margin): (usize, f32),
        config: &BuildConfig,
    ) -> Result<Self, BuildError> {
        let per_axis = per_axis.clamp(1, Self::MOST_PER_AXIS);
        let boxes = (0..count as u32).map(|i| (i, bounds(i))).filter(|(_, b)| !b.is_empty());
        let boxes: Vec<(u32, Aabb)> = boxes.collect();
        let around = boxes.iter().fold(Aabb::EMPTY, |a, (_, b)| a.union(*b));
        let mut grid = Self { per_axis, margin, ..Self::default() };
        if !around.is_empty() {
            let around = grown(&around, grid.reach());
            grid.min = around.min.as_dvec3();
            grid.size = (around.max.as_dvec3() - grid.min) / per_axis as f64;
        }
        if !grid.is_regular() {
            // Nothing tells cells apart.
            grid.per_axis = 1;
        }
        let (starts, inside) = grid.distribute(&boxes)?;
        grid.references = inside.len();
        let cells: Vec<usize> = (0..starts.len() - 1).filter(|&c| starts[c] < starts[c + 1]).collect();
        grid.cells = vec![ChildRef::NONE; starts.len() - 1];
        for wave in cells.chunks(WAVE) {
            let tree = |scratch: &mut Scratch, &cell: &usize| {
                let inside = &inside[starts[cell]..starts[cell + 1]];
                let clipped = |place: u32| grid.clipped(&boxes[place as usize].1, cell);
                Group::build(name, inside, &clipped, &|_| 1.0, config, scratch)
            };
            let built: Vec<_> = wave.par_iter().map_init(Scratch::default, tree).collect();
            for (&cell, group) in wave.iter().zip(built) {
                if let Some(group) = group? {
                    grid.levels = grid.levels.max(group.levels);
                    grid.cells[cell] = group.append_to(&mut grid.nodes, |place| boxes[place as usize].0);
                }
            }
        }
        Ok(grid)
    }

    /// How much larger than they are boxes are taken on each side.
    fn reach(&self) -> f32 {
        2.0 * self.margin
    }

    /// Whether rays can be walked cell by cell.
    fn is_regular(&self) -> bool {
        self.size.is_finite() && self.size.min_element() > 0.0 && self.margin.is_finite()
    }

    /// For each cell the places of the boxes in it, one after the other: where each cell begins, and the places.
    fn distribute(&self, boxes: &[(u32, Aabb)]) -> Result<(Vec<usize>, Vec<u32>), BuildError> {
        let mut starts = vec![0; self.per_axis.pow(3) + 1];
        for (_, bounds) in boxes {
            self.for_cells(&self.range(bounds), |cell| starts[cell + 1] += 1);
        }
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let total = starts[starts.len() - 1];
        if total >= 1 << 31 {
            return Err(BuildError::TooMany(total));
        }
        let (mut next, mut inside) = (starts.clone(), vec![0; total]);
        for (place, (_, bounds)) in boxes.iter().enumerate() {
            self.for_cells(&self.range(bounds), |cell| {
                inside[next[cell]] = place as u32;
                next[cell] += 1;
            });
        }
        Ok((starts, inside))
    }

    fn range(&self, bounds: &Aabb) -> CellRange {
        if !self.is_regular() {
            return [[0; 2]; 3];
        }
        let bounds = grown(bounds, self.reach());
        let (low, high) = (self.cell_of(bounds.min.as_dvec3()), self.cell_of(bounds.max.as_dvec3()));
        std::array::from_fn(|axis| [low[axis], high[axis]])
    }

    /// The cell of a place, or the nearest, by axis.
    fn cell_of(&self, place: DVec3) -> [usize; 3] {
        let cell = (place - self.min) / self.size;
        cell.to_array().map(|x| (x as usize).min(self.per_axis - 1))
    }

    fn for_cells(&self, [x, y, z]: &CellRange, mut each: impl FnMut(usize)) {
        for z in z[0]..=z[1] {
            for y in y[0]..=y[1] {
                (x[0]..=x[1]).for_each(|x| each(self.number([x, y, z])));
            }
        }
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.per_axis + y) * self.per_axis + x
    }

    /// Where the cells with this number along an axis begin.
    fn plane(&self, axis: usize, number: f64) -> f64 {
        self.min[axis] + number * self.size[axis]
    }

    /// The part of a box, with its margin, that lies in a cell.
    fn clipped(&self, bounds: &Aabb, cell: usize) -> Aabb {
        let bounds = grown(bounds, self.reach());
        if !self.is_regular() {
            return bounds;
        }
        let n = self.per_axis;
        let place = [cell % n, cell / n % n, cell / (n * n)].map(|x| x as f64);
        let plane = |more: f64| DVec3::from(std::array::from_fn(|axis| self.plane(axis, place[axis] + more)));
        let cell = Aabb {
            min: plane(0.0).as_vec3().map(f32::next_down),
            max: plane(1.0).as_vec3().map(f32::next_up),
        };
        bounds.intersection(cell)
    }

    /// Memory, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.cells[..])
    }

    /// Checks that every box is a leaf in all cells that it reaches into, below boxes that contain its part there, and
    /// in no other.
    ///
    /// # Errors
    /// What is wrong first.
    pub fn validate(&self, bounds: &[Aabb]) -> Result<(), String> {
        for cell in 0..self.cells.len() {
            let mut found = vec![false; bounds.len()];
            let everywhere = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
            let mut waiting = vec![(self.cells[cell], everywhere)];
            while let Some((child, around)) = waiting.pop().filter(|(child, _)| *child != ChildRef::NONE) {
                if child.is_leaf() {
                    let own = bounds.get(child.index()).ok_or("a leaf does not exist")?;
                    if found[child.index()] || !around.contains(&self.clipped(own, cell)) {
                        return Err(format!("box {} in cell {cell}", child.index()));
                    }
                    found[child.index()] = true;
                    continue;
                }
                let node = self.nodes.get(child.index()).ok_or("a node does not exist")?;
                let node = node.to_wide(child.index());
                let inside = (0..8).filter(|&slot| node.children[slot] != ChildRef::NONE);
                waiting.extend(inside.map(|s| (node.children[s], node.bounds(s).intersection(around))));
            }
            let reaches = |b: &Aabb| {
                let mut reaches = false;
                self.for_cells(&self.range(b), |c| reaches |= c == cell);
                reaches && !b.is_empty()
            };
            if bounds.iter().zip(&found).any(|(b, &found)| reaches(b) != found) {
                return Err(format!("cell {cell} has other boxes than it should"));
            }
        }
        Ok(())
    }
}

fn grown(bounds: &Aabb, by: f32) -> Aabb {
    let limit = Vec3::splat(f32::MAX);
    Aabb { min: (bounds.min - by).max(-limit), max: (bounds.max + by).min(limit) }
}

/// A ray's way from cell to cell (J. Amanatides, A. Woo 1987, "A fast voxel traversal algorithm for ray tracing").
#[derive(Clone, Copy, Debug, Default)]
pub struct CellWalk {
    origin: [f64; 3],
    /// Of the direction.
    reciprocal: [f64; 3],
    cell: [usize; 3],
    /// Where the ray enters the cell.
    entry: f64,
    /// Cells still to be looked at without order, for rays that cannot be walked cell by cell.
    unordered: Option<usize>,
    is_over: bool,
}

impl CellWalk {
    /// How much earlier than given a way begins, and how much later it ends, as a part.
    const SLACK: f64 = 1e-6;

    /// The way of a ray with this origin and direction, whose boxes are wider by `margin`, from the parameter `begin` on.
    #[must_use]
    pub fn new(grid: &GridBvh, (origin, direction): (Vec3, Vec3), margin: f32, begin: f32) -> Self {
        let mut walk = Self {
            origin: origin.as_dvec3().to_array(),
            reciprocal: direction.as_dvec3().recip().to_array(),
            entry: f64::from(begin) * (1.0 - Self::SLACK),
            ..Self::default()
        };
        // Not so for what is no number.
        let narrow = margin <= grid.margin;
        if !narrow || !grid.is_regular() {
            walk.unordered = Some(0);
            return walk;
        }
        let mut end = f64::INFINITY;
        for axis in 0..3 {
            let [a, b] = [0.0, grid.per_axis as f64].map(|number| walk.reach(grid, axis, number));
            // A ray along the slab, on its plane, has no number for it and is over: no box reaches there, since each lies
            // at a distance from the planes around all.
            (walk.entry, end) = (walk.entry.max(a.min(b)), end.min(a.max(b)));
        }
        walk.is_over = walk.entry > end;
        let place = origin.as_dvec3() + direction.as_dvec3() * walk.entry;
        walk.cell = grid.cell_of(place);
        walk
    }

    /// Where the ray meets a plane between cells.
    #[inline(always)]
    fn reach(&self, grid: &GridBvh, axis: usize, number: f64) -> f64 {
        (grid.plane(axis, number) - self.origin[axis]) * self.reciprocal[axis]
    }

    /// The root of the tree in the next cell with boxes that the ray enters before `t_max`.
    pub fn next(&mut self, grid: &GridBvh, t_max: f32) -> Option<ChildRef> {
        if let Some(number) = self.unordered {
            let found = (number..grid.cells.len()).find(|&cell| grid.cells[cell] != ChildRef::NONE);
            self.unordered = Some(found.map_or(grid.cells.len(), |cell| cell + 1));
            return found.map(|cell| grid.cells[cell]);
        }
        let last = f64::from(t_max) * (1.0 + Self::SLACK);
        while !self.is_over && self.entry <= last {
            let root = grid.cells[grid.number(self.cell)];
            self.step(grid);
            if root != ChildRef::NONE {
                return Some(root);
            }
        }
        None
    }

    /// Goes to the next cell.
    #[inline(always)]
    fn step(&mut self, grid: &GridBvh) {
        let exit = |axis: usize| {
            let forward = self.reciprocal[axis] > 0.0;
            let exit = self.reach(grid, axis, self.cell[axis] as f64 + f64::from(u8::from(forward)));
            // Along an axis in which the ray does not move, nothing ends.
            if self.reciprocal[axis].is_finite() { exit } else { f64::INFINITY }
        };
        let exits = [exit(0), exit(1), exit(2)];
        let axis = if exits[0] <= exits[1] && exits[0] <= exits[2] {
            0
        } else if exits[1] <= exits[2] {
            1
        } else {
            2
        };
        self.entry = self.entry.max(exits[axis]);
        let next = if self.reciprocal[axis] > 0.0 {
            Some(self.cell[axis] + 1).filter(|&cell| cell < grid.per_axis)
        } else {
            self.cell[axis].checked_sub(1)
        };
        match next {
            Some(next) => self.cell[axis] = next,
            None => self.is_over = true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(state: &mut u32) -> f32 {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (*state >> 8) as f32 / 16_777_216.0
    }

    fn point(state: &mut u32) -> Vec3 {
        Vec3::new(random(state), random(state), random(state))
    }

    fn boxes(count: usize) -> Vec<Aabb> {
        let mut state = 3;
        let mut one = |i: usize| {
            let min = point(&mut state);
            Aabb { min, max: min + point(&mut state) * if i.is_multiple_of(50) { 0.5 } else { 0.03 } }
        };
        (0..count).map(|i| if i == 7 { Aabb::EMPTY } else { one(i) }).collect()
    }

    fn build(boxes: &[Aabb], per_axis: usize) -> GridBvh {
        let bounds = |i: u32| boxes[i as usize];
        GridBvh::build("", boxes.len(), bounds, (per_axis, 1e-4), &BuildConfig::default()).expect("built")
    }

    #[test]
    fn boxes_stand_in_all_their_cells() {
        for (count, per_axis) in [(0, 4), (1, 1), (1, 7), (300, 1), (300, 5), (300, 16)] {
            let boxes = boxes(count);
            let grid = build(&boxes, per_axis);
            grid.validate(&boxes).unwrap_or_else(|what| panic!("{count}, {per_axis}: {what}"));
            assert!(count < 2 || grid.bytes() > 0 && grid.references >= count - 1);
        }
        let boxes = boxes(300);
        let mut broken = build(&boxes, 5);
        let cell = broken.cells.iter().position(|&root| root != ChildRef::NONE).expect("some");
        broken.cells[cell] = ChildRef::NONE;
        assert!(broken.validate(&boxes).is_err());
    }

    /// Every place of a ray lies in a cell that the walk enters before it.
    #[test]
    fn a_walk_misses_no_cell_of_its_ray() {
        let boxes = vec![Aabb { min: Vec3::ZERO, max: Vec3::ONE }];
        for per_axis in [1, 3, 8] {
            let mut grid = build(&boxes, per_axis);
            let (mut state, mut met, mut noticed, cells) = (11, 0, 0, per_axis.pow(3));
            grid.cells = (0..cells as u32).map(ChildRef::leaf).collect();
            for i in 0..2000 {
                let origin = point(&mut state) * 4.0 - 1.5;
                let mut direction = point(&mut state) - point(&mut state);
                if i % 3 == 0 {
                    direction[i % 9 / 3] = 0.0;
                }
                let begin = random(&mut state);
                let mut walk = CellWalk::new(&grid, (origin, direction), 1e-4, begin);
                let way: Vec<usize> =
                    std::iter::from_fn(|| walk.next(&grid, 3.0)).map(ChildRef::index).collect();
                let misses = |way: &[usize], step: usize| {
                    let t = begin + (3.0 - begin) * step as f32 / 199.0;
                    let place = origin + direction * t;
                    let inside = place.cmpge(Vec3::splat(-1e-5)).all() && place.cmple(Vec3::splat(1.0)).all();
                    let cell = grid.number(grid.cell_of(place.as_dvec3()));
                    let edge = ((place.as_dvec3() - grid.min) / grid.size).fract();
                    let clear = edge.min_element() > 1e-3 && edge.max_element() < 1.0 - 1e-3;
                    inside && clear && !way.contains(&cell)
                };
                assert!(!(0..200).any(|step| misses(&way, step)), "{origin} {direction} {begin}");
                assert!(way.len() <= 3 * per_axis);
                let shorter = |cut: usize| [&way[..cut], &way[cut + 1..]].concat();
                met += usize::from(!way.is_empty());
                noticed += usize::from((0..way.len()).any(|cut| (0..200).any(|s| misses(&shorter(cut), s))));
            }
            assert!(met > 50 && 2 * noticed > met, "a cell that is left out is missed: {noticed} of {met}");
        }
    }

    #[test]
    fn rays_with_wide_margins_and_endless_boxes_meet_all_cells() {
        let mut boxes = boxes(40);
        let grid = build(&boxes, 4);
        let full = grid.cells.iter().filter(|&&root| root != ChildRef::NONE).count();
        let count = |grid: &GridBvh, margin: f32| {
            let mut walk = CellWalk::new(grid, (Vec3::splat(-9.0), -Vec3::X), margin, 0.0);
            std::iter::from_fn(|| walk.next(grid, 1.0)).count()
        };
        assert_eq!([count(&grid, 1.0), count(&grid, f32::NAN), count(&grid, 0.0)], [full, full, 0]);
        boxes.push(Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY });
        let grid = build(&boxes, 2);
        grid.validate(&boxes).expect("sound");
        let mut walk = CellWalk::new(&grid, (Vec3::splat(5.0), Vec3::X), 0.0, 0.0);
        assert!(walk.next(&grid, 1.0).is_some());
    }
}
