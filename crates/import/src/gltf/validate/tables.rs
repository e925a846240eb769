//! The schema of glTF 2.0 as tables.

use super::schema::Kind::{
    Bool, Codes, Map, Maps, Number, Numbers, Objects, Reference, References, Text, Texts, Whole, Words,
};
use super::schema::Range::{self, Above, Min, Within};
use super::schema::{Kind, Object, Property, Table, extended, object, opt, req};
use super::tables_extensions as ext;

const MANY: u64 = u64::MAX;
const NAME: Property = opt("name", Text);
const FREE: Range = Range::Any;
pub(super) const UNIT: Range = Within(0.0, 1.0);

pub(super) const fn reference(table: &'static str) -> Kind {
    Reference(Table::Root(table))
}

const fn references(table: &'static str) -> Kind {
    References(Table::Root(table))
}

/// The document.
pub(super) static DOCUMENT: Object = extended(
    &[
        opt("extensionsUsed", Texts),
        opt("extensionsRequired", Texts).needs("extensionsUsed"),
        opt("accessors", Objects(&ACCESSOR)),
        opt("animations", Objects(&ANIMATION)),
        req("asset", Kind::Object(&ASSET)),
        opt("buffers", Objects(&BUFFER)),
        opt("bufferViews", Objects(&BUFFER_VIEW)),
        opt("cameras", Objects(&CAMERA)),
        opt("images", Objects(&IMAGE)),
        opt("materials", Objects(&MATERIAL)),
        opt("meshes", Objects(&MESH)),
        opt("nodes", Objects(&NODE)),
        opt("samplers", Objects(&SAMPLER)),
        opt("scene", reference("scenes")),
        opt("scenes", Objects(&SCENE)),
        opt("skins", Objects(&SKIN)),
        opt("textures", Objects(&TEXTURE)),
    ],
    &[("KHR_lights_punctual", &ext::LIGHTS)],
);

static ASSET: Object =
    object(&[opt("copyright", Text), opt("generator", Text), req("version", Text), opt("minVersion", Text)]);

const COMPONENT_TYPES: &[u32] = &[5120, 5121, 5122, 5123, 5125, 5126];

static ACCESSOR: Object = object(&[
    NAME,
    opt("bufferView", reference("bufferViews")),
    opt("byteOffset", Whole(0, MANY)).needs("bufferView"),
    req("componentType", Codes(COMPONENT_TYPES)),
    opt("normalized", Bool),
    req("count", Whole(1, MANY)),
    req("type", Words(&["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"])),
    opt("max", Numbers(1, 16, FREE)),
    opt("min", Numbers(1, 16, FREE)),
    opt("sparse", Kind::Object(&SPARSE)),
]);

static SPARSE: Object = object(&[
    req("count", Whole(1, MANY)),
    req("indices", Kind::Object(&SPARSE_INDICES)),
    req("values", Kind::Object(&SPARSE_VALUES)),
]);

static SPARSE_INDICES: Object = object(&[
    req("bufferView", reference("bufferViews")),
    opt("byteOffset", Whole(0, MANY)),
    req("componentType", Codes(&[5121, 5123, 5125])),
]);

static SPARSE_VALUES: Object =
    object(&[req("bufferView", reference("bufferViews")), opt("byteOffset", Whole(0, MANY))]);

static ANIMATION: Object =
    object(&[NAME, req("channels", Objects(&CHANNEL)), req("samplers", Objects(&ANIMATION_SAMPLER))]);

static CHANNEL: Object =
    object(&[req("sampler", Reference(Table::Local)), req("target", Kind::Object(&TARGET))]);

static TARGET: Object = object(&[
    opt("node", reference("nodes")),
    req("path", Words(&["translation", "rotation", "scale", "weights", "pointer"])),
]);

static ANIMATION_SAMPLER: Object = object(&[
    req("input", reference("accessors")),
    opt("interpolation", Words(&["LINEAR", "STEP", "CUBICSPLINE"])),
    req("output", reference("accessors")),
]);

static BUFFER: Object = extended(
    &[NAME, opt("uri", Text), req("byteLength", Whole(1, MANY))],
    &[("EXT_meshopt_compression", &ext::FALLBACK), ("KHR_meshopt_compression", &ext::FALLBACK)],
);

static BUFFER_VIEW: Object = extended(
    &[
        NAME,
        req("buffer", reference("buffers")),
        opt("byteOffset", Whole(0, MANY)),
        req("byteLength", Whole(1, MANY)),
        opt("byteStride", Whole(4, 252)),
        opt("target", Codes(&[34962, 34963])),
    ],
    &[("EXT_meshopt_compression", &ext::MESHOPT), ("KHR_meshopt_compression", &ext::MESHOPT)],
);

static CAMERA: Object = object(&[
    NAME,
    req("type", Words(&["perspective", "orthographic"])),
    opt("perspective", Kind::Object(&PERSPECTIVE)),
    opt("orthographic", Kind::Object(&ORTHOGRAPHIC)),
]);

static PERSPECTIVE: Object = object(&[
    opt("aspectRatio", Number(Above(0.0))),
    req("yfov", Number(Above(0.0))),
    opt("zfar", Number(Above(0.0))),
    req("znear", Number(Above(0.0))),
]);

static ORTHOGRAPHIC: Object = object(&[
    req("xmag", Number(FREE)),
    req("ymag", Number(FREE)),
    req("zfar", Number(Above(0.0))),
    req("znear", Number(Min(0.0))),
]);

static IMAGE: Object = object(&[
    NAME,
    opt("uri", Text),
    opt("mimeType", Words(&["image/jpeg", "image/png", "image/webp", "image/ktx2"])),
    opt("bufferView", reference("bufferViews")).needs("mimeType"),
]);

const TRANSFORM: (&str, &Object) = ("KHR_texture_transform", &ext::TEXTURE_TRANSFORM);

/// `textureInfo`.
pub(super) static TEXTURE_INFO: Object =
    extended(&[req("index", reference("textures")), opt("texCoord", Whole(0, MANY))], &[TRANSFORM]);

/// `material.normalTextureInfo`.
pub(super) static NORMAL_TEXTURE_INFO: Object = extended(
    &[req("index", reference("textures")), opt("texCoord", Whole(0, MANY)), opt("scale", Number(FREE))],
    &[TRANSFORM],
);

static OCCLUSION_TEXTURE_INFO: Object = extended(
    &[req("index", reference("textures")), opt("texCoord", Whole(0, MANY)), opt("strength", Number(UNIT))],
    &[TRANSFORM],
);

static MATERIAL: Object = extended(
    &[
        NAME,
        opt("pbrMetallicRoughness", Kind::Object(&METALLIC_ROUGHNESS)),
        opt("normalTexture", Kind::Object(&NORMAL_TEXTURE_INFO)),
        opt("occlusionTexture", Kind::Object(&OCCLUSION_TEXTURE_INFO)),
        opt("emissiveTexture", Kind::Object(&TEXTURE_INFO)),
        opt("emissiveFactor", Numbers(3, 3, UNIT)),
        opt("alphaMode", Words(&["OPAQUE", "MASK", "BLEND"])),
        opt("alphaCutoff", Number(Min(0.0))),
        opt("doubleSided", Bool),
    ],
    ext::OF_MATERIAL,
);

static METALLIC_ROUGHNESS: Object = object(&[
    opt("baseColorFactor", Numbers(4, 4, UNIT)),
    opt("baseColorTexture", Kind::Object(&TEXTURE_INFO)),
    opt("metallicFactor", Number(UNIT)),
    opt("roughnessFactor", Number(UNIT)),
    opt("metallicRoughnessTexture", Kind::Object(&TEXTURE_INFO)),
]);

static MESH: Object =
    object(&[NAME, req("primitives", Objects(&PRIMITIVE)), opt("weights", Numbers(1, usize::MAX, FREE))]);

/// A map from names to accessors.
pub(super) static TO_ACCESSORS: Kind = Reference(Table::Root("accessors"));

static PRIMITIVE: Object = extended(
    &[
        req("attributes", Map(&TO_ACCESSORS)),
        opt("indices", reference("accessors")),
        opt("material", reference("materials")),
        opt("mode", Codes(&[0, 1, 2, 3, 4, 5, 6])),
        opt("targets", Maps(&TO_ACCESSORS)),
    ],
    &[("KHR_draco_mesh_compression", &ext::DRACO)],
);

static NODE: Object = extended(
    &[
        NAME,
        opt("camera", reference("cameras")),
        opt("children", references("nodes")),
        opt("skin", reference("skins")).needs("mesh"),
        opt("matrix", Numbers(16, 16, FREE)),
        opt("mesh", reference("meshes")),
        opt("rotation", Numbers(4, 4, Within(-1.0, 1.0))),
        opt("scale", Numbers(3, 3, FREE)),
        opt("translation", Numbers(3, 3, FREE)),
        opt("weights", Numbers(1, usize::MAX, FREE)).needs("mesh"),
    ],
    &[
        ("KHR_lights_punctual", &ext::NODE_LIGHT),
        ("EXT_mesh_gpu_instancing", &ext::GPU_INSTANCING),
        ("KHR_node_visibility", &ext::VISIBILITY),
    ],
);

static SAMPLER: Object = object(&[
    NAME,
    opt("magFilter", Codes(&[9728, 9729])),
    opt("minFilter", Codes(&[9728, 9729, 9984, 9985, 9986, 9987])),
    opt("wrapS", Codes(WRAPS)),
    opt("wrapT", Codes(WRAPS)),
]);

const WRAPS: &[u32] = &[33071, 33648, 10497];

static SCENE: Object = object(&[NAME, opt("nodes", references("nodes"))]);

static SKIN: Object = object(&[
    NAME,
    opt("inverseBindMatrices", reference("accessors")),
    opt("skeleton", reference("nodes")),
    req("joints", references("nodes")),
]);

static TEXTURE: Object = extended(
    &[NAME, opt("sampler", reference("samplers")), opt("source", reference("images"))],
    &[("KHR_texture_basisu", &ext::TEXTURE_SOURCE), ("EXT_texture_webp", &ext::TEXTURE_SOURCE)],
);
