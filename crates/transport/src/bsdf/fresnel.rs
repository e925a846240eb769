//! Reflectance of smooth interfaces: dielectrics and metals with a complex index of refraction (exact Fresnel
//! equations for unpolarised light), and Schlick's approximation (1994) for colours that an artist chose.

use vastlight_math::Vec3;
use vastlight_scene::Conductor;

/// Reflectance of a dielectric. `cos` is the cosine on the side the light comes from, `eta` the index of the other
/// side over this side's; 1 at total internal reflection.
pub(crate) fn dielectric(cos: f32, eta: f32) -> f32 {
    let cos = cos.clamp(0.0, 1.0);
    let sin2_t = (1.0 - cos * cos) / (eta * eta);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let s = (cos - eta * cos_t) / (cos + eta * cos_t);
    let p = (eta * cos - cos_t) / (eta * cos + cos_t);
    (0.5 * (s * s + p * p)).min(1.0)
}

/// Reflectance of a dielectric at normal incidence.
pub(crate) fn dielectric_f0(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// Reflectance of a metal per channel.
pub(crate) fn conductor(cos: f32, metal: &Conductor) -> Vec3 {
    let f = |i: usize| conductor_channel(cos.clamp(0.0, 1.0), metal.eta[i], metal.k[i]);
    Vec3::new(f(0), f(1), f(2))
}

fn conductor_channel(cos: f32, eta: f32, k: f32) -> f32 {
    let (cos2, eta2, k2) = (cos * cos, eta * eta, k * k);
    let sin2 = 1.0 - cos2;
    let t0 = eta2 - k2 - sin2;
    let a2_plus_b2 = (t0 * t0 + 4.0 * eta2 * k2).sqrt();
    let a = (0.5 * (a2_plus_b2 + t0)).max(0.0).sqrt();
    let (t1, t2) = (a2_plus_b2 + cos2, 2.0 * cos * a);
    let s = (t1 - t2) / (t1 + t2).max(f32::MIN_POSITIVE);
    let (t3, t4) = (cos2 * a2_plus_b2 + sin2 * sin2, t2 * sin2);
    let p = s * (t3 - t4) / (t3 + t4).max(f32::MIN_POSITIVE);
    (0.5 * (s + p)).clamp(0.0, 1.0)
}

/// Schlick's weight `(1 - cos)^5`: reflectance is `f0 + (f90 - f0) * weight`.
pub(crate) fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// The direction `wo` refracted through the microfacet `h` (`wo . h > 0`); `eta` as in [`dielectric`]. `None` at
/// total internal reflection.
pub(crate) fn refract(wo: Vec3, h: Vec3, eta: f32) -> Option<Vec3> {
    let cos = wo.dot(h);
    let sin2_t = (1.0 - cos * cos).max(0.0) / (eta * eta);
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    (h * (cos / eta - cos_t) - wo / eta).try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectric_has_its_closed_form_values() {
        assert!((dielectric(1.0, 1.5) - 0.04).abs() < 1e-6);
        assert_eq!(dielectric(0.0, 1.5), 1.0);
        // Brewster's angle: only the s-polarised half is reflected.
        let cos = 1.0 / (1.0_f32 + 1.5 * 1.5).sqrt();
        let s = (1.5_f32 * 1.5 - 1.0) / (1.5 * 1.5 + 1.0);
        assert!((dielectric(cos, 1.5) - 0.5 * s * s).abs() < 1e-5);
        // Past the critical angle everything is reflected; before it, both sides agree.
        assert_eq!(dielectric(0.6, 1.0 / 1.5), 1.0);
        let wt = refract(Vec3::new(0.6, 0.0, 0.8), Vec3::Z, 1.5).expect("enters");
        assert!((wt.x + 0.4).abs() < 1e-6 && wt.z < 0.0);
        assert!((dielectric(0.8, 1.5) - dielectric(-wt.z, 1.0 / 1.5)).abs() < 1e-6);
    }

    #[test]
    fn conductor_without_absorption_is_a_dielectric() {
        let glass = Conductor { eta: Vec3::splat(1.5), k: Vec3::ZERO };
        for i in 0..=20 {
            let cos = i as f32 / 20.0;
            assert!((conductor(cos, &glass).x - dielectric(cos, 1.5)).abs() < 1e-5, "{cos}");
        }
    }
}
