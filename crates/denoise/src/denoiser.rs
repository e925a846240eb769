//! The denoiser: a device, and the filter over one picture.

use crate::api::{Device, Filter};
use crate::find::{LIBRARY_VARIABLE, candidates};
use crate::picture::{interleaved, planes};
use crate::{DenoiseError, NoisyPicture};
use std::path::Path;

/// Most memory that the filter is asked to keep to, MiB: larger pictures go through it in parts.
const FILTER_MIB: i32 = 256;
/// What it was seen to take in the end (version 2.5.1, 64 x 64 to 1920 x 1080 pixels): per pixel, and at most. Bytes.
const FILTER_BYTES_PER_PIXEL: u64 = 640;
const FILTER_BYTES: u64 = 384 << 20;
/// Threads, code and weights, bytes.
const LIBRARY_BYTES: u64 = 24 << 20;

/// Open Image Denoise, ready to run.
#[derive(Debug)]
pub struct Denoiser {
    device: Device,
}

impl Denoiser {
    /// Loads the library that [`LIBRARY_VARIABLE`] names, else the system's, and starts it on so many threads.
    ///
    /// # Errors
    /// If there is none, or it cannot be used.
    pub fn open(threads: usize) -> Result<Self, DenoiseError> {
        let named = std::env::var_os(LIBRARY_VARIABLE).filter(|name| !name.is_empty());
        Self::open_at(named.as_deref().map(Path::new), threads)
    }

    /// Loads a library by its file or folder, else the system's, and starts it on so many threads.
    ///
    /// # Errors
    /// If there is none, or it cannot be used.
    pub fn open_at(library: Option<&Path>, threads: usize) -> Result<Self, DenoiseError> {
        Ok(Self { device: Device::new(&candidates(library), threads)? })
    }

    /// Name and version for people: `Open Image Denoise 2.5.1`.
    #[must_use]
    pub fn name(&self) -> String {
        let [major, minor, patch] = self.device.version();
        format!("Open Image Denoise {major}.{minor}.{patch}")
    }

    /// Bytes that [`Denoiser::denoise`] takes for so many pixels, besides the picture. An estimate.
    #[must_use]
    pub fn bytes(pixels: u64) -> u64 {
        let images = 5 * size_of::<[f32; 3]>() as u64;
        LIBRARY_BYTES + pixels * images + FILTER_BYTES.min(pixels * FILTER_BYTES_PER_PIXEL)
    }

    /// Red, green and blue of the picture without its noise. The guides may be noisy too.
    ///
    /// # Errors
    /// If planes are not as long as the picture has pixels, or the library fails.
    pub fn denoise(&self, picture: &NoisyPicture<'_>) -> Result<[Vec<f32>; 3], DenoiseError> {
        let pixels = picture.pixels()?;
        let [mut color, mut albedo, mut normal] =
            [picture.color, picture.albedo, picture.normal].map(interleaved);
        let mut output = vec![[0.0; 3]; pixels];
        let mut filter = Filter::new(&self.device, [picture.width as usize, picture.height as usize])?;
        filter.set_image(c"color", &mut color)?;
        filter.set_image(c"albedo", &mut albedo)?;
        filter.set_image(c"normal", &mut normal)?;
        filter.set_image(c"output", &mut output)?;
        filter.set_bool(c"hdr", true);
        filter.set_bool(c"cleanAux", false);
        filter.set_int(c"maxMemoryMB", FILTER_MIB);
        filter.run()?;
        Ok(planes(&output))
    }
}
