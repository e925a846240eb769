//! Scenes on disk, to be traced page by page.
//!
//! A store holds a scene ready for rays: pages of geometry and of attributes and tiles of textures, which come and go, and all the rest,
//! which is read when it is opened. [`StoreWriter`] writes one mesh by mesh, [`Store`] opens it. The bytes are drawn in
//! docs/store-format.md.

mod attributes;
mod error;
pub mod format;
mod journal;
mod lock;
mod pack;
mod partition;
mod read;
mod records;
mod source;
mod spool;
mod tiler;
mod tiles;
mod write;

pub use attributes::{
    ATTRIBUTE_SLOT, AttributeIndex, AttributeLayout, MOST_FLOATS, PackedAttributes, UV_SETS, read_corners,
};
pub use error::StoreError;
pub use pack::{PackConfig, PackedMesh, PageStrategy};
pub use partition::{Bucket, Buckets};
pub use read::{MOST_PAGE_BYTES, Store, StoredPages};
pub use source::SourceFile;
pub use spool::{Spool, SpooledMesh};
pub use tiles::{Level, StoredTexture, TILE_BYTES, TileGrid, is_worth_tiles};
pub use write::{StoreSize, StoreWriter};
