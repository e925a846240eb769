//! Where bytes of pages come from, one kind a file.

mod address;
#[cfg(target_os = "linux")]
mod direct;
mod faulty;
mod file;
mod memory;
#[cfg(feature = "object-store")]
mod object;

pub use address::{is_address, shown};
pub use faulty::{Fault, Faulty, When};
pub use file::{FileSource, KernelCache};
pub use memory::MemorySource;
#[cfg(feature = "object-store")]
pub use object::{ObjectConfig, ObjectSource};

/// Bytes that can be read from any place, by many threads at once.
pub trait Source: Send + Sync + std::fmt::Debug {
    /// Fills `into` with the bytes from `offset` on.
    ///
    /// # Errors
    /// If not all of them can be had. What `into` holds then is not defined.
    fn read(&self, offset: u64, into: &mut [u8]) -> Result<(), SourceError>;

    /// Number of bytes.
    ///
    /// # Errors
    /// If that cannot be found out.
    fn bytes(&self) -> Result<u64, SourceError>;

    /// What to call the source in a message: a path or an address, without secrets.
    fn name(&self) -> &str;

    /// Most bytes of its own memory that so many reads at once take.
    fn buffer_bytes(&self, _readers: usize) -> usize {
        0
    }
}

/// Why bytes cannot be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name}, byte {offset}: {what} ({hint})")]
pub struct SourceError {
    /// What went wrong.
    pub what: String,
    /// The name of the source.
    pub name: String,
    /// The first byte that was asked for.
    pub offset: u64,
    /// What can be done about it.
    pub hint: &'static str,
}

impl SourceError {
    /// Bytes were asked for that lie behind the end.
    fn behind_end(name: &str, offset: u64, wanted: usize, bytes: u64) -> Self {
        Self {
            what: format!("{wanted} bytes wanted, but it ends at byte {bytes}"),
            name: name.to_owned(),
            offset,
            hint: "the file is cut short, or not the one that its directory belongs to",
        }
    }
}
