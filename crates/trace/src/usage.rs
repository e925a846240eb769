//! What work takes of the machine: memory at its peak, processor time. Read from the proc file system, where there is one.

use std::fs;

/// Does the work; gives with its answer by how much the resident memory of the process grew meanwhile, in bytes, at most.
/// Memory that was resident and free before counts as none, so measure before other work frees much.
pub(crate) fn peak_growth<T>(work: impl FnOnce() -> T) -> (T, Option<u64>) {
    // "5" makes the peak what is resident now.
    let reset = fs::write("/proc/self/clear_refs", "5").ok();
    let before = reset.and_then(|()| kilobytes("VmRSS:"));
    let done = work();
    let growth = before.and_then(|before| Some(1024 * kilobytes("VmHWM:")?.saturating_sub(before)));
    (done, growth)
}

/// A line of the process's status.
fn kilobytes(key: &str) -> Option<u64> {
    let text = fs::read_to_string("/proc/self/status").ok()?;
    let value = text.lines().find_map(|line| line.strip_prefix(key))?;
    value.trim().strip_suffix("kB")?.trim().parse().ok()
}

/// The least processor time that a work took of several times. Unlike the time on the wall it hardly depends on what else
/// the machine does.
#[derive(Default)]
pub(crate) struct LeastCpu {
    /// In milliseconds; none where the system does not say.
    pub(crate) ms: Option<f64>,
}

impl LeastCpu {
    /// Does the work once more.
    pub(crate) fn of<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let before = cpu_ms();
        let done = work();
        if let (Some(before), Some(after)) = (before, cpu_ms()) {
            self.ms = Some((after - before).min(self.ms.unwrap_or(f64::INFINITY)));
        }
        done
    }
}

/// Processor time of the process, threads that ended included, in milliseconds.
#[cfg(unix)]
fn cpu_ms() -> Option<f64> {
    use rustix::time::{ClockId, clock_gettime};
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 / 1e6)
}

/// Not asked of other systems.
#[cfg(not(unix))]
fn cpu_ms() -> Option<f64> {
    None
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;
    use std::env;
    use std::process::Command;

    #[test]
    fn memory_and_time_that_work_takes_are_seen() {
        in_a_process_of_its_own("usage::tests::memory_and_time_that_work_takes_are_seen", || {
            let touch = |bytes: usize| (0..bytes).map(|i| i as u8 | 1).collect::<Vec<u8>>();
            let (kept, grown) = peak_growth(|| touch(64 << 20));
            let grown = grown.expect("a proc file system");
            assert!((60 << 20..90 << 20).contains(&grown), "{grown}, {}", kept.len());
            assert!(peak_growth(|| kept.len()).1.expect("as before") < 8 << 20);
            let mut least = LeastCpu::default();
            assert!(least.of(|| touch(64 << 20)).iter().all(|&x| x > 0) && least.ms.expect("a clock") > 0.0);
            let once = least.ms;
            least.of(|| touch(1 << 20));
            assert!(least.ms < once, "the smaller work counts");
        });
    }

    #[test]
    fn the_time_of_threads_that_ended_counts() {
        let spin = || (0..1_u64 << 24).fold(0, |sum, i| std::hint::black_box(sum ^ i));
        let mut least = LeastCpu::default();
        least.of(|| std::thread::spawn(spin).join().expect("no panic"));
        assert!(least.ms.expect("a clock") > 1.0);
    }

    /// Runs the body of a test where no other test takes memory and time: in a second run of the test program.
    fn in_a_process_of_its_own(test: &str, body: impl FnOnce()) {
        const ALONE: &str = "VASTLIGHT_TEST_ALONE";
        if env::var_os(ALONE).is_some() {
            return body();
        }
        let program = env::current_exe().expect("the test program");
        let output =
            Command::new(program).args(["--exact", test]).env(ALONE, "1").output().expect("a process");
        let printed = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && printed.contains("1 passed"), "{printed}");
    }
}
