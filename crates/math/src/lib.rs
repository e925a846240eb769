//! Mathematics shared by every room: boxes, rays, frames, sampling warps, counter-based random numbers.
//!
//! Everything here is plain data and pure functions. Vectors and matrices are those of [`glam`], re-exported so that
//! all rooms agree on one version.
//!
//! Determinism: no function here uses the platform's `sin`, `exp` and the like in a way that reaches a picture; the
//! [`real`] module has polynomials of our own. Fused multiply-add is never used implicitly.

mod aabb;
mod between;
mod frame;
pub mod lanes;
mod ray;
pub mod real;
pub mod rng;
mod sampler;
pub mod sobol;
pub mod stats;
pub mod warp;

pub use aabb::Aabb;
pub use between::Between;
pub use frame::Frame;
pub use glam::{self, Affine3, Mat3, Mat4, Quat, Vec2, Vec3, Vec4};
pub use ray::Ray;
pub use rng::Rng;
pub use sampler::{Sampler, SamplerLanes};

/// A distance that stands for "no limit" in rays; large, finite, and safe to multiply with a direction's reciprocal.
pub const FAR: f32 = 1e30;
