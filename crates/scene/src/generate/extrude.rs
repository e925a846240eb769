//! Prisms over simple polygons: walls with arches, stair flights, boards.

use super::shape::Shape;
use vastlight_math::{Vec2, Vec3};

/// Side faces that meet at an angle whose cosine is above this share a smooth normal.
const CREASE: f32 = 0.8;

/// Pushes a simple polygon (counter-clockwise in x, y; no repeated point) from z = -depth/2 to z = +depth/2. Closed.
pub(super) fn extrude(polygon: &[Vec2], depth: f32) -> Shape {
    let mut shape = Shape::default();
    let half = depth * 0.5;
    let faces = ear_clip(polygon);
    for (z, normal, uv_sign) in [(half, Vec3::Z, 1.0), (-half, Vec3::NEG_Z, -1.0)] {
        let first = shape.positions.len() as u32;
        for p in polygon {
            shape.vertex(p.extend(z), normal, Vec2::new(p.x * uv_sign, -p.y));
        }
        for &[a, b, c] in &faces {
            let [a, b, c] = [a, b, c].map(|i| first + i);
            if z > 0.0 { shape.triangle(a, b, c) } else { shape.triangle(a, c, b) }
        }
    }
    sides(&mut shape, polygon, half);
    shape
}

fn sides(shape: &mut Shape, polygon: &[Vec2], half: f32) {
    let n = polygon.len();
    let normal = |i: usize| {
        let d = (polygon[(i + 1) % n] - polygon[i % n]).normalize_or_zero();
        Vec2::new(d.y, -d.x)
    };
    let smooth = |a: Vec2, b: Vec2| if a.dot(b) > CREASE { (a + b).normalize() } else { a };
    let mut along = 0.0;
    for i in 0..n {
        let (p, q) = (polygon[i], polygon[(i + 1) % n]);
        let own = normal(i);
        let (np, nq) = (smooth(own, normal(i + n - 1)), smooth(own, normal(i + 1)));
        let length = (q - p).length();
        let mut corner =
            |p: Vec2, z: f32, n: Vec2, u: f32| shape.vertex(p.extend(z), n.extend(0.0), Vec2::new(u, -z));
        let a = corner(p, half, np, along);
        let b = corner(p, -half, np, along);
        let c = corner(q, -half, nq, along + length);
        let d = corner(q, half, nq, along + length);
        shape.quad(a, b, c, d);
        along += length;
    }
}

/// Triangles of a simple counter-clockwise polygon, by cutting off ears.
pub(super) fn ear_clip(polygon: &[Vec2]) -> Vec<[u32; 3]> {
    let mut rest: Vec<u32> = (0..polygon.len() as u32).collect();
    let mut triangles = Vec::new();
    while rest.len() > 3 {
        let n = rest.len();
        let corner = |i: usize| [rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]];
        let ear = (0..n).find(|&i| is_ear(polygon, &rest, corner(i))).unwrap_or(0);
        triangles.push(corner(ear));
        rest.remove(ear);
    }
    triangles.extend(<[u32; 3]>::try_from(rest.as_slice()));
    triangles
}

fn is_ear(polygon: &[Vec2], rest: &[u32], corner: [u32; 3]) -> bool {
    let [a, b, c] = corner.map(|i| polygon[i as usize]);
    let turn = |p: Vec2, q: Vec2, r: Vec2| (q - p).perp_dot(r - p);
    if turn(a, b, c) <= 0.0 {
        return false;
    }
    rest.iter().filter(|i| !corner.contains(i)).all(|&i| {
        let p = polygon[i as usize];
        turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concave_polygon_is_covered_once() {
        let polygon =
            [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [3.0, 3.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]]
                .map(Vec2::from_array);
        let triangles = ear_clip(&polygon);
        assert_eq!(triangles.len(), 6);
        let area: f32 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| polygon[i as usize]);
                (b - a).perp_dot(c - a) * 0.5
            })
            .inspect(|&a| assert!(a > 0.0))
            .sum();
        assert!((area - 8.0).abs() < 1e-5);
    }
}
