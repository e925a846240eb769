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

/// What is tried with bytes.
pub type Harness = fn(&[u8]);

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
