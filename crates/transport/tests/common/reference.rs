//! Pictures that others have made, and the comparison with them.

#![allow(clippy::print_stderr, reason = "a skipped comparison is named, figures are shown")]

use super::Picture;
use exr::prelude as exr;
use std::path::PathBuf;

/// A picture of linear RGB, rows from the top.
pub(crate) struct Reference {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) pixels: Vec<[f64; 3]>,
}

/// A file of the model collection, or a line that says what is skipped.
pub(crate) fn model(path: &str) -> Option<PathBuf> {
    let sibling = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/models");
    let root = std::env::var_os("VASTLIGHT_MODELS").map_or(sibling, PathBuf::from);
    let file = root.join(path);
    if file.is_file() {
        return Some(file);
    }
    eprintln!("skipped: {path} is not there (set VASTLIGHT_MODELS)");
    None
}

/// Whether the long comparisons are asked for.
pub(crate) fn soak() -> bool {
    std::env::var_os("VASTLIGHT_SOAK").is_some_and(|v| v == "1")
}

impl Reference {
    /// Reads an OpenEXR file's R, G and B.
    pub(crate) fn read(file: &std::path::Path) -> Self {
        let image = exr::read_first_rgba_layer_from_file(
            file,
            |size, _| Self { width: size.0, height: size.1, pixels: vec![[0.0; 3]; size.0 * size.1] },
            |image, at, (r, g, b, _a): (f32, f32, f32, f32)| {
                image.pixels[at.1 * image.width + at.0] = [r, g, b].map(f64::from);
            },
        );
        image.expect("a readable reference").layer_data.channel_data.pixels
    }

    /// Means over blocks of `factor` x `factor` pixels.
    pub(crate) fn reduced(&self, factor: usize) -> Self {
        let (width, height) = (self.width / factor, self.height / factor);
        let mean = |x: usize, y: usize, c: usize| {
            let inside = (0..factor * factor)
                .map(|i| self.pixels[(y * factor + i / factor) * self.width + x * factor + i % factor][c]);
            inside.sum::<f64>() / (factor * factor) as f64
        };
        let pixels = (0..width * height).map(|i| std::array::from_fn(|c| mean(i % width, i / width, c)));
        Self { width, height, pixels: pixels.collect() }
    }

    /// This picture times `factor`: the negative control.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let pixels = self.pixels.iter().map(|p| p.map(|x| x * factor)).collect();
        Self { pixels, ..*self }
    }
}

/// How a rendered picture differs from a reference.
#[derive(Debug)]
pub(crate) struct Comparison {
    /// Mean of ours over mean of theirs.
    pub(crate) mean_ratio: f64,
    /// mean((a - b)^2 / (b^2 + 0.01)) over pixels and channels.
    pub(crate) relmse: f64,
    /// Of pixels and channels: the share more than 3 standard errors away.
    pub(crate) outliers: f64,
    /// Mean of the signed distance in standard errors.
    pub(crate) mean_z: f64,
}

impl Comparison {
    /// Compares where `keep` says so, by pixel number. The reference's own error is taken as `floor` of its value.
    pub(crate) fn new(ours: &Picture, theirs: &Reference, floor: f64, keep: impl Fn(usize) -> bool) -> Self {
        assert_eq!(ours.mean.len(), theirs.pixels.len());
        let (mut a_sum, mut b_sum, mut relmse, mut outliers, mut z_sum, mut n) =
            (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for i in (0..ours.mean.len()).filter(|&i| keep(i)) {
            for c in 0..3 {
                let (a, b) = (ours.mean[i][c], theirs.pixels[i][c]);
                let error = ours.variance[i][c] / f64::from(ours.samples) + (floor * b).powi(2) + 1e-12;
                let z = (a - b) / error.sqrt();
                a_sum += a;
                b_sum += b;
                relmse += (a - b).powi(2) / (b * b + 0.01);
                outliers += f64::from(u8::from(z.abs() > 3.0));
                z_sum += z;
                n += 1.0;
            }
        }
        Self { mean_ratio: a_sum / b_sum, relmse: relmse / n, outliers: outliers / n, mean_z: z_sum / n }
    }
}
