//! From a hit to a surface: position with an error bound, normals, tangent, texture coordinates, colour.
//!
//! Positions come from barycentric coordinates in object space, whose vertices are exact, not from `origin + t *
//! direction`: the error then does not grow with the ray's length. The bound covers the interpolation, the way to
//! world space, and the way back that the tracer takes with the next ray, in the manner of M. Pharr, W. Jakob,
//! G. Humphreys, "Physically Based Rendering", 4th ed., 6.8.6. Rays start at the bound's distance from the surface
//! along the geometric normal, so that no ray meets the triangle it leaves.

use crate::corners::{Corners, MeshCorners};
use crate::material::ShadingPoint;
use crate::placement::Placement;
use vastlight_math::glam::{DAffine3, DVec3};
use vastlight_math::{Affine3, Frame, Ray, Vec3, Vec4};
use vastlight_scene::{ImplicitShape, Mesh, Scene};
use vastlight_trace::Hit;

/// A point of a surface in world space. Normals are on the outside: the side from which the triangle's corners run
/// counter-clockwise in its mesh. A mirrored instance keeps its outside.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Position.
    pub position: Vec3,
    /// Distance along `normal` that separates a ray's origin safely from the surface.
    pub offset: f32,
    /// Unit geometric normal.
    pub normal: Vec3,
    /// Unit interpolated normal, in the half space of `normal`; equal to it on flat surfaces.
    pub smooth_normal: Vec3,
    /// Direction of growing `u` (unnormalised, zero if unknown), and the bitangent's sign.
    pub tangent: Vec4,
    /// Texture coordinates and vertex colour.
    pub attributes: ShadingPoint,
}

impl Surface {
    /// The surface that `hit` lies on.
    ///
    /// `uv_sets` are needed, the others stay zero. The tangent stays zero where it is not asked for, and where the mesh has
    /// none: a scene derives them where a material needs them.
    #[must_use]
    pub fn new(scene: &Scene, hit: &Hit, uv_sets: usize, with_tangent: bool) -> Self {
        let map = scene.instances().map(hit.instance as usize);
        let corners = MeshCorners::new(mesh_of(scene, hit), hit);
        Self::placed((map, &Placement::new(map)), hit, &corners, uv_sets, with_tangent)
    }

    /// [`Surface::new`] with the placement of the hit instance and the corners of the hit triangle.
    #[inline(always)]
    pub(crate) fn placed(
        (map, placement): (&Affine3, &Placement),
        hit: &Hit,
        corners: &impl Corners,
        uv_sets: usize,
        with_tangent: bool,
    ) -> Self {
        let weights = Weights::of(hit);
        let points = corners.points();
        let position = map.transform_point3(weights.blend(points));
        let normal = placement.normal(face_normal(points), Vec3::Z);
        Self {
            position,
            offset: placement.error(points, position) * normal.abs().element_sum(),
            normal,
            smooth_normal: smooth_normal(corners, &weights, placement, normal),
            tangent: with_tangent.then(|| corners.tangents()).flatten().map_or(Vec4::ZERO, |tangents| {
                let along = map.transform_vector3(weights.blend(tangents.map(Vec4::truncate)));
                along.extend(tangents[0].w * placement.handedness)
            }),
            attributes: attributes(corners, hit, uv_sets),
        }
    }

    /// The surface of an implicit shape where `ray` hit it at distance `t`: polished to the surface, so that the error is that of the
    /// position's rounding and of the way back. Its normal is exact and smooth; it has no texture coordinates.
    #[inline(never)]
    pub(crate) fn of_implicit(
        (map, placement): (&Affine3, &Placement),
        shape: &ImplicitShape,
        (ray, t): (&Ray, f32),
    ) -> Self {
        let wide = DAffine3 { matrix3: map.matrix3.as_dmat3(), translation: map.translation.as_dvec3() };
        let hit = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(t);
        let point = shape.project(wide.inverse().transform_point3(hit));
        let position = wide.transform_point3(point.position).as_vec3();
        let outward = point.normal.normalize_or_zero().as_vec3();
        let normal = placement.normal(outward, -ray.direction.normalize_or(Vec3::NEG_Z));
        Self {
            position,
            offset: placement.error([point.position.as_vec3(); 3], position) * normal.abs().element_sum(),
            normal,
            smooth_normal: normal,
            tangent: Vec4::ZERO,
            attributes: ShadingPoint::default(),
        }
    }

    /// Where a ray towards `direction` starts: off the surface, on the side to which it goes.
    #[inline]
    #[must_use]
    pub fn origin_towards(&self, direction: Vec3) -> Vec3 {
        self.position + self.normal * self.offset.copysign(direction.dot(self.normal))
    }

    /// The frame of the interpolated normal: z outside, x along the tangent, y along the bitangent. Left-handed where
    /// the texture is mirrored.
    #[must_use]
    #[inline(always)]
    pub fn frame(&self) -> Frame {
        if self.tangent == Vec4::ZERO {
            return Frame::from_z(self.smooth_normal);
        }
        let frame = Frame::from_z_and_tangent(self.smooth_normal, self.tangent.truncate());
        Frame { y: frame.y * self.tangent.w, ..frame }
    }

    /// The shading frame `frame`, bent as far as needed for `wo` and its mirror direction to lie on their side of the
    /// geometric surface: no point is black because its shading normal looks away.
    #[must_use]
    #[inline(always)]
    pub fn facing(&self, frame: Frame, wo: Vec3) -> Frame {
        if frame.z == self.normal {
            return frame;
        }
        let side = 1.0_f32.copysign(wo.dot(self.normal));
        let z = bend(frame.z * side, self.normal * side, wo) * side;
        if z == frame.z {
            return frame;
        }
        let handedness = 1.0_f32.copysign(frame.x.cross(frame.y).dot(frame.z));
        let bent = Frame::from_z_and_tangent(z, frame.x);
        Frame { y: bent.y * handedness, ..bent }
    }
}

/// The mesh that was hit.
#[inline(always)]
pub(crate) fn mesh_of<'s>(scene: &'s Scene, hit: &Hit) -> &'s Mesh {
    &scene.meshes()[scene.instances().mesh(hit.instance as usize) as usize]
}

/// Texture coordinates and colour alone: all that alpha depends on.
#[inline(always)]
pub(crate) fn attributes(corners: &impl Corners, hit: &Hit, uv_sets: usize) -> ShadingPoint {
    let (weights, mut point) = (Weights::of(hit), ShadingPoint::default());
    for (set, uv) in point.uvs.iter_mut().enumerate().take(uv_sets) {
        if let Some(uvs) = corners.uvs(set) {
            *uv = weights.blend(uvs);
        }
    }
    if let Some(colors) = corners.colors() {
        point.color = weights.blend(colors);
    }
    point
}

/// The interpolated normal in the half space of `normal`; `normal` itself where there is none.
#[inline(always)]
fn smooth_normal(corners: &impl Corners, weights: &Weights, placement: &Placement, normal: Vec3) -> Vec3 {
    let Some(normals) = corners.normals() else { return normal };
    let smooth = placement.normal(weights.blend(normals), normal);
    if smooth.dot(normal) < 0.0 { -smooth } else { smooth }
}

/// Weights of the corners of a hit triangle.
struct Weights([f32; 3]);

impl Weights {
    #[inline(always)]
    fn of(hit: &Hit) -> Self {
        Self([1.0 - hit.u - hit.v, hit.u, hit.v])
    }

    #[inline]
    fn blend<T>(&self, [a, b, c]: [T; 3]) -> T
    where
        T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        a * self.0[0] + b * self.0[1] + c * self.0[2]
    }
}

/// Unit normal in object space. In double precision the edges and their products are exact, so that slivers have
/// good normals too.
#[inline(always)]
fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let (a, b, c): (DVec3, DVec3, DVec3) = (a.into(), b.into(), c.into());
    (b - a).cross(c - a).normalize_or(DVec3::Z).as_vec3()
}

/// The unit vector nearest to the shading normal `z` about which the mirror image of `wo` is above the surface with
/// normal `normal` (A. Keller et al. 2017, "The iray light transport simulation and rendering system", A.3). All
/// three point to one side: `wo . normal >= 0`.
fn bend(z: Vec3, normal: Vec3, wo: Vec3) -> Vec3 {
    let lift = 1e-3 - z.dot(normal);
    let z = if lift > 0.0 { (z + normal * lift).normalize_or(normal) } else { z };
    let mirrored = z * (2.0 * wo.dot(z)) - wo;
    let limit = (0.9 * wo.dot(normal)).min(0.01);
    let height = mirrored.dot(normal);
    if height >= limit && wo.dot(z) > 0.0 {
        return z;
    }
    let lifted = (mirrored + normal * (limit - height)).normalize_or(normal);
    (wo + lifted).normalize_or(normal)
}
