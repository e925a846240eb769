//! Placed meshes: the map from world rays to the mesh's space, and boxes in the world.

use rayon::prelude::*;
use std::sync::Arc;
use vastlight_accel::ray::EightRays;
use vastlight_math::glam::{DAffine3, DMat3, DVec3};
use vastlight_math::{Aabb, Affine3, Vec3};
use vastlight_scene::{Change, InstanceKeys, Instances, Scene, Shutter, can_be_placed};
use vastlight_simd::Simd8;

/// An instance as rays see it, 56 bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    /// Rows of the map from the world to the mesh's scaled space.
    rows: [[f32; 4]; 3],
    /// Index of the mesh's structure.
    pub(crate) mesh: u32,
    identity: bool,
    /// Whether the map is that of the moment when a shutter opens: see [`Places::at`].
    pub(crate) moves: bool,
}

/// What placing a mesh needs to know of its structure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshSpace {
    /// Around all triangles, scaled; empty without triangles.
    pub(crate) bounds: Aabb,
    /// Largest absolute coordinate, scaled.
    pub(crate) extent: f32,
    /// Positions are the mesh's times this power of two.
    pub(crate) scale: f32,
}

/// The box of an instance in the world, and how much its map spreads rounding.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Footprint {
    /// Contains everything that rays can hit, with a margin for rounding that does not depend on the ray.
    pub(crate) bounds: Aabb,
    /// Factor between rounding errors in the world and those after the way to the mesh's space and back.
    pub(crate) spread: f32,
}

/// The footprint of what is not to be seen.
const NOWHERE: Footprint = Footprint { bounds: Aabb::EMPTY, spread: 1.0 };

impl Placed {
    pub(crate) fn new(world_from_object: &Affine3, mesh: u32, scale: f32) -> Self {
        let inverse = widen(world_from_object).inverse();
        let (linear, offset) = (inverse.matrix3, inverse.translation);
        let scale = f64::from(scale);
        let rows = std::array::from_fn(|r| {
            let row = linear.row(r);
            [row.x, row.y, row.z, offset[r]].map(|x| (x * scale) as f32)
        });
        let identity = rows == [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        Self { rows, mesh, identity, moves: false }
    }

    /// Rows of the map from the world to the mesh's scaled space.
    pub(crate) fn rows(&self) -> &[[f32; 4]; 3] {
        &self.rows
    }

    /// Whether the map changes nothing.
    pub(crate) fn is_identity(&self) -> bool {
        self.identity
    }

    /// Origin and direction of a world ray in the mesh's scaled space.
    #[inline(always)]
    pub(crate) fn map_ray(&self, origin: Vec3, direction: Vec3) -> (Vec3, Vec3) {
        if self.identity {
            return (origin, direction);
        }
        let linear = |v: Vec3, [x, y, z, _]: [f32; 4]| x * v.x + y * v.y + z * v.z;
        let point = self.rows.map(|row| linear(origin, row) + row[3]);
        (Vec3::from(point), Vec3::from(self.rows.map(|row| linear(direction, row))))
    }

    /// [`Placed::map_ray`] of eight rays, with the same bits.
    #[inline(always)]
    pub(crate) fn map_rays<S: Simd8>(&self, s: S, rays: &EightRays<S>) -> EightRays<S> {
        if self.identity {
            return *rays;
        }
        let [x, y, z] = &self.rows;
        let origin = [linear(s, &rays.origin, x), linear(s, &rays.origin, y), linear(s, &rays.origin, z)];
        EightRays {
            origin: [
                s.add(origin[0], s.splat(x[3])),
                s.add(origin[1], s.splat(y[3])),
                s.add(origin[2], s.splat(z[3])),
            ],
            direction: [
                linear(s, &rays.direction, x),
                linear(s, &rays.direction, y),
                linear(s, &rays.direction, z),
            ],
        }
    }
}

/// The product of eight vectors with a row.
#[inline(always)]
fn linear<S: Simd8>(s: S, v: &[S::F; 3], row: &[f32; 4]) -> S::F {
    let xy = s.add(s.mul(s.splat(row[0]), v[0]), s.mul(s.splat(row[1]), v[1]));
    s.add(xy, s.mul(s.splat(row[2]), v[2]))
}

impl Footprint {
    /// Half a unit in the last place of 1.
    const EPSILON: f64 = 1.0 / 16_777_216.0;
    /// Margin in units of it; what blending a map rounds is in it.
    const MARGIN: f64 = 100.0;
    /// Beyond this spread, a map is so close to singular that box tests may lose hits of no meaning.
    const MAX_SPREAD: f64 = 16_384.0;

    /// The footprint of `mesh` placed by `world_from_object`; an empty box for an empty mesh, and where the map is singular.
    pub(crate) fn new(world_from_object: &Affine3, mesh: &MeshSpace) -> Self {
        if mesh.bounds.is_empty() || !can_be_placed(world_from_object) {
            return NOWHERE;
        }
        let map = widen(world_from_object);
        let (there, back) = (absolute(map.matrix3), absolute(map.matrix3.inverse()));
        Self::with_spread(&map, mesh, norm(there * back))
    }

    /// The same where the map's spread is known, or a bound of it.
    fn with_spread(map: &DAffine3, mesh: &MeshSpace, spread: f64) -> Self {
        let there = absolute(map.matrix3);
        let spread = spread.clamp(1.0, Self::MAX_SPREAD);
        let scale = 1.0 / f64::from(mesh.scale);
        let (min, max) = (mesh.bounds.min.as_dvec3() * scale, mesh.bounds.max.as_dvec3() * scale);
        let center = map.transform_point3((min + max) * 0.5);
        let reach = there * ((max - min) * 0.5);
        let sources =
            spread * map.translation.abs().max_element() + norm(there) * f64::from(mesh.extent) * scale;
        let margin = DVec3::splat(Self::MARGIN * Self::EPSILON * sources);
        let bounds = Aabb {
            min: (center - reach - margin).to_array().map(round_down).into(),
            max: (center + reach + margin).to_array().map(|x| -round_down(-x)).into(),
        };
        Self { bounds, spread: spread as f32 }
    }

    /// The footprint of `mesh` on a straight way from one map to another, neither of them singular: what is between lies between the
    /// boxes of the ends, whose margins are those of the largest spread on the way.
    fn on_way([a, b]: [&Affine3; 2], mesh: &MeshSpace) -> Self {
        if mesh.bounds.is_empty() {
            return NOWHERE;
        }
        let (a, b) = (widen(a), widen(b));
        let spread = largest_spread(a.matrix3, b.matrix3, 0);
        Self::with_spread(&a, mesh, spread).union(Self::with_spread(&b, mesh, spread))
    }
}

fn absolute(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs())
}

/// Largest sum of a row, of a matrix without negative elements.
fn norm(m: DMat3) -> f64 {
    (m * DVec3::ONE).max_element()
}

/// Halvings of a way after which a bound of its spread is given up.
const MOST_HALVINGS: u32 = 12;

/// A bound of the spread of all `(1 - w) a + w b`, or infinity: found on the halves of the way where it turns far.
///
/// With `e = |a^-1 (b - a)| / 2 < 1`, `|((1 - w) a + w b)^-1| <= |a^-1| / (1 - e)` for `w <= 1/2`; the same from `b` for the rest.
fn largest_spread(a: DMat3, b: DMat3, halvings: u32) -> f64 {
    let turn = |from: DMat3, to: DMat3| 0.5 * norm(absolute(from.inverse() * (to - from)));
    let turns = [turn(a, b), turn(b, a)];
    // From a singular map they are infinite, or NaN.
    if turns.iter().all(|&e| e <= 0.5) {
        let there = norm(absolute(a)).max(norm(absolute(b)));
        let back = norm(absolute(a.inverse())).max(norm(absolute(b.inverse())));
        return there * back / (1.0 - turns[0].max(turns[1]));
    }
    if halvings == MOST_HALVINGS {
        return f64::INFINITY;
    }
    let middle = (a + b) * 0.5;
    largest_spread(a, middle, halvings + 1).max(largest_spread(middle, b, halvings + 1))
}

impl Footprint {
    fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), spread: self.spread.max(other.spread) }
    }
}

pub(crate) fn widen(map: &Affine3) -> DAffine3 {
    DAffine3 { matrix3: map.matrix3.as_dmat3(), translation: map.translation.as_dvec3() }
}

/// Numbers in order, each once.
pub(crate) fn ascending(numbers: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut numbers: Vec<u32> = numbers.collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// The largest f32 not above `x`, or a little less.
fn round_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x { nearest.next_down() } else { nearest }
}

/// Instances of a part.
const PART: usize = 512;

/// All instances of a scene, placed.
#[derive(Debug)]
pub(crate) struct Places {
    instances: Arc<Instances>,
    shutter: Option<Arc<Shutter>>,
    /// By mesh.
    spaces: Vec<MeshSpace>,
    /// All of them where there are at most [`Instances::AT_HAND`], 56 bytes each, or nothing: then maps are inverted whenever a ray
    /// comes.
    at_hand: Vec<Placed>,
    /// Around parts of the instances, with the largest of their spreads.
    parts: Vec<Footprint>,
    /// Around all instances.
    pub(crate) world: Aabb,
    /// Largest absolute coordinate of the world.
    pub(crate) extent: f32,
    /// How much wider margins of world boxes are than those of a mesh.
    pub(crate) margin_factor: f32,
}

impl Places {
    /// Places the meshes of `scene`, whose structures have these spaces.
    pub(crate) fn new(scene: &Scene, spaces: Vec<MeshSpace>) -> Self {
        let instances = scene.shared_instances();
        let mut places = Self {
            instances,
            shutter: scene.shutter().cloned(),
            spaces,
            at_hand: Vec::new(),
            parts: Vec::new(),
            world: Aabb::EMPTY,
            extent: 0.0,
            margin_factor: 2.0,
        };
        let count = places.instances.len();
        if count <= Instances::AT_HAND {
            places.at_hand = (0..count).into_par_iter().map(|i| places.opening(i)).collect();
        }
        places.parts = (0..count.div_ceil(PART)).into_par_iter().map(|part| places.around(part)).collect();
        places.unite();
        places
    }

    /// Lets go of the scene's table of instances, so that it can change in place; until [`Places::follow`], nothing is
    /// placed.
    pub(crate) fn let_go(&mut self) {
        self.instances = Arc::default();
    }

    /// Places what moved anew: instances that are elsewhere, and all those of meshes with other spaces.
    pub(crate) fn follow(&mut self, scene: &Scene, moved: &[u32], spaces: &[(u32, MeshSpace)]) {
        (self.instances, self.shutter) = (scene.shared_instances(), scene.shutter().cloned());
        for &(mesh, space) in spaces {
            self.spaces[mesh as usize] = space;
        }
        let of_meshes = spaces.iter().flat_map(|&(mesh, _)| self.instances.of_mesh(mesh));
        let mut touched = ascending(moved.iter().copied().chain(of_meshes));
        if !self.at_hand.is_empty() {
            let placed: Vec<Placed> =
                touched.par_iter().with_min_len(64).map(|&i| self.opening(i as usize)).collect();
            touched.iter().zip(placed).for_each(|(&i, placed)| self.at_hand[i as usize] = placed);
        }
        touched.iter_mut().for_each(|i| *i /= PART as u32);
        touched.dedup();
        let parts: Vec<Footprint> = touched.par_iter().map(|&part| self.around(part as usize)).collect();
        touched.iter().zip(parts).for_each(|(&part, found)| self.parts[part as usize] = found);
        self.unite();
    }

    /// The footprint of a part of the instances.
    fn around(&self, part: usize) -> Footprint {
        let numbers = part * PART..self.len().min((part + 1) * PART);
        numbers.map(|i| self.footprint(i)).fold(NOWHERE, Footprint::union)
    }

    fn unite(&mut self) {
        let Footprint { bounds, spread } = self.parts.iter().copied().fold(NOWHERE, Footprint::union);
        self.world = bounds;
        self.margin_factor = 2.0 * spread;
        self.extent =
            if bounds.is_empty() { 0.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element() };
    }

    /// Number of instances.
    pub(crate) fn len(&self) -> usize {
        self.instances.len()
    }

    /// Number of an instance's mesh.
    #[inline(always)]
    pub(crate) fn mesh(&self, instance: usize) -> u32 {
        self.at_hand.get(instance).map_or_else(|| self.instances.mesh(instance), |placed| placed.mesh)
    }

    /// An instance as rays see it when a shutter opens, if it exists; `room` is for what is not at hand.
    #[inline(always)]
    pub(crate) fn get<'p>(&'p self, instance: usize, room: &'p mut Option<Placed>) -> Option<&'p Placed> {
        match self.at_hand.get(instance) {
            Some(placed) => Some(placed),
            None if instance < self.instances.len() => Some(room.insert(self.opening(instance))),
            None => None,
        }
    }

    /// [`Places::get`] for a ray of an open shutter's `time`; none where the instance is not to be seen either.
    #[inline(always)]
    pub(crate) fn at<'p>(
        &'p self,
        instance: usize,
        time: f32,
        room: &'p mut Option<Placed>,
    ) -> Option<&'p Placed> {
        match self.at_hand.get(instance) {
            Some(placed) if !placed.moves => Some(placed),
            _ => Some(room.insert(self.find(instance, time)?)),
        }
    }

    #[inline(never)]
    fn opening(&self, instance: usize) -> Placed {
        let moves = self.moving(instance).is_some();
        Placed { moves, ..self.place(instance, self.instances.map(instance)) }
    }

    /// The same as [`Places::at`], found anew.
    #[inline(never)]
    pub(crate) fn find(&self, instance: usize, time: f32) -> Option<Placed> {
        match self.moving(instance) {
            Some((shutter, keys)) => Some(self.place(instance, &keys.at(&shutter.between(time))?)),
            None => (instance < self.len()).then(|| self.place(instance, self.instances.map(instance))),
        }
    }

    fn place(&self, instance: usize, map: &Affine3) -> Placed {
        let mesh = self.instances.mesh(instance);
        Placed::new(map, mesh, self.spaces[mesh as usize].scale)
    }

    /// The places of an instance that moves, with their shutter.
    fn moving(&self, instance: usize) -> Option<(&Shutter, &InstanceKeys)> {
        let shutter = self.shutter.as_ref()?;
        Some((shutter, shutter.instance(instance as u32)?))
    }

    /// What a change concerns: also what moved while the shutter was open, and now is somewhere.
    pub(crate) fn concerned(&self, change: &Change) -> Change {
        let Some(shutter) = &self.shutter else { return change.clone() };
        let Change { meshes, instances } = change;
        Change {
            meshes: ascending(meshes.iter().copied().chain(shutter.meshes().map(|(mesh, _)| mesh))),
            instances: ascending(instances.iter().copied().chain(shutter.instances().map(|(i, _)| i))),
        }
    }

    fn footprint(&self, instance: usize) -> Footprint {
        let mesh = &self.spaces[self.instances.mesh(instance) as usize];
        match self.moving(instance) {
            Some((_, keys)) => {
                keys.ways().map(|way| Footprint::on_way(way, mesh)).fold(NOWHERE, Footprint::union)
            }
            None => Footprint::new(self.instances.map(instance), mesh),
        }
    }

    /// The box of an instance in the world; empty for an empty mesh.
    pub(crate) fn bounds(&self, instance: u32) -> Aabb {
        self.footprint(instance as usize).bounds
    }

    /// The box in the world of a part of an instance's mesh, given in the mesh's scaled space.
    pub(crate) fn part(&self, instance: u32, bounds: Aabb) -> Aabb {
        let mesh = MeshSpace { bounds, ..self.spaces[self.instances.mesh(instance as usize) as usize] };
        Footprint::new(self.instances.map(instance as usize), &mesh).bounds
    }

    /// Memory, with the scene's own table of instances.
    pub(crate) fn bytes(&self) -> usize {
        self.instances.bytes() + size_of_val(&self.at_hand[..]) + size_of_val(&self.spaces[..])
    }

    /// What to ask the caches for before an instance is entered: where the table begins, and the bytes of a row.
    #[inline(always)]
    pub(crate) fn table(&self) -> (*const u8, usize) {
        if self.at_hand.is_empty() {
            (self.instances.maps().as_ptr().cast(), size_of::<Affine3>())
        } else {
            (self.at_hand.as_ptr().cast(), size_of::<Placed>())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spreads_on_a_way_are_bounded_even_where_it_crosses_a_singular_map() {
        let columns = |x: [f64; 3], y: [f64; 3]| DMat3::from_cols(x.into(), y.into(), DVec3::Z);
        let turn = DMat3::from_rotation_z;
        let ways = [
            (columns([1.0, 1.0, 0.0], [0.0, 1.0, 0.0]), columns([-1.0, 1.0, 0.0], [0.0, 1.0, 0.0])),
            (columns([1.0, 1.0, 0.0], [0.0, 1.0, 0.0]), columns([-0.3, 1.0, 0.0], [0.0, 1.0, 0.0])),
            (turn(0.0), turn(2.5)),
            (turn(0.3) * DMat3::from_diagonal(DVec3::new(1.0, 0.01, 1.0)), turn(0.9)),
            (DMat3::IDENTITY, DMat3::IDENTITY * 3.0),
        ];
        for (a, b) in ways {
            let bound = largest_spread(a, b, 0);
            let largest = (0..1000).map(|i| {
                let w = (f64::from(i) + 0.5) / 1000.0;
                let map = a * (1.0 - w) + b * w;
                norm(absolute(map) * absolute(map.inverse()))
            });
            let largest = largest.fold(0.0, f64::max);
            assert!(largest <= bound, "{largest} {bound}");
            assert!(bound.is_infinite() == (largest > 400.0), "{largest} {bound}");
        }
    }
}
