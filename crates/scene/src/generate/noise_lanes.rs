//! The noise of [`super::noise`] for eight places at once, the same bits: arrays that the compiler turns into vectors.

use super::noise::{PRIMES, fade, floor, gradient, mixed};
use vastlight_math::Vec3;

/// One number for each place.
pub(super) type Lanes = [f32; LANES];
/// Places that are looked at together.
pub(super) const LANES: usize = 8;

/// Eight points, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points([Lanes; 3]);

impl Points {
    pub(super) fn new(points: [Vec3; LANES]) -> Self {
        Self([0, 1, 2].map(|axis| points.map(|p| p[axis])))
    }

    /// Each point through `f`.
    pub(super) fn map(&self, f: impl Fn(Vec3) -> Vec3) -> Self {
        self.map_each(|_, p| f(p))
    }

    /// Each point with its number through `f`.
    pub(super) fn map_each(&self, f: impl Fn(usize, Vec3) -> Vec3) -> Self {
        let [x, y, z] = self.0;
        let mut out = Self([[0.0; LANES]; 3]);
        for i in 0..LANES {
            [out.0[0][i], out.0[1][i], out.0[2][i]] = f(i, Vec3::new(x[i], y[i], z[i])).to_array();
        }
        out
    }

    fn next_octave(&mut self) {
        let [x, y, z] = &mut self.0;
        for i in 0..LANES {
            let (a, b, c) = (x[i], y[i], z[i]);
            x[i] = 1.6 * b + 1.2 * c + 11.3;
            y[i] = -1.6 * a + 0.72 * b - 0.96 * c + 5.7;
            z[i] = -1.2 * a - 0.96 * b + 1.28 * c + 23.1;
        }
    }
}

/// [`super::noise::noise`].
pub(super) fn noise(p: &Points, seed: u32) -> Lanes {
    let seed = seed.wrapping_mul(PRIMES[3]);
    let mut hashes = [[[0_u32; LANES]; 2]; 3];
    let mut offsets = [[[0.0_f32; LANES]; 2]; 3];
    let mut weights = [[0.0_f32; LANES]; 3];
    for axis in 0..3 {
        for i in 0..LANES {
            let x = p.0[axis][i];
            let cell = floor(x);
            let d = x - cell as f32;
            let hash = (cell as u32).wrapping_mul(PRIMES[axis]);
            hashes[axis][0][i] = hash;
            hashes[axis][1][i] = hash.wrapping_add(PRIMES[axis]);
            offsets[axis][0][i] = d;
            offsets[axis][1][i] = d - 1.0;
            weights[axis][i] = fade(d);
        }
    }
    let mut corners = [[0.0; LANES]; 8];
    for (k, corner) in corners.iter_mut().enumerate() {
        let (x, y, z) = (k & 1, k >> 1 & 1, k >> 2);
        for i in 0..LANES {
            let h = mixed(hashes[0][x][i] ^ hashes[1][y][i] ^ hashes[2][z][i] ^ seed);
            corner[i] = gradient(h, offsets[0][x][i], offsets[1][y][i], offsets[2][z][i]);
        }
    }
    for (axis, pairs) in [(0, 4), (1, 2), (2, 1)] {
        for pair in 0..pairs {
            for i in 0..LANES {
                let (a, b) = (corners[2 * pair][i], corners[2 * pair + 1][i]);
                corners[pair][i] = a + (b - a) * weights[axis][i];
            }
        }
    }
    corners[0]
}

/// [`super::noise::fbm`].
pub(super) fn fbm(mut p: Points, octaves: u32, gain: f32, seed: u32) -> Lanes {
    let (mut sum, mut height, mut total) = ([0.0; LANES], 1.0, 0.0);
    for octave in 0..octaves {
        let n = noise(&p, seed.wrapping_add(octave));
        for i in 0..LANES {
            sum[i] += height * n[i];
        }
        total += height;
        height *= gain;
        p.next_octave();
    }
    sum.map(|s| s / total)
}

/// Ridged noise (Musgrave): crests where the noise crosses zero, each octave where the last one was high; [0, 1].
pub(super) fn ridged(mut p: Points, octaves: u32, gain: f32, seed: u32) -> Lanes {
    let (mut sum, mut height, mut total, mut weight) = ([0.0; LANES], 1.0, 0.0, [1.0_f32; LANES]);
    for octave in 0..octaves {
        let n = noise(&p, seed.wrapping_add(octave));
        for i in 0..LANES {
            let crest = 1.0 - n[i].abs();
            let crest = crest * crest * weight[i];
            weight[i] = (crest * 1.8).clamp(0.0, 1.0);
            sum[i] += height * crest;
        }
        total += height;
        height *= gain;
        p.next_octave();
    }
    sum.map(|s| s / total)
}

#[cfg(test)]
mod tests {
    use super::super::{chance::Chance, noise as one};
    use super::*;

    /// Ridged noise at one place.
    fn ridged_one(mut p: Vec3, octaves: u32, gain: f32, seed: u32) -> f32 {
        let (mut sum, mut height, mut total, mut weight) = (0.0, 1.0, 0.0, 1.0_f32);
        for octave in 0..octaves {
            let crest = 1.0 - one::noise(p, seed.wrapping_add(octave)).abs();
            let crest = crest * crest * weight;
            weight = (crest * 1.8).clamp(0.0, 1.0);
            sum += height * crest;
            total += height;
            height *= gain;
            p = one::next_octave(p);
        }
        sum / total
    }

    #[test]
    fn eight_at_once_are_the_same_bits_as_one_by_one() {
        let mut chance = Chance::new(4, 4);
        for round in 0..500 {
            let reach = [1.0, 30.0, 9000.0][round % 3];
            let points = [(); LANES].map(|()| chance.direction() * chance.range(0.0, reach));
            let (seed, lanes) = (round as u32 * 77, Points::new(points));
            let bits = |values: Lanes| values.map(f32::to_bits);
            assert_eq!(bits(noise(&lanes, seed)), bits(points.map(|p| one::noise(p, seed))));
            assert_eq!(bits(fbm(lanes, 5, 0.5, seed)), bits(points.map(|p| one::fbm(p, 5, 0.5, seed))));
            let ridges = points.map(|p| ridged_one(p, 14, 0.47, seed));
            assert_eq!(bits(ridged(lanes, 14, 0.47, seed)), bits(ridges));
            assert_ne!(bits(ridged(lanes, 14, 0.47, seed + 1)), bits(ridges));
        }
    }
}
