//! The notes of a file: which samples, the recipe, names of mattes.

use super::number::first;
use crate::{Accumulator, Cryptomatte, Recipe, SampleSet};
use std::ops::Range;

/// What a file says in words.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Notes {
    pub(super) samples: SampleSet,
    pub(super) recipe: Recipe,
    pub(super) mattes: Vec<Cryptomatte>,
}

/// Most samples sets, entries and layers: nothing makes more.
const MOST_ENTRIES: u32 = 1 << 16;

/// The notes of sums.
pub(super) fn to_bytes(sums: &Accumulator) -> Vec<u8> {
    let mut out = Vec::new();
    put_u32(&mut out, sums.samples().ranges().len());
    for range in sums.samples().ranges() {
        out.extend(range.start.to_le_bytes());
        out.extend(range.end.to_le_bytes());
    }
    put_u32(&mut out, sums.recipe.entries().len());
    for (name, value) in sums.recipe.entries() {
        put_text(&mut out, name);
        put_text(&mut out, value);
    }
    put_u32(&mut out, sums.mattes.len());
    for matte in &sums.mattes {
        put_text(&mut out, &matte.layer);
        put_u32(&mut out, matte.manifest.len());
        matte.manifest.keys().for_each(|name| put_text(&mut out, name));
    }
    out
}

fn put_u32(out: &mut Vec<u8>, number: usize) {
    out.extend((number as u32).to_le_bytes());
}

fn put_text(out: &mut Vec<u8>, text: &str) {
    put_u32(out, text.len());
    out.extend(text.as_bytes());
}

/// Reads notes; `None` if they make no sense.
pub(super) fn from_bytes(bytes: &[u8]) -> Option<Notes> {
    let mut input = Input(bytes);
    let ranges: Vec<Range<u32>> = input.list(|input| Some(input.u32()?..input.u32()?))?;
    let entries = input.list(|input| Some((input.text()?, input.text()?)))?;
    let mattes = input.list(Input::matte)?;
    let is_apart = ranges.windows(2).all(|pair| pair[0].end < pair[1].start);
    let is_set = ranges.iter().all(|range| range.start < range.end && range.end <= SampleSet::MOST);
    if !input.0.is_empty() || !is_apart || !is_set {
        return None;
    }
    let mut samples = SampleSet::default();
    samples.extend(ranges);
    Some(Notes { samples, recipe: Recipe::from_entries(entries), mattes })
}

/// Bytes that are still to be read.
struct Input<'b>(&'b [u8]);

impl<'b> Input<'b> {
    fn take(&mut self, count: usize) -> Option<&'b [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take(4).map(|bytes| u32::from_le_bytes(first(bytes)))
    }

    fn text(&mut self) -> Option<String> {
        let count = self.u32()?;
        String::from_utf8(self.take(count as usize)?.to_vec()).ok()
    }

    /// A list with its length in front; it grows with what is there, not with what is said.
    fn list<T>(&mut self, mut item: impl FnMut(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let count = self.u32()?;
        (count <= MOST_ENTRIES).then_some(())?;
        (0..count).map(|_| item(self)).collect()
    }

    fn matte(&mut self) -> Option<Cryptomatte> {
        let layer = self.text()?;
        let count = self.u32()?;
        let names: Vec<String> = (0..count).map_while(|_| self.text()).collect();
        (names.len() == count as usize).then(|| Cryptomatte::new(layer, names.iter().map(String::as_str)))
    }
}
