//! `vastlight bench sort`.

use crate::exit::Exit;
use clap::Args;
use serde_json::json;
use vastlight::accel::sort::bench;
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

pub(crate) fn run(arguments: &Sort) -> Result<Exit, Error> {
    let figures = bench::sort(arguments.n as usize, arguments.repeat).ok_or_else(|| {
        Error::new(ErrorClass::Device, "two sorts do not agree".to_owned(), "bench sort", "report this")
    })?;
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
