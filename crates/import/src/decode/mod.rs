//! Decoders of compressed data inside scene files: meshopt, Draco, and the textures of KTX2.

mod draco;
mod ktx2;
mod meshopt;

pub use draco::{DracoAttribute, DracoMesh, draco};
pub(crate) use ktx2::SIGNATURE as KTX2_SIGNATURE;
pub use ktx2::ktx2;
pub(crate) use ktx2::ktx2_decoded_bytes;
pub use meshopt::{MeshoptFilter, MeshoptMode, meshopt};
