//! The one material: glTF's metallic-roughness model with its KHR extensions, and measured metals.

use serde::{Deserialize, Serialize};
use vastlight_math::Vec3;

/// A channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Channel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha.
    A,
}

/// A number, optionally multiplied by a channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScalarInput {
    /// The number.
    pub factor: f32,
    /// Index into [`crate::SceneDesc::textures`], and the channel.
    pub texture: Option<(u32, Channel)>,
}

impl ScalarInput {
    /// A number without a texture.
    #[must_use]
    pub const fn new(factor: f32) -> Self {
        Self { factor, texture: None }
    }
}

/// A linear RGB colour, optionally multiplied by a texture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColorInput {
    /// The colour.
    pub factor: Vec3,
    /// Index into [`crate::SceneDesc::textures`].
    pub texture: Option<u32>,
}

impl ColorInput {
    /// A colour without a texture.
    #[must_use]
    pub const fn new(factor: Vec3) -> Self {
        Self { factor, texture: None }
    }
}

/// A tangent-space normal map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NormalMap {
    /// Index into [`crate::SceneDesc::textures`].
    pub texture: u32,
    /// Multiplies the map's x and y.
    pub scale: f32,
}

/// How alpha is used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum AlphaMode {
    /// Alpha is ignored.
    Opaque,
    /// The surface is there where alpha is at least the cutoff.
    Mask(f32),
    /// The surface covers the fraction alpha of what is behind it.
    Blend,
}

/// Complex index of refraction of a measured metal, per RGB channel: eta + i k.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Conductor {
    /// Real part.
    pub eta: Vec3,
    /// Imaginary part.
    pub k: Vec3,
}

/// A physically based surface. Fields follow glTF 2.0 and its KHR_materials extensions, whose texts define them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name, for messages and overrides.
    pub name: String,
    /// Diffuse albedo of dielectrics and normal reflectance of metals.
    pub base_color: ColorInput,
    /// Opacity; the base colour texture's alpha is its texture.
    pub alpha: ScalarInput,
    /// How alpha is used.
    pub alpha_mode: AlphaMode,
    /// Back faces are shaded like front faces; a single-sided surface is not hit from behind by camera rays only
    /// where it is alpha-masked in other renderers; vastlight shades both sides always and uses this for emission.
    pub double_sided: bool,
    /// Emit and show the base colour alone, without shading (KHR_materials_unlit).
    pub unlit: bool,
    /// 0 dielectric, 1 metal.
    pub metallic: ScalarInput,
    /// Perceptual roughness; the microfacet width alpha is its square.
    pub roughness: ScalarInput,
    /// A measured metal that replaces base colour and metallic for the metal lobe.
    pub conductor: Option<Conductor>,
    /// Tangent-space normals.
    pub normal_map: Option<NormalMap>,
    /// Emitted radiance, W/(sr m^2) per RGB channel.
    pub emission: ColorInput,
    /// Index of refraction of the dielectric (KHR_materials_ior); 0 means "infinite" as the extension says.
    pub ior: f32,
    /// Strength of the dielectric reflection (KHR_materials_specular).
    pub specular: ScalarInput,
    /// Colour of the dielectric reflection at normal incidence (KHR_materials_specular).
    pub specular_color: ColorInput,
    /// Fraction of light that is not diffused but transmitted (KHR_materials_transmission).
    pub transmission: ScalarInput,
    /// Thickness; 0 means an infinitely thin wall, anything else a closed volume (KHR_materials_volume).
    pub thickness: f32,
    /// Colour that white light has after `attenuation_distance` inside the volume.
    pub attenuation_color: Vec3,
    /// Distance at which `attenuation_color` is reached; infinity for none.
    pub attenuation_distance: f32,
    /// 20 / Abbe number (KHR_materials_dispersion); 0 for none.
    pub dispersion: f32,
    /// Weight of the clear coat (KHR_materials_clearcoat).
    pub clearcoat: ScalarInput,
    /// Roughness of the clear coat.
    pub clearcoat_roughness: ScalarInput,
    /// Normals of the clear coat.
    pub clearcoat_normal_map: Option<NormalMap>,
    /// Colour of the sheen lobe; black for none (KHR_materials_sheen).
    pub sheen_color: ColorInput,
    /// Roughness of the sheen lobe.
    pub sheen_roughness: ScalarInput,
    /// Stretch of the highlight, 0..1 (KHR_materials_anisotropy).
    pub anisotropy: f32,
    /// Rotation of the stretch from the tangent, radians, counter-clockwise.
    pub anisotropy_rotation: f32,
    /// Direction in RG and strength in B.
    pub anisotropy_texture: Option<u32>,
    /// Weight of the thin film (KHR_materials_iridescence).
    pub iridescence: ScalarInput,
    /// Index of refraction of the thin film.
    pub iridescence_ior: f32,
    /// Smallest and largest thickness of the thin film, nanometres; the texture's G interpolates, without one the
    /// largest holds.
    pub iridescence_thickness: [f32; 2],
    /// Texture whose green channel interpolates the thickness.
    pub iridescence_thickness_texture: Option<u32>,
}

impl Material {
    /// A neutral dielectric: mid grey, rough, opaque.
    #[must_use]
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            base_color: ColorInput::new(Vec3::splat(0.6)),
            alpha: ScalarInput::new(1.0),
            alpha_mode: AlphaMode::Opaque,
            double_sided: true,
            unlit: false,
            metallic: ScalarInput::new(0.0),
            roughness: ScalarInput::new(0.6),
            conductor: None,
            normal_map: None,
            emission: ColorInput::new(Vec3::ZERO),
            ior: 1.5,
            specular: ScalarInput::new(1.0),
            specular_color: ColorInput::new(Vec3::ONE),
            transmission: ScalarInput::new(0.0),
            thickness: 0.0,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            dispersion: 0.0,
            clearcoat: ScalarInput::new(0.0),
            clearcoat_roughness: ScalarInput::new(0.0),
            clearcoat_normal_map: None,
            sheen_color: ColorInput::new(Vec3::ZERO),
            sheen_roughness: ScalarInput::new(0.0),
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            anisotropy_texture: None,
            iridescence: ScalarInput::new(0.0),
            iridescence_ior: 1.3,
            iridescence_thickness: [100.0, 400.0],
            iridescence_thickness_texture: None,
        }
    }

    /// A purely diffuse material (no dielectric reflection): what reference scenes call Lambertian.
    #[must_use]
    pub fn diffuse(name: impl Into<String>, albedo: Vec3) -> Self {
        Self {
            base_color: ColorInput::new(albedo),
            roughness: ScalarInput::new(1.0),
            specular: ScalarInput::new(0.0),
            ..Self::new(name)
        }
    }

    /// A black surface that emits `radiance`, W/(sr m^2), from its front or from both sides.
    #[must_use]
    pub fn emitter(name: impl Into<String>, radiance: Vec3, double_sided: bool) -> Self {
        Self { emission: ColorInput::new(radiance), double_sided, ..Self::diffuse(name, Vec3::ZERO) }
    }

    /// A metal with artist's colour.
    #[must_use]
    pub fn metal(name: impl Into<String>, color: Vec3, roughness: f32) -> Self {
        Self {
            base_color: ColorInput::new(color),
            metallic: ScalarInput::new(1.0),
            roughness: ScalarInput::new(roughness),
            ..Self::new(name)
        }
    }

    /// Clear glass that fills a closed surface.
    #[must_use]
    pub fn glass(name: impl Into<String>, ior: f32, roughness: f32) -> Self {
        Self {
            base_color: ColorInput::new(Vec3::ONE),
            transmission: ScalarInput::new(1.0),
            thickness: 1.0,
            ior,
            roughness: ScalarInput::new(roughness),
            ..Self::new(name)
        }
    }

    /// Whether rays may pass a hit on this surface because of its alpha.
    #[must_use]
    pub fn has_alpha(&self) -> bool {
        self.alpha_mode != AlphaMode::Opaque
    }

    /// Whether the surface emits light at all (before textures).
    #[must_use]
    pub fn is_emissive(&self) -> bool {
        !self.unlit && self.emission.factor.max_element() > 0.0
    }
}
