//! MTL's Phong-like description to the one material. `docs/formats.md` has the rules in words.

use super::mtl::{self, Map, MtlMaterial, Slot};
use super::textures::{self, Images, Sources};
use crate::scan::Source;
use crate::texels::Deferral;
use crate::{Limits, LoadOptions};
use std::path::{Path, PathBuf};
use vastlight_math::Vec3;
use vastlight_scene::{
    AlphaMode, Channel, ColorInput, Diagnostics, Encoding, Material, NormalMap, ScalarInput, SceneDesc,
};

/// Index of refraction where the file states none that refracts.
const GLASS_IOR: f32 = 1.5;

/// The material libraries of an OBJ file.
pub(super) struct Library {
    materials: Vec<MtlMaterial>,
    files: Vec<PathBuf>,
    directory: PathBuf,
    /// The OBJ file, for messages.
    place: String,
}

impl Library {
    /// Reads the libraries that `mtllib` statements name; missing ones are named in warnings.
    pub(super) fn load(statements: &[String], path: &Path, limits: &Limits, found: &mut Diagnostics) -> Self {
        let directory = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let mut library =
            Self { materials: Vec::new(), files: Vec::new(), directory, place: path.display().to_string() };
        for statement in statements {
            let whole = textures::locate(&statement.replace('\\', "/"), &library.directory);
            if whole.is_file() {
                library.read(&whole, limits, found);
                continue;
            }
            for name in statement.split_whitespace() {
                let file = textures::locate(&name.replace('\\', "/"), &library.directory);
                library.read(&file, limits, found);
            }
        }
        library
    }

    fn read(&mut self, file: &Path, limits: &Limits, found: &mut Diagnostics) {
        let materials = Source::open(file, limits).and_then(|source| mtl::parse(source, limits, found));
        match materials {
            Ok(materials) => {
                self.materials.extend(materials);
                self.files.push(file.to_owned());
            }
            Err(e) => {
                let what = format!("the material library \"{}\" cannot be read: {}", file.display(), e.what);
                found.warn(what, &self.place, "its materials are neutral");
            }
        }
    }

    /// The libraries, and the images that their materials name.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        let maps = self.materials.iter().flat_map(|material| material.maps.iter().flatten());
        let mut images: Vec<PathBuf> = maps.map(|map| textures::locate(&map.file, &self.directory)).collect();
        images.sort();
        images.dedup();
        self.files.iter().cloned().chain(images).collect()
    }

    fn find(&self, name: &str) -> Option<&MtlMaterial> {
        self.materials.iter().find(|m| m.name == name)
    }

    /// For each name whether its material is glass, so that it matters if it covers a closed surface.
    pub(super) fn glass(&self, names: &[String]) -> Vec<bool> {
        names.iter().map(|name| self.find(name).is_some_and(MtlMaterial::is_glass)).collect()
    }

    /// Adds the named materials, in this order, with their textures and images to `desc`.
    pub(super) fn fill(
        &self,
        names: &[String],
        closed: &[bool],
        (options, deferral): (&LoadOptions, &mut Deferral),
        desc: &mut SceneDesc,
    ) {
        let used: Vec<Option<&MtlMaterial>> = names.iter().map(|name| self.find(name)).collect();
        let located = |map: &Map| textures::locate(&map.file, &self.directory);
        let files = used.iter().flatten().flat_map(|m| m.maps.iter().flatten()).map(located);
        // What these say is needed here.
        let read_here =
            |m: &&MtlMaterial| [m.map(Slot::Opacity), m.map(Slot::Bump)].map(|map| map.map(located));
        let whole = used.iter().flatten().flat_map(read_here).flatten().collect();
        let sources = Sources { whole, limits: &options.limits, place: &self.place };
        let mut images = Images::load(files, &sources, deferral, desc);
        for ((name, source), &closed) in names.iter().zip(used).zip(closed) {
            let material = match source {
                Some(source) => {
                    let mut material = source.convert(closed);
                    Textures { images: &mut images, directory: &self.directory, desc }
                        .apply(source, &mut material);
                    material
                }
                None => {
                    if !name.is_empty() {
                        let what = format!("the material \"{name}\" does not exist");
                        desc.diagnostics.warn(what, &self.place, "it is neutral");
                    }
                    Material::new(if name.is_empty() { "default" } else { name })
                }
            };
            desc.materials.push(material);
        }
    }
}

impl MtlMaterial {
    /// 1 is opaque. `d` wins over `Tr`, which some programs write the wrong way round.
    fn opacity(&self) -> f32 {
        self.opacity.or_else(|| self.transparency.map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0)
    }

    fn illum(&self) -> u32 {
        self.illum.unwrap_or(2.0).clamp(0.0, 100.0) as u32
    }

    fn refracts(&self) -> bool {
        self.ior.is_some_and(|n| n > 1.01)
    }

    /// Transparent and shiny: a dielectric, rather than a surface that is partly there.
    fn is_glass(&self) -> bool {
        let see_through = self.opacity() < 1.0;
        let shiny =
            self.specular.is_some_and(|s| s.max_element() >= 0.2) && self.exponent.is_some_and(|n| n >= 20.0);
        let by_illum = match self.illum() {
            6 | 7 => see_through || self.refracts(),
            4 | 9 => see_through,
            _ => false,
        };
        self.map(Slot::Opacity).is_none() && (by_illum || see_through && (shiny || self.refracts()))
    }

    /// The material without textures.
    fn convert(&self, closed: bool) -> Material {
        let mut out = Material::new(&*self.name);
        out.base_color = ColorInput::new(self.diffuse.unwrap_or(Vec3::splat(0.6)).min(Vec3::ONE));
        out.roughness =
            ScalarInput::new(self.roughness.unwrap_or_else(|| self.phong_roughness()).clamp(0.0, 1.0));
        out.metallic = ScalarInput::new(self.metallic.unwrap_or(0.0).clamp(0.0, 1.0));
        if self.refracts() {
            out.ior = self.ior.unwrap_or(GLASS_IOR).min(4.0);
        }
        self.convert_specular(&mut out);
        if self.is_glass() {
            self.convert_glass(closed, &mut out);
        } else if self.opacity() < 1.0 || self.map(Slot::Opacity).is_some() {
            out.alpha = ScalarInput::new(self.opacity());
            out.alpha_mode = AlphaMode::Blend;
        }
        out.emission = ColorInput::new(self.emission.unwrap_or_default());
        out.sheen_color = ColorInput::new(self.sheen.unwrap_or_default().min(Vec3::ONE));
        out.sheen_roughness = ScalarInput::new(0.3);
        out.clearcoat = ScalarInput::new(self.clearcoat.unwrap_or(0.0).clamp(0.0, 1.0));
        out.clearcoat_roughness = ScalarInput::new(self.clearcoat_roughness.unwrap_or(0.0).clamp(0.0, 1.0));
        out.anisotropy = self.anisotropy.unwrap_or(0.0).clamp(0.0, 1.0);
        out.anisotropy_rotation = self.anisotropy_rotation.unwrap_or(0.0) * std::f32::consts::TAU;
        out
    }

    /// The roughness whose microfacet highlight is as wide as Phong's with the exponent Ns: alpha^2 = 2 / (Ns + 2).
    fn phong_roughness(&self) -> f32 {
        self.exponent.map_or(0.6, |n| (2.0 / (n.max(0.0) + 2.0)).sqrt().sqrt())
    }

    /// Ks 0.5 stands for an ordinary dielectric, as modelling programs write it; where reflection is on (illum 3, 8, or
    /// 5 over black), Ks is a mirror's colour.
    fn convert_specular(&self, out: &mut Material) {
        let is_pbr = self.roughness.is_some() || self.metallic.is_some();
        let ks = self.specular.unwrap_or(Vec3::splat(if is_pbr { 0.5 } else { 0.0 }));
        let kd = self.diffuse.unwrap_or(Vec3::ZERO);
        let mirror = match self.illum() {
            3 | 8 => true,
            5 => kd.max_element() < 0.1 * ks.max_element(),
            _ => false,
        };
        let strongest = ks.max_element();
        if mirror && self.metallic.is_none() && strongest > 0.0 {
            let (diffuse, specular) = (kd.element_sum(), ks.element_sum());
            out.metallic = ScalarInput::new(specular / (diffuse + specular));
            out.base_color = ColorInput::new((kd + ks).min(Vec3::ONE));
        } else if self.illum() == 1 || strongest <= 0.0 {
            out.specular = ScalarInput::new(0.0);
        } else {
            out.specular = ScalarInput::new((2.0 * strongest).min(1.0));
            out.specular_color = ColorInput::new(ks / strongest);
        }
    }

    /// A clear dielectric: a closed surface refracts unless Ni says that light goes straight (1), an open one is a thin
    /// wall. The tint is what `d` of Kd over white would be, or Tf.
    fn convert_glass(&self, closed: bool, out: &mut Material) {
        let kd = self.diffuse.unwrap_or(Vec3::ONE);
        let tint = match self.filter {
            Some(filter) if filter != Vec3::ONE => filter.min(Vec3::ONE),
            _ if self.opacity() < 1.0 => Vec3::ONE.lerp(kd, self.opacity()),
            _ => Vec3::ONE,
        };
        out.base_color = ColorInput::new(tint);
        out.metallic = ScalarInput::new(0.0);
        out.transmission = ScalarInput::new(1.0);
        out.specular = ScalarInput::new(1.0);
        out.specular_color = ColorInput::new(Vec3::ONE);
        out.roughness = ScalarInput::new(self.roughness.unwrap_or(0.0).clamp(0.0, 1.0));
        out.ior = self.ior.filter(|_| self.refracts()).unwrap_or(GLASS_IOR).min(4.0);
        let straight = self.ior.is_some() && !self.refracts();
        out.thickness = if closed && !straight { 1.0 } else { 0.0 };
    }
}

/// Adds textures to a scene and a material.
struct Textures<'a> {
    images: &'a mut Images,
    directory: &'a Path,
    desc: &'a mut SceneDesc,
}

impl Textures<'_> {
    fn apply(&mut self, source: &MtlMaterial, out: &mut Material) {
        if let Some(texture) = self.add(source.map(Slot::Diffuse), Encoding::Srgb) {
            out.base_color.texture = Some(texture);
            // Programs that do not multiply write black beside a texture.
            if source.diffuse.is_none_or(|kd| kd == Vec3::ZERO) {
                out.base_color.factor = Vec3::ONE;
            }
        }
        out.specular_color.texture = self.add(source.map(Slot::Specular), Encoding::Srgb);
        if let Some(texture) = self.add(source.map(Slot::Emission), Encoding::Srgb) {
            out.emission.texture = Some(texture);
            if source.emission.is_none_or(|ke| ke == Vec3::ZERO) {
                out.emission.factor = Vec3::ONE;
            }
        }
        if let Some(texture) = self.add(source.map(Slot::Opacity), Encoding::Linear) {
            let image = self.desc.textures[texture as usize].image;
            let has_alpha = textures::has_alpha(&self.desc.images[image as usize]);
            out.alpha.texture = Some((texture, if has_alpha { Channel::A } else { Channel::R }));
        }
        if let Some(texture) = self.add(source.map(Slot::Roughness), Encoding::Linear) {
            out.roughness =
                ScalarInput { factor: source.roughness.unwrap_or(1.0), texture: Some((texture, Channel::R)) };
        }
        if let Some(texture) = self.add(source.map(Slot::Metallic), Encoding::Linear) {
            out.metallic =
                ScalarInput { factor: source.metallic.unwrap_or(1.0), texture: Some((texture, Channel::R)) };
        }
        out.normal_map = self.normal_map(source);
    }

    fn add(&mut self, map: Option<&Map>, encoding: Encoding) -> Option<u32> {
        let map = map?;
        let image = self.images.number(&textures::locate(&map.file, self.directory))?;
        Some(self.push(map, image, encoding))
    }

    fn push(&mut self, map: &Map, image: u32, encoding: Encoding) -> u32 {
        self.desc.textures.push(textures::texture(map, image, encoding));
        self.desc.textures.len() as u32 - 1
    }

    /// A normal map as such, or one made from the heights of a bump map.
    fn normal_map(&mut self, source: &MtlMaterial) -> Option<NormalMap> {
        if let Some(texture) = self.add(source.map(Slot::Normal), Encoding::Linear) {
            return Some(NormalMap { texture, scale: 1.0 });
        }
        let map = source.map(Slot::Bump)?;
        let image = self.images.number(&textures::locate(&map.file, self.directory))?;
        let made = self.images.normal_map_of(image, map.bump, self.desc);
        // The strength of a ready normal map is its scale, that of heights is in the slopes already.
        let scale = if made.is_some() { 1.0 } else { map.bump };
        Some(NormalMap { texture: self.push(map, made.unwrap_or(image), Encoding::Linear), scale })
    }
}
