//! Reads past the kernel's page cache (`O_DIRECT`), and advice to it.
//!
//! A direct read starts and ends at multiples of a sector, in the file and in memory; so it goes through memory of our
//! own that is aligned, a piece at a time.

use rustix::fs::{Advice, OFlags, fadvise};
use std::fs::File;
use std::io;
use std::num::NonZeroU64;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Unit of place, length and memory of a direct read.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(4096))]
struct Sector([u8; Sector::BYTES]);

impl Sector {
    const BYTES: usize = 4096;
    const ZERO: Self = Self([0; Self::BYTES]);
}

/// Sectors of a piece, 1 MiB.
const PIECE: usize = 256;

/// A file that is read past the kernel's page cache.
pub(super) struct DirectFile {
    file: File,
    /// Memory for pieces that is not in use: as much as ever was in use at once.
    spare: Mutex<Vec<Box<[Sector]>>>,
}

impl std::fmt::Debug for DirectFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DirectFile").field("file", &self.file).finish_non_exhaustive()
    }
}

impl DirectFile {
    /// Memory that a read takes while it lasts.
    pub(super) const PIECE_BYTES: usize = PIECE * Sector::BYTES;

    /// Opens a file, unless its file system cannot be read past the cache.
    pub(super) fn open(path: &Path) -> Option<Self> {
        let flags = i32::try_from(OFlags::DIRECT.bits()).ok()?;
        let file = File::options().read(true).custom_flags(flags).open(path).ok()?;
        let direct = Self { file, spare: Mutex::default() };
        // Some file systems open and then refuse to read.
        direct.with_piece(|piece| direct.file.read_at(bytemuck::cast_slice_mut(&mut piece[..1]), 0)).ok()?;
        Some(direct)
    }

    /// Fills `into` with the bytes from `offset` on.
    pub(super) fn read(&self, offset: u64, into: &mut [u8]) -> io::Result<()> {
        self.with_piece(|piece| {
            let mut done = 0;
            while done < into.len() {
                let at = offset.checked_add(done as u64).ok_or(io::ErrorKind::UnexpectedEof)?;
                done += self.read_some(at, &mut into[done..], piece)?;
            }
            Ok(())
        })
    }

    /// Reads the start of what is wanted, as much as one piece gives.
    fn read_some(&self, at: u64, into: &mut [u8], piece: &mut [Sector]) -> io::Result<usize> {
        let skip = (at % Sector::BYTES as u64) as usize;
        let sectors = (skip + into.len()).div_ceil(Sector::BYTES).min(piece.len());
        let memory: &mut [u8] = bytemuck::cast_slice_mut(&mut piece[..sectors]);
        let got = loop {
            match self.file.read_at(memory, at - skip as u64) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                other => break other?,
            }
        };
        let new = got.saturating_sub(skip).min(into.len());
        if new == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        into[..new].copy_from_slice(&memory[skip..skip + new]);
        Ok(new)
    }

    fn with_piece<T>(&self, work: impl FnOnce(&mut [Sector]) -> T) -> T {
        let spare = || self.spare.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = spare().pop();
        let mut piece = kept.unwrap_or_else(|| vec![Sector::ZERO; PIECE].into());
        let result = work(&mut piece);
        spare().push(piece);
        result
    }
}

/// Tells the kernel not to read ahead. That is advice: it matters to nobody if it is not taken.
pub(super) fn expect_random(file: &File) {
    let _ = fadvise(file, 0, None, Advice::Random);
}

/// Asks the kernel to give up what it keeps of a part of a file. That too is advice.
pub(super) fn forget(file: &File, offset: u64, bytes: usize) {
    if let Some(bytes) = NonZeroU64::new(bytes as u64) {
        let _ = fadvise(file, offset, Some(bytes), Advice::DontNeed);
    }
}
