//! The rays of a bundle in one space: each ray's figures in lanes, and the intervals that all of them lie in.

use super::{GROUPS, RAYS};
use crate::instance::{Placed, Places};
use crate::patch::Patch;
use crate::reach::Reach;
use vastlight_accel::ray::{EightRays, ScaledRay, TriangleRay};
use vastlight_accel::wide::WideNode;
use vastlight_math::{Aabb, Ray, Vec3};
use vastlight_simd::Simd8;

/// A figure of each ray, eight rays a group.
type Lanes = [[f32; 8]; GROUPS];

/// Where no ray reaches.
pub(super) const NOWHERE: f32 = f32::NEG_INFINITY;

/// The way to a space, and what rays need to know of the geometry there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place<'a> {
    /// None for the world.
    pub(super) placed: Option<&'a Placed>,
    /// Of an instance that moves: it is in another place for every ray.
    pub(super) moving: Option<(&'a Places, usize)>,
    pub(super) extent: f32,
    pub(super) margin_factor: f32,
}

/// Rays in one space. Lanes without a ray reach [`NOWHERE`].
#[derive(Clone, Debug)]
pub(super) struct Space {
    /// The rays' numbers in the bundle, by lane.
    members: [u8; RAYS],
    groups: usize,
    origin: [Lanes; 3],
    direction: [Lanes; 3],
    reciprocal: [Lanes; 3],
    /// `plane * reciprocal - near_offset` is where a ray enters a slab, margin included; it leaves at the other offset.
    near_offset: [Lanes; 3],
    far_offset: [Lanes; 3],
    t_min: Lanes,
    t_max: Lanes,
    t_scale: Lanes,
    intervals: [Interval; 3],
    /// The smallest `t_min` and the largest `t_max`.
    first: f32,
    pub(super) last: f32,
}

/// What the rays have in common along an axis.
#[derive(Clone, Copy, Debug, Default)]
struct Interval {
    /// Of the reciprocals.
    reciprocal: [f32; 2],
    /// Of the origins, margin included.
    origin: [f32; 2],
}

/// The plane of a slab by which rays enter it.
enum Side {
    Lower,
    Upper,
    /// Not the same for all rays.
    Mixed,
}

impl Interval {
    #[inline(always)]
    fn side(&self) -> Side {
        let [low, high] = self.reciprocal;
        if low > 0.0 {
            Side::Lower
        } else if high < 0.0 {
            Side::Upper
        } else {
            Side::Mixed
        }
    }
}

/// Intervals by lane.
#[derive(Clone, Copy)]
struct Hull<S: Simd8> {
    reciprocal: [S::F; 2],
    origin: [S::F; 2],
}

impl<S: Simd8> Hull<S> {
    #[inline(always)]
    fn new(s: S) -> Self {
        let empty = [s.splat(f32::INFINITY), s.splat(f32::NEG_INFINITY)];
        Self { reciprocal: empty, origin: empty }
    }

    #[inline(always)]
    fn grow(&mut self, s: S, origin: S::F, reciprocal: S::F, margin: S::F) {
        self.reciprocal = [s.min(self.reciprocal[0], reciprocal), s.max(self.reciprocal[1], reciprocal)];
        let (low, high) = (s.sub(origin, margin), s.add(origin, margin));
        self.origin = [s.min(self.origin[0], low), s.max(self.origin[1], high)];
    }

    #[inline(always)]
    fn interval(&self, s: S) -> Interval {
        Interval {
            reciprocal: [least(s, self.reciprocal[0]), most(s, self.reciprocal[1])],
            origin: [least(s, self.origin[0]), most(s, self.origin[1])],
        }
    }
}

#[inline(always)]
fn least<S: Simd8>(s: S, lanes: S::F) -> f32 {
    s.to_array(lanes).into_iter().fold(f32::INFINITY, f32::min)
}

#[inline(always)]
fn most<S: Simd8>(s: S, lanes: S::F) -> f32 {
    s.to_array(lanes).into_iter().fold(f32::NEG_INFINITY, f32::max)
}

impl Default for Space {
    fn default() -> Self {
        Self {
            members: [0; RAYS],
            groups: 0,
            origin: [[[0.0; 8]; GROUPS]; 3],
            direction: [[[0.0; 8]; GROUPS]; 3],
            reciprocal: [[[0.0; 8]; GROUPS]; 3],
            near_offset: [[[0.0; 8]; GROUPS]; 3],
            far_offset: [[[0.0; 8]; GROUPS]; 3],
            t_min: [[0.0; 8]; GROUPS],
            t_max: [[NOWHERE; 8]; GROUPS],
            t_scale: [[1.0; 8]; GROUPS],
            intervals: [Interval::default(); 3],
            first: 0.0,
            last: NOWHERE,
        }
    }
}

impl Space {
    /// Takes in the rays of a patch whose bit is set in `chosen`, each as far as `reach` says.
    #[inline(always)]
    pub(super) fn load<S: Simd8>(
        &mut self,
        s: S,
        place: &Place<'_>,
        rays: (&[Ray], &Patch),
        chosen: u64,
        reach: &[f32; RAYS],
    ) {
        self.copy(rays, chosen, reach);
        let mut hull = [Hull::new(s); 3];
        for group in 0..self.groups.min(GROUPS) {
            self.place_group(s, place, rays, group, &mut hull);
        }
        self.intervals = [hull[0].interval(s), hull[1].interval(s), hull[2].interval(s)];
        self.first = self.smallest(s, &self.t_min);
        self.shortened(s);
    }

    /// Rays to lanes; the last group is filled up with a ray that reaches nowhere.
    #[inline(always)]
    fn copy(&mut self, (rays, patch): (&[Ray], &Patch), mut chosen: u64, reach: &[f32; RAYS]) {
        let count = chosen.count_ones() as usize;
        self.groups = count.div_ceil(8);
        let mut i = 0;
        for lane in 0..8 * self.groups {
            if chosen != 0 {
                i = chosen.trailing_zeros() as usize % RAYS;
                chosen &= chosen - 1;
            }
            let ray = &rays[patch.index(i)];
            let (group, place) = (lane / 8 % GROUPS, lane % 8);
            for axis in 0..3 {
                self.origin[axis][group][place] = ray.origin[axis];
                self.direction[axis][group][place] = ray.direction[axis];
            }
            self.members[lane % RAYS] = i as u8;
            self.t_min[group][place] = ray.t_min.max(0.0);
            self.t_max[group][place] = if lane < count { reach[i] } else { NOWHERE };
        }
    }

    /// Brings a group to its place and prepares it.
    #[inline(always)]
    fn place_group<S: Simd8>(
        &mut self,
        s: S,
        place: &Place<'_>,
        rays: (&[Ray], &Patch),
        group: usize,
        hull: &mut [Hull<S>; 3],
    ) {
        if let Some(moving) = place.moving {
            self.place_one_by_one(moving, rays, group);
        }
        let mut eight =
            EightRays { origin: load3(s, &self.origin, group), direction: load3(s, &self.direction, group) };
        if let (Some(placed), None) = (place.placed, place.moving) {
            eight = placed.map_rays(s, &eight);
            store3(s, &mut self.origin, group, eight.origin);
            store3(s, &mut self.direction, group, eight.direction);
        }
        self.t_scale[group] = [1.0; 8];
        let comfortable = eight.comfortable(s);
        if comfortable != 0xff {
            self.rescale(group, !comfortable & 0xff, place.placed.is_some());
            eight.origin = load3(s, &self.origin, group);
            eight.direction = load3(s, &self.direction, group);
            let scale = s.load(&self.t_scale[group]);
            self.t_min[group] = s.to_array(s.div(s.load(&self.t_min[group]), scale));
            self.t_max[group] = s.to_array(s.div(s.load(&self.t_max[group]), scale));
        }
        let (reciprocal, margin) = eight.for_boxes(s, place.extent, place.margin_factor);
        for axis in 0..3 {
            let (origin, reciprocal) = (eight.origin[axis], reciprocal[axis]);
            let (offset, width) = (s.mul(origin, reciprocal), s.mul(margin, s.abs(reciprocal)));
            self.reciprocal[axis][group] = s.to_array(reciprocal);
            self.near_offset[axis][group] = s.to_array(s.add(offset, width));
            self.far_offset[axis][group] = s.to_array(s.sub(offset, width));
            hull[axis].grow(s, origin, reciprocal, margin);
        }
    }

    /// Brings each ray of a group to the place that an instance has at its time; those that do not see it reach nowhere.
    #[cold]
    #[inline(never)]
    fn place_one_by_one(
        &mut self,
        (places, instance): (&Places, usize),
        (rays, patch): (&[Ray], &Patch),
        group: usize,
    ) {
        for lane in 0..8 {
            let ray = &rays[patch.index(self.member(8 * group + lane))];
            let Some(placed) = places.find(instance, ray.time) else {
                self.t_max[group][lane] = NOWHERE;
                continue;
            };
            let (origin, direction) = placed.map_ray(ray.origin, ray.direction);
            for axis in 0..3 {
                self.origin[axis][group][lane] = origin[axis];
                self.direction[axis][group][lane] = direction[axis];
            }
        }
    }

    /// Scales odd directions; rays that hit nothing get harmless figures and reach nowhere.
    #[cold]
    #[inline(never)]
    fn rescale(&mut self, group: usize, lanes: u32, in_mesh: bool) {
        for lane in (0..8).filter(|lane| lanes >> lane & 1 == 1) {
            let figure = |lanes: &[Lanes; 3]| {
                Vec3::new(lanes[0][group][lane], lanes[1][group][lane], lanes[2][group][lane])
            };
            let ray = ScaledRay::new(figure(&self.origin), figure(&self.direction));
            let usable = ray.filter(|ray| !in_mesh || ray.for_triangles(0.0).is_some());
            let (origin, direction, t_scale) = match &usable {
                Some(ray) => (figure(&self.origin), ray.direction(), ray.t_scale),
                None => (Vec3::ZERO, Vec3::ONE, 1.0),
            };
            for axis in 0..3 {
                self.origin[axis][group][lane] = origin[axis];
                self.direction[axis][group][lane] = direction[axis];
            }
            self.t_scale[group][lane] = t_scale;
            if usable.is_none() {
                self.t_max[group][lane] = NOWHERE;
            }
        }
    }

    #[inline(always)]
    fn smallest<S: Simd8>(&self, s: S, lanes: &Lanes) -> f32 {
        let mut low = s.splat(f32::INFINITY);
        for group in &lanes[..self.groups] {
            low = s.min(low, s.load(group));
        }
        least(s, low)
    }

    /// Groups of eight lanes in use.
    pub(super) fn groups(&self) -> usize {
        self.groups
    }

    /// The number in the bundle of the ray in a lane.
    #[inline(always)]
    pub(super) fn member(&self, lane: usize) -> usize {
        self.members[lane % RAYS] as usize % RAYS
    }

    /// How far the ray in a lane reaches.
    #[inline(always)]
    pub(super) fn reach(&self, lane: usize) -> Reach {
        let (group, lane) = (lane / 8 % GROUPS, lane % 8);
        let figure = |lanes: &Lanes| lanes[group][lane];
        Reach { t_min: figure(&self.t_min), t_max: figure(&self.t_max), t_scale: figure(&self.t_scale) }
    }

    /// The ray in a lane, prepared for triangles.
    #[inline(always)]
    pub(super) fn triangle_ray(&self, lane: usize, extent: f32) -> TriangleRay {
        let (g, l) = (lane / 8 % GROUPS, lane % 8);
        let figure = |lanes: &[Lanes; 3]| [lanes[0][g][l], lanes[1][g][l], lanes[2][g][l]];
        TriangleRay::new(figure(&self.origin), figure(&self.direction), figure(&self.reciprocal), extent)
    }

    /// Shortens a ray; [`Space::shortened`] must follow.
    #[inline(always)]
    pub(super) fn shorten(&mut self, lane: usize, t_max: f32) {
        self.t_max[lane / 8 % GROUPS][lane % 8] = t_max;
    }

    /// Finds out anew how far the rays reach.
    #[inline(always)]
    pub(super) fn shortened<S: Simd8>(&mut self, s: S) {
        let mut last = s.splat(NOWHERE);
        for group in &self.t_max[..self.groups] {
            last = s.max(last, s.load(group));
        }
        self.last = most(s, last);
    }

    /// The slots of `node` that some ray may meet, as bits, and where the first may enter each. Never leaves out a slot
    /// that a ray does meet.
    #[inline(always)]
    pub(super) fn may_meet<S: Simd8>(&self, s: S, node: &impl WideNode) -> (u32, S::F) {
        let mut enter = s.splat(self.first);
        let mut leave = s.splat(self.last);
        for (axis, interval) in self.intervals.iter().enumerate() {
            let upper = match interval.side() {
                Side::Lower => 0,
                Side::Upper => 1,
                Side::Mixed => continue,
            };
            let [low, high] = interval.reciprocal;
            let (near, far) = (node.planes(s, axis, upper), node.planes(s, axis, upper ^ 1));
            let (low, high) = (s.splat(low), s.splat(high));
            // The ray that starts nearest to a plane reaches it first.
            let near = s.sub(near, s.splat(interval.origin[upper ^ 1]));
            let far = s.sub(far, s.splat(interval.origin[upper]));
            enter = s.max(enter, s.min(s.mul(near, low), s.mul(near, high)));
            leave = s.min(leave, s.max(s.mul(far, low), s.mul(far, high)));
        }
        let exists = s.le(node.planes(s, 0, 0), node.planes(s, 0, 1));
        (s.bits(s.and(exists, s.le(enter, leave))) & node.used(), enter)
    }

    /// The lanes whose ray meets a box, a bit each.
    #[inline(always)]
    pub(super) fn meeting<S: Simd8>(&self, s: S, bounds: &Aabb) -> u64 {
        let mut lanes = 0;
        for group in 0..self.groups.min(GROUPS) {
            let mut enter = s.load(&self.t_min[group]);
            let mut leave = s.load(&self.t_max[group]);
            for axis in 0..3 {
                let reciprocal = s.load(&self.reciprocal[axis][group]);
                let near_offset = s.load(&self.near_offset[axis][group]);
                let far_offset = s.load(&self.far_offset[axis][group]);
                let (lower, upper) = (s.splat(bounds.min[axis]), s.splat(bounds.max[axis]));
                let (near, far) = match self.intervals[axis].side() {
                    Side::Lower => (lower, upper),
                    Side::Upper => (upper, lower),
                    Side::Mixed => {
                        let (a, b) = (s.mul(lower, reciprocal), s.mul(upper, reciprocal));
                        enter = s.max(enter, s.sub(s.min(a, b), near_offset));
                        leave = s.min(leave, s.sub(s.max(a, b), far_offset));
                        continue;
                    }
                };
                enter = s.max(enter, s.mul_sub(near, reciprocal, near_offset));
                leave = s.min(leave, s.mul_sub(far, reciprocal, far_offset));
            }
            lanes |= u64::from(s.bits(s.le(enter, leave))) << (8 * group);
        }
        lanes
    }
}

#[inline(always)]
fn load3<S: Simd8>(s: S, lanes: &[Lanes; 3], group: usize) -> [S::F; 3] {
    [s.load(&lanes[0][group]), s.load(&lanes[1][group]), s.load(&lanes[2][group])]
}

#[inline(always)]
fn store3<S: Simd8>(s: S, lanes: &mut [Lanes; 3], group: usize, [x, y, z]: [S::F; 3]) {
    lanes[0][group] = s.to_array(x);
    lanes[1][group] = s.to_array(y);
    lanes[2][group] = s.to_array(z);
}
