//! The figure's skin at rest: the level set of a smooth union of sticks and ellipsoids, found as a dual net (Gibson,
//! "Constrained elastic surface nets", 1998) whose vertices are then moved onto the surface.

use super::skeleton::{Bone, CHEST, HEAD, NECK, PELVIS, SPINE, bones, side_of, stick};
use rayon::prelude::*;
use vastlight_math::Vec3;

/// Metres from sample to sample, the first sample, and samples along each axis.
const CELL: f32 = 0.0078;
const LOW: Vec3 = Vec3::new(-0.64, -0.025, -0.2);
const SAMPLES: [usize; 3] = [165, 242, 60];
/// The trunk is flatter than it is wide.
const FLAT: f32 = 1.22;

/// Positions, normals and triangles.
#[derive(Debug, Default)]
pub(super) struct Skin {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// The form as a distance, nearly.
pub(super) struct Form {
    bones: Vec<(usize, Bone)>,
    /// Metres more of flesh everywhere.
    girth: f32,
}

impl Form {
    pub(super) fn new(girth: f32) -> Self {
        // The right side is the left one in a mirror.
        let left = bones().into_iter().enumerate().filter(|(i, _)| side_of(*i) != Some(1));
        Self { bones: left.collect(), girth }
    }

    pub(super) fn distance(&self, p: Vec3) -> f32 {
        let q = Vec3::new(p.x.abs(), p.y, p.z);
        let flat = q * Vec3::new(1.0, 1.0, FLAT);
        let mut d = f32::MAX;
        for (i, bone) in &self.bones {
            let trunk = [PELVIS, SPINE, CHEST].contains(i);
            let at = if trunk { flat } else { q };
            let soft = if *i == HEAD || *i == NECK { 0.03 } else { 0.045 };
            d = join(d, stick(at, bone.joint, bone.end, bone.radii), soft);
        }
        for (at, a, b, radii) in [
            // Ribs, hips, seat, calf, heel, crown of the head, chin, thumb.
            (flat, [0.0, 1.33, 0.0], [0.085, 1.35, 0.0], [0.12, 0.105]),
            (flat, [0.0, 0.95, 0.0], [0.07, 0.94, 0.0], [0.12, 0.105]),
            (q, [0.07, 0.91, -0.05], [0.08, 0.86, -0.045], [0.075, 0.06]),
            (q, [0.105, 0.41, -0.012], [0.105, 0.3, -0.018], [0.05, 0.044]),
            (q, [0.105, 0.04, -0.05], [0.106, 0.035, 0.0], [0.042, 0.036]),
            (q, [0.0, 1.715, -0.025], [0.0, 1.72, 0.03], [0.088, 0.08]),
            (q, [0.0, 1.625, 0.055], [0.0, 1.66, 0.06], [0.033, 0.045]),
            (q, [0.507, 0.972, 0.025], [0.538, 0.912, 0.055], [0.014, 0.011]),
        ] {
            d = join(d, stick(at, Vec3::from_array(a), Vec3::from_array(b), radii), 0.035);
        }
        // Soles are flat.
        let sole = -q.y;
        -join(-(d - self.girth), -sole, 0.012)
    }

    fn gradient(&self, p: Vec3) -> Vec3 {
        const E: f32 = 1e-3;
        let slope = |e: Vec3| self.distance(p + e) - self.distance(p - e);
        Vec3::new(slope(Vec3::X * E), slope(Vec3::Y * E), slope(Vec3::Z * E)) / (2.0 * E)
    }

    /// The skin as a net.
    pub(super) fn skin(&self) -> Skin {
        let [nx, ny, nz] = SAMPLES;
        let mut samples = vec![0.0; nx * ny * nz];
        samples.par_chunks_mut(nx * ny).enumerate().for_each(|(z, slice)| {
            for (i, sample) in slice.iter_mut().enumerate() {
                *sample = self.distance(at([i % nx, i / nx, z]));
            }
        });
        let net = Net::new(&samples);
        let settled: Vec<(Vec3, Vec3)> = net.points.par_iter().map(|&p| self.settle(p)).collect();
        let (positions, normals) = settled.into_iter().unzip();
        Skin { positions, normals, triangles: net.triangles }
    }

    /// The surface's point near `p`, and its normal.
    fn settle(&self, mut p: Vec3) -> (Vec3, Vec3) {
        for _ in 0..3 {
            let gradient = self.gradient(p);
            p -= gradient * (self.distance(p) / gradient.length_squared().max(0.1)).clamp(-CELL, CELL);
        }
        (p, self.gradient(p).normalize_or(Vec3::Y))
    }
}

/// Smooth union: the minimum, rounded over a distance of `k`.
pub(super) fn join(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// The place of a sample.
fn at(sample: [usize; 3]) -> Vec3 {
    LOW + Vec3::from_array(sample.map(|i| i as f32)) * CELL
}

/// A vertex in each cell that the surface passes, and a quadrilateral around each edge that it cuts.
struct Net {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// Steps in the table of samples along each axis.
const STRIDES: [usize; 3] = [1, SAMPLES[0], SAMPLES[0] * SAMPLES[1]];

impl Net {
    fn new(samples: &[f32]) -> Self {
        let mut net = Self { points: Vec::new(), triangles: Vec::new() };
        let mut numbers = vec![0_u32; samples.len()];
        for_all(|cell, index| {
            if let Some(point) = middle(samples, index) {
                numbers[index] = net.points.len() as u32;
                net.points.push(at(cell) + point * CELL);
            }
        });
        for_all(|cell, index| {
            for axis in 0..3 {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let (inside, beyond) = (samples[index] < 0.0, samples[index + STRIDES[axis]] < 0.0);
                if inside == beyond || cell[u] == 0 || cell[v] == 0 {
                    continue;
                }
                let [a, b, c, d] =
                    [STRIDES[u] + STRIDES[v], STRIDES[v], 0, STRIDES[u]].map(|s| numbers[index - s]);
                let quad = if inside { [a, b, c, d] } else { [d, c, b, a] };
                net.triangles.push([quad[0], quad[1], quad[2]]);
                net.triangles.push([quad[0], quad[2], quad[3]]);
            }
        });
        net
    }
}

/// Calls for every cell, in order.
fn for_all(mut visit: impl FnMut([usize; 3], usize)) {
    let [nx, ny, nz] = SAMPLES;
    for z in 0..nz - 1 {
        for y in 0..ny - 1 {
            for x in 0..nx - 1 {
                visit([x, y, z], x + STRIDES[1] * y + STRIDES[2] * z);
            }
        }
    }
}

/// The mean of where a cell's edges are cut, in cells; nothing where none is.
fn middle(samples: &[f32], index: usize) -> Option<Vec3> {
    let offset = |corner: usize| (0..3).map(|i| (corner >> i & 1) * STRIDES[i]).sum::<usize>();
    let corners: [f32; 8] = std::array::from_fn(|corner| samples[index + offset(corner)]);
    let (mut sum, mut cuts) = (Vec3::ZERO, 0);
    for axis in 0..3 {
        for corner in (0..8).filter(|corner| corner >> axis & 1 == 0) {
            let (a, b) = (corners[corner], corners[corner | 1 << axis]);
            if (a < 0.0) != (b < 0.0) {
                let mut cut = Vec3::from_array([0, 1, 2].map(|i| (corner >> i & 1) as f32));
                cut[axis] = a / (a - b);
                sum += cut;
                cuts += 1;
            }
        }
    }
    (cuts > 0).then(|| sum / cuts as f32)
}

/// At most this many bones move a vertex.
pub(super) const INFLUENCES: usize = 4;

/// Bones of a vertex with their weights, which sum to one.
pub(super) type Weights = [(u8, f32); INFLUENCES];

/// Weights fall with the distance from the nearest bone's flesh; only bones near it in the skeleton count.
pub(super) fn weights(bones: &[Bone], p: Vec3) -> Weights {
    const SOFT: f32 = 0.05;
    let distance = |bone: &Bone| stick(p, bone.joint, bone.end, bone.radii);
    let distances: Vec<f32> = bones.iter().map(distance).collect();
    let nearest = (0..bones.len()).fold(0, |best, i| if distances[i] < distances[best] { i } else { best });
    let mut found: Vec<(u8, f32)> = (0..bones.len())
        .filter(|&i| are_near(bones, nearest, i))
        .map(|i| {
            let share = (1.0 - (distances[i] - distances[nearest]) / SOFT).max(0.0);
            (i as u8, share * share)
        })
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found.resize(INFLUENCES, (nearest as u8, 0.0));
    let sum: f32 = found.iter().map(|f| f.1).sum();
    std::array::from_fn(|i| (found[i].0, found[i].1 / sum))
}

/// Whether two bones are at most two joints apart and not on different sides.
fn are_near(bones: &[Bone], a: usize, b: usize) -> bool {
    let (pa, pb) = (bones[a].parent, bones[b].parent);
    let related = a == b || pa == b || pb == a || pa == pb || bones[pa].parent == b || bones[pb].parent == a;
    let across = matches!((side_of(a), side_of(b)), (Some(a), Some(b)) if a != b);
    related && !across
}

/// Where soles touch the ground at rest: heel and ball of the left foot, from above.
pub(super) const HEEL: Vec3 = Vec3::new(0.105, 0.0, -0.07);
pub(super) const BALL: Vec3 = Vec3::new(0.11, 0.0, 0.115);

#[cfg(test)]
mod tests {
    use super::super::skeleton::{THIGH, on};
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn the_skin_is_closed_and_on_the_surface() {
        let form = Form::new(0.0);
        let skin = form.skin();
        assert!((50_000..100_000).contains(&skin.triangles.len()), "{}", skin.triangles.len());
        let mut edges = BTreeMap::new();
        for t in &skin.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&balance| balance == 0), "open");
        let off = skin.positions.iter().filter(|&&p| form.distance(p).abs() > 5e-4).count();
        assert!(off * 200 < skin.positions.len(), "{off} off the surface");
        assert!(skin.positions.iter().all(|p| p.y > -0.01 && p.y < 1.85));
    }

    #[test]
    fn weights_sum_to_one_and_know_their_limb() {
        let all = bones();
        for (i, bone) in all.iter().enumerate() {
            let weights = weights(&all, bone.joint.lerp(bone.end, 0.5) + Vec3::Z * 0.02);
            assert!((weights.iter().map(|w| w.1).sum::<f32>() - 1.0).abs() < 1e-5);
            let own = weights.iter().filter(|w| w.0 as usize == i).map(|w| w.1).sum::<f32>();
            assert!(own > 0.25, "{i}: {weights:?}");
        }
        let thigh = all[on(0, THIGH)];
        let inner = weights(&all, thigh.joint.lerp(thigh.end, 0.4) - Vec3::X * 0.08);
        assert!(inner.iter().all(|w| w.1 == 0.0 || side_of(w.0 as usize) != Some(1)), "{inner:?}");
    }
}
