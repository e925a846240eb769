//! Right checksums for wrong bytes: without them nothing behind a checksum would ever be tried.

use bytemuck::{Pod, Zeroable, bytes_of, pod_read_unaligned};
use vastlight::store::format::{EntryRow, Header, Section, SectionRow};

/// A store with all its checksums and its length as they should be; none where it has no table of sections.
pub(crate) fn store(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = bytes.to_vec();
    let mut header: Header = read(&bytes, 0)?;
    header.bytes = bytes.len() as u64;
    for row in 0..header.sections.min(64) as usize {
        let place = usize::try_from(header.sections_at).ok()?.checked_add(row * size_of::<SectionRow>())?;
        let mut section: SectionRow = read(&bytes, place)?;
        let pages = [Section::Geometry, Section::Attributes, Section::Tiles];
        if pages.iter().any(|&kind| kind as u32 == section.kind) {
            seal_pages(&mut bytes, &section);
        }
        if let Some(part) = part(&bytes, section.offset, section.bytes) {
            section.crc32 = crc32fast::hash(part);
            write(&mut bytes, place, &section);
        }
    }
    let table = u64::from(header.sections) * size_of::<SectionRow>() as u64;
    header.sections_crc32 = crc32fast::hash(part(&bytes, header.sections_at, table)?);
    let checked = size_of::<Header>() - size_of::<u32>();
    header.crc32 = crc32fast::hash(&bytes_of(&header)[..checked]);
    write(&mut bytes, 0, &header);
    Some(bytes)
}

/// The checksums of the pages of a directory.
fn seal_pages(bytes: &mut [u8], directory: &SectionRow) {
    let rows = directory.bytes / size_of::<EntryRow>() as u64;
    for row in 0..rows.min(1 << 12) {
        let place = directory.offset.saturating_add(row * size_of::<EntryRow>() as u64);
        let Some(mut entry) = usize::try_from(place).ok().and_then(|place| read::<EntryRow>(bytes, place))
        else {
            return;
        };
        if let Some(page) = part(bytes, entry.offset, entry.bytes.into()) {
            entry.crc32 = crc32fast::hash(page);
            write(bytes, place as usize, &entry);
        }
    }
}

/// Bytes of the header of a file of sums.
const SUMS_HEADER: usize = 128;

/// A file of sums with all its checksums as they should be (`docs/checkpoint-format.md`); none where it ends early.
pub(crate) fn sums(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = bytes.to_vec();
    let crc = crc32fast::hash(bytes.get(16..SUMS_HEADER)?);
    write(&mut bytes, 12, &crc);
    let word = |place: usize| read::<u32>(&bytes, place).map(u64::from);
    let (window, kinds) = ([word(24)?, word(28)?, word(32)?, word(36)?], word(40)?);
    let [x0, y0, x1, y1] = window;
    let pixels = x1.checked_sub(x0)?.checked_mul(y1.checked_sub(y0)?)?;
    let blocks = (x1.div_ceil(16) - x0 / 16) * (y1.div_ceil(16) - y0 / 16);
    let has = move |bits: u64| kinds & bits != 0;
    let per_pixel = [
        (true, 4),
        (true, 48),
        (has(1 << 31), 16),
        (has(0b1_1100), 4),
        (has(0b1), 24),
        (has(0b10), 24),
        (has(0b100), 16),
        (has(0b1_0000), 48),
    ];
    let planes = per_pixel.into_iter().filter(|&(there, _)| there).map(|(_, size)| pixels.checked_mul(size));
    let sections = [Some(word(44)?), blocks.checked_mul(4)].into_iter().chain(planes);
    let mut start = SUMS_HEADER as u64;
    for length in sections.collect::<Vec<_>>() {
        start = seal_section(&mut bytes, start, length?)?;
    }
    for _ in [5, 6].into_iter().filter(|bit| has(1 << bit)) {
        let length = mattes(&bytes, start, pixels)?;
        start = seal_section(&mut bytes, start, length)?;
    }
    Some(bytes)
}

/// Bytes of a section of mattes: by pixel a count, then as many pairs.
fn mattes(bytes: &[u8], start: u64, pixels: u64) -> Option<u64> {
    let mut length = 0_u64;
    for _ in 0..pixels {
        let ids = read::<u32>(bytes, usize::try_from(start + length).ok()?)?;
        length += 4 + 8 * u64::from(ids);
    }
    Some(length)
}

/// Writes the checksum behind a section; where the next begins.
fn seal_section(bytes: &mut [u8], start: u64, length: u64) -> Option<u64> {
    let crc = crc32fast::hash(part(bytes, start, length)?);
    let end = start + length;
    part(bytes, end, 4)?;
    write(bytes, end as usize, &crc);
    Some(end + 4)
}

fn part(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let start = usize::try_from(offset).ok()?;
    bytes.get(start..start.checked_add(usize::try_from(length).ok()?)?)
}

fn read<T: Pod + Zeroable>(bytes: &[u8], place: usize) -> Option<T> {
    bytes.get(place..place.checked_add(size_of::<T>())?).map(pod_read_unaligned)
}

fn write<T: Pod>(bytes: &mut [u8], place: usize, value: &T) {
    bytes[place..place + size_of::<T>()].copy_from_slice(bytes_of(value));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seeds;

    /// Whether a file is itself again when each of these words of it was another.
    fn restores(bytes: &[u8], places: &[usize], seal: fn(&[u8]) -> Option<Vec<u8>>) {
        for &place in places {
            let mut damaged = bytes.to_vec();
            damaged[place..place + 4].iter_mut().for_each(|byte| *byte ^= 0x5a);
            assert!(seal(&damaged).is_some_and(|sealed| sealed == bytes), "the word at {place}");
        }
    }

    /// Where the checksums of a store are: those of the header, of all sections, and of all pages.
    fn checksums_of_store(bytes: &[u8]) -> (Vec<usize>, usize) {
        let header: Header = read(bytes, 0).expect("a header");
        let mut places = vec![16, 32, 36];
        let mut pages = 0;
        for row in 0..header.sections as usize {
            let place = header.sections_at as usize + row * size_of::<SectionRow>();
            let section: SectionRow = read(bytes, place).expect("a row");
            places.push(place + 4);
            if [Section::Geometry, Section::Attributes, Section::Tiles]
                .map(|kind| kind as u32)
                .contains(&section.kind)
            {
                let rows = section.bytes as usize / size_of::<EntryRow>();
                places
                    .extend((0..rows).map(|row| section.offset as usize + row * size_of::<EntryRow>() + 12));
                pages += rows;
            }
        }
        (places, pages)
    }

    #[test]
    fn damaged_checksums_of_stores_are_made_right() {
        let mut all_pages = 0;
        for bytes in seeds("store").iter().map(|path| std::fs::read(path).expect("readable")) {
            let (places, pages) = checksums_of_store(&bytes);
            restores(&bytes, &places, store);
            all_pages += pages;
        }
        assert!(all_pages > 0, "no seed has pages");
    }

    #[test]
    fn damaged_checksums_of_sums_are_made_right() {
        let mut with_mattes = 0;
        for bytes in seeds("sums").iter().map(|path| std::fs::read(path).expect("readable")) {
            let recipe = read::<u32>(&bytes, 44).expect("a header") as usize;
            restores(&bytes, &[12, SUMS_HEADER + recipe, bytes.len() - 4], sums);
            with_mattes += u32::from(bytes[40] >> 5 > 0);
        }
        assert!(with_mattes > 0, "no seed has mattes");
    }

    /// Negative control: what is no checksum is not made up.
    #[test]
    fn damaged_contents_stay_damaged() {
        for (folder, place, seal) in [("store", 4096, store as fn(&[u8]) -> _), ("sums", SUMS_HEADER, sums)] {
            let bytes = std::fs::read(&seeds(folder)[0]).expect("readable");
            let mut damaged = bytes.clone();
            damaged[place] ^= 0x5a;
            let sealed = seal(&damaged).expect("has a header");
            assert!(sealed[place] == damaged[place] && sealed != damaged);
        }
    }
}
