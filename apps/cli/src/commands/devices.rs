//! `vastlight devices`: every device, and why one is not usable.

use crate::arguments::Common;
use crate::exit::Exit;
use crate::output::print;
use clap::Args;
use serde_json::{Value, json};
use vastlight::gpu::{AdapterReport, Drivers, GpuError};
use vastlight::{Error, default_budget_bytes, human_bytes};

/// List every device, and why one is not usable
#[derive(Args, Debug)]
pub(crate) struct Devices {
    /// One JSON object
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Devices, common: &Common) -> Result<Exit, Error> {
    let adapters = Drivers::load().adapters();
    let cpu = Cpu {
        threads: rayon::current_num_threads(),
        simd: vastlight::simd::Level::detect().name(),
        memory_bytes: common.memory.or_else(default_budget_bytes),
    };
    let text =
        if arguments.json { format!("{}\n", as_json(&cpu, &adapters)) } else { as_text(&cpu, &adapters) };
    print(text.as_bytes())?;
    Ok(Exit::Done)
}

/// What is said of the processor.
struct Cpu {
    threads: usize,
    simd: &'static str,
    memory_bytes: Option<u64>,
}

fn as_json(cpu: &Cpu, adapters: &[AdapterReport]) -> Value {
    let mut devices = vec![json!({
        "device": "cpu", "usable": true, "threads": cpu.threads, "simd": cpu.simd, "memory_bytes": cpu.memory_bytes,
    })];
    devices.extend(adapters.iter().map(|adapter| {
        json!({
            "device": format!("gpu:{}", adapter.index),
            "usable": adapter.unusable.is_none(),
            "reason": adapter.unusable,
            "name": adapter.name,
            "vendor": adapter.vendor,
            "kind": adapter.kind,
            "backend": adapter.backend,
            "driver": adapter.driver,
            "limits": adapter.limits,
        })
    }));
    json!({"devices": devices})
}

fn as_text(cpu: &Cpu, adapters: &[AdapterReport]) -> String {
    let budget = cpu.memory_bytes.map_or("unknown".into(), human_bytes);
    let mut text =
        format!("cpu     usable      {} threads, {}, memory budget {budget}\n", cpu.threads, cpu.simd);
    for adapter in adapters {
        text += &adapter_line(adapter);
    }
    if adapters.is_empty() {
        let none = GpuError::NoAdapter;
        text += &format!("gpu     not usable  {none} ({})\n", none.hint());
    }
    text
}

/// An adapter, and behind it what it lacks or can do.
fn adapter_line(adapter: &AdapterReport) -> String {
    let AdapterReport { index, name, vendor, backend, driver, kind, limits, unusable } = adapter;
    let device = format!("gpu:{index}");
    let usable = if unusable.is_some() { "not usable" } else { "usable" };
    let can = unusable.clone().unwrap_or_else(|| {
        format!(
            "buffers of {}, {} a binding, {} of workgroup memory",
            human_bytes(limits.buffer_bytes),
            human_bytes(limits.binding_bytes),
            human_bytes(limits.workgroup_bytes.into())
        )
    });
    format!("{device:7} {usable:11} {name} ({kind}, {vendor}), {backend}, {driver}: {can}\n")
}
