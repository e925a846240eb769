//! Gradient noise (Perlin, "Improving Noise", 2002, with hashed gradients) and its fractal sums.

use vastlight_math::Vec3;

/// A hash of a lattice point.
fn hash(x: i32, y: i32, z: i32, seed: u32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x8da6_b343)
        ^ (y as u32).wrapping_mul(0xd816_3841)
        ^ (z as u32).wrapping_mul(0xcb1a_b31f)
        ^ seed.wrapping_mul(0x9e37_79b9);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2c1b_3c6d);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297a_2d39);
    h ^ h >> 15
}

/// Dot product of `d` with one of the twelve edge directions of a cube.
fn gradient(h: u32, d: Vec3) -> f32 {
    let u = if h & 8 == 0 { d.x } else { d.y };
    let v = if h & 12 == 0 {
        d.y
    } else if h & 13 == 12 {
        d.x
    } else {
        d.z
    };
    (if h & 1 == 0 { u } else { -u }) + (if h & 2 == 0 { v } else { -v })
}

fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Smooth noise of about [-1, 1] with features of size 1.
pub(super) fn noise(p: Vec3, seed: u32) -> f32 {
    let cell = p.floor();
    let d = p - cell;
    let (x, y, z) = (cell.x as i32, cell.y as i32, cell.z as i32);
    let corner = |i: i32, j: i32, k: i32| {
        let h = hash(x.wrapping_add(i), y.wrapping_add(j), z.wrapping_add(k), seed);
        gradient(h, d - Vec3::new(i as f32, j as f32, k as f32))
    };
    let (u, v, w) = (fade(d.x), fade(d.y), fade(d.z));
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let low = mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v);
    let high = mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v);
    mix(low, high, w)
}

/// The octaves of a fractal sum are turned against each other, so that no lattice direction shows.
fn next_octave(p: Vec3) -> Vec3 {
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

/// Ridged noise (Musgrave): crests where the noise crosses zero, each octave where the last one was high; [0, 1].
pub(super) fn ridged(mut p: Vec3, octaves: u32, gain: f32, seed: u32) -> f32 {
    let (mut sum, mut height, mut total, mut weight) = (0.0, 1.0, 0.0, 1.0_f32);
    for octave in 0..octaves {
        let crest = 1.0 - noise(p, seed.wrapping_add(octave)).abs();
        let crest = crest * crest * weight;
        weight = (crest * 1.8).clamp(0.0, 1.0);
        sum += height * crest;
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
