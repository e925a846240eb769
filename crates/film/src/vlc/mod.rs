//! Files of sums (.vlc): see docs/checkpoint-format.md. All numbers are little-endian.

mod header;
mod notes;
mod number;
mod planes;
mod read;
mod write;

#[cfg(test)]
mod tests;

pub use read::{SumsFile, decode_sums};
pub use write::{encode_sums, write_sums};
