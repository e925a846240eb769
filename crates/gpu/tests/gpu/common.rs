//! The software adapter, opened once a test program.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use vastlight_gpu::kernel::{Kernel, StructLayout};
use vastlight_gpu::{DeviceChoice, Drivers, Executor, ExecutorConfig, Groups, Recording};

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

/// Parameters of a probe: how many records there are.
pub(crate) static PROBE: StructLayout =
    StructLayout { name: "Parameters", bytes: 4, fields: &[("count", 0, 4)] };

/// Declares a kernel that answers records one by one, from its file beside the test: `parameters.count` records, 64 a
/// workgroup; binding 1 the answers, 2 the records, further ones tables.
macro_rules! probe {
    ($constant:ident = $name:literal, $buffers:literal) => {
        pub(crate) static $constant: vastlight_gpu::kernel::Kernel = vastlight_gpu::kernel::Kernel {
            name: $name,
            source: include_str!(concat!($name, ".wgsl")),
            parameters: &crate::common::PROBE,
            buffers: $buffers,
        };
    };
}
pub(crate) use probe;

/// The words that a probe answers, `words` for each of `count` records; none without an adapter.
pub(crate) fn answers(
    probe: &'static Kernel,
    inputs: &[&[u32]],
    count: usize,
    words: usize,
) -> Option<Vec<u32>> {
    let mut executor = software()?;
    let mut recording = Recording::new();
    let results = recording.buffer("answers", (count * words) as u64);
    let inputs = inputs.iter().map(|input| recording.upload("records", input));
    let buffers: Vec<_> = std::iter::once(results).chain(inputs.collect::<Vec<_>>()).collect();
    recording.dispatch(probe, &(count as u32), &buffers, Groups::Direct(count.div_ceil(64) as u32));
    let results = recording.download(results, (count * words) as u64);
    Some(executor.run(&recording).expect("runs").words(results).to_vec())
}
