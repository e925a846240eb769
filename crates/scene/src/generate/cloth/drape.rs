//! A cloth that falls on a ball and a floor: extended position-based dynamics with small steps (Macklin et al., "Small steps in
//! physics simulation", 2019) on a coarse grid of points.
//!
//! Points push each other apart where the cloth folds onto itself (Bridson's repulsions without his exact tests). One point after
//! the other in one order: the same bits for any number of threads.

use super::{BALL, DURATION};
use vastlight_math::Vec3;

/// Points along each edge, and metres between them.
pub(super) const POINTS: usize = 57;
pub(super) const SPACING: f32 = super::EDGE / (POINTS - 1) as f32;
/// Kept moments a second, and steps from one to the next.
pub(super) const KEYS_A_SECOND: u32 = 30;
const STEPS_A_KEY: u32 = 24;
const STEP: f32 = 1.0 / (KEYS_A_SECOND * STEPS_A_KEY) as f32;
/// Every so many steps the folds are looked for.
const STEPS_A_FOLD: u32 = 4;
/// Distance of points from ball and floor, and from each other.
pub(super) const THICKNESS: f32 = 0.012;
const APART: f32 = 0.8 * SPACING;
const GRAVITY: f32 = 9.81;
/// Part of the speed that the air takes in a second.
const AIR: f32 = 0.6;
const FRICTION: f32 = 0.35;
/// Inverse stiffness of threads, of the diagonals, and of bending: metres a newton for a point of one kilogram.
const THREAD: f32 = 0.0;
const DIAGONAL: f32 = 3e-6;
const BEND: f32 = 6e-5;

/// A moment: all points, row by row.
pub(super) type Key = Vec<Vec3>;

/// Moments from the first, [`KEYS_A_SECOND`], to the end.
pub(super) fn keys(start: Key) -> Vec<Key> {
    let mut cloth = Cloth::new(start);
    let mut keys = vec![cloth.points.clone()];
    for _ in 0..(DURATION * KEYS_A_SECOND as f32) as u32 {
        for step in 0..STEPS_A_KEY {
            cloth.step(step.is_multiple_of(STEPS_A_FOLD));
        }
        keys.push(cloth.points.clone());
    }
    keys
}

/// Two points that want to be so far from each other.
struct Link {
    a: u32,
    b: u32,
    length: f32,
    compliance: f32,
}

struct Cloth {
    points: Vec<Vec3>,
    before: Vec<Vec3>,
    velocities: Vec<Vec3>,
    links: Vec<Link>,
    folds: Folds,
}

impl Cloth {
    fn new(points: Vec<Vec3>) -> Self {
        let links = links();
        let velocities = vec![Vec3::ZERO; points.len()];
        Self { before: points.clone(), velocities, links, folds: Folds::default(), points }
    }

    fn step(&mut self, look_for_folds: bool) {
        self.before.clone_from(&self.points);
        for (p, v) in self.points.iter_mut().zip(&mut self.velocities) {
            v.y -= GRAVITY * STEP;
            *v *= 1.0 - AIR * STEP;
            *p += *v * STEP;
        }
        for link in &self.links {
            pull(&mut self.points, link);
        }
        if look_for_folds {
            self.folds.find(&self.points);
        }
        self.folds.push_apart(&mut self.points);
        for (p, before) in self.points.iter_mut().zip(&self.before) {
            *p = outside(*p, *before);
        }
        for ((v, p), before) in self.velocities.iter_mut().zip(&self.points).zip(&self.before) {
            *v = (*p - *before) / STEP;
        }
    }
}

/// Threads along both axes, diagonals, and every second point against bending.
fn links() -> Vec<Link> {
    let mut links = Vec::new();
    let diagonal = std::f32::consts::SQRT_2;
    let steps = [
        (1, 0, 1.0, THREAD),
        (0, 1, 1.0, THREAD),
        (1, 1, diagonal, DIAGONAL),
        (-1, 1, diagonal, DIAGONAL),
        (2, 0, 2.0, BEND),
        (0, 2, 2.0, BEND),
    ];
    for (dx, dy, length, compliance) in steps {
        for y in 0..POINTS as i32 - dy {
            for x in (-dx).max(0)..POINTS as i32 - dx.max(0) {
                let index = |x: i32, y: i32| y as u32 * POINTS as u32 + x as u32;
                let (a, b) = (index(x, y), index(x + dx, y + dy));
                links.push(Link { a, b, length: length * SPACING, compliance });
            }
        }
    }
    links
}

fn pull(points: &mut [Vec3], link: &Link) {
    let (a, b) = (link.a as usize, link.b as usize);
    let apart = points[b] - points[a];
    let length = apart.length();
    if length > 0.0 {
        let share = (length - link.length) / (2.0 + link.compliance / (STEP * STEP));
        let move_by = apart * (share / length);
        points[a] += move_by;
        points[b] -= move_by;
    }
}

/// A point put outside of ball and floor, slowed down where it slides.
fn outside(mut p: Vec3, before: Vec3) -> Vec3 {
    let rub = |p: Vec3, normal: Vec3, depth: f32| {
        let slid = p - before;
        let sliding = slid - normal * slid.dot(normal);
        let length = sliding.length();
        let hold = (FRICTION * depth).min(length);
        if length > 0.0 { p - sliding * (hold / length) } else { p }
    };
    let (center, radius) = BALL;
    let from_ball = p - center;
    let distance = from_ball.length();
    let depth = radius + THICKNESS - distance;
    if depth > 0.0 && distance > 0.0 {
        let normal = from_ball / distance;
        p = rub(p + normal * depth, normal, depth);
    }
    if p.y < THICKNESS {
        let depth = THICKNESS - p.y;
        p = rub(p.with_y(THICKNESS), Vec3::Y, depth);
    }
    p
}

/// The number of the cell at the origin along an axis. What a damaged record throws farther away is taken to be at the edge.
const MIDDLE: i32 = 1 << 18;

/// Pairs of points that are near each other but not along the cloth.
#[derive(Default)]
struct Folds {
    pairs: Vec<(u32, u32)>,
    /// Points by the cell that they are in.
    cells: Vec<(u64, u32)>,
}

impl Folds {
    /// Finds all pairs that may meet until the next time.
    fn find(&mut self, points: &[Vec3]) {
        let reach = APART * 1.3;
        let key = |cell: [i32; 3]| cell.iter().fold(0, |key, &c| key << 20 | u64::from((c + MIDDLE) as u32));
        let far = (MIDDLE - 1) as f32;
        let cell_of = |p: Vec3| (p / reach).to_array().map(|x| x.floor().clamp(-far, far) as i32);
        self.cells.clear();
        self.cells.extend((0..).zip(points).map(|(i, &p)| (key(cell_of(p)), i)));
        self.cells.sort_unstable();
        self.pairs.clear();
        for (i, &p) in (0_u32..).zip(points) {
            let [x, y, z] = cell_of(p);
            for (dx, dy) in (0..9).map(|n| (n % 3 - 1, n / 3 - 1)) {
                // Cells along z follow each other.
                let (low, high) = (key([x + dx, y + dy, z - 1]), key([x + dx, y + dy, z + 1]));
                let first = self.cells.partition_point(|c| c.0 < low);
                for &(_, j) in self.cells[first..].iter().take_while(|c| c.0 <= high) {
                    let near = (points[j as usize] - p).length_squared() < reach * reach;
                    if j > i && near && !along_the_cloth(i, j) {
                        self.pairs.push((i, j));
                    }
                }
            }
        }
    }

    fn push_apart(&self, points: &mut [Vec3]) {
        for &(a, b) in &self.pairs {
            let (a, b) = (a as usize, b as usize);
            let apart = points[b] - points[a];
            let length = apart.length();
            if length < APART && length > 0.0 {
                let move_by = apart * (0.25 * (APART - length) / length);
                points[a] -= move_by;
                points[b] += move_by;
            }
        }
    }
}

/// Whether two points are neighbours in the grid.
fn along_the_cloth(a: u32, b: u32) -> bool {
    let n = POINTS as u32;
    (a % n).abs_diff(b % n) <= 1 && (a / n).abs_diff(b / n) <= 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(height: f32) -> Key {
        let place = |i: usize| {
            let at = |i: usize| (i as f32 - 0.5 * (POINTS - 1) as f32) * SPACING;
            Vec3::new(at(i % POINTS), height, at(i / POINTS))
        };
        (0..POINTS * POINTS).map(place).collect()
    }

    #[test]
    fn a_cloth_in_the_air_falls_as_a_whole() {
        let mut cloth = Cloth::new(flat(5.0));
        for step in 0..72 {
            cloth.step(step % STEPS_A_FOLD == 0);
        }
        // A tenth of a second: half g t squared, less a little air and a step's error.
        let fallen: Vec<f32> = cloth.points.iter().map(|p| 5.0 - p.y).collect();
        assert!(fallen.iter().all(|f| (f - 0.049).abs() < 0.002), "{:?}", fallen[0]);
        assert!(cloth.points.iter().zip(flat(5.0)).all(|(p, q)| (*p - q).with_y(0.0).length() < 1e-4));
    }

    #[test]
    fn folds_are_what_brute_force_finds() {
        let mut points = flat(1.0);
        let half = points.len() / 2;
        for p in &mut points[half..] {
            // The second half is folded over, just above the first.
            *p = Vec3::new(p.x, 1.0 + 0.5 * APART, -p.z);
        }
        let mut folds = Folds::default();
        folds.find(&points);
        let reach = APART * 1.3;
        let n = points.len() as u32;
        let mut expected = Vec::new();
        for i in 0..n {
            for j in i + 1..n {
                let near = (points[i as usize] - points[j as usize]).length_squared() < reach * reach;
                if near && !along_the_cloth(i, j) {
                    expected.push((i, j));
                }
            }
        }
        folds.pairs.sort_unstable();
        assert!(expected.len() > 1000);
        assert_eq!(folds.pairs, expected);
    }

    #[test]
    fn threads_hardly_stretch() {
        let keys = keys(flat(1.2));
        for key in keys.iter().step_by(10) {
            let stretch = |i: usize| (key[i + 1] - key[i]).length() / SPACING - 1.0;
            let worst =
                (0..key.len() - 1).filter(|i| i % POINTS < POINTS - 1).map(stretch).fold(0.0, f32::max);
            assert!(worst < 0.12, "{worst}");
        }
    }
}
