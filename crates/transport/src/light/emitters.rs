//! The emissive triangles of a mesh, how strong they are, and a tree over them that instances may share.

use super::bounds::{Cone, LightBounds};
use super::tree::{Item, LightTree, NO_TRAIL, pack_trails};
use super::triangle::TriangleLight;
use crate::material::{MaterialTable, ShadingPoint};
use crate::words::Words;
use vastlight_math::{Aabb, Affine3, Vec2, Vec3, warp};
use vastlight_scene::{Mesh, Scene};

/// A run of emissive triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    first: u32,
    count: u32,
    /// Emissive triangles before this run.
    before: u32,
    pub(super) material: u32,
    /// The same radiance everywhere on it.
    pub(super) constant: Option<Vec3>,
    pub(super) two_sided: bool,
}

/// The emissive triangles of a mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct EmissiveMesh {
    runs: Vec<Run>,
    pub(super) count: u32,
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
    pub(super) fn new(mesh: &Mesh, materials: &MaterialTable, scene: &Scene) -> Self {
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
    pub(super) fn find(&self, triangle: u32) -> Option<(u32, &Run)> {
        let after = self.runs.partition_point(|r| r.first <= triangle);
        let run = self.runs.get(after.checked_sub(1)?)?;
        let offset = triangle - run.first;
        (offset < run.count).then(|| (run.before + offset, run))
    }

    pub(super) fn bytes(&self) -> usize {
        self.strengths.len() * 4 + self.shared.as_ref().map_or(0, |s| s.tree.bytes() + s.trails.len() * 8)
    }

    /// Appends the runs and, of a mesh with a tree of its own, that tree, its trails and its triangles' corners. Gives
    /// the words that name them: runs, how many, tree (two words), trails (0: no tree), corners.
    pub(super) fn pack(&self, mesh: &Mesh, words: &mut Words) -> [u32; 6] {
        let runs = words.offset();
        self.runs.iter().for_each(|run| run.pack(words));
        let count = self.runs.len() as u32;
        let Some(shared) = &self.shared else { return [runs, count, 0, 0, 0, 0] };
        let tree = shared.tree.pack(words);
        let trails = words.offset();
        pack_trails(&shared.trails, words);
        let corners = words.offset();
        for (_, triangle, _) in self.triangles() {
            mesh.corners(triangle).into_iter().for_each(|corner| words.vec3(corner));
        }
        [runs, count, tree[0], tree[1], trails, corners]
    }

    /// The triangle with this number among the emissive ones.
    pub(super) fn triangle(&self, number: u32) -> u32 {
        let after = self.runs.partition_point(|r| r.before <= number);
        let run = &self.runs[after - 1];
        run.first + (number - run.before)
    }

    pub(super) fn triangles(&self) -> impl Iterator<Item = (u32, u32, &Run)> {
        self.runs.iter().flat_map(|r| (0..r.count).map(move |i| (r.before + i, r.first + i, r)))
    }

    /// Tree items of this mesh's triangles under a map; the n-th gets the number `first + n`.
    pub(super) fn items(&self, mesh: &Mesh, map: &Affine3, first: u32) -> impl Iterator<Item = Item> {
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
        moment: axis * intensity,
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
pub(super) fn emitted(
    mesh: &Mesh,
    materials: &MaterialTable,
    material: u32,
    triangle: u32,
    barycentric: Vec2,
) -> Vec3 {
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

impl Run {
    fn pack(&self, words: &mut Words) {
        let flags = u32::from(self.two_sided) | u32::from(self.constant.is_some()) << 1;
        words.u32s(&[self.first, self.count, self.before, flags]);
        words.vec3(self.constant.unwrap_or(Vec3::ZERO));
    }
}

impl SharedTree {
    pub(super) fn new(found: &EmissiveMesh, mesh: &Mesh) -> Option<Self> {
        let items: Vec<Item> = found.items(mesh, &Affine3::IDENTITY, 0).collect();
        let bounds = items.iter().map(|i| i.bounds).reduce(|a, b| a.union(&b))?;
        let mut trails = vec![NO_TRAIL; found.count as usize];
        let tree = LightTree::build(items, &mut trails);
        Some(Self { tree, trails, bounds })
    }

    /// The whole mesh as one light of the world.
    pub(super) fn item(&self, world_from_object: &Affine3, light: u32) -> Item {
        let aabb = self.bounds.aabb.transformed(world_from_object);
        let volume = world_from_object.matrix3.determinant().abs();
        let cone = if is_similarity(world_from_object) {
            let axis = world_from_object.transform_vector3(self.bounds.cone.axis).normalize_or(Vec3::Z);
            Cone { axis, ..self.bounds.cone }
        } else {
            Cone::ALL
        };
        let area_scale = vastlight_math::real::pow(volume, 2.0 / 3.0);
        let bounds = LightBounds {
            aabb,
            cone,
            intensity: self.bounds.intensity * area_scale,
            moment: cone.axis * (self.bounds.moment.dot(self.bounds.cone.axis) * area_scale),
            ..self.bounds
        };
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
