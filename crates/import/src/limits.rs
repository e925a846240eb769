//! How much a file may ask for before it is refused.

use crate::ImportError;

/// Bounds on what an importer accepts. Every count that a file states is compared with these before memory is taken
/// for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Size of any one file, bytes.
    pub file_bytes: u64,
    /// Vertices of one mesh.
    pub vertices: u64,
    /// Triangles of one mesh.
    pub triangles: u64,
    /// Objects, nodes, meshes, materials, textures, images: entries of any one table.
    pub items: u64,
    /// Instances of meshes in the scene.
    pub instances: u64,
    /// Size of one decoded image or buffer, bytes.
    pub decoded_bytes: u64,
    /// Size of all decoded images of a scene together, bytes.
    pub all_images_bytes: u64,
    /// Width or height of an image, texels.
    pub image_side: u32,
    /// Depth of a hierarchy.
    pub nesting: u32,
    /// Length of one line of a text file, bytes.
    pub line_bytes: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file_bytes: 256 << 30,
            vertices: u64::from(u32::MAX),
            triangles: u64::from(u32::MAX),
            items: 1 << 24,
            instances: 1 << 28,
            decoded_bytes: 4 << 30,
            all_images_bytes: 8 << 30,
            image_side: 1 << 16,
            nesting: 512,
            line_bytes: 64 << 20,
        }
    }
}

impl Limits {
    /// Checks the size of an image before it is decoded; `bytes_per_texel` counts all channels.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`], or malformed if a side is 0.
    pub fn check_image(
        &self,
        width: u64,
        height: u64,
        bytes_per_texel: u64,
        place: &str,
    ) -> Result<(), ImportError> {
        if width == 0 || height == 0 {
            return Err(ImportError::malformed("the image has no texels", place));
        }
        let side = u64::from(self.image_side);
        let bytes = width.saturating_mul(height).saturating_mul(bytes_per_texel);
        if width > side || height > side || bytes > self.decoded_bytes {
            let what = format!("the image of {width} x {height} texels is larger than the limits allow");
            return Err(ImportError::limit(what, place));
        }
        Ok(())
    }

    /// Checks the size of all images of a scene together before the first is decoded.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`].
    pub fn check_all_images(&self, bytes: u64, place: &str) -> Result<(), ImportError> {
        if bytes <= self.all_images_bytes {
            return Ok(());
        }
        let limit = self.all_images_bytes;
        let what = format!("the images of the scene take {bytes} bytes, more than the limit of {limit}");
        Err(ImportError::limit(what, place).with_hint("smaller images, or a larger --memory"))
    }

    /// Checks a count of `what` against `limit`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Limit`].
    pub fn check_count(&self, count: u64, limit: u64, what: &str, place: &str) -> Result<(), ImportError> {
        if count <= limit {
            return Ok(());
        }
        Err(ImportError::limit(format!("{count} {what} are more than the limit of {limit}"), place))
    }
}
