//! Choosing an adapter and opening it.
//!
//! Nothing falls back silently: a device says its adapter's name, and one that cannot be had is an error.

use crate::adapters::{self, AdapterReport, Listed};
use crate::error::GpuError;
use crate::limits::to_request;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// Which adapter to open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The first usable card; never a software adapter (`--device auto`).
    Hardware,
    /// The first usable card, else the first usable software adapter (`--device gpu`).
    Any,
    /// The first usable software adapter, for tests.
    Software,
    /// The adapter of this number, whatever it is (`--device gpu:N`).
    Index(u32),
}

/// The drivers of this machine.
#[derive(Debug)]
pub struct Drivers {
    instance: wgpu::Instance,
    backends: wgpu::Backends,
    floor: wgpu::Limits,
}

impl Default for Drivers {
    fn default() -> Self {
        Self::load()
    }
}

impl Drivers {
    /// Loads every driver that there is.
    #[must_use]
    pub fn load() -> Self {
        Self::of(wgpu::Backends::PRIMARY, wgpu::Limits::defaults())
    }

    /// Whether it is worth looking for a card: false where the system has no node for one. Loading drivers takes
    /// time, and some of them print.
    #[must_use]
    pub fn may_have_hardware() -> bool {
        let nodes = ["/dev/dri", "/dev/dxg", "/dev/nvidia0", "/dev/kgsl-3d0", "/dev/mali0"];
        !cfg!(target_os = "linux") || nodes.iter().any(|node| std::path::Path::new(node).exists())
    }

    /// As on a machine without any driver.
    #[must_use]
    pub fn none() -> Self {
        Self::of(wgpu::Backends::empty(), wgpu::Limits::defaults())
    }

    /// As [`Drivers::load`], with kernels that need so much workgroup memory (as if the adapters had too little).
    #[must_use]
    pub fn needing_workgroup_bytes(bytes: u32) -> Self {
        let floor = wgpu::Limits { max_compute_workgroup_storage_size: bytes, ..wgpu::Limits::defaults() };
        Self::of(wgpu::Backends::PRIMARY, floor)
    }

    fn of(backends: wgpu::Backends, floor: wgpu::Limits) -> Self {
        let flags = wgpu::InstanceFlags::empty();
        let without_display = wgpu::InstanceDescriptor::new_without_display_handle();
        let descriptor = wgpu::InstanceDescriptor { backends, flags, ..without_display };
        Self { instance: wgpu::Instance::new(descriptor), backends, floor }
    }

    /// Every adapter, usable or not; hardware first.
    #[must_use]
    pub fn adapters(&self) -> Vec<AdapterReport> {
        self.list().into_iter().map(|listed| listed.report).collect()
    }

    fn list(&self) -> Vec<Listed> {
        adapters::list(&self.instance, self.backends, &self.floor)
    }

    /// Opens the adapter that `choice` names.
    ///
    /// # Errors
    /// There is none such, it cannot run the kernels, or its driver refuses.
    pub fn open(&self, choice: DeviceChoice) -> Result<Device, GpuError> {
        let listed = choose(self.list(), choice)?;
        let adapter = listed.report.name.clone();
        if let Some(reason) = listed.report.unusable {
            return Err(GpuError::Unusable { adapter, reason });
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("vastlight"),
            required_limits: to_request(&listed.adapter.limits()),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(listed.adapter.request_device(&descriptor))
            .map_err(|e| GpuError::Refused { adapter, reason: e.to_string() })?;
        Ok(Device::new(device, queue, listed.report))
    }
}

/// The adapter that was asked for; of several, the first usable one, or else the first, which says what it lacks.
fn choose(mut listed: Vec<Listed>, choice: DeviceChoice) -> Result<Listed, GpuError> {
    let count = listed.len();
    if count == 0 {
        return Err(GpuError::NoAdapter);
    }
    let reports = listed.iter().map(|l| &l.report);
    let place = match choice {
        DeviceChoice::Index(index) if index as usize >= count => {
            return Err(GpuError::NoSuchIndex { index, count });
        }
        DeviceChoice::Index(index) => index as usize,
        DeviceChoice::Any => first_usable(reports, |_| true).unwrap_or(0),
        DeviceChoice::Hardware => first_usable(reports, AdapterReport::is_hardware)
            .ok_or_else(|| no_such_kind("hardware", &listed))?,
        DeviceChoice::Software => first_usable(reports, |report| !report.is_hardware())
            .ok_or_else(|| no_such_kind("software", &listed))?,
    };
    Ok(listed.swap_remove(place))
}

/// The place of the first usable adapter that is `wanted`, else of the first that is.
fn first_usable<'a>(
    reports: impl Iterator<Item = &'a AdapterReport>,
    wanted: impl Fn(&AdapterReport) -> bool,
) -> Option<usize> {
    let places = reports.enumerate().filter(|(_, report)| wanted(report));
    places.min_by_key(|(place, report)| (report.unusable.is_some(), *place)).map(|(place, _)| place)
}

fn no_such_kind(wanted: &'static str, listed: &[Listed]) -> GpuError {
    let names: Vec<&str> = listed.iter().map(|l| l.report.name.as_str()).collect();
    GpuError::NoSuchKind { wanted, found: names.join(", ") }
}

/// What callbacks of the driver tell.
#[derive(Debug, Default)]
struct News {
    lost: Option<String>,
    failure: Option<String>,
}

/// An open adapter.
pub struct Device {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    report: AdapterReport,
    news: Arc<Mutex<News>>,
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Device").field("adapter", &self.report).finish_non_exhaustive()
    }
}

impl Device {
    fn new(device: wgpu::Device, queue: wgpu::Queue, report: AdapterReport) -> Self {
        let news = Arc::new(Mutex::new(News::default()));
        let (of_loss, of_failure) = (Arc::clone(&news), Arc::clone(&news));
        device.set_device_lost_callback(move |reason, words| {
            let words = if words.is_empty() { format!("{reason:?}").to_lowercase() } else { words };
            of_loss.lock().unwrap_or_else(PoisonError::into_inner).lost = Some(words);
        });
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let mut news = of_failure.lock().unwrap_or_else(PoisonError::into_inner);
            news.failure.get_or_insert_with(|| error.to_string());
        }));
        Self { device, queue, report, news }
    }

    /// The adapter behind it.
    #[must_use]
    pub const fn adapter(&self) -> &AdapterReport {
        &self.report
    }

    /// Gives the device up, as a reset of its driver would: all further work is [`GpuError::Lost`].
    pub fn lose(&self) {
        self.device.destroy();
        self.news.lock().unwrap_or_else(PoisonError::into_inner).lost = Some("given up".into());
    }

    /// An error if the device is gone, or failed outside of a scope.
    pub(crate) fn check(&self) -> Result<(), GpuError> {
        let mut news = self.news.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(reason) = &news.lost {
            return Err(GpuError::Lost { adapter: self.report.name.clone(), reason: reason.clone() });
        }
        news.failure.take().map_or(Ok(()), |reason| Err(GpuError::Rejected { reason }))
    }
}

/// Does `work` and hands out what the driver refused meanwhile.
pub(crate) fn scoped<T>(device: &wgpu::Device, work: impl FnOnce() -> T) -> Result<T, Refusal> {
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let done = work();
    let validation = pollster::block_on(validation.pop());
    let memory = pollster::block_on(memory.pop());
    let internal = pollster::block_on(internal.pop());
    match (memory, validation.or(internal)) {
        (None, None) => Ok(done),
        (Some(_), _) => Err(Refusal::Memory),
        (None, Some(error)) => Err(Refusal::Other(error.to_string())),
    }
}

/// What the driver refused.
pub(crate) enum Refusal {
    Memory,
    Other(String),
}
