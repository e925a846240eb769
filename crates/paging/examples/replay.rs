//! Hit rates of all replacement policies on made-up traces, beside the best possible.
#![allow(clippy::print_stdout, reason = "it is there to print")]

use vastlight_paging::PolicyKind;
use vastlight_paging::policy::{replay, traces};

fn main() {
    let (pages, uses, pass) = (5000, 400_000, 64);
    print!("{:20} {:>6} {:>8}", "trace", "slots", "optimum");
    PolicyKind::ALL.iter().for_each(|kind| print!(" {:>8}", kind.name()));
    println!();
    for (name, trace) in traces::all(pages, uses) {
        for slots in [pages as usize / 100, pages as usize / 20, pages as usize / 3] {
            let best = replay::most_hits(slots, &trace) as f64 / trace.len() as f64;
            print!("{name:20} {slots:6} {:7.1}%", best * 100.0);
            for kind in PolicyKind::ALL {
                let replay = replay::replay(&mut *kind.make(slots), slots, &trace, pass);
                print!(" {:7.1}%", replay.hit_rate() * 100.0);
            }
            println!();
        }
    }
}
