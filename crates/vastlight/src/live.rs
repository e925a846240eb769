//! A scene made ready for pictures from any place: structures, materials and lights are prepared once, and pictures grow in pieces
//! as short as the caller likes.

use crate::ids::Ids;
use crate::render::film_settings;
use crate::run::TileSink;
use crate::stats::PagingStats;
use crate::{Error, OpenScene, RenderRequest, Residency, device::Tiles, paged, shutter};
use rayon::prelude::*;
use std::time::{Duration, Instant};
use vastlight_film::{Film, FilmTile, Picture, Window};
use vastlight_math::{Aabb, Vec3};
use vastlight_scene::Scene;
use vastlight_trace::paged::Caches;
use vastlight_trace::{Hit, HitFilter, Tracer};
use vastlight_transport::photon::{PhotonMaps, PhotonPlan};
use vastlight_transport::{
    Integrator, Lights, MaterialTable, RenderSettings, RenderStats, Renderer, Sample, Tile,
};

/// Largest edge of a tile of a scene in pages: a tile that is begun is finished, however eagerly somebody waits.
const LARGEST_TILE: u32 = 64;

/// What a live scene is made of.
pub(crate) struct LiveParts<'s> {
    pub(crate) open: &'s OpenScene,
    pub(crate) tracer: &'s Tracer,
    pub(crate) materials: &'s MaterialTable<'s>,
    pub(crate) caches: Option<&'s Caches>,
}

impl LiveParts<'_> {
    /// Prepares lights, and hands all to `body`. The work began at `start`; `build` went to structures.
    pub(crate) fn with_live<R>(
        self,
        request: &RenderRequest,
        (start, build): (Instant, Duration),
        body: impl FnOnce(&mut Live<'_>) -> R,
    ) -> Result<R, Error> {
        let Self { open, tracer, materials, caches } = self;
        let lights = Lights::new(&open.scene, materials);
        let renderer = Renderer::new(&open.scene, tracer, materials, &lights, request.settings.clone());
        let renderer = match (&open.stored, caches) {
            (Some(stored), Some(caches)) => {
                renderer.with_pages(paged::through(stored, caches, &request.paging))
            }
            _ => renderer,
        };
        let store_bytes = open.stored.as_ref().and_then(|stored| stored.source.bytes().ok()).unwrap_or(0);
        let prepare = start.elapsed().saturating_sub(build);
        Ok(body(&mut Live { scene: &open.scene, renderer, caches, store_bytes, build, prepare }))
    }
}

/// A scene that is ready for pictures.
#[derive(Debug)]
pub struct Live<'s> {
    scene: &'s Scene,
    renderer: Renderer<'s>,
    caches: Option<&'s Caches>,
    store_bytes: u64,
    build: Duration,
    prepare: Duration,
}

/// A picture that grows: every pixel gets sample after sample, tile by tile. The sums are those of
/// [`render`](crate::render()) with as many samples.
#[derive(Debug)]
pub struct LivePicture {
    request: RenderRequest,
    ids: Ids,
    film: Film,
    /// By tile, the samples that its pixels have.
    done: Vec<u32>,
    /// By tile, whether it is to go on and counts.
    wanted: Vec<bool>,
    plan: Option<PhotonPlan>,
    /// The photons of the sample that is under way, by its number.
    photons: Option<(u32, PhotonMaps)>,
    cost: RenderStats,
}

impl LivePicture {
    /// Samples of the tiles that count.
    fn counted(&self) -> impl Iterator<Item = u32> {
        self.done.iter().zip(&self.wanted).filter(|(_, wanted)| **wanted).map(|(&done, _)| done)
    }

    /// Samples that every pixel has, of those to which the picture is limited.
    #[must_use]
    pub fn spp(&self) -> u32 {
        self.counted().min().unwrap_or(0)
    }

    /// Whether all of these have as many samples: no piece is under way.
    #[must_use]
    pub fn is_even(&self) -> bool {
        let spp = self.spp();
        self.counted().all(|done| done == spp)
    }

    /// Limits what comes to the tiles that have a part of a rectangle; the others keep what they have. None for all tiles again, and so
    /// is a rectangle outside of the picture.
    pub fn limit(&mut self, region: Option<Tile>) {
        let meets = |tile: &FilmTile, Tile { min, max }: Tile| {
            let Window { x0, y0, x1, y1 } = tile.window();
            x0 < max[0] && min[0] < x1 && y0 < max[1] && min[1] < y1
        };
        let is_wanted = |tile: &FilmTile| region.is_none_or(|region| meets(tile, region));
        self.wanted = self.film.tiles_mut().iter().map(is_wanted).collect();
        if !self.wanted.contains(&true) {
            self.wanted.fill(true);
        }
    }

    /// What is rendered.
    #[must_use]
    pub fn settings(&self) -> &RenderSettings {
        &self.request.settings
    }

    /// Rays and samples so far.
    #[must_use]
    pub fn cost(&self) -> RenderStats {
        self.cost
    }

    /// The picture as it is; uneven while a piece is under way.
    #[must_use]
    pub fn develop(&self) -> Picture {
        self.film.develop(self.ids.mattes())
    }
}

/// What is seen at a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// The instance.
    pub instance: u32,
    /// Its name, which others may have too; empty where it has none.
    pub object: String,
    /// Its box in world space.
    pub bounds: Aabb,
    /// The mesh.
    pub mesh: u32,
    /// The mesh's name.
    pub mesh_name: String,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// The material.
    pub material: u32,
    /// The triangle of the mesh; none of surfaces without triangles, and of scenes in a store.
    pub primitive: Option<u32>,
    /// Where, in world space.
    pub position: Vec3,
    /// The shading normal there.
    pub normal: Vec3,
    /// The distance from the camera's plane.
    pub depth: f32,
}

impl Live<'_> {
    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        self.scene
    }

    /// The time that building structures took, nothing where they were there.
    #[must_use]
    pub fn build_time(&self) -> Duration {
        self.build
    }

    /// The time that preparing materials, textures and lights took.
    #[must_use]
    pub fn prepare_time(&self) -> Duration {
        self.prepare
    }

    /// Bytes that structures keep.
    #[must_use]
    pub fn structure_bytes(&self) -> u64 {
        self.renderer.tracer().report().bytes
    }

    /// What of a store is in memory; none of a scene that is in memory as a whole.
    #[must_use]
    pub fn residency(&self) -> Option<Residency> {
        self.caches.map(|caches| Residency::new(caches, self.store_bytes))
    }

    /// What the caches over a store's pages have done so far.
    #[must_use]
    pub fn paging(&self) -> Option<PagingStats> {
        self.caches.map(PagingStats::new)
    }

    /// Begins a picture. Settings and outputs of the request count.
    ///
    /// # Errors
    /// A page of a scene in pages cannot be had, or the integrator knows no open shutter.
    pub fn begin(&mut self, request: RenderRequest) -> Result<LivePicture, Error> {
        shutter::check(self.scene, &request)?;
        self.renderer.use_settings(request.settings.clone());
        let plan = self.renderer.photon_plan()?;
        let tiles = if self.caches.is_some() { Tiles::InPages } else { Tiles::InMemory };
        let mut settings = film_settings(&request, tiles);
        settings.tile_size = settings.tile_size.min(LARGEST_TILE);
        let mut film = Film::new(settings);
        let ids = Ids::new(self.scene, &request.aovs);
        let tiles = film.tiles_mut().len();
        let (done, wanted) = (vec![0; tiles], vec![true; tiles]);
        let cost = RenderStats::default();
        Ok(LivePicture { request, ids, film, done, wanted, plan, photons: None, cost })
    }

    /// Brings every pixel to so many samples, of those to which the picture is limited, or as far as it comes until `stop` says yes: tiles that are begun are finished. Says whether
    /// all are there. What is left is done by later calls.
    ///
    /// # Errors
    /// A page of a scene in pages cannot be had.
    pub fn advance(
        &mut self,
        picture: &mut LivePicture,
        spp: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<bool, Error> {
        self.renderer.use_settings(picture.request.settings.clone());
        while picture.plan.is_some() && picture.spp() < spp && !stop() {
            let sample = picture.spp();
            self.send_photons(picture, sample)?;
            self.advance_tiles(picture, sample + 1, stop)?;
        }
        if picture.plan.is_none() {
            self.advance_tiles(picture, spp, stop)?;
        }
        Ok(picture.spp() >= spp)
    }

    /// Sends the photons of a sample, unless they are there.
    fn send_photons(&self, picture: &mut LivePicture, sample: u32) -> Result<(), Error> {
        if let (Some(plan), None) = (&picture.plan, picture.photons.as_ref().filter(|(of, _)| *of == sample))
        {
            let (photons, rays) = self.renderer.photon_maps(plan, sample)?;
            picture.photons = Some((sample, photons));
            picture.cost.rays += rays;
        }
        Ok(())
    }

    fn advance_tiles(
        &self,
        picture: &mut LivePicture,
        spp: u32,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Error> {
        let LivePicture { film, ids, done, wanted, photons, cost, .. } = picture;
        let photons = photons.as_ref().map(|(_, maps)| maps);
        let of_tile = |((tile, done), &wanted): ((&mut FilmTile, &mut u32), &bool)| {
            if !wanted || *done >= spp || stop() {
                return Ok(RenderStats::default());
            }
            let window = tile.window();
            let region = Tile { min: [window.x0, window.y0], max: [window.x1, window.y1] };
            let mut sink = TileSink { tile, ids };
            let cost = self.renderer.render_tile_under(photons, region, *done..spp, &mut sink)?;
            *done = spp;
            Ok::<_, Error>(cost)
        };
        let add = |mut a: RenderStats, b| {
            a += b;
            Ok(a)
        };
        let tiles =
            film.tiles_mut().par_iter_mut().zip(done.par_iter_mut()).zip(wanted.par_iter()).with_max_len(1);
        *cost += tiles.map(of_tile).try_reduce(RenderStats::default, add)?;
        Ok(())
    }

    /// What is seen at a pixel of a picture with these settings; none where that is nothing.
    ///
    /// # Errors
    /// A page of a scene in pages cannot be had.
    pub fn pick(&mut self, settings: &RenderSettings, [x, y]: [u32; 2]) -> Result<Option<Picked>, Error> {
        let crop = Tile { min: [x, y], max: [x.saturating_add(1), y.saturating_add(1)] };
        let integrator = Integrator::Primary;
        self.renderer.use_settings(RenderSettings {
            integrator,
            caustics: None,
            crop: Some(crop),
            ..settings.clone()
        });
        let mut seen = Sample::MISS;
        self.renderer.render_tile(crop, 0..1, &mut |_, sample: &Sample| seen = *sample)?;
        Ok((seen.object != Hit::NONE).then(|| self.picked(&seen, settings)))
    }

    fn picked(&self, seen: &Sample, settings: &RenderSettings) -> Picked {
        let scene = self.scene;
        let instance = seen.object;
        let mesh = scene.instances().mesh(instance as usize);
        let extent = &scene.extents()[mesh as usize];
        Picked {
            instance,
            object: scene.instance_name(instance).to_owned(),
            bounds: extent.bounds.transformed(scene.instances().map(instance as usize)),
            mesh,
            mesh_name: scene.meshes()[mesh as usize].name.clone(),
            triangles: extent.triangles,
            material: seen.material,
            primitive: self.primitive(seen, settings.camera.world_from_camera.translation),
            position: seen.position,
            normal: seen.normal,
            depth: seen.depth,
        }
    }

    /// The triangle at a point of an instance, looked for by a short ray along the view.
    fn primitive(&self, seen: &Sample, eye: Vec3) -> Option<u32> {
        /// Half the ray, as a part of the way.
        const REACH: f32 = 1e-3;
        if self.caches.is_some() {
            return None;
        }
        let reach = (seen.position - eye) * REACH;
        let ray = vastlight_math::Ray {
            origin: seen.position - reach,
            t_min: 0.0,
            direction: reach,
            t_max: 2.0,
            time: 0.0,
        };
        let mut hits = [Hit::MISS];
        self.renderer.tracer().closest(&[ray], &OfInstance(seen.object), &mut hits);
        (hits[0].is_hit() && hits[0].prim != Hit::NONE).then_some(hits[0].prim)
    }
}

/// Hits of one instance.
struct OfInstance(u32);

impl HitFilter for OfInstance {
    fn accepts(&self, _ray: usize, hit: &Hit) -> bool {
        hit.instance == self.0
    }
}
