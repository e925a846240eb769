//! A pass of photons: many sent together, and made a map.

use super::flight::{Departure, Flight, Landed};
use super::plan::PhotonPlan;
use super::seen::Seen;
use super::{Photon, PhotonMaps, cells};
use crate::pages::PagesError;
use crate::renderer::Renderer;
use crate::wavefront::Wave;
use rayon::prelude::*;
use std::cell::Cell;

/// Photons that fly together.
const TOGETHER: u32 = 8192;

thread_local! {
    static FLIGHT: Cell<Flight> = Cell::default();
}

impl Renderer<'_> {
    /// Whether photons begin at point and spot lights by a grid.
    #[must_use]
    pub fn has_photon_grid(&self) -> bool {
        let wanted = self.settings().caustics.is_some_and(|settings| settings.grid.is_some());
        wanted && !self.lights.punctual().is_empty()
    }

    /// Decides where photons begin and how far they are gathered; none where the settings want no photons.
    ///
    /// # Errors
    /// A page of a scene in pages cannot be had.
    pub fn photon_plan(&self) -> Result<Option<PhotonPlan>, PagesError> {
        let Some(settings) = &self.settings().caustics else { return Ok(None) };
        let cells = cells::cells(self.scene, self.materials);
        let size = self.scene.bounds().size().max_element();
        if let (Some(grid), false) = (settings.grid, self.lights.punctual().is_empty()) {
            return PhotonPlan::gridded(&cells, self.lights, settings, (grid, size), |d| Ok(self.fly(d)?.0))
                .map(Some);
        }
        let mut wave = Wave::default();
        wave.walk_through(self.walk()?);
        let seen = Seen::new(&self.context(None), wave)?;
        let photons = settings.count(self.settings().whole().pixels());
        PhotonPlan::new(cells, &seen, settings, (photons, size), |departure| Ok(self.fly(departure)?.0))
            .map(Some)
    }

    /// The photons of the pass of this number, ready to be gathered, and how many rays they took. They depend on scene, settings and
    /// number alone.
    ///
    /// # Errors
    /// A page of a scene in pages cannot be had.
    pub fn photon_maps(&self, plan: &PhotonPlan, pass: u32) -> Result<(PhotonMaps, u64), PagesError> {
        let (photons, rays) = self.photons(plan, pass)?;
        Ok((plan.maps(&photons, pass), rays))
    }

    /// The photons of the pass of this number, and how many rays they took.
    ///
    /// # Errors
    /// A page of a scene in pages cannot be had.
    pub fn photons(&self, plan: &PhotonPlan, pass: u32) -> Result<(Vec<Photon>, u64), PagesError> {
        let departure = Departure { emission: &plan.emission, pass, photons: plan.photons };
        let (landed, rays) = self.fly(&departure)?;
        Ok((landed.iter().map(|landed| landed.photon).collect(), rays))
    }

    /// All photons of a pass, in the order of their numbers.
    fn fly(&self, departure: &Departure<'_>) -> Result<(Vec<Landed>, u64), PagesError> {
        if departure.is_empty() {
            return Ok((Vec::new(), 0));
        }
        let context = self.context(None);
        let starts: Vec<u32> = (0..departure.photons).step_by(TOGETHER as usize).collect();
        let parts: Result<Vec<(Vec<Landed>, u64)>, PagesError> = starts
            .par_iter()
            .map(|&start| {
                let mut flight = FLIGHT.take();
                flight.front.walk = self.walk()?;
                let end = departure.photons.min(start + TOGETHER);
                let result = flight.run(&context, departure, start..end);
                let result = result.map(|(landed, rays)| (landed.to_vec(), rays));
                flight.front.walk = None;
                FLIGHT.set(flight);
                Ok(result?)
            })
            .collect();
        let parts = parts?;
        let rays = parts.iter().map(|(_, rays)| rays).sum();
        Ok((parts.into_iter().flat_map(|(landed, _)| landed).collect(), rays))
    }
}
