//! What a render was and what it cost, for `--stats`.

use serde::Serialize;
use vastlight_scene::Scene;

/// How a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// Every sample was taken.
    Complete,
    /// The time limit came first.
    TimeLimit,
    /// It was cancelled.
    Interrupted,
}

/// Sizes of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SceneCounts {
    /// Meshes.
    pub meshes: usize,
    /// Placements of meshes.
    pub instances: usize,
    /// Triangles, each mesh once.
    pub unique_triangles: u64,
    /// Triangles in all instances.
    pub instanced_triangles: u64,
    /// Materials.
    pub materials: usize,
    /// Textures.
    pub textures: usize,
    /// Lights without surface.
    pub lights: usize,
    /// Cameras.
    pub cameras: usize,
}

impl SceneCounts {
    /// Counts a scene.
    #[must_use]
    pub fn new(scene: &Scene) -> Self {
        Self {
            meshes: scene.meshes().len(),
            instances: scene.instances().len(),
            unique_triangles: scene.unique_triangles(),
            instanced_triangles: scene.instanced_triangles(),
            materials: scene.materials().len(),
            textures: scene.textures().len(),
            lights: scene.lights().len(),
            cameras: scene.cameras().len(),
        }
    }
}

/// What a render was and what it cost. Times are milliseconds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stats {
    /// The device: `cpu`.
    pub device: &'static str,
    /// The SIMD level that the tracer used.
    pub simd: &'static str,
    /// Threads that rendered.
    pub threads: usize,
    /// The scene's sizes.
    pub scene: SceneCounts,
    /// Picture width, pixels.
    pub width: u32,
    /// Picture height, pixels.
    pub height: u32,
    /// Samples asked for, a pixel.
    pub spp: u32,
    /// Samples that every pixel has.
    pub spp_done: u32,
    /// Passes finished.
    pub passes: u32,
    /// How it ended.
    pub ending: Ending,
    /// Samples taken, all pixels together.
    pub samples: u64,
    /// Samples dropped because they were not finite.
    pub non_finite: u64,
    /// Closest-hit rays.
    pub rays: u64,
    /// Occlusion rays.
    pub shadow_rays: u64,
    /// Building the acceleration structure.
    pub build_ms: f64,
    /// Preparing lights and materials.
    pub prepare_ms: f64,
    /// From the start of rendering to the end of the first pass.
    pub first_pass_ms: f64,
    /// Rendering, without building and preparing.
    pub render_ms: f64,
    /// Million samples a second of rendering.
    pub msamples_per_s: f64,
    /// Bytes that the acceleration structure keeps.
    pub structure_bytes: u64,
    /// Largest resident set of the process so far; `None` where the system does not say.
    pub peak_rss_bytes: Option<u64>,
}
