//! Reading sums: nothing that a file says is believed before it is checked, and nothing is allocated that the file does not hold.

use super::header::{BYTES, CRC_BYTES, Header};
use super::notes::{self, Notes};
use super::number::Number;
use super::planes::{EachPlane, Plane, each_plane, has};
use crate::coverage::Coverage;
use crate::{Accumulator, Blocks, Film, FilmError, FilmSettings, FilmTile, Recipe, SampleSet};
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A file of sums whose header and notes are read and whose planes are not.
#[derive(Debug)]
pub struct SumsFile {
    path: PathBuf,
    input: BufReader<File>,
    header: Header,
    notes: Notes,
}

/// Buffer of the file.
const BUFFER: usize = 1 << 18;

impl SumsFile {
    /// Opens a file and reads what it is.
    ///
    /// # Errors
    /// If it cannot be read, is no file of sums, is of another version, or is damaged.
    pub fn open(path: &Path) -> Result<Self, FilmError> {
        let error = |e: io::Error| FilmError::read(path, e);
        let metadata = std::fs::metadata(path).map_err(error)?;
        if !metadata.is_file() {
            return Err(FilmError::read(path, "it is no file"));
        }
        let mut input = BufReader::with_capacity(BUFFER, File::open(path).map_err(error)?);
        let (header, notes) = front(&mut input, metadata.len()).map_err(error)?;
        Ok(Self { path: path.to_owned(), input, header, notes })
    }

    /// What the film records; tiles apart.
    #[must_use]
    pub fn settings(&self) -> FilmSettings {
        self.header.settings(Blocks::EDGE)
    }

    /// What the sums are sums of.
    #[must_use]
    pub fn recipe(&self) -> &Recipe {
        &self.notes.recipe
    }

    /// Samples of whole passes.
    #[must_use]
    pub fn samples(&self) -> &SampleSet {
        &self.notes.samples
    }

    /// Reads the sums into tiles of `tile_size` pixels.
    ///
    /// # Errors
    /// If the file cannot be read or is damaged.
    pub fn load(mut self, tile_size: u32) -> Result<Accumulator, FilmError> {
        let sums = body(&mut self.input, &self.header, self.notes, tile_size);
        sums.map_err(|e| FilmError::read(&self.path, e))
    }
}

/// The sums in the bytes of a file, in tiles of `tile_size` pixels; `place` names them in messages.
///
/// # Errors
/// If they are no file of sums, of another version, or damaged.
pub fn decode_sums(mut bytes: &[u8], tile_size: u32, place: &str) -> Result<Accumulator, FilmError> {
    let length = bytes.len() as u64;
    let sums =
        front(&mut bytes, length).and_then(|(header, notes)| body(&mut bytes, &header, notes, tile_size));
    sums.map_err(|e| FilmError::read(Path::new(place), e))
}

fn damaged(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, what.into())
}

/// A shorter name for an error of the system that has none of its own.
fn readable(error: io::Error) -> io::Error {
    if error.kind() == io::ErrorKind::UnexpectedEof { damaged("the file ends early") } else { error }
}

/// Reads header and notes of a file of `file_bytes` bytes.
pub(super) fn front(input: &mut impl Read, file_bytes: u64) -> io::Result<(Header, Notes)> {
    let mut bytes = [0; BYTES];
    input.read_exact(&mut bytes).map_err(readable)?;
    let header = Header::from_bytes(&bytes).map_err(damaged)?;
    let expected = header.file_bytes().ok_or_else(|| damaged("the header makes no sense"))?;
    if expected != file_bytes {
        return Err(damaged(format!("the file has {file_bytes} bytes and should have {expected}")));
    }
    let mut sections = Sections { input, buffer: Vec::new(), hasher: crc32fast::Hasher::new() };
    let notes = sections.take(header.notes_bytes as usize)?;
    let notes = notes::from_bytes(notes);
    sections.end("notes")?;
    let notes = notes.ok_or_else(|| damaged("the notes make no sense"))?;
    Ok((header, notes))
}

/// Reads what follows the notes.
pub(super) fn body(
    input: &mut impl Read,
    header: &Header,
    notes: Notes,
    tile_size: u32,
) -> io::Result<Accumulator> {
    let mut sections = Sections { input, buffer: Vec::new(), hasher: crc32fast::Hasher::new() };
    let blocks = blocks(&mut sections, header, &notes)?;
    let mut film = Film::new(header.settings(tile_size));
    let runs = film.runs();
    let mut mattes_left = header.mattes_bytes;
    let mut planes = Planes { sections, film: &mut film, runs: &runs };
    each_plane(&mut planes)?;
    planes.mattes(&mut mattes_left, |tile| &mut tile.objects)?;
    planes.mattes(&mut mattes_left, |tile| &mut tile.materials)?;
    if mattes_left != 0 {
        return Err(damaged("the mattes make no sense"));
    }
    film.set_non_finite(header.non_finite_in_film);
    check_counts(&film, &blocks)?;
    let open_pass = (!header.open_pass.is_empty()).then(|| header.open_pass.clone());
    let Notes { samples, recipe, mattes } = notes;
    Ok(Accumulator { recipe, mattes, counters: header.counters, film, samples, open_pass, blocks })
}

/// Reads which blocks have how many samples: those of the whole passes, and of the open one where it has come to them.
fn blocks<R: Read>(sections: &mut Sections<'_, R>, header: &Header, notes: &Notes) -> io::Result<Blocks> {
    let (whole, open) = (notes.samples.len(), header.open_pass.clone());
    let is_new = notes.samples.overlap(&open.clone().into()).is_none();
    let count = Blocks::count_of(header.window) as usize;
    let words: Vec<u32> = sections.take(4 * count)?.chunks_exact(4).map(u32::get).collect();
    sections.end("blocks")?;
    let blocks = Blocks::with_words(header.window, words);
    let fits = |block| match (blocks.is_stopped(block), blocks.count(block)) {
        (true, count) => count <= whole,
        (false, count) => count == whole || count == whole + open.len() as u32,
    };
    if is_new && whole + open.len() as u32 <= SampleSet::MOST && (0..count).all(fits) {
        Ok(blocks)
    } else {
        Err(damaged("the blocks make no sense"))
    }
}

/// Refuses pixels with more samples than there were.
fn check_counts(film: &Film, blocks: &Blocks) -> io::Result<()> {
    let has_too_many = |tile: &FilmTile| {
        let beyond = |i: usize, most: u32| {
            let seen = |plane: &[Coverage]| plane.get(i).map_or(0, Coverage::total);
            let samples = tile.samples[i];
            let surfaces =
                [tile.hits.get(i).map_or(0, |&n| u64::from(n)), seen(&tile.objects), seen(&tile.materials)];
            samples > most || surfaces.into_iter().any(|count| count > u64::from(samples))
        };
        let mut pixels = blocks.counts_in(tile.window()).enumerate();
        pixels.any(|(i, most)| beyond(i, most))
    };
    if film.tiles().iter().any(has_too_many) { Err(damaged("the counts make no sense")) } else { Ok(()) }
}

/// Reads numbers and the checksums behind them.
struct Sections<'i, R> {
    input: &'i mut R,
    buffer: Vec<u8>,
    hasher: crc32fast::Hasher,
}

/// Most bytes that are taken on trust: the buffer grows with what comes.
const STEP: usize = 1 << 20;

impl<R: Read> Sections<'_, R> {
    /// The next bytes.
    fn take(&mut self, count: usize) -> io::Result<&[u8]> {
        self.buffer.clear();
        while self.buffer.len() < count {
            let start = self.buffer.len();
            self.buffer.resize(count.min(start + STEP), 0);
            self.input.read_exact(&mut self.buffer[start..]).map_err(readable)?;
        }
        self.hasher.update(&self.buffer);
        Ok(&self.buffer)
    }

    /// Ends a section: its checksum must follow.
    fn end(&mut self, name: &str) -> io::Result<()> {
        let mut expected = [0; CRC_BYTES as usize];
        self.input.read_exact(&mut expected).map_err(readable)?;
        let found = std::mem::take(&mut self.hasher).finalize();
        if found == u32::from_le_bytes(expected) {
            return Ok(());
        }
        Err(damaged(format!("the {name} are damaged: their checksum is wrong")))
    }
}

/// Fills the planes of a film.
struct Planes<'i, 'f, R> {
    sections: Sections<'i, R>,
    film: &'f mut Film,
    runs: &'f [(usize, Range<usize>)],
}

impl<R: Read> EachPlane for Planes<'_, '_, R> {
    fn plane<N: Number>(&mut self, plane: &Plane<N>) -> io::Result<()> {
        if !has(self.film, plane) {
            return Ok(());
        }
        for (tile, run) in self.runs {
            let bytes = self.sections.take(run.len() * N::BYTES)?;
            let numbers = &mut (plane.get_mut)(&mut self.film.tiles_mut()[*tile])[run.clone()];
            numbers.iter_mut().zip(bytes.chunks_exact(N::BYTES)).for_each(|(n, bytes)| *n = N::get(bytes));
        }
        self.sections.end("sums")
    }
}

impl<R: Read> Planes<'_, '_, R> {
    fn mattes(&mut self, left: &mut u64, plane: fn(&mut FilmTile) -> &mut [Coverage]) -> io::Result<()> {
        if self.film.tiles_mut().iter_mut().all(|tile| plane(tile).is_empty()) {
            return Ok(());
        }
        let pixels = self.runs.iter().flat_map(|(tile, run)| run.clone().map(move |i| (*tile, i)));
        for (tile, i) in pixels {
            let ids = u32::get(self.sections.take(4)?);
            let bytes = 8 * u64::from(ids);
            *left = left.checked_sub(4 + bytes).ok_or_else(|| damaged("the mattes make no sense"))?;
            let entry = |bytes: &[u8]| (u32::get(bytes), u32::get(&bytes[4..]));
            let entries: Vec<_> = self.sections.take(bytes as usize)?.chunks_exact(8).map(entry).collect();
            let coverage = Coverage::from_entries(&entries);
            plane(&mut self.film.tiles_mut()[tile])[i] =
                coverage.ok_or_else(|| damaged("the mattes make no sense"))?;
        }
        self.sections.end("mattes")
    }
}
