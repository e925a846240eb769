//! Light transport: materials, lights, and the integrators that join them.

pub mod bsdf;
mod camera;
pub mod light;
mod material;
mod pixel_filter;
mod sample;
mod settings;
mod texture;

pub use bsdf::{Bsdf, BsdfParams, BsdfSample};
pub use camera::{CameraRandom, CameraRays};
pub use light::{LightSample, Lights, LightsReport};
pub use material::{Evaluated, MaterialTable, ShadingPoint, UV_SETS};
pub use pixel_filter::{FilterSampler, PixelFilter};
pub use sample::{RenderStats, Sample, SampleSink};
pub use settings::{DirectSampling, Integrator, RenderSettings, Tile};
pub use texture::PreparedTexture;
