//! Tables as words: how a device that sees arrays of u32 alone gets what the renderer knows.
//!
//! A binding starts with a header, in which each section has a fixed place that holds the word where the section
//! starts; offsets within a section are its own affair. Numbers are the bits of f32.

mod albedo;
pub mod camera;
pub mod geometry;
pub mod lights;
pub mod materials;
pub mod pages;
mod renderer;
pub mod textures;
mod tiled;

use vastlight_math::{Vec2, Vec3};

pub use albedo::put_albedo;
pub use pages::ScenePages;
pub use renderer::{RendererWords, WordsError};

/// Places in the header of the binding `tables`.
pub mod tables {
    /// Tables of directional albedo, see [`put_albedo`](super::put_albedo).
    pub const ALBEDO: usize = 0;
    /// Materials.
    pub const MATERIALS: usize = 1;
    /// Instances.
    pub const INSTANCES: usize = 2;
    /// Descriptors of textures.
    pub const TEXTURES: usize = 3;
    /// Meshes.
    pub const MESHES: usize = 4;
    /// The camera.
    pub const CAMERA: usize = 5;
    /// sRGB-encoded bytes as linear numbers.
    pub const SRGB: usize = 6;
    /// The first page of attributes of each block of triangles, and one more.
    pub const BLOCKS: usize = 7;
    /// The place of the first triangle of each page of attributes in its block.
    pub const STARTS: usize = 8;
    /// The number of the first page of attributes.
    pub const FIRST_ATTRIBUTES: usize = 9;
    /// Words of the header.
    pub const HEADER: usize = 10;
}

/// The number of a texture of so many, `u32::MAX` for none.
fn texture_number(texture: Option<u32>, count: usize) -> u32 {
    texture.filter(|&texture| (texture as usize) < count).unwrap_or(u32::MAX)
}

/// Words of a binding in the making.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Words {
    words: Vec<u32>,
}

impl Words {
    /// A header of so many places, all 0.
    #[must_use]
    pub fn new(header: usize) -> Self {
        Self { words: vec![0; header] }
    }

    /// Where the next word comes; 2^32 - 1 where that is further than a device can count.
    #[must_use]
    pub fn offset(&self) -> u32 {
        u32::try_from(self.words.len()).unwrap_or(u32::MAX)
    }

    /// Starts a section here: its place in the header takes its offset. Places beyond the words so far are ignored.
    pub fn section(&mut self, place: usize) {
        self.set(place, self.offset());
    }

    /// Replaces a word; one beyond the words so far is ignored.
    pub fn set(&mut self, at: usize, word: u32) {
        if let Some(old) = self.words.get_mut(at) {
            *old = word;
        }
    }

    /// Appends a word.
    pub fn u32(&mut self, word: u32) {
        self.words.push(word);
    }

    /// Appends several words.
    pub fn u32s(&mut self, words: &[u32]) {
        self.words.extend_from_slice(words);
    }

    /// Appends a number.
    pub fn f32(&mut self, number: f32) {
        self.u32(number.to_bits());
    }

    /// Appends several numbers.
    pub fn f32s(&mut self, numbers: &[f32]) {
        self.words.extend(numbers.iter().map(|number| number.to_bits()));
    }

    /// Appends two numbers.
    pub fn vec2(&mut self, v: Vec2) {
        self.f32s(&v.to_array());
    }

    /// Appends three numbers.
    pub fn vec3(&mut self, v: Vec3) {
        self.f32s(&v.to_array());
    }

    /// All words.
    #[must_use]
    pub fn finish(self) -> Vec<u32> {
        self.words
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_start_where_their_place_says() {
        let mut words = Words::new(2);
        words.section(1);
        words.vec3(Vec3::new(1.0, 2.0, -3.0));
        words.section(0);
        words.u32s(&[7, 8]);
        words.vec2(Vec2::new(0.5, 0.25));
        words.section(99);
        let words = words.finish();
        assert_eq!(words[..2], [5, 2]);
        assert_eq!(words[words[0] as usize..][..2], [7, 8]);
        assert_eq!(f32::from_bits(words[words[1] as usize + 2]), -3.0);
        assert_eq!(words.len(), 9);
    }
}
