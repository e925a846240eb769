//! Open Image Denoise, loaded at run time where it is installed: nothing of it is linked, nothing of it is shipped.
//!
//! A [`Denoiser`] is the library with a device on the processor; [`Denoiser::denoise`] runs its filter for ray tracing
//! ("RT", linear and of high dynamic range) over a [`NoisyPicture`] with albedo and normals as guides. The functions are
//! those of the library's C interface, version 2, and the ones that version 1 has under other names
//! (<https://www.openimagedenoise.org/documentation.html>, A. T. Áfra 2018 and later). Its result depends on neither
//! threads nor memory.

mod api;
mod denoiser;
mod error;
mod find;
mod picture;

pub use denoiser::Denoiser;
pub use error::DenoiseError;
pub use find::LIBRARY_VARIABLE;
pub use picture::NoisyPicture;
