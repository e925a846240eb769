//! Ids of objects and materials for the mattes.

use vastlight_film::{Aov, Cryptomatte, Film, name_hash};
use vastlight_scene::Scene;

/// The matte ids of a scene. Empty tables where no matte is asked for.
#[derive(Debug, Default)]
pub(crate) struct Ids {
    object_of_instance: Vec<u32>,
    object_matte: Option<Cryptomatte>,
    material: Vec<u32>,
    material_matte: Option<Cryptomatte>,
}

impl Ids {
    pub(crate) fn new(scene: &Scene, aovs: &[Aov]) -> Self {
        let mut ids = Self::default();
        if aovs.contains(&Aov::Object) {
            let names =
                || (0..scene.instances().len() as u32).map(|i| named(scene.instance_name(i), "object"));
            ids.object_of_instance = names().map(name_hash).collect();
            ids.object_matte = Some(Cryptomatte::new(Film::OBJECT_LAYER, names()));
        }
        if aovs.contains(&Aov::Material) {
            let names = || scene.materials().iter().map(|m| named(&m.name, "material"));
            ids.material = names().map(name_hash).collect();
            ids.material_matte = Some(Cryptomatte::new(Film::MATERIAL_LAYER, names()));
        }
        ids
    }

    /// The id of an instance; 0 for none.
    #[inline]
    pub(crate) fn object(&self, instance: u32) -> u32 {
        self.object_of_instance.get(instance as usize).copied().unwrap_or(0)
    }

    /// The id of a material; 0 for none.
    #[inline]
    pub(crate) fn material(&self, material: u32) -> u32 {
        self.material.get(material as usize).copied().unwrap_or(0)
    }

    /// The layers in the order of the film's planes.
    pub(crate) fn mattes(&self) -> Vec<Cryptomatte> {
        self.object_matte.iter().chain(&self.material_matte).cloned().collect()
    }
}

fn named<'a>(name: &'a str, otherwise: &'a str) -> &'a str {
    if name.is_empty() { otherwise } else { name }
}
