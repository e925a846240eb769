//! The papers' renderer on the software adapter against the CPU's: photons, and pictures under their light.

use crate::common::software;
use crate::path::{Picture, difference, gather, settings};
use crate::path_scenes::mirrors;
use crate::streams::{power, with_renderer};
use vastlight_gpu::Executor;
use vastlight_gpu::path::DeviceRenderer;
use vastlight_math::Vec3;
use vastlight_scene::Scene;
use vastlight_transport::photon::{PHOTON_WORDS, PhotonMap, PhotonSettings};
use vastlight_transport::{Integrator, RenderSettings, Renderer};

const RADIUS: f32 = 0.01;

fn under_photons(scene: &Scene, radius: f32) -> RenderSettings {
    let (grid, radius) = (Some([142, 128]), Some(radius));
    let caustics = Some(PhotonSettings { grid, radius, ..PhotonSettings::default() });
    RenderSettings { integrator: Integrator::PhotonCaustics, caustics, ..settings(scene) }
}

/// Samples, each under photons of its own.
fn on_cpu(renderer: &Renderer<'_>, spp: u32) -> Picture {
    let plan = renderer.photon_plan().expect("in memory").expect("wanted");
    let region = renderer.settings().region();
    gather(renderer.settings(), |sink| {
        let mut stats = vastlight_transport::RenderStats::default();
        for sample in 0..spp {
            let (photons, rays) = renderer.photon_maps(&plan, sample).expect("in memory");
            stats += renderer
                .render_tile_under(Some(&photons), region, sample..sample + 1, sink)
                .expect("in memory");
            stats.rays += rays;
        }
        stats
    })
}

fn on_device(executor: &mut Executor, renderer: &Renderer<'_>, (spp, capacity): (u32, u32)) -> Picture {
    let plan = renderer.photon_plan().expect("in memory").expect("wanted");
    let region = renderer.settings().region();
    let mut device = DeviceRenderer::new(executor, renderer, capacity).expect("fits");
    gather(renderer.settings(), |sink| {
        let mut stats = vastlight_transport::RenderStats::default();
        for sample in 0..spp {
            let pass = device.send_photons(&plan, sample).expect("fits");
            stats += device.render_tile(region, sample..sample + 1, sink).expect("rendered");
            stats.rays += pass.rays;
        }
        stats
    })
}

/// How many photons of a device are none of a map's: nowhere near, or of other power.
fn strangers(map: &PhotonMap, words: &[u32]) -> usize {
    let (photons, _) = words.as_chunks::<PHOTON_WORDS>();
    let differs = |words: &&[u32; PHOTON_WORDS]| {
        let vec3 = |at: usize| Vec3::from([0, 1, 2].map(|i| f32::from_bits(words[at + i])));
        let (at, flux, mut found) = (vec3(0), vec3(3), false);
        map.near_at(at, |near| {
            let is_here = near.weight > 0.0;
            found |= is_here && (near.flux - flux).abs().max_element() <= 1e-3 * flux.max_element();
        });
        !found
    };
    photons.iter().filter(differs).count()
}

/// Gathered within 1e-4 of the scene's size, so that all that is found is there.
#[test]
fn photons_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    let scene = mirrors();
    let size = scene.bounds().size().max_element();
    with_renderer(&scene, &under_photons(&scene, 1e-4 / size), |renderer| {
        let plan = renderer.photon_plan().expect("in memory").expect("wanted");
        let mut device = DeviceRenderer::new(&mut executor, renderer, 7000).expect("fits");
        let mut words = Vec::new();
        for pass in [0, 3] {
            let (maps, rays) = renderer.photon_maps(&plan, pass).expect("in memory");
            let sent = device.send_photons(&plan, pass).expect("fits");
            words = device.photon_words(sent.landed).expect("there");
            let map = &maps.maps()[0];
            let (landed, few) = (map.len() as i64, map.len() as i64 / 100);
            assert!(landed > 3000 && (landed - i64::from(sent.landed)).abs() <= few, "{landed} {sent:?}");
            assert!(rays.abs_diff(sent.rays) < rays / 200, "{rays} {sent:?}");
            let strange = strangers(map, &words) as i64;
            assert!(strange <= few, "{strange} of {landed}");
        }
        let (other, _) = renderer.photon_maps(&plan, 0).expect("in memory");
        assert!(strangers(&other.maps()[0], &words) > words.len() / PHOTON_WORDS / 2, "another pass");
    });
}

#[test]
fn pictures_are_those_of_the_cpu_and_not_those_of_another_radius_or_without_photons() {
    let Some(mut executor) = software() else { return };
    let scene = mirrors();
    let plain = under_photons(&scene, RADIUS);
    let cpu = |settings: &RenderSettings| with_renderer(&scene, settings, |renderer| on_cpu(renderer, 3));
    let here = cpu(&plain);
    let device = with_renderer(&scene, &plain, |renderer| on_device(&mut executor, renderer, (3, 10_000)));
    let cut = with_renderer(&scene, &plain, |renderer| on_device(&mut executor, renderer, (3, 500)));
    assert!(cut == device);
    let wider = cpu(&under_photons(&scene, 1.3 * RADIUS));
    let none =
        with_renderer(&scene, &RenderSettings { integrator: Integrator::Whitted, ..plain }, |renderer| {
            gather(renderer.settings(), |sink| {
                renderer.render_tile(renderer.settings().region(), 0..3, sink).expect("in memory")
            })
        });
    let [share, of_wider, of_none] = [&device, &wider, &none].map(|p| difference(&here, p) / power(&here));
    assert!(share < 0.02 * of_wider && share < 0.02 * of_none, "{share}, controls {of_wider} {of_none}");
    let rays = [&here, &device].map(|p| (p.stats.rays + p.stats.shadow_rays) as f64);
    assert!((rays[0] / rays[1] - 1.0).abs() < 5e-3, "{:?} {:?}", here.stats, device.stats);
}
