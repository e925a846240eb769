//! Cryptomatte, specification 1.2.0 (Friedman and Jones 2015, "Fully automatic ID mattes with support for motion blur
//! and transparency"): names hashed to floats, coverage ranks in pairs of channels, names in a manifest.

use std::collections::BTreeMap;

/// A matte layer: which names its ids stand for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cryptomatte {
    /// Layer name; its channels are `<layer>00.R` and so on.
    pub layer: String,
    /// Name to id (see [`name_hash`]), in the order of names.
    pub manifest: BTreeMap<String, u32>,
}

impl Cryptomatte {
    /// Ids kept for a pixel; two share four channels.
    pub const RANKS: usize = 6;

    /// A layer for the given names.
    pub fn new<'a>(layer: impl Into<String>, names: impl IntoIterator<Item = &'a str>) -> Self {
        let manifest = names.into_iter().map(|n| (n.to_owned(), name_hash(n))).collect();
        Self { layer: layer.into(), manifest }
    }

    /// The metadata of the layer: (attribute name, text).
    #[must_use]
    pub fn attributes(&self) -> Vec<(String, String)> {
        let id = format!("{:08x}", murmur3_32(self.layer.as_bytes(), 0));
        let attribute = |key: &str, text: String| (format!("cryptomatte/{}/{key}", &id[..7]), text);
        vec![
            attribute("name", self.layer.clone()),
            attribute("hash", "MurmurHash3_32".into()),
            attribute("conversion", "uint32_to_float32".into()),
            attribute("manifest", self.manifest_json()),
        ]
    }

    /// The manifest as the specification asks: a JSON object from name to eight hexadecimal digits.
    fn manifest_json(&self) -> String {
        let entries: Vec<String> =
            self.manifest.iter().map(|(name, id)| format!("{}:\"{id:08x}\"", json_string(name))).collect();
        format!("{{{}}}", entries.join(","))
    }
}

/// A JSON string literal in plain ASCII.
fn json_string(text: &str) -> String {
    let mut out = String::from("\"");
    for unit in text.encode_utf16() {
        match char::from_u32(u32::from(unit)) {
            Some(c @ ('"' | '\\')) => out.extend(['\\', c]),
            Some(c @ ' '..='~') => out.push(c),
            _ => out.push_str(&format!("\\u{unit:04x}")),
        }
    }
    out.push('"');
    out
}

/// The id of a name: a MurmurHash3 whose float (see [`float_from_hash`]) is a normal number. 0 stands for nothing.
///
/// The id is the bit pattern of the float, as the manifest lists it.
#[must_use]
pub fn name_hash(name: &str) -> u32 {
    float_from_hash(murmur3_32(name.as_bytes(), 0)).to_bits()
}

/// The specification's `uint32_to_float32`: the hash's bits as a float, its exponent moved off 0 and 255 so that it is
/// neither denormal nor infinite nor NaN.
#[must_use]
pub fn float_from_hash(hash: u32) -> f32 {
    let exponent = (hash >> 23 & 255).clamp(1, 254);
    f32::from_bits(hash & 0x807f_ffff | exponent << 23)
}

/// MurmurHash3, the 32-bit variant for x86 (Appleby 2011).
fn murmur3_32(data: &[u8], seed: u32) -> u32 {
    let scramble = |k: u32| k.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let mut hash = seed;
    let mut blocks = data.chunks_exact(4);
    for block in &mut blocks {
        hash ^= scramble(u32::from_le_bytes([block[0], block[1], block[2], block[3]]));
        hash = hash.rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let tail = blocks.remainder().iter().rev().fold(0, |k, &byte| k << 8 | u32::from(byte));
    hash ^= scramble(tail);
    hash ^= data.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_murmur3() {
        // Published vectors of MurmurHash3_x86_32.
        assert_eq!(murmur3_32(b"", 0), 0);
        assert_eq!(murmur3_32(b"", 1), 0x514e_28b7);
        assert_eq!(murmur3_32(b"hello", 0), 0x248b_fa47);
        assert_eq!(murmur3_32(b"hello, world", 0), 0x149b_bb7f);
        assert_eq!(murmur3_32(b"The quick brown fox jumps over the lazy dog", 0), 0x2e4f_f723);
        assert_ne!(murmur3_32(b"hellp", 0), 0x248b_fa47);
    }

    #[test]
    fn ids_are_normal_floats() {
        assert!(float_from_hash(0x7fff_ffff).is_normal());
        assert!(float_from_hash(0x0000_0001).is_normal());
        assert_eq!(float_from_hash(0x3f80_0000), 1.0);
    }

    #[test]
    fn attributes_follow_the_specification() {
        let matte = Cryptomatte::new("CryptoObject", ["b \"é\"", "a"]);
        let attributes = matte.attributes();
        // The id is the first seven digits of the layer name's hash, as other renderers write it too.
        assert_eq!(attributes[0].0, "cryptomatte/3ae39a5/name");
        assert!(attributes.iter().all(|(name, _)| name.len() <= 31));
        let expected = format!(
            "{{\"a\":\"{:08x}\",\"b \\\"\\u00e9\\\"\":\"{:08x}\"}}",
            name_hash("a"),
            name_hash("b \"é\"")
        );
        assert_eq!(attributes[3].1, expected);
    }
}
