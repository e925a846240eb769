//! Numbers as they stand in files.

use crate::{Exact, ExactUnit};

/// A number of a plane.
pub(super) trait Number: Copy {
    /// Length in a file.
    const BYTES: usize;

    fn put(self, out: &mut Vec<u8>);

    /// The number in the first [`Self::BYTES`] of `bytes`, which are there.
    fn get(bytes: &[u8]) -> Self;
}

/// The first bytes of a slice that has as many.
pub(super) fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(&bytes[..N]);
    array
}

impl Number for u32 {
    const BYTES: usize = 4;

    fn put(self, out: &mut Vec<u8>) {
        out.extend(self.to_le_bytes());
    }

    fn get(bytes: &[u8]) -> Self {
        Self::from_le_bytes(first(bytes))
    }
}

impl Number for Exact {
    const BYTES: usize = 16;

    fn put(self, out: &mut Vec<u8>) {
        out.extend(self.units().to_le_bytes());
    }

    fn get(bytes: &[u8]) -> Self {
        Self::from_units(i128::from_le_bytes(first(bytes)))
    }
}

impl Number for ExactUnit {
    const BYTES: usize = 8;

    fn put(self, out: &mut Vec<u8>) {
        out.extend(self.units().to_le_bytes());
    }

    fn get(bytes: &[u8]) -> Self {
        Self::from_units(i64::from_le_bytes(first(bytes)))
    }
}

impl<N: Number> Number for [N; 3] {
    const BYTES: usize = 3 * N::BYTES;

    fn put(self, out: &mut Vec<u8>) {
        self.into_iter().for_each(|number| number.put(out));
    }

    fn get(bytes: &[u8]) -> Self {
        [0, 1, 2].map(|i| N::get(&bytes[i * N::BYTES..]))
    }
}
