//! The noise of a finished picture, taken out with the albedo and normals of what it shows as guides.

use crate::memory::{budget_bytes, film_bytes, refuse_beyond, rss_bytes};
use crate::{Error, ErrorClass};
use vastlight_denoise::{DenoiseError, Denoiser, NoisyPicture};
use vastlight_film::{Aov, Picture};

/// What is recorded of a picture to guide the denoiser.
const GUIDES: [Aov; 2] = [Aov::Albedo, Aov::Normal];

/// A denoiser that is ready before the picture is rendered.
#[derive(Debug)]
pub struct Denoising {
    denoiser: Denoiser,
    wanted: Vec<Aov>,
}

impl Denoising {
    /// Loads the denoiser for a picture of which these auxiliary outputs are wanted; it runs on as many threads as the
    /// current pool has.
    ///
    /// # Errors
    /// If it is not installed, or does not work.
    pub fn open(wanted: &[Aov]) -> Result<Self, Error> {
        let denoiser = Denoiser::open(rayon::current_num_threads())?;
        Ok(Self { denoiser, wanted: wanted.to_vec() })
    }

    /// Its name and version.
    #[must_use]
    pub fn name(&self) -> String {
        self.denoiser.name()
    }

    /// The auxiliary outputs to render: those that are wanted, and the guides.
    #[must_use]
    pub fn rendered_aovs(&self) -> Vec<Aov> {
        let more = GUIDES.iter().filter(|guide| !self.wanted.contains(guide));
        self.wanted.iter().chain(more).copied().collect()
    }

    /// Refuses a picture of so many pixels that cannot be denoised within `memory` bytes (none for the default budget)
    /// beside the scene, which is open.
    ///
    /// # Errors
    /// If it does not fit.
    pub fn check_memory(&self, pixels: u64, memory: Option<u64>) -> Result<(), Error> {
        let picture = film_bytes(pixels, &self.rendered_aovs()) + Denoiser::bytes(pixels);
        let needed = rss_bytes().unwrap_or(0) + picture;
        let hint = "a larger --memory, a smaller picture, or leave --denoise out";
        refuse_beyond(budget_bytes(memory), needed, "to denoise, about", hint)
    }

    /// Takes the noise out of the colour and the guides that are not wanted out of the picture. Where the denoiser fails,
    /// the colour stays as it is.
    ///
    /// # Errors
    /// If the denoiser fails.
    pub fn run(&self, picture: &mut Picture) -> Result<(), Error> {
        let denoised = self.denoised(picture);
        GUIDES
            .into_iter()
            .filter(|guide| !self.wanted.contains(guide))
            .for_each(|guide| picture.remove(guide));
        picture.set_rgb(denoised?);
        picture.denoiser = Some(self.name());
        Ok(())
    }

    fn denoised(&self, picture: &Picture) -> Result<[Vec<f32>; 3], DenoiseError> {
        let [width, height] = picture.size();
        let guide = |aov: Aov| aov.vector_channels().and_then(|names| picture.three(names));
        let (Some(color), Some(albedo), Some(normal)) =
            (picture.rgb(), guide(Aov::Albedo), guide(Aov::Normal))
        else {
            return Err(DenoiseError::Shape(picture.window.pixels()));
        };
        self.denoiser.denoise(&NoisyPicture { width, height, color, albedo, normal })
    }
}

impl From<DenoiseError> for Error {
    fn from(e: DenoiseError) -> Self {
        Self::new(ErrorClass::Device, e.to_string(), "--denoise", e.hint())
    }
}
