//! Which materials cover closed surfaces: glass refracts there, and is a thin wall elsewhere.

use super::parse::Parsed;
use vastlight_math::Vec3;

/// Share of edges without a partner that a closed surface may have: exporters drop a triangle here and there.
const TOLERANCE: f64 = 0.01;

/// For each material of the file that is `wanted`, whether its triangles close a volume: nearly every edge is used
/// equally often in both directions.
pub(super) fn closed_materials(parsed: &Parsed, wanted: &[bool]) -> Vec<bool> {
    if !wanted.contains(&true) {
        return vec![false; wanted.len()];
    }
    let welded = weld(&parsed.mesh.positions);
    let count = parsed.mesh.triangles.len() as u32;
    let is_closed = |material: usize| {
        let ends = parsed.runs.iter().skip(1).map(|r| r.first_triangle).chain([count]);
        let runs = parsed.runs.iter().zip(ends).filter(|(run, _)| run.material as usize == material);
        let triangles =
            runs.flat_map(|(run, end)| &parsed.mesh.triangles[run.first_triangle as usize..end as usize]);
        is_closed(triangles.map(|t| t.map(|v| welded[v as usize])))
    };
    wanted.iter().enumerate().map(|(material, &wanted)| wanted && is_closed(material)).collect()
}

/// For each vertex the first one at the same place.
fn weld(positions: &[Vec3]) -> Vec<u32> {
    let key = |v: u32| positions[v as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|&v| (key(v), v));
    let mut welded = vec![0; positions.len()];
    for same in order.chunk_by(|&a, &b| key(a) == key(b)) {
        same.iter().for_each(|&v| welded[v as usize] = same[0]);
    }
    welded
}

fn is_closed(triangles: impl Iterator<Item = [u32; 3]>) -> bool {
    let mut edges: Vec<(u32, u32, i32)> = Vec::new();
    for [a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if from != to {
                edges.push((from.min(to), from.max(to), if from < to { 1 } else { -1 }));
            }
        }
    }
    edges.sort_unstable();
    let unmatched: u64 = edges
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .map(|same| u64::from(same.iter().map(|e| e.2).sum::<i32>().unsigned_abs()))
        .sum();
    !edges.is_empty() && unmatched as f64 <= TOLERANCE * edges.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    #[test]
    fn tetrahedra_are_closed_and_open_ones_are_not() {
        assert!(is_closed(TETRAHEDRON.into_iter()));
        assert!(!is_closed(TETRAHEDRON.into_iter().skip(1)));
        assert!(!is_closed(std::iter::empty()));
    }

    #[test]
    fn vertices_at_one_place_are_one() {
        let positions = [Vec3::X, Vec3::Y, Vec3::X, Vec3::new(-0.0, 1.0, 0.0)];
        assert_eq!(weld(&positions), [0, 1, 0, 1]);
    }
}
