//! The only intrinsics: feature levels and eight-lane vectors.
//!
//! Code that wants vectors is written once, as a [`Kernel`] over a [`Simd8`], and is run by [`Level::dispatch`] with
//! the best instructions of the machine. Every operation but [`Simd8::mul_sub`] gives the same bits at every level.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod level;
mod portable;
mod vector;

pub use level::{Kernel, Level};
pub use portable::Portable;
pub use vector::{Simd8, WINDOW, Words};
