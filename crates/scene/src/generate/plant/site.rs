//! A site of process units, as many as the triangles ask for: each a mesh of its own, none like another.

use super::unit::{PITCH, unit};
use super::{Finishes, finishes, sky};
use crate::generate::GenerateOptions;
use crate::generate::builder::Builder;
use crate::generate::chance::Chance;
use crate::generate::palette::{srgb, stone};
use crate::generate::solids;
use crate::{Camera, Piece, PieceInstance, SceneStream, read_ahead};
use vastlight_math::{Affine3, Vec3};

/// Triangles of a unit, at most.
const UNIT: u64 = 700_000;
/// Units between two roads, and the width of those.
const BLOCK: u32 = 4;
const ROAD: f32 = 9.0;

/// Where the units stand.
#[derive(Clone, Copy, Debug)]
struct Layout {
    units: u64,
    /// Units along x.
    columns: u32,
    /// Half the site along x and z, in metres.
    half: [f32; 2],
}

/// Metres from the first unit's middle to that of unit `i` of a row.
fn along(i: u32) -> f32 {
    PITCH * i as f32 + ROAD * (i / BLOCK) as f32
}

impl Layout {
    fn new(units: u64) -> Self {
        let columns = (units as f64).sqrt().ceil().max(1.0) as u32;
        let rows = units.div_ceil(u64::from(columns)) as u32;
        Self { units, columns, half: [columns, rows].map(|n| along(n.saturating_sub(1)) * 0.5) }
    }

    /// The middle of a unit; the first row is the nearest to the viewer (+z).
    fn middle(&self, unit: u64) -> Vec3 {
        let (column, row) =
            ((unit % u64::from(self.columns)) as u32, (unit / u64::from(self.columns)) as u32);
        Vec3::new(along(column) - self.half[0], 0.0, self.half[1] - along(row))
    }
}

/// The site of this many triangles.
pub(super) fn site(triangles: u64, options: &GenerateOptions) -> SceneStream {
    let mut b = Builder::default();
    let f = finishes(&mut b, options.seed);
    // Grinding marks need tangents, which would double what a unit costs.
    b.desc.materials.iter_mut().for_each(|material| material.anisotropy = 0.0);
    let gravel = b.material(stone("gravel", srgb(0x77736b), 0.95));
    let layout = Layout::new(triangles.div_ceil(UNIT).max(1));
    ground(&mut b, &f, gravel, &layout);
    b.desc.environment = Some(sky(-2.3, 0.62, 1.4));
    b.desc.cameras.extend(cameras(&layout));
    let unit_name = b.desc.names.len() as u32;
    b.desc.names.push("process unit".into());
    let ground = SceneStream::from(std::mem::take(&mut b.desc));
    let root = Chance::new(options.seed, 600);
    let units = read_ahead(0..layout.units, rayon::current_num_threads(), move |number| {
        let budget = triangles * (number + 1) / layout.units - triangles * number / layout.units;
        let mesh = unit(&f, budget as usize, &root.part(number));
        let world_from_object = Affine3::from_translation(layout.middle(number));
        let instances = vec![PieceInstance { world_from_object, name: unit_name }];
        Ok(Piece { mesh, instances, ..Piece::default() })
    });
    SceneStream { pieces: Box::new(ground.pieces.chain(units)), triangles: Some(triangles), ..ground }
}

/// Concrete under the units, gravel to the horizon.
fn ground(b: &mut Builder, f: &Finishes, gravel: u32, layout: &Layout) {
    let [x, z] = layout.half.map(|half| 2.0 * half + PITCH);
    b.object("slab", f.concrete, &solids::floor(x, z));
    b.object("gravel", gravel, &solids::floor(x + 4000.0, z + 4000.0).at(0.0, -0.05, 0.0));
}

/// From a crane before the site, from the ground between two units, and from afar.
fn cameras(layout: &Layout) -> [Camera; 3] {
    let [x, z] = layout.half;
    let look = |name: &str, eye: Vec3, target: Vec3, degrees: f32| {
        Camera::look_at(name, eye, target, degrees.to_radians())
    };
    let front = Vec3::new(0.0, 0.0, z);
    let lane = layout.middle(u64::from(layout.columns / 2)).x - PITCH * 0.5;
    let size = x.max(z) + PITCH;
    [
        look(
            "crane",
            front + Vec3::new(PITCH * 0.3, 17.0, PITCH * 1.35),
            front + Vec3::new(-PITCH * 0.5, 6.0, -PITCH * 1.2),
            50.0,
        ),
        look("lane", Vec3::new(lane, 1.75, z + 6.5), Vec3::new(lane + 0.6, 3.4, z - 12.0), 60.0),
        look(
            "overview",
            Vec3::new(size * 0.8, size * 0.75, z + size * 0.9),
            Vec3::new(0.0, 0.0, -0.1 * z),
            45.0,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::generate::shape::turn;
    use std::collections::BTreeMap;

    /// For each connected piece of the mesh its triangles and a key that motion and scaling do not change: of the sorted
    /// ratios of edges to the longest edge the first, two in the middle, and the mean.
    fn pieces(mesh: &Mesh) -> Vec<(u64, [i64; 4])> {
        let mut sorted: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        let bits = |i: u32| mesh.positions[i as usize].to_array().map(f32::to_bits);
        sorted.sort_by_key(|&i| bits(i));
        let mut parent: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        fn root(parent: &mut [u32], mut i: u32) -> u32 {
            while parent[i as usize] != i {
                parent[i as usize] = parent[parent[i as usize] as usize];
                i = parent[i as usize];
            }
            i
        }
        let equal = sorted.windows(2).filter(|w| bits(w[0]) == bits(w[1])).map(|w| [w[0], w[1]]);
        for [a, b] in equal.chain(mesh.triangles.iter().flat_map(|t| [[t[0], t[1]], [t[0], t[2]]])) {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            parent[a as usize] = b;
        }
        let mut edges: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for (t, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(t as u32).map(|p| p.as_dvec3());
            let lengths = [(b - a).length(), (c - b).length(), (a - c).length()];
            edges.entry(root(&mut parent, triangle[0])).or_default().extend(lengths);
        }
        edges.values().map(|lengths| key(lengths)).collect()
    }

    fn key(lengths: &[f64]) -> (u64, [i64; 4]) {
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        // Positions a few metres from the origin are rounded to a micrometre.
        let quantum = if longest < 0.5 { 1e-4 } else { 2e-6 };
        let mut ratios: Vec<f64> = lengths.iter().map(|l| l / longest).collect();
        ratios.sort_by(f64::total_cmp);
        let (count, mean) = (ratios.len(), ratios.iter().sum::<f64>() / ratios.len() as f64);
        let rounded =
            [ratios[0], ratios[count / 4], ratios[count / 2], mean].map(|r| (r / quantum).round() as i64);
        (count as u64 / 3, rounded)
    }

    /// The share of triangles in pieces of which there is another one like it before.
    fn saved_by_deduplication(meshes: &[Mesh]) -> f64 {
        let mut seen = std::collections::BTreeSet::new();
        let (mut all, mut saved) = (0, 0);
        for (triangles, key) in meshes.iter().flat_map(pieces) {
            all += triangles;
            saved += if seen.insert((triangles, key)) { 0 } else { triangles };
        }
        saved as f64 / all as f64
    }

    fn some_units(count: usize) -> Vec<Mesh> {
        let options = GenerateOptions { triangles: None, seed: 3, ..GenerateOptions::default() };
        let stream = site(300_000_000, &options);
        stream.pieces.skip(2).take(count).map(|p| p.expect("made").mesh).collect()
    }

    #[test]
    fn no_two_parts_are_alike_up_to_motion_and_scaling() {
        let units = some_units(2);
        let saved = saved_by_deduplication(&units);
        assert!(saved < 0.05, "{saved}");
        // The same part, moved, turned and scaled, is found.
        let mut twice = units[0].clone();
        let map = turn(0.7) * Affine3::from_scale(Vec3::splat(1.25));
        twice.positions.iter_mut().for_each(|p| *p = map.transform_point3(*p));
        let saved = saved_by_deduplication(&[units[0].clone(), twice]);
        assert!(saved > 0.4, "{saved}");
    }

    #[test]
    fn units_are_small_and_meet_their_number() {
        for mesh in some_units(24) {
            let missing = UNIT as usize - mesh.triangles.len();
            assert!(missing < 3_000, "{missing}");
            let reach = mesh.bounds().size() * 0.5;
            assert!(reach.x.max(reach.z) <= PITCH * 0.5 + 0.6, "{reach}");
        }
    }
}
