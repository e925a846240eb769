//! A source in memory: small scenes, and tests.

use super::{Source, SourceError};
use std::sync::Arc;

/// Bytes in memory.
#[derive(Clone, Debug)]
pub struct MemorySource {
    name: String,
    bytes: Arc<[u8]>,
}

impl MemorySource {
    /// A source of these bytes.
    #[must_use]
    pub fn new(name: &str, bytes: impl Into<Arc<[u8]>>) -> Self {
        Self { name: name.to_owned(), bytes: bytes.into() }
    }
}

impl Source for MemorySource {
    fn read(&self, offset: u64, into: &mut [u8]) -> Result<(), SourceError> {
        let behind = || SourceError::behind_end(&self.name, offset, into.len(), self.bytes.len() as u64);
        let first = usize::try_from(offset).map_err(|_| behind())?;
        let end = first.checked_add(into.len()).ok_or_else(behind)?;
        let from = self.bytes.get(first..end).ok_or_else(behind)?;
        into.copy_from_slice(from);
        Ok(())
    }

    fn bytes(&self) -> Result<u64, SourceError> {
        Ok(self.bytes.len() as u64)
    }

    fn name(&self) -> &str {
        &self.name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gives_what_it_holds_and_nothing_behind_it() {
        let source = MemorySource::new("m", vec![1, 2, 3, 4]);
        let mut two = [0; 2];
        source.read(2, &mut two).expect("inside");
        assert_eq!((two, source.bytes()), ([3, 4], Ok(4)));
        for offset in [3, 4, 5, u64::MAX - 1, u64::MAX] {
            let error = source.read(offset, &mut two).expect_err("behind");
            assert_eq!((error.offset, error.name.as_str()), (offset, "m"));
        }
        assert_eq!(source.read(4, &mut []), Ok(()));
    }
}
