//! The stages of a segment, each as one pass or, where not all pages are on the device, as several: a pass of all, then of those that
//! waited for pages.

use super::wave::Buffers;
use super::{
    CLOSEST, CLOSEST_SETTLED, DeviceRenderer, LEFT, NEXT, NextParameters, RAYS, SHADE, SHADOW, SHADOW_RAYS,
    SHADOW_SETTLED, SHADOWS, SPARE, SettledParameters, ShadeParameters, TAILS, WAITING, WalkParameters,
};
use crate::error::GpuError;
use crate::kernel::Kernel;
use crate::recording::{Buffer, Groups, Recording};
use vastlight_transport::{DirectSampling, Integrator};

/// A stage of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// The closest hits of all paths.
    Closest,
    /// Shading what was hit.
    Shade,
    /// The shadow rays that shading cast.
    Shadow,
}

impl Stage {
    /// All stages, in order.
    pub(super) const ALL: [Self; 3] = [Self::Closest, Self::Shade, Self::Shadow];
}

/// A pass of a stage.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pass {
    /// The segment; the first has the number 1.
    depth: u32,
    /// 0 for the pass of all.
    number: u32,
}

impl Pass {
    /// The pass of all.
    pub(super) const fn first(depth: u32) -> Self {
        Self { depth, number: 0 }
    }

    /// The queue of the paths of this segment, and that of the next.
    const fn paths(&self) -> [u32; 2] {
        [1 - self.depth % 2, self.depth % 2]
    }

    /// The queue that the pass takes from, where `all` is that of the whole stage.
    const fn full(&self, all: u32) -> u32 {
        if self.number == 0 { all } else { WAITING[self.number as usize % 2] }
    }

    /// The queue of those that wait after it.
    const fn waiting(&self) -> u32 {
        WAITING[(self.number as usize + 1) % 2]
    }

    /// The queue of rays that are not settled, and that of those which wait after it.
    const fn left(&self) -> [u32; 2] {
        [LEFT[self.number as usize % 2], LEFT[(self.number as usize + 1) % 2]]
    }

    const fn again(&self) -> u32 {
        if self.number == 0 { 0 } else { 1 }
    }
}

impl DeviceRenderer<'_> {
    /// Records a pass of a stage.
    pub(super) fn record_stage(&self, recording: &mut Recording, b: &Buffers, stage: Stage, pass: &Pass) {
        let [paths, next] = pass.paths();
        match stage {
            Stage::Closest => {
                let first = bit(next) | bit(SHADOWS) | bit(LEFT[0]) | bit(LEFT[1]);
                self.take(recording, b, (pass, pass.full(paths)), (first, RAYS));
                self.walk(recording, b, [&CLOSEST, &CLOSEST_SETTLED], (pass, pass.full(paths)));
            }
            Stage::Shade => {
                self.take(recording, b, (pass, pass.full(paths)), (0, SPARE));
                let [first, second] = b.pages.pool;
                let seen = [b.tables, b.lights, first, second, b.pages.table, b.paths, b.queues, b.tails];
                let parameters = self.shade_parameters(pass);
                recording.dispatch(&SHADE, &parameters, &seen, Groups::Indirect(b.workgroups, 0));
            }
            Stage::Shadow => {
                let first = bit(LEFT[0]) | bit(LEFT[1]);
                self.take(recording, b, (pass, pass.full(SHADOWS)), (first, SHADOW_RAYS));
                self.walk(recording, b, [&SHADOW, &SHADOW_SETTLED], (pass, pass.full(SHADOWS)));
            }
        }
    }

    /// Records the size of a pass over a queue, and empties those it writes to; `first` are those that the first pass empties
    /// besides, and counts in `total`.
    fn take(
        &self,
        recording: &mut Recording,
        b: &Buffers,
        (pass, full): (&Pass, u32),
        (first, total): (u32, u32),
    ) {
        let own = bit(pass.waiting());
        let (empties, total) = match pass.number {
            0 => (own | first, total),
            _ => (own | bit(pass.left()[1]), SPARE),
        };
        next(recording, b.tails, b.workgroups, &NextParameters { full, empties, total });
    }

    /// Records rays of a queue on their way: all by the first kernel, those that it leaves by the second.
    fn walk(
        &self,
        recording: &mut Recording,
        b: &Buffers,
        [kernel, settled]: [&'static Kernel; 2],
        (pass, full): (&Pass, u32),
    ) {
        let (capacity, again, [left, left_waiting]) = (self.wave.capacity, pass.again(), pass.left());
        let [first, second] = b.pages.pool;
        let parameters = WalkParameters { capacity, full, waiting: pass.waiting(), left, again };
        let seen = [b.tree, first, second, b.pages.table, b.paths, b.queues, b.tails];
        recording.dispatch(kernel, &parameters, &seen, Groups::Indirect(b.workgroups, 0));
        let size = NextParameters { full: left, empties: 0, total: SPARE };
        next(recording, b.tails, b.workgroups_left, &size);
        let depth = pass.depth;
        let parameters = SettledParameters { capacity, full: left, waiting: left_waiting, again, depth };
        let seen = [b.tree, first, second, b.pages.table, b.tables, b.paths, b.queues, b.tails];
        recording.dispatch(settled, &parameters, &seen, Groups::Indirect(b.workgroups_left, 0));
    }

    fn shade_parameters(&self, pass: &Pass) -> ShadeParameters {
        let settings = self.renderer.settings();
        let [paths, next] = pass.paths();
        ShadeParameters {
            capacity: self.wave.capacity,
            depth: pass.depth,
            full: pass.full(paths),
            next,
            waiting: pass.waiting(),
            again: pass.again(),
            max_depth: settings.max_depth,
            integrator: match settings.integrator {
                Integrator::Path | Integrator::Steps | Integrator::Whitted | Integrator::PhotonCaustics => 0,
                Integrator::Direct => 1,
                Integrator::Primary => 2,
                Integrator::Ao => 3,
            },
            roulette: u32::from(settings.russian_roulette),
            direct_sampling: match settings.direct_sampling {
                DirectSampling::Both => 0,
                DirectSampling::Bsdf => 1,
                DirectSampling::Light => 2,
            },
            ao_distance: self.renderer.ao_distance().to_bits(),
        }
    }

    /// Runs a stage whose first pass is recorded, and further passes while something waits for pages, which come between them.
    pub(super) fn until_none_waits(
        &mut self,
        recording: &mut Recording,
        buffers: &mut Buffers,
        stage: Stage,
        depth: u32,
    ) -> Result<(), GpuError> {
        let mut pass = Pass::first(depth);
        loop {
            let plan = self.pages.record_plan(recording, &buffers.pages)?;
            let tails = recording.download(buffers.tails, TAILS);
            let results = self.executor.run(recording)?;
            let tails = results.words(tails);
            (*recording, *buffers) = self.anew();
            let held = |queue: u32| tails.get(queue as usize).copied().unwrap_or(0);
            // Shading settles everything at once, and leaves that queue as it was.
            let waiting = held(pass.waiting()) + if stage == Stage::Shade { 0 } else { held(pass.left()[1]) };
            if waiting == 0 {
                return Ok(());
            }
            self.pages.swap(self.executor, &mut self.source, (&plan, &results))?;
            pass.number += 1;
            self.record_stage(recording, buffers, stage, &pass);
        }
    }
}

const fn bit(queue: u32) -> u32 {
    1 << queue
}

fn next(recording: &mut Recording, tails: Buffer, workgroups: Buffer, parameters: &NextParameters) {
    recording.dispatch(&NEXT, parameters, &[tails, workgroups], Groups::Direct(1));
}
