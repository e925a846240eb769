//! Keys of 32 bits that are close where rays are close: K. Garanzha, C. Loop 2010, "Fast ray sorting and breadth-first
//! packet traversal for GPU ray tracing", section 3; Garanzha's thesis of 2014, section 6.6.
//!
//! | bits | hold |
//! |---|---|
//! | 31 to 14 | the cell of the origin among 64 x 64 x 64 in the scene's box: six bits each of x, y and z in turn |
//! | 13 to 0 | the cell of the direction among 128 x 128: seven bits each of both coordinates in turn |
//!
//! Origins outside the box count as at its border, so those of a camera with a lens are one place. Directions are
//! unfolded to a square by an octahedron (Cigolle et al. 2014, "A survey of efficient representations for independent
//! unit vectors") whose tip is the axis along which most rays go, and the square that a sample of them fills has the
//! cells: the rays of a camera use all of them.

use vastlight_math::glam::Vec2;
use vastlight_math::{Aabb, Ray, Vec3};

/// Bits of each of an origin's three coordinates.
const ORIGIN_BITS: u32 = 6;
/// Bits of each of a direction's two coordinates.
const DIRECTION_BITS: u32 = 7;

/// The cells of a batch of rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    lower: Vec3,
    /// Cells in a unit of length.
    per_length: f32,
    /// The axes of directions that become x, y and the octahedron's tip, which has this sign.
    axes: [usize; 3],
    tip: f32,
    lower_direction: Vec2,
    per_direction: f32,
}

impl Cells {
    /// Cells for rays in a scene with these bounds, of which `sample` is a sample.
    pub(super) fn new(world: &Aabb, sample: &[Ray]) -> Self {
        let sum: Vec3 = sample.iter().map(|ray| unit(ray.direction)).sum();
        let tip = (0..3).fold(0, |best, axis| if sum[axis].abs() > sum[best].abs() { axis } else { best });
        let mut cells = Self {
            lower: world.min,
            per_length: cells_per(ORIGIN_BITS, world.size().max_element()),
            axes: [(tip + 1) % 3, (tip + 2) % 3, tip],
            tip: 1.0_f32.copysign(sum[tip]),
            lower_direction: Vec2::ZERO,
            per_direction: 0.0,
        };
        let unfolded = sample.iter().map(|ray| cells.unfold(ray.direction));
        let empty = (Vec2::splat(1.0), Vec2::splat(-1.0));
        let (low, high) = unfolded.fold(empty, |(low, high), p| (low.min(p), high.max(p)));
        cells.lower_direction = low;
        cells.per_direction = cells_per(DIRECTION_BITS, (high - low).max_element());
        cells
    }

    /// The key of a ray. Rays that are not finite have some key.
    #[inline]
    pub(super) fn key(&self, ray: &Ray) -> u32 {
        let [x, y, z] = self.origin_cell(ray).map(spread_by_three);
        let [u, v] = self.direction_cell(ray).map(spread_by_two);
        (x | y << 1 | z << 2) << (2 * DIRECTION_BITS) | u | v << 1
    }

    /// The cell of the origin.
    #[inline]
    pub(super) fn origin_cell(&self, ray: &Ray) -> [u32; 3] {
        ((ray.origin - self.lower) * self.per_length).to_array().map(|x| clamped(x, ORIGIN_BITS))
    }

    /// The cell of the direction.
    #[inline]
    pub(super) fn direction_cell(&self, ray: &Ray) -> [u32; 2] {
        let place = (self.unfold(ray.direction) - self.lower_direction) * self.per_direction;
        place.to_array().map(|x| clamped(x, DIRECTION_BITS))
    }

    /// The place of a direction in the square from -1 to 1; the half space of the tip lies in the middle.
    #[inline]
    fn unfold(&self, direction: Vec3) -> Vec2 {
        let unit = unit(direction);
        let [x, y, tip] = self.axes.map(|axis| unit[axis]);
        if tip * self.tip >= 0.0 {
            return Vec2::new(x, y);
        }
        Vec2::new((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y))
    }
}

/// The place of a direction on the octahedron; zero where it has none.
#[inline]
fn unit(direction: Vec3) -> Vec3 {
    let unit = direction / direction.abs().element_sum();
    if unit.is_finite() { unit } else { Vec3::ZERO }
}

/// How many of `2^bits` cells a unit of length has, where all of them have `length`; none where that is no number.
fn cells_per(bits: u32, length: f32) -> f32 {
    let cells = (1 << bits) as f32 / length;
    if length > 0.0 && cells.is_finite() { cells } else { 0.0 }
}

/// The cell of a coordinate; the first where it is no number.
#[inline]
fn clamped(x: f32, bits: u32) -> u32 {
    (x as u32).min((1 << bits) - 1)
}

/// Bits with two zeros after each.
#[inline]
fn spread_by_three(x: u32) -> u32 {
    let x = (x | x << 8) & 0x0000_f00f;
    let x = (x | x << 4) & 0x000c_30c3;
    (x | x << 2) & 0x0024_9249
}

/// Bits with a zero after each.
#[inline]
fn spread_by_two(x: u32) -> u32 {
    let x = (x | x << 4) & 0x0f0f;
    let x = (x | x << 2) & 0x3333;
    (x | x << 1) & 0x5555
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world() -> Aabb {
        Aabb { min: Vec3::splat(-1.0), max: Vec3::new(3.0, 1.0, 0.0) }
    }

    #[test]
    fn keys_have_the_bits_of_cells_where_the_layout_says() {
        let sample = [-Vec3::X, -Vec3::Y, Vec3::X, Vec3::Y, Vec3::Z].map(|d| Ray::new(Vec3::ZERO, d));
        let cells = Cells::new(&world(), &sample);
        // Bit by bit: cell (x, y, z) of the origin above, cell (u, v) of the direction below.
        for (axis, bit) in (0..3).flat_map(|axis| (0..ORIGIN_BITS).map(move |bit| (axis, bit))) {
            let mut origin = world().min;
            origin[axis] += 4.0 / 64.0 * ((1 << bit) as f32 + 0.5);
            let key = cells.key(&Ray::new(origin, Vec3::Z)) ^ cells.key(&Ray::new(world().min, Vec3::Z));
            assert_eq!(key, 1 << (14 + 3 * bit + axis as u32), "{axis} {bit}");
        }
        let key = |direction: Vec3| cells.key(&Ray::new(world().min, direction));
        assert_eq!(key(Vec3::new(-1.0, -1e-6, 1e-6)) & 0x1555, 0);
        assert_eq!(key(Vec3::X) & 0x1555, 0x1555);
        assert_eq!(key(Vec3::Y) & 0x2aaa, 0x2aaa);
        let neighbour = key(Vec3::new(1.2 / 64.0, 1.2 / 64.0, 1.0 - 2.4 / 64.0));
        assert_eq!(neighbour ^ key(Vec3::new(0.2 / 64.0, 0.2 / 64.0, 1.0 - 0.4 / 64.0)), 3);
    }

    #[test]
    fn a_narrow_beam_uses_all_cells_wherever_it_goes() {
        for main in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            let at = |i: usize, j: usize| {
                let [u, v] = [i, j].map(|i| (i as f32 / 31.0 - 0.5) * 0.2);
                let (across, other) = (Vec3::new(main.y, main.z, main.x), Vec3::new(main.z, main.x, main.y));
                Ray::new(Vec3::ZERO, main + across * u + other * v)
            };
            let rays: Vec<Ray> = (0..1024).map(|i| at(i / 32, i % 32)).collect();
            let cells = Cells::new(&world(), &rays);
            let mut keys: Vec<u32> = rays.iter().map(|ray| cells.key(ray)).collect();
            keys.sort_unstable();
            keys.dedup();
            assert!(keys.len() > 1000, "{main}: {} keys", keys.len());
        }
    }

    #[test]
    fn odd_rays_and_worlds_have_keys() {
        let odd = [0.0, -0.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e-45];
        let figures = |i: usize| Vec3::new(odd[i % 7], odd[i / 7 % 7], odd[(i / 3) % 7]);
        let rays: Vec<Ray> = (0..49).map(|i| Ray::new(figures(i), figures(i + 5))).collect();
        for world in [Aabb::EMPTY, Aabb::point(Vec3::ONE), Aabb { min: -Vec3::INFINITY, max: Vec3::INFINITY }]
        {
            let cells = Cells::new(&world, &rays);
            rays.iter().for_each(|ray| _ = cells.key(ray));
        }
        assert_eq!(Cells::new(&world(), &[]).key(&Ray::new(world().min, Vec3::Z)), 0);
    }
}
