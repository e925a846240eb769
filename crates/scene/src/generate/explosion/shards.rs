//! Cuts a shell of the statue's grid into shards of connected triangles, each with vertices and a thickness of its own.
//!
//! Shards are cells around jittered points (Worley, "A cellular texture basis function", 1996), taken apart where a
//! cell is not connected; crumbs join a neighbour.

use super::super::noise::{PRIMES, mixed, smoothstep};
use crate::{Mesh, Part};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use vastlight_math::Vec3;

/// Metres from cell to cell.
const CELL: f32 = 0.054;
/// Shards with less than this join a neighbour, square metres.
const CRUMB: f32 = 1.5e-4;
/// The statue's axis (x, z) and the part of its radius where the shell's inside is.
const AXIS: Vec3 = Vec3::new(0.0, 0.0, -0.02);
const INSIDE: f32 = 0.88;

/// The triangles of the statue's head: two fans of `columns`, then `rings - 1` belts of `2 * columns`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub(super) rings: usize,
    pub(super) columns: usize,
}

impl Grid {
    pub(super) fn triangles(self) -> usize {
        2 * self.columns * self.rings
    }

    /// The triangle across each edge (first to second corner, second to third, third to first).
    pub(super) fn neighbours(self, triangle: usize) -> [usize; 3] {
        let n = self.columns;
        let (next, before) = (|i: usize| (i + 1) % n, |i: usize| (i + n - 1) % n);
        let top = |i: usize| i;
        let bottom = |i: usize| n + i;
        let belt = |ring: usize, i: usize, half: usize| 2 * n + (ring * n + i) * 2 + half;
        let above = |ring: usize, i: usize| if ring == 0 { top(i) } else { belt(ring - 1, i, 0) };
        let below = |ring: usize, i: usize| if ring + 1 < self.rings { belt(ring, i, 1) } else { bottom(i) };
        if triangle < n {
            let i = triangle;
            return [top(before(i)), below(0, i), top(next(i))];
        }
        if triangle < 2 * n {
            let i = triangle - n;
            return [bottom(next(i)), above(self.rings - 1, i), bottom(before(i))];
        }
        let cell = (triangle - 2 * n) / 2;
        let (ring, i) = (cell / n, cell % n);
        if triangle.is_multiple_of(2) {
            [belt(ring, before(i), 1), below(ring + 1, i), belt(ring, i, 1)]
        } else {
            [belt(ring, i, 0), belt(ring, next(i), 0), above(ring, i)]
        }
    }
}

/// Which shard each triangle belongs to.
#[derive(Debug)]
pub(super) struct Pattern {
    pub(super) shard_of: Vec<u32>,
    pub(super) shards: usize,
}

impl Pattern {
    pub(super) fn new(mesh: &Mesh, grid: Grid, seed: u32) -> Self {
        let labels: Vec<u64> = (0..mesh.triangles.len() as u32)
            .into_par_iter()
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                cell((a + b + c) / 3.0, seed)
            })
            .collect();
        let mut pattern = Self::connected(&labels, grid);
        pattern.join_crumbs(mesh, grid);
        pattern
    }

    /// Runs of triangles of one label.
    fn connected(labels: &[u64], grid: Grid) -> Self {
        const NONE: u32 = u32::MAX;
        let mut shard_of = vec![NONE; labels.len()];
        let (mut shards, mut open) = (0, Vec::new());
        for first in 0..labels.len() {
            if shard_of[first] != NONE {
                continue;
            }
            shard_of[first] = shards;
            open.push(first);
            while let Some(triangle) = open.pop() {
                for neighbour in grid.neighbours(triangle) {
                    if shard_of[neighbour] == NONE && labels[neighbour] == labels[triangle] {
                        shard_of[neighbour] = shards;
                        open.push(neighbour);
                    }
                }
            }
            shards += 1;
        }
        Self { shard_of, shards: shards as usize }
    }

    /// Gives shards that are too small to another beside them, and numbers the rest anew.
    fn join_crumbs(&mut self, mesh: &Mesh, grid: Grid) {
        let mut areas = vec![0.0_f64; self.shards];
        for (t, &shard) in (0..).zip(&self.shard_of) {
            let [a, b, c] = mesh.corners(t);
            areas[shard as usize] += f64::from((b - a).cross(c - a).length()) * 0.5;
        }
        let mut parents: Vec<u32> = (0..self.shards as u32).collect();
        for (triangle, &shard) in self.shard_of.iter().enumerate() {
            for neighbour in grid.neighbours(triangle) {
                let (a, b) = (root(&parents, shard), root(&parents, self.shard_of[neighbour]));
                if a != b && areas[a as usize] < f64::from(CRUMB) {
                    parents[a as usize] = b;
                    areas[b as usize] += areas[a as usize];
                }
            }
        }
        let mut numbers = vec![0_u32; self.shards];
        let mut kept = 0;
        for shard in 0..self.shards as u32 {
            if root(&parents, shard) == shard {
                numbers[shard as usize] = kept;
                kept += 1;
            }
        }
        self.shard_of.par_iter_mut().for_each(|s| *s = numbers[root(&parents, *s) as usize]);
        self.shards = kept as usize;
    }

    /// Edges with another shard across, counted from both sides.
    pub(super) fn border_sides(&self, grid: Grid) -> u64 {
        (0..self.shard_of.len()).into_par_iter().map(|t| self.border(grid, t).count() as u64).sum()
    }

    /// The edges of a triangle with another shard across.
    fn border(&self, grid: Grid, triangle: usize) -> impl Iterator<Item = usize> {
        let neighbours = grid.neighbours(triangle);
        (0..3).filter(move |&edge| self.shard_of[neighbours[edge]] != self.shard_of[triangle])
    }

    /// The triangles of each shard, in order.
    fn members(&self) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); self.shards];
        for (t, &shard) in (0..).zip(&self.shard_of) {
            members[shard as usize].push(t);
        }
        members
    }
}

fn root(parents: &[u32], mut shard: u32) -> u32 {
    while parents[shard as usize] != shard {
        shard = parents[shard as usize];
    }
    shard
}

/// The cell of the nearest jittered point, as a number of its own.
fn cell(p: Vec3, seed: u32) -> u64 {
    let q = p / CELL;
    let middle = q.to_array().map(|x| x.floor() as i32);
    let (mut best, mut nearest) = (0, f32::MAX);
    for offset in 0..27 {
        let at = [middle[0] + offset % 3 - 1, middle[1] + offset / 3 % 3 - 1, middle[2] + offset / 9 - 1];
        let hash = (0..3)
            .fold(seed.wrapping_mul(PRIMES[3]), |h, i| mixed(h ^ (at[i] as u32).wrapping_mul(PRIMES[i])));
        let jitter = |shift: u32| (hash >> shift & 1023) as f32 / 1024.0;
        let point = Vec3::new(at[0] as f32 + jitter(0), at[1] as f32 + jitter(10), at[2] as f32 + jitter(20));
        let distance = (point - q).length_squared();
        if distance < nearest {
            nearest = distance;
            best = at.iter().fold(0, |key, &x| key << 20 | u64::from((x + 0x4_0000) as u32));
        }
    }
    best
}

/// A shard of the cut mesh.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Shard {
    pub(super) vertices: Range<usize>,
    /// Middle of its outer vertices.
    pub(super) center: Vec3,
}

/// The cut shell: outer faces of one material, then inner faces and rims of another.
pub(super) fn cut(mesh: &Mesh, grid: Grid, pattern: &Pattern, materials: [u32; 2]) -> (Mesh, Vec<Shard>) {
    let pieces: Vec<Piece> =
        pattern.members().par_iter().map(|members| Piece::new(mesh, grid, pattern, members)).collect();
    let mut whole = Mesh { name: "shards".into(), ..Mesh::default() };
    let vertices = pieces.iter().map(|p| p.positions.len()).sum();
    whole.positions.reserve_exact(vertices);
    whole.normals.reserve_exact(vertices);
    whole.triangles.reserve_exact(pieces.iter().map(|p| p.outer.len() + p.inner.len()).sum());
    let mut shards: Vec<Shard> = Vec::with_capacity(pieces.len());
    for piece in &pieces {
        let first = whole.positions.len();
        whole.positions.extend(&piece.positions);
        whole.normals.extend(&piece.normals);
        shards.push(Shard { vertices: first..whole.positions.len(), center: piece.center });
    }
    for (side, material) in materials.into_iter().enumerate() {
        let first_triangle = whole.triangles.len() as u32;
        whole.parts.push(Part { first_triangle, material });
        for (piece, shard) in pieces.iter().zip(&shards) {
            let first = shard.vertices.start as u32;
            let faces = [&piece.outer, &piece.inner][side];
            whole.triangles.extend(faces.iter().map(|t| t.map(|i| i + first)));
        }
    }
    (whole, shards)
}

/// One shard, before it is put beside the others.
#[derive(Default)]
struct Piece {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    outer: Vec<[u32; 3]>,
    inner: Vec<[u32; 3]>,
    center: Vec3,
}

impl Piece {
    fn new(mesh: &Mesh, grid: Grid, pattern: &Pattern, members: &[u32]) -> Self {
        let mut used: Vec<u32> = members.iter().flat_map(|&t| mesh.triangles[t as usize]).collect();
        used.sort_unstable();
        used.dedup();
        let count = used.len() as u32;
        let number = |vertex: u32| used.partition_point(|&u| u < vertex) as u32;
        let mut piece = Self::default();
        for &vertex in &used {
            piece.vertex(mesh.positions[vertex as usize], mesh.normals[vertex as usize]);
        }
        piece.center = piece.positions.iter().sum::<Vec3>() / count.max(1) as f32;
        for i in 0..count as usize {
            let (p, n) = hollow(piece.positions[i], piece.normals[i]);
            piece.vertex(p, n);
        }
        for &t in members {
            let corners = mesh.triangles[t as usize].map(number);
            piece.outer.push(corners);
            let [a, b, c] = corners.map(|i| i + count);
            piece.inner.push([a, c, b]);
            for edge in pattern.border(grid, t as usize) {
                let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
                piece.rim(from, to, count);
            }
        }
        piece
    }

    fn vertex(&mut self, position: Vec3, normal: Vec3) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        (self.positions.len() - 1) as u32
    }

    /// The broken face below an outer edge.
    fn rim(&mut self, from: u32, to: u32, inner: u32) {
        let corners = [from, from + inner, to + inner, to].map(|i| self.positions[i as usize]);
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalize_or(Vec3::Y);
        let [a, b, c, d] = corners.map(|p| self.vertex(p, normal));
        self.inner.push([a, b, c]);
        self.inner.push([a, c, d]);
    }
}

/// The inside of the shell below a point of the outside, and its normal.
fn hollow(p: Vec3, normal: Vec3) -> (Vec3, Vec3) {
    let out = (p - AXIS).with_y(0.0);
    let lift = 0.012 * (1.0 - smoothstep(0.0, 0.03, p.y)) - 0.016 * smoothstep(0.42, 0.52, p.y);
    let inside = AXIS.with_y(p.y + lift) + out * INSIDE;
    let facing = Vec3::new(normal.x / INSIDE, normal.y, normal.z / INSIDE);
    (inside, -facing.normalize_or(Vec3::Y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::statue;

    fn head(triangles: u64) -> (Mesh, Grid) {
        let (rows, columns) = statue::rows_and_columns(triangles);
        let grid = Grid { rings: rows as usize - 1, columns: columns as usize };
        (statue::head(triangles, 0, 3), grid)
    }

    #[test]
    fn neighbours_share_the_edge() {
        for triangles in [24, 1000, 20_000] {
            let (mesh, grid) = head(triangles);
            assert_eq!(mesh.triangles.len(), grid.triangles());
            for (t, corners) in mesh.triangles.iter().enumerate() {
                for (edge, other) in grid.neighbours(t).into_iter().enumerate() {
                    let (a, b) = (corners[edge], corners[(edge + 1) % 3]);
                    let theirs = mesh.triangles[other];
                    let shared = (0..3).any(|i| theirs[i] == b && theirs[(i + 1) % 3] == a);
                    assert!(shared, "{triangles}: {t} {corners:?} edge {edge}: {other} {theirs:?}");
                }
            }
        }
    }

    #[test]
    fn shards_are_connected_and_all_triangles_are_in_one() {
        let (mesh, grid) = head(40_000);
        let pattern = Pattern::new(&mesh, grid, 5);
        assert!(pattern.shards > 100 && pattern.shards < 1000, "{}", pattern.shards);
        let labels: Vec<u64> = pattern.shard_of.iter().map(|&s| s.into()).collect();
        assert_eq!(Pattern::connected(&labels, grid).shards, pattern.shards);
        let (whole, shards) = cut(&mesh, grid, &pattern, [0, 1]);
        let expected = 2 * mesh.triangles.len() as u64 + 2 * pattern.border_sides(grid);
        assert_eq!(whole.triangles.len() as u64, expected);
        let mut owners = vec![0; whole.positions.len()];
        for (shard, number) in shards.iter().zip(1..) {
            owners[shard.vertices.clone()].fill(number);
        }
        assert!(
            whole.triangles.iter().all(|t| t.iter().all(|&i| owners[i as usize] == owners[t[0] as usize]))
        );
        assert!(owners.iter().all(|&o| o > 0));
    }

    #[test]
    fn shards_are_closed_and_no_crumbs() {
        let (mesh, grid) = head(40_000);
        let (whole, shards) = cut(&mesh, grid, &Pattern::new(&mesh, grid, 5), [0, 1]);
        let inner = whole.parts[1].first_triangle as usize;
        for Shard { vertices, center } in &shards {
            // The faces of a closed body cancel out; cones over them from any point make up its volume.
            let (mut sum, mut area, mut outside, mut volume) = (Vec3::ZERO, 0.0, 0.0, 0.0);
            for (t, corners) in whole.triangles.iter().enumerate() {
                if vertices.contains(&(corners[0] as usize)) {
                    let [a, b, c] = corners.map(|i| whole.positions[i as usize] - *center);
                    let face = (b - a).cross(c - a) * 0.5;
                    sum += face;
                    area += face.length();
                    outside += if t < inner { face.length() } else { 0.0 };
                    volume += a.dot(face) / 3.0;
                }
            }
            assert!(sum.length() < 1e-4 * area, "{vertices:?}: {sum} of {area}");
            assert!(outside > 0.99 * CRUMB && volume > 0.0, "{vertices:?}: {outside}, {volume}");
        }
    }
}
