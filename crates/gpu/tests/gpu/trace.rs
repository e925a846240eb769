//! Closest hits on the software adapter against every triangle tested on the CPU.

use crate::common::software;
use vastlight_accel::compact::CompactMesh;
use vastlight_accel::triangle::intersect;
use vastlight_accel::wide::{Block8, MeshBvh, MeshView};
use vastlight_accel::{BuildConfig, Scratch, ray::ScaledRay};
use vastlight_gpu::trace::{DeviceHit, DeviceMesh, DeviceRay, MAX_RAYS, record_closest};
use vastlight_gpu::{DeviceChoice, Drivers, Executor, ExecutorConfig, GpuError, Recording};
use vastlight_math::Vec3;
use vastlight_math::rng::{hash_words, unit_f32};
use vastlight_simd::Portable;

/// Numbers in [0, 1).
fn noise(i: usize, salt: u32) -> f32 {
    unit_f32((hash_words(&[i as u32, salt]) >> 32) as u32)
}

/// A point in the cube from -1 to 1, on a lattice.
fn point(i: usize, salt: u32) -> Vec3 {
    let axis = |k| (noise(i, salt + k) * 1_048_576.0).floor() / 524_288.0 - 1.0;
    Vec3::new(axis(0), axis(1), axis(2))
}

struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Separate triangles of this size, a power of two.
    fn soup(count: usize, size: f32) -> Self {
        let corner = |i: usize| point(i / 3, 1) + point(i, 10) * size;
        let triangle = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
        Self {
            positions: (0..3 * count).map(corner).collect(),
            triangles: (0..count as u32).map(triangle).collect(),
        }
    }

    /// A bumpy sheet between -1 and 1 whose triangles share vertices; its rays go through edges and corners too.
    fn sheet(side: usize) -> Self {
        let at = |i: usize| i as f32 / 32.0 - 1.0;
        let height = |i: usize| ((i % side * 7 + i / side * 13) % 32) as f32 / 256.0;
        let quad = |i: usize| {
            let a = (i / (side - 1) * side + i % (side - 1)) as u32;
            let (b, c) = (a + 1, a + side as u32);
            [[a, b, c], [b, c + 1, c]]
        };
        Self {
            positions: (0..side * side).map(|i| Vec3::new(at(i % side), height(i), at(i / side))).collect(),
            triangles: (0..(side - 1) * (side - 1)).flat_map(quad).collect(),
        }
    }

    fn view(&self) -> MeshView<'_> {
        MeshView { positions: &self.positions, triangles: &self.triangles }
    }

    /// On the device, in pages of these bytes.
    fn pack(&self, executor: &mut Executor, page_bytes: usize) -> (DeviceMesh, CompactMesh) {
        let (wide, _) = MeshBvh::build("", &self.view(), &BuildConfig::default(), &mut Scratch::default())
            .expect("built");
        let (compact, pages) = CompactMesh::pack(&wide, page_bytes).expect("on a lattice");
        (DeviceMesh::new(executor, &compact, &pages).expect("fits"), compact)
    }

    /// The closest hit among all triangles.
    fn closest(&self, compact: &CompactMesh, origin: Vec3, direction: Vec3) -> Option<(f32, u32)> {
        let (_, ray) = ScaledRay::new(origin * compact.scale, direction * compact.scale)?
            .for_triangles(compact.extent)?;
        let mut best: Option<(f32, u32)> = None;
        for (i, some) in self.triangles.chunks(8).enumerate() {
            let corners = |t: &[u32; 3]| t.map(|v| self.positions[v as usize] * compact.scale);
            let numbered = some.iter().enumerate().map(|(lane, t)| ((8 * i + lane) as u32, corners(t)));
            let block = Block8::new(numbered);
            let hits = intersect(Portable, &block, &ray);
            for lane in (0..8).filter(|lane| hits.lanes >> lane & 1 == 1) {
                let found = (hits.t[lane], block.prims[lane]);
                if found.0 >= 0.0 && best.is_none_or(|best| found < best) {
                    best = Some(found);
                }
            }
        }
        best
    }
}

fn trace(executor: &mut Executor, mesh: &DeviceMesh, rays: &[DeviceRay]) -> Vec<Option<DeviceHit>> {
    let words: Vec<[f32; 8]> = rays.iter().map(|ray| ray.words).collect();
    let mut recording = Recording::new();
    let input = recording.upload("rays", &words);
    let count = rays.len() as u32;
    let hits = record_closest(&mut recording, mesh, input, count).expect("few");
    let hits = recording.download(hits, 4 * u64::from(count));
    DeviceHit::from_words(&executor.run(&recording).expect("runs").words(hits))
}

/// Rays from all over, into all directions, and some along axes through lattice points.
fn rays(count: usize) -> Vec<(Vec3, Vec3)> {
    let ray = |i: usize| match i % 8 {
        0 => (Vec3::new(point(i, 3).x, 3.0, point(i, 3).z), -Vec3::Y),
        1 => (Vec3::new((i % 64) as f32 / 32.0 - 1.0, 2.0, (i % 61) as f32 / 32.0 - 1.0), -Vec3::Y),
        2 => (point(i, 5) * 50.0, -point(i, 5)),
        _ => (point(i, 7) * 2.0, point(i, 9)),
    };
    (0..count).map(ray).collect()
}

/// Rays whose answers differ, of those traced.
fn differences(executor: &mut Executor, mesh: &Mesh, page_bytes: usize, seen: &Mesh) -> (usize, usize) {
    let (device, compact) = mesh.pack(executor, page_bytes);
    let rays = rays(3000);
    let on_device: Vec<DeviceRay> = rays.iter().map(|&(o, d)| device.ray(o, d, f32::INFINITY)).collect();
    let hits = trace(executor, &device, &on_device);
    let (mut differ, mut met) = (0, 0);
    for (&(origin, direction), hit) in rays.iter().zip(&hits) {
        let expected = seen.closest(&compact, origin, direction);
        met += usize::from(expected.is_some());
        let same_prim = expected.map(|e| e.1) == hit.map(|hit| hit.prim);
        let same_t = expected.zip(*hit).is_none_or(|(e, hit)| (e.0 - hit.t).abs() <= 1e-5 * e.0.max(1e-2));
        differ += usize::from(!same_prim || !same_t);
    }
    device.release(executor);
    (differ, met)
}

#[test]
fn closest_hits_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (mesh, least) in [
        (Mesh::soup(1, 1.0), 20),
        (Mesh::soup(9, 1.0), 100),
        (Mesh::soup(3000, 0.0625), 500),
        (Mesh::sheet(65), 500),
    ] {
        for page_bytes in [1 << 10, CompactMesh::SLOT] {
            let (differ, met) = differences(&mut executor, &mesh, page_bytes, &mesh);
            assert!(met >= least, "{met} hits of {} triangles", mesh.triangles.len());
            assert_eq!(differ, 0, "{} triangles in pages of {page_bytes}", mesh.triangles.len());
        }
    }
}

#[test]
fn a_mesh_that_differs_is_found() {
    let Some(mut executor) = software() else { return };
    let mut other = Mesh::sheet(65);
    other.positions[1000].y += 1.0 / 256.0;
    let (differ, _) = differences(&mut executor, &Mesh::sheet(65), CompactMesh::SLOT, &other);
    assert!(differ > 0);
}

#[test]
fn rays_that_cannot_hit_and_meshes_of_nothing_are_misses() {
    let Some(mut executor) = software() else { return };
    let (nothing, _) = Mesh { positions: vec![], triangles: vec![] }.pack(&mut executor, 1 << 12);
    let down = nothing.ray(Vec3::Y, -Vec3::Y, 1e9);
    assert_eq!(trace(&mut executor, &nothing, &[down]), [None]);
    let (sheet, _) = Mesh::sheet(65).pack(&mut executor, 1 << 12);
    let odd = [Vec3::NAN, Vec3::INFINITY, Vec3::ZERO, Vec3::splat(f32::NEG_INFINITY)];
    let odd: Vec<DeviceRay> = odd.iter().map(|d| sheet.ray(Vec3::Y * 2.0, *d, f32::INFINITY)).collect();
    assert_eq!(trace(&mut executor, &sheet, &odd), [None; 4]);
    // The sheet is nearer than 2 and further away than 1.
    let near = [1.0, 2.5].map(|t_max| sheet.ray(Vec3::new(0.1, 2.0, 0.1), -Vec3::Y, t_max));
    let hits = trace(&mut executor, &sheet, &near);
    assert!(hits[0].is_none() && hits[1].is_some());
    assert_eq!(trace(&mut executor, &sheet, &[]), []);
}

#[test]
fn directions_of_any_length_hit_at_the_same_place() {
    let Some(mut executor) = software() else { return };
    let (sheet, _) = Mesh::sheet(65).pack(&mut executor, 1 << 14);
    let t = [1e-30_f32, 1e-8, 1.0, 1e8, 1e30].map(|length| {
        let ray = sheet.ray(Vec3::new(0.1, 2.0, 0.1), -Vec3::Y * length, f32::INFINITY);
        let hit = trace(&mut executor, &sheet, &[ray])[0].expect("a hit");
        hit.t * ray.t_scale * length
    });
    assert!(t.iter().all(|other| (other - t[2]).abs() < 1e-5), "{t:?}");
}

#[test]
fn pages_that_are_missing_or_do_not_fit_are_errors_and_leave_nothing() {
    let Some(mut shared) = software() else { return };
    let (wide, _) =
        MeshBvh::build("", &Mesh::sheet(65).view(), &BuildConfig::default(), &mut Scratch::default())
            .expect("built");
    let (compact, mut pages) = CompactMesh::pack(&wide, 1 << 12).expect("on a lattice");
    let missing = DeviceMesh::new(&mut shared, &compact, &pages[1..]).expect_err("one too few");
    assert!(matches!(missing, GpuError::Rejected { .. }), "{missing}");
    drop(shared);

    let device = Drivers::load().open(DeviceChoice::Software).expect("as before");
    let binding = device.adapter().limits.binding_bytes;
    let config = ExecutorConfig { budget_bytes: 40_960, ..ExecutorConfig::default() };
    let mut small = Executor::new(device, config);
    let full = DeviceMesh::new(&mut small, &compact, &pages).expect_err("more than the budget");
    assert!(matches!(full, GpuError::OutOfMemory { .. }), "{full}");
    let all_of_it = small.allocate("all of the budget", 40_960).expect("nothing else stays");
    small.release(all_of_it);

    pages[0].bytes.resize(binding as usize, 0);
    let wide = DeviceMesh::new(&mut small, &compact, &pages).expect_err("more than a binding");
    assert!(matches!(wide, GpuError::Limit { limit, .. } if limit == binding), "{wide}");
}

#[test]
fn batches_beyond_one_dispatch_are_refused() {
    let Some(mut executor) = software() else { return };
    let (mesh, _) = Mesh::soup(1, 1.0).pack(&mut executor, 1 << 12);
    let mut recording = Recording::new();
    let rays = recording.buffer("rays", 8);
    let error = record_closest(&mut recording, &mesh, rays, MAX_RAYS + 1).expect_err("too many");
    assert!(matches!(error, GpuError::Limit { .. }), "{error}");
}
