//! Memory and threads for a scene in a store.

use crate::memory::{
    budget_bytes, film_bytes, moving_bytes, photon_bytes, refuse_beyond, rss_bytes, structure_bytes,
};
use crate::{Error, ErrorClass, OpenScene, RenderRequest, peak_rss_bytes};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::Arc;
use vastlight_accel::compact::SLACK;
use vastlight_film::FilmTile;
use vastlight_paging::{CacheConfig, Directory, Line, PageCache, PolicyKind};
use vastlight_store::StoredPages;
use vastlight_trace::paged::Caches;
use vastlight_transport::{Evaluated, PagedGeometry};

/// Bytes of a path on its way through pages: its ray, hit, corners, and what it casts. The attributes of the corners come
/// on top.
const PATH_BYTES: u64 = 1440;
/// Paths of a batch.
const PATHS: std::ops::RangeInclusive<u64> = 1 << 11..=1 << 18;
/// The part that paths get of the memory beyond what is needed in any case.
const PATHS_SHARE: u64 = 5;
/// About what is needed in any case.
const NEEDED: u64 = 160 << 20;
/// Bytes of the material of a hit whose textures are in tiles.
const MATERIAL_BYTES: u64 = size_of::<Option<Evaluated>>() as u64;
/// What the allocator and the system keep for themselves.
const MARGIN: u64 = 16 << 20;
/// Pages of geometry, and of attributes, that every batch can keep at least. Hits lie far apart: attributes come by many small
/// pages.
const LEAST_PAGES: [usize; 2] = [4, 64];
/// Slots that batches do not share out among them, as a part of all.
const RESERVE: usize = 8;
/// The part of the caches that geometry gets where not all fits, of 16.
const GEOMETRY_SHARE: u64 = 13;
/// The part of all caches that tiles of textures get where not all fits.
const TILE_SHARE: u64 = 3;

/// How a scene in a store is paged. Nothing here changes a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PagingRequest {
    /// Largest resident set of the process; `None` for three quarters of the machine.
    pub memory: Option<u64>,
    /// The part of the pages that may be in memory at once, instead of what `memory` leaves room for.
    pub cache_fraction: Option<f32>,
    /// Memory for tiles of textures, bytes, instead of a share of the rest.
    pub tile_memory: Option<u64>,
    /// Batches of paths for each thread that computes: the others wait for pages meanwhile.
    pub batches_per_thread: usize,
    /// Paths of a batch; `None` for what the memory allows. More share the pages that are fetched for one of them.
    pub paths_per_batch: Option<u64>,
    /// Pages behind a page that is missed which are read with it, where there is room.
    pub read_ahead: usize,
    /// Which page leaves when room is needed.
    pub policy: PolicyKind,
}

impl Default for PagingRequest {
    fn default() -> Self {
        Self {
            memory: None,
            cache_fraction: None,
            tile_memory: None,
            batches_per_thread: 2,
            paths_per_batch: None,
            read_ahead: 0,
            policy: PolicyKind::default(),
        }
    }
}

/// Threads over a store, and what they were made for: a process, and how many there are.
pub(crate) type KeptPool = ((u32, usize), Arc<ThreadPool>);

/// A pool with a thread for every batch: the one that is there, if it has as many, or a new one.
pub(crate) fn kept_pool(
    kept: &mut Option<KeptPool>,
    paging: &PagingRequest,
) -> Result<Arc<ThreadPool>, Error> {
    let threads = rayon::current_num_threads() * paging.batches_per_thread.max(1);
    let asked = (std::process::id(), threads);
    if let Some((made_for, pool)) = kept
        && *made_for == asked
    {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = Arc::new(pool.map_err(|error| Error::usage(error.to_string(), "--threads", ""))?);
    if let Some(((process, _), before)) = kept.replace((asked, Arc::clone(&pool)))
        && process != asked.0
    {
        // The threads of another process are not here to be ended.
        std::mem::forget(before);
    }
    Ok(pool)
}

/// Bytes of a path in scenes like this.
fn path_bytes(stored: &StoredPages) -> u64 {
    let floats = stored.layouts.iter().map(|layout| 3 * layout.floats()).max().unwrap_or(0);
    PATH_BYTES + (floats * size_of::<f32>()) as u64
}

/// Paths of a batch.
fn paths_per_batch(stored: &StoredPages, paging: &PagingRequest) -> u64 {
    let fitting = || {
        let budget = budget_bytes(paging.memory);
        let each = rayon::current_num_threads() as u64 * path_bytes(stored);
        (budget.saturating_sub(NEEDED) / PATHS_SHARE / each).clamp(*PATHS.start(), *PATHS.end())
    };
    paging.paths_per_batch.unwrap_or_else(fitting)
}

/// The meshes and textures of a store through caches over their pages.
pub(crate) fn through<'a>(
    stored: &'a StoredPages,
    caches: &'a Caches,
    paging: &PagingRequest,
) -> PagedGeometry<'a> {
    let wave_paths = paths_per_batch(stored, paging);
    PagedGeometry { caches, index: &stored.index, layouts: &stored.layouts, wave_paths }
}

/// The caches that fit into what is left of the memory; to be called on the pool when all else is there. The evaluation of a
/// material needs `most_tiles` tiles of textures at once; meshes of `beside` triangles follow poses beside the pages.
pub(crate) fn caches(
    (stored, beside): (&StoredPages, u64),
    request: &RenderRequest,
    most_tiles: usize,
) -> Result<Caches, Error> {
    let kinds = Kinds::new((stored, moving_bytes(beside)), &request.paging, most_tiles);
    match request.paging.cache_fraction {
        Some(fraction) => kinds.part(fraction, request.paging.tile_memory),
        None => kinds.within(request),
    }
}

/// Caches over the pages of a store, and what they were made for: how the scene is paged, the bytes of the picture, and threads.
pub(crate) type KeptCaches = ((PagingRequest, u64, usize), Caches);

/// The caches of a request: those that are there, if they were made for such a request, or new ones.
pub(crate) fn kept_caches<'k>(
    kept: &'k mut Option<KeptCaches>,
    open: &OpenScene,
    request: &RenderRequest,
    most_tiles: usize,
) -> Result<Option<&'k Caches>, Error> {
    let Some(stored) = &open.stored else { return Ok(None) };
    let asked = (request.paging, picture_bytes(request), rayon::current_num_threads());
    let known = kept.take().filter(|(made_for, _)| *made_for == asked);
    let new = || caches((stored, open.triangles_beside_pages()), request, most_tiles);
    let caches = known.map_or_else(new, |(_, caches)| Ok(caches))?;
    Ok(Some(&kept.insert((asked, caches)).1))
}

/// The caches that are there, if they were made for so much memory and as many threads, whatever the picture; or new ones.
pub(crate) fn any_caches<'k>(
    kept: &'k mut Option<KeptCaches>,
    open: &OpenScene,
    request: &RenderRequest,
    most_tiles: usize,
) -> Result<Option<&'k Caches>, Error> {
    let asked = (request.paging, rayon::current_num_threads());
    let fits = |((paging, _, threads), _): &KeptCaches| (*paging, *threads) == asked;
    if !kept.as_ref().is_some_and(fits) {
        return kept_caches(kept, open, request, most_tiles);
    }
    Ok(kept.as_ref().map(|(_, caches)| caches))
}

/// Bytes of what a picture is made in.
fn picture_bytes(request: &RenderRequest) -> u64 {
    let pixels = request.settings.region().pixels();
    let squares = if request.noise.is_some() { FilmTile::SQUARES_BYTES as u64 } else { 0 };
    film_bytes(pixels, &request.aovs) + pixels * squares + photon_bytes(&request.settings)
}

/// Refuses a picture for which there is no room, before meshes of `beside` triangles that are in memory get their structures.
pub(crate) fn check((stored, beside): (&StoredPages, u64), request: &RenderRequest) -> Result<(), Error> {
    let to_come = structure_bytes(beside) + moving_bytes(beside);
    Kinds::new((stored, to_come), &request.paging, 0).room(request).map(|_| ())
}

/// What pictures of a scene in a store need, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredMemory {
    /// The smallest budget, with short batches and hardly a page in memory.
    pub least: u64,
    /// The caches that hold all pages.
    pub all_pages: u64,
}

/// What pictures of `pixels` pixels of a scene need that is in a store; none for one in memory.
///
/// # Errors
/// If no threads can be made.
pub fn stored_memory(open: &OpenScene, pixels: u64) -> Result<Option<StoredMemory>, Error> {
    let Some(stored) = &open.stored else { return Ok(None) };
    let paging = PagingRequest { memory: Some(0), ..PagingRequest::default() };
    Ok(Some(kept_pool(&mut None, &paging)?.install(|| {
        let beside = open.triangles_beside_pages();
        let to_come = structure_bytes(beside) + moving_bytes(beside);
        let kinds = Kinds::new((stored, to_come), &paging, open.materials().most_tiles());
        let all = [Some(&kinds.geometry), Some(&kinds.attributes), kinds.tiles.as_ref()];
        let least: u64 = all.iter().flatten().map(|pages| pages.least()).sum();
        let all_pages = all.iter().flatten().map(|pages| pages.most()).sum();
        let fixed = kinds.fixed_bytes(film_bytes(pixels, &[]), &paging);
        StoredMemory { least: fixed + least, all_pages }
    })))
}

/// All kinds of pages of a store.
struct Kinds<'s> {
    stored: &'s StoredPages,
    /// Bytes that are to come for meshes beside the pages.
    beside: u64,
    geometry: Pages<'s>,
    attributes: Pages<'s>,
    tiles: Option<Pages<'s>>,
}

impl<'s> Kinds<'s> {
    fn new((stored, beside): (&'s StoredPages, u64), paging: &PagingRequest, most_tiles: usize) -> Self {
        let batches = rayon::current_num_threads();
        let limits = |slack, pages| CacheConfig {
            slack,
            most_batches: batches,
            policy: paging.policy,
            read_ahead: paging.read_ahead,
            ..CacheConfig::new(batches * pages, Line::BYTES)
        };
        let least_tiles = most_tiles.max(LEAST_PAGES[1]) * RESERVE / (RESERVE - 1) + 1;
        let has_tiles = stored.tiles.pages() > 0;
        Self {
            stored,
            beside,
            geometry: Pages::new(&stored.geometry, limits(SLACK, LEAST_PAGES[0])),
            attributes: Pages::new(&stored.attributes, limits(0, LEAST_PAGES[1])),
            tiles: has_tiles.then(|| Pages::new(&stored.tiles, limits(0, least_tiles))),
        }
    }

    /// Caches of a part of all pages; of so many bytes for tiles, if they are given.
    fn part(&self, fraction: f32, tile_memory: Option<u64>) -> Result<Caches, Error> {
        let bytes_of = |pages: &Pages<'_>| pages.part(fraction);
        let for_tiles = tile_memory.or(self.tiles.as_ref().map(bytes_of)).unwrap_or(0);
        self.caches([bytes_of(&self.geometry), bytes_of(&self.attributes), for_tiles])
    }

    /// What a request's memory leaves for the caches.
    fn room(&self, request: &RenderRequest) -> Result<u64, Error> {
        let fixed = self.fixed_bytes(picture_bytes(request), &request.paging);
        let all = [Some(&self.geometry), Some(&self.attributes), self.tiles.as_ref()];
        let least: u64 = all.iter().flatten().map(|pages| pages.least()).sum();
        let budget = budget_bytes(request.paging.memory);
        let needed = (fixed + least).max(peak_rss_bytes().unwrap_or(0));
        let hint = "a larger --memory, fewer --threads or a smaller picture";
        refuse_beyond(budget, needed, "at least", hint)?;
        Ok(budget - fixed)
    }

    /// Caches for what a request's memory leaves.
    fn within(&self, request: &RenderRequest) -> Result<Caches, Error> {
        let Self { geometry, attributes, tiles, .. } = self;
        let (least_of_tiles, most_of_tiles) = tiles.as_ref().map_or((0, 0), |t| (t.least(), t.most()));
        let least_of_others = geometry.least() + attributes.least();
        let most_of_others = geometry.most() + attributes.most();
        let room = self.room(request)?.min(most_of_others + most_of_tiles);
        // What one kind does not need the others get.
        let for_tiles = (room / TILE_SHARE).max(room.saturating_sub(most_of_others));
        let for_tiles = request.paging.tile_memory.unwrap_or(for_tiles);
        let for_tiles = for_tiles.clamp(least_of_tiles, room - least_of_others).min(most_of_tiles);
        let room = room - for_tiles;
        let share = (room / 16 * GEOMETRY_SHARE).max(room.saturating_sub(attributes.most()));
        let for_geometry = share.clamp(geometry.least(), room - attributes.least()).min(geometry.most());
        self.caches([for_geometry, room - for_geometry, for_tiles])
    }

    /// Bytes of all but the caches.
    fn fixed_bytes(&self, film: u64, paging: &PagingRequest) -> u64 {
        let paths = rayon::current_num_threads() as u64 * paths_per_batch(self.stored, paging);
        let path_bytes = path_bytes(self.stored) + if self.tiles.is_some() { MATERIAL_BYTES } else { 0 };
        let buffers = 2 * self.stored.source.buffer_bytes(self.geometry.config.io_threads) as u64;
        rss_bytes().unwrap_or(0) + self.beside + film + paths * path_bytes + buffers + MARGIN
    }

    fn caches(&self, [geometry, attributes, tiles]: [u64; 3]) -> Result<Caches, Error> {
        Ok(Caches {
            geometry: self.geometry.cache(self.stored, geometry)?,
            attributes: self.attributes.cache(self.stored, attributes)?,
            tiles: self.tiles.as_ref().map(|pages| pages.cache(self.stored, tiles)).transpose()?,
        })
    }
}

/// Pages of a kind.
struct Pages<'d> {
    directory: &'d Directory,
    /// With the fewest slots.
    config: CacheConfig,
}

impl<'d> Pages<'d> {
    fn new(directory: &'d Directory, config: CacheConfig) -> Self {
        let longest = directory.longest().map_or(0, |(_, entry)| entry.bytes as usize);
        let slot_bytes = (longest + config.slack).next_multiple_of(Line::BYTES).max(Line::BYTES);
        Self { directory, config: CacheConfig { slot_bytes, ..config } }
    }

    fn with_slots(&self, slots: usize) -> CacheConfig {
        CacheConfig { slots, reserve: slots / RESERVE, ..self.config }
    }

    fn bytes(&self, slots: usize) -> u64 {
        self.with_slots(slots).memory_bytes(self.directory.pages()) as u64
    }

    /// Bytes of the smallest cache.
    fn least(&self) -> u64 {
        self.bytes(self.config.slots)
    }

    /// Bytes of a cache for all pages.
    fn most(&self) -> u64 {
        self.bytes(self.directory.pages().max(self.config.slots))
    }

    /// Bytes of a cache for a part of all pages.
    fn part(&self, fraction: f32) -> u64 {
        let slots = (self.directory.pages() as f64 * f64::from(fraction)).ceil() as usize;
        self.bytes(slots.max(self.config.slots))
    }

    /// The largest cache of at most so many bytes.
    fn cache(&self, stored: &StoredPages, bytes: u64) -> Result<PageCache, Error> {
        let each = (self.bytes(self.config.slots + 1) - self.least()).max(1);
        let more = bytes.saturating_sub(self.least()) / each;
        let slots = (self.config.slots + more as usize).min(self.directory.pages().max(self.config.slots));
        let cache = PageCache::new(stored.source.clone(), self.directory.clone(), self.with_slots(slots));
        cache.map_err(|error| Error::new(ErrorClass::Memory, error.to_string(), "page cache", ""))
    }
}
