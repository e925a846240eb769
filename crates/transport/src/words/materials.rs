//! Materials as words: for each a record of [`WORDS`] words, with an entry for each of its inputs.

use super::{Words, texture_number};
use crate::material::Row;
use crate::stream::is_clear;
use vastlight_math::Vec3;
use vastlight_scene::{AlphaMode, Channel, ColorInput, ScalarInput};

/// Words of a material: these and its inputs.
pub const WORDS: usize = INPUTS + ALL_INPUTS * INPUT_WORDS;
/// Bits of the first word.
pub mod flags {
    /// Shows its emission alone.
    pub const UNLIT: u32 = 1;
    /// The back emits like the front.
    pub const TWO_SIDED: u32 = 1 << 1;
    /// The tangent of the frame matters.
    pub const NEEDS_TANGENT: u32 = 1 << 2;
    /// Rays may pass by alpha.
    pub const ALPHA: u32 = 1 << 3;
    /// Alpha is tested against the cutoff.
    pub const MASK: u32 = 1 << 4;
    /// Shadow rays may pass since it may be a smooth thin wall.
    pub const PANE: u32 = 1 << 5;
    /// Infinitely thin walls.
    pub const THIN: u32 = 1 << 6;
    /// There is a measured metal.
    pub const CONDUCTOR: u32 = 1 << 7;
    /// There is a normal map.
    pub const NORMAL_MAP: u32 = 1 << 8;
    /// There is a normal map of the clear coat.
    pub const COAT_NORMAL_MAP: u32 = 1 << 9;
    /// Stretch and its direction come from a texture.
    pub const ANISOTROPY_TEXTURE: u32 = 1 << 10;
    /// The thickness of the film comes from a texture.
    pub const THICKNESS_TEXTURE: u32 = 1 << 11;
    /// Shadow rays of the integrator `whitted` pass.
    pub const CLEAR: u32 = 1 << 12;
}
/// Texture coordinate sets that are read.
pub const UV_SETS: usize = 1;
/// Index of refraction.
pub const IOR: usize = 2;
/// Absorption of the inside, three numbers.
pub const ATTENUATION: usize = 3;
/// Complex index and mean reflectance of a measured metal, three times three numbers.
pub const CONDUCTOR: usize = 6;
/// 20 / Abbe number.
pub const DISPERSION: usize = 15;
/// Stretch of the highlight.
pub const ANISOTROPY: usize = 16;
/// Its direction, two numbers.
pub const ANISOTROPY_DIRECTION: usize = 17;
/// Index of the thin film.
pub const IRIDESCENCE_IOR: usize = 19;
/// Least and greatest thickness of the film.
pub const THICKNESS: usize = 20;
/// Least alpha that is there.
pub const CUTOFF: usize = 22;
/// Scales of the normal map and of the clear coat's.
pub const NORMAL_SCALES: usize = 23;
/// Where the inputs begin.
pub const INPUTS: usize = 25;
/// Words of an input: factor (three numbers), texture or `u32::MAX`, channel (0 to 3, or 4 for colours).
pub const INPUT_WORDS: usize = 5;
/// In the word of the channel: looked up at the point alone.
pub const EXACT: u32 = 1 << 8;
/// How many inputs there are, in the order of `input`.
pub const ALL_INPUTS: usize = 17;

/// Numbers of the inputs.
pub mod input {
    /// Coverage.
    pub const ALPHA: usize = 0;
    /// Base colour.
    pub const BASE_COLOR: usize = 1;
    /// Metallic.
    pub const METALLIC: usize = 2;
    /// Roughness.
    pub const ROUGHNESS: usize = 3;
    /// Transmission.
    pub const TRANSMISSION: usize = 4;
    /// Strength of the dielectric reflection.
    pub const SPECULAR: usize = 5;
    /// Its colour.
    pub const SPECULAR_COLOR: usize = 6;
    /// Weight of the clear coat.
    pub const CLEARCOAT: usize = 7;
    /// Its roughness.
    pub const CLEARCOAT_ROUGHNESS: usize = 8;
    /// Colour of the sheen.
    pub const SHEEN_COLOR: usize = 9;
    /// Its roughness.
    pub const SHEEN_ROUGHNESS: usize = 10;
    /// Weight of the thin film.
    pub const IRIDESCENCE: usize = 11;
    /// The texture of its thickness.
    pub const THICKNESS: usize = 12;
    /// The texture of the stretch.
    pub const ANISOTROPY: usize = 13;
    /// The normal map.
    pub const NORMAL: usize = 14;
    /// The clear coat's.
    pub const COAT_NORMAL: usize = 15;
    /// Emission.
    pub const EMISSION: usize = 16;
}

/// An input on its way: factor, texture, channel, whether it is looked up exactly.
#[derive(Clone, Copy)]
struct Input {
    factor: Vec3,
    texture: Option<u32>,
    channel: u32,
    exact: bool,
}

const COLOR: u32 = 4;

impl Input {
    fn constant(factor: Vec3) -> Self {
        Self { factor, texture: None, channel: COLOR, exact: false }
    }

    fn color(input: &ColorInput) -> Self {
        Self { texture: input.texture, ..Self::constant(input.factor) }
    }

    fn scalar(input: &ScalarInput) -> Self {
        let channel = match input.texture {
            None | Some((_, Channel::R)) => 0,
            Some((_, Channel::G)) => 1,
            Some((_, Channel::B)) => 2,
            Some((_, Channel::A)) => 3,
        };
        let texture = input.texture.map(|(texture, _)| texture);
        Self { texture, channel, ..Self::constant(Vec3::splat(input.factor)) }
    }

    fn texels(texture: Option<u32>) -> Self {
        Self { texture, ..Self::constant(Vec3::ONE) }
    }
}

/// Appends a material of a scene with so many textures.
pub(crate) fn put(words: &mut Words, row: &Row<'_>, textures: usize) {
    let (m, plain) = (row.material, &row.plain);
    let first = words.offset();
    words.u32(bits(row));
    words.u32(row.uv_sets as u32);
    words.f32(m.ior);
    words.vec3(plain.attenuation);
    let metal = plain.params.conductor;
    for v in [metal.map(|m| m.index().eta), metal.map(|m| m.index().k), metal.map(|m| m.average())] {
        words.vec3(v.unwrap_or_default());
    }
    let p = &plain.params;
    words.f32s(&[p.dispersion, p.anisotropy]);
    words.vec2(p.anisotropy_direction);
    words.f32(p.iridescence_ior);
    words.f32s(&[m.iridescence_thickness[0], p.iridescence_thickness]);
    words.f32(if let AlphaMode::Mask(cutoff) = m.alpha_mode { cutoff } else { 0.0 });
    words.f32s(&[m.normal_map, m.clearcoat_normal_map].map(|map| map.map_or(1.0, |map| map.scale)));
    debug_assert_eq!(words.offset() - first, INPUTS as u32);
    for input in inputs(row) {
        words.vec3(input.factor);
        words.u32(texture_number(input.texture, textures));
        words.u32(input.channel | if input.exact { EXACT } else { 0 });
    }
}

fn bits(row: &Row<'_>) -> u32 {
    let m = row.material;
    let bit = |is: bool, bit: u32| if is { bit } else { 0 };
    bit(m.unlit, flags::UNLIT)
        | bit(m.double_sided, flags::TWO_SIDED)
        | bit(row.needs_tangent(), flags::NEEDS_TANGENT)
        | bit(m.has_alpha(), flags::ALPHA)
        | bit(matches!(m.alpha_mode, AlphaMode::Mask(_)), flags::MASK)
        | bit(m.may_be_pane(), flags::PANE)
        | bit(row.plain.params.thin, flags::THIN)
        | bit(row.plain.params.conductor.is_some(), flags::CONDUCTOR)
        | bit(!m.unlit && m.normal_map.is_some(), flags::NORMAL_MAP)
        | bit(!m.unlit && m.clearcoat_normal_map.is_some(), flags::COAT_NORMAL_MAP)
        | bit(!m.unlit && m.anisotropy_texture.is_some(), flags::ANISOTROPY_TEXTURE)
        | bit(!m.unlit && m.iridescence_thickness_texture.is_some(), flags::THICKNESS_TEXTURE)
        | bit(is_clear(m), flags::CLEAR)
}

fn inputs(row: &Row<'_>) -> [Input; ALL_INPUTS] {
    let (m, p) = (row.material, &row.plain.params);
    let scalar = |input: &ScalarInput, plain: f32| {
        if m.unlit { Input::constant(Vec3::splat(plain)) } else { Input::scalar(input) }
    };
    let color =
        |input: &ColorInput, plain: Vec3| if m.unlit { Input::constant(plain) } else { Input::color(input) };
    let texels = |texture: Option<u32>| Input::texels(texture.filter(|_| !m.unlit));
    let mut inputs = [Input::constant(Vec3::ONE); ALL_INPUTS];
    if m.alpha_mode != AlphaMode::Opaque {
        inputs[input::ALPHA] = Input::scalar(&m.alpha);
    }
    inputs[input::BASE_COLOR] = color(&m.base_color, p.base_color);
    inputs[input::METALLIC] = scalar(&m.metallic, p.metallic);
    inputs[input::ROUGHNESS] = scalar(&m.roughness, p.roughness);
    inputs[input::TRANSMISSION] = scalar(&m.transmission, p.transmission);
    inputs[input::SPECULAR] = scalar(&m.specular, p.specular);
    inputs[input::SPECULAR_COLOR] = color(&m.specular_color, p.specular_color);
    inputs[input::CLEARCOAT] = scalar(&m.clearcoat, p.clearcoat);
    inputs[input::CLEARCOAT_ROUGHNESS] = scalar(&m.clearcoat_roughness, p.clearcoat_roughness);
    inputs[input::SHEEN_COLOR] = color(&m.sheen_color, p.sheen_color);
    inputs[input::SHEEN_ROUGHNESS] = scalar(&m.sheen_roughness, p.sheen_roughness);
    inputs[input::IRIDESCENCE] = scalar(&m.iridescence, p.iridescence);
    inputs[input::THICKNESS] = texels(m.iridescence_thickness_texture);
    inputs[input::ANISOTROPY] = texels(m.anisotropy_texture);
    inputs[input::NORMAL] = texels(m.normal_map.map(|map| map.texture));
    inputs[input::COAT_NORMAL] = texels(m.clearcoat_normal_map.map(|map| map.texture));
    inputs[input::EMISSION] = Input::color(if m.unlit { &m.base_color } else { &m.emission });
    inputs.iter_mut().for_each(|input| input.exact = row.exact);
    inputs[input::ALPHA].exact = true;
    inputs[input::EMISSION].exact |= !m.unlit;
    inputs
}
