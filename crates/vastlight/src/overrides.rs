//! Changes to a scene from a TOML file: materials, lights and environment by name.
//!
//! ```toml
//! [materials.Wood]            # by the name in the file; "*" changes every material
//! base_color = [0.5, 0.3, 0.2]
//! roughness = 0.3             # a number given here replaces the texture of the same input
//!
//! [lights.Lamp]
//! intensity = [50.0, 45.0, 40.0]
//! ies = "downlight.ies"       # beside this file
//!
//! [environment]
//! map = "studio.hdr"          # beside this file; or color = [r, g, b], or sun = [azimuth, elevation]
//! strength = 1.5
//! rotation = 90.0             # degrees
//! ```
//!
//! Colours are linear Rec. 709. A name or key that is not there is an error that lists what is.

mod files;
mod ranges;

pub(crate) use files::Files;

use crate::{Error, environment};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use vastlight_math::Vec3;
use vastlight_scene::{
    AlphaMode, ColorInput, Conductor, Environment, IesProfile, Light, Material, ScalarInput, SceneDesc,
};

/// The parsed file.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Overrides {
    /// Changes by material name; `*` stands for all.
    #[serde(default)]
    materials: BTreeMap<String, MaterialOverride>,
    /// Changes by light name; `*` stands for all.
    #[serde(default)]
    lights: BTreeMap<String, LightOverride>,
    /// Change of the environment.
    environment: Option<EnvironmentOverride>,
    /// The file's folder; maps are looked for there.
    #[serde(skip)]
    folder: PathBuf,
    /// The file, for messages.
    #[serde(skip)]
    place: String,
}

/// New values of a material; see [`Material`] for their meaning and units.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialOverride {
    base_color: Option<[f32; 3]>,
    alpha: Option<f32>,
    metal: Option<MeasuredMetal>,
    metallic: Option<f32>,
    roughness: Option<f32>,
    emission: Option<[f32; 3]>,
    ior: Option<f32>,
    specular: Option<f32>,
    specular_color: Option<[f32; 3]>,
    transmission: Option<f32>,
    thickness: Option<f32>,
    attenuation_color: Option<[f32; 3]>,
    attenuation_distance: Option<f32>,
    dispersion: Option<f32>,
    clearcoat: Option<f32>,
    clearcoat_roughness: Option<f32>,
    sheen_color: Option<[f32; 3]>,
    sheen_roughness: Option<f32>,
    anisotropy: Option<f32>,
    iridescence: Option<f32>,
    double_sided: Option<bool>,
    normal_map: Option<bool>,
}

/// A measured metal by its name.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(try_from = "String")]
struct MeasuredMetal(Conductor);

impl TryFrom<String> for MeasuredMetal {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let known = || Conductor::names().collect::<Vec<_>>().join(", ");
        Conductor::named(&name)
            .map(Self)
            .ok_or_else(|| format!("no metal is named \"{name}\", there are {}", known()))
    }
}

/// New values of a light.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct LightOverride {
    /// Radiant intensity (W/sr) or irradiance (W/m^2).
    intensity: Option<[f32; 3]>,
    /// Multiplies the intensity.
    scale: Option<f32>,
    /// An IES file whose distribution, with its peak at 1, multiplies the intensity of a point or spot light.
    ies: Option<PathBuf>,
}

/// New values of the environment.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct EnvironmentOverride {
    map: Option<PathBuf>,
    color: Option<[f32; 3]>,
    sun: Option<[f32; 2]>,
    turbidity: Option<f32>,
    strength: Option<f32>,
    rotation: Option<f32>,
}

impl Overrides {
    /// Reads a TOML file.
    ///
    /// # Errors
    /// If it cannot be read, is no TOML, or has keys or numbers that mean nothing.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let place = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| Error::scene(e.to_string(), &place, ""))?;
        let mut overrides = Self::parse(&text, &place)?;
        overrides.folder = path.parent().map(Path::to_owned).unwrap_or_default();
        Ok(overrides)
    }

    /// Reads the text of a TOML file; `place` names it in messages.
    ///
    /// # Errors
    /// If it is no TOML, or has keys or numbers that mean nothing.
    pub fn parse(text: &str, place: &str) -> Result<Self, Error> {
        let parsed: Self = toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(1, |s| text[..s.start.min(text.len())].matches('\n').count() + 1);
            Error::scene(e.message().replace('\n', "; "), format!("{place}:{line}"), "")
        })?;
        parsed.checked(place)
    }

    /// The same with its place, if its numbers mean something.
    fn checked(self, place: &str) -> Result<Self, Error> {
        match self.wrong() {
            Some(what) => Err(Error::scene(what, place, "see docs/overrides.md")),
            None => Ok(Self { place: place.to_owned(), ..self }),
        }
    }

    /// What is wrong with a number, if anything.
    fn wrong(&self) -> Option<String> {
        let materials =
            self.materials.iter().map(|(name, change)| (format!("materials.{name}"), change.wrong()));
        let lights = self.lights.iter().map(|(name, change)| (format!("lights.{name}"), change.wrong()));
        let environment = self.environment.iter().map(|change| ("environment".to_owned(), change.wrong()));
        let mut found = materials.chain(lights).chain(environment);
        found.find_map(|(table, wrong)| wrong.map(|(key, right)| format!("{table}: {key} must be {right}")))
    }

    /// Reads the same as JSON; files are looked for in `folder`, and `place` names the text in messages.
    ///
    /// # Errors
    /// If it is no JSON, or has keys or numbers that mean nothing.
    pub fn parse_json(text: &str, folder: &Path, place: &str) -> Result<Self, Error> {
        let parsed: Self = serde_json::from_str(text).map_err(|e| {
            let what = e.to_string();
            // There is but one line.
            let what = what.split(" at line ").next().unwrap_or_default();
            Error::scene(what, place, "")
        })?;
        Self { folder: folder.to_owned(), ..parsed }.checked(place)
    }

    /// Files that the changes name.
    pub(crate) fn files(&self) -> impl Iterator<Item = PathBuf> {
        let profiles = self.lights.values().filter_map(|light| light.ies.as_ref());
        let map = self.environment.as_ref().and_then(|environment| environment.map.as_ref());
        profiles.chain(map).map(|path| self.folder.join(path))
    }

    /// Changes the scene.
    pub(crate) fn apply(&self, desc: &mut SceneDesc, files: &mut Files) -> Result<(), Error> {
        for (name, change) in all_first(&self.materials) {
            self.apply_by_name("material", name, &mut desc.materials, |m| &m.name, |m| change.apply(m))?;
        }
        for (name, change) in all_first(&self.lights) {
            let path = change.ies.as_ref().map(|path| self.folder.join(path));
            let profile = path.map(|path| files.profile(&path, &mut desc.diagnostics)).transpose()?;
            let apply = |light: &mut Light| change.apply(light, profile.as_ref());
            self.apply_by_name("light", name, &mut desc.lights, |l| &l.name, apply)?;
        }
        match &self.environment {
            Some(change) => self.apply_environment(change, desc, files),
            None => Ok(()),
        }
    }

    /// Changes a material that is in no scene yet, by its name.
    pub fn dress(&self, material: &mut Material) {
        for (name, change) in all_first(&self.materials) {
            if name == "*" || *name == material.name {
                change.apply(material);
            }
        }
    }

    /// Applies `change` to every entry of that name.
    fn apply_by_name<T>(
        &self,
        kind: &str,
        name: &str,
        entries: &mut [T],
        name_of: fn(&T) -> &String,
        change: impl Fn(&mut T),
    ) -> Result<(), Error> {
        let mut found = false;
        for entry in entries.iter_mut().filter(|e| name == "*" || name_of(e) == name) {
            change(entry);
            found = true;
        }
        if found || name == "*" {
            return Ok(());
        }
        let mut known: Vec<&str> = entries.iter().map(|e| name_of(e).as_str()).collect();
        known.sort_unstable();
        known.dedup();
        known.truncate(20);
        let hint = if known.is_empty() {
            "there are none".into()
        } else {
            format!("there are {}", known.join(", "))
        };
        Err(Error::scene(format!("no {kind} is named \"{name}\""), &self.place, hint))
    }

    fn apply_environment(
        &self,
        change: &EnvironmentOverride,
        desc: &mut SceneDesc,
        files: &mut Files,
    ) -> Result<(), Error> {
        let kinds = [change.map.is_some(), change.color.is_some(), change.sun.is_some()];
        if kinds.iter().filter(|&&k| k).count() > 1 {
            let hint = "give one of map, color and sun";
            return Err(Error::scene("the environment has two kinds of light", &self.place, hint));
        }
        if let Some(path) = &change.map {
            files.use_map(desc, &self.folder.join(path))?;
        }
        if let Some(color) = change.color {
            desc.environment = Some(Environment::Constant(Vec3::from_array(color)));
        }
        if let Some(sun) = change.sun {
            environment::use_sun(desc, sun);
        }
        if let Some(turbidity) = change.turbidity {
            desc.environment =
                Some(Environment::Sky(vastlight_scene::Sky { turbidity, ..environment::sky_of(desc) }));
        }
        if change.strength.is_some() || change.rotation.is_some() {
            // The sky that a scene is given for want of anything else.
            let given = Some(desc.surroundings()).filter(|given| matches!(given, Environment::Sky(_)));
            desc.environment = desc.environment.take().or(given);
        }
        scale_and_turn(desc, change);
        Ok(())
    }
}

/// The change of everything (`*`), then those by name.
fn all_first<T>(changes: &BTreeMap<String, T>) -> impl Iterator<Item = (&String, &T)> {
    let of_all = changes.iter().filter(|(name, _)| *name == "*");
    of_all.chain(changes.iter().filter(|(name, _)| *name != "*"))
}

fn scale_and_turn(desc: &mut SceneDesc, change: &EnvironmentOverride) {
    let scale = change.strength.unwrap_or(1.0);
    let turn = change.rotation.unwrap_or(0.0).to_radians();
    match &mut desc.environment {
        Some(Environment::Constant(color)) => *color *= scale,
        Some(Environment::Map { rotation, strength, .. }) => {
            *rotation += turn;
            *strength *= scale;
        }
        Some(Environment::Sky(sky)) => {
            sky.sun_azimuth += turn;
            sky.strength *= scale;
        }
        None => {}
    }
}

impl MaterialOverride {
    fn apply(&self, m: &mut Material) {
        self.apply_base(m);
        self.apply_extensions(m);
    }

    fn apply_base(&self, m: &mut Material) {
        set_color(&mut m.base_color, self.base_color);
        set_color(&mut m.emission, self.emission);
        if let Some(MeasuredMetal(conductor)) = self.metal {
            m.conductor = Some(conductor);
            m.metallic = ScalarInput::new(1.0);
        }
        set_scalar(&mut m.metallic, self.metallic);
        set_scalar(&mut m.roughness, self.roughness);
        set_scalar(&mut m.alpha, self.alpha);
        if self.alpha.is_some_and(|a| a < 1.0) {
            m.alpha_mode = AlphaMode::Blend;
        }
        set(&mut m.double_sided, self.double_sided);
        if self.normal_map == Some(false) {
            m.normal_map = None;
        }
    }

    fn apply_extensions(&self, m: &mut Material) {
        set(&mut m.ior, self.ior);
        set_scalar(&mut m.specular, self.specular);
        set_color(&mut m.specular_color, self.specular_color);
        set_scalar(&mut m.transmission, self.transmission);
        set(&mut m.thickness, self.thickness);
        set(&mut m.attenuation_color, self.attenuation_color.map(Vec3::from_array));
        set(&mut m.attenuation_distance, self.attenuation_distance);
        set(&mut m.dispersion, self.dispersion);
        set_scalar(&mut m.clearcoat, self.clearcoat);
        set_scalar(&mut m.clearcoat_roughness, self.clearcoat_roughness);
        set_color(&mut m.sheen_color, self.sheen_color);
        set_scalar(&mut m.sheen_roughness, self.sheen_roughness);
        set(&mut m.anisotropy, self.anisotropy);
        set_scalar(&mut m.iridescence, self.iridescence);
    }
}

impl LightOverride {
    fn apply(&self, light: &mut Light, profile: Option<&Arc<IesProfile>>) {
        if let Some(profile) = profile {
            light.profile = Some(Arc::clone(profile));
        }
        set(&mut light.intensity, self.intensity.map(Vec3::from_array));
        light.intensity *= self.scale.unwrap_or(1.0);
    }
}

fn set<T>(slot: &mut T, value: Option<T>) {
    if let Some(value) = value {
        *slot = value;
    }
}

fn set_scalar(input: &mut ScalarInput, value: Option<f32>) {
    set(input, value.map(ScalarInput::new));
}

fn set_color(input: &mut ColorInput, value: Option<[f32; 3]>) {
    set(input, value.map(|c| ColorInput::new(Vec3::from_array(c))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_import::Limits;

    fn scene() -> SceneDesc {
        let mut wood = Material::new("Wood");
        wood.roughness.texture = Some((0, vastlight_scene::Channel::G));
        SceneDesc { materials: vec![wood, Material::new("Steel")], ..SceneDesc::default() }
    }

    fn apply(text: &str) -> Result<SceneDesc, Error> {
        let mut desc = scene();
        Overrides::parse(text, "o.toml")?.apply(&mut desc, &mut Files::new(Limits::default()))?;
        Ok(desc)
    }

    #[test]
    fn numbers_replace_values_and_their_textures() {
        let desc =
            apply("[materials.Wood]\nroughness = 0.25\nbase_color = [1.0, 0.5, 0.0]").expect("applied");
        assert_eq!(desc.materials[0].roughness, ScalarInput::new(0.25));
        assert_eq!(desc.materials[0].base_color.factor, Vec3::new(1.0, 0.5, 0.0));
        assert_eq!(desc.materials[1], Material::new("Steel"));
        let all = apply("[materials.\"*\"]\nmetallic = 1").expect("applied");
        assert!(all.materials.iter().all(|m| m.metallic.factor == 1.0));
    }

    #[test]
    fn metals_are_measured_ones() {
        let desc = apply("[materials.Steel]\nmetal = \"gold\"").expect("applied");
        assert_eq!(desc.materials[1].conductor, Conductor::named("gold"));
        assert_eq!(desc.materials[1].metallic, ScalarInput::new(1.0));
        let message = apply("[materials.Steel]\nmetal = \"cheese\"").expect_err("no metal").to_string();
        assert!(message.contains("cheese") && message.contains("aluminium"), "{message}");
    }

    #[test]
    fn environments_are_replaced_scaled_and_turned() {
        let desc = apply("[environment]\ncolor = [1, 2, 3]\nstrength = 2").expect("applied");
        assert_eq!(desc.environment, Some(Environment::Constant(Vec3::new(2.0, 4.0, 6.0))));
        let desc = apply("[environment]\nsun = [90, 30]\nstrength = 0.5").expect("applied");
        let given = apply("[environment]\nstrength = 0.5").expect("applied").environment;
        let sky = vastlight_scene::Sky::default();
        let half = vastlight_scene::Sky { strength: 0.5 * sky.strength, ..sky };
        assert_eq!(given, Some(Environment::Sky(half)), "that of a scene without light");
        let Some(Environment::Sky(sky)) = desc.environment else { panic!("no sky") };
        assert!((sky.sun_elevation - 30_f32.to_radians()).abs() < 1e-6 && sky.strength == 0.5);
    }

    #[test]
    fn lights_take_measured_distributions() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("lamp.ies");
        let text = "IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 3 1 1 2 0 0 0\n1 1 50\n0 45 90\n0\n200 100 0\n";
        std::fs::write(&file, text).expect("written");
        let mut desc = scene();
        desc.lights.push(Light {
            name: "Lamp".into(),
            kind: vastlight_scene::LightKind::Point,
            world_from_light: vastlight_math::Affine3::IDENTITY,
            intensity: Vec3::ONE,
            range: f32::INFINITY,
            profile: None,
        });
        let text = |name: &str| format!("[lights.Lamp]\nies = '{}'", folder.path().join(name).display());
        let change = Overrides::parse(&text("lamp.ies"), "o.toml").expect("parsed");
        change.apply(&mut desc, &mut Files::new(Limits::default())).expect("applied");
        assert_eq!(desc.lights[0].profile.as_ref().map(|p| p.peak_candela), Some(200.0));
        let missing = Overrides::parse(&text("none.ies"), "o.toml").expect("parsed");
        assert!(missing.apply(&mut desc, &mut Files::new(Limits::default())).is_err());
    }

    #[test]
    fn numbers_that_mean_nothing_are_refused() {
        for (table, text) in [
            ("materials.Wood", "roughness = nan"),
            ("materials.Wood", "metallic = 1.5"),
            ("materials.Wood", "base_color = [inf, 1, 1]"),
            ("materials.Wood", "emission = [1, -1, 1]"),
            ("materials.Wood", "ior = 0.5"),
            ("materials.Wood", "thickness = -1"),
            ("materials.Wood", "attenuation_distance = 0"),
            ("lights.Lamp", "intensity = [nan, 1, 1]"),
            ("lights.Lamp", "scale = -2"),
            ("environment", "color = [1e39, 0, 0]"),
            ("environment", "strength = -1"),
            ("environment", "sun = [nan, 30]"),
            ("environment", "turbidity = 0"),
        ] {
            let wrong = Overrides::parse(&format!("[{table}]\n{text}"), "o.toml").expect_err("refused");
            let key = text.split(' ').next().expect("a key");
            assert!(wrong.what.starts_with(&format!("{table}: {key} must be ")), "{}", wrong.what);
            let (_, value) = text.split_once(" = ").expect("a value");
            if value.contains(|c: char| c.is_ascii_alphabetic()) {
                continue; // JSON has no such numbers.
            }
            let entry = format!("{{\"{key}\": {value}}}");
            let json = table.rsplit('.').fold(entry, |inner, name| format!("{{\"{name}\": {inner}}}"));
            let same = Overrides::parse_json(&json, "".as_ref(), "o.toml").expect_err("refused");
            assert_eq!(same, wrong);
        }
        let limits =
            "roughness = 0\nmetallic = 1\nior = 0\nattenuation_distance = inf\nbase_color = [2, 0, 0]";
        assert!(apply(&format!("[materials.Wood]\n{limits}")).is_ok());
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let message = |text: &str| apply(text).expect_err("wrong").to_string();
        assert!(message("[materials.Wod]\nroughness = 1").contains("there are Steel, Wood"));
        assert!(message("[materials.Wood]\nroughnes = 1").contains("o.toml:2: unknown field `roughnes`"));
        assert!(message("[materials").starts_with("o.toml:1"));
        assert!(message("[environment]\ncolor = [1,1,1]\nsun = [1,1]").contains("two kinds"));
        assert!(message("[lights.Lamp]\nscale = 2").contains("there are none"));
    }
}
