//! Normals of OBJ vertices: given ones, or smoothed over smoothing groups with the angle as weight (Thürmer and
//! Wüthrich, "Computing vertex normals from polygonal facets", 1998).

use super::builder::{Builder, Corner, NONE, NormalSource};
use vastlight_math::{Vec3, real};

/// One unit normal a vertex, or nothing if the whole file is flat. Vertices of flat faces are no longer shared where
/// other vertices have normals.
pub(super) fn vertex_normals(builder: &mut Builder) -> Vec<Vec3> {
    if builder.corners.iter().all(|c| c.normal == NormalSource::Flat) {
        return Vec::new();
    }
    let flat = unshare_flat(builder);
    let groups = smooth(builder);
    let normal = |(i, corner): (usize, &Corner)| match corner.normal {
        NormalSource::Flat => flat[i],
        NormalSource::Given(n) => builder.normals[n as usize].normalize_or_zero(),
        NormalSource::Group(_) => groups[i].normalize_or_zero(),
    };
    let mut normals: Vec<Vec3> = builder.corners.iter().enumerate().map(normal).collect();
    mend(builder, &mut normals);
    normals
}

fn face_normal(builder: &Builder, triangle: [u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|v| position(builder, v));
    (b - a).cross(c - a).normalize_or_zero()
}

fn position(builder: &Builder, vertex: u32) -> Vec3 {
    builder.positions[builder.corners[vertex as usize].position as usize]
}

/// Gives every flat face vertices of its own; returns the normals of flat vertices (others are zero). Faces in one plane share some,
/// but not where vertices of other files must be the same.
fn unshare_flat(builder: &mut Builder) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; builder.corners.len()];
    let mut taken = if builder.triangulator.is_of_many() { vec![false; normals.len()] } else { Vec::new() };
    for t in 0..builder.triangles.len() {
        let normal = face_normal(builder, builder.triangles[t]);
        for k in 0..3 {
            let vertex = builder.triangles[t][k] as usize;
            if builder.corners[vertex].normal != NormalSource::Flat {
                continue;
            }
            let is_free = match taken.get_mut(vertex) {
                Some(taken) => !std::mem::replace(taken, true),
                None => normals[vertex] == Vec3::ZERO || normals[vertex] == normal,
            };
            if is_free {
                normals[vertex] = normal;
                continue;
            }
            builder.triangles[t][k] = builder.corners.len() as u32;
            builder.corners.push(builder.corners[vertex]);
            builder.next.push(NONE);
            normals.push(normal);
            taken.extend((!taken.is_empty()).then_some(true));
        }
    }
    normals
}

/// Sums of face normals for vertices with a smoothing group; vertices at one position in one group get the same.
fn smooth(builder: &Builder) -> Vec<Vec3> {
    let in_group = |v: u32| matches!(builder.corners[v as usize].normal, NormalSource::Group(_));
    let mut sums = vec![Vec3::ZERO; builder.corners.len()];
    for &triangle in builder.triangles.iter().filter(|t| t.iter().any(|&v| in_group(v))) {
        let normal = face_normal(builder, triangle);
        for k in 0..3 {
            let [at, left, right] = [0, 1, 2].map(|i| position(builder, triangle[(k + i) % 3]));
            let to_left = (left - at).normalize_or_zero();
            let to_right = (right - at).normalize_or_zero();
            let angle = real::acos(to_left.dot(to_right).clamp(-1.0, 1.0));
            sums[triangle[k] as usize] += normal * angle;
        }
    }
    let mut chain = Vec::new();
    for &first in &builder.first {
        chain.clear();
        let mut at = first;
        while at != NONE {
            chain.push(at as usize);
            at = builder.next[at as usize];
        }
        if chain.len() > 1 {
            share_sums(builder, &chain, &mut sums);
        }
    }
    sums
}

/// Adds up the sums of vertices at one position that are in the same group (they differ in texture coordinates).
fn share_sums(builder: &Builder, chain: &[usize], sums: &mut [Vec3]) {
    let group = |v: usize| builder.corners[v].normal;
    let total = |v: usize| chain.iter().filter(|&&w| group(w) == group(v)).map(|&w| sums[w]).sum();
    let shared: Vec<Vec3> = chain.iter().map(|&v| total(v)).collect();
    for (&v, sum) in chain.iter().zip(shared) {
        sums[v] = sum;
    }
}

/// Vertices whose normal is still zero or not finite (a zero `vn`, opposite faces) take that of one of their triangles.
fn mend(builder: &Builder, normals: &mut [Vec3]) {
    let broken = |n: Vec3| !(n.is_finite() && n != Vec3::ZERO);
    for &triangle in &builder.triangles {
        for vertex in triangle {
            if broken(normals[vertex as usize]) {
                normals[vertex as usize] = face_normal(builder, triangle);
            }
        }
    }
    for normal in normals.iter_mut().filter(|n| broken(**n)) {
        *normal = Vec3::Z;
    }
}
