//! The software adapter, opened once a test program.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use vastlight_gpu::{DeviceChoice, Drivers, Executor, ExecutorConfig};

/// What fills buffers before their first use.
pub(crate) const POISON: u32 = 0xdead_beef;

/// The software adapter, with poisoned buffers; none, and a line about it, where there is none.
pub(crate) fn software() -> Option<MutexGuard<'static, Executor>> {
    static SHARED: OnceLock<Option<Mutex<Executor>>> = OnceLock::new();
    let shared = SHARED.get_or_init(|| {
        let device = Drivers::load().open(DeviceChoice::Software).ok()?;
        let config = ExecutorConfig { poison: Some(POISON), ..ExecutorConfig::default() };
        Some(Mutex::new(Executor::new(device, config)))
    });
    if shared.is_none() {
        skipped();
    }
    shared.as_ref().map(|executor| executor.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Says that a test was skipped since there is no adapter; false.
#[expect(clippy::print_stdout, reason = "what was skipped is counted from the output")]
pub(crate) fn skipped() -> bool {
    println!("skipped: no adapter: no software Vulkan driver (Debian: mesa-vulkan-drivers libvulkan1)");
    false
}
