//! A material as glTF's metallic-roughness model with KHR extensions.

use super::number::{color_and_strength, number, numbers};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use vastlight_math::Vec3;
use vastlight_scene::{
    AlphaMode, Channel, Diagnostics, Material, NormalMap, ScalarInput, Scene, TextureTransform,
};

/// Names of the extensions that the document uses.
#[derive(Debug, Default)]
pub(super) struct Extensions(BTreeSet<&'static str>);

impl Extensions {
    pub(super) fn add(&mut self, name: &'static str) {
        self.0.insert(name);
    }

    pub(super) fn names(&self) -> Vec<Value> {
        self.0.iter().map(|&name| name.into()).collect()
    }
}

/// Collects one material's JSON.
struct Writer<'a> {
    scene: &'a Scene,
    extensions: &'a mut Extensions,
    lost: &'a mut Diagnostics,
    name: &'a str,
    own: Map<String, Value>,
}

/// The JSON of a material.
pub(super) fn json(
    scene: &Scene,
    material: &Material,
    extensions: &mut Extensions,
    lost: &mut Diagnostics,
) -> Value {
    let mut writer = Writer { scene, extensions, lost, name: &material.name, own: Map::new() };
    let mut value = writer.base(material);
    writer.dielectric(material);
    writer.layers(material);
    if let Some(metal) = material.conductor {
        let metal = json!({"eta": numbers(&metal.eta.to_array()), "k": numbers(&metal.k.to_array())});
        value["extras"] = json!({"vastlight": {"conductor": metal}});
        let what = "glTF holds no measured metal; it stands in the file's extras";
        writer.lost.warn(what, format!("material \"{}\"", writer.name), super::EXTRAS_HINT);
    }
    if !writer.own.is_empty() {
        value["extensions"] = writer.own.into();
    }
    value
}

impl Writer<'_> {
    fn extend(&mut self, name: &'static str, value: Value) {
        self.extensions.add(name);
        self.own.insert(name.into(), value);
    }

    fn lose(&mut self, what: &str) {
        self.lost.warn(what, format!("material \"{}\"", self.name), "");
    }

    /// A textureInfo.
    fn info(&mut self, texture: u32) -> Value {
        let t = self.scene.textures()[texture as usize];
        let mut value = json!({"index": texture});
        if t.uv_set != 0 {
            value["texCoord"] = t.uv_set.into();
        }
        if t.transform != TextureTransform::IDENTITY {
            self.extensions.add("KHR_texture_transform");
            value["extensions"] = json!({"KHR_texture_transform": {
                "offset": numbers(&t.transform.offset.to_array()),
                "rotation": number(t.transform.rotation),
                "scale": numbers(&t.transform.scale.to_array()),
            }});
        }
        value
    }

    fn put_texture(&mut self, value: &mut Value, key: &str, texture: Option<u32>) {
        if let Some(texture) = texture {
            value[key] = self.info(texture);
        }
    }

    /// A factor with a texture that is read from glTF's own channel.
    fn put_scalar(&mut self, value: &mut Value, keys: [&str; 2], input: ScalarInput, channel: Channel) {
        value[keys[0]] = number(input.factor);
        let texture = input.texture.filter(|&(_, c)| c == channel).map(|(t, _)| t);
        if texture.is_none() && input.texture.is_some() {
            self.lose(&format!("glTF reads {} from another channel, so it is left out", keys[1]));
        }
        self.put_texture(value, keys[1], texture);
    }

    fn put_normal_map(&mut self, value: &mut Value, key: &str, map: Option<NormalMap>) {
        if let Some(map) = map {
            let mut info = self.info(map.texture);
            info["scale"] = number(map.scale);
            value[key] = info;
        }
    }

    fn base(&mut self, m: &Material) -> Value {
        let mut pbr =
            json!({"baseColorFactor": numbers(&m.base_color.factor.extend(m.alpha.factor).to_array())});
        self.put_texture(&mut pbr, "baseColorTexture", m.base_color.texture);
        let texture = "metallicRoughnessTexture";
        self.put_scalar(&mut pbr, ["metallicFactor", texture], m.metallic, Channel::B);
        self.put_scalar(&mut pbr, ["roughnessFactor", texture], m.roughness, Channel::G);
        let mut value = json!({"name": m.name, "pbrMetallicRoughness": pbr});
        if m.double_sided {
            value["doubleSided"] = true.into();
        }
        match m.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask(cutoff) => {
                value["alphaMode"] = "MASK".into();
                value["alphaCutoff"] = number(cutoff);
            }
            AlphaMode::Blend => value["alphaMode"] = "BLEND".into(),
        }
        self.put_normal_map(&mut value, "normalTexture", m.normal_map);
        self.emission(&mut value, m);
        if m.unlit {
            self.extend("KHR_materials_unlit", json!({}));
        }
        value
    }

    fn emission(&mut self, value: &mut Value, m: &Material) {
        let emission = m.emission.factor.max(Vec3::ZERO);
        if emission == Vec3::ZERO {
            return;
        }
        let is_bright = emission.max_element() > 1.0;
        let (color, strength) = if is_bright { color_and_strength(emission) } else { (emission, 1.0) };
        value["emissiveFactor"] = numbers(&color.to_array());
        self.put_texture(value, "emissiveTexture", m.emission.texture);
        if is_bright {
            self.extend("KHR_materials_emissive_strength", json!({"emissiveStrength": number(strength)}));
        }
    }

    fn dielectric(&mut self, m: &Material) {
        if m.ior != 1.5 {
            self.extend("KHR_materials_ior", json!({"ior": number(m.ior)}));
        }
        if m.specular != ScalarInput::new(1.0)
            || m.specular_color.factor != Vec3::ONE
            || m.specular_color.texture.is_some()
        {
            let mut value = json!({"specularColorFactor": numbers(&m.specular_color.factor.to_array())});
            self.put_scalar(&mut value, ["specularFactor", "specularTexture"], m.specular, Channel::A);
            self.put_texture(&mut value, "specularColorTexture", m.specular_color.texture);
            self.extend("KHR_materials_specular", value);
        }
        if m.transmission.factor > 0.0 {
            let mut value = json!({});
            let keys = ["transmissionFactor", "transmissionTexture"];
            self.put_scalar(&mut value, keys, m.transmission, Channel::R);
            self.extend("KHR_materials_transmission", value);
        }
        if m.thickness > 0.0 {
            let mut value = json!({"thicknessFactor": number(m.thickness)});
            if m.attenuation_distance.is_finite() {
                value["attenuationColor"] = numbers(&m.attenuation_color.to_array());
                value["attenuationDistance"] = number(m.attenuation_distance);
            }
            self.extend("KHR_materials_volume", value);
        }
        if m.dispersion > 0.0 {
            self.extend("KHR_materials_dispersion", json!({"dispersion": number(m.dispersion)}));
        }
    }

    fn layers(&mut self, m: &Material) {
        if m.clearcoat.factor > 0.0 {
            let mut value = json!({});
            self.put_scalar(&mut value, ["clearcoatFactor", "clearcoatTexture"], m.clearcoat, Channel::R);
            let keys = ["clearcoatRoughnessFactor", "clearcoatRoughnessTexture"];
            self.put_scalar(&mut value, keys, m.clearcoat_roughness, Channel::G);
            self.put_normal_map(&mut value, "clearcoatNormalTexture", m.clearcoat_normal_map);
            self.extend("KHR_materials_clearcoat", value);
        }
        if m.sheen_color.factor != Vec3::ZERO {
            let mut value = json!({"sheenColorFactor": numbers(&m.sheen_color.factor.to_array())});
            self.put_texture(&mut value, "sheenColorTexture", m.sheen_color.texture);
            let keys = ["sheenRoughnessFactor", "sheenRoughnessTexture"];
            self.put_scalar(&mut value, keys, m.sheen_roughness, Channel::A);
            self.extend("KHR_materials_sheen", value);
        }
        if m.anisotropy != 0.0 {
            let mut value = json!({
                "anisotropyStrength": number(m.anisotropy),
                "anisotropyRotation": number(m.anisotropy_rotation),
            });
            self.put_texture(&mut value, "anisotropyTexture", m.anisotropy_texture);
            self.extend("KHR_materials_anisotropy", value);
        }
        if m.iridescence.factor > 0.0 {
            let [low, high] = m.iridescence_thickness;
            let mut value = json!({
                "iridescenceIor": number(m.iridescence_ior),
                "iridescenceThicknessMinimum": number(low),
                "iridescenceThicknessMaximum": number(high),
            });
            let keys = ["iridescenceFactor", "iridescenceTexture"];
            self.put_scalar(&mut value, keys, m.iridescence, Channel::R);
            self.put_texture(&mut value, "iridescenceThicknessTexture", m.iridescence_thickness_texture);
            self.extend("KHR_materials_iridescence", value);
        }
    }
}
