//! Point and spot lights: intensity in a direction, and at a distance.
//!
//! The spot's falloff is the one that KHR_lights_punctual recommends. A finite `range` fades the light out with the
//! extension's window max(min(1 - (d / range)^4, 1), 0); without a range the inverse square law alone holds.

use super::bounds::{Cone, LightBounds};
use super::ies;
use crate::words::Words;
use std::sync::Arc;
use vastlight_math::real::cos;
use vastlight_math::{Aabb, Frame, Vec3, warp};
use vastlight_scene::{IesProfile, Light, LightKind};

/// A light at a point.
#[derive(Clone, Debug)]
pub(crate) struct PunctualLight {
    pub(crate) position: Vec3,
    frame: Frame,
    intensity: Vec3,
    range: f32,
    /// Cosines of the inner and outer half angle; `None` for a point light.
    spot: Option<[f32; 2]>,
    profile: Option<Arc<IesProfile>>,
}

impl PunctualLight {
    /// `None` for a directional light and for one whose numbers cannot be used.
    pub(super) fn new(light: &Light) -> Option<Self> {
        let spot = match light.kind {
            LightKind::Point => None,
            LightKind::Spot { inner, outer } => Some([cos(inner.max(0.0)), cos(outer.max(inner).min(3.2))]),
            LightKind::Directional => return None,
        };
        let position = light.world_from_light.translation;
        let usable = position.is_finite() && light.intensity.is_finite() && light.range > 0.0;
        usable.then(|| Self {
            position,
            frame: light_frame(light),
            intensity: light.intensity.max(Vec3::ZERO),
            range: light.range,
            spot,
            profile: light.profile.clone(),
        })
    }

    /// Radiant intensity towards the unit vector `direction` (world space, away from the light), W/sr.
    pub(crate) fn intensity(&self, direction: Vec3) -> Vec3 {
        let cone = self.spot.map_or(1.0, |[inner, outer]| {
            let c = -direction.dot(self.frame.z);
            // Equal angles make a hard edge.
            let x = ((c - outer) / (inner - outer).max(1e-6)).clamp(0.0, 1.0);
            x * x
        });
        if cone == 0.0 {
            return Vec3::ZERO;
        }
        let profile = self.profile.as_ref().map_or(1.0, |p| ies::value(p, self.frame.to_local(direction)));
        self.intensity * (cone * profile)
    }

    /// The range's window at a distance.
    pub(super) fn window(&self, distance: f32) -> f32 {
        if self.range.is_finite() {
            let x = distance / self.range;
            (1.0 - x * x * x * x).clamp(0.0, 1.0)
        } else {
            1.0
        }
    }

    /// Appends the light, whose profile starts at the word `profile` (0 for none).
    pub(super) fn pack(&self, profile: u32, words: &mut Words) {
        let Frame { x, y, z } = self.frame;
        [self.position, x, y, z, self.intensity].into_iter().for_each(|v| words.vec3(v));
        words.f32(if self.range.is_finite() { self.range } else { 0.0 });
        words.u32(u32::from(self.spot.is_some()));
        words.f32s(&self.spot.unwrap_or_default());
        words.u32(profile);
    }

    pub(super) fn profile(&self) -> Option<&Arc<IesProfile>> {
        self.profile.as_ref()
    }

    /// For the light tree.
    pub(super) fn bounds(&self) -> LightBounds {
        let mean = (0..64)
            .map(|i| {
                let u = vastlight_math::Vec2::new((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5) / 8.0;
                super::luminance(self.intensity(warp::uniform_sphere(u)))
            })
            .sum::<f32>()
            / 64.0;
        let full = super::luminance(self.intensity);
        // A spot is as strong as its intensity inside its cone; a profile as its mean, but never negligible.
        let intensity = if self.profile.is_some() { mean.max(0.05 * full) } else { full };
        // Importance takes a light without direction for surfaces facing all ways, which send a quarter of their
        // intensity anywhere.
        let intensity = if self.spot.is_some() { intensity } else { 4.0 * intensity };
        let cone = match self.spot {
            Some([inner, _]) => Cone { axis: -self.frame.z, cos: inner },
            None => Cone::ALL,
        };
        let cos_emission = match self.spot {
            // cos(outer - inner), a little wider.
            Some([inner, outer]) => {
                let sines = ((1.0 - inner * inner).max(0.0) * (1.0 - outer * outer).max(0.0)).sqrt();
                (inner * outer + sines - 1e-3).clamp(-1.0, 1.0)
            }
            None => 0.0,
        };
        LightBounds {
            aabb: Aabb::point(self.position),
            cone,
            cos_emission,
            intensity,
            moment: if self.spot.is_some() { cone.axis * intensity } else { Vec3::ZERO },
            two_sided: false,
        }
    }
}

/// The light's rotation without its scale: z is the light's +z in the world.
pub(super) fn light_frame(light: &Light) -> Frame {
    let m = light.world_from_light.matrix3;
    let z = m.z_axis.normalize_or(Vec3::Z);
    let mut frame = Frame::from_z_and_tangent(z, m.x_axis);
    if !frame.x.is_finite() {
        frame = Frame::from_z(z);
    }
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Affine3;

    fn spot(range: f32) -> PunctualLight {
        PunctualLight::new(&Light {
            name: String::new(),
            kind: LightKind::Spot { inner: 0.3, outer: 0.6 },
            world_from_light: Affine3::from_translation(Vec3::Y),
            intensity: Vec3::splat(2.0),
            range,
            profile: None,
        })
        .expect("usable")
    }

    #[test]
    fn spot_falls_off_between_its_angles() {
        let light = spot(f32::INFINITY);
        let at = |angle: f32| light.intensity(Vec3::new(angle.sin(), 0.0, -angle.cos())).x;
        assert_eq!((at(0.0), at(0.29), at(0.61), at(3.0)), (2.0, 2.0, 0.0, 0.0));
        let middle = ((0.45_f32.cos() - 0.6_f32.cos()) / (0.3_f32.cos() - 0.6_f32.cos())).powi(2) * 2.0;
        assert!((at(0.45) - middle).abs() < 1e-5);
    }

    #[test]
    fn only_a_finite_range_fades() {
        assert_eq!(spot(f32::INFINITY).window(1e9), 1.0);
        let light = spot(10.0);
        assert_eq!((light.window(10.0), light.window(20.0)), (0.0, 0.0));
        assert!((light.window(5.0) - 0.9375).abs() < 1e-6);
    }
}
