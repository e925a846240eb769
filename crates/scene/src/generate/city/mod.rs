//! A city of blocks: buildings put together from facade modules, trees, cars and lamps, all of them instances.
//!
//! A handful of meshes is placed again and again, from the middle outwards, until the triangles are used up: ten
//! million instances are a matter of the number asked for (about 240 triangles an instance). Each mesh comes with all
//! its placements; the city is laid out again and again, each time for a few meshes, so that no more than a million
//! placements or those of one mesh are in memory.

mod blocks;
mod modules;

use super::builder::Builder;
use super::{DemoSize, GenerateOptions, textures};
use crate::{Camera, Environment, Piece, PieceInstance, SceneDesc, SceneStream, Sky};
use std::ops::Range;
use vastlight_math::{Affine3, Vec3};

/// Triangles of a city of its own size.
const USUAL: u64 = 4_000_000;
/// Placements that are laid out at a time, unless those of one mesh are more.
const AT_A_TIME: u64 = 1_000_000;

/// The scene.
pub(super) fn city(options: &GenerateOptions) -> SceneStream {
    let (mut desc, empty) = parts(options);
    desc.environment = Some(Environment::Sky(Sky {
        sun_azimuth: -2.25,
        sun_elevation: 0.52,
        turbidity: 3.5,
        ground_albedo: Vec3::splat(0.22),
        strength: 2.0,
        sun_disc: true,
    }));
    let (eye, target) = (Vec3::new(36.0, 27.0, 96.0), Vec3::new(31.0, 12.0, 0.0));
    desc.cameras.push(Camera::look_at("above the street", eye, target, 46_f32.to_radians()));
    let meshes = std::mem::take(&mut desc.meshes);
    desc.names = meshes.iter().map(|mesh| mesh.name.clone()).collect();
    let unique = empty.triangles.iter().sum();
    let counts = empty.clone().laid_out(0..0, options.seed).counts;
    let mut meshes = meshes.into_iter();
    let seed = options.seed;
    let pieces = groups(&counts).into_iter().flat_map(move |group| {
        let placed = empty.clone().laid_out(group, seed).placed;
        let pieces = placed.into_iter().zip(meshes.by_ref());
        pieces.map(|(instances, mesh)| Ok(Piece { mesh, instances, ..Piece::default() })).collect::<Vec<_>>()
    });
    SceneStream { desc, pieces: Box::new(pieces), triangles: Some(unique), rows: Vec::new() }
}

/// How large the scene will be.
pub(super) fn size(options: &GenerateOptions) -> DemoSize {
    let (_, empty) = parts(options);
    let triangles = empty.triangles.iter().sum();
    DemoSize { triangles, instances: empty.laid_out(0..0, options.seed).counts.iter().sum() }
}

/// A description with the meshes that the city is put together from, and the site where nothing stands yet.
fn parts(options: &GenerateOptions) -> (SceneDesc, Site) {
    let mut b = Builder::default();
    let kit = modules::Kit::new(&mut b, options.seed);
    let triangles = b.desc.meshes.iter().map(|mesh| mesh.triangles.len() as u64).collect();
    let site = Site::new(kit, triangles, options.triangles.unwrap_or(USUAL));
    (b.desc, site)
}

/// Runs of meshes with at most [`AT_A_TIME`] placements, or of one mesh.
fn groups(counts: &[u64]) -> Vec<Range<usize>> {
    let mut groups: Vec<Range<usize>> = Vec::new();
    let mut placements = 0;
    for (mesh, &count) in counts.iter().enumerate() {
        placements += count;
        match groups.last_mut() {
            Some(group) if placements <= AT_A_TIME => group.end = mesh + 1,
            _ => {
                groups.push(mesh..mesh + 1);
                placements = count;
            }
        }
    }
    groups
}

/// A city that grows until its triangles are used up.
#[derive(Clone)]
struct Site {
    kit: modules::Kit,
    /// Triangles of each mesh.
    triangles: Vec<u64>,
    left: u64,
    /// Placements of each mesh so far.
    counts: Vec<u64>,
    /// Meshes whose placements are kept.
    kept: Range<usize>,
    placed: Vec<Vec<PieceInstance>>,
}

impl Site {
    fn new(kit: modules::Kit, triangles: Vec<u64>, left: u64) -> Self {
        let counts = vec![0; triangles.len()];
        Self { kit, triangles, left, counts, kept: 0..0, placed: Vec::new() }
    }

    /// The whole city, with the placements of these meshes.
    fn laid_out(mut self, kept: Range<usize>, seed: u64) -> Self {
        self.placed = vec![Vec::new(); kept.len()];
        self.kept = kept;
        self.ground();
        blocks::blocks(&mut self, seed);
        blocks::bollards(&mut self);
        self
    }

    /// Places a mesh; false once the triangles are used up.
    fn place(&mut self, mesh: u32, world_from_object: Affine3) -> bool {
        let number = mesh as usize;
        if self.left < self.triangles[number] {
            return false;
        }
        self.left -= self.triangles[number];
        self.counts[number] += 1;
        if self.kept.contains(&number) {
            self.placed[number - self.kept.start].push(PieceInstance { world_from_object, name: mesh });
        }
        true
    }

    /// A box between two corners from a unit box.
    fn slab(&mut self, mesh: u32, low: Vec3, high: Vec3) -> bool {
        let place = Affine3::from_translation((low + high) * 0.5) * Affine3::from_scale(high - low);
        self.place(mesh, place)
    }

    /// Asphalt to the horizon.
    fn ground(&mut self) {
        let reach = 4000.0;
        let asphalt = self.kit.asphalt;
        self.slab(asphalt, Vec3::new(-reach, -1.0, -reach), Vec3::new(reach, 0.0, reach));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn groups_cover_all_meshes_and_are_small() {
        let counts = [5, 999_990, 6, 3_000_000, 0, 1_000_000, 1];
        assert_eq!(groups(&counts), [0..2, 2..3, 3..4, 4..6, 6..7]);
        assert!(groups(&[]).is_empty());
    }

    #[test]
    fn a_million_instances_share_few_meshes() {
        let options = GenerateOptions { triangles: Some(240_000_000), seed: 2, ..GenerateOptions::default() };
        let (mut meshes, mut instances, mut triangles) = (0_usize, 0_usize, 0);
        let mut places = BTreeSet::new();
        for piece in city(&options).pieces {
            let piece = piece.expect("made");
            meshes += 1;
            instances += piece.instances.len();
            triangles += piece.mesh.triangles.len() as u64 * piece.instances.len() as u64;
            if piece.mesh.name == "car" {
                places.extend(
                    piece.instances.iter().map(|i| i.world_from_object.to_cols_array().map(f32::to_bits)),
                );
            }
        }
        assert!(meshes < 60 && instances > 900_000, "{meshes} {instances}");
        assert_eq!(size(&options).instances, instances as u64);
        assert!(triangles.abs_diff(240_000_000) < 2_400_000);
        assert!(places.len() > 1_000);
    }
}
