//! How a surface scatters light: glTF's metallic-roughness material with its KHR extensions, energy-preserving.
//!
//! Everything is in the local shading frame: `z` is the shading normal on the outside of the surface, `x` the tangent,
//! `y` the bitangent. `wo` and `wi` are unit vectors that point away from the surface; `wo` is where the path comes
//! from (towards the camera), `wi` where light comes from.

mod albedo;
mod coat;
mod cosine;
mod dispersion;
pub(crate) mod fresnel;
mod ggx;
mod interface;
mod iridescence;
mod lambert;
mod layered;
mod reflectance;
mod sheen;
#[cfg(test)]
mod tests;

pub use dispersion::Wavelength;
pub use reflectance::Metal;

pub(crate) use albedo::tables as bounce_tables;
pub(crate) use sheen::table as sheen_table;

use layered::Layered;
use vastlight_math::{Vec2, Vec3, warp};

/// The numbers of a material at one point: no textures, nothing to look up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfParams {
    /// Diffuse and transmission albedo of the dielectric, normal reflectance of the metal; linear, 0..1.
    pub base_color: Vec3,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0..1; the microfacet width alpha is its square.
    pub roughness: f32,
    /// A measured metal that replaces the base colour in the metal's reflectance.
    pub conductor: Option<Metal>,
    /// Index of refraction of the inside against the outside (below 1 for a bubble in glass); 0 means infinite.
    pub ior: f32,
    /// Strength of the dielectric reflection, 0..1.
    pub specular: f32,
    /// Colour of the dielectric reflection at normal incidence; may exceed 1.
    pub specular_color: Vec3,
    /// Fraction of the dielectric that transmits instead of diffusing.
    pub transmission: f32,
    /// Multiplies transmitted light: white, or the RGB weight of the wavelength that the path has just chosen.
    pub transmission_tint: Vec3,
    /// An infinitely thin wall: light passes without refraction.
    pub thin: bool,
    /// 20 / Abbe number; 0 for none.
    pub dispersion: f32,
    /// Weight of the clear coat.
    pub clearcoat: f32,
    /// Perceptual roughness of the clear coat.
    pub clearcoat_roughness: f32,
    /// Normal of the clear coat in the local frame; z where it is the surface's.
    pub clearcoat_normal: Vec3,
    /// Colour of the sheen; black for none.
    pub sheen_color: Vec3,
    /// Perceptual roughness of the sheen.
    pub sheen_roughness: f32,
    /// Stretch of the highlight, 0..1.
    pub anisotropy: f32,
    /// Direction of the stretch in the local frame's x and y, unit length.
    pub anisotropy_direction: Vec2,
    /// Weight of the thin film.
    pub iridescence: f32,
    /// Index of refraction of the thin film.
    pub iridescence_ior: f32,
    /// Thickness of the thin film, nanometres.
    pub iridescence_thickness: f32,
}

impl BsdfParams {
    /// A diffuse reflector.
    #[must_use]
    pub const fn diffuse(albedo: Vec3) -> Self {
        Self {
            base_color: albedo,
            metallic: 0.0,
            roughness: 1.0,
            conductor: None,
            ior: 1.5,
            specular: 0.0,
            specular_color: Vec3::ONE,
            transmission: 0.0,
            transmission_tint: Vec3::ONE,
            thin: true,
            dispersion: 0.0,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            clearcoat_normal: Vec3::Z,
            sheen_color: Vec3::ZERO,
            sheen_roughness: 0.0,
            anisotropy: 0.0,
            anisotropy_direction: Vec2::X,
            iridescence: 0.0,
            iridescence_ior: 1.3,
            iridescence_thickness: 400.0,
        }
    }

    /// Whether nothing but Lambert's reflection is left.
    fn is_diffuse(&self) -> bool {
        self.specular <= 0.0
            && self.metallic <= 0.0
            && self.transmission <= 0.0
            && self.clearcoat <= 0.0
            && self.sheen_color.max_element() <= 0.0
            && self.iridescence <= 0.0
    }
}

/// A direction drawn by [`Bsdf::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Where the path goes on.
    pub wi: Vec3,
    /// `f * |cos| / pdf`, for radiance (transmission carries the factor 1/eta^2).
    pub weight: Vec3,
    /// Density over solid angle, of all lobes together; 0 for a mirror-like direction.
    pub pdf: f32,
    /// Drawn from a mirror-like lobe: no light sample could have found it.
    pub delta: bool,
    /// `wi` is on the other side of the surface.
    pub transmitted: bool,
    /// Squared relative index of the side that the path enters, `(n_i / n_o)^2`: `weight * radiance_scale` is the
    /// share of energy, to be used by Russian roulette. 1 without refraction.
    pub radiance_scale: f32,
    /// The direction depends on the wavelength: from here on the path carries its wavelength alone.
    pub dispersed: bool,
}

/// The random numbers that choose a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BsdfDraw {
    /// Of the lobe.
    pub(crate) lobe: f32,
    /// Of the direction.
    pub(crate) u: Vec2,
    /// [`warp::cosine_hemisphere`] of `u`, which is cheaper for many points at once.
    pub(crate) cosine: Vec3,
}

/// The scattering of one surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bsdf {
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "lives on the stack of one shading point; a box would allocate"
)]
enum Kind {
    Lambert(Vec3),
    Layered(Layered),
}

impl Bsdf {
    /// Prepares the scattering of a point. Numbers out of range are brought into it.
    #[must_use]
    pub fn new(params: &BsdfParams) -> Self {
        if params.is_diffuse() {
            return Self { kind: Kind::Lambert(color(params.base_color)) };
        }
        Self { kind: Kind::Layered(Layered::new(params)) }
    }

    /// `f(wo, wi) * |cos(wi)|`, without mirror-like lobes.
    #[inline]
    #[must_use]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(wo, wi).0
    }

    /// Density over solid angle with which [`Bsdf::sample`] draws `wi`, without mirror-like lobes.
    #[inline]
    #[must_use]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }

    /// [`Bsdf::eval`] and [`Bsdf::pdf`] for the price of one.
    #[inline(always)]
    #[must_use]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        match &self.kind {
            Kind::Lambert(albedo) => lambert::evaluate(*albedo, wo, wi),
            Kind::Layered(layered) => layered.eval_pdf(wo, wi),
        }
    }

    /// Draws a direction; `None` where the sample ends the path (it left through the surface's own horizon, or there
    /// is nothing to scatter). `u_lobe` and `u` are uniform in [0, 1).
    #[inline(always)]
    #[must_use]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        self.sample_drawn(wo, BsdfDraw { lobe: u_lobe, u, cosine: warp::cosine_hemisphere(u) })
    }

    /// [`Bsdf::sample`] with random numbers made ready.
    #[inline(always)]
    pub(crate) fn sample_drawn(&self, wo: Vec3, draw: BsdfDraw) -> Option<BsdfSample> {
        match &self.kind {
            Kind::Lambert(albedo) => {
                let (wi, pdf) = lambert::sample(wo, draw.cosine)?;
                Some(BsdfSample {
                    wi,
                    weight: *albedo,
                    pdf,
                    delta: false,
                    transmitted: false,
                    radiance_scale: 1.0,
                    dispersed: false,
                })
            }
            Kind::Layered(layered) => layered.sample(wo, &draw),
        }
    }

    /// Whether the surface is a smooth thin wall that light goes straight through: a window pane.
    #[inline]
    #[must_use]
    pub fn is_pane(&self) -> bool {
        matches!(&self.kind, Kind::Layered(layered) if layered.is_pane())
    }

    /// Share of light that goes straight through a pane, per channel; zero for any other surface. A sample that is
    /// `delta` and `transmitted` there has this expected weight.
    #[must_use]
    pub fn straight(&self, wo: Vec3) -> Vec3 {
        match &self.kind {
            Kind::Lambert(_) => Vec3::ZERO,
            Kind::Layered(layered) => layered.straight(wo),
        }
    }

    /// Colour for the albedo AOV, 0..1: diffuse and specular together, independent of direction.
    #[inline]
    #[must_use]
    pub fn albedo(&self) -> Vec3 {
        match &self.kind {
            Kind::Lambert(albedo) => *albedo,
            Kind::Layered(layered) => layered.albedo(),
        }
    }

    /// Whether a lobe of finite width is there, so that sampling the lights is worth it.
    #[inline]
    #[must_use]
    pub fn has_nondelta(&self) -> bool {
        match &self.kind {
            Kind::Lambert(albedo) => albedo.max_element() > 0.0,
            Kind::Layered(layered) => layered.has_nondelta(),
        }
    }

    /// Whether nothing leaves but in narrow lobes: a mirror, glass, metal that is hardly rough. Photons end elsewhere.
    #[inline]
    #[must_use]
    pub fn focuses(&self) -> bool {
        match &self.kind {
            Kind::Lambert(_) => false,
            Kind::Layered(layered) => layered.focuses(),
        }
    }

    /// Whether light that arrives may leave in a narrow lobe.
    #[must_use]
    pub fn may_focus(&self) -> bool {
        match &self.kind {
            Kind::Lambert(_) => false,
            Kind::Layered(layered) => layered.focuses() || layered.has_delta(),
        }
    }

    /// Whether a lobe of finite width leads through the surface, so that lights behind it are worth sampling.
    #[inline]
    #[must_use]
    pub fn transmits(&self) -> bool {
        match &self.kind {
            Kind::Lambert(_) => false,
            Kind::Layered(layered) => layered.transmits(),
        }
    }
}

/// A colour whose channels are all in [0, 1]; black where it is not a number.
fn color(c: Vec3) -> Vec3 {
    Vec3::new(unit(c.x), unit(c.y), unit(c.z))
}

/// A colour without negative or infinite channels.
fn positive(c: Vec3) -> Vec3 {
    let channel = |x: f32| if x > 0.0 { x.min(1e6) } else { 0.0 };
    Vec3::new(channel(c.x), channel(c.y), channel(c.z))
}

/// A number in [0, 1]; 0 where it is not a number.
fn unit(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

fn max3(c: Vec3) -> f32 {
    c.x.max(c.y).max(c.z)
}

fn mean3(c: Vec3) -> f32 {
    (c.x + c.y + c.z) * (1.0 / 3.0)
}
