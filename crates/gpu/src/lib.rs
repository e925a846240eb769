//! Compute kernels on any vendor's graphics processor.
//!
//! This crate alone names wgpu. Work is written down as a [`Recording`] without a device and run by an [`Executor`];
//! every kernel stays within the limits that WebGPU promises on any device and depends on no subgroup size.
//!
//! ```no_run
//! use vastlight_gpu::{DeviceChoice, Drivers};
//!
//! let device = Drivers::load().open(DeviceChoice::Any)?;
//! assert!(!device.adapter().name.is_empty());
//! # Ok::<(), vastlight_gpu::GpuError>(())
//! ```

mod adapters;
pub mod bench;
pub mod build;
mod device;
mod error;
pub mod kernel;
pub mod limits;
pub mod page;
pub mod path;
pub mod photon;
pub mod primitives;
mod recording;
mod run;
pub mod trace;

pub use adapters::{AdapterKind, AdapterLimits, AdapterReport};
pub use device::{Device, DeviceChoice, Drivers};
pub use error::GpuError;
pub use recording::{Buffer, Command, Download, Groups, Recording, Resident};
pub use run::{CompileProgress, Executor, ExecutorConfig, Results};
