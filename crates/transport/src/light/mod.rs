//! Lights: which there are, how to sample them, and with what density a ray finds them by itself.
//!
//! One light is chosen in two steps. First between the group of local lights (emissive triangles, point and spot
//! lights, in a light tree), the background, the sun's disc and each directional light, with probability proportional
//! to the *square root* of an estimate of its irradiance at the point: the estimates do not know what is in the way, and
//! flat weights keep a lamp behind which the bright sky is hidden from being sampled too rarely. Then within the group.

mod atmosphere;
mod bounds;
mod emitters;
mod environment;
mod grid;
mod ies;
mod local;
mod map;
mod punctual;
mod sky;
mod surfaces;
mod tree;
mod triangle;

#[cfg(test)]
mod tests;

use crate::material::MaterialTable;
use environment::DistantLights;
use local::LocalLights;
use tree::Estimate;
use vastlight_math::{FAR, Vec2, Vec3};
use vastlight_scene::Scene;

/// Light that reaches a point from one direction, if nothing is in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub wi: Vec3,
    /// Distance to the light; [`FAR`] for light from infinity.
    pub distance: f32,
    /// Radiance that arrives from there, W/(sr m^2), times the emitting point's coverage (alpha). For a delta light the
    /// irradiance on a plane that faces it, W/m^2.
    pub radiance: Vec3,
    /// Density over solid angle with which this direction was chosen, the choice of the light included. For a delta
    /// light the probability of the choice.
    pub pdf: f32,
    /// The light is a point or a direction, which no other ray finds by itself.
    pub delta: bool,
}

/// What [`Lights`] holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightsReport {
    /// Leaves of the light tree: emissive triangles, point and spot lights, instances whose mesh has its own tree.
    pub local: usize,
    /// Directional lights.
    pub directional: usize,
    /// Memory of all tables.
    pub bytes: usize,
}

/// All lights of a scene.
#[derive(Clone, Debug)]
pub struct Lights<'a> {
    local: LocalLights<'a>,
    distant: DistantLights<'a>,
}

/// Probabilities of the groups at a point.
struct Weights {
    local: f32,
    estimate: Estimate,
    background: f32,
    sun: f32,
    /// 1 / the sum of all groups' weights, to scale those of the directional lights.
    scale: f32,
}

impl<'a> Lights<'a> {
    /// Collects the lights of `scene` and builds the light tree and the environment's tables.
    #[must_use]
    pub fn new(scene: &'a Scene, materials: &'a MaterialTable<'a>) -> Self {
        Self::with_flat_limit(scene, materials, surfaces::FLAT_LIMIT)
    }

    fn with_flat_limit(scene: &'a Scene, materials: &'a MaterialTable<'a>, flat_limit: u64) -> Self {
        Self { local: LocalLights::new(scene, materials, flat_limit), distant: DistantLights::new(scene) }
    }

    /// Counts and memory.
    #[must_use]
    pub fn report(&self) -> LightsReport {
        LightsReport {
            local: self.local.len(),
            directional: self.distant.directional().len(),
            bytes: self.local.bytes() + self.distant.bytes(),
        }
    }

    /// Chooses a light and a direction to it from the point `from` in world space.
    ///
    /// `normal` is the unit shading normal on the side from which the light is to come; zero if light from both sides
    /// counts (surfaces that transmit). Light that comes from behind it may be left out. `u_pick` and `u` are uniform in
    /// [0, 1). `None` means that the sample is black.
    #[must_use]
    pub fn sample(&self, from: Vec3, normal: Vec3, u_pick: f32, u: Vec2) -> Option<LightSample> {
        let weights = self.weights(from, normal)?;
        let mut pick = u_pick;
        if pick < weights.local {
            let pick = (pick / weights.local).min(ONE_MINUS_EPSILON);
            let sample = self.local.sample(&weights.estimate, from, normal, pick, u)?;
            return Some(LightSample { pdf: sample.pdf * weights.local, ..sample });
        }
        pick -= weights.local;
        if pick < weights.background {
            let wi = self.distant.sample_background(normal, u)?;
            return self.distant_sample(&weights, normal, wi);
        }
        pick -= weights.background;
        if pick < weights.sun {
            let wi = self.distant.sample_sun(u)?;
            return self.distant_sample(&weights, normal, wi);
        }
        pick -= weights.sun;
        self.sample_directional(&weights, normal, pick)
    }

    fn distant_sample(&self, weights: &Weights, normal: Vec3, wi: Vec3) -> Option<LightSample> {
        let radiance = self.distant.radiance(wi);
        let pdf = self.distant_pdf(weights, normal, wi);
        (radiance != Vec3::ZERO && pdf > 0.0).then_some(LightSample {
            wi,
            distance: FAR,
            radiance,
            pdf,
            delta: false,
        })
    }

    fn sample_directional(&self, weights: &Weights, normal: Vec3, pick: f32) -> Option<LightSample> {
        let mut pick = pick;
        let mut chosen = None;
        for light in self.distant.directional() {
            let p = light.estimate(normal).sqrt() * weights.scale;
            if p > 0.0 {
                chosen = Some(light.sample(p));
                if pick < p {
                    break;
                }
                pick -= p;
            }
        }
        chosen
    }

    /// Density over solid angle with which [`Lights::sample`] chooses the point `position` of a surface; 0 if that
    /// surface is no light. `instance` and `triangle` are those of the hit.
    #[must_use]
    pub fn pdf_hit(&self, from: Vec3, normal: Vec3, instance: u32, triangle: u32, position: Vec3) -> f32 {
        match self.weights(from, normal) {
            Some(weights) if weights.local > 0.0 => {
                weights.local
                    * self.local.pdf(&weights.estimate, from, normal, (instance, triangle), position)
            }
            _ => 0.0,
        }
    }

    /// Density over solid angle with which [`Lights::sample`] chooses a direction that leaves the scene.
    #[must_use]
    pub fn pdf_environment(&self, from: Vec3, normal: Vec3, wi: Vec3) -> f32 {
        self.weights(from, normal).map_or(0.0, |weights| self.distant_pdf(&weights, normal, wi))
    }

    #[inline]
    fn distant_pdf(&self, weights: &Weights, normal: Vec3, wi: Vec3) -> f32 {
        let mut pdf = 0.0;
        if weights.background > 0.0 {
            pdf += weights.background * self.distant.background_pdf(normal, wi);
        }
        if weights.sun > 0.0 {
            pdf += weights.sun * self.distant.sun_pdf(wi);
        }
        pdf
    }

    /// Radiance from infinity along a direction, W/(sr m^2): background and sun's disc.
    #[must_use]
    pub fn environment(&self, wi: Vec3) -> Vec3 {
        self.distant.radiance(wi)
    }

    /// Probabilities of the groups; `None` if no light can reach the front of the surface.
    #[inline]
    fn weights(&self, from: Vec3, normal: Vec3) -> Option<Weights> {
        let estimate = self.local.estimate(from, normal);
        let local = estimate.total.sqrt();
        let background = self.distant.background_estimate(normal).sqrt();
        let sun = self.distant.sun_estimate(normal).sqrt();
        let directional: f32 = self.distant.directional().iter().map(|l| l.estimate(normal).sqrt()).sum();
        let sum = local + background + sun + directional;
        let scale = 1.0 / sum;
        (sum > 0.0).then_some(Weights {
            local: local * scale,
            estimate,
            background: background * scale,
            sun: sun * scale,
            scale,
        })
    }
}

const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON * 0.5;

/// Luminance of a linear Rec. 709 colour.
#[inline]
fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
