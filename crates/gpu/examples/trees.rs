//! Trees that devices build beside those of the CPU: what rays visit in them, and rays a second on the CPU, for all eight-wide trees alike:
//! `cargo run --release -p vastlight-gpu --example trees -- [ADAPTER]`.

use std::time::Instant;
use vastlight_accel::wide::{ChildRef, MeshBvh, MeshView};
use vastlight_accel::{BuildConfig, Scratch};
use vastlight_gpu::bench::{self, BuildInput};
use vastlight_gpu::build::Builder;
use vastlight_gpu::{DeviceChoice, Drivers, Executor, ExecutorConfig};
use vastlight_math::{Affine3, FAR, Ray, Vec3};
use vastlight_scene::generate::{GenerateOptions, by_name};
use vastlight_scene::{Instance, Mesh, Scene, SceneDesc};
use vastlight_trace::{AcceptAll, Hit, Tracer, TracerConfig};

/// Rays of each kind.
const RAYS: usize = 1 << 16;
/// Runs through each tree; the best counts.
const REPEATS: u32 = 3;
/// Most triangles in a leaf.
const LEAF: u32 = 8;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Outcome<()> {
    let adapter = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let choice = adapter.map_or(DeviceChoice::Any, DeviceChoice::Index);
    let mut executor = Executor::new(Drivers::load().open(choice)?, ExecutorConfig::default());
    show(executor.adapter().name.clone());
    for (name, mesh) in [("statue", statue()?), ("needles", needles())] {
        let scene = alone(mesh)?;
        show(format!("{name}, {} triangles", scene.meshes()[0].triangles.len()));
        for budget in [1.0, 2.0] {
            let trees = trees(&mut executor, &scene, budget)?;
            compare(&scene, budget, &trees)?;
        }
    }
    Ok(())
}

/// The largest mesh of a demo.
fn statue() -> Outcome<Mesh> {
    let options = GenerateOptions { triangles: Some(200_000), ..GenerateOptions::default() };
    let meshes = by_name("statue", &options)?.meshes;
    meshes.into_iter().max_by_key(|mesh| mesh.triangles.len()).ok_or_else(|| "no mesh".into())
}

/// Long thin triangles in all directions.
fn needles() -> Mesh {
    let corner = |i: usize| {
        let along =
            (point(i / 3, 20).normalize_or_zero() * 0.4) * if i.is_multiple_of(3) { 1.0 } else { 0.0 };
        point(i / 3, 10) + along + point(i, 30) * 0.003
    };
    let triangle = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
    let count = 60_000;
    Mesh {
        positions: (0..3 * count).map(corner).collect(),
        triangles: (0..count as u32).map(triangle).collect(),
        ..Mesh::default()
    }
}

fn alone(mesh: Mesh) -> Outcome<Scene> {
    let instances = vec![Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 }];
    let desc =
        SceneDesc { meshes: vec![mesh], instances, names: vec![String::new()], ..SceneDesc::default() };
    Ok(Scene::new(desc)?)
}

fn view(scene: &Scene) -> MeshView<'_> {
    let mesh = &scene.meshes()[0];
    MeshView { positions: &mesh.positions, triangles: &mesh.triangles }
}

/// The trees of some builders on the CPU and of those on the device.
fn trees(executor: &mut Executor, scene: &Scene, budget: f32) -> Outcome<Vec<(String, MeshBvh)>> {
    let mut trees = Vec::new();
    for name in ["morton", "hlbvh2", "grid-sah", "binned-sah"] {
        let config = BuildConfig { split_budget: Some(budget), ..BuildConfig::default() };
        let (bvh, _) = MeshBvh::build(name, &view(scene), &config, &mut Scratch::default())?;
        trees.push((format!("CPU {name}"), bvh));
    }
    for (name, builder) in Builder::ALL {
        if builder == Builder::MortonQueues {
            continue;
        }
        let MeshView { positions, triangles } = view(scene);
        let split_budget = Some(budget);
        let input = BuildInput { positions, triangles, builder, leaf: LEAF, split_budget };
        let (_, tree, wide) = bench::build(executor, &input, 1)?;
        let bvh = MeshBvh::over_nodes(&view(scene), &wide.nodes, &wide.leaves, &tree.prims);
        bvh.validate(&view(scene))?;
        trees.push((format!("device {name}"), bvh));
    }
    Ok(trees)
}

/// A line a tree: wide nodes and blocks that rays visit, and rates on the CPU, measured in turns.
fn compare(scene: &Scene, budget: f32, trees: &[(String, MeshBvh)]) -> Outcome<()> {
    let around = trees[0].1.bounds;
    let batches: Vec<Vec<Ray>> =
        [outer_ray, inner_ray].map(|ray| (0..RAYS).map(|i| ray(i, &around)).collect()).into();
    let config = TracerConfig { single_rays: true, ..TracerConfig::default() };
    let over = |bvh: &MeshBvh| Tracer::over_meshes(scene, vec![bvh.clone()], &config);
    let tracers = trees.iter().map(|tree| over(&tree.1)).collect::<Result<Vec<_>, _>>()?;
    let mut best = vec![[f64::INFINITY; 2]; trees.len()];
    let mut hits = vec![Hit::MISS; RAYS];
    let mut met = vec![[0; 2]; trees.len()];
    for _ in 0..REPEATS {
        for (tree, tracer) in tracers.iter().enumerate() {
            for (kind, rays) in batches.iter().enumerate() {
                let start = Instant::now();
                tracer.closest(rays, &AcceptAll, &mut hits);
                best[tree][kind] = best[tree][kind].min(start.elapsed().as_secs_f64());
                met[tree][kind] = hits.iter().filter(|hit| hit.is_hit()).count();
            }
        }
    }
    for (tree, (name, bvh)) in trees.iter().enumerate() {
        let of_kind = |kind: usize| {
            let [nodes, blocks] = visited(bvh, &batches[kind]);
            let rate = RAYS as f64 / best[tree][kind] / 1e6;
            format!("{nodes:.2} nodes, {blocks:.2} blocks, {rate:.2} M rays/s, {} hits", met[tree][kind])
        };
        let (nodes, blocks) = (bvh.nodes.len(), bvh.blocks.len());
        show(format!(
            "budget {budget}, {name} ({nodes} nodes, {blocks} blocks): from outside {}; from inside {}",
            of_kind(0),
            of_kind(1)
        ));
    }
    Ok(())
}

/// Wide nodes and blocks that a ray visits on the way to its closest hit, children from near to far; the mean.
fn visited(bvh: &MeshBvh, rays: &[Ray]) -> [f64; 2] {
    let mut all = [0_u64; 2];
    for ray in rays {
        let mut t = f32::INFINITY;
        let mut open: Vec<(f32, ChildRef)> = bvh.root.map(|root| (0.0, root)).into_iter().collect();
        while let Some((enter, child)) = open.pop() {
            if enter > t {
                continue;
            }
            all[usize::from(child.is_leaf())] += 1;
            if child.is_leaf() {
                let block = &bvh.blocks[child.index()];
                t = block.used().fold(t, |t, lane| t.min(meet(block.triangle(lane), ray)));
                continue;
            }
            let node = &bvh.nodes[child.index()];
            let first = open.len();
            for slot in (0..8).filter(|&slot| node.children[slot] != ChildRef::NONE) {
                let b = node.bounds(slot);
                let (p, q) = ((b.min - ray.origin) / ray.direction, (b.max - ray.origin) / ray.direction);
                let (near, far) = (p.min(q).max_element().max(0.0), p.max(q).min_element());
                if near <= far.min(t) {
                    open.push((near, node.children[slot]));
                }
            }
            open[first..].sort_by(|a, b| b.0.total_cmp(&a.0));
        }
    }
    all.map(|count| count as f64 / rays.len() as f64)
}

/// Where a ray meets a triangle (Moeller, Trumbore 1997), or infinity.
fn meet([a, b, c]: [Vec3; 3], ray: &Ray) -> f32 {
    let (ab, ac, from_a) = (b - a, c - a, ray.origin - a);
    let p = ray.direction.cross(ac);
    let q = from_a.cross(ab);
    let scale = 1.0 / ab.dot(p);
    let (u, v, t) = (from_a.dot(p) * scale, ray.direction.dot(q) * scale, ac.dot(q) * scale);
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 { t } else { f32::INFINITY }
}

/// Numbers in [0, 1).
fn noise(i: usize, salt: u64) -> f32 {
    let mut x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ salt.wrapping_mul(0xd134_2543_de82_ef95);
    x = (x ^ x >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x ^= x >> 29;
    (x >> 40) as f32 / 16_777_216.0
}

fn point(i: usize, salt: u64) -> Vec3 {
    Vec3::new(noise(i, salt), noise(i, salt + 1), noise(i, salt + 2)) * 2.0 - 1.0
}

/// From a sphere around everything to a point inside.
fn outer_ray(i: usize, around: &vastlight_math::Aabb) -> Ray {
    let size = around.size();
    let origin = around.min + size * 0.5 + point(i, 60).normalize_or_zero() * size.length();
    toward(origin, around.min + size * (point(i, 70) * 0.5 + 0.5))
}

/// From a point inside to another.
fn inner_ray(i: usize, around: &vastlight_math::Aabb) -> Ray {
    let place = |salt| around.min + around.size() * (point(i, salt) * 0.5 + 0.5);
    toward(place(80), place(90))
}

fn toward(origin: Vec3, to: Vec3) -> Ray {
    Ray { origin, t_min: 0.0, direction: to - origin, t_max: FAR, time: 0.0 }
}

#[expect(clippy::print_stdout, reason = "an example's result")]
fn show(line: String) {
    println!("{line}");
}
