//! From sums to what the screen shows: the picture through its tone curve, or another output in colours.

use crate::view::ToneView;
use serde::{Deserialize, Serialize};
use vastlight::LivePicture;
use vastlight::film::{
    Aov, BitDepth, Cryptomatte, Film, Picture, PngOptions, ToneCurve, linear_from_srgb, name_hash,
};
use vastlight::transport::Integrator;

/// What of the picture is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Channel {
    /// Light.
    Beauty,
    /// Reflectance of the first surface.
    Albedo,
    /// Its shading normal: red, green and blue for x, y and z.
    Normal,
    /// Its distance, from near (yellow) to far (violet).
    Depth,
    /// Whether there is one.
    Alpha,
    /// Objects, in a colour each.
    Object,
    /// Materials, in a colour each.
    Material,
    /// The length of the camera ray's way through structures, from short (violet) to long (yellow).
    Steps,
    /// Samples of each pixel, from none (black) to many (yellow).
    Samples,
    /// Pixels with samples that were not finite, magenta over the dimmed picture.
    NonFinite,
}

impl Channel {
    /// The output that it needs.
    pub(crate) fn aov(self) -> Option<Aov> {
        match self {
            Self::Beauty | Self::Steps | Self::Samples | Self::NonFinite => None,
            Self::Albedo => Some(Aov::Albedo),
            Self::Normal => Some(Aov::Normal),
            Self::Depth => Some(Aov::Depth),
            Self::Alpha => Some(Aov::Alpha),
            Self::Object => Some(Aov::Object),
            Self::Material => Some(Aov::Material),
        }
    }

    /// The integrator that it needs; none for the one that is chosen.
    pub(crate) fn integrator(self) -> Option<Integrator> {
        match self {
            Self::Beauty | Self::Samples | Self::NonFinite => None,
            Self::Steps => Some(Integrator::Steps),
            _ => Some(Integrator::Primary),
        }
    }
}

/// A picture as it is shown: with which options it becomes the bytes of a screen.
pub(crate) struct Shown {
    pub(crate) picture: Picture,
    pub(crate) options: PngOptions,
}

impl Shown {
    pub(crate) fn new(of: &LivePicture, channel: Channel, tone: &ToneView) -> Self {
        let picture = of.develop();
        let plain =
            PngOptions { exposure: 0.0, curve: ToneCurve::Linear, depth: BitDepth::Eight, dither: false };
        let [width, height] = picture.size();
        let colored = |rgb| Self { picture: Picture::from_rgb(width, height, rgb), options: plain };
        let three = |aov: Aov| aov.vector_channels().and_then(|names| picture.three(names));
        let one = |name: &str| picture.plane(name).unwrap_or_default();
        match channel {
            Channel::Beauty => Self { picture, options: tone.options() },
            Channel::Albedo => colored(three(Aov::Albedo).unwrap_or_default().map(<[f32]>::to_vec)),
            Channel::Normal => {
                let encoded = |plane: &[f32]| plane.iter().map(|x| linear_from_srgb(0.5 * x + 0.5)).collect();
                colored(three(Aov::Normal).unwrap_or_default().map(encoded))
            }
            Channel::Depth => colored(by_rank(one("depth.Z"), |place| 1.0 - place)),
            Channel::Steps => colored(by_rank(one("R"), |place| place)),
            Channel::Samples => colored(by_count(&of.samples().map(floats)[0])),
            Channel::NonFinite => {
                let missing = of.samples().map(floats);
                let light = |i: usize| [one("R")[i], one("G")[i], one("B")[i]];
                colored(planes((0..missing[0].len()).map(|i| mask(missing[0][i] < missing[1][i], light(i)))))
            }
            Channel::Alpha => colored([(); 3].map(|()| one("A").to_vec())),
            Channel::Object => colored(by_id(&picture, Film::OBJECT_LAYER)),
            Channel::Material => colored(by_id(&picture, Film::MATERIAL_LAYER)),
        }
    }
}

/// Parts of all pixels with a number, by size, beyond which colours end.
const LEAST: f32 = 0.005;
const MOST: f32 = 0.99;

/// Colours of numbers by their place from the least to the most, black where there is none.
fn by_rank(numbers: &[f32], on_ramp: impl Fn(f32) -> f32) -> [Vec<f32>; 3] {
    let mut there: Vec<f32> = numbers.iter().copied().filter(|&x| x > 0.0).collect();
    there.sort_by(f32::total_cmp);
    let at = |part: f32| there.get((part * there.len() as f32) as usize).copied().unwrap_or(0.0);
    let (least, most) = (at(LEAST), at(MOST));
    let color = |&x: &f32| {
        let place = ((x - least) / (most - least).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        if x > 0.0 { ramp(on_ramp(place)) } else { [0.0; 3] }
    };
    planes(numbers.iter().map(color))
}

/// Colours of numbers from none to the largest, black where there are none.
fn by_count(counts: &[f32]) -> [Vec<f32>; 3] {
    let most = counts.iter().copied().fold(1.0, f32::max);
    planes(counts.iter().map(|&n| if n > 0.0 { ramp(n / most) } else { [0.0; 3] }))
}

/// Light from black to white as a dark grey, and what is marked in a colour that stands out of it.
fn mask(is_marked: bool, light: [f32; 3]) -> [f32; 3] {
    let grey = 0.1 * (light[0] + light[1] + light[2]).clamp(0.0, 3.0) / 3.0;
    if is_marked { [1.0, 0.0, 1.0] } else { [grey; 3] }
}

fn floats(counts: Vec<u32>) -> Vec<f32> {
    counts.into_iter().map(|n| n as f32).collect()
}

/// Steps of a ramp from dark violet over green to yellow that rises evenly in lightness, and can be read by the colour-blind (after
/// viridis by Smith and van der Walt), sRGB.
const RAMP: [[f32; 3]; 7] = [
    [0.267, 0.005, 0.329],
    [0.267, 0.227, 0.513],
    [0.191, 0.407, 0.556],
    [0.128, 0.567, 0.551],
    [0.208, 0.719, 0.473],
    [0.565, 0.843, 0.263],
    [0.993, 0.906, 0.144],
];

/// The colour at a place from 0 to 1, linear.
fn ramp(place: f32) -> [f32; 3] {
    let step = place * (RAMP.len() - 1) as f32;
    let i = (step as usize).min(RAMP.len() - 2);
    let mix = |axis: usize| RAMP[i][axis] + (RAMP[i + 1][axis] - RAMP[i][axis]) * (step - i as f32);
    [mix(0), mix(1), mix(2)].map(linear_from_srgb)
}

/// Colours of a matte layer's ids, each by its share of the pixel.
fn by_id(picture: &Picture, layer: &str) -> [Vec<f32>; 3] {
    let rank = |rank: usize| {
        let plane = |c: usize| picture.plane(&format!("{layer}{:02}.{}", rank / 2, ["R", "G", "B", "A"][c]));
        let first = rank % 2 * 2;
        Some((plane(first)?, plane(first + 1)?))
    };
    let ranks: Vec<_> = (0..Cryptomatte::RANKS).filter_map(rank).collect();
    let color = |pixel: usize| {
        let mut sum = [0.0; 3];
        for (ids, shares) in &ranks {
            let color = color_of(ids[pixel].to_bits());
            (0..3).for_each(|axis| sum[axis] += color[axis] * shares[pixel]);
        }
        sum
    };
    planes((0..picture.window.pixels()).map(color))
}

/// A colour for an id, linear; neighbours in number lie apart.
fn color_of(id: u32) -> [f32; 3] {
    let hash = name_hash(&id.to_string());
    let byte = |shift: u32| (hash >> shift & 0xff) as f32 / 255.0;
    // Muted in saturation, so that no colour outshines the others.
    let (hue, light) = (byte(0), 0.55 + 0.35 * byte(8));
    let channel = |offset: f32| {
        let wave = ((hue + offset).fract() * 6.0 - 3.0).abs() - 1.0;
        light * (0.3 + 0.7 * wave.clamp(0.0, 1.0))
    };
    [channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0)].map(linear_from_srgb)
}

fn planes(colors: impl Iterator<Item = [f32; 3]>) -> [Vec<f32>; 3] {
    let mut planes: [Vec<f32>; 3] = Default::default();
    for color in colors {
        planes.iter_mut().zip(color).for_each(|(plane, value)| plane.push(value));
    }
    planes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_run_from_yellow_to_violet_and_nothing_is_black() {
        let depths: Vec<f32> = (0..1000).map(|i| i as f32).collect();
        let [red, green, _] = by_rank(&depths, |place| 1.0 - place);
        assert_eq!((red[0], green[0]), (0.0, 0.0));
        assert!(green[1] > green[500] && green[500] > green[999]);
        assert!(by_rank(&[0.0, 0.0], |place| place)[0].iter().all(|&x| x == 0.0));
    }

    #[test]
    fn counts_are_bright_where_they_are_many_and_marks_stand_out() {
        let [_, green, _] = by_count(&[0.0, 1.0, 2.0, 4.0]);
        assert!(green[0] == 0.0 && green.is_sorted_by(|a, b| a < b), "{green:?}");
        let [_, steps, _] = by_rank(&[3.0, 5.0, 9.0], |place| place);
        assert!(steps.is_sorted_by(|a, b| a < b), "{steps:?}");
        assert_eq!(mask(true, [0.5; 3]), [1.0, 0.0, 1.0]);
        assert!(mask(false, [f32::MAX; 3]).iter().all(|&x| x <= 0.1));
    }

    #[test]
    fn the_ramp_rises_in_lightness() {
        let light = |i: usize| {
            let [r, g, b] = ramp(i as f32 / 100.0);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        assert!((0..100).all(|i| light(i) < light(i + 1)));
    }

    #[test]
    fn ids_have_colours_of_their_own() {
        let mut colors: Vec<[u32; 3]> = (1..50).map(|id| color_of(id).map(f32::to_bits)).collect();
        colors.sort_unstable();
        colors.dedup();
        assert_eq!(colors.len(), 49);
        assert!((1..50).all(|id| color_of(id).iter().all(|x| (0.0..=1.0).contains(x))));
    }
}
