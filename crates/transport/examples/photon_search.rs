//! Times of the search structures of photon maps on a caustic: half of the photons in a dense middle, half in a wide skirt.
//!
//!     cargo run --release -p vastlight-transport --example photon_search -- [POINTS] [REPEAT]
//!
//! Times are those of all threads. Slow structures gather around fewer points; times are of one point all the same.
#![allow(clippy::print_stdout, reason = "the table is on stdout")]

use std::f32::consts::TAU;
use vastlight_math::{Rng, Vec3};
use vastlight_transport::photon::{Photon, SearchKind, bench};

/// Share of the scene's extent, 10 m.
const RADIUS: f32 = 0.04;

fn main() {
    let number =
        |i: usize, default: usize| std::env::args().nth(i).and_then(|s| s.parse().ok()).unwrap_or(default);
    let (points, repeat) = (number(1, 2_000_000), number(2, 3) as u32);
    println!(
        "receiver photons structure  build_ms  Mphotons/s  gather_ns/point  Mpoints/s  near/point  MB  irradiance"
    );
    for (name, receiver) in RECEIVERS {
        for count in [1 << 14, 1 << 16, 1 << 18, 1 << 20] {
            let photons = photons(count, receiver);
            for kind in SearchKind::ALL {
                let points = seen(points / fewer(kind, count), receiver);
                let figures = bench::search(&photons, kind, RADIUS, &points, repeat);
                print(name, &figures);
            }
        }
    }
}

type Receiver = fn(&mut Rng) -> Vec3;
/// A floor; a floor and two walls, and drops between them.
const RECEIVERS: [(&str, Receiver); 2] = [("floor", floor), ("room", room)];

/// A point of the floor, 10 m wide, as photons come: half of them within 1 m.
fn floor(rng: &mut Rng) -> Vec3 {
    let [pick, r, angle] = [rng.next_1d(), rng.next_1d(), rng.next_1d() * TAU];
    let r = if pick < 0.5 { r } else { 5.0 * r.sqrt() };
    Vec3::new(5.0 + r * angle.cos(), 0.0, 5.0 + r * angle.sin())
}

fn room(rng: &mut Rng) -> Vec3 {
    let (pick, at) = (rng.next_1d(), floor(rng));
    match pick {
        p if p < 0.5 => at,
        p if p < 0.7 => Vec3::new(at.y, at.x, at.z),
        p if p < 0.9 => Vec3::new(at.x, at.z, at.y),
        _ => Vec3::new(rng.next_1d(), rng.next_1d(), rng.next_1d()) * 10.0,
    }
}

fn photons(count: usize, receiver: Receiver) -> Vec<Photon> {
    let mut rng = Rng::new(1);
    let of = |rng: &mut Rng| Photon {
        position: receiver(rng),
        flux: Vec3::splat(1.0 / count as f32),
        from: Vec3::Y,
        normal: Vec3::Y,
        segments: 3,
    };
    (0..count).map(|_| of(&mut rng)).collect()
}

/// Points where a picture looks: most on the receiver by area, line by line, one of eight where photons come.
fn seen(count: usize, receiver: Receiver) -> Vec<Vec3> {
    let mut rng = Rng::new(2);
    let side = (count as f32).sqrt().ceil() as usize;
    let of = |i: usize| {
        let (u, v) = ((i % side) as f32 / side as f32 * 10.0, (i / side) as f32 / side as f32 * 10.0);
        if i.is_multiple_of(8) { receiver(&mut rng) } else { Vec3::new(u, 0.0, v) }
    };
    (0..count).map(of).collect()
}

/// How many times fewer points a structure gathers around.
fn fewer(kind: SearchKind, photons: usize) -> usize {
    match kind {
        SearchKind::Brute => photons / 32,
        SearchKind::Lexicographic => photons / 2048,
        _ => 1,
    }
}

fn print(receiver: &str, f: &bench::SearchFigures) {
    let points = f.points.max(1) as f64;
    println!(
        "{receiver:8} {:8} {:13} {:8.2} {:8.1} {:10.1} {:8.3} {:8.2} {:6.1} {:.5}",
        f.photons,
        f.kind.name(),
        f.build_ms,
        f.photons as f64 / f.build_ms / 1e3,
        f.gather_ms * 1e6 / points,
        points / f.gather_ms / 1e3,
        f.near,
        f.bytes as f64 / 1e6,
        f.irradiance.x as f64 / points,
    );
}
