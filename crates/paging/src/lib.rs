//! Pages of data in memory inside a budget.
//!
//! [`Table`] says which pages are in memory; [`PageCache`] reads them from a [`Source`] as they are needed and decides
//! which to keep by a [`Policy`]. Nothing here knows what pages hold.

mod cache;
mod directory;
pub mod policy;
mod source;
mod table;

pub use cache::{Batch, CacheConfig, CacheError, CacheStats, PageCache, PageError, PageFault, Usage};
pub use directory::{Directory, PageEntry};
pub use policy::{Policy, PolicyKind};
pub use source::{
    Fault, Faulty, FileSource, KernelCache, MemorySource, Source, SourceError, When, is_address, shown,
};
#[cfg(feature = "object-store")]
pub use source::{ObjectConfig, ObjectSource};
pub use table::{Buffer, Edition, Line, Table};
