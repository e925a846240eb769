//! Ray files.

use std::sync::OnceLock;
use vastlight::LoadOptions;
use vastlight::scene::Scene;
use vastlight::trace::bench::{RAY_BYTES, parse_rays};
use vastlight::trace::{AcceptAll, Hit, Tracer, TracerConfig};

fn scene() -> &'static (Scene, Tracer) {
    static SCENE: OnceLock<(Scene, Tracer)> = OnceLock::new();
    SCENE.get_or_init(|| {
        let scene = vastlight::load("demo:cornell", &LoadOptions::default()).expect("a demo");
        let tracer = Tracer::new(&scene, &TracerConfig::default()).expect("builds");
        (scene, tracer)
    })
}

/// Rays through a small scene.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let Ok(rays) = parse_rays(bytes) else { return false };
    assert_eq!(rays.len() * RAY_BYTES, bytes.len());
    let (scene, tracer) = scene();
    let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
    tracer.closest(&rays, &AcceptAll, &mut hits);
    tracer.occluded(&rays, &AcceptAll, &mut occluded);
    for ((ray, hit), occluded) in rays.iter().zip(&hits).zip(occluded) {
        assert_eq!(hit.is_hit(), occluded, "{ray:?}");
        if hit.is_hit() {
            // The ends of a ray as far as its numbers are normal: the length of a direction scales them.
            let is_normal = ray.direction.abs().max_element() >= f32::MIN_POSITIVE;
            let is_on_ray = hit.t + f32::MIN_POSITIVE >= ray.t_min && hit.t <= ray.t_max || !is_normal;
            assert!(is_on_ray && hit.u.is_finite() && hit.v.is_finite(), "{ray:?} {hit:?}");
            let mesh = scene.instances().mesh(hit.instance as usize) as usize;
            assert!((hit.prim as usize) < scene.meshes()[mesh].triangles.len());
        }
    }
    true
}
