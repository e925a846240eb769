//! A developed picture: named planes of linear f32.

use crate::{Aov, Cryptomatte, Window};

/// One channel of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Name as in an EXR file: `R`, `albedo.G`, `normal.X`.
    pub name: String,
    /// One value a pixel, rows from the top.
    pub values: Vec<f32>,
}

/// A picture, or the crop of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height of the whole picture.
    pub full_size: [u32; 2],
    /// The part that is here.
    pub window: Window,
    /// Channels; `R`, `G` and `B` come first.
    pub planes: Vec<Plane>,
    /// Matte layers whose channels are among the planes.
    pub mattes: Vec<Cryptomatte>,
    /// What took the noise out of the colour, for the metadata of files; `None` for the means of samples.
    pub denoiser: Option<String>,
}

impl Picture {
    /// A picture of three planes.
    #[must_use]
    pub fn from_rgb(width: u32, height: u32, rgb: [Vec<f32>; 3]) -> Self {
        let plane = |(name, values): (&str, Vec<f32>)| Plane { name: name.to_owned(), values };
        Self {
            full_size: [width, height],
            window: Window::whole(width, height),
            planes: ["R", "G", "B"].into_iter().zip(rgb).map(plane).collect(),
            mattes: Vec::new(),
            denoiser: None,
        }
    }

    /// Width and height of the part that is here.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.window.width(), self.window.height()]
    }

    /// The values of a channel.
    #[must_use]
    pub fn plane(&self, name: &str) -> Option<&[f32]> {
        self.planes.iter().find(|p| p.name == name).map(|p| &p.values[..])
    }

    /// Three channels, if all are there.
    #[must_use]
    pub fn three(&self, names: [&str; 3]) -> Option<[&[f32]; 3]> {
        let [a, b, c] = names.map(|name| self.plane(name));
        Some([a?, b?, c?])
    }

    /// The three colour channels, if all are there.
    #[must_use]
    pub fn rgb(&self) -> Option<[&[f32]; 3]> {
        self.three(["R", "G", "B"])
    }

    /// Puts other values into the three colour channels.
    pub fn set_rgb(&mut self, rgb: [Vec<f32>; 3]) {
        for (name, values) in ["R", "G", "B"].into_iter().zip(rgb) {
            if let Some(plane) = self.planes.iter_mut().find(|plane| plane.name == name) {
                plane.values = values;
            }
        }
    }

    /// Takes out the channels of an auxiliary output that is one vector a pixel; others stay.
    pub fn remove(&mut self, aov: Aov) {
        if let Some(names) = aov.vector_channels() {
            self.planes.retain(|plane| !names.contains(&plane.name.as_str()));
        }
    }
}
