//! Lights at a place: emissive triangles, point and spot lights, in one light tree.

use super::punctual::PunctualLight;
use super::surfaces::{PlainTriangle, Surfaces};
use super::tree::{Choice, Estimate, EstimateLanes, Item, LightTree, NO_TRAIL, pack_trails};
use super::{LightSample, ies};
use crate::material::MaterialTable;
use crate::words::{Words, lights};
use std::sync::Arc;
use vastlight_math::lanes::Lanes3;
use vastlight_math::{Vec2, Vec3};
use vastlight_scene::{IesProfile, Scene};

/// All lights at a place. The tree's light numbers are those of the surfaces, then those of the others.
#[derive(Clone, Debug)]
pub(super) struct LocalLights<'a> {
    surfaces: Surfaces<'a>,
    punctual: Vec<PunctualLight>,
    trails: Vec<u64>,
    tree: LightTree,
}

impl<'a> LocalLights<'a> {
    pub(super) fn new(scene: &'a Scene, materials: &'a MaterialTable<'a>, flat_limit: u64) -> Self {
        let mut items = Vec::new();
        let surfaces = Surfaces::new(scene, materials, flat_limit, &mut items);
        let lights = scene.lights().iter().filter_map(PunctualLight::new);
        let punctual: Vec<_> = lights.filter(|l| l.bounds().intensity > 0.0).collect();
        items.extend(punctual.iter().enumerate().map(|(i, light)| Item {
            bounds: light.bounds(),
            center: light.position,
            radius: 0.0,
            light: (surfaces.len() + i) as u32,
            planar: false,
        }));
        let mut trails = vec![NO_TRAIL; surfaces.len() + punctual.len()];
        let tree = LightTree::build(items, &mut trails);
        Self { surfaces, punctual, trails, tree }
    }

    /// Those without surface.
    pub(super) fn punctual(&self) -> &[PunctualLight] {
        &self.punctual
    }

    /// Number of lights, where an instance with a shared tree counts as one.
    pub(super) fn len(&self) -> usize {
        self.trails.len()
    }

    pub(super) fn bytes(&self) -> usize {
        self.surfaces.bytes() + self.tree.bytes() + self.trails.len() * 8
    }

    /// Appends all of them and their tree.
    pub(super) fn pack(&self, words: &mut Words) {
        let [nodes, few] = self.tree.pack(words);
        words.set(lights::TREE, nodes);
        words.set(lights::TREE + 1, few);
        words.section(lights::TRAILS);
        pack_trails(&self.trails, words);
        self.surfaces.pack(words);
        let profiles = self.pack_profiles(words);
        words.section(lights::PUNCTUAL);
        for (light, profile) in self.punctual.iter().zip(profiles) {
            light.pack(profile, words);
        }
    }

    /// Appends the profiles, those of lights that follow each other once. Gives each light's, 0 for none.
    fn pack_profiles(&self, words: &mut Words) -> Vec<u32> {
        let mut last: Option<(&Arc<IesProfile>, u32)> = None;
        let mut places = Vec::with_capacity(self.punctual.len());
        for profile in self.punctual.iter().map(PunctualLight::profile) {
            let known = last.filter(|(known, _)| profile.is_some_and(|profile| Arc::ptr_eq(known, profile)));
            let place = match (known, profile) {
                (Some((_, place)), _) => place,
                (None, None) => 0,
                (None, Some(profile)) => ies::pack(profile, words),
            };
            places.push(place);
            last = profile.map(|profile| (profile, place));
        }
        places
    }

    /// An estimate of the irradiance from all of them; its total is zero where none can matter.
    #[inline(always)]
    pub(super) fn estimate(&self, from: Vec3, normal: Vec3) -> Estimate {
        self.tree.estimate(from, normal, true)
    }

    /// Chooses a light and a point on it. The density does not include the choice of local lights over others.
    #[inline(always)]
    pub(super) fn sample(
        &self,
        estimate: &Estimate,
        from: Vec3,
        normal: Vec3,
        u_pick: f32,
        at: (Vec2, f32),
    ) -> Option<LightSample> {
        let choice = self.choose(estimate, from, normal, u_pick)?;
        self.sample_chosen(&choice, from, normal, at)
    }

    /// [`LocalLights::estimate`] by lane.
    #[inline(always)]
    pub(super) fn estimate_lanes(&self, from: &Lanes3, normal: &Lanes3) -> EstimateLanes {
        self.tree.estimate_lanes(from, normal)
    }

    /// The first step of [`LocalLights::sample`]: chooses a light.
    #[inline(always)]
    pub(super) fn choose(
        &self,
        estimate: &Estimate,
        from: Vec3,
        normal: Vec3,
        u_pick: f32,
    ) -> Option<Choice> {
        self.tree.sample(estimate, from, normal, u_pick, true)
    }

    /// The chosen light if it is a triangle that shines alike everywhere.
    #[inline(always)]
    pub(super) fn plain_triangle(&self, choice: &Choice) -> Option<PlainTriangle<'_>> {
        self.surfaces.plain_triangle(choice.light)
    }

    /// The second step of [`LocalLights::sample`]: chooses a point on the light by two numbers, at a time.
    #[inline(always)]
    pub(super) fn sample_chosen(
        &self,
        choice: &Choice,
        from: Vec3,
        normal: Vec3,
        at: (Vec2, f32),
    ) -> Option<LightSample> {
        if let Some(punctual) = (choice.light as usize).checked_sub(self.surfaces.len()) {
            return sample_punctual(&self.punctual[punctual], from, choice.probability);
        }
        let found = self.surfaces.sample(choice, from, normal, at)?;
        (found.radiance != Vec3::ZERO).then_some(LightSample {
            wi: found.point.wi,
            distance: found.point.distance,
            radiance: found.radiance,
            pdf: found.point.pdf * found.probability,
            delta: false,
        })
    }

    /// Density over solid angle with which [`LocalLights::sample`] finds a point of a surface at a time.
    #[inline]
    pub(super) fn pdf(
        &self,
        from: Vec3,
        normal: Vec3,
        (instance, triangle): (u32, u32),
        at: (Vec3, f32),
    ) -> f32 {
        let Some(found) = self.surfaces.find(instance, triangle) else { return 0.0 };
        let trail = self.trails[found.0 as usize];
        let estimate = self.estimate(from, normal);
        let probability = self.tree.probability(&estimate, trail, from, normal, true);
        if probability <= 0.0 {
            return 0.0;
        }
        probability * self.surfaces.pdf(found, triangle, from, normal, at)
    }
}

fn sample_punctual(light: &PunctualLight, from: Vec3, probability: f32) -> Option<LightSample> {
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
