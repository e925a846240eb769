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
mod lanes;
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
use crate::words::{self, Words};
use environment::DistantLights;
pub(crate) use lanes::{LightAnswers, LightQueries};
use local::LocalLights;
pub(crate) use punctual::PunctualLight;
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

/// Probabilities at a point of the groups whose light a ray can find by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Odds {
    /// Of the lights at a place.
    pub local: f32,
    /// Of the background.
    pub background: f32,
    /// Of the sun's disc.
    pub sun: f32,
}

impl Odds {
    /// Those of groups with these weights; with the sum of all, and 1 / it.
    #[inline(always)]
    fn of(local: f32, background: f32, sun: f32, directional: f32) -> (Self, f32, f32) {
        let sum = local + background + sun + directional;
        let scale = 1.0 / sum;
        (Self { local: local * scale, background: background * scale, sun: sun * scale }, sum, scale)
    }
}

/// What the choice of a light at a point depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    pub(crate) odds: Odds,
    estimate: Estimate,
    /// 1 / the sum of all groups' weights, to scale those of the directional lights.
    scale: f32,
}

impl<'a> Lights<'a> {
    /// Collects the lights of `scene` and builds the light tree and the environment's tables.
    #[must_use]
    pub fn new(scene: &'a Scene, materials: &'a MaterialTable<'a>) -> Self {
        Self::with_flat_limit(scene, materials, surfaces::FLAT_LIMIT)
    }

    /// [`Lights::new`] with so many emissive triangles (times instances) in one tree before meshes with several instances
    /// get trees of their own; by default half a million.
    #[must_use]
    pub fn with_flat_limit(scene: &'a Scene, materials: &'a MaterialTable<'a>, flat_limit: u64) -> Self {
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

    /// Point and spot lights.
    pub(crate) fn punctual(&self) -> &[PunctualLight] {
        self.local.punctual()
    }

    /// All lights as the words of a kernel's binding `lights`; see [`words::lights`].
    #[must_use]
    pub fn pack(&self) -> Vec<u32> {
        let mut words = Words::new(words::lights::HEADER);
        self.local.pack(&mut words);
        self.distant.pack(&mut words);
        words.finish()
    }

    /// With which probabilities [`Lights::sample`] chooses between groups of lights at a point; 0 where no light can
    /// reach it.
    #[must_use]
    pub fn odds(&self, from: Vec3, normal: Vec3) -> Odds {
        self.weights(from, normal).map_or(Odds::default(), |weights| weights.odds)
    }

    /// Chooses a light and a direction to it from the point `from` in world space.
    ///
    /// `normal` is the unit shading normal on the side from which the light is to come; zero if light from both sides
    /// counts (surfaces that transmit). Light that comes from behind it may be left out. `u_pick` and `u` are uniform in
    /// [0, 1). `None` means that the sample is black.
    #[must_use]
    pub fn sample(&self, from: Vec3, normal: Vec3, u_pick: f32, u: Vec2) -> Option<LightSample> {
        self.draw(&self.weights(from, normal)?, from, normal, u_pick, (u, 0.0))
    }

    /// [`Lights::sample`] with the weights for the same arguments, at a time of an open shutter.
    #[inline(always)]
    pub(crate) fn draw(
        &self,
        weights: &Weights,
        from: Vec3,
        normal: Vec3,
        u_pick: f32,
        (u, time): (Vec2, f32),
    ) -> Option<LightSample> {
        let Odds { local, background, sun } = weights.odds;
        let mut pick = u_pick;
        if pick < local {
            let pick = (pick / local).min(ONE_MINUS_EPSILON);
            let sample = self.local.sample(&weights.estimate, from, normal, pick, (u, time))?;
            return Some(LightSample { pdf: sample.pdf * local, ..sample });
        }
        pick -= local;
        if pick < background {
            let wi = self.distant.sample_background(normal, u)?;
            return self.distant_sample(weights.odds, normal, wi);
        }
        pick -= background;
        if pick < sun {
            let wi = self.distant.sample_sun(u)?;
            return self.distant_sample(weights.odds, normal, wi);
        }
        pick -= sun;
        self.sample_directional(weights, normal, pick)
    }

    #[inline(always)]
    fn distant_sample(&self, odds: Odds, normal: Vec3, wi: Vec3) -> Option<LightSample> {
        let radiance = self.distant.radiance(wi);
        let pdf = self.density_of_direction(odds, normal, wi);
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
        let hit = (instance, triangle);
        let weights = self.weights(from, normal);
        weights.map_or(0.0, |weights| self.density_of_hit(weights.odds, from, normal, hit, (position, 0.0)))
    }

    /// [`Lights::pdf_hit`] with the odds for the same point and normal, of a place and a time of an open shutter.
    #[inline]
    pub(crate) fn density_of_hit(
        &self,
        odds: Odds,
        from: Vec3,
        normal: Vec3,
        hit: (u32, u32),
        at: (Vec3, f32),
    ) -> f32 {
        if odds.local > 0.0 { odds.local * self.local.pdf(from, normal, hit, at) } else { 0.0 }
    }

    /// Density over solid angle with which [`Lights::sample`] chooses a direction that leaves the scene.
    #[must_use]
    pub fn pdf_environment(&self, from: Vec3, normal: Vec3, wi: Vec3) -> f32 {
        let weights = self.weights(from, normal);
        weights.map_or(0.0, |weights| self.density_of_direction(weights.odds, normal, wi))
    }

    /// [`Lights::pdf_environment`] with the odds for the same point and normal.
    #[inline(always)]
    pub(crate) fn density_of_direction(&self, odds: Odds, normal: Vec3, wi: Vec3) -> f32 {
        let mut pdf = 0.0;
        if odds.background > 0.0 {
            pdf += odds.background * self.distant.background_pdf(normal, wi);
        }
        if odds.sun > 0.0 {
            pdf += odds.sun * self.distant.sun_pdf(wi);
        }
        pdf
    }

    /// Radiance from infinity along a direction, W/(sr m^2): background and sun's disc.
    #[must_use]
    pub fn environment(&self, wi: Vec3) -> Vec3 {
        self.distant.radiance(wi)
    }

    /// Weights for the choice of a light at a point; `None` if no light can reach the front of the surface. Arguments are
    /// those of [`Lights::sample`].
    #[inline(always)]
    pub(crate) fn weights(&self, from: Vec3, normal: Vec3) -> Option<Weights> {
        let estimate = self.local.estimate(from, normal);
        let background = self.distant.background_estimate(normal).sqrt();
        let sun = self.distant.sun_estimate(normal).sqrt();
        let directional = self.distant.directional_estimate(normal);
        let (odds, sum, scale) = Odds::of(estimate.total.sqrt(), background, sun, directional);
        (sum > 0.0).then_some(Weights { odds, estimate, scale })
    }
}

const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON * 0.5;

/// Luminance of a linear Rec. 709 colour.
#[inline]
fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
