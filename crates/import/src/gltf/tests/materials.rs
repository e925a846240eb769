//! Materials, textures, samplers, images.

use super::builder::{Builder, load_bytes};
use crate::{Limits, LoadOptions};
use serde_json::{Value, json};
use vastlight_math::{Vec2, Vec3};
use vastlight_scene::{
    AlphaMode, Channel, ColorInput, Encoding, Filter, Material, ScalarInput, SceneDesc, Texels,
    TextureTransform, Wrap,
};

/// A red PNG of one texel.
const RED: &str = concat!(
    "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAA",
    "DUlEQVR4nGP4z8DwHwAFAAH/iZk9HQAAAABJRU5ErkJggg=="
);

fn with_materials(materials: Value) -> Builder {
    let mut builder = Builder::triangle();
    for set in 0..3 {
        let uvs = builder.floats(&[[0.0_f32, 0.0], [1.0, 0.0], [0.0, 1.0]], "VEC2");
        builder.json["meshes"][0]["primitives"][0]["attributes"][format!("TEXCOORD_{set}")] = json!(uvs);
    }
    builder.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    builder
        .with("materials", materials)
        .with("images", json!([{"uri": RED}, {"uri": RED, "name": "other"}]))
        .with("samplers", json!([{}, {"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}]))
        .with("textures", json!([{"source": 0, "sampler": 0}, {"source": 1, "sampler": 1}]))
}

/// A material with one extension.
fn extended(name: &str, extension: Value) -> Material {
    let mut builder = with_materials(json!([{}]));
    builder.json["materials"][0]["extensions"][name] = extension;
    builder.json["extensionsUsed"] = json!([name]);
    let desc = builder.load_clean();
    assert!(desc.diagnostics.items().is_empty(), "{name}: {:?}", desc.diagnostics);
    desc.materials[0].clone()
}

fn first_material(material: Value) -> (Material, SceneDesc) {
    let desc = with_materials(json!([material])).load_clean();
    (desc.materials[0].clone(), desc)
}

#[test]
fn defaults_are_those_of_the_specification() {
    let (material, desc) = first_material(json!({}));
    assert_eq!(material.base_color, ColorInput::new(Vec3::ONE));
    assert_eq!((material.metallic, material.roughness), (ScalarInput::new(1.0), ScalarInput::new(1.0)));
    assert_eq!(
        (material.alpha_mode, material.double_sided, material.unlit),
        (AlphaMode::Opaque, false, false)
    );
    assert_eq!((material.ior, material.name.as_str()), (1.5, "material 0"));
    assert!(desc.images.is_empty() && desc.textures.is_empty(), "what nothing uses is not kept");
}

#[test]
fn the_base_is_read_with_its_textures() {
    let (material, desc) = first_material(json!({
        "name": "m", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [1, 0.5, 0],
        "emissiveTexture": {"index": 0},
        "normalTexture": {"index": 1, "scale": 0.5, "texCoord": 1},
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "baseColorTexture": {"index": 0},
            "metallicFactor": 0.5, "roughnessFactor": 0.25, "metallicRoughnessTexture": {"index": 0}},
    }));
    assert_eq!((material.alpha_mode, material.double_sided), (AlphaMode::Mask(0.25), true));
    assert_eq!(material.base_color.factor, Vec3::new(0.1, 0.2, 0.3));
    let base = material.base_color.texture.expect("a texture");
    assert_eq!(material.alpha, ScalarInput { factor: 0.4, texture: Some((base, Channel::A)) });
    assert_eq!(material.emission, ColorInput { factor: Vec3::new(1.0, 0.5, 0.0), texture: Some(base) });
    let (metallic, roughness) =
        (material.metallic.texture.expect("blue"), material.roughness.texture.expect("green"));
    assert_eq!((metallic.1, roughness.1, metallic.0), (Channel::B, Channel::G, roughness.0));
    let normal = material.normal_map.expect("a map");
    assert_eq!(normal.scale, 0.5);
    // Colour and numbers of one image are two textures, one image.
    assert_eq!((desc.textures.len(), desc.images.len()), (3, 2));
    assert_eq!(desc.textures[base as usize].encoding, Encoding::Srgb);
    assert_eq!(desc.textures[metallic.0 as usize].encoding, Encoding::Linear);
    let map = desc.textures[normal.texture as usize];
    assert_eq!((map.uv_set, map.wrap, map.filter), (1, [Wrap::Clamp, Wrap::Mirror], Filter::Nearest));
    assert_eq!(desc.images[1].name, "other");
    assert_eq!((desc.images[0].width, desc.images[0].texels.clone()), (1, Texels::U8(vec![255, 0, 0, 255])));
}

#[test]
fn texture_transforms_move_and_choose_coordinates() {
    let mut builder = with_materials(
        json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1,
        "extensions": {"KHR_texture_transform": {"offset": [0.5, 1], "rotation": 0.25, "scale": [2, 3], "texCoord": 2}}}}}]),
    );
    builder.json["extensionsUsed"] = json!(["KHR_texture_transform"]);
    let texture = builder.load_clean().textures[0];
    let transform =
        TextureTransform { offset: Vec2::new(0.5, 1.0), rotation: 0.25, scale: Vec2::new(2.0, 3.0) };
    assert_eq!((texture.uv_set, texture.transform), (2, transform));
}

#[test]
fn glass_is_read_from_its_extensions() {
    let material = extended(
        "KHR_materials_transmission",
        json!({"transmissionFactor": 0.5, "transmissionTexture": {"index": 0}}),
    );
    assert_eq!(material.transmission, ScalarInput { factor: 0.5, texture: Some((0, Channel::R)) });
    assert_eq!(material.thickness, 0.0);
    let volume = json!({"thicknessFactor": 2, "attenuationColor": [1, 0.5, 0], "attenuationDistance": 3});
    let material = extended("KHR_materials_volume", volume);
    assert_eq!((material.thickness, material.attenuation_distance), (2.0, 3.0));
    assert_eq!(material.attenuation_color, Vec3::new(1.0, 0.5, 0.0));
    assert_eq!(extended("KHR_materials_volume", json!({})).attenuation_distance, f32::INFINITY);
    assert_eq!(extended("KHR_materials_ior", json!({"ior": 1.33})).ior, 1.33);
    assert_eq!(extended("KHR_materials_ior", json!({"ior": 0})).ior, 0.0);
    assert_eq!(extended("KHR_materials_dispersion", json!({"dispersion": 0.1})).dispersion, 0.1);
}

#[test]
fn coats_and_cloth_are_read_from_their_extensions() {
    let material = extended(
        "KHR_materials_specular",
        json!({"specularFactor": 0.5, "specularTexture": {"index": 0},
        "specularColorFactor": [2, 1, 0], "specularColorTexture": {"index": 0}}),
    );
    assert_eq!(material.specular.texture.map(|t| t.1), Some(Channel::A));
    assert_eq!(material.specular_color.factor, Vec3::new(2.0, 1.0, 0.0));
    let material = extended(
        "KHR_materials_clearcoat",
        json!({"clearcoatFactor": 0.5, "clearcoatTexture": {"index": 0},
        "clearcoatRoughnessFactor": 0.25, "clearcoatRoughnessTexture": {"index": 0},
        "clearcoatNormalTexture": {"index": 1, "scale": 2}}),
    );
    assert_eq!(material.clearcoat.texture.map(|t| t.1), Some(Channel::R));
    assert_eq!(material.clearcoat_roughness.texture.map(|t| t.1), Some(Channel::G));
    assert_eq!(material.clearcoat_normal_map.map(|n| n.scale), Some(2.0));
    let material = extended(
        "KHR_materials_sheen",
        json!({"sheenColorFactor": [0.1, 0.2, 0.3],
        "sheenRoughnessFactor": 0.5, "sheenRoughnessTexture": {"index": 0}}),
    );
    assert_eq!(material.sheen_color.factor, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!(material.sheen_roughness.texture.map(|t| t.1), Some(Channel::A));
}

#[test]
fn films_grooves_light_and_flatness_are_read_from_their_extensions() {
    let material = extended(
        "KHR_materials_anisotropy",
        json!({"anisotropyStrength": 0.5, "anisotropyRotation": 0.25,
        "anisotropyTexture": {"index": 0}}),
    );
    assert_eq!((material.anisotropy, material.anisotropy_rotation), (0.5, 0.25));
    assert_eq!(material.anisotropy_texture, Some(0));
    let material = extended(
        "KHR_materials_iridescence",
        json!({"iridescenceFactor": 1, "iridescenceIor": 1.8,
        "iridescenceThicknessMinimum": 200, "iridescenceThicknessTexture": {"index": 0}}),
    );
    assert_eq!((material.iridescence.factor, material.iridescence_ior), (1.0, 1.8));
    assert_eq!(material.iridescence_thickness, [200.0, 400.0]);
    assert_eq!(material.iridescence_thickness_texture, Some(0));
    assert!(extended("KHR_materials_unlit", json!({})).unlit);
    let mut builder = with_materials(json!([{"emissiveFactor": [1, 0.5, 0], "extensions":
        {"KHR_materials_emissive_strength": {"emissiveStrength": 8}}}]));
    builder.json["extensionsUsed"] = json!(["KHR_materials_emissive_strength"]);
    assert_eq!(builder.load_clean().materials[0].emission.factor, Vec3::new(8.0, 4.0, 0.0));
}

#[test]
fn values_out_of_range_are_errors_with_their_place() {
    let error = |material: Value| with_materials(json!([material])).error();
    let e = error(json!({"pbrMetallicRoughness": {"roughnessFactor": 1.5}}));
    assert!(e.contains("#/materials/0/pbrMetallicRoughness/roughnessFactor: 1.5 is out of range"), "{e}");
    let e = error(json!({"normalTexture": {"index": 0, "texCoord": 3}}));
    assert!(e.contains("needs TEXCOORD_3"), "{e}");
    let e = error(json!({"normalTexture": {"index": 9}}));
    assert!(e.contains("#/materials/0/normalTexture/index: 9 refers to nothing"), "{e}");
}

#[test]
fn images_that_are_too_large_together_are_one_error() {
    let builder = with_materials(json!([{}]));
    let images = builder.json["images"].as_array().expect("images").len() as u64;
    let load = |all_images_bytes: u64| {
        let limits = Limits { all_images_bytes, ..Limits::default() };
        load_bytes(&builder.glb(), &LoadOptions { limits, ..LoadOptions::default() })
    };
    assert_eq!(load(4 * images).diagnostics.first_error(), None);
    let desc = load(4 * images - 1);
    let errors: Vec<String> = desc.diagnostics.items().iter().map(ToString::to_string).collect();
    assert!(errors.len() == 1 && errors[0].contains("#/images: the images of the scene"), "{errors:?}");
}

#[test]
fn broken_images_are_errors_and_unknown_ones_are_magenta() {
    let mut builder = with_materials(json!([{"emissiveTexture": {"index": 0}}]));
    builder.json["images"][0]["uri"] = json!("data:image/png;base64,iVBORw0KGgoAAAA=");
    assert!(builder.error().contains("#/images/0"));
    builder.json["images"][0]["uri"] = json!("data:image/gif;base64,R0lGODlh");
    let desc = builder.load_clean();
    assert_eq!(desc.images[0].texels, Texels::U8(vec![255, 0, 255]));
    assert!(builder.warnings().iter().any(|w| w.contains("unknown format")));
    builder.json["images"][0]["uri"] = json!("no%20such.png");
    assert!(builder.error().contains("no such.png"));
}
