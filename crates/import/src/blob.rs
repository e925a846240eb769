//! Bytes of a file or of a part of it, in memory or read when they are needed.

use crate::{ImportError, Limits};
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufReader, Error, ErrorKind, Read, Result, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Files of at most so many bytes are kept in memory.
pub(crate) const MOST_IN_MEMORY: u64 = 1 << 20;

/// A run of bytes; copies of it share them.
#[derive(Clone, Debug)]
pub(crate) struct Blob {
    place: Place,
    range: Range<u64>,
}

#[derive(Clone, Debug)]
enum Place {
    Memory(Arc<Vec<u8>>),
    File(Arc<Mutex<File>>),
}

impl From<Vec<u8>> for Blob {
    fn from(bytes: Vec<u8>) -> Self {
        let range = 0..bytes.len() as u64;
        Self { place: Place::Memory(Arc::new(bytes)), range }
    }
}

impl Blob {
    /// A regular file of at most `limit` bytes, which stays on disk if it has more than `in_memory`.
    pub(crate) fn open(path: &Path, limit: u64, in_memory: u64) -> Result<Self> {
        let (mut file, length) = open_file(path, limit)?;
        if length > in_memory {
            return Ok(Self { place: Place::File(Arc::new(Mutex::new(file))), range: 0..length });
        }
        read_exactly(&mut file, length as usize).map(Self::from)
    }

    /// Number of bytes.
    pub(crate) fn len(&self) -> u64 {
        self.range.end - self.range.start
    }

    /// A part; `None` if it is not within this one.
    pub(crate) fn part(&self, start: u64, length: u64) -> Option<Self> {
        let start = self.range.start.checked_add(start)?;
        let end = start.checked_add(length).filter(|&end| end <= self.range.end)?;
        Some(Self { place: self.place.clone(), range: start..end })
    }

    /// Some of the bytes.
    ///
    /// # Errors
    /// They are not there, the file cannot be read, or there is no memory for them.
    pub(crate) fn read(&self, start: u64, length: u64) -> Result<Cow<'_, [u8]>> {
        let Some(Self { range, .. }) = self.part(start, length) else {
            return Err(ErrorKind::UnexpectedEof.into());
        };
        match &self.place {
            Place::Memory(bytes) => {
                let bytes = bytes.get(range.start as usize..range.end as usize);
                bytes.map(Cow::Borrowed).ok_or_else(|| ErrorKind::UnexpectedEof.into())
            }
            Place::File(file) => {
                let mut file = file.lock().map_err(|_| Error::other("a reader of the file failed"))?;
                file.seek(SeekFrom::Start(range.start))?;
                read_exactly(&mut file, length as usize).map(Cow::Owned)
            }
        }
    }

    /// A reader that begins with the first byte.
    pub(crate) fn reader(&self) -> BufReader<impl Read + Seek + Send + use<>> {
        BufReader::with_capacity(1 << 16, Reader { blob: self.clone(), at: 0 })
    }

    /// All bytes.
    ///
    /// # Errors
    /// Those of [`read`](Self::read).
    pub(crate) fn bytes(&self) -> Result<Cow<'_, [u8]>> {
        self.read(0, self.len())
    }
}

/// Opens a regular file of at most `limit` bytes; and its length. What a scene names may be a pipe or a device, and opening one or
/// reading it to its end may take for ever.
pub(crate) fn open_file(path: &Path, limit: u64) -> Result<(File, u64)> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(Error::other("it is no regular file"));
    }
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    if length > limit {
        return Err(Error::other(format!("{length} bytes are more than the limit of {limit}")));
    }
    Ok((file, length))
}

/// The same within the limits of files, as the error of an importer.
pub(crate) fn open_within(path: &Path, limits: &Limits) -> std::result::Result<(File, u64), ImportError> {
    let (file, bytes) = open_file(path, u64::MAX).map_err(|e| ImportError::io(&e, path))?;
    limits.check_count(bytes, limits.file_bytes, "bytes", &path.display().to_string())?;
    Ok((file, bytes))
}

/// Reads a blob from anywhere in it.
struct Reader {
    blob: Blob,
    at: u64,
}

impl Read for Reader {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        let count = self.blob.len().saturating_sub(self.at).min(into.len() as u64);
        if count == 0 {
            return Ok(0);
        }
        into[..count as usize].copy_from_slice(&self.blob.read(self.at, count)?);
        self.at += count;
        Ok(count as usize)
    }
}

impl Seek for Reader {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => self.blob.len().checked_add_signed(by),
        };
        self.at = at.ok_or(ErrorKind::InvalidInput)?;
        Ok(self.at)
    }
}

fn read_exactly(file: &mut File, length: usize) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(length)?;
    file.take(length as u64).read_to_end(&mut bytes)?;
    if bytes.len() < length { Err(ErrorKind::UnexpectedEof.into()) } else { Ok(bytes) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Opening a pipe that nobody writes to would wait for ever, and devices have no end.
    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe.obj");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        let mut paths = vec![Path::new("/dev/zero").to_owned()];
        match made {
            Ok(status) if status.success() => paths.push(pipe),
            _ => println!("skipped: mkfifo makes no pipe here"),
        }
        for path in paths {
            let error = open_within(&path, &Limits::default()).expect_err("no regular file");
            assert_eq!(error.what, "it is no regular file");
            assert!(crate::load(&path, &crate::LoadOptions::default()).is_err());
            assert!(crate::load_ies(&path, &Limits::default(), &mut Default::default()).is_err());
        }
        let scene = folder.path().join("scene.obj");
        std::fs::write(&scene, "mtllib pipe.obj\nmtllib /dev/zero\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
            .expect("written");
        let desc =
            crate::load(&scene, &crate::LoadOptions::default()).expect("a scene without its libraries");
        assert_eq!(desc.diagnostics.items().len(), 2, "{:?}", desc.diagnostics);
    }

    #[test]
    fn a_file_on_disk_is_read_as_one_in_memory() {
        let path = std::env::temp_dir().join(format!("vastlight-blob-{}", std::process::id()));
        let bytes: Vec<u8> = (0..200).collect();
        std::fs::write(&path, &bytes).expect("written");
        assert!(Blob::open(&path, 199, 0).is_err() && Blob::open(Path::new("/"), 1 << 20, 0).is_err());
        let blobs = [0, 1000].map(|most| Blob::open(&path, 200, most).expect("opened"));
        for blob in blobs {
            let part = blob.part(50, 100).expect("a part").part(10, 20).expect("a part of it");
            assert_eq!((blob.len(), part.len()), (200, 20));
            assert_eq!(&*blob.bytes().expect("read"), &bytes);
            assert_eq!(&*part.bytes().expect("read"), &bytes[60..80]);
            assert_eq!(&*part.read(5, 3).expect("read"), &bytes[65..68]);
            assert!(part.part(10, 11).is_none() && part.part(u64::MAX, 2).is_none());
            assert!(part.read(20, 1).is_err());
            let (mut reader, mut read) = (part.reader(), Vec::new());
            assert_eq!(reader.seek(SeekFrom::End(-5)).expect("sought"), 15);
            assert_eq!(reader.read_to_end(&mut read).expect("read"), 5);
            assert_eq!((&read[..], reader.seek(SeekFrom::Start(30)).expect("sought")), (&bytes[75..80], 30));
            assert_eq!(reader.read(&mut [0; 4]).expect("behind the end"), 0);
            assert!(reader.seek(SeekFrom::Current(-31)).is_err());
        }
        let cut = Blob::open(&path, 200, 0).expect("opened");
        std::fs::write(&path, &bytes[..100]).expect("written");
        assert!(cut.read(90, 20).is_err() && cut.read(80, 20).is_ok());
        std::fs::remove_file(&path).expect("removed");
    }
}
