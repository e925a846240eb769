//! Lights at a place: emissive triangles, point and spot lights, in one light tree.

use super::LightSample;
use super::emitters::{Emitter, Emitters, NONE, is_similarity};
use super::punctual::PunctualLight;
use super::tree::{Item, LightTree, NO_TRAIL};
use crate::material::MaterialTable;
use vastlight_math::{Vec2, Vec3};
use vastlight_scene::Scene;

#[derive(Clone, Debug)]
pub(super) struct LocalLights<'a> {
    surfaces: Emitters<'a>,
    punctual: Vec<PunctualLight>,
    emitters: Vec<Emitter>,
    trails: Vec<u64>,
    tree: LightTree,
}

impl<'a> LocalLights<'a> {
    pub(super) fn new(scene: &'a Scene, materials: &'a MaterialTable<'a>, flat_limit: u64) -> Self {
        let (mut emitters, mut items) = (Vec::new(), Vec::new());
        let surfaces = Emitters::new(scene, materials, flat_limit, &mut emitters, &mut items);
        let punctual: Vec<_> = scene.lights().iter().filter_map(PunctualLight::new).collect();
        for (i, light) in punctual.iter().enumerate() {
            let bounds = light.bounds();
            if bounds.intensity > 0.0 {
                let number = emitters.len() as u32;
                items.push(Item {
                    bounds,
                    center: light.position,
                    radius: 0.0,
                    light: number,
                    planar: false,
                });
                emitters.push(Emitter { instance: NONE, index: i as u32 });
            }
        }
        let mut trails = vec![NO_TRAIL; emitters.len()];
        let tree = LightTree::build(items, &mut trails);
        Self { surfaces, punctual, emitters, trails, tree }
    }

    /// Number of leaves of the world-space tree.
    pub(super) fn len(&self) -> usize {
        self.emitters.len()
    }

    pub(super) fn bytes(&self) -> usize {
        self.surfaces.bytes() + self.tree.bytes() + self.emitters.len() * size_of::<(Emitter, u64)>()
    }

    /// An estimate of the irradiance from all of them; zero where none can matter.
    #[inline]
    pub(super) fn importance(&self, from: Vec3, normal: Vec3) -> f32 {
        self.tree.importance(from, normal)
    }

    /// Chooses a light and a point on it. The density does not include the choice of local lights over others.
    pub(super) fn sample(&self, from: Vec3, normal: Vec3, u_pick: f32, u: Vec2) -> Option<LightSample> {
        let choice = self.tree.sample(from, normal, u_pick, true)?;
        let emitter = self.emitters[choice.light as usize];
        if emitter.instance == NONE {
            return self.sample_punctual(&self.punctual[emitter.index as usize], from, choice.probability);
        }
        let (triangle, probability) = if emitter.index == NONE {
            let (triangle, p) = self.choose_in_shared(emitter.instance, from, normal, choice.u)?;
            (triangle, p * choice.probability)
        } else {
            (emitter.index, choice.probability)
        };
        let light = self.surfaces.light(emitter.instance, triangle)?;
        let point = light.shape.sample(from, u)?;
        let radiance = self.surfaces.radiance(&light, from, point.barycentric);
        (radiance != Vec3::ZERO).then_some(LightSample {
            wi: point.wi,
            distance: point.distance,
            radiance,
            pdf: point.pdf * probability,
            delta: false,
        })
    }

    fn choose_in_shared(&self, instance: u32, from: Vec3, normal: Vec3, u: f32) -> Option<(u32, f32)> {
        let mesh = self.surfaces.mesh_of(instance);
        let (from, normal, similar) = self.in_object(instance, from, normal);
        let choice = mesh.shared.as_ref()?.tree.sample(from, normal, u, similar)?;
        Some((mesh.triangle(choice.light), choice.probability))
    }

    /// Point and plane normal in object space, and whether the map keeps angles.
    fn in_object(&self, instance: u32, from: Vec3, normal: Vec3) -> (Vec3, Vec3, bool) {
        let map = self.surfaces.world_from_object(instance);
        let from = map.inverse().transform_point3(from);
        let normal: Vec3 = (map.matrix3.transpose() * normal).normalize_or_zero();
        (from, normal, is_similarity(map))
    }

    fn sample_punctual(&self, light: &PunctualLight, from: Vec3, probability: f32) -> Option<LightSample> {
        let to_light = light.position - from;
        let distance = to_light.length();
        let wi = to_light / distance;
        if !wi.is_finite() {
            return None;
        }
        let radiance = light.intensity(-wi) * (light.window(distance) / (distance * distance));
        (radiance != Vec3::ZERO && radiance.is_finite()).then_some(LightSample {
            wi,
            distance,
            radiance,
            pdf: probability,
            delta: true,
        })
    }

    /// Density over solid angle with which [`LocalLights::sample`] finds a point of a surface.
    pub(super) fn pdf(&self, from: Vec3, normal: Vec3, instance: u32, triangle: u32, position: Vec3) -> f32 {
        let Some((place, shared)) = self.surfaces.find(instance, triangle) else { return 0.0 };
        let mut probability = self.tree.probability(self.trails[place as usize], from, normal, true);
        if let Some((number, tree)) = shared.zip(self.surfaces.mesh_of(instance).shared.as_ref()) {
            let (from, normal, similar) = self.in_object(instance, from, normal);
            probability *= tree.tree.probability(tree.trails[number as usize], from, normal, similar);
        }
        if probability <= 0.0 {
            return 0.0;
        }
        self.surfaces.light(instance, triangle).map_or(0.0, |l| probability * l.shape.pdf(from, position))
    }
}
