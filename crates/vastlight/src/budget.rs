//! What a pack may hold in memory at a time, so that the whole process stays within its budget.

use crate::load::file_size;
use crate::memory::{budget_bytes, refuse_beyond};
use crate::{Error, ErrorClass, LoadOptions, PackInput, human_bytes, textures};
use vastlight_import::FileSize;
use vastlight_scene::Image;

/// The process itself, and what allocators keep.
const BASE_BYTES: u64 = 72 << 20;
/// A triangle while it is packed: the mesh, the tree over it, its pages, and the part of the next bucket that is read
/// meanwhile.
const TRIANGLE_BYTES: u64 = 320;
/// What stays in memory of a triangle that is in the store: rows of directories and of the tree above pages.
const RESIDENT_BYTES: f64 = 1.0;
/// A placement of a mesh that is packed: its matrix of 48 bytes, and a margin.
const INSTANCE_BYTES: u64 = 56;
/// Fewest triangles that are packed at a time.
const LEAST_TRIANGLES: u64 = 1 << 16;
/// Triangles are counted in these, so that small changes do not matter.
const STEP_TRIANGLES: u64 = 1 << 14;
/// Most triangles that are packed at a time.
const MOST_TRIANGLES: u64 = 1 << 28;
/// Triangles of small meshes that are packed side by side.
const TOGETHER: usize = 1 << 19;
/// Part of the budget for looking up vertices on disk, when nothing else is in memory.
const CACHE_PART: u64 = 3;

/// The parts of a budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PackBudget {
    /// Most triangles that are packed at a time: larger meshes go through the disk.
    pub(crate) most: usize,
    /// Small meshes are gathered until they have so many triangles.
    pub(crate) together: usize,
    /// Bytes for looking up vertices on disk.
    pub(crate) cache: usize,
    room: u64,
}

impl PackBudget {
    /// Divides `memory` bytes, or the default budget; textures are cut into tiles of so many bytes.
    ///
    /// # Errors
    /// If that is too little for this input.
    pub(crate) fn new(memory: Option<u64>, input: &PackInput, tile_bytes: usize) -> Result<Self, Error> {
        let budget = budget_bytes(memory);
        let images = textures::resident_bytes(&input.stream, tile_bytes);
        let fixed = fixed_bytes(images + input.held_bytes, input.triangles());
        // Textures come before meshes.
        check(fixed + textures::working_bytes(&input.stream, tile_bytes), budget)?;
        check(fixed + LEAST_TRIANGLES * TRIANGLE_BYTES, budget)?;
        let room = budget - fixed;
        let most =
            (room / TRIANGLE_BYTES / STEP_TRIANGLES * STEP_TRIANGLES).clamp(LEAST_TRIANGLES, MOST_TRIANGLES);
        let most = most as usize;
        Ok(Self { most, together: most.min(TOGETHER), cache: (room / CACHE_PART) as usize, room })
    }

    /// Takes bytes that stay in memory to the end.
    pub(crate) fn hold(&mut self, bytes: u64) {
        self.room = self.room.saturating_sub(bytes);
    }

    /// Whether a mesh of so many triangles fits that cannot go through the disk.
    ///
    /// # Errors
    /// If it does not.
    pub(crate) fn check_whole(&self, triangles: u64, name: &str) -> Result<(), Error> {
        let needed = triangles * TRIANGLE_BYTES;
        if needed <= self.room {
            return Ok(());
        }
        let what = format!(
            "it deforms, shines or needs tangents, so it must be in memory: about {} are needed, there is room for {}",
            human_bytes(needed),
            human_bytes(self.room)
        );
        Err(Error::new(ErrorClass::Memory, what, format!("mesh \"{name}\""), "a larger --memory"))
    }
}

/// Bytes that a scene has in memory while it is packed, besides its meshes: what its import holds, and placements.
pub(crate) fn held_bytes(size: &FileSize) -> u64 {
    size.streaming_bytes.saturating_add(size.instances.saturating_mul(INSTANCE_BYTES))
}

/// Refuses to import files as a whole that do not fit, before they are read; `bytes` is what they take.
///
/// # Errors
/// If they do not fit.
pub(crate) fn check_import(memory: Option<u64>, bytes: u64) -> Result<(), Error> {
    check(bytes.saturating_add(BASE_BYTES + LEAST_TRIANGLES * TRIANGLE_BYTES), budget_bytes(memory))
}

/// Bytes of a triangle in memory, ready for rays, with what it takes to build that.
const RENDERED_BYTES: u64 = 210;
/// Bytes of a placement of a mesh that is read, and placed for rays.
const RENDERED_INSTANCE_BYTES: u64 = 160;

/// Refuses a scene that is too large to be rendered from memory, as far as its files say before they are read.
///
/// # Errors
/// If it does not fit into `memory` bytes (none for the default budget), or cannot be read.
pub(crate) fn check_fits(source: &str, options: &LoadOptions, memory: Option<u64>) -> Result<(), Error> {
    let FileSize { triangles, instances, image_bytes, .. } = file_size(source, options)?;
    let meshes = triangles.saturating_mul(RENDERED_BYTES);
    let placements = instances.saturating_mul(RENDERED_INSTANCE_BYTES);
    let needed = [image_bytes, meshes, placements].into_iter().fold(BASE_BYTES, u64::saturating_add);
    let hint = "a larger --memory, --cache-dir DIR, or `vastlight pack` first";
    refuse_beyond(budget_bytes(memory), needed, "about", hint)
}

fn check(needed: u64, budget: u64) -> Result<(), Error> {
    refuse_beyond(budget, needed, "at least", "a larger --memory, or smaller files")
}

/// What is in memory all the time.
fn fixed_bytes(held: u64, triangles: Option<u64>) -> u64 {
    BASE_BYTES + held + (triangles.unwrap_or(0) as f64 * RESIDENT_BYTES) as u64
}

/// Bytes of an image's texels.
pub(crate) fn image_bytes(image: &Image) -> u64 {
    (image.texels.len() * image.texels.number_bytes()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_scene::{SceneDesc, SceneStream};

    fn input(triangles: u64) -> PackInput {
        let stream = SceneStream { triangles: Some(triangles), ..SceneDesc::default().into() };
        stream.into()
    }

    #[test]
    fn more_memory_is_more_at_a_time_and_too_little_is_refused() {
        let most = |memory: u64| PackBudget::new(Some(memory), &input(1_000_000), 4096).map(|b| b.most);
        let sizes: Vec<usize> = [128, 256, 512, 4096].map(|mib| most(mib << 20).expect("enough")).to_vec();
        assert!(sizes.is_sorted_by(|a, b| a < b), "{sizes:?}");
        let error = most(64 << 20).expect_err("too little");
        assert_eq!(error.class, ErrorClass::Memory);
        assert!(error.what.contains("needed"), "{error}");
        assert!(PackBudget::new(Some(1 << 30), &input(10_000_000_000), 4096).is_err());
        assert!(
            check_import(Some(1 << 30), 2 << 30).is_err() && check_import(Some(1 << 30), 1 << 29).is_ok()
        );
    }
}
