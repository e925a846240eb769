//! Changes to the looks of a scene: what sliders say, as the text of an override file.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use vastlight::{Error, Overrides};

/// Most names that are changed.
const MOST: usize = 1000;

/// All changes since a scene was opened, by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Edits {
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) materials: BTreeMap<String, MaterialEdit>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) lights: BTreeMap<String, LightEdit>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) environment: Option<EnvironmentEdit>,
}

/// New values of a material.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MaterialEdit {
    #[serde(skip_serializing_if = "Option::is_none")]
    base_color: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    roughness: Option<f32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    metallic: Option<f32>,
}

/// How much brighter a light is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LightEdit {
    pub(crate) scale: f32,
}

/// How much brighter the environment is, and how far it is turned, degrees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EnvironmentEdit {
    rotation: f32,
    strength: f32,
}

impl MaterialEdit {
    pub(crate) fn check(&self) -> Result<(), String> {
        let numbers = self.base_color.into_iter().flatten().chain(self.roughness).chain(self.metallic);
        for number in numbers {
            if !(0.0..=1.0).contains(&number) {
                return Err("colours, roughness and metalness are 0 to 1".to_owned());
            }
        }
        Ok(())
    }

    /// The change with that of `other` on top.
    fn with(self, other: Self) -> Self {
        Self {
            base_color: other.base_color.or(self.base_color),
            roughness: other.roughness.or(self.roughness),
            metallic: other.metallic.or(self.metallic),
        }
    }
}

impl LightEdit {
    pub(crate) fn check(&self) -> Result<(), String> {
        check_scale(self.scale)
    }
}

impl EnvironmentEdit {
    pub(crate) fn check(&self) -> Result<(), String> {
        match self.rotation.is_finite() {
            true => check_scale(self.strength),
            false => Err("the rotation must be finite".to_owned()),
        }
    }
}

fn check_scale(scale: f32) -> Result<(), String> {
    match (0.0..=1e6).contains(&scale) {
        true => Ok(()),
        false => Err("brightness is 0 to 1000000 times".to_owned()),
    }
}

impl Edits {
    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    pub(crate) fn edit_material(&mut self, name: String, edit: MaterialEdit) {
        if self.materials.len() < MOST || self.materials.contains_key(&name) {
            let known = self.materials.entry(name).or_default();
            *known = known.with(edit);
        }
    }

    pub(crate) fn edit_light(&mut self, name: String, edit: LightEdit) {
        if self.lights.len() < MOST || self.lights.contains_key(&name) {
            self.lights.insert(name, edit);
        }
    }

    /// The text of an override file that does the same.
    pub(crate) fn text(&self) -> String {
        toml::to_string(self).unwrap_or_default()
    }

    /// The changes, for a scene.
    pub(crate) fn overrides(&self) -> Result<Overrides, Error> {
        Overrides::parse(&self.text(), "the page's changes")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_add_up_to_an_override_file() {
        let mut edits = Edits::default();
        assert_eq!(edits.text(), "");
        let rough = MaterialEdit { roughness: Some(0.25), ..MaterialEdit::default() };
        let red = MaterialEdit { base_color: Some([1.0, 0.0, 0.0]), ..MaterialEdit::default() };
        edits.edit_material("A \"b\"\n".into(), rough);
        edits.edit_material("A \"b\"\n".into(), red);
        edits.edit_light(String::new(), LightEdit { scale: 2.0 });
        edits.environment = Some(EnvironmentEdit { rotation: 90.0, strength: 0.5 });
        let text = edits.text();
        assert!(text.contains("roughness = 0.25") && text.contains("base_color = [1.0, 0.0, 0.0]"), "{text}");
        assert_ne!(edits.overrides().expect("parsed"), Overrides::default());
        assert!(MaterialEdit { roughness: Some(f32::NAN), ..rough }.check().is_err());
    }
}
