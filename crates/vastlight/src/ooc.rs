//! What rendering out of core costs: frames of a scene in a store through caches of several sizes.

use crate::ids::Ids;
use crate::render::{frame, tracer_of};
use crate::stats::PagingStats;
use crate::{Control, Error, OpenScene, RenderRequest, paged};
use vastlight_trace::Tracer;
use vastlight_transport::{Lights, MaterialTable, Renderer};

/// A frame through caches of one size.
#[derive(Clone, Debug, PartialEq)]
pub struct OocFigures {
    /// The part of all pages that may be in memory at once.
    pub cache_fraction: f32,
    /// The first frame, milliseconds: nothing is in memory yet.
    pub cold_ms: f64,
    /// The best of the frames after it, milliseconds.
    pub frame_ms: f64,
    /// Rays of a frame, shadow rays included.
    pub rays: u64,
    /// Lookups in textures in tiles in the last frame, milliseconds, all threads together, without waiting.
    pub filter_ms: f64,
    /// Memory of what is above the pages, instances included.
    pub structure_bytes: u64,
    /// What the caches did in the last frame.
    pub paging: PagingStats,
}

/// Renders frames of `request` through caches of each of `fractions` of the pages: one frame to fill the cache, then
/// `repeat` more. `each` is told the figures of a size as soon as they are there. On the threads of the current rayon pool.
///
/// # Errors
/// If the scene is not in a store, or a page cannot be had.
pub fn measure_ooc(
    open: &OpenScene,
    request: &RenderRequest,
    fractions: &[f32],
    repeat: u32,
    control: &Control<'_>,
    mut each: impl FnMut(&OocFigures) + Send,
) -> Result<(), Error> {
    paged::kept_pool(&mut None, &request.paging)?.install(|| {
        let tracer = tracer_of(open, request)?;
        let materials = open.materials();
        let lights = Lights::new(&open.scene, &materials);
        let parts = Parts { open, request, control, tracer: &tracer, materials: &materials, lights: &lights };
        fractions.iter().try_for_each(|&fraction| {
            each(&parts.measure(fraction, repeat)?);
            Ok(())
        })
    })
}

/// What all sizes share.
struct Parts<'a> {
    open: &'a OpenScene,
    request: &'a RenderRequest,
    control: &'a Control<'a>,
    tracer: &'a Tracer,
    materials: &'a MaterialTable<'a>,
    lights: &'a Lights<'a>,
}

impl Parts<'_> {
    fn measure(&self, cache_fraction: f32, repeat: u32) -> Result<OocFigures, Error> {
        let Self { open, request, control, tracer, materials, lights } = self;
        let mut request = (*request).clone();
        request.paging.cache_fraction = Some(cache_fraction);
        let request = &request;
        let Some(stored) = &open.stored else {
            return Err(Error::usage("the scene is in memory", "", "pack it to a store first"));
        };
        let caches = paged::caches((stored, open.triangles_beside_pages()), request, materials.most_tiles())?;
        let renderer = Renderer::new(&open.scene, tracer, materials, lights, request.settings.clone());
        let renderer = renderer.with_pages(paged::through(stored, &caches, &request.paging));
        let ids = Ids::new(&open.scene, &[]);
        let (_, cold_ms) = frame(&renderer, &ids, request, control)?;
        let mut figures = None;
        for _ in 0..repeat.max(1) {
            let before = PagingStats::new(&caches);
            let (cost, frame_ms) = frame(&renderer, &ids, request, control)?;
            let paging = PagingStats::new(&caches).since(&before);
            let rays = cost.rays + cost.shadow_rays;
            let best = figures.as_ref().map_or(f64::INFINITY, |f: &OocFigures| f.frame_ms);
            let frame_ms = frame_ms.min(best);
            let waited = paging.tiles.as_ref().map_or(0.0, |tiles| tiles.stall_ms);
            let filter_ms = (cost.tile_ns as f64 * 1e-6 - waited).max(0.0);
            let structure_bytes = tracer.report().bytes;
            figures = Some(OocFigures {
                cache_fraction,
                cold_ms,
                frame_ms,
                rays,
                filter_ms,
                structure_bytes,
                paging,
            });
        }
        figures.ok_or_else(|| Error::usage("nothing was measured", "", ""))
    }
}
