//! What a pack has done so far, in a file beside the store: a pack that was killed goes on from there.
//!
//! ```text
//! magic       8 bytes
//! frame       length u64, CRC-32 u32, then runs of bytes, each behind its length u64: what the journal belongs to
//! frames      the same, each a step that was done
//! ```
//!
//! A step is written after its pages are in the file. What is left of a step that was cut short has a wrong checksum,
//! and is not believed.

use std::fs::{File, OpenOptions};
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;

const MAGIC: &[u8; 8] = b"vastjrn2";
/// Bytes of a frame before its contents.
const FRAME: usize = 12;
/// Bytes before a run.
const LENGTH: usize = 8;
/// Longest frame that is believed.
const LONGEST: u64 = 1 << 36;

/// Steps that are done.
#[derive(Debug)]
pub(crate) struct Journal {
    file: File,
    /// Where the first step begins.
    first: u64,
}

impl Journal {
    /// Opens the journal at `path`; begins a new one unless there is one of the same `fingerprint`. Whether there was.
    pub(crate) fn open(path: &Path, fingerprint: &[u8]) -> std::io::Result<(Self, bool)> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let first = (MAGIC.len() + FRAME + LENGTH + fingerprint.len()) as u64;
        let mut journal = Self { file, first };
        let same = journal.belongs_to(fingerprint)?;
        if !same {
            journal.file.set_len(0)?;
            journal.file.seek(SeekFrom::Start(0))?;
            journal.file.write_all(MAGIC)?;
            journal.append(&[fingerprint])?;
        }
        Ok((journal, same))
    }

    fn belongs_to(&mut self, fingerprint: &[u8]) -> std::io::Result<bool> {
        let mut reader = BufReader::new(&self.file);
        let mut magic = [0; 8];
        let begins = reader.read_exact(&mut magic).is_ok() && &magic == MAGIC;
        Ok(begins && read_frame(&mut reader).is_some_and(|found| split_runs(&found) == Some([fingerprint])))
    }

    /// Calls `each` with every step, as long as that returns true; steps from there on are forgotten.
    pub(crate) fn replay(&mut self, mut each: impl FnMut(&[u8]) -> bool) -> std::io::Result<()> {
        self.file.seek(SeekFrom::Start(self.first))?;
        let mut reader = BufReader::with_capacity(1 << 18, &self.file);
        let mut end = self.first;
        while let Some(step) = read_frame(&mut reader) {
            if !each(&step) {
                break;
            }
            end += (FRAME + step.len()) as u64;
        }
        self.file.set_len(end)?;
        self.file.seek(SeekFrom::Start(end)).map(|_| ())
    }

    /// Notes a step: runs of bytes, which [`split_runs`] finds again.
    pub(crate) fn append(&mut self, runs: &[&[u8]]) -> std::io::Result<()> {
        let lengths: Vec<[u8; LENGTH]> = runs.iter().map(|run| (run.len() as u64).to_le_bytes()).collect();
        let parts = || lengths.iter().zip(runs).flat_map(|(length, run)| [&length[..], run]);
        let mut crc32 = crc32fast::Hasher::new();
        parts().for_each(|part| crc32.update(part));
        let length: usize = parts().map(<[u8]>::len).sum();
        let mut file = BufWriter::with_capacity(1 << 16, &self.file);
        file.write_all(&(length as u64).to_le_bytes())?;
        file.write_all(&crc32.finalize().to_le_bytes())?;
        parts().try_for_each(|part| file.write_all(part))?;
        file.flush()
    }
}

/// The next frame; none where there is none that is whole.
fn read_frame(reader: &mut impl Read) -> Option<Vec<u8>> {
    let mut head = [0; FRAME];
    reader.read_exact(&mut head).ok()?;
    let length = u64::from_le_bytes(*head.first_chunk()?);
    let crc32 = u32::from_le_bytes(*head[8..].first_chunk()?);
    let mut bytes = Vec::new();
    reader.take(length.min(LONGEST)).read_to_end(&mut bytes).ok()?;
    (bytes.len() as u64 == length && crc32fast::hash(&bytes) == crc32).then_some(bytes)
}

/// The runs of a step, if there are exactly `N`.
pub(crate) fn split_runs<const N: usize>(mut bytes: &[u8]) -> Option<[&[u8]; N]> {
    let mut runs = [&[][..]; N];
    for run in &mut runs {
        let (length, rest) = bytes.split_first_chunk()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        (*run, bytes) = rest.split_at_checked(length)?;
    }
    bytes.is_empty().then_some(runs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(journal: &mut Journal) -> Vec<Vec<u8>> {
        let mut steps = Vec::new();
        journal
            .replay(|step| {
                steps.push(step.to_vec());
                true
            })
            .expect("reads");
        steps
    }

    #[test]
    fn what_was_cut_short_or_belongs_to_another_source_is_forgotten() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal");
        let (mut journal, found) = Journal::open(&path, b"a scene").expect("opens");
        assert!(!found);
        [&b"one"[..], b"", b"three"].into_iter().for_each(|step| journal.append(&[step]).expect("writes"));
        let whole = std::fs::read(&path).expect("reads");
        let expected = [&b"one"[..], b"", b"three"];
        for cut in 0..=whole.len() {
            std::fs::write(&path, &whole[..cut]).expect("writes");
            let (mut journal, found) = Journal::open(&path, b"a scene").expect("opens");
            let steps = steps(&mut journal);
            let found_runs = steps.iter().map(|step| split_runs(step).expect("a run"));
            assert!(steps.len() <= 3 && found_runs.eq(expected[..steps.len()].iter().map(|run| [*run])));
            assert_eq!(found, cut >= 8 + FRAME + LENGTH + 7);
            assert_eq!(steps.len() == 3, cut == whole.len());
        }
        std::fs::write(&path, &whole).expect("writes");
        let (mut journal, found) = Journal::open(&path, b"another").expect("opens");
        assert!(!found && steps(&mut journal).is_empty());
    }

    #[test]
    fn runs_are_found_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let (mut journal, _) = Journal::open(&folder.path().join("journal"), b"").expect("opens");
        let runs = [&b"ab"[..], b"", b"cde"];
        journal.append(&runs).expect("writes");
        let bytes = steps(&mut journal).remove(0);
        assert_eq!(split_runs(&bytes), Some(runs));
        assert_eq!(split_runs::<2>(&bytes), None);
        assert_eq!(split_runs::<3>(&bytes[..bytes.len() - 1]), None);
    }
}
