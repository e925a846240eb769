//! `vastlight bench sort`.

use crate::arguments::Common;
use crate::exit::Exit;
use clap::Args;
use serde_json::json;
use vastlight::accel::sort::{bench, key, payload, radix_sort};
use vastlight::gpu::{self, DeviceChoice};
use vastlight::{Error, ErrorClass};

/// Sort 32-bit keys with payloads, as builders and ray batches do
#[derive(Args, Debug)]
pub(crate) struct Sort {
    /// Number of keys
    #[arg(short, long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u32).range(1..1 << 30))]
    n: u32,
    /// Times each sort is done; the best counts
    #[arg(long, value_name = "N", default_value_t = 5)]
    repeat: u32,
}

pub(crate) fn run(arguments: &Sort, common: &Common) -> Result<Exit, Error> {
    match common.device.adapter() {
        Some(choice) => on_gpu(arguments, choice, common),
        None => on_cpu(arguments),
    }
}

fn disagreement() -> Error {
    Error::new(ErrorClass::Device, "two sorts do not agree", "bench sort", "report this")
}

fn on_cpu(arguments: &Sort) -> Result<Exit, Error> {
    let figures = bench::sort(arguments.n as usize, arguments.repeat).ok_or_else(disagreement)?;
    for line in figures {
        let line = json!({
            "bench": "sort",
            "device": "cpu",
            "algorithm": line.algorithm,
            "keys": line.keys,
            "threads": rayon::current_num_threads(),
            "n": line.n,
            "ms": line.ms,
            "mkeys_per_s": line.mkeys_per_s,
        });
        println!("{line}");
    }
    Ok(Exit::Done)
}

/// Sorts on a graphics processor, keys with payloads and keys alone, and compares with the processor's order.
fn on_gpu(arguments: &Sort, choice: DeviceChoice, common: &Common) -> Result<Exit, Error> {
    let mut executor = common.executor(choice)?;
    let n = arguments.n as usize;
    for keys in bench::KEYS {
        let mut pairs = bench::pairs(n, keys);
        let input: (Vec<u32>, Vec<u32>) = pairs.iter().map(|&pair| (key(pair), payload(pair))).unzip();
        let mut spare = vec![0; n];
        let expected = radix_sort(&mut pairs, &mut spare, u32::BITS);
        for with_payloads in [true, false] {
            let payloads = with_payloads.then_some(input.1.as_slice());
            let (figures, sorted) = gpu::bench::sort(&mut executor, &input.0, payloads, arguments.repeat)?;
            let same_keys = sorted.keys.iter().copied().eq(expected.iter().map(|&pair| key(pair)));
            let ours = sorted.payloads.iter().copied();
            if !same_keys || (with_payloads && !ours.eq(expected.iter().map(|&pair| payload(pair)))) {
                return Err(disagreement());
            }
            let line = json!({
                "bench": "sort",
                "device": "gpu",
                "adapter": executor.adapter().name,
                "algorithm": if with_payloads { "radix" } else { "radix-keys" },
                "keys": keys,
                "n": n,
                "ms": figures.ms,
                "mkeys_per_s": n as f64 / figures.ms.max(1e-6) / 1e3,
                "first_ms": figures.first_ms,
                "compile_ms": figures.compile_ms,
                "dispatches": figures.dispatches,
                "device_bytes": executor.held_bytes(),
            });
            println!("{line}");
        }
    }
    Ok(Exit::Done)
}
