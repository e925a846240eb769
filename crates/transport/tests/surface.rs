//! Positions, normals and ray origins of surfaces.

mod common;

use common::{Build, shapes};
use vastlight_math::glam::EulerRot;
use vastlight_math::{Affine3, Quat, Ray, Rng, Vec3, warp};
use vastlight_scene::{Material, Mesh, Scene};
use vastlight_trace::{AcceptAll, Hit, Tracer, TracerConfig};
use vastlight_transport::Surface;

/// A random placement: turned, stretched unevenly, mirrored half of the time, `scale` large, `offset` away.
fn placement(rng: &mut Rng, scale: f32, offset: f32) -> Affine3 {
    let mut between = |a: f32, b: f32| a + (b - a) * rng.next_1d();
    let turn = |x: f32, y: f32, z: f32| Affine3::from_quat(Quat::from_euler(EulerRot::XYZ, x, y, z));
    let stretch = Vec3::new(between(0.3, 1.0), between(0.3, 1.0), between(-1.0, 1.0).signum());
    let first = turn(between(0.0, 6.0), between(0.0, 6.0), between(0.0, 6.0));
    let second = turn(between(0.0, 6.0), between(0.0, 6.0), between(0.0, 6.0));
    let at = Vec3::new(between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)) * offset;
    Affine3::from_translation(at) * first * Affine3::from_scale(stretch * scale) * second
}

/// A random point of a random triangle as a hit.
fn random_hit(rng: &mut Rng, mesh: &Mesh) -> Hit {
    let prim = ((rng.next_1d() * mesh.triangles.len() as f32) as u32).min(mesh.triangles.len() as u32 - 1);
    let b = warp::uniform_triangle(rng.next_2d());
    Hit { t: 1.0, u: b.x, v: b.y, instance: 0, prim }
}

/// Rays out of a convex body that hit it, and rays into it that do not, out of `n` each.
fn wrong_rays(mesh: Mesh, place: Affine3, rng: &mut Rng, n: usize) -> (usize, usize) {
    let scene: Scene = Build::in_light(Vec3::ONE).add(mesh, Material::new("m"), place).finish();
    let tracer = Tracer::new(&scene, &TracerConfig::default()).expect("a tracer");
    let mut rays = Vec::new();
    for i in 0..2 * n {
        let hit = random_hit(rng, &scene.meshes()[0]);
        let surface = Surface::new(&scene, &hit, 0, false);
        let side = if i < n { 1.0 } else { -1.0 };
        let around = vastlight_math::Frame::from_z(surface.normal * side);
        let direction = around.to_outer(warp::cosine_hemisphere(rng.next_2d()));
        rays.push(Ray::new(surface.origin_towards(direction), direction));
    }
    let mut hits = vec![Hit::MISS; rays.len()];
    tracer.closest(&rays, &AcceptAll, &mut hits);
    let (out, into) = hits.split_at(n);
    (out.iter().filter(|h| h.is_hit()).count(), into.iter().filter(|h| !h.is_hit()).count())
}

#[test]
fn rays_leave_their_own_triangle() {
    let mut rng = Rng::new(7);
    for round in 0..60 {
        let scale = 10.0_f32.powi(round % 11 - 4);
        let offset = [0.0, 1.0, 30.0, 1e3][round as usize % 4] * scale;
        let mesh = if round % 2 == 0 { shapes::cube() } else { shapes::sphere(2, false) };
        let place = placement(&mut rng, scale, offset);
        let (out, into) = wrong_rays(mesh, place, &mut rng, 2000);
        assert_eq!(out, 0, "round {round}: rays hit the body that they leave");
        assert!(into <= 4, "round {round}: {into} of 2000 rays escape from within");
    }
}

#[test]
fn normals_point_outwards_also_of_mirrored_bodies() {
    let mut rng = Rng::new(3);
    for _ in 0..50 {
        let place = placement(&mut rng, 2.0, 5.0);
        let center = place.transform_point3(Vec3::ZERO);
        let scene =
            Build::in_light(Vec3::ONE).add(shapes::sphere(2, true), Material::new("m"), place).finish();
        for _ in 0..50 {
            let surface = Surface::new(&scene, &random_hit(&mut rng, &scene.meshes()[0]), 0, false);
            let outwards = surface.position - center;
            assert!(surface.normal.dot(outwards) > 0.0 && surface.smooth_normal.dot(outwards) > 0.0);
            assert!((surface.normal.length() - 1.0).abs() < 1e-5);
            assert!(surface.normal.dot(surface.smooth_normal) > 0.9);
        }
    }
}

/// The tangent follows u, the bitangent falls with v, in mirrored instances as well: the map's "up" is up in the image.
#[test]
fn tangents_follow_texture_coordinates() {
    let mut rng = Rng::new(5);
    for _ in 0..50 {
        let place = placement(&mut rng, 1.0, 3.0);
        let stretched = Material { anisotropy: 0.5, ..Material::new("m") };
        let scene = Build::in_light(Vec3::ONE).add(shapes::quad(), stretched, place).finish();
        let surface = Surface::new(&scene, &random_hit(&mut rng, &scene.meshes()[0]), 1, true);
        let frame = surface.frame();
        let along_u = place.transform_vector3(Vec3::X);
        let up = place.transform_vector3(Vec3::Y);
        assert!(frame.x.dot(along_u.normalize()) > 0.999);
        assert!(frame.y.dot(up) > 0.0, "{frame:?} {up}");
        assert!(frame.z.dot(surface.normal) > 0.999);
    }
}

/// Whatever the shading normal, the frame that faces `wo` has `wo` and its mirror image on their side.
#[test]
fn bent_frames_reflect_to_their_own_side() {
    let mut rng = Rng::new(11);
    let place = Affine3::IDENTITY;
    let scene = Build::in_light(Vec3::ONE).add(shapes::quad(), Material::new("m"), place).finish();
    let surface = Surface::new(&scene, &random_hit(&mut rng, &scene.meshes()[0]), 0, false);
    let mut bent = 0;
    for _ in 0..20_000 {
        let z = warp::uniform_hemisphere(rng.next_2d());
        let wo = warp::uniform_sphere(rng.next_2d());
        let side = wo.z.signum();
        let frame = surface.facing(vastlight_math::Frame::from_z(z), wo);
        let mirrored = frame.z * (2.0 * wo.dot(frame.z)) - wo;
        assert!(wo.dot(frame.z) * side > -1e-6, "{z} {wo}");
        assert!(mirrored.z * side > -1e-5, "{z} {wo} {mirrored}");
        assert!(frame.z.z > 0.0 && (frame.z.length() - 1.0).abs() < 1e-5);
        bent += usize::from(frame.z != z);
    }
    assert!(bent > 1000 && bent < 19_000, "{bent}");
}
