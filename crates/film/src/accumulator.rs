//! A picture under way: its sums, and which samples are in them. It can be put aside, taken up again, and added to others.

use crate::{
    Blocks, Cryptomatte, Film, FilmError, FilmSettings, FilmTile, Picture, Recipe, SampleSet, Window, noise,
};
use std::ops::Range;

/// What the samples cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Samples taken, dropped ones included.
    pub samples: u64,
    /// Samples that were not finite and dropped.
    pub non_finite: u64,
    /// Closest-hit rays.
    pub rays: u64,
    /// Occlusion rays.
    pub shadow_rays: u64,
}

impl Counters {
    fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        self.non_finite += other.non_finite;
        self.rays += other.rays;
        self.shadow_rays += other.shadow_rays;
    }
}

/// The sums of a picture under way. Samples come in passes; a pass may be left in the middle, and blocks may be left out of it.
#[derive(Clone, Debug)]
pub struct Accumulator {
    /// What the sums are sums of.
    pub recipe: Recipe,
    /// Names for the mattes that the film records.
    pub mattes: Vec<Cryptomatte>,
    /// What the samples cost.
    pub counters: Counters,
    pub(crate) film: Film,
    /// Samples of whole passes. Blocks that are stopped have the first of them only.
    pub(crate) samples: SampleSet,
    /// A pass that some blocks have already.
    pub(crate) open_pass: Option<Range<u32>>,
    pub(crate) blocks: Blocks,
}

impl Accumulator {
    /// No samples yet.
    #[must_use]
    pub fn new(settings: FilmSettings, recipe: Recipe, mattes: Vec<Cryptomatte>) -> Self {
        let blocks = Blocks::new(settings.window);
        Self {
            recipe,
            mattes,
            counters: Counters::default(),
            film: Film::new(settings),
            samples: SampleSet::default(),
            open_pass: None,
            blocks,
        }
    }

    /// The sums.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The tiles of the film, to add samples to; see [`Accumulator::waiting`].
    pub fn tiles_mut(&mut self) -> &mut [FilmTile] {
        self.film.tiles_mut()
    }

    /// Samples of whole passes.
    #[must_use]
    pub fn samples(&self) -> &SampleSet {
        &self.samples
    }

    /// The pass that has begun, if one has.
    #[must_use]
    pub fn open_pass(&self) -> Option<Range<u32>> {
        self.open_pass.clone()
    }

    /// How many samples the parts of the picture have.
    #[must_use]
    pub fn blocks(&self) -> &Blocks {
        &self.blocks
    }

    /// The picture so far: linear means of all planes.
    #[must_use]
    pub fn develop(&self) -> Picture {
        self.film.develop(self.mattes.clone())
    }

    /// Begins a pass of samples that are not there yet, after the one before was ended.
    pub fn begin_pass(&mut self, pass: Range<u32>) {
        self.open_pass = Some(pass);
    }

    /// The parts of each tile that the pass has still to come to.
    #[must_use]
    pub fn waiting(&self) -> Vec<Vec<Window>> {
        let count = self.samples.len();
        self.film.tiles().iter().map(|tile| self.blocks.waiting(tile.window(), count)).collect()
    }

    /// Notes that the pass has come to these parts.
    pub fn note_done(&mut self, parts: &[Window]) {
        let samples = self.open_pass.as_ref().map_or(0, ExactSizeIterator::len);
        self.blocks.add(parts, samples as u32);
    }

    /// Ends the pass if it has come to all blocks that go on; else says that it has not.
    pub fn end_pass(&mut self) -> bool {
        let count = self.samples.len();
        let is_waiting = |block| !self.blocks.is_stopped(block) && self.blocks.count(block) == count;
        if (0..self.blocks.words().len()).any(is_waiting) {
            return false;
        }
        self.samples.extend(self.open_pass.take());
        true
    }

    /// Stops the blocks whose noise is at most `tolerance`; see [`Film::noise`].
    pub fn stop_quiet(&mut self, tolerance: f64) {
        noise::stop_quiet(&mut self.blocks, &self.film.noise(), tolerance);
    }

    /// Adds all samples of `other`. In any order and grouping the sums are the same bits as if they were of one run.
    ///
    /// # Errors
    /// The two are of different recipes or parts of a picture, have samples in common, or not the same samples in all pixels. Then
    /// nothing is changed.
    pub fn merge(&mut self, other: &Self) -> Result<(), FilmError> {
        self.check_kin(other)?;
        for sums in [&*self, other] {
            sums.check_even()?;
        }
        if let Some(both) = self.samples.overlap(&other.samples) {
            let both = SampleSet::from(both);
            return Err(FilmError::mismatch(format!("passes {both} are in it and in those before it")));
        }
        if u64::from(self.samples.len()) + u64::from(other.samples.len()) > u64::from(SampleSet::MOST) {
            return Err(FilmError::mismatch(format!("there are more than {} passes", SampleSet::MOST)));
        }
        self.film.merge(&other.film)?;
        self.blocks.merge(&other.blocks);
        self.counters.add(&other.counters);
        self.samples.extend(other.samples.ranges().iter().cloned());
        Ok(())
    }

    /// Puts other parts of the picture beside this one; all of them fill `window`.
    pub(crate) fn join(&mut self, others: Vec<Self>, window: Window) -> Result<(), FilmError> {
        self.check_even()?;
        for other in &others {
            other.check_even()?;
            if other.samples != self.samples {
                let (a, b) = (&self.samples, &other.samples);
                return Err(FilmError::mismatch(format!("a part has passes {b}, another has {a}")));
            }
        }
        self.blocks = Blocks::new(window);
        self.blocks.add(&[window], self.samples.len());
        for other in others {
            self.counters.add(&other.counters);
            self.film.join(other.film, window);
        }
        Ok(())
    }

    /// The part of the picture that the sums are of.
    #[must_use]
    pub fn window(&self) -> Window {
        self.film.settings().window
    }

    /// Refuses sums of another render, whatever part and passes they are of.
    pub(crate) fn check_kin(&self, other: &Self) -> Result<(), FilmError> {
        let settings = self.film.settings();
        let same_window = FilmSettings { window: settings.window, ..other.film.settings().clone() };
        match self.recipe.difference(&other.recipe) {
            Some(difference) => {
                Err(FilmError::mismatch(format!("it is of another render, by its {difference}")))
            }
            None if !settings.records_the_same(&same_window) => {
                Err(FilmError::mismatch("it is of another size, or has other auxiliary outputs"))
            }
            None => Ok(()),
        }
    }

    /// Refuses sums that do not have the same samples in all pixels.
    fn check_even(&self) -> Result<(), FilmError> {
        if self.open_pass.is_some() {
            return Err(FilmError::mismatch("a pass was left in the middle: finish it with --resume"));
        }
        if self.blocks.going_on() < self.blocks.words().len() {
            return Err(FilmError::mismatch(
                "parts of the picture are done by their noise: others cannot be added",
            ));
        }
        Ok(())
    }
}
