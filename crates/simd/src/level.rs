//! Which instructions the machine has, and running code with them.

use crate::{Portable, Simd8};

/// Work that is compiled once for each feature level.
///
/// `run` and everything it calls that takes a [`Simd8`] must be `#[inline(always)]`, so that it becomes part of the
/// one function that has the level's instructions enabled. Closures cannot be marked so: operations inside closures
/// become calls, ten times slower.
pub trait Kernel {
    /// What the work gives.
    type Output;
    /// The work.
    fn run<S: Simd8>(self, simd: S) -> Self::Output;
}

/// A set of instructions that this machine is known to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level(Kind);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(crate::avx2::Avx2),
}

impl Level {
    /// The level that every machine has.
    pub const PORTABLE: Self = Self(Kind::Portable);

    /// The best level of this machine.
    #[must_use]
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = crate::avx2::Avx2::detect() {
            return Self(Kind::Avx2(avx2));
        }
        Self::PORTABLE
    }

    /// Every level of this machine, the best last.
    #[must_use]
    pub fn available() -> Vec<Self> {
        let best = Self::detect();
        if matches!(best.0, Kind::Portable) { vec![best] } else { vec![Self::PORTABLE, best] }
    }

    /// The level of this name, where the machine has it.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::available().into_iter().find(|level| level.name() == name)
    }

    /// `portable` or `avx2`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(_) => "avx2",
        }
    }

    /// Runs `kernel` compiled for this level.
    #[inline]
    pub fn dispatch<K: Kernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Kind::Portable => kernel.run(Portable),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(avx2) => avx2.run(kernel),
        }
    }
}

impl Default for Level {
    fn default() -> Self {
        Self::detect()
    }
}
