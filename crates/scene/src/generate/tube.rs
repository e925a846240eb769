//! Tubes along paths: pipes, cables, handrails, branches.

use super::shape::Shape;
use std::f32::consts::TAU;
use vastlight_math::{Frame, Vec2, Vec3, real::sin_cos};

/// A closed tube along `path` with one radius for each point. Frames are carried along without twist.
pub(super) fn tube_with_radii(path: &[Vec3], radii: &[f32], sides: u32) -> Shape {
    let mut shape = Shape::default();
    let count = path.len().min(radii.len());
    if count < 2 {
        return shape;
    }
    let tangents: Vec<Vec3> = (0..count)
        .map(|i| (path[(i + 1).min(count - 1)] - path[i.saturating_sub(1)]).normalize_or(Vec3::Y))
        .collect();
    let mut frame = Frame::from_z(tangents[0]);
    let mut along = 0.0;
    for i in 0..count {
        frame = Frame::from_z_and_tangent(tangents[i], frame.x);
        if i > 0 {
            along += (path[i] - path[i - 1]).length();
        }
        ring(&mut shape, &frame, path[i], radii[i], along, sides);
    }
    for i in 0..count as u32 - 1 {
        for side in 0..sides {
            let a = i * (sides + 1) + side;
            shape.quad(a, a + 1, a + sides + 2, a + sides + 1);
        }
    }
    cap(&mut shape, 0, -tangents[0], sides);
    cap(&mut shape, (count as u32 - 1) * (sides + 1), tangents[count - 1], sides);
    shape
}

/// A closed tube of one radius.
pub(super) fn tube(path: &[Vec3], radius: f32, sides: u32) -> Shape {
    tube_with_radii(path, &vec![radius; path.len()], sides)
}

/// A closed straight tube.
pub(super) fn rod(from: Vec3, to: Vec3, radius: f32, sides: u32) -> Shape {
    tube(&[from, to], radius, sides)
}

fn ring(shape: &mut Shape, frame: &Frame, center: Vec3, radius: f32, along: f32, sides: u32) {
    for side in 0..=sides {
        let (s, c) = sin_cos(TAU * (side % sides) as f32 / sides as f32);
        let normal = frame.x * c + frame.y * s;
        let uv = Vec2::new(along, TAU * radius * side as f32 / sides as f32);
        shape.vertex(center + normal * radius, normal, uv);
    }
}

/// Closes the ring that starts at vertex `first` with a fan that faces `normal`.
fn cap(shape: &mut Shape, first: u32, normal: Vec3, sides: u32) {
    let rim: Vec<Vec3> = (first..first + sides).map(|i| shape.positions[i as usize]).collect();
    let start = shape.positions.len() as u32;
    let center = rim.iter().sum::<Vec3>() / sides as f32;
    let frame = Frame::from_z(normal);
    for &p in &rim {
        shape.vertex(p, normal, Vec2::new((p - center).dot(frame.x), (p - center).dot(frame.y)));
    }
    let outward = sides > 2 && (rim[1] - rim[0]).cross(rim[2] - rim[0]).dot(normal) > 0.0;
    for i in 1..sides - 1 {
        let (b, c) = (start + i, start + i + 1);
        if outward { shape.triangle(start, b, c) } else { shape.triangle(start, c, b) }
    }
}

/// A path whose corners are rounded by arcs of about `radius`, `steps` pieces a corner.
pub(super) fn rounded_path(corners: &[Vec3], radius: f32, steps: u32) -> Vec<Vec3> {
    let mut path = Vec::new();
    for (i, &corner) in corners.iter().enumerate() {
        if i == 0 || i + 1 == corners.len() {
            path.push(corner);
            continue;
        }
        let (before, after) = (corners[i - 1] - corner, corners[i + 1] - corner);
        let reach = radius.min(before.length() * 0.49).min(after.length() * 0.49);
        let (start, end) = (corner + before.normalize() * reach, corner + after.normalize() * reach);
        for step in 0..=steps {
            let t = step as f32 / steps as f32;
            let (a, b) = (start.lerp(corner, t), corner.lerp(end, t));
            path.push(a.lerp(b, t));
        }
    }
    path
}

/// A hanging cable between two points that sags by `sag` in the middle (a parabola, near enough to the catenary).
pub(super) fn hanging(from: Vec3, to: Vec3, sag: f32, pieces: u32) -> Vec<Vec3> {
    (0..=pieces)
        .map(|i| {
            let t = i as f32 / pieces as f32;
            from.lerp(to, t) - Vec3::Y * (4.0 * sag * t * (1.0 - t))
        })
        .collect()
}
