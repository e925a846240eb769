//! Numbers that Rust and WGSL both have, compared by their names.

use super::stream::{COUNTERS, RAY_FIELDS, RAYS, SHADOW_RAYS, SLOTS, SUM_WORDS};
use super::{PATH_FIELDS, SAMPLE_FIELDS, SHADOWS, sample_of};
use crate::kernel::{Kernel, all};
use std::collections::{BTreeMap, BTreeSet};
use vastlight_trace::words::{self as traced, header};
use vastlight_transport::photon::{GridPass, PHOTON_WORDS, VoxelGrid};
use vastlight_transport::words::materials::{flags, input};
use vastlight_transport::words::{camera, geometry, lights, materials, pages, tables, textures};

/// Numbers of a module, by the names that they have in WGSL.
macro_rules! named {
    ($prefix:literal, $module:ident: $($name:ident)+) => {
        vec![$((concat!($prefix, stringify!($name)).to_owned(), $module::$name as u32)),+]
    };
}

/// Beginnings of names that all are places in tables.
const PLACES: [&str; 9] =
    ["TABLES_", "MATERIAL_", "FLAG_", "INPUT_", "TEXTURE_", "GEOMETRY_", "CAMERA_", "TREE_", "SAMPLE_"];
/// Names that begin so and are something else.
const NO_PLACES: [&str; 1] = ["CAMERA_DIMENSIONS"];

/// All numbers that Rust writes or reads, by their names in WGSL.
fn numbers() -> Vec<(String, u32)> {
    let mut all = Vec::new();
    all.extend(named!("TABLES_", tables: ALBEDO MATERIALS INSTANCES TEXTURES MESHES CAMERA SRGB BLOCKS STARTS FIRST_ATTRIBUTES));
    all.extend(named!("MATERIAL_", materials: WORDS UV_SETS IOR ATTENUATION CONDUCTOR DISPERSION ANISOTROPY
        ANISOTROPY_DIRECTION IRIDESCENCE_IOR THICKNESS CUTOFF NORMAL_SCALES INPUTS INPUT_WORDS EXACT ALL_INPUTS));
    all.extend(
        named!("FLAG_", flags: UNLIT TWO_SIDED NEEDS_TANGENT ALPHA MASK PANE THIN CONDUCTOR NORMAL_MAP
        COAT_NORMAL_MAP ANISOTROPY_TEXTURE THICKNESS_TEXTURE CLEAR),
    );
    all.extend(
        named!("INPUT_", input: ALPHA BASE_COLOR METALLIC ROUGHNESS TRANSMISSION SPECULAR SPECULAR_COLOR
        CLEARCOAT CLEARCOAT_ROUGHNESS SHEEN_COLOR SHEEN_ROUGHNESS IRIDESCENCE THICKNESS ANISOTROPY NORMAL
        COAT_NORMAL EMISSION),
    );
    all.extend(named!("TEXTURE_", textures: WORDS MATRIX TEXELS WRAP NEAREST SRGB UV_SET LEVELS LEVEL_COUNT
        LEVEL_WORDS));
    all.extend(
        named!("GEOMETRY_", geometry: MESH_WORDS ATTRIBUTES UNSCALE FIRST_BLOCK PARTS PART_COUNT VEILED INSTANCE_WORDS MAP NORMAL_MAP HANDEDNESS NORM MESH),
    );
    all.extend(named!("CAMERA_", camera: MAP SCALE AXIS LENS ORTHOGRAPHIC CONE FILTER));
    all.extend(named!("TREE_", header: ROOT INSTANCES EXTENT MARGIN PAGE_SHIFT ITEMS BOXES));
    all.extend(named!("", traced: INSTANCE_WORDS KD_NODE_WORDS KD_BLOCK_WORDS LEAF));
    all.extend(named!("LIGHT_", lights: CONSTANT IMAGE SKY));
    all.extend(lights::PLACES.map(|(name, place)| (format!("LIGHT_{name}"), place as u32)));
    all.extend(sample_places().map(|(name, place)| (format!("SAMPLE_{name}"), place)));
    all.extend(
        [
            ("NODE_WORDS_OF_TREE", traced::NODE_WORDS as u32),
            ("GEOMETRY_BLOCK", pages::BLOCK as u32),
            ("LEVEL_IN_A_ROW", textures::IN_A_ROW),
            ("PAGE_WORDS", crate::page::PAGE_WORDS as u32),
            ("MOST_USES", crate::page::MOST_USES),
            ("PATH_FIELDS", PATH_FIELDS),
            ("SHADOWS", SHADOWS),
            ("PHOTON_WORDS", PHOTON_WORDS as u32),
            ("RECTANGLE_WORDS", GridPass::RECTANGLE_WORDS as u32),
            ("GRID_WORDS", VoxelGrid::WORDS as u32),
            ("STREAM_FIELDS", RAY_FIELDS),
            ("SUM_FIRST", COUNTERS),
            ("SUM_WORDS", SUM_WORDS),
            ("SLOTS", SLOTS),
            ("RAYS", RAYS),
            ("SHADOW_RAYS", SHADOW_RAYS),
        ]
        .map(|(name, number)| (name.to_owned(), number)),
    );
    all
}

/// From which word of a path each field of a sample is read.
fn sample_places() -> [(&'static str, u32); 8] {
    let sample = sample_of(|field| SAMPLE_FIELDS + field as u32);
    [
        ("RADIANCE", sample.radiance.x.to_bits()),
        ("ALBEDO", sample.albedo.x.to_bits()),
        ("NORMAL", sample.normal.x.to_bits()),
        ("POSITION", sample.position.x.to_bits()),
        ("DEPTH", sample.depth.to_bits()),
        ("COVERAGE", sample.coverage.to_bits()),
        ("OBJECT", sample.object),
        ("MATERIAL", sample.material),
    ]
}

/// The name and value of a line `const NAME: u32 = VALUE;`.
fn constant(line: &str) -> Option<(&str, u32)> {
    let (name, value) = line.strip_prefix("const ")?.strip_suffix("u;")?.split_once(": u32 = ")?;
    let value = value.strip_prefix("0x").map_or_else(|| value.parse(), |hex| u32::from_str_radix(hex, 16));
    Some((name, value.ok()?))
}

/// What a constant is in the kernels that have it.
fn constants(texts: &[String]) -> BTreeMap<&str, BTreeSet<u32>> {
    let mut found: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
    for (name, value) in texts.iter().flat_map(|text| text.lines()).filter_map(constant) {
        found.entry(name).or_default().insert(value);
    }
    found
}

/// Names whose numbers differ, and of places that Rust does not know.
fn differing(texts: &[String]) -> Vec<String> {
    let (mut found, mut differ) = (constants(texts), Vec::new());
    for (name, number) in numbers() {
        if found.remove(name.as_str()) != Some(BTreeSet::from([number])) {
            differ.push(name);
        }
    }
    let is_place =
        |name: &&str| PLACES.iter().any(|begin| name.starts_with(begin)) && !NO_PLACES.contains(name);
    differ.extend(found.into_keys().filter(is_place).map(str::to_owned));
    differ
}

#[test]
fn numbers_are_the_same_in_rust_and_in_kernels() {
    let mut texts: Vec<String> = all().into_iter().map(Kernel::wgsl).collect();
    assert_eq!(differing(&texts), [""; 0]);
    // What differs in one kernel alone, or is not known, is found.
    let shade = texts.iter().position(|text| text.contains("const RANDOM_WAVELENGTH")).expect("a kernel");
    texts[shade] = texts[shade].replace("FLAG_THIN: u32 = 64u", "FLAG_THIN: u32 = 65u");
    texts[shade].push_str("const CAMERA_NEW: u32 = 0x1fu;\n");
    assert_eq!(differing(&texts), ["FLAG_THIN", "CAMERA_NEW"]);
}
