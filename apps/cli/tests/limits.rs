//! The command under limits that the system holds it to, and killed at any moment.
//!
//! A few moments and scenes in a test run, hundreds with `VASTLIGHT_SOAK` in the environment.
#![cfg(target_os = "linux")]

mod common;

use common::{Outcome, Workspace};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What threads' stacks, code and the allocator's reserves may have beyond what is resident.
const ADDRESSES: u64 = 384 << 20;

fn is_soak() -> bool {
    std::env::var_os("VASTLIGHT_SOAK").is_some()
}

/// A number below `end`, by the state of a generator (D. Knuth's constants).
fn below(state: &mut u64, end: u64) -> u64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) % end.max(1)
}

/// A workspace with a mesh of so many triangles and its store; that store, and the picture of the scene in memory.
fn with_mesh(triangles: u64) -> (Workspace, Vec<u8>, Vec<u8>) {
    let work = Workspace::new();
    let done = |arguments: &str| {
        let outcome = work.run(arguments);
        assert_eq!(outcome.code, 0, "{arguments}: {}", outcome.stderr);
    };
    done(&format!("generate statue --triangles {triangles} -o mesh.ply -q"));
    done("pack mesh.ply -o once.vls --memory 96MiB -q");
    done(&format!("render mesh.ply -o expected.png {PICTURE}"));
    let (store, picture) = (work.bytes("once.vls"), work.bytes("expected.png"));
    (work, store, picture)
}

const PICTURE: &str = "-r 48x27 --spp 2 -q";

/// Budgets in MiB to pack and to render in.
fn budgets(least: u64) -> Vec<u64> {
    let more: &[u64] = if is_soak() { &[8, 24, 57, 120, 300] } else { &[8] };
    more.iter().map(|more| least + more).collect()
}

/// A line of the command's own that says how much it needs, MiB.
fn needed_mib(outcome: &Outcome) -> u64 {
    outcome.is_refusal(4, "MiB");
    let words: Vec<&str> = outcome.stderr.split_whitespace().collect();
    let at = words.iter().position(|word| *word == "MiB").expect("says how much");
    words[at - 1].parse::<f64>().expect("a number").ceil() as u64
}

/// What the system says the command took at most, in a report of its.
fn peak_in(report: &serde_json::Value) -> u64 {
    report["peak_rss_bytes"].as_u64().expect("measured")
}

/// That of a pack.
fn peak_bytes(packed: &Outcome) -> u64 {
    peak_in(&serde_json::from_str(&packed.stdout).expect("JSON"))
}

/// Packs and renders in budgets from the least that the command itself names on; `within` limits it to so many bytes.
fn hold_to_budgets(within: impl Fn(&Workspace, u64, &str) -> Outcome) {
    let (work, _, picture) = with_mesh(if is_soak() { 3_000_000 } else { 1_000_000 });
    let pack = "pack mesh.ply -o scene.vls --json -q";
    let least = needed_mib(&work.run(&format!("{pack} --memory 1MiB")));
    // Without a budget more is taken, so that these are ones.
    assert!(peak_bytes(&work.run(pack)) > (least + 8) << 20);
    for mib in budgets(least) {
        let outcome = within(&work, mib << 20, &format!("{pack} --memory {mib}MiB"));
        assert_eq!(outcome.code, 0, "packs in {mib} MiB: {outcome:?}");
        assert!(peak_bytes(&outcome) <= mib << 20, "{mib} MiB: {outcome:?}");
        let whole = work.run(&format!("pack mesh.ply -o same.vls --memory {mib}MiB -q"));
        assert_eq!(whole.code, 0, "{whole:?}");
        assert!(work.bytes("scene.vls") == work.bytes("same.vls"), "{mib} MiB");
    }
    let render = format!("render once.vls -o found.png {PICTURE} --stats stats.json");
    for mib in budgets(needed_mib(&work.run(&format!("{render} --memory 1MiB")))) {
        let outcome = within(&work, mib << 20, &format!("{render} --memory {mib}MiB"));
        assert_eq!(outcome.code, 0, "renders in {mib} MiB: {outcome:?}");
        assert!(peak_in(&work.json("stats.json")) <= mib << 20, "{mib} MiB: {}", work.json("stats.json"));
        assert!(work.bytes("found.png") == picture, "{mib} MiB");
    }
}

#[test]
fn budgets_hold_under_a_limit_of_addresses() {
    hold_to_budgets(|work, bytes, arguments| {
        let kib = (bytes + ADDRESSES) >> 10;
        work.in_shell(&format!("ulimit -v {kib}; export MALLOC_ARENA_MAX=2 RAYON_NUM_THREADS=2"), arguments)
    });
}

#[test]
fn placements_of_meshes_count() {
    let work = Workspace::new();
    let city = |triangles: u64| format!("demo:city --triangles {triangles} -o city");
    let pack = format!("pack {}.vls --json -q", city(500_000_000));
    let least = needed_mib(&work.run(&format!("{pack} --memory 1MiB")));
    let outcome = work.run(&format!("{pack} --memory {}MiB", least + 1));
    assert_eq!(outcome.code, 0, "{outcome:?}");
    // Two million, which alone are as much as the budget would be without them.
    assert!(peak_bytes(&outcome) <= (least + 1) << 20 && peak_bytes(&outcome) > 110 << 20, "{outcome:?}");
    let refused = work.run(&format!("render {}.png {PICTURE} --memory 300MiB", city(2_000_000_000)));
    assert!(needed_mib(&refused) < 2048, "{refused:?}");
}

/// A memory control group of the first version, gone with the value.
struct Group(PathBuf);

impl Group {
    /// None where groups cannot be made.
    fn new(bytes: u64) -> Option<Self> {
        let path = PathBuf::from(format!("/sys/fs/cgroup/memory/vastlight-{}", std::process::id()));
        std::fs::create_dir(&path).ok()?;
        let group = Self(path);
        let limited = std::fs::write(group.0.join("memory.limit_in_bytes"), bytes.to_string());
        limited.ok().map(|()| group)
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        // The group is empty again: nothing can be done where it stays.
        let _ = std::fs::remove_dir(&self.0);
    }
}

#[test]
fn budgets_hold_in_a_control_group() {
    if Group::new(1 << 30).is_none() {
        println!("skipped: memory control groups: none of version 1 can be made here");
        return;
    }
    hold_to_budgets(|work, bytes, arguments| {
        let group = Group::new(bytes).expect("as before");
        work.in_shell(&format!("echo $$ > {}/cgroup.procs", group.0.display()), arguments)
    });
}

#[test]
fn a_pack_that_is_killed_again_and_again_gives_the_same_bytes() {
    let (work, expected, _) = with_mesh(if is_soak() { 700_000 } else { 300_000 });
    let most_kills = if is_soak() { 200 } else { 6 };
    let command = "pack mesh.ply -o scene.vls --memory 96MiB -q";
    let start = Instant::now();
    assert_eq!(work.run(command).code, 0);
    let whole = start.elapsed();
    let (mut state, mut kills, mut packs) = (5, 0, 0);
    while kills < most_kills {
        let mut child = work.spawn(command);
        let moment = whole.mul_f64(below(&mut state, 1000) as f64 / 800.0);
        std::thread::sleep(moment);
        // It may have ended already.
        let _ = child.kill();
        if !child.wait().expect("ends").success() {
            kills += 1;
            let seen = work.files().contains(&"scene.vls".to_owned());
            assert!(!seen || work.bytes("scene.vls") == expected, "a half store after {moment:?}");
            continue;
        }
        packs += 1;
        assert!(work.bytes("scene.vls") == expected, "after {kills} kills");
        assert!(!work.files().iter().any(|name| name.starts_with("scene.vls.")), "{:?}", work.files());
        std::fs::remove_file(work.path("scene.vls")).expect("removes");
    }
    assert_eq!(work.run(command).code, 0);
    assert!(work.bytes("scene.vls") == expected);
    println!("{kills} kills, {packs} packs that were done before, {whole:?} each");
}

#[test]
fn a_render_that_is_killed_leaves_no_half_picture() {
    let (work, _, expected) = with_mesh(100_000);
    let most_kills = if is_soak() { 200 } else { 8 };
    let command = format!("render once.vls -o found.png {PICTURE}");
    let start = Instant::now();
    assert_eq!(work.run(&command).code, 0);
    let whole = start.elapsed();
    let (mut state, mut kills, mut pictures) = (9, 0, 0);
    for _ in 0..3 * most_kills {
        std::fs::remove_file(work.path("found.png")).ok();
        let mut child = work.spawn(&command);
        // Most of them near the end, when the picture is written.
        let moment = if below(&mut state, 2) == 0 { 0 } else { 700 };
        std::thread::sleep(whole.mul_f64((moment + below(&mut state, 400)) as f64 / 1000.0));
        let _ = child.kill();
        kills += u64::from(!child.wait().expect("ends").success());
        if work.files().contains(&"found.png".to_owned()) {
            pictures += 1;
            assert!(work.bytes("found.png") == expected, "half a picture");
        }
        if kills >= most_kills {
            break;
        }
    }
    assert!(kills > 0);
    assert_eq!(work.run(&command).code, 0);
    assert!(work.bytes("found.png") == expected);
    println!("{kills} kills, {pictures} pictures, {:?} each", Duration::as_millis(&whole));
}

/// What frames between which a mesh moves are said to need is enough, for all of them.
#[test]
fn frames_keep_to_the_budget() {
    let work = Workspace::new();
    let frames =
        "render demo:bodies --triangles 1500000 -f 8-32x8 -o f.##.png -r 48x27 --spp 1 -q --stats s.##.json";
    // The size of the scene is known before it is made, what moves of it then.
    let scene = needed_mib(&work.run(&format!("{frames} --memory 100MiB")));
    let mib = needed_mib(&work.run(&format!("{frames} --memory {scene}MiB")));
    let outcome = work.run(&format!("{frames} --memory {mib}MiB"));
    assert_eq!(outcome.code, 0, "{mib} MiB: {outcome:?}");
    let peaks = ["08", "16", "24", "32"].map(|frame| peak_in(&work.json(&format!("s.{frame}.json"))) >> 20);
    assert!(peaks[3] < mib && peaks[3] > mib / 2, "{peaks:?} of {mib} MiB");
    assert!(peaks[1] > peaks[0], "what moves needs more: {peaks:?}");
}
