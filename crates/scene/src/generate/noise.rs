//! Gradient noise (Perlin, "Improving Noise", 2002, with hashed gradients) and its fractal sums.

use vastlight_math::Vec3;

/// Multipliers of a lattice point's coordinates and of the seed in its hash.
pub(super) const PRIMES: [u32; 4] = [0x8da6_b343, 0xd816_3841, 0xcb1a_b31f, 0x9e37_79b9];

/// Mixes the sum of a lattice point's products with [`PRIMES`].
pub(super) const fn mixed(mut h: u32) -> u32 {
    h ^= h >> 15;
    h = h.wrapping_mul(0x2c1b_3c6d);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297a_2d39);
    h ^ h >> 15
}

/// Dot product of (x, y, z) with one of the twelve edge directions of a cube.
pub(super) fn gradient(h: u32, x: f32, y: f32, z: f32) -> f32 {
    let u = if h & 8 == 0 { x } else { y };
    let other = if h & 13 == 12 { x } else { z };
    let v = if h & 12 == 0 { y } else { other };
    // The lowest bits of the hash are signs.
    f32::from_bits(u.to_bits() ^ h << 31) + f32::from_bits(v.to_bits() ^ (h & 2) << 30)
}

/// The largest integer not above `x`, for |x| < 2^31; `f32::floor` is a call where the processor is not known.
pub(super) fn floor(x: f32) -> i32 {
    let cut = x as i32;
    cut - i32::from(x < cut as f32)
}

pub(super) fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Smooth noise of about [-1, 1] with features of size 1.
pub(super) fn noise(p: Vec3, seed: u32) -> f32 {
    let cell = p.to_array().map(floor);
    let d = p - Vec3::from_array(cell.map(|c| c as f32));
    // Hashes of the two coordinates of the corners along each axis, then the eight corners side by side.
    let hash = |axis: usize, step: i32| (cell[axis].wrapping_add(step) as u32).wrapping_mul(PRIMES[axis]);
    let (x, y, z) = ([hash(0, 0), hash(0, 1)], [hash(1, 0), hash(1, 1)], [hash(2, 0), hash(2, 1)]);
    let seed = seed.wrapping_mul(PRIMES[3]);
    let (dx, dy, dz) = ([d.x, d.x - 1.0], [d.y, d.y - 1.0], [d.z, d.z - 1.0]);
    let mut corners = [0.0; 8];
    for (i, corner) in corners.iter_mut().enumerate() {
        let h = mixed(x[i & 1] ^ y[i >> 1 & 1] ^ z[i >> 2] ^ seed);
        *corner = gradient(h, dx[i & 1], dy[i >> 1 & 1], dz[i >> 2]);
    }
    let (u, v, w) = (fade(d.x), fade(d.y), fade(d.z));
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let c = corners;
    let low = mix(mix(c[0], c[1], u), mix(c[2], c[3], u), v);
    let high = mix(mix(c[4], c[5], u), mix(c[6], c[7], u), v);
    mix(low, high, w)
}

/// The octaves of a fractal sum are turned against each other, so that no lattice direction shows.
pub(super) fn next_octave(p: Vec3) -> Vec3 {
    Vec3::new(
        1.6 * p.y + 1.2 * p.z,
        -1.6 * p.x + 0.72 * p.y - 0.96 * p.z,
        -1.2 * p.x - 0.96 * p.y + 1.28 * p.z,
    ) + Vec3::new(11.3, 5.7, 23.1)
}

/// Fractal Brownian motion: octaves of half the size and `gain` of the height each; about [-1, 1].
pub(super) fn fbm(mut p: Vec3, octaves: u32, gain: f32, seed: u32) -> f32 {
    let (mut sum, mut height, mut total) = (0.0, 1.0, 0.0);
    for octave in 0..octaves {
        sum += height * noise(p, seed.wrapping_add(octave));
        total += height;
        height *= gain;
        p = next_octave(p);
    }
    sum / total
}

/// 0 below `low`, 1 above `high`, smooth between.
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_bounded_continuous_and_not_constant() {
        let (mut low, mut high) = (f32::MAX, f32::MIN);
        for i in 0..20_000 {
            let p = Vec3::new(i as f32 * 0.0137, i as f32 * 0.0071, -(i as f32) * 0.0093);
            let n = noise(p, 3);
            (low, high) = (low.min(n), high.max(n));
            assert!((noise(p + Vec3::splat(1e-3), 3) - n).abs() < 0.02);
        }
        assert!(low < -0.5 && high > 0.5 && low > -1.5 && high < 1.5, "{low} {high}");
        assert_eq!(noise(Vec3::new(4.0, -7.0, 2.0), 3), 0.0);
        assert_ne!(noise(Vec3::splat(0.3), 3), noise(Vec3::splat(0.3), 4));
    }
}
