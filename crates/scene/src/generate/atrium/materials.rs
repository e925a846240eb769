//! What the atrium is made of.

use crate::generate::palette::{brushed, fabric, lacquer, pane, srgb, stone};
use crate::generate::{builder::Builder, textures};
use crate::{ColorInput, Encoding, Material};
use vastlight_math::{Vec2, Vec3};

/// Indices of the atrium's materials.
pub(super) struct Finishes {
    pub(super) limestone: u32,
    pub(super) carved: u32,
    pub(super) plaster: u32,
    pub(super) floor: u32,
    pub(super) steps: u32,
    pub(super) steel: u32,
    pub(super) bronze: u32,
    pub(super) wood: u32,
    pub(super) glass: u32,
    pub(super) water: u32,
    pub(super) granite: u32,
    pub(super) bark: u32,
    pub(super) leaves: u32,
    pub(super) soil: u32,
    pub(super) banners: [u32; 3],
    pub(super) globe: u32,
    pub(super) ceiling_lamp: u32,
}

impl Finishes {
    pub(super) fn new(b: &mut Builder, seed: u64) -> Self {
        let seed = seed as u32;
        let ashlar = textures::slabs("ashlar", 512, srgb(0xe2d6c0), srgb(0xa89878), 4, 4, seed);
        let ashlar = b.texture(ashlar, Encoding::Srgb, Vec2::new(4.8, 2.8));
        let paving = textures::slabs("paving", 512, srgb(0xcfc4b2), srgb(0x776d60), 2, 2, seed ^ 5);
        let paving = b.texture(paving, Encoding::Srgb, Vec2::new(2.4, 2.4));
        let marble = textures::marble("marble", srgb(0xe8e2d8), srgb(0x8c8076), seed ^ 9);
        let marble = b.texture(marble, Encoding::Srgb, Vec2::splat(3.0));
        let oak = textures::planks("oak", srgb(0xb98a55), srgb(0x7c5630), 4, seed ^ 3);
        let oak = b.texture(oak, Encoding::Srgb, Vec2::new(1.6, 0.5));
        let textured = |material: Material, texture: u32| Material {
            base_color: ColorInput { texture: Some(texture), ..material.base_color },
            ..material
        };
        let banner = |hex: u32| fabric("banner", srgb(hex));
        Self {
            limestone: b.material(textured(stone("limestone", Vec3::ONE, 0.55), ashlar)),
            carved: b.material(stone("carved limestone", srgb(0xe0d4be), 0.5)),
            plaster: b.material(stone("plaster", srgb(0xe6d8c0), 0.8)),
            floor: b.material(textured(stone("polished floor", Vec3::ONE, 0.16), paving)),
            steps: b.material(textured(stone("marble steps", Vec3::ONE, 0.22), marble)),
            steel: b.material(brushed("brushed steel", Vec3::new(0.58, 0.57, 0.55), 0.32)),
            bronze: b.material(Material::metal("bronze", Vec3::new(0.55, 0.36, 0.19), 0.3)),
            wood: b.material(textured(lacquer("oak", Vec3::ONE, 0.4), oak)),
            glass: b.material(pane("roof glass", 0.16)),
            water: b.material(Material { ior: 1.33, ..stone("water", Vec3::new(0.008, 0.016, 0.016), 0.0) }),
            granite: b.material(stone("black granite", srgb(0x2c2a29), 0.18)),
            bark: b.material(stone("bark", srgb(0x6b5a48), 0.9)),
            leaves: b.material(stone("leaves", Vec3::ONE, 0.45)),
            soil: b.material(stone("soil", srgb(0x3a2a1e), 1.0)),
            banners: [0xc8502a, 0xd9a441, 0x1f6a6d].map(|hex| b.material(banner(hex))),
            globe: b.material(Material::emitter("globe", Vec3::new(1.0, 0.66, 0.34) * 16.0, false)),
            ceiling_lamp: b.material(Material::emitter(
                "ceiling lamp",
                Vec3::new(1.0, 0.62, 0.30) * 26.0,
                false,
            )),
        }
    }
}
