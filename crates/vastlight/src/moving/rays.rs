//! Rays to measure with: what a scene's camera sees, and what bounces from there.

use crate::{CameraChoice, Error};
use rayon::prelude::*;
use vastlight_math::{Frame, Ray, Sampler, Vec2, Vec3, rng, warp};
use vastlight_scene::Scene;
use vastlight_trace::bench::trace;
use vastlight_trace::sort::SortRays;
use vastlight_trace::{Hit, Tracer};
use vastlight_transport::{CameraRays, RenderSettings};

/// Times that rays are traced; the best counts.
const REPEATS: u32 = 2;

/// What rays through a structure took, and what they met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Traced {
    pub(super) ms: f64,
    /// Hits, and the bits of the sum of their distances.
    pub(super) answer: (u64, u64),
}

pub(super) fn traced(tracer: &Tracer, rays: &[Ray]) -> Traced {
    let figures = trace(tracer, rays, false, SortRays::Auto, REPEATS);
    let ms = rays.len() as f64 / figures.mrays_per_s / 1e3;
    Traced { ms, answer: (figures.hits, figures.sum_t.to_bits()) }
}

/// Rays of the scene's first camera, one through each pixel, and what they meet.
pub(super) fn seen(
    scene: &Scene,
    tracer: &Tracer,
    [width, height]: [u32; 2],
) -> Result<(Vec<Ray>, Vec<Hit>), Error> {
    let settings = RenderSettings::new(CameraChoice::default().resolve(scene)?, width, height);
    let camera = CameraRays::new(&settings);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let rays: Vec<Ray> =
        pixels.map(|pixel| camera.ray(pixel, camera.draw(Sampler::new(pixel, 0, 0)))).collect();
    let mut hits = vec![Hit::MISS; rays.len()];
    tracer.closest_parallel(&rays, &mut hits);
    Ok((rays, hits))
}

/// The normal of the triangle that a ray meets, on the ray's side; none of what has no triangles.
pub(super) fn normal(scene: &Scene, ray: &Ray, hit: &Hit) -> Option<Vec3> {
    let map = scene.instances().maps().get(hit.instance as usize).filter(|_| hit.is_hit())?;
    let mesh = &scene.meshes()[scene.instances().mesh(hit.instance as usize) as usize];
    mesh.triangles.get(hit.prim as usize)?;
    let [a, b, c] = mesh.corners(hit.prim).map(|p| map.transform_point3(p));
    let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
    Some(if normal.dot(ray.direction) > 0.0 { -normal } else { normal })
}

/// What the camera [sees](seen), and rays that bounce from there, spread by the cosine.
pub(crate) fn rays(scene: &Scene, tracer: &Tracer, size: [u32; 2]) -> Result<Vec<Ray>, Error> {
    let (mut rays, hits) = seen(scene, tracer, size)?;
    let bounced = |(i, (ray, hit)): (usize, (&Ray, &Hit))| {
        let normal = normal(scene, ray, hit)?;
        let unit = |dimension| rng::hash_to_unit(&[i as u32, dimension]);
        let local = warp::cosine_hemisphere(Vec2::new(unit(0), unit(1)));
        let frame = Frame::from_z(normal);
        let direction = frame.x * local.x + frame.y * local.y + frame.z * local.z;
        let origin = ray.origin + ray.direction * hit.t;
        Some(Ray::new(origin + normal * (1e-4 * hit.t), direction))
    };
    let more: Vec<Ray> = rays.par_iter().zip(&hits).enumerate().filter_map(bounced).collect();
    rays.extend(more);
    Ok(rays)
}
