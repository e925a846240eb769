//! A source that fails when it is told to, for tests of whatever reads.

use super::{Source, SourceError};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The read fails.
    Error,
    /// The read claims to succeed, but fills only the first half.
    Short,
    /// The read succeeds with one wrong bit, in the first byte that it covers from this place of the source on.
    Flip(u64),
    /// The read takes longer by so much.
    Delay(Duration),
    /// This read and all later ones fail: the source is gone.
    Vanish,
}

/// Which reads go wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// The read of this number; the first is 0.
    Read(u64),
    /// Each so-manieth read, beginning with the first; never if 0.
    Every(u64),
    /// Reads that cover this byte of the source.
    Covers(u64),
    /// All reads.
    Always,
}

/// A source that hands on what another one gives, with faults.
#[derive(Debug)]
pub struct Faulty {
    inner: Arc<dyn Source>,
    faults: Vec<(When, Fault)>,
    reads: AtomicU64,
    gone_from: AtomicU64,
}

impl Faulty {
    /// A source with all of these faults.
    #[must_use]
    pub fn new(inner: Arc<dyn Source>, faults: Vec<(When, Fault)>) -> Self {
        Self { inner, faults, reads: AtomicU64::new(0), gone_from: AtomicU64::new(u64::MAX) }
    }

    /// Number of reads so far, those that failed too.
    #[must_use]
    pub fn reads(&self) -> u64 {
        self.reads.load(Ordering::Relaxed)
    }

    fn fail(&self, offset: u64, what: &str) -> SourceError {
        let name = self.inner.name().to_owned();
        SourceError { what: what.to_owned(), name, offset, hint: "the fault was asked for" }
    }

    fn apply(&self, fault: Fault, read: u64, offset: u64, into: &mut [u8]) -> Result<(), SourceError> {
        match fault {
            Fault::Error => return Err(self.fail(offset, "a read that fails")),
            Fault::Vanish => {
                self.gone_from.fetch_min(read, Ordering::Relaxed);
                return Err(self.fail(offset, "the source is gone"));
            }
            Fault::Delay(time) => std::thread::sleep(time),
            Fault::Short => {
                let half = into.len() / 2;
                into[half..].fill(0xa5);
            }
            Fault::Flip(place) => {
                if let Some(byte) = into.get_mut(place.saturating_sub(offset) as usize) {
                    *byte ^= 0x10;
                }
            }
        }
        Ok(())
    }
}

impl When {
    fn holds(self, read: u64, offset: u64, bytes: usize) -> bool {
        match self {
            Self::Read(number) => read == number,
            Self::Every(step) => step > 0 && read.is_multiple_of(step),
            Self::Covers(place) => place >= offset && place - offset < bytes as u64,
            Self::Always => true,
        }
    }
}

impl Source for Faulty {
    fn read(&self, offset: u64, into: &mut [u8]) -> Result<(), SourceError> {
        let read = self.reads.fetch_add(1, Ordering::Relaxed);
        if read >= self.gone_from.load(Ordering::Relaxed) {
            return Err(self.fail(offset, "the source is gone"));
        }
        self.inner.read(offset, into)?;
        let due = |when: When| when.holds(read, offset, into.len());
        let faults: Vec<Fault> = self.faults.iter().filter(|(when, _)| due(*when)).map(|(_, f)| *f).collect();
        faults.into_iter().try_for_each(|fault| self.apply(fault, read, offset, into))
    }

    fn bytes(&self) -> Result<u64, SourceError> {
        self.inner.bytes()
    }

    fn name(&self) -> &str {
        self.inner.name()
    }

    fn buffer_bytes(&self, readers: usize) -> usize {
        self.inner.buffer_bytes(readers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::MemorySource;

    fn read(source: &Faulty, offset: u64) -> Result<[u8; 4], SourceError> {
        let mut into = [0; 4];
        source.read(offset, &mut into).map(|()| into)
    }

    #[test]
    fn each_fault_comes_when_it_is_due_and_not_else() {
        let inner = Arc::new(MemorySource::new("m", vec![1; 16]));
        let faults = vec![
            (When::Read(1), Fault::Error),
            (When::Read(2), Fault::Short),
            (When::Covers(13), Fault::Flip(13)),
            (When::Read(5), Fault::Vanish),
            (When::Every(0), Fault::Error),
        ];
        let source = Faulty::new(inner, faults);
        assert_eq!(read(&source, 0), Ok([1; 4]));
        assert!(read(&source, 0).is_err());
        assert_eq!(read(&source, 0), Ok([1, 1, 0xa5, 0xa5]));
        assert_eq!(read(&source, 12), Ok([1, 0x11, 1, 1]));
        assert_eq!(read(&source, 9), Ok([1; 4]));
        assert!(read(&source, 0).is_err() && read(&source, 0).is_err());
        assert_eq!(source.reads(), 7);
    }
}
