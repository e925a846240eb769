//! Kd-trees by name.

use super::{Cuts, KdConfig};

/// Names that [`KdKind::from_name`] knows.
pub const NAMES: [&str; 4] = ["kd-threaded", "kd-threaded-sah", "kd-stack", "kd-stack-sah"];

/// How a kd-tree is cut and walked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KdKind {
    /// How planes are chosen.
    pub cuts: Cuts,
    /// Walked with a stack; otherwise by threads.
    pub stacked: bool,
    /// The name.
    pub name: &'static str,
}

impl KdKind {
    /// The kind of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let name = NAMES.into_iter().find(|known| *known == name)?;
        let cuts = if name.ends_with("-sah") { Cuts::SurfaceArea } else { Cuts::Median };
        Some(Self { cuts, stacked: name.starts_with("kd-stack"), name })
    }

    /// How trees of this kind are built.
    #[must_use]
    pub fn config(&self) -> KdConfig {
        // The heuristic cuts off empty space and leaves the rest to later cuts: its trees are deeper.
        let spare_levels = if self.cuts == Cuts::SurfaceArea { 12 } else { 6 };
        KdConfig { cuts: self.cuts, spare_levels, ..KdConfig::default() }
    }
}
