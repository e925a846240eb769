//! Scenes as they are opened: in memory, or as a store whose pages come when they are needed.

use crate::load::{LoadOptions, adapt, bring_to, describe, posed};
use crate::{Error, ErrorClass};
use std::path::Path;
use std::sync::Arc;
use vastlight_paging::{FileSource, KernelCache, PageError, Source, SourceError, is_address, shown};
#[cfg(feature = "object-store")]
use vastlight_paging::{ObjectConfig, ObjectSource};
use vastlight_scene::{Scene, TextureUse, texture_uses};
use vastlight_store::{Store, StoreError, StoredPages, StoredTexture};
use vastlight_transport::{MaterialTable, PagesError};

/// The extension of stores.
pub(crate) const STORE: &str = "vls";

/// A scene, and where its meshes are.
#[derive(Debug)]
pub struct OpenScene {
    /// The scene; if it is [`stored`](Self::stored), most of its meshes have no geometry.
    pub scene: Scene,
    /// Where the rest is, of a scene in a store.
    pub stored: Option<StoredPages>,
}

impl OpenScene {
    /// Triangles of the meshes that are in memory beside the pages of a store, since they deform.
    #[must_use]
    pub fn triangles_beside_pages(&self) -> u64 {
        let meshes = self.stored.iter().flat_map(|stored| &stored.meshes).zip(self.scene.extents());
        meshes.filter(|(above, _)| above.is_none()).map(|(_, extent)| extent.triangles).sum()
    }

    /// The scene's materials, ready for lookups.
    pub(crate) fn materials(&self) -> MaterialTable<'_> {
        let textures = self.stored.as_ref().map_or(&[][..], |stored| &stored.textures);
        MaterialTable::with_tiles(&self.scene, textures)
    }
}

impl From<Scene> for OpenScene {
    fn from(scene: Scene) -> Self {
        Self { scene, stored: None }
    }
}

/// Opens a scene: a file, a store (.vls), also on a server (`https://`, `http://`, `s3://`), or `demo:NAME`.
///
/// # Errors
/// If the file cannot be read or is wrong, the demo is unknown, or an override names what is not there.
pub fn open(source: &str, options: &LoadOptions) -> Result<OpenScene, Error> {
    if is_store(source) {
        let pages = pages_of(source, options).map_err(|e| Error::scene(e.what, e.name, e.hint))?;
        return open_store(pages, options);
    }
    let mut desc = describe(source, options)?;
    adapt(&mut desc, options)?;
    Ok(posed(desc, source, options)?.into())
}

/// Where the bytes of a store are.
fn pages_of(source: &str, options: &LoadOptions) -> Result<Arc<dyn Source>, SourceError> {
    if is_address(source) {
        return remote_pages(source);
    }
    let kernel = if options.bypass_kernel_cache { KernelCache::Bypass } else { KernelCache::Keep };
    Ok(Arc::new(FileSource::open(Path::new(source), kernel)?))
}

#[cfg(feature = "object-store")]
fn remote_pages(address: &str) -> Result<Arc<dyn Source>, SourceError> {
    Ok(Arc::new(ObjectSource::open(address, ObjectConfig::default())?))
}

#[cfg(not(feature = "object-store"))]
fn remote_pages(address: &str) -> Result<Arc<dyn Source>, SourceError> {
    let what = "stores on servers are not read by this program".to_owned();
    let name = shown(address).into_owned();
    Err(SourceError { what, name, offset: 0, hint: "build it with `--features object-store`" })
}

/// Whether a scene's name is that of a store.
#[must_use]
pub fn is_store(source: &str) -> bool {
    !source.starts_with("demo:")
        && Path::new(&*shown(source))
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case(STORE))
}

/// Opens a store, wherever its bytes are.
///
/// # Errors
/// If it cannot be read or is damaged, or an override names what is not there.
pub fn open_store(source: Arc<dyn Source>, options: &LoadOptions) -> Result<OpenScene, Error> {
    if let Some(animation) = &options.import.animation {
        let what = format!("a store keeps one animation, and \"{animation}\" cannot be chosen any more");
        return Err(Error::usage(what, "--animation", "choose it when the scene is packed"));
    }
    let Store { mut desc, instances, extents, motion, pages } = Store::open(source)?;
    adapt(&mut desc, options)?;
    desc.motion = motion.map(|record| crate::motion::read(record, &desc)).transpose()?;
    let deforming = (0..).zip(&pages.meshes).filter(|(_, above)| above.is_none());
    let deforming: Vec<u32> = deforming.map(|(number, _)| number).collect();
    let count = instances.len();
    let mut scene = Scene::with_meshes_elsewhere(desc, instances, extents, &deforming)?;
    let name = pages.source.name();
    if scene.instances().len() != count {
        return Err(Error::scene(
            "an instance is singular",
            name,
            "the store is damaged: pack the scene again",
        ));
    }
    check_looks(&scene, &pages)?;
    bring_to(&mut scene, options.time, name)?;
    Ok(OpenScene { scene, stored: Some(pages) })
}

/// Refuses materials that need what a store does not have.
pub(crate) fn check_looks(scene: &Scene, pages: &StoredPages) -> Result<(), Error> {
    let refused = |what| Err(Error::usage(what, pages.source.name(), "pack the scene with this override"));
    if let Some(material) = dark_emitter(scene) {
        return refused(format!(
            "material \"{material}\" is made to shine, but its triangles are not in memory"
        ));
    }
    if let Some(image) = missing_texels(scene, &pages.textures) {
        return refused(format!(
            "a material needs image \"{image}\" as a whole, but its texels are in tiles"
        ));
    }
    Ok(())
}

/// An image that a material looks up in a way that its tiles do not serve.
fn missing_texels<'s>(scene: &'s Scene, stored: &[StoredTexture]) -> Option<&'s str> {
    let uses = texture_uses(scene.materials(), scene.textures());
    let served = |image: u32, found: &TextureUse| {
        let mut tiles = stored.iter().filter(|s| s.image == image).peekable();
        let used = found.exact || found.filtered;
        !used || tiles.peek().is_none() || !found.exact && tiles.any(|s| s.content == found.content)
    };
    let missing = scene.textures().iter().zip(&uses).find(|(texture, found)| !served(texture.image, found));
    missing.map(|(texture, _)| scene.images()[texture.image as usize].name.as_str())
}

/// A material that shines, of a mesh whose geometry is not in memory.
fn dark_emitter(scene: &Scene) -> Option<&str> {
    let elsewhere = scene.meshes().iter().zip(scene.extents());
    let mut elsewhere = elsewhere.filter(|(mesh, extent)| mesh.triangles.is_empty() && extent.triangles > 0);
    let shining = |&material: &u32| scene.materials()[material as usize].is_emissive();
    elsewhere
        .find_map(|(mesh, _)| crate::pack::materials_of(mesh).find(shining))
        .map(|material| scene.materials()[material as usize].name.as_str())
}

impl From<StoreError> for Error {
    fn from(error: StoreError) -> Self {
        let class = if error.is_output { ErrorClass::Output } else { ErrorClass::Scene };
        Self::new(class, error.what, error.place, error.hint)
    }
}

impl From<PageError> for Error {
    fn from(error: PageError) -> Self {
        Self::scene(error.to_string(), "", "")
    }
}

impl From<PagesError> for Error {
    fn from(error: PagesError) -> Self {
        match error {
            PagesError::Page(error) => error.into(),
            PagesError::FewTiles { .. } | PagesError::Cache(_) => {
                Self::new(ErrorClass::Memory, error.to_string(), "page cache", "")
            }
        }
    }
}
