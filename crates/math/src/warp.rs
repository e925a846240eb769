//! Maps from the unit square to other domains, each with its density.

use crate::real::{exchange, sin_cos};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

/// The unit disc, uniformly and with little distortion (Shirley and Chiu 1997, "A low distortion map between disk and
/// square"). Density [`DISK_PDF`].
#[inline(always)]
#[must_use]
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let p = u * 2.0 - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    // The angle is measured from the nearer axis, in coordinates that are exchanged if that is y.
    let nearer_y = u32::from(p.x.abs().to_bits() <= p.y.abs().to_bits()).wrapping_neg();
    let (radius, other) = exchange(p.x, p.y, nearer_y);
    let (sin, cos) = sin_cos(FRAC_PI_4 * (other / radius));
    let (x, y) = exchange(radius * cos, radius * sin, nearer_y);
    Vec2::new(x, y)
}

/// Density of [`concentric_disk`] over area.
pub const DISK_PDF: f32 = FRAC_1_PI;

/// Directions around +z with density proportional to the cosine.
#[inline(always)]
#[must_use]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = concentric_disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] over solid angle, for a direction with this z.
#[inline(always)]
#[must_use]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Directions of the upper half sphere, uniformly. Density 1 / (2 pi).
#[inline(always)]
#[must_use]
pub fn uniform_hemisphere(u: Vec2) -> Vec3 {
    direction(1.0 - u.x, u.y * TAU)
}

/// Directions of the whole sphere, uniformly. Density [`SPHERE_PDF`].
#[inline(always)]
#[must_use]
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    direction(1.0 - 2.0 * u.x, u.y * TAU)
}

/// Density of [`uniform_sphere`] over solid angle.
pub const SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Directions within a cone around +z, uniformly. `one_minus_cos` is 1 minus the cosine of the half angle (exact even
/// for a cone as narrow as the sun). Density [`uniform_cone_pdf`].
#[inline(always)]
#[must_use]
pub fn uniform_cone(u: Vec2, one_minus_cos: f32) -> Vec3 {
    // The height of the cap is mapped from the disc's radius squared; sin from it without cancellation.
    let d = concentric_disk(u);
    let height = d.length_squared() * one_minus_cos;
    let scale = (one_minus_cos * (2.0 - height)).max(0.0).sqrt();
    Vec3::new(d.x * scale, d.y * scale, 1.0 - height)
}

/// Density of [`uniform_cone`] over solid angle, inside the cone.
#[inline(always)]
#[must_use]
pub fn uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    1.0 / (TAU * one_minus_cos)
}

/// Barycentric weights (of the second and third corner) of points of a triangle, uniformly over its area
/// (E. Heitz 2019, "A low-distortion map between triangle and square"). Density 1 / area.
#[inline(always)]
#[must_use]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    if u.x < u.y {
        let a = u.x * 0.5;
        Vec2::new(a, u.y - a)
    } else {
        let b = u.y * 0.5;
        Vec2::new(u.x - b, b)
    }
}

/// The direction with this z and this angle around z from x.
#[inline(always)]
#[must_use]
pub fn direction(z: f32, phi: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sin_cos(phi);
    Vec3::new(r * cos, r * sin, z)
}

/// A number in [-1, 1] distributed like a tent around 0. Density 1 - |x|.
#[inline(always)]
#[must_use]
pub fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).max(0.0).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;
    use crate::stats::{chi_square, sphere_chi_square};

    const N: u32 = 100_000;

    fn on_sphere(map: impl Fn(Vec2) -> Vec3, pdf: impl Fn(Vec3) -> f32) -> f64 {
        let mut rng = Rng::new(11);
        let test = sphere_chi_square(N, |_| Some(map(rng.next_2d())), pdf);
        assert!((test.density_integral - 1.0).abs() < 2e-2, "{test:?}");
        test.p
    }

    #[test]
    fn directions_follow_their_densities() {
        assert!(on_sphere(uniform_sphere, |_| SPHERE_PDF) > 1e-3);
        assert!(on_sphere(cosine_hemisphere, |d| cosine_hemisphere_pdf(d.z)) > 1e-3);
        assert!(on_sphere(uniform_hemisphere, |d| if d.z > 0.0 { 1.0 / TAU } else { 0.0 }) > 1e-3);
        let h = 0.5; // half angle of 60 degrees
        let cone = |d: Vec3| if d.z > 1.0 - h { uniform_cone_pdf(h) } else { 0.0 };
        assert!(on_sphere(|u| uniform_cone(u, h), cone) > 1e-3);
        let wrong = on_sphere(cosine_hemisphere, |d| if d.z > 0.0 { 1.0 / TAU } else { 0.0 });
        assert!(wrong < 1e-6, "negative control: {wrong}");
    }

    #[test]
    fn narrow_cones_keep_unit_length() {
        let h = 1.08e-5; // the sun
        for i in 0..100 {
            let d = uniform_cone(Vec2::new(i as f32 / 100.0, 0.37), h);
            assert!((d.length() - 1.0).abs() < 1e-6 && d.truncate().length() < 4.7e-3);
        }
    }

    #[test]
    fn disc_and_triangle_are_uniform() {
        let mut rng = Rng::new(5);
        let (mut rings, mut thirds) = (vec![0.0; 32], vec![0.0; 4]);
        for _ in 0..N {
            let d = concentric_disk(rng.next_2d());
            let ring = (d.length_squared() * 8.0).min(7.0) as usize;
            let quadrant = usize::from(d.x > 0.0) * 2 + usize::from(d.y > 0.0);
            rings[ring * 4 + quadrant] += 1.0;
            let b = uniform_triangle(rng.next_2d());
            assert!(b.min_element() >= 0.0 && b.x + b.y <= 1.0);
            // The four congruent parts of a triangle.
            let part = if b.x > 0.5 {
                0
            } else if b.y > 0.5 {
                1
            } else {
                2 + usize::from(b.x + b.y < 0.5)
            };
            thirds[part] += 1.0;
        }
        assert!(chi_square(&rings, &[f64::from(N) / 32.0; 32]).p > 1e-3);
        assert!(chi_square(&thirds, &[f64::from(N) / 4.0; 4]).p > 1e-3);
    }

    #[test]
    fn tent_is_a_tent() {
        let mut counts = vec![0.0; 10];
        let mut expected = vec![0.0; 10];
        let mut rng = Rng::new(6);
        for _ in 0..N {
            counts[((tent(rng.next_1d()) + 1.0) * 5.0).min(9.0) as usize] += 1.0;
        }
        for (i, e) in expected.iter_mut().enumerate() {
            let middle = (i as f64 + 0.5) / 5.0 - 1.0;
            *e = f64::from(N) * 0.2 * (1.0 - middle.abs());
        }
        assert!(chi_square(&counts, &expected).p > 1e-3);
    }
}
