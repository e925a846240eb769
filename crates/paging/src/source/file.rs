//! A file as source: positioned reads, past the kernel's page cache if wanted.

#[cfg(target_os = "linux")]
use super::direct::{self, DirectFile};
use super::{Source, SourceError};
use std::fs::File;
use std::io;
use std::path::Path;

/// What the kernel keeps of a file that is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KernelCache {
    /// As much as it likes: pages that come back come from memory that no budget of ours counts.
    #[default]
    Keep,
    /// Nothing, so that every read is a read of the disk (`O_DIRECT`); where the file system cannot do that, what was
    /// read is given up at once (`posix_fadvise`). On systems without either, the same as `Keep`.
    Bypass,
}

/// A file. Reads name their place, so that threads share it without a lock.
#[derive(Debug)]
pub struct FileSource {
    name: String,
    file: File,
    way: Way,
}

/// How a file is read.
#[derive(Debug)]
enum Way {
    /// Through the kernel's page cache.
    Plain,
    /// Past it.
    #[cfg(target_os = "linux")]
    Direct(DirectFile),
    /// Through it, and out of it at once.
    #[cfg(target_os = "linux")]
    Forget,
}

impl FileSource {
    /// Opens a file for reading.
    ///
    /// # Errors
    /// If it cannot be opened.
    pub fn open(path: &Path, cache: KernelCache) -> Result<Self, SourceError> {
        let name = path.display().to_string();
        let file = File::open(path).map_err(|e| io_error(&name, 0, &e))?;
        let way = Way::choose(path, &file, cache);
        Ok(Self { name, file, way })
    }

    /// True if reads go past the kernel's page cache.
    #[must_use]
    pub fn is_direct(&self) -> bool {
        #[cfg(target_os = "linux")]
        return matches!(self.way, Way::Direct(_));
        #[cfg(not(target_os = "linux"))]
        false
    }
}

impl Way {
    #[cfg(target_os = "linux")]
    fn choose(path: &Path, file: &File, cache: KernelCache) -> Self {
        match cache {
            KernelCache::Keep => Self::Plain,
            KernelCache::Bypass => match DirectFile::open(path) {
                Some(direct) => Self::Direct(direct),
                None => {
                    direct::expect_random(file);
                    Self::Forget
                }
            },
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn choose(_path: &Path, _file: &File, _cache: KernelCache) -> Self {
        Self::Plain
    }
}

impl Source for FileSource {
    fn read(&self, offset: u64, into: &mut [u8]) -> Result<(), SourceError> {
        let read = match &self.way {
            Way::Plain => read_exact_at(&self.file, into, offset),
            #[cfg(target_os = "linux")]
            Way::Direct(direct) => direct.read(offset, into),
            #[cfg(target_os = "linux")]
            Way::Forget => {
                let read = read_exact_at(&self.file, into, offset);
                direct::forget(&self.file, offset, into.len());
                read
            }
        };
        let end = offset.checked_add(into.len() as u64);
        read.map_err(|error| match self.bytes() {
            Ok(bytes) if end.is_none_or(|end| end > bytes) => {
                SourceError::behind_end(&self.name, offset, into.len(), bytes)
            }
            _ => io_error(&self.name, offset, &error),
        })
    }

    fn buffer_bytes(&self, readers: usize) -> usize {
        match &self.way {
            #[cfg(target_os = "linux")]
            Way::Direct(_) => readers * DirectFile::PIECE_BYTES,
            _ => 0,
        }
    }

    fn bytes(&self) -> Result<u64, SourceError> {
        self.file.metadata().map(|meta| meta.len()).map_err(|e| io_error(&self.name, 0, &e))
    }

    fn name(&self) -> &str {
        &self.name
    }
}

#[cfg(unix)]
fn read_exact_at(file: &File, into: &mut [u8], offset: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, into, offset)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut into: &mut [u8], mut offset: u64) -> io::Result<()> {
    while !into.is_empty() {
        let got = std::os::windows::fs::FileExt::seek_read(file, into, offset)?;
        if got == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        into = &mut into[got..];
        offset += got as u64;
    }
    Ok(())
}

fn io_error(name: &str, offset: u64, error: &io::Error) -> SourceError {
    let hint = match error.kind() {
        io::ErrorKind::NotFound => "check the path",
        io::ErrorKind::PermissionDenied => "check who may read the file",
        _ => "check the disk that the file is on",
    };
    SourceError { what: error.to_string(), name: name.to_owned(), offset, hint }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(count: usize) -> Vec<u8> {
        (0..count).map(|i| (i * 7 + i / 256) as u8).collect()
    }

    /// Reads of all alignments and lengths, up to the last byte and behind it, give what is in the file.
    fn check(source: &FileSource, all: &[u8]) {
        assert_eq!(source.bytes(), Ok(all.len() as u64));
        let places = [0, 1, 511, 4095, 4096, 4097, 8191, 1 << 20, all.len() - 1, all.len()];
        for far in [u64::MAX, u64::MAX - 70_000, i64::MAX as u64 - 5, 1 << 62] {
            let error = source.read(far, &mut [0; 4096]).expect_err("behind the end");
            assert!(error.what.contains("ends at byte"), "{error}");
        }
        for offset in places {
            for wanted in [0, 1, 4096, 5000, 70_000, (1 << 20) + 3, all.len() - offset] {
                let mut into = vec![0xee; wanted];
                let read = source.read(offset as u64, &mut into);
                if offset + wanted > all.len() {
                    let error = read.expect_err("behind the end");
                    assert!(error.what.contains("ends at byte"), "{error}");
                } else {
                    read.expect("inside");
                    assert!(into == all[offset..offset + wanted], "{offset} {wanted}");
                }
            }
        }
    }

    #[test]
    fn reads_what_is_there_whether_the_kernel_keeps_it_or_not() {
        let all = bytes((3 << 20) + 777);
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("pages");
        std::fs::write(&path, &all).expect("writes");
        for cache in [KernelCache::Keep, KernelCache::Bypass] {
            check(&FileSource::open(&path, cache).expect("opens"), &all);
        }
        #[cfg(target_os = "linux")]
        check(
            &FileSource { way: Way::Forget, ..FileSource::open(&path, KernelCache::Keep).expect("opens") },
            &all,
        );
    }

    #[test]
    fn a_file_that_is_not_there_is_an_error_with_its_name() {
        let error = FileSource::open(Path::new("/no/such.pages"), KernelCache::Bypass).expect_err("none");
        assert_eq!((error.name.as_str(), error.hint), ("/no/such.pages", "check the path"));
    }
}
