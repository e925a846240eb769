//! Times of sorting photons by voxels: `cargo run --release -p vastlight-gpu --example photons -- [ADAPTER]`.

use vastlight_gpu::bench::index;
use vastlight_gpu::{DeviceChoice, Drivers, Executor, ExecutorConfig};
use vastlight_math::{Rng, Vec3};
use vastlight_transport::photon::Photon;

/// Runs; the best counts.
const REPEATS: u32 = 5;
/// The papers' radius, of a scene 1 m wide.
const RADIUS: f32 = 0.004;

/// Photons on a floor 1 m wide with some height.
fn photons(count: u32) -> Vec<Photon> {
    let mut rng = Rng::new(3);
    let photon = |_| {
        let (place, height) = (rng.next_2d(), rng.next_1d());
        let position = Vec3::new(place.x, 0.05 * height, place.y);
        Photon { position, flux: Vec3::ONE, from: Vec3::Y, normal: Vec3::Y, segments: 3 }
    };
    (0..count).map(photon).collect()
}

#[expect(clippy::print_stdout, reason = "it is what the example is for")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let adapter = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let choice = adapter.map_or(DeviceChoice::Any, DeviceChoice::Index);
    let mut executor = Executor::new(Drivers::load().open(choice)?, ExecutorConfig::default());
    println!("{}", executor.adapter().name);
    for bits in [14, 16, 18, 20] {
        let figures = index(&mut executor, &photons(1 << bits), RADIUS, REPEATS)?;
        println!("{} photons: {figures:?}", 1 << bits);
    }
    Ok(())
}
