//! Light from infinity: the background, the sun's disc, and directional lights.

use super::map::MapLight;
use super::punctual::light_frame;
use super::sky::{SkyLight, Sun};
use super::{LightSample, luminance};
use crate::words::{Words, lights};
use std::f32::consts::PI;
use vastlight_math::{FAR, Frame, Vec2, Vec3, warp};
use vastlight_scene::{Environment, LightKind, Scene};

#[derive(Clone, Debug)]
enum Background<'a> {
    Constant(Vec3),
    Map(MapLight<'a>),
    Sky(Box<SkyLight>),
}

/// A directional light.
#[derive(Clone, Copy, Debug)]
pub(super) struct Directional {
    /// Towards the light.
    wi: Vec3,
    irradiance: Vec3,
    strength: f32,
}

/// All light from infinity.
#[derive(Clone, Debug)]
pub(super) struct DistantLights<'a> {
    background: Background<'a>,
    /// Mean luminance of the background's upper and lower half.
    mean: [f32; 2],
    sun: Option<Sun>,
    directional: Vec<Directional>,
}

impl<'a> DistantLights<'a> {
    pub(super) fn new(scene: &'a Scene) -> Self {
        let (background, sun) = match scene.environment() {
            Environment::Constant(radiance) => (constant(*radiance), None),
            Environment::Map { image, rotation, strength } => {
                let map = MapLight::new(scene, *image, *rotation, *strength);
                (map.map_or(Background::Constant(Vec3::ZERO), Background::Map), None)
            }
            Environment::Sky(sky) => {
                let (light, sun) = SkyLight::new(sky);
                (Background::Sky(Box::new(light)), sun)
            }
        };
        let mean = match &background {
            Background::Constant(radiance) => [luminance(*radiance); 2],
            Background::Map(map) => map.grid.integrals().map(|i| i / (2.0 * PI)),
            Background::Sky(sky) => sky.grid.integrals().map(|i| i / (2.0 * PI)),
        };
        let directional = scene
            .lights()
            .iter()
            .filter(|l| l.kind == LightKind::Directional && l.intensity.is_finite())
            .map(|l| {
                let irradiance = l.intensity.max(Vec3::ZERO);
                Directional { wi: light_frame(l).z, irradiance, strength: luminance(irradiance) }
            })
            .filter(|l| l.strength > 0.0)
            .collect();
        Self { background, mean, sun, directional }
    }

    pub(super) fn bytes(&self) -> usize {
        match &self.background {
            Background::Constant(_) => 0,
            Background::Map(map) => map.grid.bytes(),
            Background::Sky(sky) => sky.grid.bytes(),
        }
    }

    /// Appends the background, the sun if there is one, and the directional lights.
    pub(super) fn pack(&self, words: &mut Words) {
        let (kind, background) = match &self.background {
            Background::Constant(radiance) => {
                let start = words.offset();
                words.vec3(*radiance);
                (lights::CONSTANT, start)
            }
            Background::Map(map) => (lights::IMAGE, map.pack(words)),
            Background::Sky(sky) => (lights::SKY, sky.pack(words)),
        };
        words.set(lights::BACKGROUND, background);
        words.set(lights::BACKGROUND_KIND, kind);
        words.set(lights::MEANS, self.mean[0].to_bits());
        words.set(lights::MEANS + 1, self.mean[1].to_bits());
        if let Some(sun) = &self.sun {
            words.section(lights::SUN);
            sun.pack(words);
        }
        words.section(lights::DIRECTIONAL);
        words.set(lights::DIRECTIONAL_COUNT, self.directional.len() as u32);
        for light in &self.directional {
            words.vec3(light.wi);
            words.vec3(light.irradiance);
            words.f32(light.strength);
        }
    }

    /// An estimate of the background's irradiance on a surface with this normal (zero: facing any way).
    #[inline(always)]
    pub(super) fn background_estimate(&self, normal: Vec3) -> f32 {
        let [upper, lower] = self.mean;
        (upper * (1.0 + normal.y) + lower * (1.0 - normal.y)).max(0.0) * (0.5 * PI)
    }

    /// The sun's irradiance on the surface.
    #[inline(always)]
    pub(super) fn sun_estimate(&self, normal: Vec3) -> f32 {
        self.sun.as_ref().map_or(0.0, |s| s.irradiance * s.facing(normal))
    }

    /// Sum of the square roots of the directional lights' estimates.
    #[inline(always)]
    pub(super) fn directional_estimate(&self, normal: Vec3) -> f32 {
        self.directional.iter().map(|l| l.estimate(normal).sqrt()).sum()
    }

    /// Whether the background is the same everywhere.
    #[inline(always)]
    pub(super) fn is_even(&self) -> bool {
        matches!(self.background, Background::Constant(_))
    }

    pub(super) fn directional(&self) -> &[Directional] {
        &self.directional
    }

    /// Radiance from a direction, the sun's disc included.
    #[inline]
    pub(super) fn radiance(&self, wi: Vec3) -> Vec3 {
        let background = match &self.background {
            Background::Constant(radiance) => return *radiance,
            Background::Map(map) => return map.radiance(wi),
            Background::Sky(sky) => sky.radiance(wi),
        };
        background + self.sun.as_ref().map_or(Vec3::ZERO, |s| s.radiance(wi))
    }

    /// Density with which [`DistantLights::sample_background`] finds a direction.
    #[inline(always)]
    pub(super) fn background_pdf(&self, normal: Vec3, wi: Vec3) -> f32 {
        match &self.background {
            Background::Constant(_) if normal == Vec3::ZERO => warp::SPHERE_PDF,
            Background::Constant(_) => warp::cosine_hemisphere_pdf(wi.dot(normal)),
            Background::Map(map) => map.pdf(normal, wi),
            Background::Sky(sky) => sky.pdf(normal, wi),
        }
    }

    /// Density with which [`DistantLights::sample_sun`] finds a direction.
    #[inline]
    pub(super) fn sun_pdf(&self, wi: Vec3) -> f32 {
        self.sun.as_ref().map_or(0.0, |s| s.pdf(wi))
    }

    #[inline(always)]
    pub(super) fn sample_background(&self, normal: Vec3, u: Vec2) -> Option<Vec3> {
        match &self.background {
            Background::Constant(_) if normal == Vec3::ZERO => Some(warp::uniform_sphere(u)),
            Background::Constant(_) => Some(Frame::from_z(normal).to_outer(warp::cosine_hemisphere(u))),
            Background::Map(map) => map.sample(normal, u),
            Background::Sky(sky) => sky.sample(normal, u),
        }
    }

    #[inline]
    pub(super) fn sample_sun(&self, u: Vec2) -> Option<Vec3> {
        self.sun.as_ref().map(|s| s.sample(u))
    }
}

impl Directional {
    /// Irradiance on a surface with this normal (zero: facing it).
    #[inline]
    pub(super) fn estimate(&self, normal: Vec3) -> f32 {
        if normal == Vec3::ZERO { self.strength } else { self.strength * self.wi.dot(normal).max(0.0) }
    }

    pub(super) fn sample(&self, probability: f32) -> LightSample {
        LightSample { wi: self.wi, distance: FAR, radiance: self.irradiance, pdf: probability, delta: true }
    }
}

/// A constant background with nothing undefined or negative in it.
fn constant<'a>(radiance: Vec3) -> Background<'a> {
    let usable = radiance.max(Vec3::ZERO);
    Background::Constant(if usable.is_finite() { usable } else { Vec3::ZERO })
}
