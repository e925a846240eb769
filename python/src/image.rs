//! Finished pictures.

use crate::errors::{OrRaise, not_encoded, usage};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use numpy::{IntoPyArray, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use vastlight::film::{
    BitDepth, Picture, PngOptions, encode_exr, encode_png, quantise, write_atomically, write_exr, write_png,
};
use vastlight::{Error, ErrorClass};

/// Quality of JPEG files.
const JPEG_QUALITY: u8 = 92;

/// Linear planes of a picture, and what they cost.
#[pyclass(frozen, module = "vastlight._native")]
#[derive(Debug)]
pub(crate) struct Image {
    picture: Picture,
    stats: String,
}

impl Image {
    /// A picture with figures as JSON.
    pub(crate) fn new(picture: Picture, stats: String) -> Self {
        Self { picture, stats }
    }
}

/// How linear colours become those of a file.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Tone {
    exposure: f32,
    tonemap: String,
    bit_depth: u8,
    dither: bool,
}

impl Tone {
    fn options(&self) -> Result<PngOptions, Error> {
        let curve = self.tonemap.parse().map_err(|what: String| Error::usage(what, "tonemap", ""))?;
        let depth = match self.bit_depth {
            8 => BitDepth::Eight,
            16 => BitDepth::Sixteen,
            _ => return Err(Error::usage("a PNG has 8 or 16 bits a channel", "bit_depth", "")),
        };
        if !self.exposure.is_finite() {
            return Err(Error::usage("a number is expected", "exposure", ""));
        }
        Ok(PngOptions { exposure: self.exposure, curve, depth, dither: self.dither })
    }
}

/// The bytes of a JPEG file of the colour channels.
fn encode_jpeg(picture: &Picture, tone: &PngOptions) -> Result<Vec<u8>, Error> {
    let failed = |what: String| Error::new(ErrorClass::Output, what, "jpg", "write to .png or .exr");
    let tone = PngOptions { depth: BitDepth::Eight, ..*tone };
    let samples = quantise(picture, &tone).ok_or_else(|| failed("the picture has no R, G and B".into()))?;
    let [Ok(width), Ok(height)] = picture.size().map(u16::try_from) else {
        return Err(failed("a JPEG has at most 65535 pixels an edge".into()));
    };
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, JPEG_QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_1_1);
    encoder.encode(&samples, width, height, ColorType::Rgb).map_err(|e| failed(e.to_string()))?;
    Ok(bytes)
}

#[pymethods]
impl Image {
    /// Width and height in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        self.picture.size().into()
    }

    /// First column and row, and one past the last, in the whole picture.
    #[getter]
    fn window(&self) -> (u32, u32, u32, u32) {
        let w = self.picture.window;
        (w.x0, w.y0, w.x1, w.y1)
    }

    /// Names of all planes.
    #[getter]
    fn planes(&self) -> Vec<&str> {
        self.picture.planes.iter().map(|plane| plane.name.as_str()).collect()
    }

    /// Figures as JSON.
    #[getter]
    fn stats(&self) -> &str {
        &self.stats
    }

    /// Planes side by side: (H, W, C) float32.
    fn array<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let plane = |name: &String| {
            self.picture
                .plane(name)
                .ok_or_else(|| usage(py, format!("there is no plane \"{name}\""), "planes", ""))
        };
        let planes = names.iter().map(plane).collect::<PyResult<Vec<_>>>()?;
        let [width, height] = self.picture.size().map(|n| n as usize);
        let count = planes.len();
        let values: Vec<f32> = py.detach(|| {
            let pixel = |i: usize| planes.iter().map(move |plane| plane[i]);
            (0..width * height).flat_map(pixel).collect()
        });
        values.into_pyarray(py).reshape([height, width, count])
    }

    /// Writes a file of the kind that its extension says.
    fn save(&self, py: Python<'_>, path: PathBuf, tone: Tone) -> PyResult<()> {
        let Self { picture, .. } = self;
        let write = || {
            let tone = tone.options()?;
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            match extension.to_ascii_lowercase().as_str() {
                "png" => Ok(write_png(&path, picture, &tone)?),
                "exr" => Ok(write_exr(&path, picture)?),
                "jpg" | "jpeg" => {
                    let bytes = encode_jpeg(picture, &tone)?;
                    Ok(write_atomically(&path, |w| w.write_all(&bytes))?)
                }
                _ => {
                    let place = path.display().to_string();
                    Err(Error::usage("unknown kind of picture", place, "write to .png, .exr or .jpg"))
                }
            }
        };
        py.detach(write).or_raise(py)
    }

    /// The bytes of a file: `png`, `exr` or `jpg`.
    fn encode<'py>(&self, py: Python<'py>, format: &str, tone: Tone) -> PyResult<Bound<'py, PyBytes>> {
        let encode = || {
            let tone = tone.options()?;
            match format {
                "png" => encode_png(&self.picture, &tone).map_err(|e| not_encoded(&e)),
                "exr" => encode_exr(&self.picture).map_err(|e| not_encoded(&e)),
                "jpg" => encode_jpeg(&self.picture, &tone),
                _ => Err(Error::usage(
                    format!("unknown kind of picture \"{format}\""),
                    "format",
                    "png, exr or jpg",
                )),
            }
        };
        Ok(PyBytes::new(py, &py.detach(encode).or_raise(py)?))
    }
}
