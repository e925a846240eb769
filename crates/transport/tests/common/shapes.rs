//! Meshes.

use vastlight_math::{Vec2, Vec3};
use vastlight_scene::Mesh;

/// The square [-1, 1]^2 in z = 0, facing +z, with texture coordinates whose v grows downwards.
pub(crate) fn quad() -> Mesh {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0_f32]];
    Mesh {
        positions: corners.iter().map(|c| Vec3::new(c[0], c[1], 0.0)).collect(),
        uvs: vec![corners.iter().map(|c| Vec2::new(0.5 + 0.5 * c[0], 0.5 - 0.5 * c[1])).collect()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// The cube [-1, 1]^3, outside out.
pub(crate) fn cube() -> Mesh {
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect(),
        ..Mesh::default()
    }
}

/// A unit sphere of `20 * 4^level` triangles, outside out, with smooth normals if asked for.
pub(crate) fn sphere(level: u32, smooth: bool) -> Mesh {
    let (mut positions, mut triangles) = icosahedron();
    for _ in 0..level {
        let mut next = Vec::with_capacity(triangles.len() * 4);
        let mut middles = std::collections::BTreeMap::new();
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j): (u32, u32)| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    positions.len() as u32 - 1
                })
            });
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = next;
    }
    let normals = if smooth { positions.clone() } else { Vec::new() };
    Mesh { positions, triangles, normals, ..Mesh::default() }
}

fn icosahedron() -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let g = (1.0 + 5.0_f32.sqrt()) / 2.0;
    let mut positions = Vec::new();
    for (a, b) in [(-1.0, -g), (1.0, -g), (-1.0, g), (1.0, g)] {
        positions.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    // Every three corners at the edge's distance form a face.
    let near = |a: Vec3, b: Vec3| (a.distance(b) - 2.0).abs() < 0.1;
    let mut triangles = Vec::new();
    for i in 0..12_usize {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [i, j, k].map(|x| positions[x]);
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    let (j, k) = if outward { (j, k) } else { (k, j) };
                    triangles.push([i as u32, j as u32, k as u32]);
                }
            }
        }
    }
    (positions.iter().map(|p| p.normalize()).collect(), triangles)
}
