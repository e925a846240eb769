//! EXR: every plane in linear f32, losslessly compressed, with colour tags and mattes.

use crate::exr_header::sort_attributes;
use crate::{FilmError, Picture, write_atomically};
use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image,
    ImageAttributes, IntegerBounds, Layer, LayerAttributes, LineOrder, SmallVec, Text, Vec2, WritableImage,
};
use std::io::{self, Cursor};
use std::path::Path;

/// Writes all planes of a picture as one EXR part. The same picture gives the same bytes.
///
/// # Errors
/// If the file cannot be written.
pub fn write_exr(path: &Path, picture: &Picture) -> Result<(), FilmError> {
    let bytes = encode_exr(picture).map_err(|e| FilmError::write(path, e))?;
    write_atomically(path, |w| w.write_all(&bytes))
}

/// The bytes of an EXR file of all planes.
///
/// # Errors
/// If the picture has no pixels.
pub fn encode_exr(picture: &Picture) -> io::Result<Vec<u8>> {
    encode(picture).map_err(io::Error::other)
}

fn encode(picture: &Picture) -> exr::error::Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    image(picture)?.write().to_buffered(&mut bytes)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn image(picture: &Picture) -> exr::error::Result<Image<Layer<AnyChannels<FlatSamples>>>> {
    let [full_width, full_height] = picture.full_size.map(|n| n as usize);
    let [width, height] = picture.size().map(|n| n as usize);
    let mut layer = LayerAttributes {
        layer_position: Vec2(picture.window.x0 as i32, picture.window.y0 as i32),
        ..LayerAttributes::default()
    };
    for (name, text) in picture.mattes.iter().flat_map(crate::Cryptomatte::attributes) {
        layer.other.insert(Text::from(name.as_str()), AttributeValue::Text(Text::from(text.as_str())));
    }
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions((full_width, full_height)));
    attributes.chromaticities = Some(rec709());
    attributes
        .other
        .insert(Text::from("colorInteropID"), AttributeValue::Text(Text::from("lin_rec709_scene")));
    if let Some(denoiser) = &picture.denoiser {
        let text = AttributeValue::Text(Text::from(denoiser.as_str()));
        attributes.other.insert(Text::from("denoiser"), text);
    }
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    Ok(Image { attributes, layer_data: Layer::new((width, height), layer, encoding, channels(picture)) })
}

fn channels(picture: &Picture) -> AnyChannels<FlatSamples> {
    let channel = |plane: &crate::Plane| {
        AnyChannel::new(Text::from(plane.name.as_str()), FlatSamples::F32(plane.values.clone()))
    };
    AnyChannels::sort(picture.planes.iter().map(channel).collect::<SmallVec<_>>())
}

/// Primaries and white of Rec. 709 (and sRGB).
fn rec709() -> Chromaticities {
    Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Cryptomatte, Plane, Window, read_picture};

    fn picture() -> Picture {
        let window = Window { x0: 3, y0: 2, x1: 20, y1: 13 };
        let plane = |name: &str, scale: f32| Plane {
            name: name.into(),
            values: (0..window.pixels()).map(|i| (i as f32).sqrt() * scale - 3.0).collect(),
        };
        Picture {
            full_size: [32, 16],
            window,
            planes: vec![plane("R", 1.0), plane("G", 1e-9), plane("B", 1e9), plane("normal.X", 0.1)],
            mattes: vec![
                Cryptomatte::new("CryptoObject", ["a", "b", "c"]),
                Cryptomatte::new("CryptoMaterial", ["d"]),
            ],
            denoiser: Some("a filter".into()),
        }
    }

    #[test]
    fn planes_come_back_bit_for_bit() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("a.exr");
        let written = picture();
        write_exr(&path, &written).expect("written");
        let read = read_picture(&path).expect("read");
        assert_eq!((read.full_size, read.window), (written.full_size, written.window));
        for plane in &written.planes {
            assert_eq!(read.plane(&plane.name), Some(&plane.values[..]), "{}", plane.name);
        }
    }

    #[test]
    fn the_same_picture_is_the_same_bytes() {
        let first = encode_exr(&picture()).expect("encoded");
        // Hash maps are seeded anew each time: eight attributes would show another order soon.
        for _ in 0..8 {
            assert_eq!(encode_exr(&picture()).expect("encoded"), first);
        }
        let mut other = picture();
        other.planes[0].values[0] += 1.0;
        assert_ne!(encode_exr(&other).expect("encoded"), first);
    }

    #[test]
    fn tags_and_manifest_are_in_the_header() {
        let bytes = encode_exr(&picture()).expect("encoded");
        let meta = exr::meta::MetaData::read_from_buffered(&bytes[..], true).expect("valid header");
        let header = &meta.headers[0];
        assert_eq!(header.shared_attributes.chromaticities, Some(rec709()));
        let text = |name: &str| {
            let own = header.own_attributes.other.get(&Text::from(name));
            match own.or_else(|| header.shared_attributes.other.get(&Text::from(name))) {
                Some(AttributeValue::Text(text)) => text.to_string(),
                other => panic!("{name}: {other:?}"),
            }
        };
        assert_eq!(text("denoiser"), "a filter");
        for (name, value) in Cryptomatte::new("CryptoObject", ["a", "b", "c"]).attributes() {
            assert_eq!(text(&name), value);
        }
        assert!(header.own_attributes.capture_date.is_none() && header.own_attributes.owner.is_none());
    }
}
