//! Places in the header of the binding `lights`, which [`Lights::pack`](crate::Lights::pack) fills.
//!
//! How a section lies is told where it is written: the functions `pack` of the files of `light`.

/// The tree of the lights at a place: where its nodes start, and how many lights a list has (all bits for a tree).
pub const TREE: usize = 0;
/// Ways from the root to the emissive triangles, two words each.
pub const TRAILS: usize = 2;
/// Emissive triangles, times instances, 16 words each.
pub const SURFACES: usize = 3;
/// How many they are.
pub const SURFACE_COUNT: usize = 4;
/// Point and spot lights, 20 words each.
pub const PUNCTUAL: usize = 5;
/// Meshes with emissive triangles, 10 words each, by their first instance.
pub const MESHES: usize = 6;
/// How many they are.
pub const MESH_COUNT: usize = 7;
/// The background.
pub const BACKGROUND: usize = 8;
/// What it is: [`CONSTANT`], [`IMAGE`] or [`SKY`].
pub const BACKGROUND_KIND: usize = 9;
/// Mean luminance of its upper and its lower half.
pub const MEANS: usize = 10;
/// The sun's disc; 0 if there is none.
pub const SUN: usize = 12;
/// Directional lights, seven words each.
pub const DIRECTIONAL: usize = 13;
/// How many they are.
pub const DIRECTIONAL_COUNT: usize = 14;
/// Words of the header.
pub const HEADER: usize = 15;

/// The same radiance from everywhere.
pub const CONSTANT: u32 = 0;
/// A latitude-longitude map.
pub const IMAGE: u32 = 1;
/// The procedural sky.
pub const SKY: u32 = 2;

/// Names of the places in WGSL, without `LIGHT_`.
pub const PLACES: [(&str, usize); 13] = [
    ("TREE", TREE),
    ("TRAILS", TRAILS),
    ("SURFACES", SURFACES),
    ("SURFACE_COUNT", SURFACE_COUNT),
    ("PUNCTUAL", PUNCTUAL),
    ("MESHES", MESHES),
    ("MESH_COUNT", MESH_COUNT),
    ("BACKGROUND", BACKGROUND),
    ("BACKGROUND_KIND", BACKGROUND_KIND),
    ("MEANS", MEANS),
    ("SUN", SUN),
    ("DIRECTIONAL", DIRECTIONAL),
    ("DIRECTIONAL_COUNT", DIRECTIONAL_COUNT),
];
