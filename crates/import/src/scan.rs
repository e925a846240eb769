//! A buffered window over a file that hands out lines of text or runs of bytes, and knows where it is.

use crate::blob::open_within;
use crate::{ImportError, Limits};
use std::fs::File;
use std::io::Read;
use std::path::Path;

const CHUNK_BYTES: usize = 1 << 18;

/// A window that slides over a reader. Memory is one chunk, or the longest line or run that was asked for.
pub(crate) struct Source<R> {
    reader: R,
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    consumed_bytes: u64,
    line: u64,
    /// The next byte is the first of a line that is not counted yet.
    at_line_start: bool,
    /// Whether CR is followed by LF in this file; learned at the first CR.
    cr_lf: Option<bool>,
    line_limit: usize,
    place: String,
}

impl Source<File> {
    /// Opens a file.
    pub(crate) fn open(path: &Path, limits: &Limits) -> Result<Self, ImportError> {
        let (file, _) = open_within(path, limits)?;
        Ok(Self::new(file, path.display().to_string(), limits))
    }
}

impl<R: Read> Source<R> {
    /// A window over `reader`; `place` is the file's name for messages.
    pub(crate) fn new(reader: R, place: String, limits: &Limits) -> Self {
        let line_limit = limits.line_bytes;
        Self {
            reader,
            buffer: vec![0; CHUNK_BYTES],
            start: 0,
            end: 0,
            consumed_bytes: 0,
            line: 0,
            at_line_start: true,
            cr_lf: None,
            line_limit,
            place,
        }
    }

    /// The next line without its end (LF, CR or CR LF), or `None` at the end of the file.
    pub(crate) fn line(&mut self) -> Result<Option<&[u8]>, ImportError> {
        let mut searched = 0;
        loop {
            let window = &self.buffer[self.start + searched..self.end];
            if let Some(found) = memchr::memchr2(b'\n', b'\r', window) {
                let length = searched + found;
                return self.finish_line(length).map(Some);
            }
            searched = self.end - self.start;
            if searched > self.line_limit {
                return Err(self.error("a line is longer than the limits allow"));
            }
            if !self.fill()? {
                return self.last_line(searched);
            }
        }
    }

    fn last_line(&mut self, length: usize) -> Result<Option<&[u8]>, ImportError> {
        if length == 0 {
            return Ok(None);
        }
        self.line += 1;
        let line_start = self.start;
        self.advance(length);
        Ok(Some(&self.buffer[line_start..line_start + length]))
    }

    fn finish_line(&mut self, length: usize) -> Result<&[u8], ImportError> {
        let mut end_bytes = 1;
        if self.buffer[self.start + length] == b'\r' && self.cr_lf != Some(false) {
            let need = length + 2;
            while self.end - self.start < need && self.fill()? {}
            let followed = self.peek(length + 1) == Some(b'\n');
            self.cr_lf.get_or_insert(followed);
            end_bytes += usize::from(followed);
        }
        self.line += 1;
        let line_start = self.start;
        self.advance(length + end_bytes);
        Ok(&self.buffer[line_start..line_start + length])
    }

    fn peek(&self, offset: usize) -> Option<u8> {
        self.buffer[self.start..self.end].get(offset).copied()
    }

    /// Skips blanks and ends of lines in text. Whether a word follows; otherwise this is the end of the file.
    #[inline]
    pub(crate) fn find_word(&mut self) -> Result<bool, ImportError> {
        self.line += u64::from(std::mem::take(&mut self.at_line_start));
        loop {
            let window = &self.buffer[self.start..self.end];
            let mut lines = 0;
            let found = window.iter().position(|&c| {
                lines += u64::from(c == b'\n');
                c > b' '
            });
            self.line += lines;
            self.advance(found.unwrap_or(self.end - self.start));
            if found.is_some() {
                return Ok(true);
            }
            if !self.fill()? {
                return Ok(false);
            }
        }
    }

    /// The word that [`Self::find_word`] has found.
    #[inline]
    pub(crate) fn word(&mut self) -> Result<&[u8], ImportError> {
        let mut length = 0;
        loop {
            let window = &self.buffer[self.start + length..self.end];
            if let Some(found) = window.iter().position(|&c| c <= b' ') {
                length += found;
                break;
            }
            length += window.len();
            if length > self.line_limit {
                return Err(self.error("a word is longer than the limits allow"));
            }
            if !self.fill()? {
                break;
            }
        }
        let first = self.start;
        self.advance(length);
        Ok(&self.buffer[first..first + length])
    }

    /// The next word in text, on this line or a later one; `None` at the end of the file.
    #[inline]
    pub(crate) fn token(&mut self) -> Result<Option<&[u8]>, ImportError> {
        if self.find_word()? { self.word().map(Some) } else { Ok(None) }
    }

    /// The next `count` bytes, or `None` if the file ends before.
    #[inline]
    pub(crate) fn take(&mut self, count: usize) -> Result<Option<&[u8]>, ImportError> {
        while self.end - self.start < count {
            if !self.fill()? {
                return Ok(None);
            }
        }
        let first = self.start;
        self.advance(count);
        Ok(Some(&self.buffer[first..first + count]))
    }

    /// All bytes that are in memory; at least one unless the file has ended. Consume them with [`Self::advance`].
    pub(crate) fn window(&mut self) -> Result<&[u8], ImportError> {
        if self.start == self.end {
            self.fill()?;
        }
        Ok(&self.buffer[self.start..self.end])
    }

    /// Reads on, so that [`Self::window`] grows. `false` at the end of the file.
    pub(crate) fn fill(&mut self) -> Result<bool, ImportError> {
        if self.start > 0 {
            self.buffer.copy_within(self.start..self.end, 0);
            self.end -= self.start;
            self.start = 0;
        }
        if self.end == self.buffer.len() {
            let larger = self.buffer.len() * 2;
            self.buffer.resize(larger, 0);
        }
        let count = loop {
            match self.reader.read(&mut self.buffer[self.end..]) {
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(ImportError::io(&e, Path::new(&self.place))),
                Ok(count) => break count,
            }
        };
        self.end += count;
        Ok(count > 0)
    }

    /// Consumes `count` bytes of the window.
    #[inline]
    pub(crate) fn advance(&mut self, count: usize) {
        self.start += count;
        self.consumed_bytes += count as u64;
    }

    /// Number of the line or of the word's line that was returned last, from 1.
    pub(crate) fn line_number(&self) -> u64 {
        self.line
    }

    /// The file's name.
    pub(crate) fn file(&self) -> &str {
        &self.place
    }

    /// `file:line` of the line that was returned last.
    pub(crate) fn line_place(&self) -> String {
        format!("{}:{}", self.place, self.line)
    }

    /// `file, byte N` of the next byte.
    pub(crate) fn byte_place(&self) -> String {
        format!("{}, byte {}", self.place, self.consumed_bytes)
    }

    /// Malformed at the line that was returned last.
    pub(crate) fn error(&self, what: impl Into<String>) -> ImportError {
        ImportError::malformed(what, self.line_place())
    }

    /// Malformed at the next byte.
    pub(crate) fn byte_error(&self, what: impl Into<String>) -> ImportError {
        ImportError::malformed(what, self.byte_place())
    }
}

/// The words of a line, separated by blanks and tabs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Words<'a>(pub(crate) &'a [u8]);

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    #[inline]
    fn next(&mut self) -> Option<&'a [u8]> {
        let is_blank = |c: &u8| matches!(c, b' ' | b'\t' | b'\x0b' | b'\x0c' | b'\0');
        let first = self.0.iter().position(|c| !is_blank(c))?;
        let tail = &self.0[first..];
        let length = tail.iter().position(is_blank).unwrap_or(tail.len());
        self.0 = &tail[length..];
        Some(&tail[..length])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hands out one byte at a time, the worst case for a window.
    struct Trickle<'a>(&'a [u8]);

    impl Read for Trickle<'_> {
        fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
            let Some((&first, rest)) = self.0.split_first() else { return Ok(0) };
            out[0] = first;
            self.0 = rest;
            Ok(1)
        }
    }

    fn lines(text: &[u8]) -> Vec<String> {
        let mut source = Source::new(Trickle(text), "t".into(), &Limits::default());
        let mut found = Vec::new();
        while let Some(line) = source.line().expect("readable") {
            found.push(String::from_utf8_lossy(line).into_owned());
        }
        found
    }

    #[test]
    fn all_line_ends() {
        assert_eq!(lines(b"a\nb\r\nc\rd\n\ne"), ["a", "b", "c", "d", "", "e"]);
        assert_eq!(lines(b""), [""; 0]);
        assert_eq!(lines(b"x\r"), ["x"]);
    }

    #[test]
    fn runs_cross_chunks_and_end_cleanly() {
        let data: Vec<u8> = (0..=255).cycle().take(3 * CHUNK_BYTES).collect();
        let mut source = Source::new(&data[..], "t".into(), &Limits::default());
        assert_eq!(source.take(5).expect("readable"), Some(&data[..5]));
        let large = 2 * CHUNK_BYTES;
        assert_eq!(source.take(large).expect("readable"), Some(&data[5..5 + large]));
        assert_eq!(source.take(large).expect("readable"), None);
        assert_eq!(source.byte_place(), format!("t, byte {}", 5 + large));
    }

    #[test]
    fn overlong_lines_are_refused() {
        let limits = Limits { line_bytes: 100, ..Limits::default() };
        let text = vec![b'x'; 2 * CHUNK_BYTES];
        let mut source = Source::new(&text[..], "t".into(), &limits);
        assert!(source.line().expect_err("too long").what.contains("longer"));
    }

    #[test]
    fn words_of_a_line() {
        let words: Vec<&[u8]> = Words(b" a\tbc  d ").collect();
        assert_eq!(words, [&b"a"[..], b"bc", b"d"]);
    }
}
