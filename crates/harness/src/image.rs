//! Image files, and environment maps.

use crate::scene::check;
use crate::scratch::{Scratch, limits};
use vastlight::film::read_picture;
use vastlight::import::{decode_image, load_environment};
use vastlight::scene::{Diagnostics, Texels};

/// An image of any format, as a texture, as an environment map and as a picture to compare with.
pub(crate) fn run(bytes: &[u8]) {
    if let Ok(image) = decode_image(bytes, "image", &limits()) {
        check::image(&image);
    }
    let extension = if bytes.starts_with(b"\x76\x2f\x31\x01") { "image.exr" } else { "image.hdr" };
    let scratch = Scratch::with(&[(extension, bytes)]);
    let path = scratch.path(extension);
    if let Ok(map) = load_environment(&path, &limits(), &mut Diagnostics::default()) {
        check::image(&map);
        let Texels::F32(values) = &map.texels else { panic!("maps are floats") };
        assert!(map.channels == 3 && values.iter().all(|value| value.is_finite() && *value >= 0.0));
    }
    if let Ok(picture) = read_picture(&path) {
        let pixels = u64::from(picture.window.width()) * u64::from(picture.window.height());
        assert!(picture.planes.iter().all(|plane| plane.values.len() as u64 == pixels));
    }
}
