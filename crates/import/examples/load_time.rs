//! Loads scene files and prints how long it took.
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "an example")]
use std::time::Instant;
fn main() {
    for arg in std::env::args().skip(1) {
        let start = Instant::now();
        match vastlight_import::load(std::path::Path::new(&arg), &Default::default()) {
            Ok(d) => {
                let ms = start.elapsed().as_secs_f64() * 1e3;
                let tris: usize = d.meshes.iter().map(|m| m.triangles.len()).sum();
                println!(
                    "{arg}: {ms:.1} ms, {} meshes, {tris} triangles, {} materials, {} warnings",
                    d.meshes.len(),
                    d.materials.len(),
                    d.diagnostics.items().len()
                );
                for i in d.diagnostics.items().iter().take(5) {
                    println!("    {i}");
                }
            }
            Err(e) => {
                println!("{arg}: {:.1} ms, error {:?}: {e}", start.elapsed().as_secs_f64() * 1e3, e.kind)
            }
        }
    }
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    println!("{}", status.lines().find(|l| l.starts_with("VmHWM")).unwrap());
}
