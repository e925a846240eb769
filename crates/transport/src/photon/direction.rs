//! Unit vectors in few bits: Cigolle et al. 2014, "A survey of efficient representations for independent unit vectors",
//! the octahedron unfolded to a square.

use vastlight_math::Vec3;

/// The direction as two numbers of `bits` bits each, at most 16, the first below; the tip of the octahedron where it is none.
#[inline]
pub(super) fn pack(direction: Vec3, bits: u32) -> u32 {
    let d = direction / direction.abs().element_sum();
    let d = if d.is_finite() { d } else { Vec3::Z };
    let (u, v) = if d.z >= 0.0 { (d.x, d.y) } else { folded(d.x, d.y) };
    let half = steps(bits) * 0.5;
    let number = |x: f32| (x * half + (half + 0.5)) as u32;
    number(u) | number(v) << bits
}

/// The unit vector of what [`pack`] gave; bits above are ignored.
#[inline(always)]
pub(super) fn unpack(packed: u32, bits: u32) -> Vec3 {
    let (mask, scale) = ((1 << bits) - 1, 2.0 / steps(bits));
    let (u, v) = ((packed & mask) as f32 * scale - 1.0, (packed >> bits & mask) as f32 * scale - 1.0);
    let z = 1.0 - u.abs() - v.abs();
    let (x, y) = if z >= 0.0 { (u, v) } else { folded(u, v) };
    Vec3::new(x, y, z).normalize()
}

/// The greatest number, made even so that the axes have numbers of their own.
#[inline(always)]
fn steps(bits: u32) -> f32 {
    ((1_u32 << bits) - 2) as f32
}

/// Across the edge of the upper half's square.
#[inline(always)]
fn folded(u: f32, v: f32) -> (f32, f32) {
    ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::{Rng, warp};

    #[test]
    fn directions_survive_packing() {
        let mut rng = Rng::new(3);
        for _ in 0..200_000 {
            let direction = warp::uniform_sphere(rng.next_2d());
            for (bits, most) in [(16, 7e-5), (14, 3e-4)] {
                let error = unpack(pack(direction, bits), bits).distance(direction);
                assert!(error < most, "{direction} {bits}: {error}");
            }
        }
        assert!(unpack(pack(Vec3::new(0.3, 0.5, 0.8).normalize(), 6), 6).distance(Vec3::Z) > 1e-3, "control");
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!([unpack(pack(axis, 14), 14), unpack(pack(-axis, 14), 14)], [axis, -axis]);
        }
        for none in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            assert_eq!(unpack(pack(none, 16), 16), Vec3::Z);
        }
    }
}
