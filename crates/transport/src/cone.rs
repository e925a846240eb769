//! Ray cones: how much of a surface a path sees (T. Akenine-Moeller et al. 2021, "Improved shader and texture level of detail using ray
//! cones").
//!
//! A cone has a width at the ray's origin and grows by its spread. Where it meets a triangle it covers an area, of which lookups in
//! textures are the mean. It depends on the path alone. Deviations: mirrors count as flat; the area of the slanted ellipse decides, not its
//! longer axis, since the samples of a pixel average along that; a cone that scatters spreads as its lobe does.

use crate::corners::Corners;
use crate::material::UV_SETS;
use vastlight_math::{Affine3, Ray};

/// The part of a pixel that a camera ray stands for: the samples of a pixel share it.
pub(crate) const PIXEL_PART: f32 = 0.5;

/// The part of a lobe's width that a scattered ray stands for.
const LOBE_PART: f32 = 0.125;

/// The cone around a ray.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cone {
    /// At the ray's origin, in world units.
    pub(crate) width: f32,
    /// Growth by distance.
    pub(crate) spread: f32,
}

impl Cone {
    /// A ray without width: lookups are for points.
    pub(crate) const RAY: Self = Self { width: 0.0, spread: 0.0 };

    /// The cone where it has come a distance further.
    #[inline(always)]
    pub(crate) fn moved(self, distance: f32) -> Self {
        Self { width: self.width + self.spread * distance, ..self }
    }

    /// The cone after scattering with a density by solid angle; 0 for mirrors, which leave it as it is.
    #[inline(always)]
    pub(crate) fn scattered(self, pdf: f32) -> Self {
        let spread = if pdf > 0.0 { LOBE_PART / pdf.sqrt() } else { 0.0 };
        Self { spread: self.spread.max(spread), ..self }
    }

    /// The area around a hit at distance `t` that the cone covers, in units of the first `uv_sets` texture coordinates.
    #[inline(always)]
    pub(crate) fn areas(
        self,
        (ray, t): (&Ray, f32),
        map: &Affine3,
        corners: &impl Corners,
        uv_sets: usize,
    ) -> [f32; UV_SETS] {
        let mut areas = [0.0; UV_SETS];
        if uv_sets == 0 {
            return areas;
        }
        let width = self.moved(t).width;
        let [a, b, c] = corners.points();
        let normal = map.transform_vector3(b - a).cross(map.transform_vector3(c - a));
        // Twice the triangle's area as the ray sees it.
        let seen = normal.dot(ray.direction).abs();
        for (set, area) in areas.iter_mut().enumerate().take(uv_sets) {
            if let Some([a, b, c]) = corners.uvs(set) {
                *area = width * width * (b - a).perp_dot(c - a).abs() / seen;
            }
        }
        areas
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corners::MeshCorners;
    use vastlight_math::{FAR, Vec2, Vec3};
    use vastlight_scene::Mesh;
    use vastlight_trace::Hit;

    #[test]
    fn areas_are_those_of_the_cone_on_the_surface() {
        // A triangle of 3 by 4 metres that a texture of 6 by 2 covers, placed twice as large.
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X * 3.0, Vec3::Y * 4.0],
            uvs: vec![vec![Vec2::ZERO, Vec2::X * 6.0, Vec2::Y * 2.0]],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let hit = Hit { prim: 0, ..Hit::MISS };
        let corners = MeshCorners::new(&mesh, &hit);
        let map = Affine3::from_scale(Vec3::splat(2.0));
        let ray = |direction| Ray { origin: Vec3::Z, t_min: 0.0, direction, t_max: FAR, time: 0.0 };
        let cone = Cone { width: 0.5, spread: 0.25 };
        let per_metre = 12.0 / 48.0;
        let straight = cone.areas((&ray(Vec3::NEG_Z), 2.0), &map, &corners, 1);
        assert_eq!(straight, [per_metre, 0.0, 0.0, 0.0], "one metre wide");
        let slanted = Vec3::new(0.6, 0.0, -0.8);
        let slanted = cone.areas((&ray(slanted), 2.0), &map, &corners, 2);
        assert!((slanted[0] - per_metre / 0.8).abs() < 1e-6 && slanted[1] == 0.0);
        assert_eq!(Cone::RAY.areas((&ray(Vec3::NEG_Z), 1e9), &map, &corners, 1)[0], 0.0);
        assert_eq!(cone.areas((&ray(Vec3::NEG_Z), 2.0), &map, &corners, 0)[0], 0.0);
    }

    #[test]
    fn cones_grow_and_never_shrink() {
        let cone = Cone { width: 0.0, spread: 0.125 }.moved(8.0);
        assert_eq!(cone.width, 1.0);
        assert_eq!(cone.scattered(0.0), cone, "a mirror");
        assert_eq!(cone.scattered(1e12), cone, "nearly a mirror");
        assert!(cone.scattered(0.3).spread > 0.2);
        assert_eq!(Cone { spread: 0.5, ..cone }.scattered(0.3).spread, 0.5);
    }
}
