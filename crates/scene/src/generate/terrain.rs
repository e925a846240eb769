//! Mountains of any number of triangles: ridged noise worn by its own slope, coloured by height and steepness.
//!
//! The surface is a function of the place alone, so that every tile of the grid is made by itself. Neighbouring tiles
//! have equal vertices along their border, and keep them when each is snapped to its own lattice: all vertices are on
//! the lattice of the whole square already, and a smaller mesh's lattice holds the points of a larger one's.

use super::noise::smoothstep;
use super::noise_lanes::{LANES, Lanes, Points, fbm, noise, ridged};
use super::palette::{srgb, stone};
use super::{GenerateOptions, builder::Builder};
use crate::{Camera, Environment, Lattice, Mesh, Part, Piece, SceneStream, Sky, read_ahead};
use std::ops::Range;
use vastlight_math::{Vec2, Vec3, Vec4, real::sin_cos};

/// Edge of the square in metres.
const EDGE: f32 = 6000.0;
/// Highest summit above the valleys, about.
const HEIGHT: f32 = 1500.0;
/// Cells along the edge of the largest tile.
const TILE: u32 = 512;

/// The scene.
pub(super) fn terrain(options: &GenerateOptions) -> SceneStream {
    let mut b = Builder::default();
    let ground = b.material(stone("ground", Vec3::ONE, 0.85));
    b.desc.names.push("terrain".into());
    b.desc.environment = Some(Environment::Sky(Sky {
        sun_azimuth: 1.95,
        sun_elevation: 0.40,
        turbidity: 2.6,
        ground_albedo: Vec3::new(0.2, 0.19, 0.17),
        strength: 3.0,
        sun_disc: true,
    }));
    b.desc.cameras.push(camera(options.seed as u32));
    let grid = Grid::new(options.triangles.unwrap_or(2_000_000), ground, options.seed as u32);
    let tiles = grid.tiles();
    let pieces = read_ahead(0..tiles[0] * tiles[1], rayon::current_num_threads(), move |tile| {
        let (across, along) = (tile % tiles[0], tile / tiles[0]);
        let part = |cells: u32, n: u32, i: u32| {
            let at = |i: u32| (u64::from(cells) * u64::from(i) / u64::from(n)) as u32;
            at(i)..at(i + 1)
        };
        let mesh = grid.tile(part(grid.columns, tiles[0], across), part(grid.rows, tiles[1], along));
        Ok(Piece::placed(mesh, 0))
    });
    SceneStream { desc: b.desc, pieces, triangles: Some(grid.triangles()), rows: Vec::new() }
}

/// Stands above a slope at the near edge and looks over the valley.
fn camera(seed: u32) -> Camera {
    let at = Vec2::new(valley_line(EDGE * 0.45) + 260.0, EDGE * 0.45);
    let eye = Vec3::new(at.x, heights([at; LANES], seed, 8)[0] + 230.0, at.y);
    Camera::look_at("overlook", eye, Vec3::new(-60.0, eye.y + 30.0, -1200.0), 36_f32.to_radians())
}

/// Cells along x and z whose product is as near to half the triangles as it gets.
fn cells(triangles: u64) -> (u32, u32) {
    let half = (triangles / 2).max(1);
    let columns = (half as f64).sqrt().round().max(1.0) as u64;
    let rows = ((half + columns / 2) / columns).max(1);
    (columns as u32, rows as u32)
}

/// The whole square.
#[derive(Clone, Copy, Debug)]
struct Grid {
    columns: u32,
    rows: u32,
    octaves: u32,
    lattice: Lattice,
    material: u32,
    seed: u32,
}

impl Grid {
    fn new(triangles: u64, material: u32, seed: u32) -> Self {
        let (columns, rows) = cells(triangles);
        let octaves = octaves(EDGE / columns.max(rows) as f32);
        // Summits stay below half the edge, so no tile's own lattice is coarser.
        Self { columns, rows, octaves, lattice: Lattice::for_extent(EDGE * 0.5), material, seed }
    }

    fn triangles(&self) -> u64 {
        2 * u64::from(self.columns) * u64::from(self.rows)
    }

    /// Numbers of tiles along both axes.
    fn tiles(&self) -> [u32; 2] {
        [self.columns, self.rows].map(|cells| cells.div_ceil(TILE))
    }

    /// The surface at vertices of a row of the grid, not snapped.
    fn positions(&self, columns: Range<u32>, row: u32, positions: &mut Vec<Vec3>) {
        for first in columns.clone().step_by(LANES) {
            let at: [Vec2; LANES] = std::array::from_fn(|i| {
                let column = (first + i as u32).min(columns.end - 1);
                let (u, v) = (column as f32 / self.columns as f32 - 0.5, row as f32 / self.rows as f32 - 0.5);
                Vec2::new(u * EDGE, v * EDGE)
            });
            let heights = heights(at, self.seed, self.octaves);
            let found = at.iter().zip(heights).map(|(at, height)| Vec3::new(at.x, height, at.y));
            positions.extend(found.take((columns.end - first) as usize));
        }
    }

    /// The mesh of these cells. A rim of one more vertex around them gives the normals.
    fn tile(&self, columns: Range<u32>, rows: Range<u32>) -> Mesh {
        let rim =
            |cells: &Range<u32>, last: u32| cells.start.saturating_sub(1)..(cells.end + 1).min(last) + 1;
        let (rim_columns, rim_rows) = (rim(&columns, self.columns), rim(&rows, self.rows));
        let mut positions = Vec::with_capacity(rim_columns.len() * rim_rows.len());
        for row in rim_rows.clone() {
            self.positions(rim_columns.clone(), row, &mut positions);
        }
        let at = |column: u32, row: u32| {
            let column = column.clamp(rim_columns.start, rim_columns.end - 1) - rim_columns.start;
            let row = row.clamp(rim_rows.start, rim_rows.end - 1) - rim_rows.start;
            positions[row as usize * rim_columns.len() + column as usize]
        };
        let paints = Paints::new();
        let count = (columns.len() + 1) * (rows.len() + 1);
        let mut mesh = Mesh {
            name: "terrain".into(),
            positions: Vec::with_capacity(count),
            normals: Vec::with_capacity(count),
            colors: Vec::with_capacity(count),
            triangles: cell_triangles(columns.len() as u32, rows.len() as u32),
            parts: vec![Part { first_triangle: 0, material: self.material }],
            ..Mesh::default()
        };
        for j in rows.start..=rows.end {
            for i in columns.start..=columns.end {
                let along_x = at(i + 1, j) - at(i.saturating_sub(1), j);
                let along_z = at(i, j + 1) - at(i, j.saturating_sub(1));
                let normal = along_z.cross(along_x).normalize();
                mesh.positions.push(self.lattice.snap(at(i, j)));
                mesh.normals.push(normal);
            }
        }
        for (positions, normals) in mesh.positions.chunks(LANES).zip(mesh.normals.chunks(LANES)) {
            mesh.colors.extend(&colors(&paints, positions, normals, self.seed)[..positions.len()]);
        }
        mesh
    }
}

/// Two triangles a cell, row by row.
fn cell_triangles(columns: u32, rows: u32) -> Vec<[u32; 3]> {
    let stride = columns + 1;
    let mut triangles = Vec::with_capacity(2 * columns as usize * rows as usize);
    for row in 0..rows {
        for a in row * stride..row * stride + columns {
            let below = a + stride;
            triangles.extend([[a, below, below + 1], [a, below + 1, a + 1]]);
        }
    }
    triangles
}

/// Octaves whose features a grid of this step can show.
fn octaves(step: f32) -> u32 {
    let finest = EDGE / 3.0 / step.max(1e-3);
    (vastlight_math::real::ln(finest.max(2.0)) / std::f32::consts::LN_2).ceil().clamp(5.0, 14.0) as u32
}

/// Heights above the lowest valley in metres.
fn heights(at: [Vec2; LANES], seed: u32, octaves: u32) -> Lanes {
    let p = Points::new(at.map(|at| Vec3::new(at.x, 0.0, at.y) / 2100.0));
    let bend_x = fbm(p.map(|p| p * 1.3), 3, 0.5, seed ^ 0xa1);
    let bend_z = fbm(p.map(|p| p * 1.3 + Vec3::splat(7.7)), 3, 0.5, seed ^ 0xb2);
    let p = p.map_each(|i, p| p + Vec3::new(bend_x[i], 0.0, bend_z[i]) * 0.28 + Vec3::Y * 0.37);
    let massifs = noise(&p.map(|p| p * 0.9), seed ^ 0xc3);
    let crests = ridged(p, octaves, 0.47, seed);
    let valleys = fbm(p.map(|p| p * 3.0), 4, 0.5, seed ^ 0xd4);
    let mut heights = [0.0; LANES];
    for (i, height) in heights.iter_mut().enumerate() {
        let massif = massif(at[i]) * (0.82 + 0.3 * massifs[i]);
        let valley = 0.06 + 0.05 * valleys[i];
        *height = HEIGHT * (valley + massif * (crests[i] * 1.15 - 0.08).max(0.0));
    }
    heights
}

/// How much of a mountain stands here: a valley winds towards the viewer from a wall at its end.
fn massif(at: Vec2) -> f32 {
    let beside = (at.x - valley_line(at.y)).abs();
    let sides = smoothstep(120.0, 1750.0, beside);
    let end = smoothstep(-700.0, -2300.0, at.y);
    sides + end - sides * end
}

/// The valley's middle.
fn valley_line(z: f32) -> f32 {
    420.0 * sin_cos(z / 780.0).0
}

/// Colours of the ground.
struct Paints {
    rock: [Vec3; 2],
    meadow: [Vec3; 2],
    scree: Vec3,
}

impl Paints {
    fn new() -> Self {
        Self {
            rock: [srgb(0x7d7064), srgb(0x544c46)],
            meadow: [srgb(0x5f6a35), srgb(0x8a7d48)],
            scree: srgb(0x8f857a),
        }
    }
}

/// Meadow, scree, rock and snow at up to eight places.
fn colors(paints: &Paints, positions: &[Vec3], normals: &[Vec3], seed: u32) -> [Vec4; LANES] {
    let last = positions.len() - 1;
    let p = Points::new(std::array::from_fn(|i| positions[i.min(last)]));
    let patches = fbm(p.map(|p| p / 160.0), 4, 0.55, seed ^ 0xe5);
    let strata = noise(&p.map(|p| p / Vec3::new(900.0, 26.0, 900.0)), seed ^ 0xf6);
    std::array::from_fn(|i| {
        color(paints, positions[i.min(last)].y, normals[i.min(last)].y, patches[i], strata[i])
    })
}

/// The colour at a height where the normal has this upward component; `patch` and `strata` are noise.
fn color(paints: &Paints, height: f32, up: f32, patch: f32, strata: f32) -> Vec4 {
    let h = height / HEIGHT + 0.07 * patch;
    let steep = 1.0 - up;
    let rock = paints.rock[0].lerp(paints.rock[1], 0.5 + 0.5 * strata) * (1.0 + 0.3 * patch);
    let meadow = paints.meadow[0].lerp(paints.meadow[1], smoothstep(-0.3, 0.4, patch));
    let green = smoothstep(0.40, 0.20, h) * smoothstep(0.34, 0.16, steep);
    let loose = smoothstep(0.42, 0.25, steep) * smoothstep(0.2, 0.45, h);
    let snow = smoothstep(0.58, 0.74, h) * smoothstep(0.5, 0.32, steep);
    rock.lerp(paints.scree, loose * 0.6).lerp(meadow, green).lerp(Vec3::splat(0.86), snow).extend(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Scene, SceneDesc};
    use std::collections::BTreeSet;

    /// Vertices of a tile on one of its sides, after its own lattice.
    fn border(mesh: Mesh, side: impl Fn(Vec3) -> bool) -> BTreeSet<[u32; 3]> {
        let scene = Scene::new(SceneDesc { meshes: vec![mesh], ..SceneDesc::default() }).expect("valid");
        let positions = scene.meshes()[0].positions.iter().filter(|&&p| side(p));
        positions.map(|p| p.to_array().map(f32::to_bits)).collect()
    }

    #[test]
    fn tiles_meet_exactly_after_each_was_snapped_to_its_own_lattice() {
        let mut grid = Grid::new(2_000_000_000, 0, 5);
        let middle = grid.columns / 2;
        // The tile to the right of x = 2048 has a lattice of its own that is coarser than that to the left.
        let seam = ((2048.0 / EDGE + 0.5) * grid.columns as f32) as u32;
        let places = [(seam, middle), (middle, middle), (40, middle), (middle + 9, grid.rows - 20)];
        for (fine, expect_equal) in [(false, true), (true, false)] {
            if fine {
                grid.lattice = Lattice { step: grid.lattice.step / 64.0 };
            }
            let equal = places.iter().all(|&(i, j)| {
                let mut vertex = Vec::new();
                grid.positions(i..i + 1, j, &mut vertex);
                let seam = grid.lattice.snap(vertex[0]).x;
                let near = |p: Vec3| (p.x - seam).abs() < 0.02;
                let (left, right) = (grid.tile(i - 9..i, j..j + 9), grid.tile(i..i + 5, j..j + 9));
                let (left, right) = (border(left, near), border(right, near));
                assert_eq!((left.len(), right.len()), (10, 10));
                left == right
            });
            assert_eq!(equal, expect_equal);
        }
    }

    #[test]
    fn tiles_cover_the_grid_once() {
        let triangles = 3 * 600 * 600 * 2;
        let options = GenerateOptions { triangles: Some(triangles), seed: 1, ..GenerateOptions::default() };
        let stream = terrain(&options);
        let expected = stream.triangles.expect("known");
        let (mut made, mut area) = (0, 0.0);
        for piece in stream.pieces {
            let mesh = piece.expect("made").mesh;
            made += mesh.triangles.len() as u64;
            area += (0..mesh.triangles.len() as u32)
                .map(|t| {
                    let [a, b, c] = mesh.corners(t);
                    f64::from((b - a).cross(c - a).y) * 0.5
                })
                .sum::<f64>();
        }
        assert_eq!(made, expected);
        let square = f64::from(EDGE) * f64::from(EDGE);
        assert!((area / square - 1.0).abs() < 1e-6, "{area}");
    }
}
