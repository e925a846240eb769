//! The CPU tracer: closest hits and occlusion for arrays of rays.
//!
//! [`Tracer::new`] builds a structure over every mesh of a scene and one over its instances. Hits are defined by the
//! scene alone: they do not depend on the structure, the instructions, the number of threads or the order of rays.

pub mod bench;
mod bundle;
mod flight;
mod follow;
mod grid;
mod hit;
mod implicit;
mod instance;
mod judge;
mod kd;
mod mesh;
pub mod paged;
mod patch;
mod pose;
mod reach;
pub mod sort;
mod steps;
pub mod stream;
mod tracer;
mod tree;
mod usage;
mod walk;
pub mod words;

pub use follow::{FollowReport, UpdateMethod};
pub use hit::{AcceptAll, Hit, HitFilter};
pub use mesh::Layout;
pub use pose::{PoseError, PoseReport};
pub use tracer::{BuildReport, LARGEST_CHUNK, TopLevel, TraceError, Tracer, TracerConfig, parallel_chunk};
