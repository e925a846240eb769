//! How long every kernel takes to compile: reading and translating it, then its first dispatch, at which some drivers finish.
//! `MESA_SHADER_CACHE_DISABLE=true cargo run --release -p vastlight-gpu --example compile -- [ADAPTER]`.

use std::time::Instant;
use vastlight_gpu::{DeviceChoice, Executor, Groups, Recording, kernel};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let adapter = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let choice = adapter.map_or(DeviceChoice::Any, DeviceChoice::Index);
    let mut executor = Executor::open(choice, None)?;
    show(executor.adapter().name.clone());
    for kernel in kernel::all() {
        let start = Instant::now();
        executor.prepare(&[kernel], &mut |_| {})?;
        let translated = start.elapsed();
        // Nothing but zeros: no kernel finds work in them.
        let mut recording = Recording::new();
        let buffers: Vec<_> = (0..kernel.buffers).map(|_| recording.upload("zeros", &[0_u32; 64])).collect();
        recording.dispatch_bytes(kernel, vec![0; kernel.parameters.bytes], &buffers, Groups::Direct(1));
        let _ = recording.download(buffers[0], 1);
        let start = Instant::now();
        executor.run(&recording)?;
        let [translated, first] = [translated, start.elapsed()].map(|time| time.as_secs_f64() * 1e3);
        show(format!("{}: translated {translated:.0} ms, first dispatch {first:.0} ms", kernel.name));
    }
    Ok(())
}

#[expect(clippy::print_stdout, reason = "an example's result")]
fn show(line: String) {
    println!("{line}");
}
