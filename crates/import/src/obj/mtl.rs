//! The statements of an MTL file.

use crate::number::parse_f32;
use crate::scan::{Source, Words};
use crate::{ImportError, Limits};
use std::io::Read;
use vastlight_math::{Vec2, Vec3};
use vastlight_scene::Diagnostics;

/// A texture statement: a file and its options.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub(super) file: String,
    pub(super) offset: Vec2,
    pub(super) scale: Vec2,
    pub(super) clamp: bool,
    /// `-bm`.
    pub(super) bump: f32,
}

/// Which statement a [`Map`] stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    Diffuse,
    Specular,
    Emission,
    Opacity,
    Bump,
    Normal,
    Roughness,
    Metallic,
}

pub(super) const SLOTS: usize = 8;

/// A material as the file has it; what it does not state is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MtlMaterial {
    pub(super) name: String,
    pub(super) diffuse: Option<Vec3>,
    pub(super) specular: Option<Vec3>,
    pub(super) emission: Option<Vec3>,
    /// Tf.
    pub(super) filter: Option<Vec3>,
    pub(super) exponent: Option<f32>,
    pub(super) ior: Option<f32>,
    /// d.
    pub(super) opacity: Option<f32>,
    /// Tr.
    pub(super) transparency: Option<f32>,
    pub(super) illum: Option<f32>,
    pub(super) roughness: Option<f32>,
    pub(super) metallic: Option<f32>,
    pub(super) sheen: Option<Vec3>,
    pub(super) clearcoat: Option<f32>,
    pub(super) clearcoat_roughness: Option<f32>,
    pub(super) anisotropy: Option<f32>,
    pub(super) anisotropy_rotation: Option<f32>,
    pub(super) maps: [Option<Map>; SLOTS],
}

/// Reads the materials of a library; unknown statements are named in `diagnostics`.
pub(super) fn parse<R: Read>(
    mut source: Source<R>,
    limits: &Limits,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<MtlMaterial>, ImportError> {
    let file = source.file().to_owned();
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut unknown: Vec<String> = Vec::new();
    while let Some(line) = source.line()? {
        let mut words = Words(line);
        let Some(keyword) = words.next().filter(|w| !w.starts_with(b"#")) else { continue };
        let keyword = String::from_utf8_lossy(keyword).to_ascii_lowercase();
        if keyword == "newmtl" {
            limits.check_count(materials.len() as u64 + 1, limits.items, "materials", &file)?;
            let name = String::from_utf8_lossy(words.0.trim_ascii()).into_owned();
            materials.push(MtlMaterial { name, ..MtlMaterial::default() });
            continue;
        }
        let Some(material) = materials.last_mut() else { continue };
        let known = material.set(&keyword, words);
        match known {
            Ok(true) => {}
            Ok(false) if unknown.len() < 32 && !unknown.contains(&keyword) => unknown.push(keyword),
            Ok(false) => {}
            Err(what) => {
                diagnostics.warn(
                    format!("{keyword}: {what}"),
                    source.line_place(),
                    "the statement is left out",
                );
            }
        }
    }
    for keyword in unknown {
        let what = format!("the material statement \"{}\" is not supported", keyword.escape_default());
        diagnostics.warn(what, &file, "it is left out");
    }
    Ok(materials)
}

impl MtlMaterial {
    /// The map of a slot.
    pub(super) fn map(&self, slot: Slot) -> Option<&Map> {
        self.maps[slot as usize].as_ref()
    }

    /// Understands one statement; `Ok(false)` if it is not a known one.
    fn set(&mut self, keyword: &str, words: Words<'_>) -> Result<bool, String> {
        if let Some(slot) = slot(keyword) {
            self.maps[slot as usize] = Some(parse_map(words)?);
            return Ok(true);
        }
        let scalar = || scalar(words).map(Some);
        match keyword {
            "kd" => self.diffuse = Some(color(words)?),
            "ks" => self.specular = Some(color(words)?),
            "ke" => self.emission = Some(color(words)?),
            "tf" => self.filter = Some(color(words)?),
            "ps" => self.sheen = Some(color(words)?),
            "ns" => self.exponent = scalar()?,
            "ni" => self.ior = scalar()?,
            // "d -halo factor"
            "d" => self.opacity = Some(scalar_of(words.last().unwrap_or_default())?),
            "tr" => self.transparency = scalar()?,
            "illum" => self.illum = scalar()?,
            "pr" => self.roughness = scalar()?,
            "pm" => self.metallic = scalar()?,
            "pc" => self.clearcoat = scalar()?,
            "pcr" => self.clearcoat_roughness = scalar()?,
            "aniso" => self.anisotropy = scalar()?,
            "anisor" => self.anisotropy_rotation = scalar()?,
            // Ambient light does not exist here; sharpness and antialiasing concern other renderers.
            "ka" | "map_ka" | "sharpness" | "map_aat" => {}
            _ => return Ok(false),
        }
        Ok(true)
    }
}

fn slot(keyword: &str) -> Option<Slot> {
    Some(match keyword {
        "map_kd" => Slot::Diffuse,
        "map_ks" => Slot::Specular,
        "map_ke" => Slot::Emission,
        "map_d" => Slot::Opacity,
        "bump" | "map_bump" => Slot::Bump,
        "norm" | "map_norm" | "map_kn" => Slot::Normal,
        "map_pr" => Slot::Roughness,
        "map_pm" => Slot::Metallic,
        _ => return None,
    })
}

fn scalar_of(word: &[u8]) -> Result<f32, String> {
    let value = parse_f32(word).filter(|v| v.is_finite());
    value.ok_or_else(|| format!("\"{}\" is not a number", String::from_utf8_lossy(word)))
}

fn scalar(mut words: Words<'_>) -> Result<f32, String> {
    scalar_of(words.next().unwrap_or_default())
}

/// `r g b`, or `r` for grey, or `xyz x y z`.
fn color(mut words: Words<'_>) -> Result<Vec3, String> {
    let first = words.next().unwrap_or_default();
    match first {
        b"spectral" => return Err("spectral curves are not supported".into()),
        b"xyz" => {
            let [x, y, z] = [scalar(words)?, nth(words, 1)?, nth(words, 2)?];
            let rgb = Vec3::new(
                3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
                -0.969_266 * x + 1.876_010_8 * y + 0.041_556 * z,
                0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
            );
            return Ok(rgb.max(Vec3::ZERO));
        }
        _ => {}
    }
    let r = scalar_of(first)?;
    let Some(g) = words.next() else { return Ok(Vec3::splat(r)) };
    let g = scalar_of(g)?;
    let b = words.next().map_or(Ok(g), scalar_of)?;
    Ok(Vec3::new(r, g, b).max(Vec3::ZERO))
}

fn nth(mut words: Words<'_>, n: usize) -> Result<f32, String> {
    scalar_of(words.nth(n).unwrap_or_default())
}

/// Options, then a file name that may contain blanks.
fn parse_map(mut words: Words<'_>) -> Result<Map, String> {
    let mut map = Map { file: String::new(), offset: Vec2::ZERO, scale: Vec2::ONE, clamp: false, bump: 1.0 };
    loop {
        let rest = words.0.trim_ascii();
        if !rest.starts_with(b"-") {
            map.file = String::from_utf8_lossy(rest).replace('\\', "/");
            break;
        }
        let option = words.next().unwrap_or_default();
        match option {
            b"-o" => map.offset = up_to_three(&mut words, Vec2::ZERO),
            b"-s" => map.scale = up_to_three(&mut words, Vec2::ONE),
            b"-t" => drop(up_to_three(&mut words, Vec2::ZERO)),
            b"-clamp" => map.clamp = words.next() == Some(b"on"),
            b"-bm" => map.bump = scalar_of(words.next().unwrap_or_default())?,
            b"-mm" => drop(words.nth(1)),
            b"-blendu" | b"-blendv" | b"-cc" | b"-boost" | b"-texres" | b"-imfchan" | b"-type" => {
                words.next();
            }
            other => return Err(format!("unknown option \"{}\"", String::from_utf8_lossy(other))),
        }
    }
    if map.file.is_empty() { Err("the file name is missing".into()) } else { Ok(map) }
}

/// One to three numbers; the third (w) is of no use for images.
fn up_to_three(words: &mut Words<'_>, default: Vec2) -> Vec2 {
    let mut values = [default.x, default.y, 0.0];
    for value in &mut values {
        let mut ahead = *words;
        let Some(number) = ahead.next().and_then(|w| scalar_of(w).ok()) else { break };
        *value = number;
        *words = ahead;
    }
    Vec2::new(values[0], values[1])
}
