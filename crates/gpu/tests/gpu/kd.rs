//! Hits by threaded kd-trees on the software adapter against the CPU's.

use crate::common::{answers, probe};
use crate::trace::{alone, crowd, edge_on, rays, same, sheet, soup};
use vastlight_gpu::trace::{hits_of_words, ray_words};
use vastlight_math::{Ray, Vec3};
use vastlight_scene::{Mesh, Scene};
use vastlight_trace::words::{KD_BLOCK_WORDS, KD_NODE_WORDS, TracerWords, header};
use vastlight_trace::{AcceptAll, Hit, Tracer, TracerConfig};

probe!(KD = "kd_probe", 4);

fn tracer(scene: &Scene, accel: &str) -> Tracer {
    Tracer::new(scene, &TracerConfig { accel: accel.to_owned(), ..TracerConfig::default() }).expect("built")
}

fn words(scene: &Scene, accel: &str) -> TracerWords {
    tracer(scene, accel).threaded_words().expect("threaded")
}

/// The hits on the device; none without an adapter.
fn on_device(words: &TracerWords, rays: &[Ray]) -> Option<Vec<Hit>> {
    let input: Vec<u32> = rays.iter().flat_map(ray_words).map(f32::to_bits).collect();
    let found = answers(&KD, &[&input, &words.tree, &words.blocks], rays.len(), 5)?;
    Some(hits_of_words(&found))
}

/// The hits of the CPU's walk by threads.
fn on_cpu(scene: &Scene, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    tracer(scene, "kd-threaded").closest(rays, &AcceptAll, &mut hits);
    hits
}

fn differences(expected: &[Hit], found: &[Hit]) -> usize {
    expected.iter().zip(found).filter(|(expected, found)| !same(expected, found)).count()
}

/// Bit `k` is set where the direction is negative along axis `k`.
fn octant(ray: &Ray) -> usize {
    let [x, y, z] = ray.direction.to_array().map(|d| usize::from(d < 0.0));
    x | y << 1 | z << 2
}

#[test]
fn hits_are_those_of_the_cpu_in_all_directions() {
    let rays = rays(12_000);
    for way in 0..8 {
        assert!(rays.iter().filter(|ray| octant(ray) == way).count() > 500, "{way}");
    }
    for (scene, least) in [
        (alone(soup(1, Vec3::ONE)), 20),
        (alone(soup(9, Vec3::ONE)), 100),
        (alone(soup(3000, Vec3::splat(0.0625))), 500),
        (alone(sheet(65)), 1500),
        (crowd(), 4000),
    ] {
        let expected = on_cpu(&scene, &rays);
        let met = expected.iter().filter(|hit| hit.is_hit()).count();
        assert!(met >= least, "{met} hits");
        for accel in ["kd-threaded", "kd-threaded-sah"] {
            let Some(found) = on_device(&words(&scene, accel), &rays) else { return };
            assert_eq!(differences(&expected, &found), 0, "{accel}, {} instances", scene.instances().len());
        }
    }
}

#[test]
fn triangles_seen_edge_on_are_settled() {
    let scene = alone(soup(400, Vec3::ONE));
    let rays = edge_on(&scene);
    let Some(found) = on_device(&words(&scene, "kd-threaded"), &rays) else { return };
    assert_eq!(differences(&on_cpu(&scene, &rays), &found), 0);
}

/// Negative control: without the threads of one octant its rays, and no others, lose hits.
#[test]
fn each_octant_has_its_own_threads() {
    let (scene, rays) = (alone(soup(3000, Vec3::splat(0.0625))), rays(12_000));
    let expected = on_cpu(&scene, &rays);
    for way in 0..8 {
        let mut broken = words(&scene, "kd-threaded");
        let nodes = broken.tree[header::ITEMS] as usize;
        for node in broken.tree[..nodes].chunks_exact_mut(KD_NODE_WORDS).skip(1) {
            node[8 + way] = u32::MAX;
        }
        let Some(found) = on_device(&broken, &rays) else { return };
        let differs = |i: &usize| !same(&expected[*i], &found[*i]);
        let lost: Vec<usize> = (0..rays.len()).filter(differs).collect();
        assert!(!lost.is_empty() && lost.iter().all(|&i| octant(&rays[i]) == way), "{way}: {}", lost.len());
    }
}

#[test]
fn a_scene_that_differs_is_found_and_one_of_nothing_is_missed() {
    let (mut other, rays) = (sheet(65), rays(3000));
    other.positions[1000].y += 1.0 / 256.0;
    let Some(found) = on_device(&words(&alone(other), "kd-threaded"), &rays) else { return };
    assert!(differences(&on_cpu(&alone(sheet(65)), &rays), &found) > 0);
    let nothing = words(&alone(Mesh::default()), "kd-threaded");
    let found = on_device(&nothing, &rays).expect("as before");
    assert!(found.iter().all(|hit| !hit.is_hit()));
}

#[test]
fn words_are_read_where_they_are_written() {
    let text = KD.wgsl();
    for (name, value) in [
        ("KD_NODE_WORDS", KD_NODE_WORDS),
        ("KD_BLOCK_WORDS", KD_BLOCK_WORDS),
        ("TREE_ITEMS", header::ITEMS),
        ("TREE_BOXES", header::BOXES),
    ] {
        let line = format!("const {name}: u32 = {value}u;");
        assert!(text.contains(&line), "{line}");
    }
    for accel in ["", "kd-stack"] {
        assert!(tracer(&alone(soup(9, Vec3::ONE)), accel).threaded_words().is_err(), "{accel}");
    }
}
