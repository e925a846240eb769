//! The clear atmosphere: Rayleigh, haze and ozone; single scattering integrated, the rest as if isotropic.
//!
//! The medium and the table of optical depths follow E. Bruneton and F. Neyret 2008, "Precomputed atmospheric
//! scattering"; all higher orders of scattering are summed as a geometric series with S. Hillaire 2020, "A scalable and
//! production ready sky and atmosphere rendering technique". Lengths in kilometres, coefficients per kilometre at
//! 680, 550 and 440 nm taken as red, green and blue; radiances are relative to the sun's irradiance above the air.

use rayon::prelude::*;
use std::f32::consts::PI;
use vastlight_math::real::{exp, sin_cos};
use vastlight_math::{Vec2, Vec3, warp};

/// Radius of the ground.
pub(super) const GROUND: f32 = 6360.0;
/// Radius at which the air ends.
const TOP: f32 = 6460.0;
const RAYLEIGH: Vec3 = Vec3::new(5.802e-3, 13.558e-3, 33.1e-3);
const OZONE: Vec3 = Vec3::new(0.650e-3, 1.881e-3, 0.085e-3);
const RAYLEIGH_HEIGHT: f32 = 8.0;
const HAZE_HEIGHT: f32 = 1.2;
/// Scattered part of what haze takes away.
const HAZE_ALBEDO: f32 = 0.9;
/// Mean cosine of haze scattering.
const HAZE_G: f32 = 0.8;
/// Wavelengths relative to 550 nm to the power -1.3 (Angstrom's exponent).
const HAZE_COLOR: Vec3 = Vec3::new(0.759, 1.0, 1.336);
/// Half the sun's angle, radians.
pub(super) const SUN_ANGLE: f32 = 0.266_5 * PI / 180.0;

const DEPTH_HEIGHTS: usize = 24;
const DEPTH_ANGLES: usize = 64;
const ORDERS_HEIGHTS: usize = 10;
const ORDERS_SUNS: usize = 24;

/// An atmosphere of a given haze over ground of a given albedo.
#[derive(Clone, Debug)]
pub(super) struct Atmosphere {
    haze_extinction: Vec3,
    ground_albedo: Vec3,
    /// Columns of air, haze and ozone to the top, by height and angle.
    depths: Vec<Vec3>,
    /// Light scattered twice or more, as a source per scattering coefficient, by height and sun.
    orders: Vec<Vec3>,
}

/// Densities relative to the ground's (ozone: to its maximum) at a height.
fn densities(height: f32) -> Vec3 {
    let h = height.max(0.0);
    Vec3::new(exp(-h / RAYLEIGH_HEIGHT), exp(-h / HAZE_HEIGHT), (1.0 - (h - 25.0).abs() / 15.0).max(0.0))
}

/// Distance to the sphere of `radius` from inside it, at distance `r` from its centre along a cosine `mu`.
fn distance_to_top(r: f32, mu: f32, radius: f32) -> f32 {
    -r * mu + (r * r * (mu * mu - 1.0) + radius * radius).max(0.0).sqrt()
}

impl Atmosphere {
    /// `turbidity` is Linke's kind: the ratio of the vertical optical depth of air and haze to that of air, at 550 nm.
    pub(super) fn new(turbidity: f32, ground_albedo: Vec3) -> Self {
        let haze_depth = (turbidity - 1.0) * RAYLEIGH.y * RAYLEIGH_HEIGHT;
        let mut air = Self {
            haze_extinction: HAZE_COLOR * (haze_depth / HAZE_HEIGHT),
            ground_albedo,
            depths: Vec::new(),
            orders: Vec::new(),
        };
        air.depths = depth_table();
        air.orders = (0..ORDERS_HEIGHTS * ORDERS_SUNS)
            .into_par_iter()
            .map(|i| {
                let height = unit(i / ORDERS_SUNS, ORDERS_HEIGHTS);
                let sun = unit(i % ORDERS_SUNS, ORDERS_SUNS);
                air.higher_orders(GROUND + height * height * (TOP - GROUND), 2.0 * sun - 1.0)
            })
            .collect();
        air
    }

    fn extinction(&self, density: Vec3) -> Vec3 {
        RAYLEIGH * density.x + self.haze_extinction * density.y + OZONE * density.z
    }

    /// Fraction of light that gets from the top of the air to a point, from a direction above the horizon.
    fn transmittance_to_top(&self, r: f32, mu: f32) -> Vec3 {
        let horizon = -(1.0 - (GROUND / r).powi(2)).max(0.0).sqrt();
        let mu = mu.max(horizon);
        let (x, y) = depth_coordinates(r, mu);
        exp3(-self.extinction(lookup(&self.depths, DEPTH_ANGLES, x, y)))
    }

    /// Fraction of the sun's irradiance that reaches a point; the disc sets gradually.
    pub(super) fn sunlight(&self, r: f32, mu: f32) -> Vec3 {
        let horizon = -(1.0 - (GROUND / r).powi(2)).max(0.0).sqrt();
        let risen = ((mu - horizon) / (2.0 * SUN_ANGLE) + 0.5).clamp(0.0, 1.0);
        if risen == 0.0 { Vec3::ZERO } else { self.transmittance_to_top(r, mu) * risen }
    }

    /// Radiance at a height from the direction `view`, with the sun in the direction `sun` (unit vectors, y up), per
    /// irradiance of the sun above the air.
    pub(super) fn sky(&self, height: f32, view: Vec3, sun: Vec3, steps: u32) -> Vec3 {
        let eye = Vec3::new(0.0, GROUND + height, 0.0);
        let reach = distance_to_top(eye.y, view.y, TOP);
        let cosine = view.dot(sun);
        let (air_phase, haze_phase) = (rayleigh_phase(cosine), haze_phase(cosine));
        let mut sum = Vec3::ZERO;
        self.march(eye, view, reach, steps, |at, density, weight| {
            let r = at.length();
            let mu = at.dot(sun) / r;
            let air = RAYLEIGH * density.x;
            let haze = self.haze_extinction * (HAZE_ALBEDO * density.y);
            let direct = self.sunlight(r, mu) * (air * air_phase + haze * haze_phase);
            sum += weight * (direct + self.scattered(r, mu) * (air + haze));
        });
        sum
    }

    /// Calls `visit(point, densities, weight)` along a ray, where the weights integrate over the distance with the
    /// transmittance back to the eye. Steps grow with the square of their number. Returns the whole transmittance.
    fn march(
        &self,
        eye: Vec3,
        view: Vec3,
        reach: f32,
        steps: u32,
        mut visit: impl FnMut(Vec3, Vec3, Vec3),
    ) -> Vec3 {
        let mut transmittance = Vec3::ONE;
        let mut near = 0.0;
        for i in 0..steps {
            let far = reach * ((i + 1) as f32 / steps as f32).powi(2);
            let (middle, length) = (0.5 * (near + far), far - near);
            let at = eye + view * middle;
            let density = densities(at.length() - GROUND);
            let extinction = self.extinction(density).max(Vec3::splat(1e-9));
            let passed = exp3(-extinction * length);
            visit(at, density, transmittance * (Vec3::ONE - passed) / extinction);
            transmittance *= passed;
            near = far;
        }
        transmittance
    }

    fn scattered(&self, r: f32, mu_sun: f32) -> Vec3 {
        let height = ((r - GROUND) / (TOP - GROUND)).clamp(0.0, 1.0).sqrt();
        lookup(&self.orders, ORDERS_SUNS, 0.5 * mu_sun + 0.5, height)
    }

    /// The source of all light scattered at least twice at a point, per scattering coefficient.
    fn higher_orders(&self, r: f32, mu_sun: f32) -> Vec3 {
        const SIDE: u32 = 5;
        let eye = Vec3::new(0.0, r.clamp(GROUND + 0.01, TOP - 0.01), 0.0);
        let sun = warp::direction(mu_sun, 0.0);
        let sun = Vec3::new(sun.x, sun.z, sun.y);
        let (mut second, mut again) = (Vec3::ZERO, Vec3::ZERO);
        for i in 0..SIDE * SIDE {
            let u = Vec2::new((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5) / SIDE as f32;
            let (light, share) = self.once_scattered(eye, warp::uniform_sphere(u), sun);
            second += light;
            again += share;
        }
        let mean = 1.0 / (SIDE * SIDE) as f32;
        // Isotropic phase 1 / (4 pi) over the sphere's 4 pi: the mean over directions.
        let series = Vec3::ONE / (Vec3::ONE - (again * mean).min(Vec3::splat(0.99)));
        second * mean * series / (4.0 * PI)
    }

    /// Along a ray: radiance of isotropically scattered sunlight (times 4 pi) with the ground's, and the fraction of
    /// light that is scattered on the way.
    fn once_scattered(&self, eye: Vec3, view: Vec3, sun: Vec3) -> (Vec3, Vec3) {
        let (r, mu) = (eye.length(), eye.dot(view) / eye.length());
        let to_ground = r * r * (mu * mu - 1.0) + GROUND * GROUND;
        let hits_ground = mu < 0.0 && to_ground >= 0.0;
        let reach = if hits_ground { -r * mu - to_ground.sqrt() } else { distance_to_top(r, mu, TOP) };
        let (mut light, mut share) = (Vec3::ZERO, Vec3::ZERO);
        let transmittance = self.march(eye, view, reach, 12, |at, density, weight| {
            let r = at.length();
            let scattering = RAYLEIGH * density.x + self.haze_extinction * (HAZE_ALBEDO * density.y);
            light += weight * scattering * self.sunlight(r, at.dot(sun) / r);
            share += weight * scattering;
        });
        if hits_ground {
            let up = (eye + view * reach).normalize();
            let lit = self.sunlight(GROUND, up.dot(sun)) * up.dot(sun).max(0.0);
            // The ground's radiance is albedo / pi times its irradiance; 4 pi of it, as above.
            light += transmittance * lit * self.ground_albedo * 4.0;
        }
        (light, share)
    }

    /// Extinction of air and haze at the ground.
    pub(super) fn ground_extinction(&self) -> Vec3 {
        self.extinction(densities(0.0))
    }
}

fn rayleigh_phase(cosine: f32) -> f32 {
    3.0 / (16.0 * PI) * (1.0 + cosine * cosine)
}

/// Cornette and Shanks 1992.
fn haze_phase(cosine: f32) -> f32 {
    let g = HAZE_G;
    let base = (1.0 + g * g - 2.0 * g * cosine).max(1e-4);
    3.0 / (8.0 * PI) * (1.0 - g * g) * (1.0 + cosine * cosine) / ((2.0 + g * g) * base * base.sqrt())
}

fn exp3(v: Vec3) -> Vec3 {
    Vec3::new(exp(v.x), exp(v.y), exp(v.z))
}

/// The i-th of n points of [0, 1], ends included.
fn unit(i: usize, n: usize) -> f32 {
    i as f32 / (n - 1) as f32
}

/// Coordinates in the table of depths: by the distance to the top between its shortest and longest, and by the
/// distance to the horizon (Bruneton and Neyret 2008).
fn depth_coordinates(r: f32, mu: f32) -> (f32, f32) {
    let to_horizon_of_top = (TOP * TOP - GROUND * GROUND).sqrt();
    let to_horizon = (r * r - GROUND * GROUND).max(0.0).sqrt();
    let (shortest, longest) = (TOP - r, to_horizon + to_horizon_of_top);
    let distance = distance_to_top(r, mu, TOP);
    let x = (distance - shortest) / (longest - shortest).max(1e-6);
    (x.clamp(0.0, 1.0), (to_horizon / to_horizon_of_top).clamp(0.0, 1.0))
}

fn depth_table() -> Vec<Vec3> {
    let to_horizon_of_top = (TOP * TOP - GROUND * GROUND).sqrt();
    let entry = |i: usize| {
        let to_horizon = unit(i / DEPTH_ANGLES, DEPTH_HEIGHTS) * to_horizon_of_top;
        let r = (to_horizon * to_horizon + GROUND * GROUND).sqrt();
        let (shortest, longest) = (TOP - r, to_horizon + to_horizon_of_top);
        let reach = shortest + unit(i % DEPTH_ANGLES, DEPTH_ANGLES) * (longest - shortest);
        let mu = if reach <= 0.0 { 1.0 } else { (TOP * TOP - r * r - reach * reach) / (2.0 * r * reach) };
        column(r, mu.clamp(-1.0, 1.0), reach)
    };
    (0..DEPTH_HEIGHTS * DEPTH_ANGLES).into_par_iter().map(entry).collect()
}

/// Densities integrated over a ray: from its lowest point outwards, with steps that grow.
fn column(r: f32, mu: f32, reach: f32) -> Vec3 {
    let lowest = (-r * mu).clamp(0.0, reach);
    let piece = |length: f32| -> Vec3 {
        const STEPS: u32 = 24;
        let end = |i: u32| length * (i as f32 / STEPS as f32).powi(2);
        let step = |i: u32| {
            let t = lowest + 0.5 * (end(i) + end(i + 1));
            let height = (r * r + t * t + 2.0 * r * t * mu).max(0.0).sqrt() - GROUND;
            densities(height) * (end(i + 1) - end(i)).abs()
        };
        (0..STEPS).map(step).sum()
    };
    piece(reach - lowest) + piece(-lowest)
}

/// Bilinear lookup in a table whose rows have `width` entries; coordinates in [0, 1].
pub(super) fn lookup(table: &[Vec3], width: usize, x: f32, y: f32) -> Vec3 {
    let height = table.len() / width;
    let split = |v: f32, n: usize| {
        let v = v.clamp(0.0, 1.0) * (n - 1) as f32;
        let i = (v as usize).min(n.saturating_sub(2));
        (i, v - i as f32)
    };
    let ((x0, s), (y0, t)) = (split(x, width), split(y, height));
    let row = |y: usize| table[y * width + x0] * (1.0 - s) + table[y * width + (x0 + 1).min(width - 1)] * s;
    row(y0) * (1.0 - t) + row((y0 + 1).min(height - 1)) * t
}

/// A unit vector at an elevation and an azimuth from -z towards +x.
pub(super) fn unit_vector(azimuth: f32, elevation: f32) -> Vec3 {
    let (up, across) = sin_cos(elevation);
    let (east, north) = sin_cos(azimuth);
    Vec3::new(across * east, up, -across * north)
}
