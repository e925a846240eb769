//! What a pack has done so far, in a file beside the store: a pack that was killed goes on from there.
//!
//! ```text
//! magic       8 bytes
//! frame       length u64, CRC-32 u32, then what the journal belongs to: source and settings
//! frames      the same, each a step that was done
//! ```
//!
//! A step is written after its pages are in the file. What is left of a step that was cut short has a wrong checksum,
//! and is not believed.

use std::fs::{File, OpenOptions};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::Path;

const MAGIC: &[u8; 8] = b"vastjrn1";
/// Bytes of a frame before its contents.
const FRAME: usize = 12;
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
        let first = (MAGIC.len() + FRAME + fingerprint.len()) as u64;
        let mut journal = Self { file, first };
        let same = journal.belongs_to(fingerprint)?;
        if !same {
            journal.file.set_len(0)?;
            journal.file.seek(SeekFrom::Start(0))?;
            journal.file.write_all(MAGIC)?;
            journal.append(fingerprint)?;
        }
        Ok((journal, same))
    }

    fn belongs_to(&mut self, fingerprint: &[u8]) -> std::io::Result<bool> {
        let mut reader = BufReader::new(&self.file);
        let mut magic = [0; 8];
        let begins = reader.read_exact(&mut magic).is_ok() && &magic == MAGIC;
        Ok(begins && read_frame(&mut reader).is_some_and(|found| found == fingerprint))
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

    /// Notes a step.
    pub(crate) fn append(&mut self, step: &[u8]) -> std::io::Result<()> {
        let mut frame = Vec::with_capacity(FRAME + step.len());
        frame.extend((step.len() as u64).to_le_bytes());
        frame.extend(crc32fast::hash(step).to_le_bytes());
        frame.extend(step);
        self.file.write_all(&frame)
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

/// Puts runs of bytes together so that [`split_runs`] finds them again.
pub(crate) fn join_runs<'b>(runs: impl IntoIterator<Item = &'b [u8]>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for run in runs {
        bytes.extend((run.len() as u64).to_le_bytes());
        bytes.extend(run);
    }
    bytes
}

/// The runs of [`join_runs`], if there are exactly `N`.
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
        [&b"one"[..], b"", b"three"].into_iter().for_each(|step| journal.append(step).expect("writes"));
        let whole = std::fs::read(&path).expect("reads");
        let expected: [&[u8]; 3] = [b"one", b"", b"three"];
        for cut in 0..=whole.len() {
            std::fs::write(&path, &whole[..cut]).expect("writes");
            let (mut journal, found) = Journal::open(&path, b"a scene").expect("opens");
            let steps = steps(&mut journal);
            assert!(steps.len() <= 3 && steps == expected[..steps.len()]);
            assert_eq!(found, cut >= 8 + FRAME + 7);
            assert_eq!(steps.len() == 3, cut == whole.len());
        }
        std::fs::write(&path, &whole).expect("writes");
        let (mut journal, found) = Journal::open(&path, b"another").expect("opens");
        assert!(!found && steps(&mut journal).is_empty());
    }

    #[test]
    fn runs_are_found_again() {
        let bytes = join_runs([&b"ab"[..], b"", b"cde"]);
        assert_eq!(split_runs(&bytes), Some([&b"ab"[..], b"", b"cde"]));
        assert_eq!(split_runs::<2>(&bytes), None);
        assert_eq!(split_runs::<3>(&bytes[..bytes.len() - 1]), None);
    }
}
