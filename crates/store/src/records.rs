//! Records of equal size in a temporary file without a name: written one after the other, read at any place through a
//! small cache.

use crate::error::StoreError;
use bytemuck::{Pod, cast_slice};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Bytes that are gathered before they are written.
const GATHERED: usize = 1 << 18;
/// Records of a block of the cache.
const BLOCK: usize = 256;

/// A file of records, each of which is `words` numbers of 32 bits.
#[derive(Debug)]
pub(crate) struct Records {
    folder: Box<Path>,
    file: File,
    words: usize,
    /// Words on their way to the file's end.
    gathered: Vec<u32>,
    /// Words in the file.
    written: u64,
    lines: Vec<Line>,
}

/// A block of the file in memory.
#[derive(Clone, Debug, Default)]
struct Line {
    /// Number of the block, and one more; 0 for none.
    block: u64,
    words: Vec<u32>,
}

impl Records {
    /// No records, in the file system of `folder`. The system takes the file away when the process ends, however it ends.
    pub(crate) fn new(folder: &Path, words: usize) -> Result<Self, StoreError> {
        let file = tempfile::tempfile_in(folder).map_err(|error| StoreError::write(folder, &error))?;
        Ok(Self { folder: folder.into(), file, words, gathered: Vec::new(), written: 0, lines: Vec::new() })
    }

    /// Number of records.
    pub(crate) fn len(&self) -> u64 {
        (self.written + self.gathered.len() as u64) / self.words.max(1) as u64
    }

    /// Bytes of all records.
    pub(crate) fn bytes(&self) -> u64 {
        4 * (self.written + self.gathered.len() as u64)
    }

    /// Adds records.
    pub(crate) fn push<T: Pod>(&mut self, records: &[T]) -> Result<(), StoreError> {
        self.gathered.extend_from_slice(cast_slice(records));
        if 4 * self.gathered.len() >= GATHERED { self.flush() } else { Ok(()) }
    }

    /// Brings all that was added into the file.
    pub(crate) fn flush(&mut self) -> Result<(), StoreError> {
        if self.gathered.is_empty() {
            return Ok(());
        }
        let write = |file: &mut File, words: &[u32], at: u64| {
            file.seek(SeekFrom::Start(4 * at))?;
            file.write_all(cast_slice(words))
        };
        write(&mut self.file, &self.gathered, self.written)
            .map_err(|e| StoreError::write(&self.folder, &e))?;
        self.written += self.gathered.len() as u64;
        self.gathered.clear();
        Ok(())
    }

    /// Gives the disk back.
    pub(crate) fn clear(&mut self) -> Result<(), StoreError> {
        self.gathered = Vec::new();
        self.lines = Vec::new();
        self.written = 0;
        self.file.set_len(0).map_err(|e| StoreError::write(&self.folder, &e))
    }

    /// Writes records over those from number `first` on, or behind the last.
    pub(crate) fn put<T: Pod>(&mut self, first: u64, records: &[T]) -> Result<(), StoreError> {
        let words: &[u32] = cast_slice(records);
        let at = first * self.words as u64;
        let mut put = || {
            self.file.seek(SeekFrom::Start(4 * at))?;
            self.file.write_all(cast_slice(words))
        };
        put().map_err(|e| StoreError::write(&self.folder, &e))?;
        self.written = self.written.max(at + words.len() as u64);
        Ok(())
    }

    /// Reads records from number `first` on, as many as `out` has room for.
    pub(crate) fn read<T: Pod>(&mut self, first: u64, out: &mut [T]) -> Result<(), StoreError> {
        self.flush()?;
        let mut read = || {
            self.file.seek(SeekFrom::Start(4 * first * self.words as u64))?;
            self.file.read_exact(bytemuck::cast_slice_mut(out))
        };
        read().map_err(|e| StoreError::read(&self.folder, &e))
    }

    /// Lets [`get`](Self::get) use about so many bytes; what it had in memory is dropped.
    pub(crate) fn cache(&mut self, bytes: usize) -> Result<(), StoreError> {
        self.flush()?;
        let blocks = self.len().div_ceil(BLOCK as u64).max(1) as usize;
        let lines = (bytes / (4 * self.words.max(1) * BLOCK)).clamp(1, blocks);
        self.lines = vec![Line::default(); lines];
        Ok(())
    }

    /// Whether [`cache`](Self::cache) was called.
    pub(crate) fn has_cache(&self) -> bool {
        !self.lines.is_empty()
    }

    /// A record, through the cache.
    #[inline]
    pub(crate) fn get(&mut self, number: u64) -> Result<&[u32], StoreError> {
        let (block, place) = (number / BLOCK as u64, number as usize % BLOCK);
        let slot = (block % self.lines.len().max(1) as u64) as usize;
        let end = (place + 1) * self.words;
        // The last block of a file that still grows may have more by now.
        if self.lines.get(slot).is_none_or(|line| line.block != block + 1 || line.words.len() < end) {
            self.load(block, slot)?;
        }
        let words = self.lines[slot].words.get(end - self.words..end);
        words.ok_or_else(|| StoreError::read(&self.folder, &std::io::ErrorKind::UnexpectedEof.into()))
    }

    fn load(&mut self, block: u64, slot: usize) -> Result<(), StoreError> {
        if self.lines.is_empty() {
            self.cache(0)?;
        }
        let first = block * BLOCK as u64;
        let records = self.len().saturating_sub(first).min(BLOCK as u64) as usize;
        let mut words = std::mem::take(&mut self.lines[slot].words);
        words.resize(records * self.words, 0);
        self.read(first, &mut words)?;
        self.lines[slot] = Line { block: block + 1, words };
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_read_back_through_caches_of_any_size() {
        let mut records = Records::new(&std::env::temp_dir(), 3).expect("a file");
        let all: Vec<[u32; 3]> = (0..100_000_u32).map(|i| [i, i ^ 7, i.wrapping_mul(3)]).collect();
        all.chunks(777).for_each(|some| records.push(some).expect("writes"));
        assert_eq!((records.len(), records.bytes()), (100_000, 1_200_000));
        for bytes in [0, 10_000, 1 << 24] {
            records.cache(bytes).expect("flushes");
            for i in (0..100_000_u64).map(|i| i * 7919 % 100_000) {
                assert_eq!(records.get(i).expect("reads"), all[i as usize]);
            }
        }
        records.put(5, &[[1_u32, 2, 3]]).expect("writes");
        let mut out = [[0_u32; 3]; 2];
        records.read(4, &mut out).expect("reads");
        assert_eq!(out, [all[4], [1, 2, 3]]);
        assert!(records.get(100_000).is_err() && records.read(99_999, &mut out).is_err());
    }
}
