//! Updates of moving meshes against fresh builds: times by stage and costs.
//!
//! `cargo run --release -p vastlight-accel --example update [-- SCENE] [--short]`
#![allow(clippy::print_stdout, reason = "an example speaks")]

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "../tests/common/moving.rs"]
mod moving;

use moving::Moving;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use vastlight_accel::update::{DynamicMesh, Method, Region, Stages, UpdateConfig};
use vastlight_accel::wide::MeshBvh;
use vastlight_accel::{BuildConfig, Scratch};

const FRAMES: usize = 100;
/// Every so many frames trees are built afresh for comparison.
const COMPARED: usize = 10;
const BUILDERS: [&str; 5] = ["binned-sah", "grid-sah", "hlbvh2", "hlbvh2-binned", "ploc"];

/// Makes a scene.
type Make = fn() -> Moving;
/// Of each builder: milliseconds, costs, and costs of wide trees.
type Fresh = BTreeMap<&'static str, [Vec<f64>; 3]>;

fn main() {
    let wanted = std::env::args().nth(1).filter(|name| name != "--short");
    let scenes: [(&str, Make); 5] = [
        ("bodies", || moving::bodies(96, 20)),
        ("explosion", || moving::explosion(166, 800)),
        ("waves", || moving::waves(230)),
        ("twist", || moving::twist(24, 48)),
        ("dust", || moving::dust(100_000)),
    ];
    for (_, scene) in scenes.into_iter().filter(|s| wanted.as_ref().is_none_or(|name| name == s.0)) {
        measure(scene());
    }
}

/// What an update costs and gives, in milliseconds and in parts of the fresh tree's cost.
#[derive(Default)]
struct Figures {
    times: Vec<f64>,
    costs: Vec<f64>,
    wide_costs: Vec<f64>,
    stages: BTreeMap<&'static str, Duration>,
    shares: [f64; 4],
}

fn variants() -> Vec<(&'static str, Method, UpdateConfig)> {
    let base = UpdateConfig::default();
    let stages = base.stages;
    let with = |stages| UpdateConfig { stages, ..base };
    let mut all = vec![
        ("refit", Method::Refit, base),
        ("rotate", Method::Rotate, base),
        ("clustered", Method::Clustered, base),
    ];
    if std::env::args().any(|arg| arg == "--short") {
        return all;
    }
    all.extend([
        ("dM .05 dE .01", Method::Clustered, UpdateConfig { d_m: 0.05, d_e: 0.01, ..base }),
        ("dM .01 dE .05", Method::Clustered, UpdateConfig { d_m: 0.01, d_e: 0.05, ..base }),
        ("whole regions", Method::Clustered, UpdateConfig { region: Region::Leaves, ..base }),
        ("no rotations", Method::Clustered, with(Stages { rotate: false, ..stages })),
        ("no parting", Method::Clustered, with(Stages { part: false, ..stages })),
        ("no rebuild", Method::Clustered, with(Stages { rebuild: false, ..stages })),
        ("no migration", Method::Clustered, with(Stages { migrate: false, ..stages })),
        (
            "published",
            Method::Clustered,
            UpdateConfig {
                region: Region::Leaves,
                least: 0,
                gain: f32::NEG_INFINITY,
                ..with(Stages { rotate: false, part: false, ..stages })
            },
        ),
    ]);
    all
}

fn measure(mut scene: Moving) {
    println!("{}: {} triangles, {FRAMES} frames", scene.name, scene.triangles.len());
    let mut scratch = Scratch::default();
    let config = BuildConfig { split_budget: Some(1.0), ..BuildConfig::default() };
    scene.go_to(0.0);
    let new = DynamicMesh::new("", &scene.view(), &config, &mut scratch).expect("built").0;
    let mut variants: Vec<_> = variants().into_iter().map(|v| (v, new.clone(), Figures::default())).collect();
    let mut fresh = Fresh::new();
    let mut best = Vec::new();
    for frame in 1..=FRAMES {
        scene.go_to(frame as f32);
        let compared = frame % COMPARED == 0;
        if compared {
            for name in BUILDERS {
                let build = |measure, scratch: &mut Scratch| {
                    let start = Instant::now();
                    let config = BuildConfig { measure, ..config };
                    let built = MeshBvh::build(name, &scene.view(), &config, scratch).expect("built");
                    (built, start.elapsed().as_secs_f64() * 1e3)
                };
                let ((bvh, report), _) = build(true, &mut scratch);
                let figures = fresh.entry(name).or_default();
                figures[0].push((0..3).map(|_| build(false, &mut scratch).1).fold(f64::MAX, f64::min));
                figures[1].push(report.quality.cost);
                figures[2].push(wide_cost(&bvh));
            }
            let least =
                |costs: &dyn Fn(&str) -> f64| BUILDERS.iter().map(|n| costs(n)).fold(f64::MAX, f64::min);
            best.push([
                least(&|name| *fresh[name][1].last().expect("one")),
                least(&|name| *fresh[name][2].last().expect("one")),
            ]);
        }
        for ((_, method, config), mesh, figures) in &mut variants {
            let start = Instant::now();
            let report = mesh.update(&scene.view(), *method, config).expect("updated");
            figures.times.push(start.elapsed().as_secs_f64() * 1e3);
            for (stage, time) in &report.stages {
                *figures.stages.entry(stage).or_default() += *time;
            }
            let shares = [report.rebuilt, report.migrated, report.rotated, report.collapsed];
            figures.shares.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share / FRAMES as f64);
            if compared {
                mesh.validate(&scene.view()).expect("sound");
                let best = best.last().expect("one");
                figures.costs.push(mesh.cost() / best[0]);
                figures.wide_costs.push(wide_cost(mesh.bvh()) / best[1]);
            }
        }
    }
    print(&fresh, &best, &mut variants);
}

type Variant = ((&'static str, Method, UpdateConfig), DynamicMesh, Figures);

fn print(fresh: &Fresh, best: &[[f64; 2]], variants: &mut [Variant]) {
    for (name, [times, costs, wide]) in fresh {
        let relative = |costs: &[f64], kind: usize| {
            costs.iter().zip(best).map(|(cost, best)| cost / best[kind]).sum::<f64>() / costs.len() as f64
        };
        let (cost, wide) = (relative(costs, 0), relative(wide, 1));
        println!("  build {name:14} {:6.2} ms                cost {cost:.3} wide {wide:.3}", mean(times));
    }
    for ((name, ..), mesh, figures) in variants {
        let frames = figures.times.len();
        let (average, last) = (mean(&figures.times), figures.costs.last().copied().unwrap_or(0.0));
        figures.times.sort_by(f64::total_cmp);
        let median = figures.times[frames / 2];
        let [rebuilt, migrated, rotated, collapsed] = figures.shares.map(|share| share * 100.0);
        println!(
            "  {name:14} median {median:6.2} ms, mean {average:6.2} ms cost {:.3} (last {last:.3}) wide {:.3}  \
             rebuilt {rebuilt:.1} migrated {migrated:.1} rotated {rotated:.1} collapsed {collapsed:.1} %  locality {:.2}, {} leaves, {:.1} MB",
            mean(&figures.costs),
            mean(&figures.wide_costs),
            mesh.locality(),
            mesh.leaves(),
            mesh.bytes() as f64 / 1e6,
        );
        let stages = figures.stages.iter();
        let stages =
            stages.map(|(name, time)| format!("{name} {:.2}", time.as_secs_f64() * 1e3 / frames as f64));
        println!("      {}", stages.collect::<Vec<_>>().join(", "));
    }
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// Areas of nodes and leaves over the root's: what a ray is expected to test.
fn wide_cost(bvh: &MeshBvh) -> f64 {
    let area: f64 =
        bvh.nodes.iter().map(|n| (0..8).map(|s| f64::from(n.bounds(s).half_area())).sum::<f64>()).sum();
    1.0 + area / f64::from(bvh.bounds.half_area())
}
