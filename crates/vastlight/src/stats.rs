//! What a render was and what it cost, for `--stats`.

use serde::Serialize;
use vastlight_gpu::page::PageStats;
use vastlight_paging::PageCache;
use vastlight_scene::Scene;
use vastlight_trace::paged::Caches;

/// How a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// Every sample was taken, or all parts of the picture are done by their noise.
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

/// What the caches of a scene in a store did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PagingStats {
    /// Pages of geometry.
    pub geometry: CacheCounts,
    /// Pages of attributes.
    pub attributes: CacheCounts,
    /// Tiles of textures, if there are any.
    pub tiles: Option<CacheCounts>,
}

/// What of a store is in memory, while a picture is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Residency {
    /// Bytes of the caches that hold pages.
    pub resident_bytes: u64,
    /// Bytes of the store.
    pub store_bytes: u64,
    /// Bytes read so far.
    pub bytes_read: u64,
}

impl Residency {
    /// That of caches over a store of so many bytes.
    pub(crate) fn new(caches: &Caches, store_bytes: u64) -> Self {
        let all = [Some(&caches.geometry), Some(&caches.attributes), caches.tiles.as_ref()];
        let mut sum = Self { resident_bytes: 0, store_bytes, bytes_read: 0 };
        for cache in all.into_iter().flatten() {
            let stats = cache.stats();
            sum.resident_bytes += (stats.resident_pages * cache.config().slot_bytes) as u64;
            sum.bytes_read += stats.bytes_read;
        }
        sum
    }
}

/// What a cache did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CacheCounts {
    /// Uses of pages that were in memory.
    pub hits: u64,
    /// Pages that were asked for and not in memory.
    pub misses: u64,
    /// Pages that left the cache.
    pub evictions: u64,
    /// Reads of the store.
    pub reads: u64,
    /// Bytes read.
    pub bytes_read: u64,
    /// Time that batches waited, milliseconds, all together.
    pub stall_ms: f64,
    /// Pages in memory at the end.
    pub resident_pages: u64,
}

impl CacheCounts {
    fn since(&self, earlier: &Self) -> Self {
        Self {
            hits: self.hits - earlier.hits,
            misses: self.misses - earlier.misses,
            evictions: self.evictions - earlier.evictions,
            reads: self.reads - earlier.reads,
            bytes_read: self.bytes_read - earlier.bytes_read,
            stall_ms: self.stall_ms - earlier.stall_ms,
            resident_pages: self.resident_pages,
        }
    }

    /// The part of all uses of pages that found them in memory; 1 where there were none.
    #[must_use]
    pub fn hit_rate(&self) -> f64 {
        let uses = self.hits + self.misses;
        if uses == 0 { 1.0 } else { self.hits as f64 / uses as f64 }
    }
}

impl PagingStats {
    /// What the caches have done so far.
    #[must_use]
    pub fn new(caches: &Caches) -> Self {
        let counts = |cache: &PageCache| {
            let stats = cache.stats();
            CacheCounts {
                hits: stats.hits,
                misses: stats.misses,
                evictions: stats.evictions,
                reads: stats.reads,
                bytes_read: stats.bytes_read,
                stall_ms: stats.stall.as_secs_f64() * 1e3,
                resident_pages: stats.resident_pages as u64,
            }
        };
        Self {
            geometry: counts(&caches.geometry),
            attributes: counts(&caches.attributes),
            tiles: caches.tiles.as_ref().map(counts),
        }
    }

    /// What they did after `earlier`.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> Self {
        Self {
            geometry: self.geometry.since(&earlier.geometry),
            attributes: self.attributes.since(&earlier.attributes),
            tiles: self.tiles.as_ref().zip(earlier.tiles.as_ref()).map(|(now, then)| now.since(then)),
        }
    }
}

/// What a render was and what it cost. Times are milliseconds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stats {
    /// The device: `cpu` or `gpu`.
    pub device: &'static str,
    /// The graphics processor, where one rendered.
    pub adapter: Option<String>,
    /// Why the CPU rendered where a graphics processor was to.
    pub fallback: Option<String>,
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
    /// Samples of a pixel in the mean over all pixels: with `noise` more than `spp_done`.
    pub spp_mean: f64,
    /// The error at which parts of the picture were done, if that was asked for.
    pub noise: Option<f32>,
    /// Passes finished, of one sample a pixel each, resumed ones included.
    pub passes: u32,
    /// Whole passes that a checkpoint brought.
    pub resumed_passes: u32,
    /// Samples that a checkpoint brought, all pixels together.
    pub resumed_samples: u64,
    /// How it ended.
    pub ending: Ending,
    /// Samples taken, all pixels together; these and the rays include what a checkpoint brought.
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
    /// What the page caches did, for a scene in a store.
    pub paging: Option<PagingStats>,
    /// What was brought to the graphics processor, where one rendered.
    pub gpu_paging: Option<PageStats>,
}
