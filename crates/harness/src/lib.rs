//! Fuzz harnesses: each feeds bytes to one reader and checks what is accepted.
//!
//! The targets of `fuzz/` call these with what a fuzzer makes up; the tests here call them with the kept corpus, on any compiler. A
//! harness panics where a reader breaks its word: a panic of its own, a scene with an index that leads nowhere, a picture that is not
//! finite, two ways to read a file that do not agree. Limits are small, so that memory beyond them is a finding too.

mod compressed;
mod ies;
mod image;
mod overrides;
mod rays;
mod scene;
mod scratch;
mod seal;
mod store;
mod sums;
mod view;

pub use scratch::limits;

use std::path::{Path, PathBuf};

/// What is tried with bytes; whether a reader took them.
pub type Harness = fn(&[u8]) -> bool;

/// All harnesses by the names of their targets.
pub const ALL: [(&str, Harness); 13] = [
    ("gltf", scene::gltf),
    ("obj", scene::obj),
    ("ply", scene::ply),
    ("stl", scene::stl),
    ("image", image::run),
    ("ies", ies::run),
    ("draco", compressed::draco),
    ("meshopt", compressed::meshopt),
    ("overrides", overrides::run),
    ("rays", rays::run),
    ("store", store::run),
    ("sums", sums::run),
    ("view", view::run),
];

/// The harness of a target.
#[must_use]
pub fn named(name: &str) -> Option<Harness> {
    ALL.iter().find(|(known, _)| *known == name).map(|&(_, harness)| harness)
}

/// The kept corpus of a target.
///
/// # Panics
/// There is none.
#[must_use]
pub fn seeds(target: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds").join(target);
    let entries = std::fs::read_dir(folder).expect("every target has seeds");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}

#[cfg(test)]
mod tests {
    /// A file of the kept corpus.
    pub(crate) fn seed(target: &str, name: &str) -> Vec<u8> {
        let files = super::seeds(target);
        let file = files.iter().find(|path| path.ends_with(name)).expect("a seed of this name");
        std::fs::read(file).expect("readable")
    }
}
