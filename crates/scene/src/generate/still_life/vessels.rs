//! Blown and cut glass: a goblet of red wine, a decanter of whisky.

use crate::Material;
use crate::generate::builder::Builder;
use crate::generate::lathe::{lathe, smooth_profile};
use crate::generate::palette::tinted_glass;
use vastlight_math::{Vec2, Vec3};

/// Between a vessel and its content: without a rule for overlapping volumes, a hair of air keeps both sound.
const GAP: f32 = 0.000_15;

/// A wine glass, filled to the widest point of its bowl.
pub(super) fn goblet(b: &mut Builder, at: Vec3) {
    let glass = b.material(Material::glass("goblet glass", 1.52, 0.0));
    let outer = [
        [0.0365, 0.0011],
        [0.034, 0.0019],
        [0.02, 0.0045],
        [0.0085, 0.0085],
        [0.0048, 0.015],
        [0.0038, 0.03],
        [0.0036, 0.062],
        [0.0046, 0.083],
        [0.0105, 0.0935],
        [0.0265, 0.108],
        [0.0385, 0.135],
        [0.0405, 0.158],
        [0.0365, 0.192],
        [0.0338, 0.212],
    ];
    let inner = [
        [0.0, 0.0955],
        [0.0095, 0.0965],
        [0.0255, 0.110],
        [0.0372, 0.136],
        [0.0392, 0.158],
        [0.0353, 0.192],
        [0.0327, 0.2122],
    ];
    let outer = smooth_profile(&outer.map(Vec2::from_array), 6);
    let inner = smooth_profile(&inner.map(Vec2::from_array), 10);
    let mut profile = vec![Vec2::new(0.0, 0.0003), Vec2::new(0.0355, 0.0003)];
    profile.extend(&outer);
    profile.push(Vec2::new(0.03325, 0.2127));
    profile.extend(inner.iter().rev());
    let sectors = 128;
    b.object("goblet", glass, &lathe(&profile, sectors).at(at.x, at.y, at.z));
    let wine = b.material(tinted_glass("red wine", 1.34, Vec3::new(0.55, 0.02, 0.035), 0.012));
    let content = filled(&inner, 0.152);
    b.object("wine", wine, &lathe(&content, sectors).at(at.x, at.y, at.z));
}

/// What fills a vessel with this inner profile (bottom to top, from the axis) up to `level`.
fn filled(inner: &[Vec2], level: f32) -> Vec<Vec2> {
    let mut profile = vec![Vec2::new(0.0, inner[0].y + GAP)];
    for pair in inner.windows(2) {
        let (p, q) = (pair[0], pair[1]);
        let normal = Vec2::new(p.y - q.y, q.x - p.x).normalize_or(Vec2::Y);
        if q.y >= level {
            let t = ((level - p.y) / (q.y - p.y).max(1e-9)).clamp(0.0, 1.0);
            let edge = p.lerp(q, t);
            profile.push(Vec2::new(edge.x - 1.5 * GAP, level));
            break;
        }
        let moved = q + normal * GAP;
        if moved.x > 0.0 {
            profile.push(moved);
        }
    }
    profile.push(Vec2::new(0.0, level));
    profile
}

/// A cut decanter of ten sides with its stopper.
pub(super) fn decanter(b: &mut Builder, at: Vec3) {
    let sides = 10;
    let crystal = b.material(Material { dispersion: 0.45, ..Material::glass("lead crystal", 1.56, 0.0) });
    let outer = [
        [0.0, 0.0],
        [0.048, 0.0],
        [0.053, 0.006],
        [0.056, 0.03],
        [0.053, 0.055],
        [0.056, 0.08],
        [0.052, 0.108],
        [0.034, 0.134],
        [0.0175, 0.148],
        [0.0150, 0.166],
        [0.0165, 0.184],
        [0.0225, 0.198],
        [0.0225, 0.2015],
    ];
    let inner = [
        [0.0, 0.012],
        [0.042, 0.012],
        [0.0462, 0.02],
        [0.0462, 0.1],
        [0.0285, 0.129],
        [0.0115, 0.146],
        [0.0108, 0.185],
        [0.0135, 0.2015],
    ];
    let (outer, inner) = (outer.map(Vec2::from_array), inner.map(Vec2::from_array));
    let mut profile = outer.to_vec();
    profile.extend(inner.iter().rev());
    b.object("decanter", crystal, &lathe(&profile, sides).faceted().at(at.x, at.y, at.z));
    let whisky = b.material(tinted_glass("whisky", 1.36, Vec3::new(0.86, 0.40, 0.06), 0.06));
    let content = filled(&inner, 0.088);
    b.object("whisky", whisky, &lathe(&content, sides).faceted().at(at.x, at.y, at.z));
    let stopper = [
        [0.0, 0.172],
        [0.0085, 0.172],
        [0.0098, 0.2012],
        [0.0098, 0.2022],
        [0.019, 0.2022],
        [0.0205, 0.2045],
        [0.011, 0.2095],
        [0.018, 0.216],
        [0.0255, 0.232],
        [0.018, 0.249],
        [0.0, 0.256],
    ];
    let stopper = lathe(&stopper.map(Vec2::from_array), sides).faceted();
    b.object("stopper", crystal, &stopper.at(at.x, at.y, at.z));
}
