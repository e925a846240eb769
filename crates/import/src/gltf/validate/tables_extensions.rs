//! The schemas of the extensions that vastlight reads.

use super::schema::Kind::{self, Bool, Map, Number, Numbers, Objects, Reference, Whole, Words};
use super::schema::Range::{self, Above, Min, Within};
use super::schema::{Object, Property, Table, object, opt, req};
use super::tables::{NORMAL_TEXTURE_INFO, TEXTURE_INFO, TO_ACCESSORS, UNIT, reference};
use std::f64::consts::FRAC_PI_2;

const FREE: Range = Range::Any;
const MANY: u64 = u64::MAX;

const fn texture(name: &'static str) -> Property {
    opt(name, Kind::Object(&TEXTURE_INFO))
}

const fn unit(name: &'static str) -> Property {
    opt(name, Number(UNIT))
}

pub(super) static LIGHTS: Object = object(&[req("lights", Objects(&LIGHT))]);

static LIGHT: Object = object(&[
    opt("name", Kind::Text),
    opt("color", Numbers(3, 3, Min(0.0))),
    opt("intensity", Number(Min(0.0))),
    opt("range", Number(Above(0.0))),
    req("type", Words(&["directional", "point", "spot"])),
    opt("spot", Kind::Object(&SPOT)),
]);

static SPOT: Object = object(&[
    opt("innerConeAngle", Number(Within(0.0, FRAC_PI_2 + 1e-6))),
    opt("outerConeAngle", Number(Within(0.0, FRAC_PI_2 + 1e-6))),
]);

pub(super) static NODE_LIGHT: Object = object(&[req("light", Reference(Table::Lights))]);

pub(super) static GPU_INSTANCING: Object = object(&[req("attributes", Map(&TO_ACCESSORS))]);

pub(super) static VISIBILITY: Object = object(&[opt("visible", Bool)]);

pub(super) static TEXTURE_TRANSFORM: Object = object(&[
    opt("offset", Numbers(2, 2, FREE)),
    opt("rotation", Number(FREE)),
    opt("scale", Numbers(2, 2, FREE)),
    opt("texCoord", Whole(0, MANY)),
]);

pub(super) static TEXTURE_SOURCE: Object = object(&[opt("source", reference("images"))]);

pub(super) static FALLBACK: Object = object(&[opt("fallback", Bool)]);

pub(super) static MESHOPT: Object = object(&[
    req("buffer", reference("buffers")),
    opt("byteOffset", Whole(0, MANY)),
    req("byteLength", Whole(1, MANY)),
    req("byteStride", Whole(1, 256)),
    req("count", Whole(1, MANY)),
    req("mode", Words(&["ATTRIBUTES", "TRIANGLES", "INDICES"])),
    opt("filter", Words(&["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"])),
]);

pub(super) static DRACO: Object =
    object(&[req("bufferView", reference("bufferViews")), req("attributes", Map(&DRACO_ATTRIBUTE))]);

static DRACO_ATTRIBUTE: Kind = Whole(0, MANY);

/// Extensions of materials.
pub(super) static OF_MATERIAL: &[(&str, &Object)] = &[
    ("KHR_materials_anisotropy", &ANISOTROPY),
    ("KHR_materials_clearcoat", &CLEARCOAT),
    ("KHR_materials_diffuse_transmission", &DIFFUSE_TRANSMISSION),
    ("KHR_materials_dispersion", &DISPERSION),
    ("KHR_materials_emissive_strength", &EMISSIVE_STRENGTH),
    ("KHR_materials_ior", &IOR),
    ("KHR_materials_iridescence", &IRIDESCENCE),
    ("KHR_materials_sheen", &SHEEN),
    ("KHR_materials_specular", &SPECULAR),
    ("KHR_materials_transmission", &TRANSMISSION),
    ("KHR_materials_unlit", &UNLIT),
    ("KHR_materials_volume", &VOLUME),
];

static ANISOTROPY: Object = object(&[
    unit("anisotropyStrength"),
    opt("anisotropyRotation", Number(FREE)),
    texture("anisotropyTexture"),
]);

static CLEARCOAT: Object = object(&[
    unit("clearcoatFactor"),
    texture("clearcoatTexture"),
    unit("clearcoatRoughnessFactor"),
    texture("clearcoatRoughnessTexture"),
    opt("clearcoatNormalTexture", Kind::Object(&NORMAL_TEXTURE_INFO)),
]);

static DIFFUSE_TRANSMISSION: Object = object(&[
    unit("diffuseTransmissionFactor"),
    texture("diffuseTransmissionTexture"),
    opt("diffuseTransmissionColorFactor", Numbers(3, 3, Min(0.0))),
    texture("diffuseTransmissionColorTexture"),
]);

static DISPERSION: Object = object(&[opt("dispersion", Number(Min(0.0)))]);

static EMISSIVE_STRENGTH: Object = object(&[opt("emissiveStrength", Number(Min(0.0)))]);

static IOR: Object = object(&[opt("ior", Number(Min(0.0)))]);

static IRIDESCENCE: Object = object(&[
    unit("iridescenceFactor"),
    texture("iridescenceTexture"),
    opt("iridescenceIor", Number(Min(1.0))),
    opt("iridescenceThicknessMinimum", Number(Min(0.0))),
    opt("iridescenceThicknessMaximum", Number(Min(0.0))),
    texture("iridescenceThicknessTexture"),
]);

static SHEEN: Object = object(&[
    opt("sheenColorFactor", Numbers(3, 3, UNIT)),
    texture("sheenColorTexture"),
    unit("sheenRoughnessFactor"),
    texture("sheenRoughnessTexture"),
]);

static SPECULAR: Object = object(&[
    unit("specularFactor"),
    texture("specularTexture"),
    opt("specularColorFactor", Numbers(3, 3, Min(0.0))),
    texture("specularColorTexture"),
]);

static TRANSMISSION: Object = object(&[unit("transmissionFactor"), texture("transmissionTexture")]);

static UNLIT: Object = object(&[]);

static VOLUME: Object = object(&[
    opt("thicknessFactor", Number(Min(0.0))),
    texture("thicknessTexture"),
    opt("attenuationDistance", Number(Above(0.0))),
    opt("attenuationColor", Numbers(3, 3, UNIT)),
]);
