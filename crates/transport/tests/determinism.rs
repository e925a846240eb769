//! The same bits however the work is cut.

mod common;

use common::{Build, look_at, shapes, with_renderer};
use rayon::prelude::*;
use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{AlphaMode, Material, ScalarInput, Scene};
use vastlight_transport::{RenderSettings, Renderer, Sample};

fn scene() -> Scene {
    let half = Material {
        alpha: ScalarInput::new(0.5),
        alpha_mode: AlphaMode::Blend,
        ..Material::diffuse("half", Vec3::X)
    };
    Build::in_light(Vec3::new(0.3, 0.5, 0.8))
        .add(shapes::sphere(2, true), Material::glass("glass", 1.5, 0.2), Affine3::IDENTITY)
        .add(shapes::cube(), half, Affine3::from_translation(Vec3::new(2.2, 0.0, 0.0)))
        .add(
            shapes::quad(),
            Material::emitter("lamp", Vec3::splat(5.0), true),
            Affine3::from_translation(Vec3::new(0.0, 0.0, -3.0)),
        )
        .finish()
}

const SIZE: u32 = 40;
const SAMPLES: u32 = 6;

/// Bits of every sample, by pixel and sample, rendered in tiles of `tile` pixels over ranges of `range` samples.
fn bits(r: &Renderer<'_>, tile: u32, range: u32, threads: usize, backwards: bool) -> Vec<Vec<[u32; 3]>> {
    let mut jobs: Vec<_> = (0..SAMPLES)
        .step_by(range as usize)
        .flat_map(|s| r.settings().region().split(tile).into_iter().map(move |t| (s, t)))
        .collect();
    if backwards {
        jobs.reverse();
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    let render = |&(first, tile): &(u32, _)| {
        let mut found: Vec<([u32; 2], u32, [u32; 3])> = Vec::new();
        let mut sink = |pixel: [u32; 2], s: &Sample| {
            found.push((pixel, first, s.radiance.to_array().map(f32::to_bits)));
        };
        r.render_tile(tile, first..(first + range).min(SAMPLES), &mut sink).expect("in memory");
        found
    };
    let mut found: Vec<_> = pool.install(|| jobs.par_iter().flat_map_iter(render).collect());
    found.sort_by_key(|&(pixel, first, _)| (pixel, first));
    let mut pixels = vec![Vec::new(); (SIZE * SIZE) as usize];
    for (pixel, _, bits) in found {
        pixels[(pixel[1] * SIZE + pixel[0]) as usize].push(bits);
    }
    pixels
}

#[test]
fn threads_tiles_and_ranges_do_not_change_a_bit() {
    let camera = look_at(Vec3::new(1.0, 1.0, 6.0), Vec3::new(0.7, 0.0, 0.0), 0.8);
    let settings = RenderSettings::new(camera, SIZE, SIZE);
    with_renderer(&scene(), settings.clone(), |r| {
        let expected = bits(r, SIZE, SAMPLES, 1, false);
        assert!(expected.iter().all(|p| p.len() == SAMPLES as usize));
        for (tile, range, threads, backwards) in
            [(7, 6, 2, true), (16, 1, 16, false), (40, 2, 2, true), (1, 3, 4, false)]
        {
            assert_eq!(bits(r, tile, range, threads, backwards), expected, "{tile} {range} {threads}");
        }
    });
    let other_seed = RenderSettings { seed: 1, ..settings };
    with_renderer(&scene(), other_seed, |r| {
        let same = bits(r, 16, 6, 2, false);
        with_renderer(&scene(), RenderSettings { seed: 2, ..r.settings().clone() }, |other| {
            assert_ne!(bits(other, 16, 6, 2, false), same);
        });
    });
}
