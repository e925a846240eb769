//! Photons in the order of a search structure, and gathering those around a point.

use super::search::{Kept, Search, SearchKind};
use super::{Kernel, Photon, direction};
use rayon::prelude::*;
use vastlight_accel::sort::{Pair, payload};
use vastlight_math::Vec3;
use vastlight_simd::{Level, Simd8};

/// Distances computed at once.
const LANES: usize = 8;
/// Photons that one thread packs at a time.
const CHUNK: usize = 1 << 12;
/// Bits of each of the two numbers of a direction: right to 3e-4.
const BITS: u32 = 14;
/// The most segments that are told from more.
const MOST_SEGMENTS: u32 = u8::MAX as u32;

/// A photon within the radius of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// What it counts, 1/m²: see [`Kernel`].
    pub weight: f32,
    /// Power that arrived, W.
    pub flux: Vec3,
    /// Unit vector to where it came from.
    pub from: Vec3,
    /// Unit geometric normal of the surface, on the side that the light came from.
    pub normal: Vec3,
    /// Segments of its way from the light, at most 255.
    pub segments: u32,
}

/// Words of a photon on a device.
pub const PHOTON_WORDS: usize = 8;

impl Photon {
    /// As it lies on a device: place, power, and the directions packed as in a map.
    #[must_use]
    pub fn words(&self) -> [u32; PHOTON_WORDS] {
        let (at, packed) = (self.position.to_array().map(f32::to_bits), Packed::new(self));
        let flux = packed.flux.map(f32::to_bits);
        [at[0], at[1], at[2], flux[0], flux[1], flux[2], packed.from, packed.normal]
    }
}

/// What of a photon is not its place, in 20 bytes.
#[derive(Clone, Copy, Debug, Default)]
struct Packed {
    flux: [f32; 3],
    /// Where it came from; above, the lower four bits of its segments.
    from: u32,
    /// The normal; above, the upper four.
    normal: u32,
}

impl Packed {
    fn new(photon: &Photon) -> Self {
        let segments = photon.segments.min(MOST_SEGMENTS);
        Self {
            flux: photon.flux.to_array(),
            from: direction::pack(photon.from, BITS) | segments << (2 * BITS),
            normal: direction::pack(photon.normal, BITS) | (segments >> 4) << (2 * BITS),
        }
    }

    #[inline(always)]
    fn near(&self, weight: f32) -> Near {
        Near {
            weight,
            flux: Vec3::from_array(self.flux),
            from: direction::unpack(self.from, BITS),
            normal: direction::unpack(self.normal, BITS),
            segments: self.from >> (2 * BITS) | (self.normal >> (2 * BITS)) << 4,
        }
    }
}

/// Photons to be gathered within one radius around points.
#[derive(Debug)]
pub struct PhotonMap {
    radius: f32,
    kernel: Kernel,
    lost: usize,
    search: Search,
    /// Coordinates, by axis, and [`LANES`] more so that eight can be read anywhere.
    positions: [Vec<f32>; 3],
    packed: Vec<Packed>,
}

impl PhotonMap {
    /// Sorts photons, without those whose place or power is no number, and indexes them for a radius, m. Nothing is near
    /// anything where the radius is not positive, or its square or that's inverse is not a number that f32 has.
    #[must_use]
    pub fn new(photons: &[Photon], kind: SearchKind, radius: f32, weight: Kernel) -> Self {
        let radius = weight.usable(radius);
        let kind = if radius > 0.0 { kind } else { SearchKind::Brute };
        let kept = Kept::of(photons);
        let (search, sorted) = Search::new(kind, photons, &kept, radius);
        let mut map = Self {
            radius,
            kernel: weight,
            lost: kept.lost,
            search,
            positions: [0; 3].map(|_| vec![0.0; kept.photons + LANES]),
            packed: vec![Packed::default(); kept.photons],
        };
        map.fill(photons, &sorted);
        map
    }

    /// Packs photons in their order.
    fn fill(&mut self, photons: &[Photon], sorted: &[Pair]) {
        let [xs, ys, zs] = &mut self.positions;
        let places = (xs.par_chunks_mut(CHUNK), ys.par_chunks_mut(CHUNK), zs.par_chunks_mut(CHUNK));
        let chunks =
            (sorted.par_chunks(CHUNK), self.packed.par_chunks_mut(CHUNK), places.0, places.1, places.2);
        chunks.into_par_iter().for_each(|(sorted, packed, xs, ys, zs)| {
            for (i, &pair) in sorted.iter().enumerate() {
                let photon = &photons[payload(pair) as usize];
                [xs[i], ys[i], zs[i]] = photon.position.to_array();
                packed[i] = Packed::new(photon);
            }
        });
    }

    /// Calls `visit` for every photon within the radius of `at`, always in the same order.
    #[inline(always)]
    pub fn near<S: Simd8>(&self, s: S, at: Vec3, mut visit: impl FnMut(Near)) {
        if self.radius == 0.0 {
            return;
        }
        let (peak, one_over_radius) = (self.kernel.peak(self.radius), s.splat(1.0 / self.radius));
        let limit = s.splat(self.radius * self.radius);
        for [mut first, end] in self.search.runs(&self.positions[0][..self.len()], at).iter() {
            while first < end {
                let squared = self.squared_distances(s, first, at);
                let wanted = u32::MAX >> (32 - (end - first).min(LANES));
                let mut inside = s.bits(s.le(squared, limit)) & wanted;
                if inside != 0 {
                    let shares = self.kernel.shares(s, s.mul(s.sqrt(squared), one_over_radius));
                    let weights = s.to_array(s.mul(shares, s.splat(peak)));
                    while inside != 0 {
                        let lane = inside.trailing_zeros() as usize % LANES;
                        if let Some(packed) = self.packed.get(first + lane) {
                            visit(packed.near(weights[lane]));
                        }
                        inside &= inside - 1;
                    }
                }
                first += LANES;
            }
        }
    }

    /// Of eight photons from `first` on; not a number where there are none.
    #[inline(always)]
    fn squared_distances<S: Simd8>(&self, s: S, first: usize, at: Vec3) -> S::F {
        let mut sum = s.splat(0.0);
        for (positions, at) in self.positions.iter().zip(at.to_array()) {
            let eight =
                positions.get(first..).and_then(|rest| rest.first_chunk()).unwrap_or(&[f32::NAN; LANES]);
            let apart = s.sub(s.load(eight), s.splat(at));
            sum = s.add(sum, s.mul(apart, apart));
        }
        sum
    }

    /// [`PhotonMap::near`] for one point, with the best instructions of the machine.
    pub fn near_at(&self, at: Vec3, visit: impl FnMut(Near)) {
        Level::detect().dispatch(OnePoint { map: self, at, visit });
    }

    /// The radius, m; 0 where the one asked for is of no use.
    #[must_use]
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// The variance along an axis of each photon's light, m².
    pub(crate) fn variance(&self) -> f32 {
        self.kernel.variance() * self.radius * self.radius
    }

    /// How many photons there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.packed.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.packed.is_empty()
    }

    /// How many photons were left out because their place or power was no number.
    #[must_use]
    pub fn lost(&self) -> usize {
        self.lost
    }

    /// Memory of photons and index.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let positions: usize = self.positions.iter().map(|axis| size_of_val(axis.as_slice())).sum();
        positions + size_of_val(self.packed.as_slice()) + self.search.bytes()
    }
}

/// [`PhotonMap::near_at`].
struct OnePoint<'a, V> {
    map: &'a PhotonMap,
    at: Vec3,
    visit: V,
}

impl<V: FnMut(Near)> vastlight_simd::Kernel for OnePoint<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd8>(self, s: S) {
        self.map.near(s, self.at, self.visit);
    }
}

#[cfg(test)]
impl PhotonMap {
    /// These photons with another index.
    pub(super) fn with_search(self, search: Search) -> Self {
        Self { search, ..self }
    }
}
