//! Writing sums.

use super::header::{Header, planes_of};
use super::notes;
use super::number::Number;
use super::planes::{EachPlane, Plane, each_plane, has};
use crate::coverage::Coverage;
use crate::{Accumulator, Film, FilmError, FilmTile, write_atomically};
use std::io::{self, Write};
use std::path::Path;

/// Writes sums, whole or not at all. Equal sums are equal bytes.
///
/// # Errors
/// If the file cannot be written, a full disk included.
pub fn write_sums(path: &Path, sums: &Accumulator) -> Result<(), FilmError> {
    write_atomically(path, |out| to_writer(out, sums))
}

/// The bytes of a file of sums.
///
/// # Errors
/// If names of objects and materials are too long.
pub fn encode_sums(sums: &Accumulator) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    to_writer(&mut bytes, sums)?;
    Ok(bytes)
}

pub(super) fn to_writer(out: &mut dyn Write, sums: &Accumulator) -> io::Result<()> {
    let (film, notes) = (&sums.film, notes::to_bytes(sums));
    let too_long = || io::Error::other("the names of objects and materials are more than 4 GiB");
    let header = Header {
        full_size: film.settings().full_size,
        window: film.settings().window,
        planes: planes_of(film.settings()),
        notes_bytes: u32::try_from(notes.len()).map_err(|_| too_long())?,
        mattes_bytes: mattes_bytes(film),
        open_pass: sums.open_pass().unwrap_or(0..0),
        counters: sums.counters,
        non_finite_in_film: film.non_finite(),
    };
    out.write_all(&header.to_bytes())?;
    let mut out = Sections { out, film, runs: &film.runs(), buffer: Vec::new() };
    out.section([&notes[..]].into_iter(), |bytes, buffer| buffer.extend(bytes))?;
    out.section([sums.blocks().words()].into_iter(), put_all)?;
    each_plane(&mut out)?;
    out.mattes(|tile| &tile.objects)?;
    out.mattes(|tile| &tile.materials)
}

/// Bytes of what mattes have seen.
fn mattes_bytes(film: &Film) -> u64 {
    let of = |coverage: &Coverage| 4 + 8 * coverage.ids() as u64;
    let tiles = film.tiles().iter();
    tiles.flat_map(|tile| tile.objects.iter().chain(&tile.materials)).map(of).sum()
}

fn put_all<N: Number>(numbers: &[N], buffer: &mut Vec<u8>) {
    numbers.iter().for_each(|number| number.put(buffer));
}

/// Writes runs of numbers with a checksum behind them.
struct Sections<'o, 'f> {
    out: &'o mut dyn Write,
    film: &'f Film,
    runs: &'f [(usize, std::ops::Range<usize>)],
    buffer: Vec<u8>,
}

impl Sections<'_, '_> {
    fn section<T>(
        &mut self,
        pieces: impl Iterator<Item = T>,
        put: impl Fn(T, &mut Vec<u8>),
    ) -> io::Result<()> {
        let mut hasher = crc32fast::Hasher::new();
        for piece in pieces {
            self.buffer.clear();
            put(piece, &mut self.buffer);
            hasher.update(&self.buffer);
            self.out.write_all(&self.buffer)?;
        }
        self.out.write_all(&hasher.finalize().to_le_bytes())
    }

    fn mattes(&mut self, plane: fn(&FilmTile) -> &[Coverage]) -> io::Result<()> {
        let (film, runs) = (self.film, self.runs);
        if film.tiles().iter().all(|tile| plane(tile).is_empty()) {
            return Ok(());
        }
        let pixels = runs.iter().flat_map(|(tile, run)| &plane(&film.tiles()[*tile])[run.clone()]);
        self.section(pixels, |coverage, buffer| {
            let ranked = coverage.ranked();
            (ranked.len() as u32).put(buffer);
            for (id, count) in ranked {
                id.put(buffer);
                count.put(buffer);
            }
        })
    }
}

impl EachPlane for Sections<'_, '_> {
    fn plane<N: Number>(&mut self, plane: &Plane<N>) -> io::Result<()> {
        let (film, runs) = (self.film, self.runs);
        if !has(film, plane) {
            return Ok(());
        }
        let rows = runs.iter().map(|(tile, run)| &(plane.get)(&film.tiles()[*tile])[run.clone()]);
        self.section(rows, put_all)
    }
}
