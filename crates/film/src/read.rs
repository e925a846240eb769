//! Reading pictures back: EXR, PNG, Radiance HDR.

use crate::{FilmError, Picture, Plane, Window, linear_from_srgb};
use exr::prelude::{ReadChannels, ReadLayers, read};
use std::path::Path;

/// Reads an EXR, PNG or HDR file as linear planes. Integer images are decoded from sRGB.
///
/// # Errors
/// If the file is missing, broken or of another format.
pub fn read_picture(path: &Path) -> Result<Picture, FilmError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "exr" => read_exr(path),
        "png" | "hdr" => read_with_image(path),
        _ => Err(FilmError::read(path, "pictures are .exr, .png or .hdr")),
    }
}

fn read_exr(path: &Path) -> Result<Picture, FilmError> {
    let reader =
        read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = reader.from_file(path).map_err(|e| FilmError::read(path, e))?;
    let layer = image.layer_data;
    let window = image.attributes.display_window;
    let position = layer.attributes.layer_position;
    let offset = |at: i32, origin: i32| u32::try_from(i64::from(at) - i64::from(origin)).unwrap_or(0);
    let [x0, y0] = [offset(position.0, window.position.0), offset(position.1, window.position.1)];
    let [width, height] = [layer.size.0 as u32, layer.size.1 as u32];
    let planes = layer.channel_data.list.into_iter().map(|channel| Plane {
        name: channel.name.to_string(),
        values: channel.sample_data.values_as_f32().collect(),
    });
    Ok(Picture {
        full_size: [window.size.0 as u32, window.size.1 as u32],
        window: Window { x0, y0, x1: x0.saturating_add(width), y1: y0.saturating_add(height) },
        planes: planes.collect(),
        mattes: Vec::new(),
        denoiser: None,
    })
}

fn read_with_image(path: &Path) -> Result<Picture, FilmError> {
    let image = image::open(path).map_err(|e| FilmError::read(path, e))?;
    let float = matches!(image, image::DynamicImage::ImageRgb32F(_) | image::DynamicImage::ImageRgba32F(_));
    let decode = |x: f32| if float { x } else { linear_from_srgb(x) };
    let rgb = image.into_rgb32f();
    let (width, height) = rgb.dimensions();
    let plane = |channel: usize| rgb.as_raw().iter().skip(channel).step_by(3).map(|&x| decode(x)).collect();
    Ok(Picture::from_rgb(width, height, [plane(0), plane(1), plane(2)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BitDepth, PngOptions, ToneCurve, write_png};

    #[test]
    fn png_comes_back_linear() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("a.png");
        let values: Vec<f32> = (0..256).map(|i| i as f32 / 256.0).collect();
        let picture = Picture::from_rgb(16, 16, [values.clone(), values.clone(), values]);
        for (depth, tolerance) in [(BitDepth::Eight, 5e-3), (BitDepth::Sixteen, 3e-5)] {
            let options = PngOptions { exposure: 0.0, curve: ToneCurve::Linear, depth, dither: false };
            write_png(&path, &picture, &options).expect("written");
            let read = read_picture(&path).expect("read");
            let pairs = read.planes[1].values.iter().zip(&picture.planes[1].values);
            assert!(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) < tolerance);
        }
    }

    #[test]
    fn broken_files_are_errors() {
        let folder = tempfile::tempdir().expect("temporary folder");
        for name in ["a.exr", "a.png", "a.hdr", "a.txt"] {
            let path = folder.path().join(name);
            assert!(read_picture(&path).is_err());
            std::fs::write(&path, b"v/1\x01 this is no picture").expect("written");
            assert!(read_picture(&path).expect_err("broken").to_string().contains(name));
        }
    }
}
