//! Materials: metallic-roughness and the KHR_materials extensions.

use super::extras;
use super::json::Json;
use super::texture::Textures;
use vastlight_math::Vec3;
use vastlight_scene::{AlphaMode, Channel, ColorInput, Encoding, Material, NormalMap, ScalarInput};

/// Reads a material; an empty object gives glTF's default.
pub(super) fn read(root: &Json<'_>, json: &Json<'_>, name: String, textures: &mut Textures) -> Material {
    let mut reader = Reader { root, textures };
    let mut material = reader.base(json, name);
    reader.dielectric(json, &mut material);
    reader.volume(json, &mut material);
    reader.coats(json, &mut material);
    reader.anisotropy(json, &mut material);
    reader.iridescence(json, &mut material);
    material
}

struct Reader<'a> {
    root: &'a Json<'a>,
    textures: &'a mut Textures,
}

impl Reader<'_> {
    fn texture(&mut self, json: &Json<'_>, key: &str, encoding: Encoding) -> Option<u32> {
        self.textures.add(self.root, json.get(key)?, encoding)
    }

    fn color(&mut self, json: &Json<'_>, factor: Vec3, texture: &str) -> ColorInput {
        ColorInput { factor, texture: self.texture(json, texture, Encoding::Srgb) }
    }

    fn scalar(&mut self, json: &Json<'_>, factor: (&str, f32), texture: (&str, Channel)) -> ScalarInput {
        let (name, channel) = texture;
        let number = self.texture(json, name, Encoding::Linear);
        ScalarInput { factor: json.float(factor.0, factor.1), texture: number.map(|t| (t, channel)) }
    }

    fn normal_map(&mut self, json: &Json<'_>, key: &str) -> Option<NormalMap> {
        let texture = self.texture(json, key, Encoding::Linear)?;
        Some(NormalMap { texture, scale: json.at(key).float("scale", 1.0) })
    }

    fn base(&mut self, json: &Json<'_>, name: String) -> Material {
        let pbr = json.at("pbrMetallicRoughness");
        let [r, g, b, a] = pbr.floats("baseColorFactor").unwrap_or([1.0; 4]);
        let base_color = self.color(pbr, Vec3::new(r, g, b), "baseColorTexture");
        let strength = extension_number(json, "KHR_materials_emissive_strength", "emissiveStrength", 1.0);
        let emissive = vec3(json, "emissiveFactor", Vec3::ZERO) * strength;
        Material {
            base_color,
            alpha: ScalarInput { factor: a, texture: base_color.texture.map(|t| (t, Channel::A)) },
            alpha_mode: alpha_mode(json),
            double_sided: json.flag("doubleSided"),
            unlit: json.extension("KHR_materials_unlit").is_some(),
            metallic: self.scalar(pbr, ("metallicFactor", 1.0), ("metallicRoughnessTexture", Channel::B)),
            roughness: self.scalar(pbr, ("roughnessFactor", 1.0), ("metallicRoughnessTexture", Channel::G)),
            normal_map: self.normal_map(json, "normalTexture"),
            emission: self.color(json, emissive, "emissiveTexture"),
            conductor: extras::conductor(json),
            ..Material::new(name)
        }
    }

    fn dielectric(&mut self, json: &Json<'_>, material: &mut Material) {
        material.ior = extension_number(json, "KHR_materials_ior", "ior", 1.5);
        material.dispersion = extension_number(json, "KHR_materials_dispersion", "dispersion", 0.0);
        if let Some(specular) = json.extension("KHR_materials_specular") {
            let texture = ("specularTexture", Channel::A);
            material.specular = self.scalar(specular, ("specularFactor", 1.0), texture);
            let factor = vec3(specular, "specularColorFactor", Vec3::ONE);
            material.specular_color = self.color(specular, factor, "specularColorTexture");
        }
        if let Some(transmission) = json.extension("KHR_materials_transmission") {
            let texture = ("transmissionTexture", Channel::R);
            material.transmission = self.scalar(transmission, ("transmissionFactor", 0.0), texture);
        }
    }

    /// A thickness above zero means that the mesh is the closed surface of a volume. How thick it is follows from the
    /// geometry, so the thickness texture, made for rasterisers, is not read.
    fn volume(&mut self, json: &Json<'_>, material: &mut Material) {
        if let Some(volume) = json.extension("KHR_materials_volume") {
            material.thickness = volume.float("thicknessFactor", 0.0);
            material.attenuation_color = vec3(volume, "attenuationColor", Vec3::ONE);
            material.attenuation_distance = volume.float("attenuationDistance", f32::INFINITY);
        }
    }

    fn coats(&mut self, json: &Json<'_>, material: &mut Material) {
        if let Some(coat) = json.extension("KHR_materials_clearcoat") {
            material.clearcoat =
                self.scalar(coat, ("clearcoatFactor", 0.0), ("clearcoatTexture", Channel::R));
            let texture = ("clearcoatRoughnessTexture", Channel::G);
            material.clearcoat_roughness = self.scalar(coat, ("clearcoatRoughnessFactor", 0.0), texture);
            material.clearcoat_normal_map = self.normal_map(coat, "clearcoatNormalTexture");
        }
        if let Some(sheen) = json.extension("KHR_materials_sheen") {
            let factor = vec3(sheen, "sheenColorFactor", Vec3::ZERO);
            material.sheen_color = self.color(sheen, factor, "sheenColorTexture");
            let texture = ("sheenRoughnessTexture", Channel::A);
            material.sheen_roughness = self.scalar(sheen, ("sheenRoughnessFactor", 0.0), texture);
        }
    }

    fn anisotropy(&mut self, json: &Json<'_>, material: &mut Material) {
        if let Some(anisotropy) = json.extension("KHR_materials_anisotropy") {
            material.anisotropy = anisotropy.float("anisotropyStrength", 0.0);
            material.anisotropy_rotation = anisotropy.float("anisotropyRotation", 0.0);
            material.anisotropy_texture = self.texture(anisotropy, "anisotropyTexture", Encoding::Linear);
        }
    }

    fn iridescence(&mut self, json: &Json<'_>, material: &mut Material) {
        if let Some(film) = json.extension("KHR_materials_iridescence") {
            let texture = ("iridescenceTexture", Channel::R);
            material.iridescence = self.scalar(film, ("iridescenceFactor", 0.0), texture);
            material.iridescence_ior = film.float("iridescenceIor", 1.3);
            material.iridescence_thickness = [
                film.float("iridescenceThicknessMinimum", 100.0),
                film.float("iridescenceThicknessMaximum", 400.0),
            ];
            material.iridescence_thickness_texture =
                self.texture(film, "iridescenceThicknessTexture", Encoding::Linear);
        }
    }
}

fn vec3(json: &Json<'_>, key: &str, default: Vec3) -> Vec3 {
    json.floats(key).map_or(default, Vec3::from_array)
}

fn extension_number(json: &Json<'_>, extension: &str, key: &str, default: f32) -> f32 {
    json.extension(extension).map_or(default, |e| e.float(key, default))
}

fn alpha_mode(json: &Json<'_>) -> AlphaMode {
    match json.at("alphaMode").text() {
        Some("MASK") => AlphaMode::Mask(json.float("alphaCutoff", 0.5)),
        Some("BLEND") => AlphaMode::Blend,
        _ => AlphaMode::Opaque,
    }
}
