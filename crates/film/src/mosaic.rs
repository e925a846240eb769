//! Parts of a picture, put together.

use crate::{Accumulator, FilmError, Window};
use std::borrow::Cow;

/// Sums that come one by one, in any order: those of the same part of a picture are added, parts are put side by side.
#[derive(Debug, Default)]
pub struct Mosaic {
    parts: Vec<Accumulator>,
}

impl Mosaic {
    /// Adds sums; says whether they are the first of their part.
    ///
    /// # Errors
    /// They are of another picture than those before, or cannot be [added](Accumulator::merge) to those of their part. Then nothing is
    /// changed.
    pub fn add(&mut self, sums: Cow<'_, Accumulator>) -> Result<bool, FilmError> {
        if let Some(first) = self.parts.first() {
            first.check_kin(&sums)?;
        }
        let window = sums.window();
        match self.parts.iter_mut().find(|part| part.window() == window) {
            Some(part) => part.merge(&sums)?,
            None => {
                self.parts.push(sums.into_owned());
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// The sums of the rectangle that the parts fill, the same bits as if they were of one run; none if there are none. Sums of a single
    /// part may be of a picture under way.
    ///
    /// # Errors
    /// Parts overlap or leave gaps, or do not have the same samples in all pixels.
    pub fn finish(mut self) -> Result<Option<Accumulator>, FilmError> {
        if self.parts.len() < 2 {
            return Ok(self.parts.pop());
        }
        self.parts.sort_unstable_by_key(|part| (part.window().y0, part.window().x0));
        let windows: Vec<Window> = self.parts.iter().map(Accumulator::window).collect();
        check_filled(&windows)?;
        let mut parts = self.parts.into_iter();
        let Some(mut whole) = parts.next() else { return Ok(None) };
        let rest: Vec<Accumulator> = parts.collect();
        whole.join(rest, around(&windows))?;
        Ok(Some(whole))
    }
}

/// The smallest rectangle around all.
fn around(windows: &[Window]) -> Window {
    let union = |a: Window, b: &Window| Window {
        x0: a.x0.min(b.x0),
        y0: a.y0.min(b.y0),
        x1: a.x1.max(b.x1),
        y1: a.y1.max(b.y1),
    };
    windows.iter().skip(1).fold(windows[0], union)
}

/// Refuses windows that overlap, or do not fill a rectangle.
fn check_filled(windows: &[Window]) -> Result<(), FilmError> {
    let words = |w: &Window| format!("{},{} to {},{}", w.x0, w.y0, w.x1, w.y1);
    for (i, a) in windows.iter().enumerate() {
        let meets = |b: &&Window| a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1;
        if let Some(b) = windows[..i].iter().find(meets) {
            let what = format!("the parts {} and {} of the picture overlap", words(b), words(a));
            return Err(FilmError::mismatch(what));
        }
    }
    let (whole, pixels) = (around(windows), windows.iter().map(Window::pixels).sum::<usize>());
    if pixels < whole.pixels() {
        let missing = whole.pixels() - pixels;
        let what = format!("the parts leave {missing} pixels of {} out", words(&whole));
        return Err(FilmError::mismatch(what));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aov, FilmSettings, PixelSample, Recipe, decode_sums, encode_sums};
    use std::ops::Range;
    use vastlight_math::Vec3;

    const SIZE: [u32; 2] = [70, 41];

    fn sums(crop: [u32; 4], samples: Range<u32>, seed: u32) -> Accumulator {
        let [x0, y0, x1, y1] = crop;
        let settings = FilmSettings {
            full_size: SIZE,
            window: Window { x0, y0, x1, y1 },
            tile_size: 16,
            aovs: vec![Aov::Normal, Aov::Object],
            squares: false,
        };
        let mut sums = Accumulator::new(settings, Recipe::default().with("seed", seed), Vec::new());
        sums.begin_pass(samples.clone());
        let waiting = sums.waiting();
        for (tile, parts) in sums.tiles_mut().iter_mut().zip(&waiting) {
            for part in parts {
                for (x, y) in (part.y0..part.y1).flat_map(|y| (part.x0..part.x1).map(move |x| (x, y))) {
                    for sample in samples.clone() {
                        let value = (x * 7 + y * 3 + sample * 11) as f32 / 13.0;
                        let (radiance, object) = (Vec3::new(value, 0.5, 1.0 / (1.0 + value)), x / 9 + sample);
                        let normal = Vec3::Y;
                        tile.add(
                            x,
                            y,
                            &PixelSample { radiance, hit: true, object, normal, ..Default::default() },
                        );
                    }
                }
            }
        }
        waiting.iter().for_each(|parts| sums.note_done(parts));
        assert!(sums.end_pass());
        sums.counters.samples = u64::from(x1 - x0) * u64::from(y1 - y0) * samples.len() as u64;
        sums
    }

    #[test]
    fn tiles_may_differ() {
        let all = [0, 0, 70, 41];
        let whole = sums(all, 0..6, 1);
        let read = |sums: &Accumulator| decode_sums(&bytes(sums), 64, "sums").expect("read");
        let halves = |samples: Range<u32>| {
            let mut mosaic = Mosaic::default();
            for crop in [[0, 0, 33, 41], [33, 0, 70, 41]] {
                mosaic.add(Cow::Owned(sums(crop, samples.clone(), 1))).expect("belongs");
            }
            mosaic.finish().expect("filled").expect("some")
        };
        for (mut a, b) in [
            (sums(all, 0..2, 1), read(&sums(all, 2..6, 1))),
            (read(&sums(all, 2..6, 1)), sums(all, 0..2, 1)),
            (halves(0..2), sums(all, 2..6, 1)),
            (read(&sums(all, 2..6, 1)), halves(0..2)),
        ] {
            a.merge(&b).expect("belongs");
            assert_eq!(bytes(&a), bytes(&whole));
            assert_eq!(a.develop(), whole.develop());
        }
    }

    fn bytes(sums: &Accumulator) -> Vec<u8> {
        encode_sums(sums).expect("in memory")
    }

    #[test]
    fn parts_and_passes_in_any_order_are_the_bits_of_the_whole() {
        let whole = bytes(&sums([0, 0, 70, 41], 0..6, 1));
        // Cuts that are not those of blocks, and parts that are not in a grid.
        let crops = [[0, 0, 33, 20], [33, 0, 70, 7], [33, 7, 70, 20], [0, 20, 70, 41]];
        for turn in 0..3 {
            let mut all: Vec<Accumulator> = Vec::new();
            for passes in [2..6, 0..2] {
                all.extend(crops.iter().map(|&crop| sums(crop, passes.clone(), 1)));
            }
            all.rotate_left(turn * 3);
            let mut mosaic = Mosaic::default();
            let firsts = all
                .into_iter()
                .map(|part| mosaic.add(Cow::Owned(part)).expect("belongs"))
                .filter(|first| *first);
            assert_eq!(firsts.count(), crops.len());
            let joined = mosaic.finish().expect("filled").expect("some");
            assert_eq!(bytes(&joined), whole);
            assert_eq!(bytes(&decode_sums(&whole, 64, "whole").expect("whole")), whole);
            assert_eq!(joined.develop(), sums([0, 0, 70, 41], 0..6, 1).develop());
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let finish = |parts: Vec<Accumulator>| {
            let mut mosaic = Mosaic::default();
            let added = parts.into_iter().try_for_each(|part| mosaic.add(Cow::Owned(part)).map(|_| ()));
            added.and_then(|()| mosaic.finish()).map(|sums| sums.is_some()).map_err(|e| e.to_string())
        };
        let left = || sums([0, 0, 30, 41], 0..2, 1);
        let refused = |other: Accumulator, word: &str| {
            let error = finish(vec![left(), other]).expect_err("refused");
            assert!(error.contains(word), "{error}");
        };
        assert_eq!(finish(Vec::new()), Ok(false));
        assert_eq!(finish(vec![left()]), Ok(true));
        refused(sums([29, 0, 70, 41], 0..2, 1), "overlap");
        refused(sums([31, 0, 70, 41], 0..2, 1), "41 pixels");
        refused(sums([30, 0, 70, 41], 0..3, 1), "passes");
        refused(sums([30, 0, 70, 41], 0..2, 2), "seed");
        refused(left(), "passes 1-2");
        let mut begun = sums([30, 0, 70, 41], 0..2, 1);
        begun.begin_pass(2..3);
        refused(begun, "left in the middle");
    }
}
