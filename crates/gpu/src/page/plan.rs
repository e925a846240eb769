//! Which pages come and which leave, after a pass.
//!
//! Why it ends: who waits asks for what it has not found, and from its second pass on also for what it has found. Pages are ordered by
//! who asks, so those of the waiting path with the least number stay or come, if there are slots for as many as one path may need. In
//! its next pass that path has them all and goes on: its ray by a turn at least (see the part `walk`), its shading by a level at least
//! of the chain from attributes to textures. Turns are finite. Where a path needs more pages than there are slots nothing comes
//! twice, and that is an error.

use super::{DevicePages, FORGET_AFTER, NONE, PageBuffers};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::radix::Pairs;
use crate::primitives::{GROUP, compact, radix};
use crate::recording::{Buffer, Download, Groups, Recording};
use crate::run::{Executor, Results};
use vastlight_transport::words::ScenePages;
use vastlight_transport::words::pages::KINDS;

/// Bits of the keys.
const KEY_BITS: u32 = 24;

device_struct! {
    struct KeyParameters as "Parameters" { pages, second, third, fourth, forget }
}
device_struct! {
    struct PlanParameters as "Parameters" {
        pages, second, third, fourth, slots_of_first, slots_of_second, slots_of_third, slots_of_fourth
    }
}
kernel!(pub(crate) KEYS = "page_keys", KeyParameters, 3);
kernel!(pub(crate) PLAN = "page_plan", PlanParameters, 6);

/// What the device says about what should change.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Numbers of pages, and how many they are.
    come: [Download; 2],
    leave: [Download; 2],
}

impl DevicePages {
    /// Records the plan of a swap; to be called after each pass that may have asked for pages.
    ///
    /// # Errors
    /// There are more pages than can be sorted.
    pub fn record_plan(
        &mut self,
        recording: &mut Recording,
        buffers: &PageBuffers,
    ) -> Result<Plan, GpuError> {
        let pages = self.places.len() as u32;
        let [_, second, third, fourth] = self.kinds.map(|kind| kind.first);
        self.swaps += 1;
        let forget = u32::from(self.swaps.is_multiple_of(FORGET_AFTER));
        let keys = recording.buffer("keys of pages", pages.into());
        let numbers = recording.buffer("numbers of pages", pages.into());
        let parameters = KeyParameters { pages, second, third, fourth, forget };
        let groups = Groups::Direct(pages.div_ceil(GROUP));
        recording.dispatch(&KEYS, &parameters, &[buffers.table, keys, numbers], groups);
        let pairs = Pairs { keys, payloads: Some(numbers) };
        let sorted = radix::record(recording, pairs, pages, KEY_BITS)?;
        let numbers = sorted.payloads.unwrap_or(numbers);
        let [slots_of_first, slots_of_second, slots_of_third, slots_of_fourth] = self.slots;
        let parameters = PlanParameters {
            pages,
            second,
            third,
            fourth,
            slots_of_first,
            slots_of_second,
            slots_of_third,
            slots_of_fourth,
        };
        let [comes, leaves, backwards] =
            ["pages to come", "pages to leave", "pages backwards"].map(|l| recording.buffer(l, pages.into()));
        let seen = [buffers.table, sorted.keys, numbers, comes, leaves, backwards];
        recording.dispatch(&PLAN, &parameters, &seen, groups);
        let come = self.chosen(recording, comes, numbers, pages)?;
        let leave = self.chosen(recording, leaves, backwards, pages)?;
        Ok(Plan { come, leave })
    }

    /// Records the download of those numbers whose flag is set: no more than there are slots.
    fn chosen(
        &self,
        recording: &mut Recording,
        flags: Buffer,
        numbers: Buffer,
        pages: u32,
    ) -> Result<[Download; 2], GpuError> {
        let chosen = compact::record(recording, flags, numbers, pages)?;
        let most: u64 = self.slots.iter().map(|&slots| u64::from(slots)).sum();
        let list = recording.download(chosen.kept, most.min(pages.into()));
        Ok([list, recording.download(chosen.count, 1)])
    }

    /// Swaps pages as planned.
    ///
    /// # Errors
    /// There is nothing to swap although somebody waits, or a page cannot be had.
    pub fn swap(
        &mut self,
        executor: &mut Executor,
        pages: &mut ScenePages<'_>,
        (plan, results): (&Plan, &Results),
    ) -> Result<(), GpuError> {
        self.stats.waits += 1;
        let list = |[list, count]: [Download; 2]| {
            let mut list = results.words(list);
            list.truncate(results.words(count).first().copied().unwrap_or(0) as usize);
            list
        };
        let (come, leave) = (list(plan.come), list(plan.leave));
        // Once may be for those that found all they needed, and asked for it so that it stays.
        if come.is_empty() && self.nothing_came {
            let what = "what one path needs of the scene at once".to_owned();
            let (wanted_bytes, held_bytes) = (self.stats.slot_bytes + 1, executor.held_bytes());
            return Err(GpuError::OutOfMemory { what, wanted_bytes, held_bytes });
        }
        self.nothing_came = come.is_empty();
        let mut wanted = [0_usize; KINDS];
        come.iter().for_each(|&page| wanted[self.kind_of(page)] += 1);
        let mut gone = Vec::new();
        // Those that deserve their place least stand first.
        for page in leave {
            let kind = self.kind_of(page);
            if self.free[kind].len() < wanted[kind] {
                self.free[kind].push(std::mem::replace(&mut self.places[page as usize], NONE));
                gone.push([page, NONE]);
            }
        }
        self.bring(executor, pages, (&come, gone))
    }
}
