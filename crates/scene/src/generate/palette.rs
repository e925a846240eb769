//! Materials that several demos share.

use crate::{AlphaMode, ColorInput, Conductor, Material, ScalarInput};
use vastlight_math::Vec3;

/// A linear colour from an sRGB hexadecimal number such as 0xc8b090.
pub(super) fn srgb(hex: u32) -> Vec3 {
    let channel = |shift: u32| {
        let x = (hex >> shift & 255) as f32 / 255.0;
        if x <= 0.04045 { x / 12.92 } else { vastlight_math::real::pow((x + 0.055) / 1.055, 2.4) }
    };
    Vec3::new(channel(16), channel(8), channel(0))
}

/// A rough or polished dielectric.
pub(super) fn stone(name: &str, color: Vec3, roughness: f32) -> Material {
    Material {
        base_color: ColorInput::new(color),
        roughness: ScalarInput::new(roughness),
        ..Material::new(name)
    }
}

/// A dielectric under a clear coat: lacquered wood, car paint.
pub(super) fn lacquer(name: &str, color: Vec3, roughness: f32) -> Material {
    Material {
        clearcoat: ScalarInput::new(1.0),
        clearcoat_roughness: ScalarInput::new(0.06),
        ..stone(name, color, roughness)
    }
}

/// Woven cloth: diffuse with a sheen.
pub(super) fn fabric(name: &str, color: Vec3) -> Material {
    Material {
        sheen_color: ColorInput::new(color * 0.5 + Vec3::splat(0.1)),
        sheen_roughness: ScalarInput::new(0.5),
        specular: ScalarInput::new(0.3),
        ..stone(name, color, 0.95)
    }
}

/// Metal with grinding marks along the first texture axis.
pub(super) fn brushed(name: &str, color: Vec3, roughness: f32) -> Material {
    Material { anisotropy: 0.7, ..Material::metal(name, color, roughness) }
}

/// A large pane of clean window glass as its mirror image alone: a smooth dark surface that covers the fraction
/// `coverage`. Light passes the rest unbent, so that lamps and the sun behind it can still be aimed at.
pub(super) fn pane(name: &str, coverage: f32) -> Material {
    Material {
        alpha: ScalarInput::new(coverage),
        alpha_mode: AlphaMode::Blend,
        ior: 1.7,
        ..stone(name, Vec3::new(0.01, 0.014, 0.013), 0.0)
    }
}

/// Glass that fills a closed surface and colours white light to `color` over `distance` metres.
pub(super) fn tinted_glass(name: &str, ior: f32, color: Vec3, distance: f32) -> Material {
    Material { attenuation_color: color, attenuation_distance: distance, ..Material::glass(name, ior, 0.0) }
}

/// Gold from its measured index of refraction.
pub(super) fn gold(name: &str, roughness: f32) -> Material {
    Material {
        conductor: Some(Conductor { eta: Vec3::new(0.143, 0.375, 1.442), k: Vec3::new(3.983, 2.386, 1.603) }),
        ..Material::metal(name, Vec3::new(1.0, 0.78, 0.34), roughness)
    }
}
