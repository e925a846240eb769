//! Image files, and environment maps.

use crate::scene::check;
use crate::scratch::{Scratch, limits};
use vastlight::film::read_picture;
use vastlight::import::{decode_image, load_environment};
use vastlight::scene::{Diagnostics, Texels};

/// An image of any format, as a texture, as an environment map and as a picture to compare with.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let texture = decode_image(bytes, "image", &limits());
    if let Ok(image) = &texture {
        check::image(image);
    }
    let extension = if bytes.starts_with(b"\x76\x2f\x31\x01") { "image.exr" } else { "image.hdr" };
    let scratch = Scratch::with(&[(extension, bytes)]);
    let path = scratch.path(extension);
    let map = load_environment(&path, &limits(), &mut Diagnostics::default());
    if let Ok(map) = &map {
        check::image(map);
        let Texels::F32(values) = &map.texels else { panic!("maps are floats") };
        assert!(map.channels == 3 && values.iter().all(|value| value.is_finite() && *value >= 0.0));
    }
    let picture = read_picture(&path);
    if let Ok(picture) = &picture {
        let pixels = u64::from(picture.window.width()) * u64::from(picture.window.height());
        assert!(picture.planes.iter().all(|plane| plane.values.len() as u64 == pixels));
    }
    texture.is_ok() || map.is_ok() || picture.is_ok()
}
