//! The facade: open a scene, render it, trace arrays of rays.
//!
//! ```no_run
//! use std::sync::atomic::AtomicBool;
//! use vastlight::{CameraChoice, Control, LoadOptions, RenderRequest, open, render};
//! use vastlight::transport::RenderSettings;
//!
//! let scene = open("demo:cornell", &LoadOptions::default())?;
//! let camera = CameraChoice::default().resolve(&scene.scene)?;
//! let request = RenderRequest::new(RenderSettings::new(camera, 256, 256), 16);
//! let picture = render(&scene, &request, &Control::new(&AtomicBool::new(false), &|_| {}))?.develop();
//! vastlight::film::write_exr("cornell.exr".as_ref(), &picture)?;
//! # Ok::<(), vastlight::Error>(())
//! ```

mod blurred;
mod budget;
mod cached;
mod camera;
mod check;
mod checkpoint;
mod choice;
mod denoise;
mod device;
mod edit;
mod environment;
mod error;
mod fingerprint;
mod ids;
mod input;
mod live;
mod load;
mod manifest;
mod memory;
mod merge;
mod motion;
mod moving;
mod ooc;
mod open;
mod overrides;
mod pack;
mod paged;
mod passes;
mod picture;
mod rays;
mod recipe;
mod render;
mod run;
mod session;
mod shutter;
mod stats;
mod sums;
mod textures;

pub use blurred::{ShutterFigures, measure_shutter};
pub use cached::{CachedStore, cached_store, open_within};
pub use camera::CameraChoice;
pub use check::check_request;
pub use checkpoint::Checkpoint;
pub use choice::{LookChoice, SceneChoice};
pub use denoise::Denoising;
pub use device::{Device, DeviceRequest, paths_in_flight};
pub use edit::{Addition, Table};
pub use error::{Error, ErrorClass};
pub use input::PackInput;
pub use live::{Live, LivePicture, Picked};
pub use load::{LoadOptions, describe, load, pack_input, stream};
pub use memory::{MemoryEstimate, default_budget_bytes, human_bytes, parse_bytes, peak_rss_bytes, rss_bytes};
pub use moving::{
    ClusterFigures, ClusterMoment, ClusterRequest, MovingFigures, MovingRequest, measure_clusters,
    measure_moving,
};
pub use ooc::{OocFigures, measure_ooc};
pub use open::{OpenScene, is_store, open, open_store};
pub use overrides::Overrides;
pub use pack::{PackControl, PackProgress, pack, pack_within};
pub use paged::{PagingRequest, StoredMemory, stored_memory};
pub use picture::{LARGEST_EDGE, default_size, photon_settings};
pub use rays::{RayArray, RayHits};
pub use render::{Control, Progress, RenderRequest, Rendered, Snapshot, render};
pub use session::Session;
pub use shutter::Exposure;
pub use stats::{CacheCounts, Ending, PagingStats, Residency, SceneCounts, Stats};
pub use sums::{Merger, SUMS_TILE, merge_sums};

pub use vastlight_accel as accel;
pub use vastlight_export as export;
pub use vastlight_film as film;
pub use vastlight_gpu as gpu;
pub use vastlight_import as import;
pub use vastlight_math as math;
pub use vastlight_paging as paging;
pub use vastlight_scene as scene;
pub use vastlight_simd as simd;
pub use vastlight_store as store;
pub use vastlight_trace as trace;
pub use vastlight_transport as transport;
