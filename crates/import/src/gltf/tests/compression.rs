//! Compressed meshes and textures.
