//! Everything that a renderer knows but its tracer, as words.

use super::{Words, camera, geometry, materials, put_albedo, tables, textures};
use crate::renderer::Renderer;
use vastlight_scene::TexelReader;

/// The bindings of a path tracer on a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RendererWords {
    /// Materials, textures, meshes, instances, camera; see [`tables`].
    pub tables: Vec<u32>,
    /// What triangles' corners have.
    pub corners: Vec<u32>,
    /// Numbers of all images.
    pub texels: Vec<u32>,
    /// Everything about lights.
    pub lights: Vec<u32>,
}

/// Why a renderer cannot be had as words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WordsError {
    /// Meshes or textures are in a store.
    #[error("parts of the scene are in a store")]
    Stored,
    /// A binding would have 2^32 words.
    #[error("the scene has more than 16 GiB of {0}")]
    TooLong(&'static str),
}

impl Renderer<'_> {
    /// The renderer's tables as words.
    ///
    /// # Errors
    /// Parts of the scene are in a store, or it is too large to be counted in words of 32 bits.
    pub fn words(&self) -> Result<RendererWords, WordsError> {
        let (rows, all_textures) = self.materials.parts();
        if self.pages.is_some() || all_textures.iter().any(|texture| texture.is_in_tiles()) {
            return Err(WordsError::Stored);
        }
        let mut words = Words::new(tables::HEADER);
        let (mut corners, mut texels) = (Words::default(), Words::default());
        words.section(tables::ALBEDO);
        put_albedo(&mut words);
        words.section(tables::SRGB);
        words.f32s(TexelReader::srgb_table());
        words.section(tables::CAMERA);
        camera::put(&mut words, &self.camera);
        words.section(tables::MATERIALS);
        rows.iter().for_each(|row| materials::put(&mut words, row, all_textures.len()));
        let first = textures::put(&mut words, &mut texels, all_textures);
        words.set(tables::TEXTURES, first);
        let first = geometry::put_meshes(&mut words, &mut corners, self.scene, &self.veils);
        words.set(tables::MESHES, first);
        words.section(tables::INSTANCES);
        geometry::put_instances(&mut words, self.scene, &self.placements);
        let all = RendererWords {
            tables: words.finish(),
            corners: corners.finish(),
            texels: texels.finish(),
            lights: self.lights.pack(),
        };
        all.check()
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
        for (what, words) in [
            ("tables", &self.tables),
            ("corners", &self.corners),
            ("texels", &self.texels),
            ("lights", &self.lights),
        ] {
            if words.len() >= u32::MAX as usize {
                return Err(WordsError::TooLong(what));
            }
        }
        Ok(self)
    }
}
