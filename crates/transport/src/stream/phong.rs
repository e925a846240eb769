//! Phong's model (B. T. Phong 1975, "Illumination for computer generated pictures") from a metallic-roughness material:
//! a diffuse part, a highlight around the mirror direction, and what is mirrored and refracted as in Whitted's model.
//!
//! Both parts are normalised, so that radiances are physical (R. Lewis 1994, "Making shaders more physically
//! plausible"). What smooth surfaces reflect is mirrored, what rough ones reflect is highlight; between, roughness
//! decides about the shares. Fresnel's equations are C. Schlick's (1994) approximation.

use crate::bsdf::fresnel::{dielectric_f0, schlick_weight};
use crate::material::Evaluated;
use std::f32::consts::{FRAC_1_PI, PI};
use vastlight_math::{Vec3, real};

/// Surfaces with this roughness mirror nothing.
const NO_MIRROR: f32 = 0.4;

/// A surface's colours in Phong's and Whitted's models.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phong {
    diffuse: Vec3,
    /// Reflectance at normal incidence.
    specular: Vec3,
    exponent: f32,
    /// Share of the reflectance that is mirrored.
    smooth: f32,
    transmitted: Vec3,
    /// Index of refraction of the inside; 1 for a thin wall.
    ior: f32,
}

/// Where a refracted ray goes, and the weights of the mirrored and the refracted ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parting {
    pub(super) mirrored: Vec3,
    /// None where everything is reflected, or nothing is let through.
    pub(super) refracted: Option<(Vec3, Vec3)>,
}

impl Phong {
    pub(super) fn new(evaluated: &Evaluated) -> Self {
        let p = &evaluated.params;
        if evaluated.unlit {
            return Self::black();
        }
        let dielectric = (p.specular_color * (dielectric_f0(p.ior) * p.specular)).min(Vec3::ONE);
        let metal = p.conductor.map_or(p.base_color, |metal| metal.normal);
        let alpha = (p.roughness * p.roughness).clamp(0.02, 1.0);
        let smooth = (1.0 - p.roughness / NO_MIRROR).max(0.0);
        let opaque = (1.0 - p.metallic) * (1.0 - p.transmission);
        Self {
            diffuse: p.base_color * opaque,
            specular: dielectric.lerp(metal, p.metallic),
            // The width of a microfacet highlight, seen from its middle.
            exponent: (0.5 / (alpha * alpha) - 0.5).max(1.0),
            smooth: smooth * smooth,
            transmitted: p.base_color * ((1.0 - p.metallic) * p.transmission),
            ior: if p.thin || p.ior <= 0.0 { 1.0 } else { p.ior },
        }
    }

    fn black() -> Self {
        let none = Vec3::ZERO;
        Self { diffuse: none, specular: none, exponent: 1.0, smooth: 0.0, transmitted: none, ior: 1.0 }
    }

    /// Radiance towards the viewer for radiance 1 from a light, per solid angle and before the light's cosine.
    /// `highlight` is the cosine between the mirrored view and the light. A light without surface, `point`, has its
    /// highlight also where a mirror would show other lights themselves.
    pub(super) fn local(&self, highlight: f32, point: bool) -> Vec3 {
        let share = if point { 1.0 } else { 1.0 - self.smooth };
        let lobe = (self.exponent + 2.0) * (0.5 / PI) * real::pow(highlight.clamp(0.0, 1.0), self.exponent);
        self.diffuse * FRAC_1_PI + self.specular * (lobe * share)
    }

    /// What of the light is mirrored and refracted at a surface with normal `normal`, on the side of the viewer in the
    /// direction `wo`. `outside` tells whether that side is the outside.
    pub(super) fn part(&self, wo: Vec3, normal: Vec3, outside: bool) -> Parting {
        let eta = if outside { 1.0 / self.ior } else { self.ior };
        let cos = wo.dot(normal).clamp(0.0, 1.0);
        let squared = 1.0 - eta * eta * (1.0 - cos * cos);
        let clear = self.transmitted.max_element() > 0.0;
        if squared <= 0.0 {
            let mirrored = if clear { Vec3::ONE } else { self.schlick(cos) };
            return Parting { mirrored: mirrored * self.smooth, refracted: None };
        }
        let behind = squared.sqrt();
        // Schlick's approximation wants the angle on the thinner side.
        let reflected = self.schlick(if eta > 1.0 { behind } else { cos });
        let direction = normal * (eta * cos - behind) - wo * eta;
        let refracted =
            clear.then(|| (direction.normalize_or(-wo), (Vec3::ONE - reflected) * self.transmitted));
        Parting { mirrored: reflected * self.smooth, refracted }
    }

    fn schlick(&self, cos: f32) -> Vec3 {
        // Reflectances of nothing stay nothing.
        let grazing = if self.specular == Vec3::ZERO { 0.0 } else { schlick_weight(cos) };
        self.specular + (Vec3::ONE - self.specular) * grazing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{MaterialTable, ShadingPoint};
    use vastlight_math::{Frame, Vec2, warp};
    use vastlight_scene::{Material, Scene, SceneDesc};

    fn phong(material: Material) -> Phong {
        let scene =
            Scene::new(SceneDesc { materials: vec![material], ..SceneDesc::default() }).expect("valid");
        Phong::new(&MaterialTable::new(&scene).evaluate(0, &ShadingPoint::default()))
    }

    #[test]
    fn a_surface_reflects_at_most_what_arrives() {
        for roughness in [0.05, 0.2, 0.5, 1.0] {
            for metallic in [0.0, 1.0] {
                let mut material = Material::metal("m", Vec3::ONE, roughness);
                material.metallic.factor = metallic;
                let phong = phong(material);
                let n = 64;
                let mut sum = 0.0;
                for i in 0..n * n {
                    let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
                    // The view is along the normal, so the light's cosine is the highlight's.
                    let cos = warp::cosine_hemisphere(u).z;
                    sum += phong.local(cos, false).x * PI / (n * n) as f32;
                }
                let mirrored = phong.part(Vec3::Z, Vec3::Z, true).mirrored.x;
                assert!(sum + mirrored < 1.06, "{roughness} {metallic}: {sum} + {mirrored}");
                assert!(sum + mirrored > 0.9, "{roughness} {metallic}: {sum} + {mirrored}");
            }
        }
    }

    #[test]
    fn glass_refracts_by_snell_and_reflects_totally() {
        let glass = phong(Material::glass("g", 1.5, 0.0));
        for degrees in [0.0_f32, 20.0, 60.0, 89.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let wo = Frame::from_z(Vec3::Z).to_outer(Vec3::new(sin, 0.0, cos));
            let parting = glass.part(wo, Vec3::Z, true);
            let (direction, weight) = parting.refracted.expect("enters");
            let along = wo - Vec3::Z * cos;
            assert!((direction.truncate() * 1.5 + along.truncate()).length() < 1e-5 && direction.z < 0.0);
            assert!((parting.mirrored + weight - Vec3::ONE).abs().max_element() < 1e-5);
            let parting = glass.part(wo, Vec3::Z, false);
            assert_eq!(parting.refracted.is_none(), sin * 1.5 > 1.0, "{degrees}");
            if parting.refracted.is_none() {
                assert_eq!(parting.mirrored, Vec3::ONE);
            }
        }
    }

    #[test]
    fn thin_walls_let_light_go_straight() {
        let wall = phong(Material { thickness: 0.0, ..Material::glass("w", 1.5, 0.0) });
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let (direction, _) = wall.part(wo, Vec3::Z, true).refracted.expect("goes through");
        assert!((direction + wo).length() < 1e-6);
    }
}
