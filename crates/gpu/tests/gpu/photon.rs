//! Photon maps on the software adapter against the CPU's.

use crate::common::{probe, software};
use vastlight_gpu::photon::PHOTONS_AT_ONCE;
use vastlight_gpu::photon::voxels::{self, BOUNDS_WORDS, Bounds, PhotonIndex, Unsorted};
use vastlight_gpu::{Executor, Groups, Recording};
use vastlight_math::{Rng, Vec3, warp};
use vastlight_transport::photon::{Kernel, Photon, PhotonMap, SearchKind, VoxelGrid};

const RADIUS: f32 = 0.1;

probe!(PHOTON_PROBE = "photon_probe", 4);

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

/// Points in the unit cube, around it, far from it, and at photons.
fn queries(photons: &[Photon]) -> Vec<Vec3> {
    let mut rng = Rng::new(5);
    let mut points: Vec<Vec3> = (0..300).map(|_| point(&mut rng) * 1.4 - 0.2).collect();
    points.extend(photons.iter().step_by(photons.len() / 100 + 1).map(|photon| photon.position));
    points.extend([Vec3::ZERO, Vec3::ONE * 1.05, Vec3::splat(1e30), Vec3::INFINITY, Vec3::NAN]);
    points
}

/// Sums around points on a device: irradiance, and one over what else is known of photons.
fn gathered(
    executor: &mut Executor,
    photons: &[Photon],
    (radius, weight): (f32, Kernel),
    points: &[Vec3],
) -> Vec<[f32; 4]> {
    let (words, count) = (words_of(photons), photons.len() as u32);
    let Bounds { bounds, kept } = bounds(executor, &words, count);
    let grid = VoxelGrid::new(bounds, [kept, count - kept].map(|n| n as usize), radius, weight);
    let mut recording = Recording::new();
    let photons = recording.upload("photons", &words);
    let index = PhotonIndex {
        map: recording.buffer("map", voxels::map_words(count)),
        voxels: recording.buffer("voxels", voxels::voxel_words(&grid)),
    };
    let _order = voxels::record(&mut recording, Unsorted { photons, count, kept }, (&grid, weight), index)
        .expect("few");
    let coordinates: Vec<f32> = points.iter().flat_map(|point| point.to_array()).collect();
    let asked = recording.upload("points", &coordinates);
    let parts = count.div_ceil(PHOTONS_AT_ONCE).max(1) as usize;
    let sums = points.len() * parts;
    let answers = recording.buffer("answers", 4 * sums as u64);
    let groups = Groups::Direct(sums.div_ceil(64) as u32);
    let seen = [answers, asked, index.map, index.voxels];
    recording.dispatch(&PHOTON_PROBE, &(sums as u32), &seen, groups);
    let answers = recording.download(answers, 4 * sums as u64);
    let answers = executor.run(&recording).expect("runs").words(answers);
    let of_point = |point: usize| {
        let own = answers.chunks_exact(4).skip(point).step_by(points.len());
        own.fold([0.0; 4], |sum: [f32; 4], four| std::array::from_fn(|i| sum[i] + f32::from_bits(four[i])))
    };
    (0..points.len()).map(of_point).collect()
}

/// The same of the CPU.
fn expected(map: &PhotonMap, at: Vec3) -> [f32; 4] {
    let (mut irradiance, mut rest) = (Vec3::ZERO, 0.0);
    map.near_at(at, |near| {
        irradiance += near.flux * near.weight;
        rest += near.weight * (near.from.dot(near.normal) + near.segments as f32);
    });
    [irradiance.x, irradiance.y, irradiance.z, rest]
}

/// How many sums differ by more than rounding.
fn differing(map: &PhotonMap, points: &[Vec3], sums: &[[f32; 4]]) -> usize {
    let close = |a: f32, b: f32| (a - b).abs() <= 2e-4 * (1.0 + a.abs().max(b.abs()));
    let differs = |(&at, sums): (&Vec3, &[f32; 4])| {
        let expected = expected(map, at);
        (0..4).any(|i| !close(expected[i], sums[i]))
    };
    points.iter().zip(sums).filter(|&pair| differs(pair)).count()
}

#[test]
fn photons_are_gathered_as_by_the_cpu_and_not_within_another_radius() {
    let Some(mut executor) = software() else { return };
    for (name, photons, radius) in cases().into_iter().filter(|(_, photons, _)| photons.len() < 10_000) {
        let points = queries(&photons);
        for weight in Kernel::ALL {
            let sums = gathered(&mut executor, &photons, (radius, weight), &points);
            let map = PhotonMap::new(&photons, SearchKind::Voxel, radius, weight);
            assert_eq!(differing(&map, &points, &sums), 0, "{name} {weight:?} of {}", photons.len());
            if name == "random" && photons.len() == 5000 {
                let wider = PhotonMap::new(&photons, SearchKind::Voxel, 1.05 * radius, weight);
                assert!(differing(&wider, &points, &sums) > 200);
            }
        }
    }
}

/// More photons around one point than a software driver lets a loop turn: 65,535 times.
#[test]
fn a_focus_of_many_photons_is_gathered_whole() {
    assert!(PHOTON_PROBE.source.contains(&format!("PART: u32 = {PHOTONS_AT_ONCE}u")));
    let Some(mut executor) = software() else { return };
    // Some are elsewhere, so that there are many voxels.
    let photons = photons(150_000, |i, at| if i % 1000 == 0 { at } else { at * 0.01 + 0.5 });
    // Invocations side by side meet the full voxel at different turns.
    let around = (0..27).map(|i| Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32));
    let points: Vec<Vec3> = around.map(|i| (i - 1.0) * 0.055 + 0.505).chain([Vec3::ZERO]).collect();
    let sums = gathered(&mut executor, &photons, (RADIUS, Kernel::Linear), &points);
    let map = PhotonMap::new(&photons, SearchKind::Voxel, RADIUS, Kernel::Linear);
    assert_eq!(differing(&map, &points, &sums), 0, "{sums:?}");
}
