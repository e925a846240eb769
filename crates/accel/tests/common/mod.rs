//! Triangles for the tests, easy and nasty.
#![allow(dead_code, reason = "each test file uses a part")]

use vastlight_accel::wide::{MeshBvh, MeshView};
use vastlight_accel::{BuildConfig, Scratch};
use vastlight_math::{Aabb, Vec3};

/// Numbers in [0, 1), the same in every run.
pub(crate) fn noise(i: usize, salt: u64) -> f32 {
    let mut x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ salt.wrapping_mul(0xd134_2543_de82_ef95);
    x = (x ^ x >> 31).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (x >> 40) as f32 / 16_777_216.0
}

/// A point in the cube from -1 to 1.
pub(crate) fn point(i: usize, salt: u64) -> Vec3 {
    Vec3::new(noise(i, salt), noise(i, salt + 1), noise(i, salt + 2)) * 2.0 - 1.0
}

/// Named triangle lists, from none to nasty.
pub(crate) fn inputs() -> Vec<(&'static str, Vec<[Vec3; 3]>)> {
    let soup = |n: usize, size: f32| -> Vec<[Vec3; 3]> {
        (0..n).map(|i| [10, 20, 30].map(|salt| point(i, 1) + point(i, salt) * size)).collect()
    };
    let flat = |t: [Vec3; 3]| t.map(|p| Vec3::new(p.x, 0.0, p.z));
    // Distances that double: the heuristic peels one triangle at a time.
    let doubling = (0..120).map(|i| soup(1, 0.1)[0].map(|p| p + Vec3::X * 2.0_f32.powi(i / 2))).collect();
    let mut one_huge = soup(2000, 1e-3);
    one_huge.push([Vec3::splat(-1e6), Vec3::new(1e6, 0.0, 0.0), Vec3::splat(1e6)]);
    vec![
        ("none", vec![]),
        ("one", soup(1, 1.0)),
        ("two", soup(2, 1.0)),
        ("eight", soup(8, 1.0)),
        ("nine", soup(9, 1.0)),
        ("many", soup(30_000, 0.02)),
        ("overlapping", soup(1000, 1.0)),
        ("all equal", vec![soup(1, 1.0)[0]; 20_000]),
        (
            "equal centres",
            (0..500).map(|i| [-1.0, 0.0, 1.0].map(|k| Vec3::new(k, k, -k) * (i + 1) as f32)).collect(),
        ),
        ("points", (0..300).map(|i| [point(i, 5); 3]).collect()),
        ("one point", vec![[Vec3::ONE; 3]; 300]),
        ("flat", soup(1000, 0.1).into_iter().map(flat).collect()),
        ("line", (0..1000).map(|i| [0.0, 0.2, 0.4].map(|k| Vec3::X * (i as f32 + k))).collect()),
        ("tiny", soup(1000, 0.1).into_iter().map(|t| t.map(|p| p * 1e-25)).collect()),
        ("huge", soup(1000, 0.1).into_iter().map(|t| t.map(|p| p * 1e14)).collect()),
        ("doubling", doubling),
        ("one huge", one_huge),
    ]
}

/// The triangles' boxes.
pub(crate) fn boxes(triangles: &[[Vec3; 3]]) -> Vec<Aabb> {
    triangles.iter().map(|t| Aabb::from_points(*t)).collect()
}

/// A mesh of separate triangles.
pub(crate) struct Soup {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Soup {
    pub(crate) fn new(triangles: &[[Vec3; 3]]) -> Self {
        let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        Self { positions: triangles.iter().flatten().copied().collect(), triangles: indices.collect() }
    }

    pub(crate) fn view(&self) -> MeshView<'_> {
        MeshView { positions: &self.positions, triangles: &self.triangles }
    }

    pub(crate) fn build(&self, name: &str) -> MeshBvh {
        MeshBvh::build(name, &self.view(), &BuildConfig::default(), &mut Scratch::default()).expect("built").0
    }
}
