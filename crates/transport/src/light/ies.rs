//! Measured distributions of luminaires, interpolated between their angles.

use crate::words::Words;
use vastlight_math::Vec3;
use vastlight_math::real::{acos, atan2};
use vastlight_scene::IesProfile;

/// The profile's value (0..1) for light that leaves along `direction`, a unit vector in the light's frame.
///
/// The vertical angle is measured from -z, the horizontal one around it from +x towards +y. Beyond the measured
/// vertical angles it is dark.
pub(super) fn value(profile: &IesProfile, direction: Vec3) -> f32 {
    let vertical = acos(-direction.z).to_degrees();
    let horizontal = atan2(direction.y, direction.x).to_degrees().rem_euclid(360.0);
    let Some((v0, v1, s)) = bracket(&profile.vertical, vertical) else { return 0.0 };
    let (h0, h1, t) = bracket_turn(&profile.horizontal, horizontal);
    let at = |h: usize, v: usize| {
        profile.candela.get(h * profile.vertical.len() + v).copied().filter(|c| *c > 0.0).unwrap_or(0.0)
    };
    let row = |h: usize| at(h, v0) * (1.0 - s) + at(h, v1) * s;
    row(h0) * (1.0 - t) + row(h1) * t
}

/// Appends a profile: how many vertical and horizontal angles, the angles, and values for all of them (at least one
/// horizontal angle's), by horizontal angle; nothing undefined, negative or infinite among the values. Gives its word.
pub(super) fn pack(profile: &IesProfile, words: &mut Words) -> u32 {
    let start = words.offset();
    let (vertical, horizontal) = (&profile.vertical, &profile.horizontal);
    words.u32s(&[vertical.len() as u32, horizontal.len() as u32]);
    words.f32s(vertical);
    words.f32s(horizontal);
    for i in 0..vertical.len() * horizontal.len().max(1) {
        let usable = profile.candela.get(i).copied().filter(|c| *c > 0.0).unwrap_or(0.0);
        words.f32(usable.min(f32::MAX));
    }
    start
}

/// The neighbours of `x` in an ascending list and the fraction between them; `None` outside.
fn bracket(angles: &[f32], x: f32) -> Option<(usize, usize, f32)> {
    // Rounding of the angle must not darken the pole.
    const SLACK: f32 = 1e-2;
    let (&first, &last) = (angles.first()?, angles.last()?);
    if x < first - SLACK || x > last + SLACK {
        return None;
    }
    let above = angles.partition_point(|&a| a <= x).clamp(1, angles.len().max(2) - 1).min(angles.len() - 1);
    let below = above.saturating_sub(1);
    let width = angles[above] - angles[below];
    let fraction = if width > 0.0 { ((x - angles[below]) / width).clamp(0.0, 1.0) } else { 0.0 };
    Some((below, above, fraction))
}

/// [`bracket`] on the circle of 360 degrees.
fn bracket_turn(angles: &[f32], x: f32) -> (usize, usize, f32) {
    let Some((&first, &last)) = angles.first().zip(angles.last()) else { return (0, 0, 0.0) };
    if let Some(inside) = bracket(angles, x).filter(|_| x >= first && x <= last) {
        return inside;
    }
    let gap = first + 360.0 - last;
    let past = (x - last).rem_euclid(360.0);
    (angles.len() - 1, 0, if gap > 0.0 { (past / gap).clamp(0.0, 1.0) } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(vertical: &[f32], horizontal: &[f32], candela: &[f32]) -> IesProfile {
        IesProfile {
            vertical: vertical.to_vec(),
            horizontal: horizontal.to_vec(),
            candela: candela.to_vec(),
            peak_candela: 1.0,
        }
    }

    fn direction(vertical: f32, horizontal: f32) -> Vec3 {
        let (v, h) = (vertical.to_radians(), horizontal.to_radians());
        Vec3::new(v.sin() * h.cos(), v.sin() * h.sin(), -v.cos())
    }

    #[test]
    fn interpolates_between_angles() {
        let p = profile(&[0.0, 30.0, 90.0], &[0.0], &[1.0, 0.4, 0.1]);
        for (angle, expected) in
            [(0.0, 1.0), (15.0, 0.7), (30.0, 0.4), (60.0, 0.25), (90.0, 0.1), (91.0, 0.0)]
        {
            for turn in [0.0, 100.0, 359.0] {
                let found = value(&p, direction(angle, turn));
                assert!((found - expected).abs() < 1e-4, "{angle} {turn}: {found}");
            }
        }
    }

    #[test]
    fn horizontal_angles_wrap() {
        for horizontal in [&[0.0, 90.0, 180.0, 270.0][..], &[0.0, 90.0, 180.0, 270.0, 360.0]] {
            let rows = [1.0, 0.5, 0.2, 0.6, 1.0];
            let candela: Vec<f32> = rows[..horizontal.len()].iter().flat_map(|&c| [c, c]).collect();
            let p = profile(&[0.0, 180.0], horizontal, &candela);
            for (turn, expected) in [(0.0, 1.0), (45.0, 0.75), (180.0, 0.2), (315.0, 0.8), (359.9, 1.0)] {
                let found = value(&p, direction(90.0, turn));
                assert!((found - expected).abs() < 1e-3, "{turn}: {found}");
            }
        }
    }

    #[test]
    fn broken_profiles_are_dark_or_finite() {
        for p in [
            profile(&[], &[], &[]),
            profile(&[0.0], &[0.0], &[1.0]),
            profile(&[0.0, 90.0], &[0.0, 90.0], &[1.0]),
            profile(&[0.0, 0.0], &[10.0, 10.0], &[f32::NAN, -1.0, 0.5, 0.5]),
        ] {
            for i in 0..100 {
                assert!(value(&p, direction(i as f32 * 1.8, i as f32 * 3.6)).is_finite());
            }
        }
    }
}
