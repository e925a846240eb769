//! `vastlight devices`: every device, and why one is not usable.

use crate::arguments::Common;
use crate::exit::Exit;
use vastlight::{Error, default_budget_bytes, human_bytes};

pub(crate) fn run(common: &Common) -> Result<Exit, Error> {
    let level = vastlight::simd::Level::detect().name();
    let threads = rayon::current_num_threads();
    let budget = common.memory.or_else(default_budget_bytes).map_or("unknown".into(), human_bytes);
    println!("cpu     usable      {threads} threads, {level}, memory budget {budget}");
    println!("gpu     not usable  rendering on graphics processors comes with a later version");
    Ok(Exit::Done)
}
