//! Cut stones and a quartz point.

use crate::Material;
use crate::generate::builder::Builder;
use crate::generate::chance::Chance;
use crate::generate::lathe::lathe;
use crate::generate::palette::tinted_glass;
use crate::generate::shape::{Shape, stand};
use std::f32::consts::TAU;
use vastlight_math::{Vec2, Vec3, real::sin_cos};

/// Stones on the table in front.
pub(super) fn gems(b: &mut Builder, seed: u64) {
    let diamond = b.material(Material { dispersion: 0.36, ..Material::glass("diamond", 2.42, 0.0) });
    let ruby = b.material(tinted_glass("ruby", 1.77, Vec3::new(0.9, 0.03, 0.08), 0.012));
    let emerald = b.material(tinted_glass("emerald", 1.58, Vec3::new(0.06, 0.8, 0.28), 0.012));
    let sapphire = b.material(tinted_glass("sapphire", 1.77, Vec3::new(0.05, 0.14, 0.85), 0.012));
    let cut = brilliant();
    let mut chance = Chance::new(seed, 60);
    let stones = [
        (diamond, 0.0165, -0.085, 0.125),
        (sapphire, 0.0125, -0.038, 0.175),
        (emerald, 0.0120, 0.105, 0.150),
        (ruby, 0.0110, 0.085, 0.195),
        (diamond, 0.0085, -0.012, 0.205),
        (diamond, 0.0075, 0.148, 0.185),
    ];
    for (material, size, x, z) in stones {
        let stone = resting(&cut, size, chance.range(0.0, TAU));
        b.object("gem", material, &stone.at(x, 0.0, z));
    }
    let quartz = b.material(tinted_glass("quartz", 1.544, Vec3::new(0.93, 0.80, 0.97), 0.05));
    let point = [[0.0, -0.045], [0.009, -0.036], [0.0155, -0.030], [0.0145, 0.026], [0.0, 0.052]]
        .map(Vec2::from_array);
    let point = lathe(&point, 6).faceted();
    // A flat side down: half a sector from the x axis.
    let (s, c) = sin_cos(0.45);
    let lying = point.turned(TAU / 12.0).transformed(&stand(Vec3::ZERO, Vec3::new(c, 0.0, s)));
    b.object("quartz point", quartz, &dropped(lying).at(0.235, 0.0, 0.125));
}

/// Lies on the table: the lowest point a hair above it.
fn dropped(shape: Shape) -> Shape {
    let lowest = shape.positions.iter().fold(f32::MAX, |y, p| y.min(p.y));
    shape.at(0.0, 0.0002 - lowest, 0.0)
}

/// A stone of this radius lying on one of its pavilion's sides and its girdle.
fn resting(cut: &Shape, size: f32, turn: f32) -> Shape {
    // The pavilion's half angle: from the culet to the girdle.
    let lean = vastlight_math::real::atan(PAVILION);
    let (s, c) = sin_cos(std::f32::consts::FRAC_PI_2 - lean + 0.24);
    let scaled = cut.clone().transformed(&vastlight_math::Affine3::from_scale(Vec3::splat(size)));
    let tilted = scaled.transformed(&stand(Vec3::ZERO, Vec3::new(s, c, 0.0)));
    dropped(tilted.turned(turn))
}

/// Depth of the pavilion, the lower part, in radii.
const PAVILION: f32 = 0.86;

/// A round brilliant of radius 1 (Tolkowsky's proportions) around the middle of its girdle.
fn brilliant() -> Shape {
    let ring = |radius: f32, y: f32, count: u32, shift: f32| -> Vec<Vec3> {
        (0..count)
            .map(|i| {
                let (s, c) = sin_cos(TAU * (i as f32 + shift) / count as f32);
                Vec3::new(radius * c, y, radius * s)
            })
            .collect()
    };
    let (table, crown) = (ring(0.53, 0.345, 8, 0.0), ring(0.78, 0.185, 8, 0.5));
    let (upper, lower) = (ring(1.0, 0.02, 16, 0.0), ring(1.0, -0.02, 16, 0.0));
    let below = ring(0.80, -0.20, 8, 0.5);
    let culet = Vec3::new(0.0, -PAVILION, 0.0);
    let mut faces: Vec<[Vec3; 3]> = Vec::new();
    for i in 0..8 {
        let next = (i + 1) % 8;
        let (g0, g1, g2) = (2 * i, 2 * i + 1, (2 * i + 2) % 16);
        if i > 0 && next > 0 {
            faces.push([table[0], table[i], table[next]]);
        }
        faces.push([table[i], crown[i], table[next]]);
        faces.extend([[table[i], upper[g0], crown[i]], [table[next], crown[i], upper[g2]]]);
        faces.extend([[crown[i], upper[g0], upper[g1]], [crown[i], upper[g1], upper[g2]]]);
        for (a, c) in [(g0, g1), (g1, g2)] {
            faces.extend([
                [upper[a], lower[a], lower[c]],
                [upper[a], lower[c], upper[c]],
                [below[i], lower[a], lower[c]],
            ]);
        }
        faces.extend([[below[i], lower[g0], culet], [below[i], culet, lower[g2]]]);
    }
    outward(&faces)
}

/// Flat triangles of a convex body around the origin, turned to face outwards.
fn outward(faces: &[[Vec3; 3]]) -> Shape {
    let mut shape = Shape::default();
    for &[a, mut b, mut c] in faces {
        if (b - a).cross(c - a).dot(a + b + c) < 0.0 {
            (b, c) = (c, b);
        }
        let normal = (b - a).cross(c - a).normalize();
        let [a, b, c] = [a, b, c].map(|p| shape.vertex(p, normal, Vec2::ZERO));
        shape.triangle(a, b, c);
    }
    shape
}
