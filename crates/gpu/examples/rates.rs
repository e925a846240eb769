//! What each primitive takes on a device, and what its kernels take to compile:
//! `cargo run --release -p vastlight-gpu --example rates -- [ELEMENTS] [ADAPTER]`.
//!
//! Times are the best of several, from handing commands over to the end of the last; elements are on the device already.

use std::time::Instant;
use vastlight_gpu::kernel;
use vastlight_gpu::primitives::reduce::Operation;
use vastlight_gpu::primitives::{bitonic, compact, histogram, queue, radix, reduce, runs, scan};
use vastlight_gpu::{Buffer, CompileProgress, DeviceChoice, Executor, GpuError, Recording, Resident};

/// Runs of each primitive; the best counts.
const REPEATS: u32 = 7;

fn main() -> Result<(), GpuError> {
    let argument = |i: usize| std::env::args().nth(i).and_then(|text| text.parse::<u32>().ok());
    let n = argument(1).unwrap_or(1_000_000);
    let choice = argument(2).map_or(DeviceChoice::Any, DeviceChoice::Index);
    let mut executor = Executor::open(choice, None)?;
    show(format!("{}, {n} elements", executor.adapter().name));

    let mut compiled: Vec<CompileProgress> = Vec::new();
    executor.prepare(&kernel::all(), &mut |progress| compiled.push(progress))?;
    for CompileProgress { kernel, ms, .. } in compiled {
        show(format!("| `{kernel}` | {ms:.1} ms to compile |"));
    }

    let words: Vec<u32> = (0..n).map(|i| i.wrapping_mul(2_654_435_761)).collect();
    let input = executor.keep("words", &words)?;
    for (name, record) in PRIMITIVES {
        measure(&mut executor, name, input, n, record)?;
    }
    Ok(())
}

type Record = fn(&mut Recording, Buffer, u32) -> Result<(), GpuError>;

const PRIMITIVES: [(&str, Record); 9] = [
    ("reduce", |r, words, n| reduce::record(r, words, n, Operation::Max).map(drop)),
    ("scan", |r, words, n| scan::record(r, words, n).map(drop)),
    ("compact", |r, words, n| compact::record(r, words, words, n).map(drop)),
    ("runs", |r, words, n| runs::record(r, words, n, 15).map(drop)),
    ("histogram of 10 bits", |r, words, n| histogram::record(r, words, n, 22, 10).map(drop)),
    ("radix sort of keys", |r, words, n| {
        radix::record(r, radix::Pairs { keys: words, payloads: None }, n, 32).map(drop)
    }),
    ("radix sort of pairs", |r, words, n| {
        radix::record(r, radix::Pairs { keys: words, payloads: Some(words) }, n, 32).map(drop)
    }),
    ("bitonic sorts of 1024 pairs", |r, words, n| {
        let stretches: Vec<[u32; 2]> = (0..n / 1024).map(|i| [i * 1024, 1024]).collect();
        bitonic::record(r, &stretches, words, words, n).map(drop)
    }),
    ("queue of ranges", |r, _, n| queue::record(r, n, 1, n.min(queue::MAX_ENTRIES)).map(drop)),
];

fn measure(
    executor: &mut Executor,
    name: &str,
    input: Resident,
    n: u32,
    record: Record,
) -> Result<(), GpuError> {
    let mut recording = Recording::new();
    let words = recording.resident("words", input);
    record(&mut recording, words, n)?;
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        let start = Instant::now();
        executor.run(&recording)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    let best = times.iter().copied().fold(f64::INFINITY, f64::min);
    let rate = f64::from(n) / best / 1e3;
    let dispatches = recording.dispatches();
    show(format!("| {name} | {dispatches} | {:.1} ms | {best:.2} ms | {rate:.1} |", times[0]));
    Ok(())
}

#[expect(clippy::print_stdout, reason = "an example's result")]
fn show(line: String) {
    println!("{line}");
}
