//! Scenes, rays and the brute-force oracle for the tests.
#![allow(dead_code, reason = "each test file uses a part")]

pub(crate) mod shapes;

use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_scene::{Instance, Mesh, Scene, SceneDesc};
use vastlight_simd::Level;
use vastlight_trace::stream::{Outlets, StreamRay};
use vastlight_trace::{AcceptAll, Hit, Layout, Tracer, TracerConfig};

/// A small generator of numbers for tests: xorshift64*.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// The next number in [0, 1).
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / 16_777_216.0
    }

    /// A point in the cube from -1 to 1.
    pub(crate) fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// A number below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f32) as usize).min(n - 1)
    }
}

/// A scene of meshes, each placed by every map beside it.
pub(crate) fn scene(meshes: Vec<(Mesh, Vec<Affine3>)>) -> Scene {
    let mut desc = SceneDesc::default();
    for (mesh, maps) in meshes {
        let number = desc.meshes.len() as u32;
        desc.meshes.push(mesh);
        desc.instances.extend(maps.into_iter().map(|m| Instance {
            world_from_object: m,
            mesh: number,
            name: 0,
        }));
    }
    Scene::new(desc).expect("a valid scene")
}

/// A tracer at a level.
pub(crate) fn tracer(scene: &Scene, level: Level) -> Tracer {
    tracer_over("", scene, level)
}

/// Names of structures for tests: the default, the same in the compact layout, kd-trees by threads and with a stack.
pub(crate) const ACCELS: [&str; 5] = ["", "compact", "kd-threaded", "kd-threaded-sah", "kd-stack"];

/// A tracer over a structure by name.
pub(crate) fn tracer_over(accel: &str, scene: &Scene, level: Level) -> Tracer {
    let (accel, layout) = if accel == "compact" { ("", Layout::Compact) } else { (accel, Layout::Wide) };
    let config = TracerConfig { level: Some(level), accel: accel.into(), layout, ..TracerConfig::default() };
    Tracer::new(scene, &config).expect("built")
}

/// Hits of all rays by the kernels of the stream tracer: the closest, or some.
pub(crate) fn streamed(tracer: &Tracer, rays: &[Ray], any: bool) -> Vec<Hit> {
    let mut stream: Vec<StreamRay> = rays.iter().map(|ray| StreamRay::new(ray, any)).collect();
    let mut waiting: Vec<u32> = (0..rays.len() as u32).collect();
    let mut ended = Vec::new();
    while !waiting.is_empty() {
        let mut at_leaves = Vec::new();
        tracer.traverse(&mut stream, &waiting, Outlets { on: &mut at_leaves, ended: &mut ended });
        waiting.clear();
        let outlets = Outlets { on: &mut waiting, ended: &mut ended };
        tracer.intersect(&mut stream, &at_leaves, &AcceptAll, outlets);
    }
    ended.sort_unstable();
    assert!(ended.into_iter().eq(0..rays.len() as u32), "every ray ends once");
    stream.iter().map(StreamRay::hit).collect()
}

/// Closest hits of all rays.
pub(crate) fn closest(tracer: &Tracer, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    tracer.closest(rays, &AcceptAll, &mut hits);
    hits
}

/// Occlusion of all rays.
pub(crate) fn occluded(tracer: &Tracer, rays: &[Ray]) -> Vec<bool> {
    let mut out = vec![false; rays.len()];
    tracer.occluded(rays, &AcceptAll, &mut out);
    out
}

/// Rays from around a place to its inside.
pub(crate) fn rays_at(random: &mut Random, count: usize, center: Vec3, size: f32) -> Vec<Ray> {
    let ray = |_| {
        let origin = center + random.point() * (size * 2.0);
        Ray::new(origin, center + random.point() * size - origin)
    };
    (0..count).map(ray).collect()
}

/// Rays that go much the same way: around each given one a beam of 64, from narrow to wide. Some are broken or short.
pub(crate) fn beams(random: &mut Random, around: &[Ray]) -> Vec<Ray> {
    let mut rays = Vec::new();
    for (beam, axis) in around.iter().enumerate() {
        let width = axis.direction.length() * [0.0, 1e-4, 1e-2, 0.1][beam % 4];
        for i in 0..64 {
            let mut ray = *axis;
            ray.direction += random.point() * width;
            if beam % 3 == 0 {
                ray.origin += random.point() * width;
            }
            match (beam + i) % 31 {
                7 => ray.direction.x = f32::NAN,
                11 => ray.direction = Vec3::ZERO,
                13 => (ray.t_min, ray.t_max) = (0.3, 0.7),
                17 => (ray.t_min, ray.t_max) = (0.7, 0.3),
                19 => ray.direction.y = -0.0,
                _ => {}
            }
            rays.push(ray);
        }
    }
    rays
}

/// Hits by brute force: every triangle of every instance is a scene of its own, so no tree is involved, and the closest
/// of all answers counts.
pub(crate) struct BruteForce {
    /// One tracer a triangle: (instance, triangle, tracer).
    single: Vec<(u32, u32, Tracer)>,
}

impl BruteForce {
    /// The oracle for a scene. Each single triangle keeps the whole mesh's vertices, which set lattice and margins.
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut single = Vec::new();
        for (number, instance) in scene.instances().iter().enumerate() {
            let mesh = &scene.meshes()[instance.mesh as usize];
            for prim in 0..mesh.triangles.len() as u32 {
                let mut one = Mesh { positions: mesh.positions.clone(), ..Mesh::default() };
                one.triangles.push(mesh.triangles[prim as usize]);
                let scene = self::scene(vec![(one, vec![instance.world_from_object])]);
                if !scene.instances().is_empty() {
                    single.push((number as u32, prim, tracer(&scene, Level::PORTABLE)));
                }
            }
        }
        Self { single }
    }

    /// The closest hit.
    pub(crate) fn closest(&self, ray: &Ray) -> Hit {
        let mut best = Hit::MISS;
        for (instance, prim, tracer) in &self.single {
            let found = closest(tracer, std::slice::from_ref(ray))[0];
            let before = (found.t, *instance, *prim) < (best.t, best.instance, best.prim);
            if found.is_hit() && before {
                best = Hit { instance: *instance, prim: *prim, ..found };
            }
        }
        best
    }
}
