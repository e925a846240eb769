//! Buffers compressed by meshoptimizer, as the appendix of EXT_meshopt_compression (and its successor
//! KHR_meshopt_compression) specifies the bit streams.

mod attributes;
mod filters;
mod indices;

#[cfg(test)]
mod tests;

use crate::{ImportError, Limits};

/// What a compressed buffer holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshoptMode {
    /// Elements of any kind, compressed byte by byte.
    Attributes,
    /// A triangle list.
    Triangles,
    /// Any sequence of indices.
    Indices,
}

/// What is done to decoded attributes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshoptFilter {
    /// Nothing.
    None,
    /// Unit vectors from octahedral coordinates; strides 4 and 8.
    Octahedral,
    /// Unit quaternions from their three smallest components; stride 8.
    Quaternion,
    /// Floats from a shared exponent and a mantissa; strides that are multiples of 4.
    Exponential,
    /// RGBA from luma and chroma; strides 4 and 8.
    Color,
}

/// Decodes `count` elements of `stride` bytes. `place` is for messages.
///
/// Indices come out with `stride` bytes each (2 or 4), little-endian.
///
/// # Errors
/// The stream is malformed, of an unknown version, or the result is beyond the limits.
pub fn meshopt(
    bytes: &[u8],
    count: usize,
    stride: usize,
    mode: MeshoptMode,
    filter: MeshoptFilter,
    limits: &Limits,
    place: &str,
) -> Result<Vec<u8>, ImportError> {
    let size = (count as u64).saturating_mul(stride as u64);
    limits.check_count(size, limits.decoded_bytes, "bytes of compressed elements", place)?;
    let decoded = match mode {
        MeshoptMode::Attributes => attributes::decode(bytes, count, stride).and_then(|mut elements| {
            filters::apply(filter, &mut elements, stride)?;
            Ok(elements)
        }),
        _ if filter != MeshoptFilter::None => Err("indices take no filter"),
        MeshoptMode::Triangles => indices::triangles(bytes, count).and_then(|i| indices::narrow(i, stride)),
        MeshoptMode::Indices => indices::sequence(bytes, count).and_then(|i| indices::narrow(i, stride)),
    };
    decoded.map_err(|what| ImportError::malformed(format!("meshopt: {what}"), place))
}

/// A cursor over a stream that may end too early.
#[derive(Debug)]
struct Bytes<'a>(&'a [u8]);

/// What is wrong with a stream.
type Fault = &'static str;

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or("the stream is too short")?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, Fault> {
        Ok(self.take(1)?[0])
    }
}
