//! Traces a ray file through the structures of the crate obvhs, beside vastlight and Embree.
//!
//! `obvhs-bench MESH.ply RAYS [--preset fast|medium|slow] [--structure bvh2|cwbvh] [--threads 2]`: one JSON line with
//! the names that the Embree driver uses. Closest hits, also for shadow rays: its walk for any hit does not end at the first. The mesh is a binary PLY file with positions and triangles alone.

use glam::Vec3A;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use obvhs::{BvhBuildParams, bvh2::Bvh2, cwbvh::CwBvh};
use std::error::Error;
use std::io::{BufRead, BufReader, Read};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Rays that a thread takes at a time.
const CHUNK: usize = 4096;

enum Structure {
    Binary(Bvh2),
    Wide(CwBvh),
}

fn read_mesh(path: &str) -> Result<Vec<Triangle>, Box<dyn Error>> {
    let mut file = BufReader::new(std::fs::File::open(path)?);
    let (mut vertices, mut faces, mut line) = (0, 0, String::new());
    while line.trim() != "end_header" {
        line.clear();
        if file.read_line(&mut line)? == 0 {
            return Err("the header does not end".into());
        }
        match line.split_whitespace().collect::<Vec<_>>()[..] {
            ["element", "vertex", n] => vertices = n.parse()?,
            ["element", "face", n] => faces = n.parse()?,
            _ => {}
        }
    }
    let word = |bytes: &[u8], at: usize| [0, 1, 2, 3].map(|i| bytes[at + i]);
    let mut bytes = vec![0; 12 * vertices];
    file.read_exact(&mut bytes)?;
    let float = |bytes: &[u8], at: usize| f32::from_le_bytes(word(bytes, at));
    let points: Vec<Vec3A> =
        bytes.chunks_exact(12).map(|v| Vec3A::new(float(v, 0), float(v, 4), float(v, 8))).collect();
    bytes.resize(13 * faces, 0);
    file.read_exact(&mut bytes)?;
    let corner = |face: &[u8], i: usize| points[u32::from_le_bytes(word(face, 1 + 4 * i)) as usize];
    let triangle = |face: &[u8]| Triangle { v0: corner(face, 0), v1: corner(face, 1), v2: corner(face, 2) };
    Ok(bytes.chunks_exact(13).map(triangle).collect())
}

fn read_rays(path: &str) -> Result<Vec<Ray>, Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let ray = |r: &[u8]| {
        let v: Vec<f32> = r.chunks_exact(4).map(|w| f32::from_le_bytes([w[0], w[1], w[2], w[3]])).collect();
        Ray::new(Vec3A::new(v[0], v[1], v[2]), Vec3A::new(v[4], v[5], v[6]), v[3], v[7])
    };
    Ok(bytes.chunks_exact(32).map(ray).collect())
}

/// The closest hit; infinite for none.
fn trace(structure: &Structure, triangles: &[Triangle], ray: Ray) -> f32 {
    let mut hit = RayHit::none();
    match structure {
        Structure::Wide(bvh) => {
            let order = &bvh.primitive_indices;
            bvh.ray_traverse(ray, &mut hit, |ray, id| triangles[order[id] as usize].intersect(ray));
        }
        Structure::Binary(bvh) => {
            let order = &bvh.primitive_indices;
            bvh.ray_traverse(ray, &mut hit, |ray, id| triangles[order[id] as usize].intersect(ray));
        }
    }
    hit.t
}

/// Hits and the sum of their parameters.
fn trace_all(structure: &Structure, triangles: &[Triangle], rays: &[Ray], threads: usize) -> (u64, f64) {
    let next = AtomicUsize::new(0);
    let work = || {
        let (mut hits, mut sum) = (0, 0.0);
        loop {
            let first = next.fetch_add(CHUNK, Ordering::Relaxed);
            let Some(chunk) = rays.get(first..rays.len().min(first + CHUNK)).filter(|c| !c.is_empty()) else {
                return (hits, sum);
            };
            for &ray in chunk {
                let t = trace(structure, triangles, ray);
                if t < ray.tmax {
                    hits += 1;
                    sum += f64::from(t);
                }
            }
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let results = workers.into_iter().filter_map(|worker| worker.join().ok());
        results.fold((0, 0.0), |(hits, sum), (h, s)| (hits + h, sum + s))
    })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let value =
        |name: &str| arguments.iter().position(|a| a == name).and_then(|i| arguments.get(i + 1)).cloned();
    let [mesh, rays_file, ..] = &arguments[..] else {
        return Err("usage: obvhs-bench MESH.ply RAYS ...".into());
    };
    let (triangles, rays) = (read_mesh(mesh)?, read_rays(rays_file)?);
    let preset = value("--preset").unwrap_or("medium".into());
    let parameters = || match preset.as_str() {
        "fast" => BvhBuildParams::fast_build(),
        "slow" => BvhBuildParams::slow_build(),
        _ => BvhBuildParams::medium_build(),
    };
    let wide = value("--structure").is_none_or(|name| name == "cwbvh");
    let threads: usize = value("--threads").map_or(Ok(2), |n| n.parse())?;
    let (mut structure, mut build) = (None, Duration::MAX);
    for _ in 0..3 {
        let (start, mut core) = (Instant::now(), Duration::ZERO);
        structure = Some(if wide {
            Structure::Wide(build_cwbvh_from_tris(&triangles, parameters(), &mut core))
        } else {
            Structure::Binary(build_bvh2_from_tris(&triangles, parameters(), &mut core))
        });
        build = build.min(start.elapsed());
    }
    let Some(structure) = structure else { return Ok(()) };
    let (mut best, mut answer) = (Duration::MAX, (0, 0.0));
    for _ in 0..5 {
        let start = Instant::now();
        answer = trace_all(&structure, &triangles, &rays, threads);
        best = best.min(start.elapsed());
    }
    println!(
        "{{\"lib\":\"obvhs 0.3.1\",\"preset\":\"{preset}\",\"structure\":\"{}\",\"tris\":{},\"threads\":{threads},\"build_ms_best\":{:.1},\"Mrays_s_best\":{:.3},\"hits\":{},\"sum_t\":{:.6}}}",
        if wide { "cwbvh" } else { "bvh2" },
        triangles.len(),
        build.as_secs_f64() * 1e3,
        rays.len() as f64 / best.as_secs_f64() / 1e6,
        answer.0,
        answer.1,
    );
    Ok(())
}
