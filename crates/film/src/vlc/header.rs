//! The first bytes of a file of sums.

use super::number::first;
use super::planes;
use crate::accumulator::Counters;
use crate::film::FilmSettings;
use crate::{Aov, Blocks, SampleSet, Window};
use std::ops::Range;

/// What a file starts with: no text, and damaged by transfers that take it for one.
pub(super) const MAGIC: [u8; 8] = *b"\x89VLC\r\n\x1a\n";
/// The version of the format that this code reads and writes.
pub(super) const VERSION: u32 = 1;
/// Length of the header.
pub(super) const BYTES: usize = 128;
/// Length of the checksum behind each section.
pub(super) const CRC_BYTES: u64 = 4;
/// The bit of the planes that stands for squares of luminances.
const SQUARES: u32 = 1 << 31;

/// The first bytes of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) full_size: [u32; 2],
    pub(super) window: Window,
    pub(super) planes: u32,
    pub(super) notes_bytes: u32,
    pub(super) mattes_bytes: u64,
    pub(super) open_pass: Range<u32>,
    pub(super) counters: Counters,
    /// Samples that the film, not the renderer, found not to be finite.
    pub(super) non_finite_in_film: u64,
}

/// The bits of what a film records.
pub(super) fn planes_of(settings: &FilmSettings) -> u32 {
    let bits = Aov::ALL.iter().zip(0..).filter(|(aov, _)| settings.aovs.contains(aov));
    bits.map(|(_, bit)| 1 << bit).sum::<u32>() | if settings.squares { SQUARES } else { 0 }
}

impl Header {
    /// The bytes, checksum included.
    pub(super) fn to_bytes(&self) -> [u8; BYTES] {
        let Window { x0, y0, x1, y1 } = self.window;
        let mut rest: Vec<u8> = Vec::with_capacity(BYTES);
        for number in [self.full_size[0], self.full_size[1], x0, y0, x1, y1, self.planes, self.notes_bytes] {
            rest.extend(number.to_le_bytes());
        }
        rest.extend(self.mattes_bytes.to_le_bytes());
        rest.extend(self.open_pass.start.to_le_bytes());
        rest.extend(self.open_pass.end.to_le_bytes());
        let Counters { samples, non_finite, rays, shadow_rays } = self.counters;
        for number in [samples, non_finite, rays, shadow_rays, self.non_finite_in_film] {
            rest.extend(number.to_le_bytes());
        }
        rest.resize(BYTES - 16, 0);
        let mut bytes = [0; BYTES];
        bytes[..8].copy_from_slice(&MAGIC);
        bytes[8..12].copy_from_slice(&VERSION.to_le_bytes());
        bytes[12..16].copy_from_slice(&crc32fast::hash(&rest).to_le_bytes());
        bytes[16..].copy_from_slice(&rest);
        bytes
    }

    /// Reads and checks a header: what it says can be believed, but for the length of the file.
    pub(super) fn from_bytes(bytes: &[u8; BYTES]) -> Result<Self, String> {
        let word = |at: usize| u32::from_le_bytes(first(&bytes[at..]));
        let long = |at: usize| u64::from_le_bytes(first(&bytes[at..]));
        if bytes[..8] != MAGIC {
            return Err("it does not start as a file of sums does".into());
        }
        if word(8) != VERSION {
            return Err(format!("it has version {}, this is a reader of version {VERSION}", word(8)));
        }
        if word(12) != crc32fast::hash(&bytes[16..]) {
            return Err("the header is damaged".into());
        }
        let counters =
            Counters { samples: long(64), non_finite: long(72), rays: long(80), shadow_rays: long(88) };
        let header = Self {
            full_size: [word(16), word(20)],
            window: Window { x0: word(24), y0: word(28), x1: word(32), y1: word(36) },
            planes: word(40),
            notes_bytes: word(44),
            mattes_bytes: long(48),
            open_pass: word(56)..word(60),
            counters,
            non_finite_in_film: long(96),
        };
        if header.is_sound() && bytes[104..].iter().all(|&byte| byte == 0) {
            Ok(header)
        } else {
            Err("the header makes no sense".into())
        }
    }

    /// Whether numbers are in their ranges.
    fn is_sound(&self) -> bool {
        let Window { x0, y0, x1, y1 } = self.window;
        let is_inside = x0 < x1 && y0 < y1 && x1 <= self.full_size[0] && y1 <= self.full_size[1];
        let known = (1 << Aov::ALL.len()) - 1 | SQUARES;
        let Counters { samples, non_finite, rays, shadow_rays } = self.counters;
        let counts = [samples, non_finite, rays, shadow_rays, self.non_finite_in_film];
        let pass = &self.open_pass;
        is_inside
            && self.planes & !known == 0
            && counts.iter().all(|&count| count < 1 << 60)
            && pass.start <= pass.end
            && pass.end <= SampleSet::MOST
    }

    /// What the film records, in tiles of `tile_size` pixels.
    pub(super) fn settings(&self, tile_size: u32) -> FilmSettings {
        let aovs = Aov::ALL.into_iter().zip(0..).filter(|(_, bit)| self.planes >> bit & 1 == 1);
        FilmSettings {
            full_size: self.full_size,
            window: self.window,
            tile_size,
            aovs: aovs.map(|(aov, _)| aov).collect(),
            squares: self.planes & SQUARES != 0,
        }
    }

    /// Length that the file must have; `None` beyond all numbers.
    pub(super) fn file_bytes(&self) -> Option<u64> {
        let pixels = u64::from(self.window.width()).checked_mul(self.window.height().into())?;
        let planes = planes::measure(&self.settings(1));
        let parts = [
            u64::from(self.notes_bytes),
            Blocks::count_of(self.window).checked_mul(4)?,
            pixels.checked_mul(planes.bytes_per_pixel)?,
            self.mattes_bytes,
            (2 + planes.count) * CRC_BYTES,
        ];
        parts.into_iter().try_fold(BYTES as u64, u64::checked_add)
    }
}
