//! Stores with wrong numbers behind right checksums: what only the checks behind the checksums can refuse.

use crate::common::random::Random;
use bytemuck::{Pod, bytes_of, pod_read_unaligned};
use vastlight::accel::compact::PageRoot;
use vastlight::store::format::{EntryRow, Header, Section, SectionRow};

/// Bytes of the header that its checksum covers.
const CHECKED: usize = 36;
/// Numbers that code is seldom ready for.
const WORDS: [u32; 12] =
    [0, 1, 2, 7, 0xff, 0xffff, 0x7fff_ffff, 0x8000_0000, 0xffff_ffff, 0x7fc0_0000, 0x7f80_0000, 0x7149_f2ca];

/// What is done to a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Damage {
    /// The file ends early.
    Truncated,
    /// Bits are flipped, and the checksums tell.
    Bits,
    /// Words of a section.
    Section(Section),
    /// Words of a page that a directory knows.
    Page(Section),
    /// The bounds of a section.
    Bounds(Section),
    /// Words of the header.
    Header,
}

/// A store by its parts.
pub(crate) struct Anatomy {
    bytes: Vec<u8>,
    header: Header,
    sections: Vec<SectionRow>,
}

impl Anatomy {
    pub(crate) fn of(bytes: Vec<u8>) -> Self {
        let header: Header = read(&bytes, 0);
        let row = |i: usize| read(&bytes, header.sections_at as usize + i * size_of::<SectionRow>());
        let sections = (0..header.sections as usize).map(row).collect();
        Self { bytes, header, sections }
    }

    /// A store with some damage.
    pub(crate) fn damaged(&self, random: &mut Random) -> (Damage, Vec<u8>) {
        let damage = self.choose(random);
        let mut bytes = self.bytes.clone();
        match damage {
            Damage::Truncated => bytes.truncate(random.below(bytes.len())),
            Damage::Bits => {
                let last = bytes.len();
                (0..=random.below(8)).for_each(|_| bytes[random.below(last)] ^= 1 << random.below(8));
            }
            Damage::Section(section) => {
                let row = self.row(section);
                overwrite(part_mut(&mut bytes, row.offset, row.bytes), random);
                self.seal(&mut bytes, self.sections.clone());
            }
            Damage::Page(directory) => self.damage_page(&mut bytes, directory, random),
            Damage::Bounds(section) => {
                let mut sections = self.sections.clone();
                let row = sections.iter_mut().find(|row| row.kind == section as u32).expect("in every store");
                match random.below(4) {
                    0 => row.offset = u64::from(random.word()),
                    1 => row.bytes = random.below(row.bytes as usize + 200) as u64 & !3,
                    2 => row.bytes = u64::from(random.word()),
                    _ => row.kind = random.word() % 20,
                }
                self.seal(&mut bytes, sections);
            }
            Damage::Header => {
                let place = 4 * random.below(CHECKED / 4);
                bytes[place..place + 4].copy_from_slice(&random.word().to_le_bytes());
                let crc32 = crc32fast::hash(&bytes[..CHECKED]);
                write(&mut bytes, CHECKED, &crc32);
            }
        }
        (damage, bytes)
    }

    /// The store with all its checksums computed anew.
    pub(crate) fn sealed(&self) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        self.seal(&mut bytes, self.sections.clone());
        bytes
    }

    /// The store with pages of geometry whose ways meet again at every node; all subtrees begin there.
    pub(crate) fn with_meeting_ways(&self) -> Vec<u8> {
        let mut bytes = self.bytes.clone();
        let directory = self.row(Section::Geometry);
        for row in 0..directory.bytes as usize / size_of::<EntryRow>() {
            let place = directory.offset as usize + row * size_of::<EntryRow>();
            let mut entry: EntryRow = read(&bytes, place);
            let page = part_mut(&mut bytes, entry.offset, u64::from(entry.bytes));
            page.chunks_exact_mut(NODE).for_each(|node| node.copy_from_slice(&meeting_node()));
            entry.crc32 = crc32fast::hash(page);
            write(&mut bytes, place, &entry);
        }
        let roots = self.row(Section::Roots);
        for row in 0..roots.bytes as usize / size_of::<PageRoot>() {
            let place = roots.offset as usize + row * size_of::<PageRoot>();
            // Behind the number of the page stands the place in it.
            write(&mut bytes, place + 4, &0_u32);
        }
        self.seal(&mut bytes, self.sections.clone());
        bytes
    }

    /// A store with other words in one section, behind checksums that are right.
    pub(crate) fn damaged_in(&self, section: Section, random: &mut Random) -> Vec<u8> {
        let (mut bytes, row) = (self.bytes.clone(), self.row(section));
        overwrite(part_mut(&mut bytes, row.offset, row.bytes), random);
        self.seal(&mut bytes, self.sections.clone());
        bytes
    }

    fn choose(&self, random: &mut Random) -> Damage {
        let filled = |section: &Section| self.row(*section).bytes > 0;
        let pages = [Section::Geometry, Section::Attributes, Section::Tiles];
        let pages: Vec<Section> = pages.into_iter().filter(filled).collect();
        let sections: Vec<Section> = Section::ALL.into_iter().filter(filled).collect();
        match random.below(10) {
            0 => Damage::Truncated,
            1 => Damage::Bits,
            2 => Damage::Bounds(*random.of(&sections)),
            3 => Damage::Header,
            4 | 5 => Damage::Page(*random.of(&pages)),
            6 => Damage::Section(Section::Scene),
            _ => Damage::Section(*random.of(&sections)),
        }
    }

    fn row(&self, section: Section) -> SectionRow {
        let none = SectionRow { kind: 0, crc32: 0, offset: 0, bytes: 0 };
        self.sections.iter().find(|row| row.kind == section as u32).copied().unwrap_or(none)
    }

    /// Overwrites a part of a page.
    fn damage_page(&self, bytes: &mut [u8], directory: Section, random: &mut Random) {
        let row = self.row(directory);
        let rows = row.bytes as usize / size_of::<EntryRow>();
        let place = row.offset as usize + random.below(rows) * size_of::<EntryRow>();
        let mut entry: EntryRow = read(bytes, place);
        let page = part_mut(bytes, entry.offset, u64::from(entry.bytes));
        overwrite(page, random);
        entry.crc32 = crc32fast::hash(page);
        write(bytes, place, &entry);
        self.seal(bytes, self.sections.clone());
    }

    /// Makes all checksums right, as far as there is something to check.
    fn seal(&self, bytes: &mut [u8], mut sections: Vec<SectionRow>) {
        for row in &mut sections {
            let end = row.offset.saturating_add(row.bytes);
            if end <= bytes.len() as u64 {
                row.crc32 = crc32fast::hash(part_mut(bytes, row.offset, row.bytes));
            }
        }
        let table: &[u8] = bytemuck::cast_slice(&sections);
        let at = self.header.sections_at as usize;
        bytes[at..at + table.len()].copy_from_slice(table);
        let mut header = Header { sections_crc32: crc32fast::hash(table), ..self.header };
        header.crc32 = crc32fast::hash(&bytes_of(&header)[..CHECKED]);
        write(bytes, 0, &header);
    }
}

/// Bytes of a node in a page.
const NODE: usize = 92;

/// A node whose eight children are the node behind it, with boxes in which everything lies.
fn meeting_node() -> [u8; NODE] {
    let mut node = [0; NODE];
    (0..3).for_each(|axis| write(&mut node, 4 * axis, &-1e8_f32));
    // Planes 2^20 apart; all slots are used.
    node[12..16].copy_from_slice(&[147, 147, 147, 0xff]);
    (0..3).for_each(|axis| node[16 + 16 * axis + 8..][..8].fill(0xff));
    let next = (NODE / 4 - 1) as u16;
    (0..8).for_each(|slot| write(&mut node, 64 + 2 * slot, &next));
    node
}

/// Overwrites one to four numbers, mostly whole words, at times bytes.
fn overwrite(bytes: &mut [u8], random: &mut Random) {
    for _ in 0..=random.below(4) {
        let bytewise = bytes.len() < 4 || random.below(3) == 0;
        if bytewise {
            let place = random.below(bytes.len());
            bytes[place] = random.word() as u8;
            continue;
        }
        let (place, other) = (4 * random.below(bytes.len() / 4), 4 * random.below(bytes.len() / 4));
        let old: u32 = read(bytes, place);
        let new = match random.below(6) {
            0 => old.wrapping_add(1),
            1 => old.wrapping_sub(1),
            2 => old ^ 1 << random.below(32),
            3 => read(bytes, other),
            _ => random.word(),
        };
        write(bytes, place, &new);
    }
}

impl Random {
    /// A number that code is seldom ready for, or any.
    fn word(&mut self) -> u32 {
        if self.below(3) == 0 { self.next() as u32 } else { *self.of(&WORDS) }
    }
}

fn part_mut(bytes: &mut [u8], offset: u64, length: u64) -> &mut [u8] {
    &mut bytes[offset as usize..(offset + length) as usize]
}

fn read<T: Pod>(bytes: &[u8], place: usize) -> T {
    pod_read_unaligned(&bytes[place..place + size_of::<T>()])
}

fn write<T: Pod>(bytes: &mut [u8], place: usize, value: &T) {
    bytes[place..place + size_of::<T>()].copy_from_slice(bytes_of(value));
}
