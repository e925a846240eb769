//! The device's real functions, frames and warps against `vastlight-math`.

use crate::common::{answers, probe};
use std::f32::consts::{FRAC_PI_2, PI};
use vastlight_math::{Frame, Rng, Vec2, Vec3, real, warp};

probe!(MATH_PROBE = "math_probe", 2);

/// What differs by drivers: contracted sums, quotients and roots of a few units in the last place.
const TOLERANCE: f32 = 4e-6;

struct Record {
    a: f32,
    b: f32,
    z: Vec3,
    v: Vec3,
    u: Vec2,
}

impl Record {
    fn words(&self) -> [u32; 10] {
        let (z, v) = (self.z, self.v);
        [self.a, self.b, z.x, z.y, z.z, v.x, v.y, v.z, self.u.x, self.u.y].map(f32::to_bits)
    }

    /// The probe's answers, each with the scale of its error.
    fn expected(&self) -> Vec<(f32, f32)> {
        let &Self { a, b, z, v, u } = self;
        let mut all = Vec::new();
        // The largest number stands for infinity.
        let mut put = |x: f32, scale: f32| all.push((x.clamp(f32::MIN, f32::MAX), scale.min(1e30)));
        put(real::sin(a), 1.0);
        put(real::cos(a), 1.0);
        // Errors of the argument's reduction grow with the exponent.
        put(real::exp(a), real::exp(a) * (1.0 + a.abs()));
        put(real::exp2(a), real::exp2(a) * (1.0 + a.abs()));
        put(real::ln(a.abs()), real::ln(a.abs()).abs().max(1.0));
        put(real::pow(u.x, b.abs()), 1.0);
        put(real::asin(b), 1.0);
        put(real::acos(b), 1.0);
        put(real::atan(a), 1.0);
        put(real::atan2(a, b), 1.0);
        put(a.copysign(b), a.abs());
        put(1.0, 0.0);
        let mut put_all = |numbers: &[f32], scale: f32| numbers.iter().for_each(|&x| put(x, scale));
        for frame in [Frame::from_z(z), Frame::from_z_and_tangent(z, v)] {
            // A tangent near the normal loses digits.
            let scale = if frame == Frame::from_z(z) { 1.0 } else { v.length() / z.cross(v).length() };
            put_all(&frame.x.to_array(), scale);
            put_all(&frame.y.to_array(), scale);
            put_all(&frame.to_outer(v).to_array(), scale * v.length());
            put_all(&frame.to_local(v).to_array(), scale * v.length());
        }
        put_all(&warp::concentric_disk(u).to_array(), 1.0);
        let d = warp::cosine_hemisphere(u);
        // Near the horizon the height is a root of a difference.
        put_all(&d.to_array(), (0.1 / d.z.max(1e-3)).max(1.0));
        put_all(&[warp::cosine_hemisphere_pdf(z.z)], 1.0);
        put_all(&warp::uniform_hemisphere(u).to_array(), 1.0);
        put_all(&warp::uniform_sphere(u).to_array(), 1.0);
        put_all(&warp::uniform_cone(u, z.z.abs()).to_array(), 1.0);
        put_all(&[warp::uniform_cone_pdf(1.0 + b.abs())], 1.0);
        put_all(&warp::uniform_triangle(u).to_array(), 1.0);
        put_all(&[warp::tent(u.x), real::tan(0.25 * u.x)], 1.0);
        all
    }
}

/// Edge values, then random ones.
fn records() -> Vec<Record> {
    let edges = [0.0, -0.0, 1.0, -1.0, 0.5, -0.5, 1e-30, -1e-7, 1e-40, 87.0, -87.2, 100.0, -PI, FRAC_PI_2];
    let axes = [Vec3::Z, -Vec3::Z, Vec3::X, -Vec3::Y, Vec3::new(0.6, 0.0, -0.8), Vec3::new(0.6, -0.8, -0.0)];
    let corners = [0.0, 0.25, 0.5, 0.999_999_94];
    let edge = |i: usize| Record {
        a: edges[i % 14],
        b: edges[i / 14 % 14],
        z: axes[i % 6],
        v: axes[i / 6 % 6],
        u: Vec2::new(corners[i % 4], corners[i / 4 % 4]),
    };
    let mut rng = Rng::new(7);
    let mut random = |_| Record {
        a: 40.0 * (rng.next_1d() - 0.5),
        b: 2.2 * (rng.next_1d() - 0.5),
        z: warp::uniform_sphere(rng.next_2d()),
        v: 3.0 * warp::uniform_sphere(rng.next_2d()),
        u: rng.next_2d(),
    };
    (0..14 * 14 * 6).map(edge).chain((0..8000).map(&mut random)).collect()
}

/// How many numbers are too far from those expected.
fn differences(found: &[u32], records: &[Record]) -> usize {
    let expected = records.iter().flat_map(Record::expected);
    let pairs = found.iter().map(|&bits| f32::from_bits(bits)).zip(expected);
    let far = pairs.filter(|&(found, (expected, scale))| {
        let error = (found - expected).abs();
        error.is_nan() || error > (TOLERANCE * scale).max(f32::MIN_POSITIVE)
    });
    far.count()
}

#[test]
fn functions_are_those_of_the_cpu() {
    let mut records = records();
    let words: Vec<u32> = records.iter().flat_map(Record::words).collect();
    let each = records[0].expected().len();
    let Some(found) = answers(&MATH_PROBE, &[&words], records.len(), each) else { return };
    assert_eq!(differences(&found, &records), 0, "of {}", found.len());
    // A change of the input that is not far above the tolerance is found.
    records.iter_mut().for_each(|r| r.u.x *= 1.0 - 3e-5);
    assert!(differences(&found, &records) > 8000);
}
