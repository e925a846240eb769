//! Camera rays: thin-lens perspective (Kolb, Mitchell, Hanrahan 1995, the thin-lens model) and orthographic.

use crate::cone::{Cone, PIXEL_PART};
use crate::pixel_filter::FilterSampler;
use crate::settings::RenderSettings;
use crate::wavefront::TIME_DIMENSION;
use vastlight_math::{Affine3, Between, FAR, Ray, Sampler, Vec2, Vec3, real, warp};
use vastlight_scene::{Camera, Projection};

/// Planes at smaller cosines to a ray are not looked at.
const EDGE_ON: f32 = 0.05;

/// A camera made ready for one picture size.
#[derive(Clone, Debug)]
pub struct CameraRays {
    pub(crate) world_from_camera: Affine3,
    pub(crate) projection: Projection,
    /// Camera-plane coordinates of a picture point: `scale * point + offset`, on the plane at distance 1 for
    /// perspective.
    pub(crate) scale: Vec2,
    pub(crate) offset: Vec2,
    pub(crate) filter: FilterSampler,
    /// Unit viewing direction in world space.
    pub(crate) axis: Vec3,
    /// Whether rays have a time each.
    has_shutter: bool,
    /// Of a camera that moves while the shutter is open: what it is at the shutter's keys.
    keys: Vec<CameraRays>,
}

/// The random numbers that a camera ray needs, all in [0, 1).
#[derive(Clone, Copy, Debug)]
pub struct CameraRandom {
    /// Place within the pixel filter.
    pub filter: Vec2,
    /// Place on the lens.
    pub lens: Vec2,
    /// Time in the shutter interval.
    pub time: f32,
}

impl CameraRays {
    /// Prepares the camera of `settings`.
    #[must_use]
    pub fn new(settings: &RenderSettings) -> Self {
        let cameras = &settings.camera_keys;
        let moves = cameras.windows(2).any(|ends| ends[0] != ends[1]);
        let keys = if moves { &cameras[..] } else { &[] };
        Self {
            has_shutter: !cameras.is_empty(),
            keys: keys.iter().map(|camera| Self::of(camera, settings)).collect(),
            ..Self::of(&settings.camera, settings)
        }
    }

    /// A camera that stands still, with the size and the filter of `settings`.
    fn of(camera: &Camera, settings: &RenderSettings) -> Self {
        let (width, height) = (settings.width.max(1) as f32, settings.height.max(1) as f32);
        let projection = camera.projection;
        let half_height = match projection {
            Projection::Perspective { vertical_fov, .. } => real::tan(vertical_fov.clamp(1e-6, 3.1) * 0.5),
            Projection::Orthographic { half_height } => half_height,
        };
        let half = Vec2::new(half_height * width / height, half_height);
        let world_from_camera = camera.world_from_camera;
        Self {
            world_from_camera,
            projection,
            scale: Vec2::new(2.0 * half.x / width, -2.0 * half.y / height),
            offset: Vec2::new(-half.x, half.y),
            filter: FilterSampler::new(settings.filter),
            axis: world_from_camera.transform_vector3(Vec3::NEG_Z).normalize_or(Vec3::NEG_Z),
            has_shutter: false,
            keys: Vec::new(),
        }
    }

    /// The random numbers of a ray, from the sampler's first dimensions: filter, lens, time. A camera without a lens draws
    /// none for it; without an open shutter all rays have time 0.
    #[inline]
    #[must_use]
    pub fn draw(&self, mut sampler: Sampler) -> CameraRandom {
        let time = if self.has_shutter { sampler.at_dimension(TIME_DIMENSION).next_1d() } else { 0.0 };
        let filter = sampler.next_2d();
        let has_lens =
            matches!(self.projection, Projection::Perspective { lens_radius, .. } if lens_radius > 0.0);
        CameraRandom { filter, lens: if has_lens { sampler.next_2d() } else { Vec2::ZERO }, time }
    }

    /// A ray through `pixel` (column, row from the top) with a unit direction in world space.
    #[inline(always)]
    #[must_use]
    pub fn ray(&self, pixel: [u32; 2], random: CameraRandom) -> Ray {
        if self.keys.is_empty() { self.still_ray(pixel, random) } else { self.moving_ray(pixel, random) }
    }

    /// The ray of a camera that moves, between those of its keys.
    #[inline(never)]
    fn moving_ray(&self, pixel: [u32; 2], random: CameraRandom) -> Ray {
        let between = Between::new(random.time, self.keys.len());
        let Some(ends) = between.ends(&self.keys) else { return self.still_ray(pixel, random) };
        let [a, b] = ends.map(|camera| camera.still_ray(pixel, random));
        let direction = between.blend(a.direction, b.direction).normalize_or(a.direction);
        Ray { origin: between.blend(a.origin, b.origin), direction, ..a }
    }

    #[inline(always)]
    fn still_ray(&self, pixel: [u32; 2], random: CameraRandom) -> Ray {
        let center = Vec2::new(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5);
        let plane = (center + self.filter.sample(random.filter)) * self.scale + self.offset;
        let (origin, direction) = match self.projection {
            Projection::Perspective { lens_radius, focus_distance, .. } => {
                thin_lens(plane, lens_radius, focus_distance, random.lens)
            }
            Projection::Orthographic { .. } => (plane.extend(0.0), Vec3::NEG_Z),
        };
        Ray {
            origin: self.world_from_camera.transform_point3(origin),
            t_min: 0.0,
            direction: self.world_from_camera.transform_vector3(direction).normalize_or(self.axis),
            t_max: FAR,
            time: random.time,
        }
    }

    /// How a point of a plane at `t` on a ray of this camera moves from column to column and from row to row; none where the plane is
    /// seen almost edge-on. `normal` is the plane's.
    pub(crate) fn steps(&self, ray: &Ray, t: f32, normal: Vec3) -> Option<[Vec3; 2]> {
        let across = ray.direction.dot(normal);
        if across.abs() < EDGE_ON {
            return None;
        }
        let (along, reach) = (
            ray.direction / across,
            match self.projection {
                Projection::Perspective { .. } => self.depth(ray, t),
                Projection::Orthographic { .. } => 1.0,
            },
        );
        let on_plane = |axis: Vec3| {
            let step = self.world_from_camera.transform_vector3(axis) * reach;
            step - along * step.dot(normal)
        };
        Some([on_plane(Vec3::X * self.scale.x), on_plane(Vec3::Y * self.scale.y)])
    }

    /// The cone of every ray.
    #[inline]
    pub(crate) fn cone(&self) -> Cone {
        let size = self.scale.x.abs().max(self.scale.y.abs()) * PIXEL_PART;
        match self.projection {
            Projection::Perspective { .. } => Cone { width: 0.0, spread: size },
            Projection::Orthographic { .. } => Cone { width: size, spread: 0.0 },
        }
    }

    /// Distance from the camera's plane along its viewing axis of the point at `t` on a ray of this camera.
    #[inline]
    #[must_use]
    pub fn depth(&self, ray: &Ray, t: f32) -> f32 {
        t * ray.direction.dot(if self.keys.is_empty() { self.axis } else { self.axis_at(ray.time) })
    }

    /// The viewing axis of a camera that moves, at a time.
    fn axis_at(&self, time: f32) -> Vec3 {
        let between = Between::new(time, self.keys.len());
        let blended = |[a, b]: [&Self; 2]| between.blend(a.axis, b.axis).normalize_or(a.axis);
        between.ends(&self.keys).map_or(self.axis, blended)
    }
}

/// Origin on the lens and direction towards the point in focus, in camera space.
#[inline]
fn thin_lens(plane: Vec2, lens_radius: f32, focus_distance: f32, u: Vec2) -> (Vec3, Vec3) {
    let pinhole = plane.extend(-1.0);
    if lens_radius <= 0.0 {
        return (Vec3::ZERO, pinhole);
    }
    let lens = (warp::concentric_disk(u) * lens_radius).extend(0.0);
    (lens, pinhole * focus_distance - lens)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pixel_filter::PixelFilter;

    fn settings(projection: Projection) -> RenderSettings {
        let mut camera = Camera::look_at("c", Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, 1.0);
        camera.projection = projection;
        RenderSettings { filter: PixelFilter::Box, ..RenderSettings::new(camera, 40, 20) }
    }

    fn random(filter: f32, lens: Vec2) -> CameraRandom {
        CameraRandom { filter: Vec2::splat(filter), lens, time: 0.25 }
    }

    const PINHOLE: Projection =
        Projection::Perspective { vertical_fov: 1.0, lens_radius: 0.0, focus_distance: 5.0 };

    #[test]
    fn corners_of_the_picture_see_the_corners_of_the_field_of_view() {
        let rays = CameraRays::new(&settings(PINHOLE));
        let top_left = rays.ray([0, 0], random(0.0, Vec2::ZERO));
        let expected = Vec3::new(-2.0 * real::tan(0.5), real::tan(0.5), -1.0).normalize();
        assert!((top_left.direction - expected).length() < 1e-5, "{top_left:?}");
        let top_right = rays.ray([39, 0], random(0.999_999, Vec2::ZERO));
        assert!(top_right.direction.x > 0.0 && (top_right.time, top_right.origin.z) == (0.25, 5.0));
        assert!((rays.depth(&top_left, 2.0) - 2.0 * -expected.z).abs() < 1e-5);
    }

    #[test]
    fn orthographic_rays_are_parallel_and_span_the_height() {
        let rays = CameraRays::new(&settings(Projection::Orthographic { half_height: 3.0 }));
        let ray = rays.ray([0, 0], random(0.0, Vec2::ZERO));
        assert!((ray.origin - Vec3::new(-6.0, 3.0, 5.0)).length() < 1e-5);
        assert_eq!(ray.direction, Vec3::NEG_Z);
    }

    /// From where a ray off the middle meets a plane, the steps lead back to where the middle's ray does.
    #[test]
    fn steps_lead_from_pixel_to_pixel_on_a_plane() {
        let lens = Projection::Perspective { vertical_fov: 1.0, lens_radius: 0.3, focus_distance: 4.0 };
        for projection in [PINHOLE, lens, Projection::Orthographic { half_height: 3.0 }] {
            let rays = CameraRays::new(&settings(projection));
            let normal = Vec3::new(0.4, 0.3, 1.0).normalize();
            let meet = |filter: Vec2| {
                let ray = rays.ray([31, 4], CameraRandom { filter, lens: Vec2::new(0.7, 0.2), time: 0.0 });
                let t = (Vec3::new(0.0, 0.0, 1.0) - ray.origin).dot(normal) / ray.direction.dot(normal);
                (ray, t)
            };
            let (ray, t) = meet(Vec2::new(0.9, 0.3));
            let [column, row] = rays.steps(&ray, t, normal).expect("seen well");
            let (middle, t_middle) = meet(Vec2::splat(0.5));
            let apart = ray.at(t) - column * 0.4 + row * 0.2 - middle.at(t_middle);
            // The box filter's offsets are what the numbers say.
            assert!(apart.length() < 0.02 * column.length(), "{projection:?} {apart} {column} {row}");
            assert!(rays.steps(&ray, t, ray.direction.cross(Vec3::X).normalize()).is_none(), "edge-on");
        }
    }

    /// A point at distance `z` is blurred into a disc of radius `R |z - f| / f` on the plane through it.
    #[test]
    fn circle_of_confusion_has_the_thin_lens_radius() {
        let (radius, focus) = (0.2, 4.0);
        let lens = Projection::Perspective { vertical_fov: 1.0, lens_radius: radius, focus_distance: focus };
        let blurred = CameraRays::new(&settings(lens));
        let sharp = CameraRays::new(&settings(PINHOLE));
        for z in [1.0_f32, 4.0, 10.0] {
            let at = |rays: &CameraRays, u: Vec2| {
                let ray = rays.ray([31, 4], random(0.5, u));
                ray.at(z / -ray.direction.z)
            };
            let center = at(&sharp, Vec2::ZERO);
            let spread = (0..4096)
                .map(|i| Vec2::new((i % 64) as f32 / 63.001, (i / 64) as f32 / 63.001))
                .map(|u| (at(&blurred, u) - center).length())
                .fold(0.0, f32::max);
            let expected = radius * (z - focus).abs() / focus;
            assert!((spread - expected).abs() < 2e-3 * radius.max(expected), "{z} {spread} {expected}");
        }
    }
}
