//! Arrays in large pages.
//!
//! A build writes more memory than it reads, and most of what writing costs is the system's handing out of pages. Large
//! arrays therefore ask for large pages, which come 512 times less often.

use bytemuck::Pod;
use memmap2::MmapMut;
use std::fmt;
use std::ops::{Deref, DerefMut};

/// Smaller arrays live on the heap.
const LARGE_BYTES: usize = 4 << 20;

/// An array of fixed length, zero at first, in memory of its own.
pub struct Pages<T>(Room<T>);

enum Room<T> {
    Heap(Vec<T>),
    /// A map and the number of elements in it.
    Map(MmapMut, usize),
}

impl<T: Pod> Pages<T> {
    /// `len` elements, all bits zero. Pages are handed out when they are touched.
    #[must_use]
    pub fn zeroed(len: usize) -> Self {
        let bytes = len.saturating_mul(size_of::<T>());
        if bytes >= LARGE_BYTES
            && let Ok(map) = MmapMut::map_anon(bytes)
        {
            // Without large pages it works as well.
            #[cfg(target_os = "linux")]
            let _ = map.advise(memmap2::Advice::HugePage);
            return Self(Room::Map(map, len));
        }
        Self(Room::Heap(bytemuck::zeroed_vec(len)))
    }

    /// Makes it `len` elements long, which hold anything. Its memory stays where that suffices.
    pub(crate) fn set_len(&mut self, len: usize) {
        match &mut self.0 {
            Room::Heap(elements) if len <= elements.capacity() => elements.resize(len, T::zeroed()),
            Room::Map(map, own) if len.saturating_mul(size_of::<T>()) <= map.len() => *own = len,
            _ => *self = Self::zeroed(len),
        }
    }
}

impl<T: Pod> Deref for Pages<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.0 {
            Room::Heap(elements) => elements,
            Room::Map(map, len) => bytemuck::cast_slice(&map[..len * size_of::<T>()]),
        }
    }
}

impl<T: Pod> DerefMut for Pages<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Room::Heap(elements) => elements,
            Room::Map(map, len) => bytemuck::cast_slice_mut(&mut map[..*len * size_of::<T>()]),
        }
    }
}

impl<T: Pod> Default for Pages<T> {
    fn default() -> Self {
        Self(Room::Heap(Vec::new()))
    }
}

impl<T: Pod> Clone for Pages<T> {
    fn clone(&self) -> Self {
        let mut copy = Self::zeroed(self.len());
        copy.copy_from_slice(self);
        copy
    }
}

impl<T: Pod + fmt::Debug> fmt::Debug for Pages<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_large_arrays_hold_what_is_written() {
        for len in [0, 1, 1000, 3_000_001] {
            let mut pages = Pages::<u32>::zeroed(len);
            assert!(pages.len() == len && pages.iter().all(|&x| x == 0));
            pages.iter_mut().zip(1..).for_each(|(x, i)| *x = i);
            let copy = pages.clone();
            assert!(copy.iter().zip(1..).all(|(&x, i)| x == i) && copy.len() == len);
        }
    }

    #[test]
    fn arrays_change_their_length_within_their_memory() {
        for len in [1000, 3_000_001] {
            let mut pages = Pages::<u32>::zeroed(len);
            let start = pages.as_ptr();
            for next in [len / 2, 0, len - 1, len] {
                pages.set_len(next);
                assert_eq!((pages.len(), pages.as_ptr()), (next, start));
            }
            pages.set_len(4 * len);
            assert_eq!(pages.len(), 4 * len);
        }
    }
}
