//! Running a recording on a device.
//!
//! Commands are handed over in portions of a bounded number of workgroups, so that no portion keeps the device from its
//! other users long enough for a watchdog to reset it.

use super::pipelines::{CompileProgress, Pipelines};
use super::pool::Pool;
use super::portion::{Arrival, Run};
use crate::adapters::AdapterReport;
use crate::device::{Device, DeviceChoice, Drivers, Refusal, scoped};
use crate::error::GpuError;
use crate::kernel::Kernel;
use crate::recording::{Download, Recording, Resident};
use bytemuck::NoUninit;

/// How recordings are run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExecutorConfig {
    /// Most bytes that buffers take on the device (default: no bound but the device's).
    pub budget_bytes: u64,
    /// Workgroups after which commands are handed over (default 16384: milliseconds on a slow card).
    pub groups_per_submission: u32,
    /// Fills buffers with this before their first use, so that tests see what a kernel did not write (default: not).
    pub poison: Option<u32>,
}

impl Default for ExecutorConfig {
    fn default() -> Self {
        Self { budget_bytes: u64::MAX, groups_per_submission: 1 << 14, poison: None }
    }
}

/// A device with its memory and its compiled kernels.
#[derive(Debug)]
pub struct Executor {
    device: Device,
    config: ExecutorConfig,
    pool: Pool,
    pipelines: Pipelines,
}

impl Executor {
    /// Opens an adapter of this machine, whose buffers take at most `budget_bytes`; `None` for what it has.
    ///
    /// # Errors
    /// As of [`Drivers::open`].
    pub fn open(choice: DeviceChoice, budget_bytes: Option<u64>) -> Result<Self, GpuError> {
        let device = Drivers::load().open(choice)?;
        let plain = ExecutorConfig::default();
        let budget_bytes = budget_bytes.unwrap_or(plain.budget_bytes);
        Ok(Self::new(device, ExecutorConfig { budget_bytes, ..plain }))
    }

    /// Takes a device into service.
    #[must_use]
    pub fn new(device: Device, config: ExecutorConfig) -> Self {
        let pool = Pool::new(config.budget_bytes);
        Self { device, config, pool, pipelines: Pipelines::default() }
    }

    /// The adapter behind it.
    #[must_use]
    pub const fn adapter(&self) -> &AdapterReport {
        self.device.adapter()
    }

    /// The device.
    #[must_use]
    pub const fn device(&self) -> &Device {
        &self.device
    }

    /// Bytes that buffers take on the device, those kept for later included.
    #[must_use]
    pub const fn held_bytes(&self) -> u64 {
        self.pool.held_bytes()
    }

    /// Compiles kernels ahead of their use. Some drivers finish that at the first dispatch only.
    ///
    /// # Errors
    /// A kernel does not compile, or the device is lost.
    pub fn prepare(
        &mut self,
        kernels: &[&'static Kernel],
        progress: &mut dyn FnMut(CompileProgress),
    ) -> Result<(), GpuError> {
        self.device.check()?;
        self.pipelines.prepare(&self.device, kernels, progress)
    }

    /// A buffer of `bytes` bytes (at least 4) that stays until it is released; it holds anything.
    ///
    /// # Errors
    /// It is larger than the device allows, or does not fit.
    pub fn allocate(&mut self, label: &str, bytes: u64) -> Result<Resident, GpuError> {
        self.device.check()?;
        self.pool.allocate(&self.device, label, bytes)
    }

    /// A buffer with this content that stays until it is released.
    ///
    /// # Errors
    /// As of [`Executor::allocate`] and [`Executor::run`]; then nothing stays.
    pub fn keep<T: NoUninit>(&mut self, label: &'static str, content: &[T]) -> Result<Resident, GpuError> {
        let bytes = bytemuck::cast_slice(content).to_vec();
        let kept = self.allocate(label, bytes.len() as u64)?;
        let mut recording = Recording::new();
        let to = recording.resident(label, kept);
        recording.write(to, bytes);
        self.run(&recording).map(|_| kept).inspect_err(|_| self.release(kept))
    }

    /// Buffers with these contents that stay, all or none; each is small enough for a kernel to see it whole.
    ///
    /// # Errors
    /// As of [`Executor::keep`], or one is larger than a binding.
    pub fn keep_all<const N: usize>(
        &mut self,
        contents: [(&'static str, &[u32]); N],
    ) -> Result<[Resident; N], GpuError> {
        let limit = self.adapter().limits.binding_bytes;
        let mut kept = [Resident::NOTHING; N];
        for (i, (label, words)) in contents.into_iter().enumerate() {
            let wanted = 4 * words.len() as u64;
            let done = if wanted > limit {
                Err(GpuError::Limit { what: format!("the buffer of {label} in bytes"), wanted, limit })
            } else {
                self.keep(label, words)
            };
            kept[i] = done.inspect_err(|_| kept.into_iter().for_each(|resident| self.release(resident)))?;
        }
        Ok(kept)
    }

    /// Lets a buffer go that stayed.
    pub fn release(&mut self, resident: Resident) {
        self.pool.release(resident);
    }

    /// Runs a recording to its end.
    ///
    /// # Errors
    /// The recording makes no sense, memory does not suffice, or the device is lost.
    pub fn run(&mut self, recording: &Recording) -> Result<Results, GpuError> {
        recording.check()?;
        self.prepare(&recording.kernels(), &mut |_| {})?;
        let handle = self.device.device.clone();
        let mut run = Run::new(&self.device, &mut self.pool, &self.pipelines, &self.config, recording)?;
        let outcome = scoped(&handle, || run.all());
        let downloads = run.end();
        self.device.check()?;
        self.explained(outcome)??;
        self.read(&downloads)
    }

    /// A refusal as an error.
    fn explained<T>(&self, outcome: Result<T, Refusal>) -> Result<T, GpuError> {
        outcome.map_err(|refusal| match refusal {
            Refusal::Other(reason) => GpuError::Rejected { reason },
            Refusal::Memory => GpuError::OutOfMemory {
                what: "the driver".into(),
                wanted_bytes: 0,
                held_bytes: self.pool.held_bytes(),
            },
        })
    }

    /// Waits for downloads and reads them.
    fn read(&self, downloads: &[Arrival]) -> Result<Results, GpuError> {
        let read = scoped(&self.device.device, || {
            downloads.iter().for_each(|to| to.buffer.map_async(wgpu::MapMode::Read, .., |_| {}));
            self.device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| e.to_string())?;
            let words = downloads.iter().map(|to| {
                let view = to.buffer.get_mapped_range(..)?;
                Ok(view[..to.bytes as usize].to_vec())
            });
            words.collect::<Result<Vec<_>, wgpu::MapRangeError>>().map_err(|e| e.to_string())
        });
        self.device.check()?;
        let downloads = self.explained(read)?.map_err(|reason| GpuError::Rejected { reason })?;
        Ok(Results { downloads })
    }
}

/// What a recording brought back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Results {
    downloads: Vec<Vec<u8>>,
}

impl Results {
    /// The words of a download; none if it is of another recording.
    #[must_use]
    pub fn words(&self, download: Download) -> Vec<u32> {
        let bytes = self.downloads.get(download.0).map_or(&[][..], Vec::as_slice);
        bytemuck::pod_collect_to_vec(bytes)
    }
}
