//! Light transport: materials, lights, and the integrators that join them.

mod alpha;
mod ao;
pub mod bsdf;
mod camera;
mod corners;
pub mod light;
mod material;
mod medium;
mod mis;
mod order;
mod pages;
mod pane;
mod path;
mod pixel_filter;
mod placement;
mod primary;
mod renderer;
mod sample;
mod settings;
mod stream;
mod surface;
mod texture;
mod veil;
mod vertex;
mod wavefront;

pub use bsdf::{Bsdf, BsdfParams, BsdfSample};
pub use camera::{CameraRandom, CameraRays};
pub use light::{LightSample, Lights, LightsReport};
pub use material::{Evaluated, MaterialTable, ShadingPoint, UV_SETS};
pub use pages::{PagedGeometry, PagesError};
pub use pixel_filter::{FilterSampler, PixelFilter};
pub use renderer::Renderer;
pub use sample::{RenderStats, Sample, SampleSink};
pub use settings::{DirectSampling, Integrator, RenderSettings, Tile};
pub use surface::Surface;
pub use texture::PreparedTexture;
