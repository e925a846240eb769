//! Light transport: materials, lights, and the integrators that join them.

mod camera;
mod pixel_filter;
mod sample;
mod settings;

pub use camera::{CameraRandom, CameraRays};
pub use pixel_filter::{FilterSampler, PixelFilter};
pub use sample::{RenderStats, Sample, SampleSink};
pub use settings::{DirectSampling, Integrator, RenderSettings, Tile};
