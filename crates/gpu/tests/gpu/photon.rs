//! Photon maps on the software adapter against the CPU's.

use crate::common::software;
use vastlight_gpu::photon::voxels::{self, BOUNDS_WORDS, Bounds, PhotonIndex, Unsorted};
use vastlight_gpu::{Executor, Recording};
use vastlight_math::{Rng, Vec3, warp};
use vastlight_transport::photon::{Kernel, Photon, VoxelGrid};

const RADIUS: f32 = 0.1;

/// A point of the unit cube.
fn point(rng: &mut Rng) -> Vec3 {
    Vec3::new(rng.next_1d(), rng.next_1d(), rng.next_1d())
}

/// Photons where `place` says.
fn photons(count: usize, place: impl Fn(usize, Vec3) -> Vec3) -> Vec<Photon> {
    let mut rng = Rng::new(11);
    let photon = |i| {
        let position = place(i, point(&mut rng));
        let [from, normal] = [(); 2].map(|()| warp::uniform_sphere(rng.next_2d()));
        Photon { position, flux: point(&mut rng), from, normal, segments: 2 + i as u32 % 300 }
    };
    (0..count).map(photon).collect()
}

/// Sets of photons that are hard in one way each, and radii.
fn cases() -> Vec<(&'static str, Vec<Photon>, f32)> {
    let lost = |i: usize, at: Vec3| match i % 7 {
        2 => Vec3::new(at.x, f32::NAN, 0.0),
        5 => Vec3::splat(f32::INFINITY),
        _ => at - 0.5,
    };
    let lattice = |i: usize| Vec3::new((i % 11) as f32, (i / 11 % 11) as f32, (i / 121) as f32) * RADIUS;
    let mut cases: Vec<_> =
        [0, 1, 63, 64, 65, 5000].map(|n| ("random", photons(n, |_, at| at), RADIUS)).into();
    cases.push(("one voxel", photons(3000, |_, at| at * 0.01 + 0.5), RADIUS));
    cases.push(("one place", photons(3000, |_, _| Vec3::splat(-0.3)), RADIUS));
    cases.push(("borders", photons(1331, |i, _| lattice(i)), RADIUS));
    cases.push(("some are lost", photons(5000, lost), 0.01));
    cases.push(("all are lost", photons(300, |_, _| Vec3::NAN), RADIUS));
    cases.push(("no radius", photons(300, |_, at| at), 0.0));
    cases.push(("many", photons(1_000_000, |_, at| at * Vec3::new(1.0, 0.02, 3.0)), 0.004));
    cases
}

/// Order and voxels of photons on a device, and the map.
struct Sorted {
    order: Vec<u32>,
    voxels: Vec<[u32; 2]>,
    map: Vec<u32>,
}

fn words_of(photons: &[Photon]) -> Vec<u32> {
    photons.iter().flat_map(Photon::words).collect()
}

fn bounds(executor: &mut Executor, words: &[u32], count: u32) -> Bounds {
    let mut recording = Recording::new();
    let photons = recording.upload("photons", words);
    let bounds = voxels::record_bounds(&mut recording, photons, count);
    let bounds = recording.download(bounds, BOUNDS_WORDS);
    Bounds::from_words(&executor.run(&recording).expect("runs").words(bounds))
}

fn sort(executor: &mut Executor, photons: &[Photon], radius: f32) -> Sorted {
    let (words, count) = (words_of(photons), photons.len() as u32);
    let Bounds { bounds, kept } = bounds(executor, &words, count);
    let grid = VoxelGrid::new(bounds, [kept, count - kept].map(|n| n as usize), radius, Kernel::Linear);
    let mut recording = Recording::new();
    let photons = recording.upload("photons", &words);
    let index = PhotonIndex {
        map: recording.buffer("map", voxels::map_words(count)),
        voxels: recording.buffer("voxels", voxels::voxel_words(&grid)),
    };
    let unsorted = Unsorted { photons, count, kept };
    let order = voxels::record(&mut recording, unsorted, (&grid, Kernel::Linear), index).expect("few");
    let order = recording.download(order, kept.into());
    let bounds = recording.download(index.voxels, voxels::voxel_words(&grid));
    let map = recording.download(index.map, voxels::map_words(kept));
    let results = executor.run(&recording).expect("runs");
    let voxels = results.words(bounds).chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
    Sorted { order: results.words(order), voxels, map: results.words(map) }
}

#[test]
fn voxels_are_those_of_the_cpu_to_the_bit() {
    let Some(mut executor) = software() else { return };
    for (name, photons, radius) in cases() {
        let sorted = sort(&mut executor, &photons, radius);
        let (order, voxels) = VoxelGrid::index(&photons, radius);
        assert!(sorted.order == order, "{name}: {} photons", photons.len());
        assert!(sorted.voxels == voxels, "{name}: {} photons, {} voxels", photons.len(), voxels.len());
        let placed: Vec<u32> = order.iter().flat_map(|&i| photons[i as usize].words()).collect();
        assert!(sorted.map[VoxelGrid::WORDS..] == placed, "{name}");
    }
}

#[test]
fn a_photon_that_has_moved_is_found() {
    let Some(mut executor) = software() else { return };
    let mut all = photons(5000, |_, at| at);
    let sorted = sort(&mut executor, &all, RADIUS);
    all[77].position.x = 1.0 - all[77].position.x;
    let (order, voxels) = VoxelGrid::index(&all, RADIUS);
    assert!(sorted.order != order && sorted.voxels != voxels);
}
