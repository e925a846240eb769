//! The CPU tracer: closest hits and occlusion for arrays of rays.

mod hit;

pub use hit::{AcceptAll, Hit, HitFilter};
