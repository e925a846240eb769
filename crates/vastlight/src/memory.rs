//! How much memory there is, how much is used, and how much a picture will need.

use crate::budget::image_bytes;
use crate::{Error, ErrorClass};
use std::fs;
use vastlight_film::{Aov, FilmTile};
use vastlight_math::Affine3;
use vastlight_scene::{Instances, Mesh, Scene};
use vastlight_transport::RenderSettings;

/// What a picture of a scene needs, in bytes. An estimate, made before the work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryEstimate {
    /// Meshes, instances and images.
    pub scene: u64,
    /// The acceleration structure at its largest, while it is built.
    pub structure: u64,
    /// Sums, developed planes and the file in memory.
    pub film: u64,
    /// Paths in flight on all threads.
    pub paths: u64,
    /// What a graphics processor is given, and its driver; on software adapters all of it is the process's.
    pub device: u64,
}

/// Bytes of a mesh of so many triangles beside the pages of a store, at its largest, while it follows a pose.
pub(crate) fn moving_bytes(triangles: u64) -> u64 {
    triangles * (MOVING_BYTES_PER_TRIANGLE + POSE_BYTES_PER_TRIANGLE)
}

/// Bytes of the structure of so many triangles.
pub(crate) fn structure_bytes(triangles: u64) -> u64 {
    triangles * STRUCTURE_BYTES_PER_TRIANGLE
}

/// Bytes of the acceleration structure a unique triangle, the builder's working memory included.
const STRUCTURE_BYTES_PER_TRIANGLE: u64 = 150;
/// Bytes of what updates keep and work with besides, a triangle that moves, and of a pose.
const MOVING_BYTES_PER_TRIANGLE: u64 = 100;
const POSE_BYTES_PER_TRIANGLE: u64 = 40;
/// Bytes of the structure at a key of a shutter, a triangle that moves.
const KEY_BYTES_PER_TRIANGLE: u64 = 90;
/// Bytes of the tree over instances an instance.
const STRUCTURE_BYTES_PER_INSTANCE: u64 = 32;
/// Bytes of what is at hand of an instance, of scenes with few.
const BYTES_AT_HAND: u64 = 110;
/// Bytes of the wavefront of one thread.
const WAVE_BYTES_PER_THREAD: u64 = 16 << 20;
/// Bytes of a path in flight on a graphics processor, its way back included, times how many there are.
const WAVE_BYTES_ON_DEVICE: u64 = (352 + 3 * 64) << 16;
/// Bytes of a photon of a pass, and of the trial passes before the first.
const BYTES_PER_PHOTON: u64 = 320;
const TRIAL_BYTES: u64 = 48 << 20;
/// Compiled kernels, and the driver that compiles them: a software adapter was seen to take 253 MiB, and 506 MiB where the driver's
/// cache did not know the kernels.
const DRIVER_BYTES: u64 = 512 << 20;
/// Bytes of an instance on a graphics processor, of a triangle in pages, and how often both are held while they are brought.
const DEVICE_BYTES_PER_INSTANCE: u64 = 170;
const DEVICE_BYTES_PER_TRIANGLE: u64 = 24;
const DEVICE_COPIES: u64 = 3;
/// The process itself.
const BASE_BYTES: u64 = 24 << 20;

impl MemoryEstimate {
    /// The estimate for `pixels` pixels with `aovs` on `threads` threads.
    #[must_use]
    pub fn new(scene: &Scene, pixels: u64, aovs: &[Aov], threads: usize) -> Self {
        let instances = scene.instances().len();
        let at_hand = if instances <= Instances::AT_HAND { BYTES_AT_HAND } else { 0 };
        let mesh_bytes: u64 = scene.meshes().iter().map(mesh_bytes).sum();
        let image_bytes: u64 = scene.images().iter().map(image_bytes).sum();
        Self {
            scene: mesh_bytes + image_bytes + scene.instances().bytes() as u64,
            structure: scene.unique_triangles() * STRUCTURE_BYTES_PER_TRIANGLE
                + instances as u64 * (STRUCTURE_BYTES_PER_INSTANCE + at_hand),
            film: film_bytes(pixels, aovs),
            paths: threads as u64 * WAVE_BYTES_PER_THREAD + BASE_BYTES,
            device: 0,
        }
    }

    /// The same with the photons that a picture wants.
    #[must_use]
    pub fn with_photons(self, settings: &RenderSettings) -> Self {
        Self { paths: self.paths + photon_bytes(settings), ..self }
    }

    /// The same with what the noise of so many pixels is found from.
    #[must_use]
    pub fn with_noise(self, pixels: u64) -> Self {
        Self { film: self.film + pixels * FilmTile::SQUARES_BYTES as u64, ..self }
    }

    /// The same for frames between which so many triangles get other vertices.
    #[must_use]
    pub fn with_moving(self, triangles: u64) -> Self {
        let structure = self.structure + triangles * MOVING_BYTES_PER_TRIANGLE;
        Self { scene: self.scene + triangles * POSE_BYTES_PER_TRIANGLE, structure, ..self }
    }

    /// The same where the scene's shutter is open.
    #[must_use]
    pub fn with_shutter(self, scene: &Scene) -> Self {
        let Some(shutter) = scene.shutter() else { return self };
        let triangles = |mesh: u32| scene.extents()[mesh as usize].triangles;
        let moving: u64 = shutter.meshes().map(|(mesh, _)| triangles(mesh)).sum();
        let keys = shutter.keys() as u64;
        let instances = shutter.instances().count() as u64 * keys * size_of::<Affine3>() as u64;
        Self {
            scene: self.scene + moving * keys * POSE_BYTES_PER_TRIANGLE + instances,
            structure: self.structure + moving * (keys + 1) * KEY_BYTES_PER_TRIANGLE,
            ..self
        }
    }

    /// The same on a graphics processor.
    #[must_use]
    pub fn on_graphics_processor(self, scene: &Scene) -> Self {
        let held = self.scene
            + scene.unique_triangles() * DEVICE_BYTES_PER_TRIANGLE
            + scene.instances().len() as u64 * DEVICE_BYTES_PER_INSTANCE;
        Self { device: DEVICE_COPIES * held + WAVE_BYTES_ON_DEVICE + DRIVER_BYTES, ..self }
    }

    /// The sum.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.scene + self.structure + self.film + self.paths + self.device
    }

    /// Refuses work that does not fit, before it starts.
    ///
    /// # Errors
    /// If `budget` is smaller than the estimate, or than what the process has used already and will still add.
    pub fn check(&self, budget: u64) -> Result<(), Error> {
        let still_to_come = self.structure + self.film + self.paths + self.device - BASE_BYTES;
        let needed = self.total().max(peak_rss_bytes().unwrap_or(0) + still_to_come);
        let hint = "a larger --memory, a smaller picture or fewer AOVs, or --cache-dir DIR";
        refuse_beyond(budget, needed, "about", hint)
    }
}

/// Refuses work that needs more than `budget` bytes: `how` says how well that is known.
pub(crate) fn refuse_beyond(budget: u64, needed: u64, how: &str, hint: &str) -> Result<(), Error> {
    if needed <= budget {
        return Ok(());
    }
    let what = format!("{how} {} are needed, the budget is {}", human_bytes(needed), human_bytes(budget));
    Err(Error::new(ErrorClass::Memory, what, "--memory", hint))
}

/// The budget where neither the user nor the system says one.
const UNKNOWN_MACHINE: u64 = 4 << 30;

/// What the user says, else the default.
pub(crate) fn budget_bytes(memory: Option<u64>) -> u64 {
    memory.or_else(default_budget_bytes).unwrap_or(UNKNOWN_MACHINE)
}

/// Bytes of the photons of a pass, on their way, landed, sorted and indexed.
pub(crate) fn photon_bytes(settings: &RenderSettings) -> u64 {
    let pixels = settings.whole().pixels();
    let photons = settings.caustics.map_or(0, |caustics| caustics.count(pixels));
    u64::from(photons) * BYTES_PER_PHOTON + if photons > 0 { TRIAL_BYTES } else { 0 }
}

/// Bytes of a film, its picture, and the file in memory.
pub(crate) fn film_bytes(pixels: u64, aovs: &[Aov]) -> u64 {
    // Sums, then up to 22 developed f32 planes twice (in the picture and in the file).
    pixels * (FilmTile::bytes_per_pixel(aovs) as u64 + 2 * 4 * (3 + 3 * aovs.len() as u64))
}

/// Bytes of a mesh.
pub(crate) fn mesh_bytes(mesh: &Mesh) -> u64 {
    let uvs: usize = mesh.uvs.iter().map(|uv| size_of_val(&uv[..])).sum();
    let bytes = size_of_val(&mesh.positions[..])
        + size_of_val(&mesh.triangles[..])
        + size_of_val(&mesh.normals[..])
        + size_of_val(&mesh.tangents[..])
        + size_of_val(&mesh.colors[..])
        + uvs;
    bytes as u64
}

/// The budget without `--memory`: three quarters of the machine, or of the control group where it is smaller. `None`
/// where the system does not say.
#[must_use]
pub fn default_budget_bytes() -> Option<u64> {
    let machine = proc_kilobytes("/proc/meminfo", "MemTotal:");
    let group = fs::read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|t| t.trim().parse().ok());
    machine.into_iter().chain(group).min().map(|bytes: u64| bytes / 4 * 3)
}

/// The largest resident set that the process has had, bytes. `None` where the system does not say.
#[must_use]
pub fn peak_rss_bytes() -> Option<u64> {
    proc_kilobytes("/proc/self/status", "VmHWM:")
}

/// The resident set of the process now, bytes. `None` where the system does not say.
#[must_use]
pub fn rss_bytes() -> Option<u64> {
    proc_kilobytes("/proc/self/status", "VmRSS:")
}

/// A line `KEY  123 kB` of a file of the proc file system, in bytes.
fn proc_kilobytes(file: &str, key: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let value = text.lines().find_map(|line| line.strip_prefix(key))?;
    value.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kb| kb * 1024)
}

/// A number of bytes for people: `1.5 GiB`.
#[must_use]
pub fn human_bytes(bytes: u64) -> String {
    const UNITS: [&str; 4] = ["KiB", "MiB", "GiB", "TiB"];
    let mut value = bytes as f64 / 1024.0;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    format!("{value:.1} {}", UNITS[unit])
}

/// Reads `8GiB`, `512MiB`, `2G`, `1000000`: binary units, with or without `iB`, or plain bytes.
///
/// # Errors
/// A sentence that says what is expected.
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let expected = || format!("\"{text}\" is no size; write 8GiB, 512MiB or a number of bytes");
    let value: f64 = text[..digits].parse().map_err(|_| expected())?;
    let unit = match text[digits..].trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kb" | "kib" => 1024.0,
        "m" | "mb" | "mib" => 1024.0 * 1024.0,
        "g" | "gb" | "gib" => 1024.0 * 1024.0 * 1024.0,
        "t" | "tb" | "tib" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
        _ => return Err(expected()),
    };
    Ok((value * unit) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_scene::SceneDesc;

    #[test]
    fn sizes_are_read_and_written() {
        assert_eq!(parse_bytes("2GiB"), Ok(2 << 30));
        assert_eq!(parse_bytes("1.5m"), Ok(3 << 19));
        assert_eq!(parse_bytes("4096"), Ok(4096));
        assert!(
            parse_bytes("lots").is_err() && parse_bytes("2 parsecs").is_err() && parse_bytes("").is_err()
        );
        assert_eq!(human_bytes(3 << 29), "1.5 GiB");
    }

    #[test]
    fn a_picture_that_cannot_fit_is_refused_and_one_that_can_is_not() {
        let scene = Scene::new(SceneDesc::default()).expect("valid");
        let estimate = MemoryEstimate::new(&scene, 1 << 40, &[], 1);
        let error = estimate.check(1 << 30).expect_err("too large");
        assert_eq!(error.class, ErrorClass::Memory);
        assert!(MemoryEstimate::new(&scene, 1 << 10, &Aov::ALL, 1).check(1 << 40).is_ok());
    }
}
