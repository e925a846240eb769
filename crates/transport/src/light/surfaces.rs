//! All emissive triangles of a scene, times instances.
//!
//! A light is an (instance, triangle) pair. Up to [`FLAT_LIMIT`] of them stand in one world-space tree, about 180 bytes
//! each. Beyond it, meshes with many instances get a tree of their own in object space that all their instances share,
//! so that a million lamps cost a million leaves, however many triangles a lamp has.

use super::emitters::{EmissiveMesh, Run, SharedTree, emitted, is_similarity};
use super::tree::{Choice, Item};
use super::triangle::{TriangleLight, TrianglePoint};
use crate::material::MaterialTable;
use crate::words::{Words, lights};
use std::sync::Arc;
use vastlight_math::{Affine3, Vec2, Vec3};
use vastlight_scene::{Scene, Shutter};

/// Emissive triangles (times instances) in the world-space tree, before meshes share trees.
pub(super) const FLAT_LIMIT: u64 = 1 << 19;

/// The first light of a mesh without light.
const NONE: u32 = u32::MAX;

/// A triangle of the world-space tree, ready to be sampled: 64 bytes.
#[derive(Clone, Copy, Debug)]
struct FlatLight {
    shape: TriangleLight,
    /// What leaves every point of it, unless it is textured.
    radiance: Vec3,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Kind {
    OneSided,
    TwoSided,
    /// The radiance must be looked up.
    Textured,
    /// Stands for all triangles of an instance with a shared tree.
    Shared,
    /// Is elsewhere at each time of an open shutter. It is chosen by where it is when the shutter opens.
    Moving,
}

/// What stands at a leaf of the world-space tree.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    instance: u32,
    triangle: u32,
}

/// Point, plane normal and kind of map of an instance in object space.
struct ObjectView {
    from: Vec3,
    normal: Vec3,
    similar: bool,
}

/// A point on a light, with the radiance that leaves it and the probability of the choices within the light.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceSample {
    pub(super) point: TrianglePoint,
    pub(super) radiance: Vec3,
    pub(super) probability: f32,
}

/// A triangle of which every point shines alike.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlainTriangle<'a> {
    pub(super) shape: &'a TriangleLight,
    /// Not black.
    pub(super) radiance: Vec3,
    two_sided: bool,
}

impl PlainTriangle<'_> {
    /// Whether the point lies on a side that shines.
    #[inline(always)]
    pub(super) fn shines_at(&self, from: Vec3) -> bool {
        self.two_sided || self.shape.faces(from)
    }
}

/// All emissive triangles of a scene. Their lights are numbered from 0.
#[derive(Clone, Debug)]
pub(super) struct Surfaces<'a> {
    scene: &'a Scene,
    materials: &'a MaterialTable<'a>,
    meshes: Vec<EmissiveMesh>,
    /// The lights.
    flat: Vec<FlatLight>,
    /// What each light is.
    leaves: Vec<Leaf>,
    /// By mesh, the number of the first light of its first instance, or [`NONE`]; empty if nothing shines.
    first: Vec<u32>,
}

impl<'a> Surfaces<'a> {
    /// Finds all emissive triangles and appends them to the tree's items.
    pub(super) fn new(
        scene: &'a Scene,
        materials: &'a MaterialTable<'a>,
        flat_limit: u64,
        items: &mut Vec<Item>,
    ) -> Self {
        let meshes = scene.meshes().iter().map(|m| EmissiveMesh::new(m, materials, scene)).collect();
        let (flat, leaves, first) = (Vec::new(), Vec::new(), Vec::new());
        let mut found = Self { scene, materials, meshes, flat, leaves, first };
        if found.meshes.iter().all(|m| m.count == 0) {
            return found;
        }
        found.share_trees(flat_limit);
        for mesh in 0..found.meshes.len() as u32 {
            let of_mesh = scene.instances().of_mesh(mesh);
            let shines = found.meshes[mesh as usize].count > 0;
            found.first.push(if shines { found.flat.len() as u32 } else { NONE });
            of_mesh.filter(|_| shines).for_each(|i| found.append_instance(i, mesh, items));
        }
        found
    }

    /// Number of lights.
    pub(super) fn len(&self) -> usize {
        self.flat.len()
    }

    fn append_instance(&mut self, number: u32, mesh: u32, items: &mut Vec<Item>) {
        let first = self.flat.len() as u32;
        let moves =
            |shutter: &Arc<Shutter>| shutter.instance(number).is_some() || shutter.mesh(mesh).is_some();
        let moves = self.scene.shutter().is_some_and(moves);
        let (found, scene) = (&self.meshes[mesh as usize], self.scene);
        let (mesh, map) = (&scene.meshes()[mesh as usize], scene.instances().map(number as usize));
        if let Some(shared) = &found.shared {
            items.push(shared.item(map, first));
            self.leaves.push(Leaf { instance: number, triangle: 0 });
            let shape = TriangleLight::new([Vec3::ZERO; 3], 1.0);
            self.flat.push(FlatLight { shape, radiance: Vec3::ZERO, kind: Kind::Shared });
        } else {
            items.extend(found.items(mesh, map, first));
            for (_, triangle, run) in found.triangles() {
                self.leaves.push(Leaf { instance: number, triangle });
                let light = FlatLight::new(TriangleLight::placed(mesh.corners(triangle), map), run);
                self.flat.push(if moves { FlatLight { kind: Kind::Moving, ..light } } else { light });
            }
        }
    }

    /// Gives trees of their own to the meshes with the most instanced triangles, until the others fit.
    fn share_trees(&mut self, flat_limit: u64) {
        let instances = self.scene.instances();
        let uses: Vec<u64> =
            (0..self.meshes.len() as u32).map(|mesh| instances.of_mesh(mesh).len() as u64).collect();
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

    /// The light with this number, if it is a triangle that shines alike everywhere.
    #[inline(always)]
    pub(super) fn plain_triangle(&self, light: u32) -> Option<PlainTriangle<'_>> {
        let FlatLight { shape, radiance, kind } = self.flat.get(light as usize)?;
        let plain = matches!(kind, Kind::OneSided | Kind::TwoSided) && *radiance != Vec3::ZERO;
        plain.then_some(PlainTriangle { shape, radiance: *radiance, two_sided: *kind == Kind::TwoSided })
    }

    /// A point of the chosen light, at a time of an open shutter.
    #[inline]
    pub(super) fn sample(
        &self,
        choice: &Choice,
        from: Vec3,
        normal: Vec3,
        (u, time): (Vec2, f32),
    ) -> Option<SurfaceSample> {
        let flat = &self.flat[choice.light as usize];
        match flat.kind {
            Kind::OneSided | Kind::TwoSided => {
                let plain = self.plain_triangle(choice.light).filter(|plain| plain.shines_at(from))?;
                let point = plain.shape.sample(from, u)?;
                Some(SurfaceSample { point, radiance: plain.radiance, probability: choice.probability })
            }
            Kind::Textured => {
                let leaf = self.leaves[choice.light as usize];
                self.sample_triangle(leaf, &flat.shape, from, u, choice.probability)
            }
            Kind::Shared => self.sample_shared(choice, from, normal, (u, time)),
            Kind::Moving => {
                let leaf = self.leaves[choice.light as usize];
                self.sample_triangle(leaf, &self.shape(&leaf, time)?, from, u, choice.probability)
            }
        }
    }

    fn sample_shared(
        &self,
        choice: &Choice,
        from: Vec3,
        normal: Vec3,
        (u, time): (Vec2, f32),
    ) -> Option<SurfaceSample> {
        let instance = self.leaves[choice.light as usize].instance;
        let (mesh, map) = (self.mesh_of(instance), self.map(instance, time)?);
        let shared = mesh.shared.as_ref()?;
        let view = ObjectView::new(&map, from, normal);
        let estimate = shared.tree.estimate(view.from, view.normal, view.similar);
        let inner = shared.tree.sample(&estimate, view.from, view.normal, choice.u, view.similar)?;
        let leaf = Leaf { instance, triangle: mesh.triangle(inner.light) };
        let shape = self.shape(&leaf, time)?;
        self.sample_triangle(leaf, &shape, from, u, choice.probability * inner.probability)
    }

    fn sample_triangle(
        &self,
        leaf: Leaf,
        shape: &TriangleLight,
        from: Vec3,
        u: Vec2,
        probability: f32,
    ) -> Option<SurfaceSample> {
        let mesh_number = self.scene.instances().mesh(leaf.instance as usize) as usize;
        let (_, run) = self.meshes[mesh_number].find(leaf.triangle)?;
        if !run.two_sided && !shape.faces(from) {
            return None;
        }
        let point = shape.sample(from, u)?;
        let radiance = run.constant.unwrap_or_else(|| {
            let mesh = &self.scene.meshes()[mesh_number];
            emitted(mesh, self.materials, run.material, leaf.triangle, point.barycentric)
        });
        Some(SurfaceSample { point, radiance, probability })
    }

    /// The light that a triangle belongs to, and its number in the instance's shared tree.
    #[inline]
    pub(super) fn find(&self, instance: u32, triangle: u32) -> Option<(u32, Option<u32>)> {
        let instances = self.scene.instances();
        let mesh_number = if self.first.is_empty() { return None } else { instances.mesh(instance as usize) };
        let of_mesh = self.first.get(mesh_number as usize).copied().filter(|&f| f != NONE)?;
        let mesh = &self.meshes[mesh_number as usize];
        let (number, _) = mesh.find(triangle)?;
        let each = if mesh.shared.is_some() { 1 } else { mesh.count };
        let first = of_mesh + (instance - instances.of_mesh(mesh_number).start) * each;
        Some(if mesh.shared.is_some() { (first, Some(number)) } else { (first + number, None) })
    }

    /// Density over solid angle with which [`Surfaces::sample`] finds `position` at a time on what [`Surfaces::find`] found.
    #[inline]
    pub(super) fn pdf(
        &self,
        (light, shared): (u32, Option<u32>),
        triangle: u32,
        from: Vec3,
        normal: Vec3,
        (position, time): (Vec3, f32),
    ) -> f32 {
        let instance = self.leaves[light as usize].instance;
        let moved = || self.shape(&Leaf { instance, triangle }, time);
        let flat = &self.flat[light as usize];
        let Some(number) = shared else {
            return match flat.kind {
                Kind::Moving => moved().map_or(0.0, |shape| shape.pdf(from, position)),
                _ => flat.shape.pdf(from, position),
            };
        };
        let Some(map) = self.map(instance, time) else { return 0.0 };
        let (Some(tree), Some(shape)) = (&self.mesh_of(instance).shared, moved()) else { return 0.0 };
        let view = ObjectView::new(&map, from, normal);
        let estimate = tree.tree.estimate(view.from, view.normal, view.similar);
        let trail = tree.trails[number as usize];
        tree.tree.probability(&estimate, trail, view.from, view.normal, view.similar)
            * shape.pdf(from, position)
    }

    fn mesh_of(&self, instance: u32) -> &EmissiveMesh {
        &self.meshes[self.scene.instances().mesh(instance as usize) as usize]
    }

    /// The place of an instance at a time; none where it is not to be seen.
    fn map(&self, instance: u32, time: f32) -> Option<Affine3> {
        let moving = self.scene.shutter().and_then(|shutter| Some((shutter, shutter.instance(instance)?)));
        match moving {
            Some((shutter, keys)) => keys.at(&shutter.between(time)),
            None => Some(*self.scene.instances().map(instance as usize)),
        }
    }

    /// A triangle at a time; none where it is not to be seen.
    fn shape(&self, leaf: &Leaf, time: f32) -> Option<TriangleLight> {
        let number = self.scene.instances().mesh(leaf.instance as usize);
        let mesh = &self.scene.meshes()[number as usize];
        let moving = self.scene.shutter().and_then(|shutter| Some((shutter, shutter.mesh(number)?)));
        let corners = match moving {
            Some((shutter, keys)) => {
                let between = shutter.between(time);
                let [a, b] = between.ends(keys)?;
                let vertices = mesh.triangles[leaf.triangle as usize].map(|vertex| vertex as usize);
                vertices.map(|vertex| between.blend(a.positions[vertex], b.positions[vertex]))
            }
            None => mesh.corners(leaf.triangle),
        };
        Some(TriangleLight::placed(corners, &self.map(leaf.instance, time)?))
    }

    /// Appends all triangles and what finds them.
    pub(super) fn pack(&self, words: &mut Words) {
        let meshes = self.pack_meshes(words);
        words.section(lights::SURFACES);
        words.set(lights::SURFACE_COUNT, self.len() as u32);
        for (flat, leaf) in self.flat.iter().zip(&self.leaves) {
            let mesh = self.scene.instances().mesh(leaf.instance as usize) as usize;
            match flat.kind {
                Kind::Shared => self.pack_shared(leaf.instance, meshes[mesh], words),
                Kind::Textured | Kind::Moving => {
                    let run = self.meshes[mesh].find(leaf.triangle);
                    let two_sided = run.is_some_and(|(_, run)| run.two_sided);
                    flat.shape.pack(words);
                    words.u32s(&[leaf.instance, leaf.triangle, u32::from(two_sided)]);
                }
                Kind::OneSided | Kind::TwoSided => {
                    flat.shape.pack(words);
                    words.vec3(flat.radiance);
                }
            }
            words.u32(flat.kind as u32);
        }
    }

    /// Appends what the emissive meshes' records point to, then the records. Gives the word of each mesh's record, 0 for
    /// those without light.
    fn pack_meshes(&self, words: &mut Words) -> Vec<u32> {
        let numbered = || self.first.iter().enumerate().filter(|(_, first)| **first != NONE);
        let parts: Vec<[u32; 6]> =
            numbered().map(|(i, _)| self.meshes[i].pack(&self.scene.meshes()[i], words)).collect();
        words.section(lights::MESHES);
        words.set(lights::MESH_COUNT, parts.len() as u32);
        let mut places = vec![0; self.meshes.len()];
        for ((i, first), part) in numbered().zip(parts) {
            let instances = self.scene.instances().of_mesh(i as u32);
            places[i] = words.offset();
            words.u32s(&[instances.start, instances.end, *first, self.meshes[i].count]);
            words.u32s(&part);
        }
        places
    }

    fn pack_shared(&self, instance: u32, mesh: u32, words: &mut Words) {
        let map = self.scene.instances().map(instance as usize);
        let mirrored = map.matrix3.determinant().is_sign_negative();
        map.to_cols_array_2d().into_iter().for_each(|column| words.f32s(&column));
        words.u32s(&[mesh, instance, u32::from(is_similarity(map)) | u32::from(mirrored) << 1]);
    }

    pub(super) fn bytes(&self) -> usize {
        self.first.len() * 4
            + self.flat.len() * size_of::<(FlatLight, Leaf)>()
            + self.meshes.iter().map(EmissiveMesh::bytes).sum::<usize>()
    }
}

impl FlatLight {
    fn new(shape: TriangleLight, run: &Run) -> Self {
        let kind = match run.constant {
            None => Kind::Textured,
            Some(_) if run.two_sided => Kind::TwoSided,
            Some(_) => Kind::OneSided,
        };
        Self { shape, radiance: run.constant.unwrap_or(Vec3::ZERO), kind }
    }
}

impl ObjectView {
    fn new(world_from_object: &Affine3, from: Vec3, normal: Vec3) -> Self {
        Self {
            from: world_from_object.inverse().transform_point3(from),
            normal: (world_from_object.matrix3.transpose() * normal).normalize_or_zero(),
            similar: is_similarity(world_from_object),
        }
    }
}
