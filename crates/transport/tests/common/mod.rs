//! Scenes and statistics that several tests share.
#![allow(dead_code, reason = "every test file uses its own part of this module")]

pub(crate) mod reference;
pub(crate) mod shapes;

use vastlight_math::{Affine3, Vec3};
use vastlight_scene::{Camera, Environment, Instance, Material, Mesh, Projection, Scene, SceneDesc};
use vastlight_trace::{Tracer, TracerConfig};
use vastlight_transport::{Lights, MaterialTable, RenderSettings, RenderStats, Renderer, Sample};

/// A scene in the making.
#[derive(Default)]
pub(crate) struct Build {
    pub(crate) desc: SceneDesc,
}

impl Build {
    /// A scene in a constant environment.
    pub(crate) fn in_light(radiance: Vec3) -> Self {
        let desc = SceneDesc { environment: Some(Environment::Constant(radiance)), ..SceneDesc::default() };
        Self { desc }
    }

    /// Adds `mesh` with `material` at `place`.
    pub(crate) fn add(&mut self, mesh: Mesh, material: Material, place: Affine3) -> &mut Self {
        let id = self.desc.materials.len() as u32;
        self.desc.materials.push(material);
        self.add_with(mesh, id, place)
    }

    /// Adds `mesh` with a material that is there already.
    pub(crate) fn add_with(&mut self, mut mesh: Mesh, material: u32, place: Affine3) -> &mut Self {
        mesh.parts = vec![vastlight_scene::Part { first_triangle: 0, material }];
        let id = self.desc.meshes.len() as u32;
        self.desc.meshes.push(mesh);
        self.desc.instances.push(Instance { world_from_object: place, mesh: id, name: 0 });
        self
    }

    pub(crate) fn finish(&mut self) -> Scene {
        Scene::new(std::mem::take(&mut self.desc)).expect("a valid scene")
    }
}

/// A pinhole camera.
pub(crate) fn look_at(eye: Vec3, target: Vec3, vertical_fov: f32) -> Camera {
    Camera::look_at("test", eye, target, vertical_fov)
}

/// A camera with parallel rays whose picture is `2 * half_height` high.
pub(crate) fn orthographic(eye: Vec3, target: Vec3, half_height: f32) -> Camera {
    Camera { projection: Projection::Orthographic { half_height }, ..look_at(eye, target, 1.0) }
}

/// Per-pixel means and variances (of one sample), rows from the top.
pub(crate) struct Picture {
    pub(crate) width: u32,
    pub(crate) samples: u32,
    pub(crate) mean: Vec<[f64; 3]>,
    pub(crate) variance: Vec<[f64; 3]>,
    /// The material that all samples of a pixel saw first, if it was one.
    pub(crate) material: Vec<Option<u32>>,
    pub(crate) stats: RenderStats,
}

impl Picture {
    /// Mean over all pixels and channels.
    pub(crate) fn average(&self) -> f64 {
        self.mean.iter().flatten().sum::<f64>() / (3 * self.mean.len()) as f64
    }

    /// Mean over all pixels.
    pub(crate) fn color(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.mean.iter().map(|m| m[c]).sum::<f64>() / self.mean.len() as f64)
    }

    /// Standard error of [`Picture::average`], from the samples' variance. Stratification makes the true error smaller.
    pub(crate) fn standard_error(&self) -> f64 {
        let sum: f64 = self.variance.iter().flatten().sum();
        (sum / f64::from(self.samples)).sqrt() / (3 * self.mean.len()) as f64
    }
}

/// Calls `with` with a renderer of `scene`.
pub(crate) fn with_renderer<T>(
    scene: &Scene,
    settings: RenderSettings,
    with: impl FnOnce(&Renderer<'_>) -> T,
) -> T {
    with_renderer_over("", scene, settings, with)
}

/// Calls `with` with a renderer of `scene` over the structure `accel`.
pub(crate) fn with_renderer_over<T>(
    accel: &str,
    scene: &Scene,
    settings: RenderSettings,
    with: impl FnOnce(&Renderer<'_>) -> T,
) -> T {
    let config = TracerConfig { accel: accel.into(), ..TracerConfig::default() };
    let tracer = Tracer::new(scene, &config).expect("a tracer");
    let materials = MaterialTable::new(scene);
    let lights = Lights::new(scene, &materials);
    with(&Renderer::new(scene, &tracer, &materials, &lights, settings))
}

/// Renders the whole picture on this thread.
pub(crate) fn render(scene: &Scene, settings: &RenderSettings, samples: u32) -> Picture {
    let region = settings.region();
    let count = region.pixels() as usize;
    let mut sum = vec![[0.0_f64; 3]; count];
    let mut squares = vec![[0.0_f64; 3]; count];
    let mut material: Vec<Option<Option<u32>>> = vec![None; count];
    let mut sink = |pixel: [u32; 2], sample: &Sample| {
        let place = ((pixel[1] - region.min[1]) * region.width() + pixel[0] - region.min[0]) as usize;
        let seen = material[place].get_or_insert(Some(sample.material));
        *seen = seen.filter(|&m| m == sample.material);
        for (c, value) in sample.radiance.to_array().into_iter().enumerate() {
            sum[place][c] += f64::from(value);
            squares[place][c] += f64::from(value).powi(2);
        }
    };
    let stats = with_renderer(scene, settings.clone(), |r| {
        r.render_tile(region, 0..samples, &mut sink).expect("in memory")
    });
    let n = f64::from(samples);
    let mean: Vec<[f64; 3]> = sum.iter().map(|s| s.map(|x| x / n)).collect();
    let variance = |(q, m): (&[f64; 3], &[f64; 3])| {
        std::array::from_fn(|c| ((q[c] / n - m[c] * m[c]) * n / (n - 1.0)).max(0.0))
    };
    let variance = squares.iter().zip(&mean).map(variance).collect();
    let material = material.into_iter().map(Option::flatten).collect();
    Picture { width: region.width(), samples, mean, variance, material, stats }
}

/// Asserts that `found` is within `relative` of `expected`.
#[track_caller]
pub(crate) fn assert_close(found: f64, expected: f64, relative: f64, what: &str) {
    let error = (found / expected - 1.0).abs();
    assert!(error <= relative, "{what}: found {found}, expected {expected}, off by {:.3} %", error * 100.0);
}
