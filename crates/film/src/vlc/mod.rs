//! Files of sums (.vlc): see docs/checkpoint-format.md. All numbers are little-endian.

mod header;
mod notes;
mod number;
mod planes;
mod read;
mod write;

#[cfg(test)]
mod tests;

/// Stands for the path of what is in no file.
const IN_MEMORY: &str = "sums in memory";

pub use read::SumsFile;
pub use write::write_sums;
