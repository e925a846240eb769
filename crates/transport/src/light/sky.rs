//! The procedural sky: a table of the atmosphere's radiance, the ground below it, and the sun's disc.
//!
//! Units: above the air the sun's irradiance on a facing plane is [`SUN_ABOVE_AIR`] (about 1361 W/m^2 of real
//! sunlight), so that on a clear day sun and sky together light the ground with about pi and a white page has a radiance
//! of about 1.

use super::atmosphere::{Atmosphere, SUN_ANGLE, lookup, unit_vector};
use super::grid::{DirectionGrid, direction_of, uv_of};
use super::luminance;
use super::map::solid_angle_pdf;
use crate::words::Words;
use rayon::prelude::*;
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};
use vastlight_math::real::{acos, asin, exp, sin};
use vastlight_math::{Frame, Vec2, Vec3, warp};
use vastlight_scene::Sky;

/// Irradiance of the sun above the air at strength 1.
pub(super) const SUN_ABOVE_AIR: f32 = 5.0;

/// Height of the eye above the ground, km: sets how soon the ground fades into haze.
const EYE_HEIGHT: f32 = 0.1;
const ELEVATIONS: usize = 64;
const AZIMUTHS: usize = 40;
const STEPS: u32 = 32;
const GRID: (usize, usize) = (256, 128);

/// The sky without the sun's disc.
#[derive(Clone, Debug)]
pub(super) struct SkyLight {
    /// Radiance by elevation (rows) and azimuth from the sun.
    table: Vec<Vec3>,
    /// Towards the sun along the ground, and in space.
    sun_azimuth: Vec2,
    sun: Vec3,
    ground: Vec3,
    ground_extinction: Vec3,
    pub(super) grid: DirectionGrid,
}

/// The sun's disc.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sun {
    frame: Frame,
    radiance: Vec3,
    /// Luminance of the irradiance on a facing plane.
    pub(super) irradiance: f32,
}

/// 1 minus the cosine of half the sun's angle: 2 sin^2(angle / 2).
fn sun_height() -> f32 {
    let s = sin(0.5 * SUN_ANGLE);
    2.0 * s * s
}

impl SkyLight {
    /// The sky, and the sun where it is up and shines.
    pub(super) fn new(sky: &Sky) -> (Self, Option<Sun>) {
        let finite = |x: f32, otherwise: f32| if x.is_finite() { x } else { otherwise };
        let azimuth = finite(sky.sun_azimuth, 0.0);
        let elevation = finite(sky.sun_elevation, 0.8).clamp(-FRAC_PI_2, FRAC_PI_2);
        let scale = SUN_ABOVE_AIR * finite(sky.strength, 1.0).max(0.0);
        let albedo = sky.ground_albedo.max(Vec3::ZERO).min(Vec3::ONE);
        let air = Atmosphere::new(finite(sky.turbidity, 3.0).clamp(1.0, 10.0), albedo);
        let sunlight = air.sunlight(super::atmosphere::GROUND + EYE_HEIGHT, sin(elevation)) * scale;
        let table = sky_table(&air, elevation, scale);
        let irradiance = sunlight * sin(elevation).max(0.0) + horizontal_irradiance(&table);
        let mut light = Self {
            table,
            sun_azimuth: Vec2::new(sin(azimuth), -vastlight_math::real::cos(azimuth)),
            sun: unit_vector(azimuth, elevation),
            ground: albedo * irradiance * FRAC_1_PI,
            ground_extinction: air.ground_extinction(),
            grid: DirectionGrid::new(1, 2, |_, _| 0.0),
        };
        light.grid = light.density_grid();
        let sun = Sun::new(light.sun, sunlight);
        (light, sky.sun_disc.then_some(sun).filter(|s| s.irradiance > 0.0))
    }

    /// Appends grid and table; then the sky, whose word it gives: grid, table, the table's azimuths and elevations,
    /// towards the sun along the ground and in space, the ground's radiance and extinction, height of the eye.
    pub(super) fn pack(&self, words: &mut Words) -> u32 {
        let grid = self.grid.pack(words);
        let table = words.offset();
        self.table.iter().for_each(|entry| words.vec3(*entry));
        let start = words.offset();
        words.u32s(&[grid, table, AZIMUTHS as u32, ELEVATIONS as u32]);
        words.vec2(self.sun_azimuth);
        [self.sun, self.ground, self.ground_extinction].into_iter().for_each(|v| words.vec3(v));
        words.f32(EYE_HEIGHT);
        start
    }

    fn density_grid(&self) -> DirectionGrid {
        let (width, height) = GRID;
        let at =
            |x: usize, y: usize| Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        DirectionGrid::new(width, height, |x, y| luminance(self.radiance(direction_of(at(x, y)).0)))
    }

    /// Radiance from a direction, without the sun's disc.
    #[inline]
    pub(super) fn radiance(&self, wi: Vec3) -> Vec3 {
        if wi.y >= 0.0 {
            let elevation = (asin(wi.y) / FRAC_PI_2).sqrt();
            return lookup(&self.table, AZIMUTHS, self.azimuth_from_sun(wi), elevation);
        }
        // The ground, seen through the haze up to where the ray meets it. Haze shines like the place on the horizon
        // that is as far from the sun.
        let distance = EYE_HEIGHT / (-wi.y).max(1e-5);
        let passed = -self.ground_extinction * distance;
        let passed = Vec3::new(exp(passed.x), exp(passed.y), exp(passed.z));
        let horizon = lookup(&self.table, AZIMUTHS, (acos(wi.dot(self.sun)) / PI).sqrt(), 0.0);
        self.ground * passed + horizon * (Vec3::ONE - passed)
    }

    /// The table's coordinate of the angle between a direction's azimuth and the sun's.
    fn azimuth_from_sun(&self, wi: Vec3) -> f32 {
        let across = Vec2::new(wi.x, wi.z);
        let length = across.length();
        let cosine = if length > 1e-12 { across.dot(self.sun_azimuth) / length } else { 1.0 };
        (acos(cosine) / PI).sqrt()
    }

    /// A direction, for a surface with this normal.
    #[inline]
    pub(super) fn sample(&self, normal: Vec3, u: Vec2) -> Option<Vec3> {
        let uv = self.grid.sample(&self.grid.halves(normal), u)?;
        Some(direction_of(uv).0)
    }

    /// Density over solid angle with which [`SkyLight::sample`] finds a direction.
    #[inline]
    pub(super) fn pdf(&self, normal: Vec3, wi: Vec3) -> f32 {
        solid_angle_pdf(&self.grid, normal, wi, uv_of(wi))
    }
}

/// Elevation of a row of the table: denser towards the horizon.
fn row_elevation(row: usize) -> f32 {
    let s = row as f32 / (ELEVATIONS - 1) as f32;
    s * s * FRAC_PI_2
}

fn sky_table(air: &Atmosphere, sun_elevation: f32, scale: f32) -> Vec<Vec3> {
    let sun = unit_vector(0.0, sun_elevation);
    (0..ELEVATIONS * AZIMUTHS)
        .into_par_iter()
        .map(|i| {
            let s = (i % AZIMUTHS) as f32 / (AZIMUTHS - 1) as f32;
            let view = unit_vector(s * s * PI, row_elevation(i / AZIMUTHS));
            air.sky(EYE_HEIGHT, view, sun, STEPS) * scale
        })
        .collect()
}

/// The sky's irradiance on the ground: trapezoids over the table.
fn horizontal_irradiance(table: &[Vec3]) -> Vec3 {
    let row_mean = |row: usize| -> Vec3 {
        let at = |i: usize| table[row * AZIMUTHS + i];
        (1..AZIMUTHS)
            .map(|i| {
                let angle = |i: usize| (i as f32 / (AZIMUTHS - 1) as f32).powi(2);
                (at(i - 1) + at(i)) * 0.5 * (angle(i) - angle(i - 1))
            })
            .sum()
    };
    (1..ELEVATIONS)
        .map(|row| {
            // The integral of sin cos over the elevation is sin^2 / 2.
            let up = |row: usize| sin(row_elevation(row)).powi(2) * 0.5;
            (row_mean(row - 1) + row_mean(row)) * 0.5 * (up(row) - up(row - 1)) * TAU
        })
        .sum()
}

impl Sun {
    fn new(direction: Vec3, irradiance: Vec3) -> Self {
        // Over a disc so small the cosine is 1 - h / 2 on average.
        let solid_angle = TAU * sun_height() * (1.0 - 0.5 * sun_height());
        Self {
            frame: Frame::from_z(direction),
            radiance: irradiance / solid_angle,
            irradiance: luminance(irradiance),
        }
    }

    /// Appends frame, radiance, luminance of the irradiance, half the disc's angle and 1 minus its cosine.
    pub(super) fn pack(&self, words: &mut Words) {
        let Frame { x, y, z } = self.frame;
        [x, y, z, self.radiance].into_iter().for_each(|v| words.vec3(v));
        words.f32s(&[self.irradiance, SUN_ANGLE, sun_height()]);
    }

    /// Cosine between a normal and the sun as far as any part of the disc may matter; 1 without normal.
    #[inline]
    pub(super) fn facing(&self, normal: Vec3) -> f32 {
        if normal == Vec3::ZERO {
            return 1.0;
        }
        (normal.dot(self.frame.z) + SUN_ANGLE).clamp(0.0, 1.0)
    }

    /// Whether a unit vector points into the disc. Compared by distance: a cosine has no digits left here.
    #[inline]
    fn contains(&self, wi: Vec3) -> bool {
        let h = sun_height();
        wi.distance_squared(self.frame.z) <= 2.0 * h
    }

    #[inline]
    pub(super) fn radiance(&self, wi: Vec3) -> Vec3 {
        if wi.y > 0.0 && self.contains(wi) { self.radiance } else { Vec3::ZERO }
    }

    pub(super) fn sample(&self, u: Vec2) -> Vec3 {
        // Just inside, so that rounding does not lose the disc's edge.
        self.frame.to_outer(warp::uniform_cone(u, sun_height() * 0.999_9))
    }

    #[inline]
    pub(super) fn pdf(&self, wi: Vec3) -> f32 {
        if self.contains(wi) { warp::uniform_cone_pdf(sun_height()) } else { 0.0 }
    }
}
