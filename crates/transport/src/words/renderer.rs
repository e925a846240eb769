//! Everything that a renderer knows but its tracer, as words.

use super::pages::{ATTRIBUTES, KEPT, ScenePages, TILES};
use super::{Words, camera, geometry, materials, put_albedo, tables, textures};
use crate::pages::PagesError;
use crate::renderer::Renderer;
use vastlight_scene::TexelReader;

/// The bindings of a path tracer on a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RendererWords {
    /// Materials, textures, meshes, instances, camera; see [`tables`].
    pub tables: Vec<u32>,
    /// Everything about lights.
    pub lights: Vec<u32>,
}

/// Why a renderer cannot be had as words.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WordsError {
    /// Pages of a store cannot be had.
    #[error(transparent)]
    Pages(#[from] PagesError),
    /// A binding would have 2^32 words.
    #[error("the scene has more than 16 GiB of {0}")]
    TooLong(&'static str),
}

impl Renderer<'_> {
    /// The renderer's tables as words, and the pages of its scene.
    ///
    /// # Errors
    /// It is too large to be counted in words of 32 bits, or its store serves nobody else.
    pub fn words(&self) -> Result<(RendererWords, ScenePages<'_>), WordsError> {
        let (rows, all_textures) = self.materials.parts();
        let (pages, attributes, tiled) = ScenePages::new(self)?;
        let [tiles, of_attributes, kept] = [TILES, ATTRIBUTES, KEPT].map(|kind| pages.kinds()[kind].first);
        let mut words = Words::new(tables::HEADER);
        words.section(tables::ALBEDO);
        put_albedo(&mut words);
        words.section(tables::SRGB);
        words.f32s(TexelReader::srgb_table());
        words.section(tables::CAMERA);
        camera::put(&mut words, &self.camera);
        words.section(tables::MATERIALS);
        rows.iter().for_each(|row| materials::put(&mut words, row, all_textures.len()));
        let first_kept = kept + attributes.kept_pages();
        let first = textures::put(&mut words, all_textures, &tiled, [tiles, first_kept]);
        words.set(tables::TEXTURES, first);
        let [blocks, starts] = attributes.put(&mut words, of_attributes);
        words.set(tables::BLOCKS, blocks);
        words.set(tables::STARTS, starts);
        words.set(tables::FIRST_ATTRIBUTES, of_attributes);
        let geometry = (self.scene, self.tracer());
        let first = geometry::put_meshes(&mut words, geometry, &self.veils, &attributes);
        words.set(tables::MESHES, first);
        words.section(tables::INSTANCES);
        geometry::put_instances(&mut words, self.scene, &self.placements);
        let all = RendererWords { tables: words.finish(), lights: self.lights.pack() };
        Ok((all.check()?, pages))
    }
}

impl RendererWords {
    /// Whether rays may pass surfaces of an instance.
    #[must_use]
    pub fn is_veiled(&self, instance: u32) -> bool {
        self.passers(instance) & 1 != 0
    }

    /// The same of rays of the integrator `whitted`.
    #[must_use]
    pub fn is_veiled_to_whitted(&self, instance: u32) -> bool {
        self.passers(instance) != 0
    }

    /// See [`geometry::VEILED`].
    fn passers(&self, instance: u32) -> usize {
        let word = |at: usize| self.tables.get(at).copied().unwrap_or(0) as usize;
        let instance = word(tables::INSTANCES) + instance as usize * geometry::INSTANCE_WORDS;
        let mesh = word(tables::MESHES) + word(instance + geometry::MESH) * geometry::MESH_WORDS;
        word(mesh + geometry::VEILED)
    }

    fn check(self) -> Result<Self, WordsError> {
        for (what, words) in [("tables", &self.tables), ("lights", &self.lights)] {
            if words.len() >= u32::MAX as usize {
                return Err(WordsError::TooLong(what));
            }
        }
        Ok(self)
    }
}
