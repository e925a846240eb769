//! Emissive triangles: which there are, where they stand in the light tree, and how strong they are.
//!
//! A light is an (instance, triangle) pair. Up to [`FLAT_LIMIT`] of them stand in one world-space tree, about 120 bytes
//! each. Beyond it, meshes with many instances get a tree of their own in object space that all their instances share,
//! so that a million lamps cost a million leaves, however many triangles a lamp has.

use super::bounds::{Cone, LightBounds};
use super::tree::{Item, LightTree, NO_TRAIL};
use super::triangle::TriangleLight;
use crate::material::{MaterialTable, ShadingPoint};
use vastlight_math::{Aabb, Affine3, Vec2, Vec3, warp};
use vastlight_scene::{Instance, Mesh, Scene};

/// Emissive triangles (times instances) in the world-space tree, before meshes share trees.
pub(super) const FLAT_LIMIT: u64 = 1 << 20;

/// Marks a light that is no triangle, and an instance without light.
pub(super) const NONE: u32 = u32::MAX;

/// A leaf of the world-space tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emitter {
    /// The instance; [`NONE`] for a light without surface.
    pub(super) instance: u32,
    /// The triangle; [`NONE`] for all triangles of an instance with a shared tree. Without surface: its number.
    pub(super) index: u32,
}

/// A run of emissive triangles.
#[derive(Clone, Copy, Debug)]
struct Run {
    first: u32,
    count: u32,
    /// Emissive triangles before this run.
    before: u32,
    material: u32,
    /// The same radiance everywhere on it.
    constant: Option<Vec3>,
    two_sided: bool,
}

/// The emissive triangles of a mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct EmissiveMesh {
    runs: Vec<Run>,
    count: u32,
    /// Luminance of the mean radiance of each emissive triangle.
    strengths: Vec<f32>,
    pub(super) shared: Option<SharedTree>,
}

/// A tree over a mesh's emissive triangles in object space.
#[derive(Clone, Debug)]
pub(super) struct SharedTree {
    pub(super) tree: LightTree,
    pub(super) trails: Vec<u64>,
    bounds: LightBounds,
}

impl EmissiveMesh {
    fn new(mesh: &Mesh, materials: &MaterialTable, scene: &Scene) -> Self {
        let mut found = Self::default();
        let whole = [vastlight_scene::Part { first_triangle: 0, material: 0 }];
        let parts = if mesh.parts.is_empty() { &whole[..] } else { &mesh.parts };
        for (i, part) in parts.iter().enumerate() {
            let end = parts.get(i + 1).map_or(mesh.triangles.len() as u32, |p| p.first_triangle);
            let material = &scene.materials()[part.material as usize];
            let count = end.saturating_sub(part.first_triangle);
            if material.is_emissive() && count > 0 {
                let plain = material.emission.texture.is_none() && !material.has_alpha();
                found.runs.push(Run {
                    first: part.first_triangle,
                    count,
                    before: found.count,
                    material: part.material,
                    constant: plain.then(|| materials.emission(part.material, &ShadingPoint::default())),
                    two_sided: materials.is_two_sided(part.material),
                });
                found.count += count;
            }
        }
        found.strengths = found.measure(mesh, materials);
        found
    }

    fn measure(&self, mesh: &Mesh, materials: &MaterialTable) -> Vec<f32> {
        let points = if self.count < 100 { 256 } else { 32 };
        let mut strengths = Vec::with_capacity(self.count as usize);
        for run in &self.runs {
            for triangle in run.first..run.first + run.count {
                strengths.push(match run.constant {
                    Some(radiance) => super::luminance(radiance),
                    None => mean_luminance(mesh, materials, run.material, triangle, points),
                });
            }
        }
        strengths
    }

    /// The triangle's number among the emissive ones, and its run.
    #[inline]
    fn find(&self, triangle: u32) -> Option<(u32, &Run)> {
        let after = self.runs.partition_point(|r| r.first <= triangle);
        let run = self.runs.get(after.checked_sub(1)?)?;
        let offset = triangle - run.first;
        (offset < run.count).then(|| (run.before + offset, run))
    }

    /// The triangle with this number among the emissive ones.
    pub(super) fn triangle(&self, number: u32) -> u32 {
        let after = self.runs.partition_point(|r| r.before <= number);
        let run = &self.runs[after - 1];
        run.first + (number - run.before)
    }

    fn triangles(&self) -> impl Iterator<Item = (u32, u32, &Run)> {
        self.runs.iter().flat_map(|r| (0..r.count).map(move |i| (r.before + i, r.first + i, r)))
    }

    /// Tree items of this mesh's triangles under a map; the n-th gets the number `first + n`.
    fn items(&self, mesh: &Mesh, map: &Affine3, first: u32) -> impl Iterator<Item = Item> {
        let front = 1.0_f32.copysign(map.matrix3.determinant());
        self.triangles().filter_map(move |(number, triangle, run)| {
            let corners = mesh.corners(triangle).map(|p| map.transform_point3(p));
            let intensity = self.strengths[number as usize] * TriangleLight::new(corners, front).area();
            (intensity > 0.0 && intensity.is_finite())
                .then(|| triangle_item(corners, front, intensity, run.two_sided, first + number))
        })
    }
}

fn triangle_item(corners: [Vec3; 3], front: f32, intensity: f32, two_sided: bool, light: u32) -> Item {
    let [a, b, c] = corners;
    let center = (a + b + c) / 3.0;
    let radius = corners.iter().map(|p| p.distance(center)).fold(0.0, f32::max);
    let axis = ((b - a).cross(c - a) * front).normalize_or(Vec3::Z);
    let bounds = LightBounds {
        aabb: Aabb::from_points(corners),
        cone: Cone { axis, cos: 1.0 },
        cos_emission: 0.0,
        intensity,
        two_sided,
    };
    Item { bounds, center, radius, light, planar: true }
}

/// Mean luminance of what a textured triangle emits, over points in a fixed pattern (R. Roberts' R2 sequence).
fn mean_luminance(mesh: &Mesh, materials: &MaterialTable, material: u32, triangle: u32, points: u32) -> f32 {
    let sum: f32 = (0..points)
        .map(|i| {
            let at = |step: f64| ((f64::from(i) + 0.5) * step).fract() as f32;
            let b =
                warp::uniform_triangle(Vec2::new(at(0.754_877_666_246_692_8), at(0.569_840_290_998_053_2)));
            super::luminance(emitted(mesh, materials, material, triangle, b))
        })
        .sum();
    sum / points as f32
}

/// What a point of a triangle emits, times its coverage.
fn emitted(mesh: &Mesh, materials: &MaterialTable, material: u32, triangle: u32, barycentric: Vec2) -> Vec3 {
    let point = attributes(mesh, triangle, barycentric, materials.uv_sets(material));
    let radiance = materials.emission(material, &point);
    if materials.has_alpha(material) { radiance * materials.alpha(material, &point) } else { radiance }
}

fn attributes(mesh: &Mesh, triangle: u32, barycentric: Vec2, uv_sets: usize) -> ShadingPoint {
    let [a, b, c] = mesh.triangles[triangle as usize].map(|i| i as usize);
    let weight_a = 1.0 - barycentric.x - barycentric.y;
    let mut point = ShadingPoint::default();
    for (uv, set) in point.uvs.iter_mut().take(uv_sets).zip(&mesh.uvs) {
        if !set.is_empty() {
            *uv = set[a] * weight_a + set[b] * barycentric.x + set[c] * barycentric.y;
        }
    }
    if !mesh.colors.is_empty() {
        let colors = &mesh.colors;
        point.color = colors[a] * weight_a + colors[b] * barycentric.x + colors[c] * barycentric.y;
    }
    point
}

/// All emissive triangles of a scene.
#[derive(Clone, Debug)]
pub(super) struct Emitters<'a> {
    scene: &'a Scene,
    materials: &'a MaterialTable<'a>,
    meshes: Vec<EmissiveMesh>,
    /// The number of the first light of each instance in the list that [`Emitters::new`] fills, or [`NONE`].
    first: Vec<u32>,
}

/// A point on an emissive triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceLight<'e> {
    run: &'e Run,
    mesh: &'e Mesh,
    triangle: u32,
    pub(super) shape: TriangleLight,
}

impl<'a> Emitters<'a> {
    /// Finds all emissive triangles; appends them to the list of lights and of tree items.
    pub(super) fn new(
        scene: &'a Scene,
        materials: &'a MaterialTable<'a>,
        flat_limit: u64,
        emitters: &mut Vec<Emitter>,
        items: &mut Vec<Item>,
    ) -> Self {
        let meshes =
            scene.meshes().iter().map(|m| EmissiveMesh::new(m, materials, scene)).collect::<Vec<_>>();
        let mut found = Self { scene, materials, meshes, first: Vec::new() };
        if found.meshes.iter().all(|m| m.count == 0) {
            return found;
        }
        found.share_trees(flat_limit);
        for (i, instance) in scene.instances().iter().enumerate() {
            found.append_instance(i as u32, instance, emitters, items);
        }
        found
    }

    fn append_instance(
        &mut self,
        number: u32,
        instance: &Instance,
        emitters: &mut Vec<Emitter>,
        items: &mut Vec<Item>,
    ) {
        let found = &self.meshes[instance.mesh as usize];
        if found.count == 0 {
            self.first.push(NONE);
            return;
        }
        let first = emitters.len() as u32;
        self.first.push(first);
        if let Some(shared) = &found.shared {
            items.push(shared.item(&instance.world_from_object, first));
            emitters.push(Emitter { instance: number, index: NONE });
        } else {
            let mesh = &self.scene.meshes()[instance.mesh as usize];
            items.extend(found.items(mesh, &instance.world_from_object, first));
            emitters.extend(found.triangles().map(|(_, index, _)| Emitter { instance: number, index }));
        }
    }

    /// Gives trees of their own to the meshes with the most instanced triangles, until the others fit.
    fn share_trees(&mut self, flat_limit: u64) {
        let mut uses = vec![0_u64; self.meshes.len()];
        for instance in self.scene.instances() {
            uses[instance.mesh as usize] += 1;
        }
        let cost = |i: usize| uses[i] * u64::from(self.meshes[i].count);
        let mut total: u64 = (0..uses.len()).map(cost).sum();
        let mut order: Vec<usize> =
            (0..uses.len()).filter(|&i| uses[i] > 1 && self.meshes[i].count > 1).collect();
        order.sort_by_key(|&i| (std::cmp::Reverse(cost(i)), i));
        let mut chosen = Vec::new();
        for i in order {
            if total > flat_limit {
                total -= cost(i) - uses[i];
                chosen.push(i);
            }
        }
        for i in chosen {
            self.meshes[i].shared = SharedTree::new(&self.meshes[i], &self.scene.meshes()[i]);
        }
    }

    /// The mesh's emissive triangles that the instance shows.
    #[inline]
    pub(super) fn mesh_of(&self, instance: u32) -> &EmissiveMesh {
        &self.meshes[self.scene.instances()[instance as usize].mesh as usize]
    }

    pub(super) fn world_from_object(&self, instance: u32) -> &Affine3 {
        &self.scene.instances()[instance as usize].world_from_object
    }

    /// The light's place in the list of lights, and its number in the instance's shared tree.
    #[inline]
    pub(super) fn find(&self, instance: u32, triangle: u32) -> Option<(u32, Option<u32>)> {
        let first = self.first.get(instance as usize).copied().filter(|&f| f != NONE)?;
        let mesh = self.mesh_of(instance);
        let (number, _) = mesh.find(triangle)?;
        Some(if mesh.shared.is_some() { (first, Some(number)) } else { (first + number, None) })
    }

    /// The triangle as a light, if it emits.
    #[inline]
    pub(super) fn light(&self, instance: u32, triangle: u32) -> Option<SurfaceLight<'_>> {
        let placed = self.scene.instances().get(instance as usize)?;
        let (_, run) = self.meshes[placed.mesh as usize].find(triangle)?;
        let mesh = &self.scene.meshes()[placed.mesh as usize];
        let map = &placed.world_from_object;
        let front = 1.0_f32.copysign(map.matrix3.determinant());
        let shape = TriangleLight::new(mesh.corners(triangle).map(|p| map.transform_point3(p)), front);
        Some(SurfaceLight { run, mesh, triangle, shape })
    }

    /// Radiance that leaves a point of the triangle towards `from`, times the point's coverage.
    pub(super) fn radiance(&self, light: &SurfaceLight, from: Vec3, barycentric: Vec2) -> Vec3 {
        if !light.run.two_sided && !light.shape.faces(from) {
            return Vec3::ZERO;
        }
        light.run.constant.unwrap_or_else(|| {
            emitted(light.mesh, self.materials, light.run.material, light.triangle, barycentric)
        })
    }

    pub(super) fn bytes(&self) -> usize {
        let mesh = |m: &EmissiveMesh| {
            m.strengths.len() * 4 + m.shared.as_ref().map_or(0, |s| s.tree.bytes() + s.trails.len() * 8)
        };
        self.first.len() * 4 + self.meshes.iter().map(mesh).sum::<usize>()
    }
}

impl SharedTree {
    fn new(found: &EmissiveMesh, mesh: &Mesh) -> Option<Self> {
        let items: Vec<Item> = found.items(mesh, &Affine3::IDENTITY, 0).collect();
        let bounds = items.iter().map(|i| i.bounds).reduce(|a, b| a.union(&b))?;
        let mut trails = vec![NO_TRAIL; found.count as usize];
        let tree = LightTree::build(items, &mut trails);
        Some(Self { tree, trails, bounds })
    }

    /// The whole mesh as one light of the world.
    fn item(&self, world_from_object: &Affine3, light: u32) -> Item {
        let aabb = self.bounds.aabb.transformed(world_from_object);
        let volume = world_from_object.matrix3.determinant().abs();
        let cone = if is_similarity(world_from_object) {
            let axis = world_from_object.transform_vector3(self.bounds.cone.axis).normalize_or(Vec3::Z);
            Cone { axis, ..self.bounds.cone }
        } else {
            Cone::ALL
        };
        let area_scale = vastlight_math::real::pow(volume, 2.0 / 3.0);
        let bounds = LightBounds { aabb, cone, intensity: self.bounds.intensity * area_scale, ..self.bounds };
        Item { bounds, center: aabb.center(), radius: 0.5 * aabb.size().length(), light, planar: false }
    }
}

/// Whether a map keeps angles: then a shared tree's cones of normals hold.
pub(super) fn is_similarity(map: &Affine3) -> bool {
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
    let size = x.length_squared().max(y.length_squared()).max(z.length_squared());
    let equal = |v: f32| (v - size).abs() <= 1e-4 * size;
    let small = |v: f32| v.abs() <= 1e-4 * size;
    equal(x.length_squared())
        && equal(y.length_squared())
        && equal(z.length_squared())
        && small(x.dot(y))
        && small(y.dot(z))
        && small(z.dot(x))
}
