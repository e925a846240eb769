//! Which numbers a change may have: those that mean something, so that a slip of the pen is no picture.

use super::{EnvironmentOverride, LightOverride, MaterialOverride};

/// The first number that means nothing, if there is one: its key, and what it should be.
type Wrong = Option<(&'static str, &'static str)>;

const UNIT: &str = "between 0 and 1";
const POSITIVE: &str = "0 or more, and finite";

impl MaterialOverride {
    /// A number that means nothing.
    pub(super) fn wrong(&self) -> Wrong {
        let units = [
            ("alpha", self.alpha),
            ("metallic", self.metallic),
            ("roughness", self.roughness),
            ("specular", self.specular),
            ("transmission", self.transmission),
            ("clearcoat", self.clearcoat),
            ("clearcoat_roughness", self.clearcoat_roughness),
            ("sheen_roughness", self.sheen_roughness),
            ("anisotropy", self.anisotropy),
            ("iridescence", self.iridescence),
        ];
        let colors = [
            ("base_color", self.base_color),
            ("emission", self.emission),
            ("specular_color", self.specular_color),
            ("attenuation_color", self.attenuation_color),
            ("sheen_color", self.sheen_color),
        ];
        let lengths = [("thickness", self.thickness), ("dispersion", self.dispersion)];
        let of_units = first(&units, |x| (0.0..=1.0).contains(&x), UNIT);
        of_units
            .or_else(|| first_color(&colors))
            .or_else(|| first(&lengths, is_positive, POSITIVE))
            .or_else(|| first(&[("ior", self.ior)], is_ior, "1 or more and finite, or 0 for a mirror"))
            .or_else(|| {
                first(&[("attenuation_distance", self.attenuation_distance)], |x| x > 0.0, "more than 0")
            })
    }
}

impl LightOverride {
    /// A number that means nothing.
    pub(super) fn wrong(&self) -> Wrong {
        let of_color = first_color(&[("intensity", self.intensity)]);
        of_color.or_else(|| first(&[("scale", self.scale)], is_positive, POSITIVE))
    }
}

impl EnvironmentOverride {
    /// A number that means nothing.
    pub(super) fn wrong(&self) -> Wrong {
        let [azimuth, elevation] = self.sun.map_or([None; 2], |sun| sun.map(Some));
        let angles = [("sun", azimuth), ("sun", elevation), ("rotation", self.rotation)];
        let turbidity = [("turbidity", self.turbidity)];
        first_color(&[("color", self.color)])
            .or_else(|| first(&[("strength", self.strength)], is_positive, POSITIVE))
            .or_else(|| first(&angles, f32::is_finite, "finite, in degrees"))
            .or_else(|| first(&turbidity, |x| (1.0..=10.0).contains(&x), "between 1 and 10"))
    }
}

fn first(
    numbers: &[(&'static str, Option<f32>)],
    is_right: impl Fn(f32) -> bool,
    right: &'static str,
) -> Wrong {
    let wrong = numbers.iter().find(|(_, number)| number.is_some_and(|x| !is_right(x)));
    wrong.map(|&(key, _)| (key, right))
}

fn first_color(colors: &[(&'static str, Option<[f32; 3]>)]) -> Wrong {
    let wrong = colors.iter().find(|(_, color)| color.is_some_and(|c| !c.into_iter().all(is_positive)));
    wrong.map(|&(key, _)| (key, POSITIVE))
}

fn is_positive(x: f32) -> bool {
    x >= 0.0 && x.is_finite()
}

fn is_ior(x: f32) -> bool {
    x == 0.0 || x >= 1.0 && x.is_finite()
}
