//! Tables of directional albedo, one behind the other: a reflector that absorbs nothing, its means, one bounce at a
//! dielectric (outside, then inside; rise and loss), its means, and sheen.

use super::Words;
use crate::bsdf::{bounce_tables, sheen_table};

/// Appends the tables; `bsdf_albedo.wgsl` reads them.
pub fn put_albedo(words: &mut Words) {
    bounce_tables().put(words);
    for row in sheen_table() {
        words.f32s(row);
    }
}
