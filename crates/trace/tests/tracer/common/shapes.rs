//! Geometry for the tests, easy and nasty.

use super::Random;
use vastlight_math::Vec3;
use vastlight_scene::Mesh;

/// A mesh of separate triangles.
pub(crate) fn soup(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Mesh {
    let positions: Vec<Vec3> = triangles.into_iter().flatten().collect();
    let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { name: "soup".into(), positions, triangles, ..Mesh::default() }
}

/// Triangles of about `size` in the cube from -1 to 1, times `scale`, moved by `offset`.
pub(crate) fn random_soup(random: &mut Random, count: usize, size: f32, scale: f32, offset: Vec3) -> Mesh {
    soup((0..count).map(|_| {
        let center = random.point();
        [(); 3].map(|()| offset + (center + random.point() * size) * scale)
    }))
}

/// Long triangles, much thinner than long, in all directions.
pub(crate) fn thin_soup(random: &mut Random, count: usize, width: f32) -> Mesh {
    soup((0..count).map(|_| {
        let (a, along) = (random.point(), random.point());
        [a, a + along, a + along + random.point() * width]
    }))
}

/// A closed surface: a sphere of `rings` by `segments`, its radius changed by `radius`.
pub(crate) fn closed_surface(rings: u32, segments: u32, radius: impl Fn(Vec3) -> f32) -> Mesh {
    let mut positions = vec![Vec3::Y, Vec3::NEG_Y];
    for ring in 1..rings {
        let (sin, cos) = (std::f32::consts::PI * ring as f32 / rings as f32).sin_cos();
        for segment in 0..segments {
            let (s, c) = (std::f32::consts::TAU * segment as f32 / segments as f32).sin_cos();
            positions.push(Vec3::new(sin * c, cos, sin * s));
        }
    }
    positions.iter_mut().for_each(|p| *p *= radius(*p));
    let at = |ring: u32, segment: u32| 2 + (ring - 1) * segments + segment % segments;
    let mut triangles = Vec::new();
    for s in 0..segments {
        triangles.push([0, at(1, s + 1), at(1, s)]);
        triangles.push([1, at(rings - 1, s), at(rings - 1, s + 1)]);
        for r in 1..rings - 1 {
            triangles.push([at(r, s), at(r, s + 1), at(r + 1, s)]);
            triangles.push([at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)]);
        }
    }
    Mesh { name: "closed".into(), positions, triangles, ..Mesh::default() }
}
