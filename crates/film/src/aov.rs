//! The names of what a film can record beside radiance.

use std::{fmt, str::FromStr};

/// An auxiliary output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Aov {
    /// Reflectance of the first surface, linear RGB, 0 where nothing is hit.
    Albedo,
    /// Shading normal of the first surface in world space, 0 where nothing is hit.
    Normal,
    /// Distance from the camera's plane along its axis, scene units: the mean over samples that hit, 0 where none does.
    Depth,
    /// The fraction of samples that hit something.
    Alpha,
    /// World-space position of the first surface: the mean over samples that hit, 0 where none does.
    Position,
    /// Cryptomatte of objects, by instance name.
    Object,
    /// Cryptomatte of materials, by material name.
    Material,
}

impl Aov {
    /// Every output in the order of its definition.
    pub const ALL: [Self; 7] =
        [Self::Albedo, Self::Normal, Self::Depth, Self::Alpha, Self::Position, Self::Object, Self::Material];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Alpha => "alpha",
            Self::Position => "position",
            Self::Object => "object",
            Self::Material => "material",
        }
    }

    /// The channels of an output that is one vector a pixel.
    #[must_use]
    pub const fn vector_channels(self) -> Option<[&'static str; 3]> {
        match self {
            Self::Albedo => Some(["albedo.R", "albedo.G", "albedo.B"]),
            Self::Normal => Some(["normal.X", "normal.Y", "normal.Z"]),
            Self::Position => Some(["position.X", "position.Y", "position.Z"]),
            _ => None,
        }
    }
}

impl fmt::Display for Aov {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Aov {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|a| a.name() == name).ok_or_else(|| {
            let known: Vec<_> = Self::ALL.iter().map(|a| a.name()).collect();
            format!("unknown AOV \"{name}\"; known are {}", known.join(", "))
        })
    }
}
