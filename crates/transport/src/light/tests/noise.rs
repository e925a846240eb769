//! Noise: many lights must not be much noisier than few.

use super::*;
use vastlight_math::{stats::mean_and_variance, warp};

/// `count` one-sided triangles of random place and direction above the ground, together of area 2 and radiance 1.
pub(super) fn scattered(count: u32) -> SceneDesc {
    let mut desc = dark(vec![Material::emitter("lamp", Vec3::ONE, false)]);
    let mut rng = Rng::new(u64::from(count));
    let side = (4.0 / count as f32 / 3.0_f32.sqrt() * 2.0).sqrt();
    let corners: Vec<[Vec3; 3]> = (0..count)
        .map(|_| {
            let u = rng.next_2d();
            let center = Vec3::new(10.0 * u.x - 5.0, 1.0 + 3.0 * rng.next_1d(), 10.0 * u.y - 5.0);
            let frame = vastlight_math::Frame::from_z(warp::uniform_sphere(rng.next_2d()));
            [0.0_f32, 2.0, 4.0].map(|third| {
                let (s, c) = (third * std::f32::consts::FRAC_PI_3).sin_cos();
                center + frame.to_outer(Vec3::new(c, s, 0.0)) * (side / 3.0_f32.sqrt())
            })
        })
        .collect();
    add_mesh(&mut desc, &corners, 0, Affine3::IDENTITY);
    desc
}

/// Mean over points of the ground of the relative variance of a single sample's irradiance.
pub(super) fn relative_variance(count: u32) -> f64 {
    with_lights(scattered(count), 1 << 20, |_, lights| {
        let mut rng = Rng::new(5);
        let points = 64;
        let variance_at = |from: Vec3, rng: &mut Rng| {
            let n = 256;
            let estimates = (0..n).map(|_| {
                let s = lights.sample(from, Vec3::Y, rng.next_1d(), rng.next_2d());
                f64::from(s.map_or(0.0, |s| s.radiance.x * s.wi.y.max(0.0) / s.pdf))
            });
            let (mean, variance_of_mean) = mean_and_variance(estimates);
            variance_of_mean * f64::from(n) / (mean * mean)
        };
        let sum: f64 = (0..points)
            .map(|_| {
                let u = rng.next_2d();
                variance_at(Vec3::new(8.0 * u.x - 4.0, 0.0, 8.0 * u.y - 4.0), &mut rng)
            })
            .sum();
        sum / f64::from(points)
    })
}

#[test]
fn a_hundred_thousand_lights_are_at_most_twice_as_noisy_as_ten() {
    let (few, many) = (relative_variance(10), relative_variance(100_000));
    println!("relative variance of one sample: 10 lights {few:.2}, 100000 lights {many:.2}");
    assert!(many < 2.0 * few, "10 lights {few}, 100000 lights {many}");
}
