//! What `bench caustics` does with photons: sort and index them, gather around points, give the times.

use super::{Kernel, Photon, PhotonMap, SearchKind};
use rayon::prelude::*;
use std::time::Instant;
use vastlight_math::Vec3;
use vastlight_simd::{Level, Simd8};

/// Points that one thread takes at a time.
const CHUNK: usize = 1024;

/// The figures of a search structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchFigures {
    /// The structure.
    pub kind: SearchKind,
    /// Photons of the map.
    pub photons: usize,
    /// Points around which photons were gathered.
    pub points: usize,
    /// Best time of sorting, packing and indexing, ms.
    pub build_ms: f64,
    /// Best time of gathering, ms.
    pub gather_ms: f64,
    /// Photons within the radius of a point, on average.
    pub near: f64,
    /// The sum of irradiances over all points, W/m²: the same for every structure but for rounding.
    pub irradiance: Vec3,
    /// Memory of the map.
    pub bytes: usize,
}

/// Builds a map and gathers around all `points`, each `repeat` times (at least once), with the current pool.
#[must_use]
pub fn search(
    photons: &[Photon],
    kind: SearchKind,
    radius: f32,
    points: &[Vec3],
    repeat: u32,
) -> SearchFigures {
    let build = || PhotonMap::new(photons, kind, radius, Kernel::default());
    let (build_ms, map) = best_of(repeat, build);
    let (gather_ms, (near, irradiance)) = best_of(repeat, || gather(&map, points));
    let near = near as f64 / points.len().max(1) as f64;
    let (photons, points, bytes) = (map.len(), points.len(), map.bytes());
    SearchFigures { kind, photons, points, build_ms, gather_ms, near, irradiance, bytes }
}

/// The best time, ms, and the last result.
fn best_of<T>(repeat: u32, work: impl Fn() -> T) -> (f64, T) {
    let timed = || {
        let start = Instant::now();
        let result = work();
        (start.elapsed().as_secs_f64() * 1e3, result)
    };
    (1..repeat).fold(timed(), |(best, before), _| {
        drop(before);
        let (ms, result) = timed();
        (best.min(ms), result)
    })
}

/// How many photons were near, and the sum of irradiances.
fn gather(map: &PhotonMap, points: &[Vec3]) -> (usize, Vec3) {
    let level = Level::detect();
    let sums: Vec<(usize, Vec3)> =
        points.par_chunks(CHUNK).map(|points| level.dispatch(Gather { map, points })).collect();
    sums.into_iter().fold((0, Vec3::ZERO), |a, b| (a.0 + b.0, a.1 + b.1))
}

/// [`gather`] around some points.
struct Gather<'a> {
    map: &'a PhotonMap,
    points: &'a [Vec3],
}

impl vastlight_simd::Kernel for Gather<'_> {
    type Output = (usize, Vec3);

    #[inline(always)]
    fn run<S: Simd8>(self, s: S) -> (usize, Vec3) {
        let (mut count, mut sum) = (0, Vec3::ZERO);
        for &point in self.points {
            self.map.near(s, point, |near| {
                count += 1;
                sum += near.flux * near.weight;
            });
        }
        (count, sum)
    }
}
