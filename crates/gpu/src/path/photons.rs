//! The papers' renderer on a device: D. Bogolepov, D. Sopin, V. Turlapov 2010, "Simulation of caustics in real time". Photons fly from
//! point lights by the kernels of the stream tracer, are sorted by voxels, and light the surfaces that its rays meet.
//!
//! A photon has a slot for each of its first landings (one as published; a second for surfaces that mirror beside scattering), so that
//! the order of photons does not depend on which workgroup comes first. Further landings, which the CPU keeps, are lost.

use super::DeviceRenderer;
use super::stream::{OWN_KERNELS as STREAM, SHADE_RAYS, SPARE, Streams, TRAVERSE, Waiting};
use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::photon::voxels::{self, BOUNDS_WORDS, Bounds, PhotonIndex, Unsorted};
use crate::photon::{KERNELS as INDEX, PHOTONS_AT_ONCE};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording, Resident};
use std::time::Instant;
use vastlight_transport::photon::{GridPass, PHOTON_WORDS, PhotonPlan, VoxelGrid};

/// Landings of a photon that are kept.
const LANDINGS: u32 = 2;

device_struct! {
    struct StartParameters as "Parameters" {
        slots, capacity, count, first, photons, columns, rows, shift_x, shift_y, pass_first, seed, landings, next
    }
}
device_struct! {
    struct ArriveParameters as "Parameters" {
        slots, capacity, full, next, photons, pass_first, seed, landings, max_depth
    }
}
device_struct! {
    struct GatherParameters as "Parameters" { slots, full, max_depth, first, end }
}
kernel!(pub(crate) START = "photon_start", StartParameters, 7);
kernel!(pub(crate) ARRIVE = "photon_arrive", ArriveParameters, 8);
kernel!(pub(crate) GATHER = "stream_photons", GatherParameters, 8);

/// The kernels that no other integrator has, but for those that sort.
pub(crate) static KERNELS: [&Kernel; 3] = [&START, &ARRIVE, &GATHER];
/// All kernels of the integrator.
pub(super) static OWN_KERNELS: [&Kernel; 13] = [
    STREAM[0], STREAM[1], STREAM[2], STREAM[3], STREAM[4], STREAM[5], INDEX[0], INDEX[1], INDEX[2], INDEX[3],
    &START, &ARRIVE, &GATHER,
];

/// The photons of a pass on a device, in the order of their voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct DevicePhotons {
    map: Resident,
    voxels: Resident,
    count: u32,
}

/// The same in one recording.
#[derive(Clone, Copy, Debug)]
pub(super) struct PhotonLight {
    index: PhotonIndex,
    count: u32,
}

impl DevicePhotons {
    /// Those of a recording.
    pub(super) fn light(&self, recording: &mut Recording) -> PhotonLight {
        let map = recording.resident("photons in order", self.map);
        let index = PhotonIndex { map, voxels: recording.resident("voxels", self.voxels) };
        PhotonLight { index, count: self.count }
    }
}

/// What a pass of photons took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotonPass {
    /// Rays of photons.
    pub rays: u64,
    /// Photons that landed.
    pub landed: u32,
    /// Photons' flight, ms.
    pub trace_ms: f64,
    /// Sorting and indexing, ms.
    pub index_ms: f64,
}

impl Waiting {
    /// Adds the light of photons to the samples of rays that wait for shading.
    pub(super) fn gather(&self, recording: &mut Recording, photons: &PhotonLight, max_depth: u32) {
        let (b, PhotonLight { index, count }) = (&self.b, *photons);
        let seen =
            [b.tables, index.map, index.voxels, b.pages.pool[0], b.pages.table, self.rays, b.queues, b.tails];
        for first in (0..count).step_by(PHOTONS_AT_ONCE as usize) {
            let end = count.min(first + PHOTONS_AT_ONCE);
            let parameters = GatherParameters { slots: self.slots, full: SHADE_RAYS, max_depth, first, end };
            recording.dispatch(&GATHER, &parameters, &seen, self.groups());
        }
    }
}

impl DeviceRenderer<'_> {
    /// Sends the photons of the pass of this number, in place of those that were there. Samples are rendered under their light from then
    /// on.
    ///
    /// # Errors
    /// The integrator is none of photons, they do not begin by a grid, they are too many, or the device fails.
    pub fn send_photons(&mut self, plan: &PhotonPlan, pass: u32) -> Result<PhotonPass, GpuError> {
        self.release_photons();
        let pass = plan.grid_pass(pass, self.renderer.settings().seed);
        let (Some(pass), Some(streams)) = (pass, self.wave.streams) else {
            let reason =
                "photons on graphics processors begin at point and spot lights, by a grid".to_owned();
            return Err(GpuError::Scene { reason });
        };
        let bytes = 4 * PHOTON_WORDS as u64 * u64::from(LANDINGS) * u64::from(pass.photons);
        let limit = self.executor.adapter().limits.binding_bytes;
        if bytes > limit {
            return Err(GpuError::Limit { what: "photons in bytes".to_owned(), wanted: bytes, limit });
        }
        let unsorted = self.executor.allocate("photons", bytes)?;
        let sent = self.send(&pass, streams, unsorted);
        self.executor.release(unsorted);
        if sent.is_err() {
            self.release_photons();
        }
        sent
    }

    /// The photons that were sent, in the order of their voxels, [`PHOTON_WORDS`] words each; none where none were sent.
    ///
    /// # Errors
    /// The device fails.
    pub fn photon_words(&mut self, landed: u32) -> Result<Vec<u32>, GpuError> {
        let Some(photons) = self.photons else { return Ok(Vec::new()) };
        let mut recording = Recording::new();
        let map = photons.light(&mut recording).index.map;
        let words = recording.download(map, voxels::map_words(landed));
        Ok(self.executor.run(&recording)?.words(words).split_off(VoxelGrid::WORDS))
    }

    pub(super) fn release_photons(&mut self) {
        if let Some(DevicePhotons { map, voxels, .. }) = self.photons.take() {
            self.executor.release(map);
            self.executor.release(voxels);
        }
    }

    fn send(
        &mut self,
        pass: &GridPass,
        streams: Streams,
        unsorted: Resident,
    ) -> Result<PhotonPass, GpuError> {
        let start = Instant::now();
        let mut rays = 0;
        for first in (0..pass.photons).step_by(self.wave.capacity as usize) {
            rays += self.fly(pass, streams, (unsorted, first))?;
        }
        let trace_ms = start.elapsed().as_secs_f64() * 1e3;
        let landed = self.sort(pass, unsorted)?;
        let index_ms = start.elapsed().as_secs_f64() * 1e3 - trace_ms;
        Ok(PhotonPass { rays, landed, trace_ms, index_ms })
    }

    /// A wave of photons from the number `first` on, to their end. Gives the number of their rays.
    fn fly(
        &mut self,
        pass: &GridPass,
        streams: Streams,
        (unsorted, first): (Resident, u32),
    ) -> Result<u64, GpuError> {
        let settings = self.renderer.settings();
        let arrival = ArriveParameters {
            slots: streams.slots,
            capacity: self.wave.capacity,
            full: SHADE_RAYS,
            next: TRAVERSE,
            photons: pass.photons,
            pass_first: pass.pass.wrapping_mul(pass.photons),
            seed: settings.seed,
            landings: LANDINGS,
            max_depth: settings.max_depth,
        };
        let (mut recording, waiting) = self.waiting(streams);
        let photons = recording.resident("photons", unsorted);
        start(&mut recording, &waiting, pass, (&arrival, photons, first));
        let arrive = |waiting: &Waiting, recording: &mut Recording| {
            let photons = recording.resident("photons", unsorted);
            waiting.arrive(recording, &arrival, photons);
        };
        Ok(self.follow(streams, (recording, waiting), arrive)?.rays.into())
    }

    /// Sorts photons, and keeps them. Gives how many landed.
    fn sort(&mut self, pass: &GridPass, unsorted: Resident) -> Result<u32, GpuError> {
        let count = LANDINGS * pass.photons;
        let mut recording = Recording::new();
        let photons = recording.resident("photons", unsorted);
        let bounds = voxels::record_bounds(&mut recording, photons, count);
        let bounds = recording.download(bounds, BOUNDS_WORDS);
        let Bounds { bounds, kept } = Bounds::from_words(&self.executor.run(&recording)?.words(bounds));
        let numbers = [kept, count - kept].map(|number| number as usize);
        let grid = VoxelGrid::new(bounds, numbers, pass.radius, pass.weight);
        let map = self.executor.allocate("photons in order", 4 * voxels::map_words(kept))?;
        let places = self.executor.allocate("voxels", 4 * voxels::voxel_words(&grid));
        let voxels = places.inspect_err(|_| self.executor.release(map))?;
        let sorted = DevicePhotons { map, voxels, count: kept };
        self.photons = Some(sorted);
        let mut recording = Recording::new();
        let index = sorted.light(&mut recording).index;
        let photons = recording.resident("photons", unsorted);
        let unsorted = Unsorted { photons, count, kept };
        voxels::record(&mut recording, unsorted, (&grid, pass.weight), index)?;
        self.executor.run(&recording)?;
        Ok(kept)
    }
}

impl Waiting {
    /// Photons that wait for shading arrive at surfaces.
    fn arrive(&self, recording: &mut Recording, parameters: &ArriveParameters, photons: Buffer) {
        let b = &self.b;
        self.next(recording, SHADE_RAYS, [SPARE, SPARE]);
        let seen = [b.tables, b.pages.pool[0], b.pages.table, b.paths, self.rays, b.queues, b.tails, photons];
        recording.dispatch(&ARRIVE, parameters, &seen, self.groups());
        self.next(recording, SPARE, [SHADE_RAYS, SPARE]);
    }
}

/// Records the start of a wave of photons from the number `first` on.
fn start(
    recording: &mut Recording,
    waiting: &Waiting,
    pass: &GridPass,
    (arrival, photons, first): (&ArriveParameters, Buffer, u32),
) {
    let b = &waiting.b;
    recording.clear(b.tails);
    let rectangles = recording.upload("rectangles", &pass.rectangles);
    let count = arrival.capacity.min(pass.photons - first);
    let [columns, rows] = pass.grid;
    let [shift_x, shift_y] = pass.shift.to_array().map(f32::to_bits);
    let ArriveParameters { slots, capacity, photons: all, pass_first, seed, landings, next, .. } = *arrival;
    let parameters = StartParameters {
        slots,
        capacity,
        count,
        first,
        photons: all,
        columns,
        rows,
        shift_x,
        shift_y,
        pass_first,
        seed,
        landings,
        next,
    };
    let seen = [b.lights, rectangles, b.paths, waiting.rays, b.queues, b.tails, photons];
    recording.dispatch(&START, &parameters, &seen, Groups::Direct(count.div_ceil(GROUP)));
}
