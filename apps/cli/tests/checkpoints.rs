//! Work in parts, and work that is interrupted: the bits of one run.

mod common;

use common::{Workspace, wait_for_line};
use std::process::{Child, Command};
use std::time::{Duration, Instant};

/// Every kind of plane, tiles of several sizes, on any number of threads.
const SCENE: &str = "render demo:still-life -r 80x50 --spp 12 --device cpu --aov albedo,normal,depth,alpha,position,object,material";

fn done(w: &Workspace, arguments: &str) {
    let outcome = w.run(arguments);
    assert_eq!(outcome.code, 0, "{arguments}: {}", outcome.stderr);
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill").args([name, &child.id().to_string()]).status().expect("started");
    assert!(status.success());
}

/// Waits until a file is there.
fn wait_for(w: &Workspace, name: &str) {
    let start = Instant::now();
    while !w.path(name).exists() {
        assert!(start.elapsed() < Duration::from_secs(60), "{name} does not come");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn merged_parts_are_the_bytes_of_one_run() {
    let w = Workspace::new();
    done(&w, &format!("{SCENE} -o whole.exr"));
    done(&w, &format!("{SCENE} -o whole.vlc"));
    for (passes, threads) in [("1-3", 1), ("4-4", 2), ("5-12", 3)] {
        done(&w, &format!("{SCENE} -t {threads} --passes {passes} -o {passes}.vlc"));
    }
    done(&w, "merge 5-12.vlc 1-3.vlc 4-4.vlc -o merged.exr");
    assert!(w.bytes("merged.exr") == w.bytes("whole.exr"));
    done(&w, "merge 4-4.vlc 5-12.vlc -o most.vlc");
    done(&w, "merge 1-3.vlc most.vlc -o merged.vlc");
    assert!(w.bytes("merged.vlc") == w.bytes("whole.vlc"));
    done(&w, "merge whole.vlc -o developed.exr");
    assert!(w.bytes("developed.exr") == w.bytes("whole.exr"));
    // A part is another picture, in a picture file as well.
    done(&w, &format!("{SCENE} --passes 5-12 -o part.exr"));
    done(&w, "merge 5-12.vlc -o developed.exr");
    assert!(w.bytes("developed.exr") == w.bytes("part.exr"));
    assert!(w.bytes("part.exr") != w.bytes("whole.exr"));
    // What was merged is taken up as a checkpoint, the gap in it too.
    done(&w, "merge 1-3.vlc 5-12.vlc -o gap.vlc");
    done(&w, &format!("{SCENE} --checkpoint gap.vlc --resume --stats s.json -o filled.exr"));
    assert!(w.bytes("filled.exr") == w.bytes("whole.exr"));
    let stats = w.json("s.json");
    assert_eq!((stats["passes"].as_u64(), stats["resumed_passes"].as_u64()), (Some(12), Some(11)));
}

#[test]
fn parts_of_a_picture_are_put_together() {
    let photons =
        "render demo:caustic-sphere --caustics photons --photons 3000 -r 80x50 --spp 2 --device cpu";
    for scene in [SCENE, photons] {
        let w = Workspace::new();
        for output in ["whole.exr", "whole.vlc"] {
            done(&w, &format!("{scene} -o {output}"));
        }
        for (number, crop) in ["0,0,30,50", "30,0,80,7", "30,7,80,50"].into_iter().enumerate() {
            done(&w, &format!("{scene} --crop {crop} -o {number}.vlc"));
        }
        done(&w, "merge 2.vlc 0.vlc 1.vlc -o merged.exr");
        assert!(w.bytes("merged.exr") == w.bytes("whole.exr"), "{scene}");
        done(&w, "merge 2.vlc 1.vlc -o right.vlc");
        done(&w, "merge right.vlc 0.vlc -o merged.vlc");
        // Photons fly for each part: there are more rays.
        assert!(w.bytes("merged.vlc") == w.bytes("whole.vlc") || scene == photons, "{scene}");
        w.refused("merge 0.vlc 2.vlc -o x.exr", 3, "350 pixels");
        assert!(!w.path("x.exr").exists());
    }
}

#[test]
fn an_open_shutter_is_part_of_a_picture() {
    let w = Workspace::new();
    let at = |shutter: f32| {
        format!(
            "render demo:bodies --triangles 30000 --time 0.4 --shutter {shutter} -r 24x16 --spp 4 --device cpu"
        )
    };
    done(&w, &format!("{} -o whole.exr", at(0.5)));
    for (shutter, passes, name) in
        [(0.5, "1-2", "a"), (0.5, "3-4", "b"), (0.25, "3-4", "c"), (0.0, "3-4", "d")]
    {
        done(&w, &format!("{} --passes {passes} -o {name}.vlc", at(shutter)));
    }
    done(&w, "merge a.vlc b.vlc -o merged.exr");
    assert!(w.bytes("merged.exr") == w.bytes("whole.exr"));
    for other in ["c", "d"] {
        w.refused(&format!("merge a.vlc {other}.vlc -o x.exr"), 3, "scene");
    }
}

#[test]
fn what_does_not_belong_together_is_refused_by_name() {
    let w = Workspace::new();
    let small = "render demo:cornell -r 24x16 --spp 8 --device cpu";
    done(&w, &format!("{small} --passes 1-4 -o a.vlc"));
    done(&w, &format!("{small} --passes 3-8 -o b.vlc"));
    w.refused("merge a.vlc b.vlc -o x.exr", 3, "passes 3-4");
    let others = [
        ("render demo:cornell -r 24x16 --spp 8 --device cpu --seed 1", "seed (0 and 1)"),
        ("render demo:cornell -r 25x16 --spp 8 --device cpu", "size (24 x 16 and 25 x 16)"),
        ("render demo:cornell -r 24x16 --spp 8 --device cpu --crop 0,0,9,9", "part"),
        ("render demo:cornell -r 24x16 --spp 8 --device cpu --max-depth 3", "depth (16 and 3)"),
        (
            "render demo:cornell -r 24x16 --spp 8 --device cpu --aov depth",
            "auxiliary outputs (none and depth)",
        ),
        ("render demo:cornell -r 24x16 --spp 8 --device cpu --fov 20", "camera"),
        ("render demo:still-life -r 24x16 --spp 8 --device cpu", "scene"),
        ("render demo:cornell -r 24x16 --spp 8 --device cpu --override o.toml", "scene"),
    ];
    w.write("o.toml", "[materials.\"*\"]\nbase_color = [0.5, 0.5, 0.5]\n");
    for (other, text) in others {
        done(&w, &format!("{other} --passes 5-8 -o c.vlc"));
        w.refused("merge a.vlc c.vlc -o x.exr", 3, text);
        let before = w.bytes("a.vlc");
        w.refused(
            &format!("{other} --checkpoint a.vlc --resume -o x.exr"),
            3,
            text.split(" (").next().unwrap_or(text),
        );
        assert!(w.bytes("a.vlc") == before, "a refused checkpoint stays as it is");
    }
    w.refused(&format!("{small} --passes 2-8 --checkpoint a.vlc --resume -o x.exr"), 3, "passes 1-4");
    let mut damaged = w.bytes("a.vlc");
    let middle = damaged.len() / 2;
    damaged[middle] ^= 4;
    std::fs::write(w.path("damaged.vlc"), &damaged).expect("written");
    w.refused("merge damaged.vlc -o x.exr", 3, "checksum");
    w.refused(&format!("{small} --checkpoint damaged.vlc --resume -o x.exr"), 3, "checksum");
    std::fs::write(w.path("short.vlc"), &damaged[..middle]).expect("written");
    w.refused("merge short.vlc -o x.exr", 3, "bytes and should have");
    assert!(!w.path("x.exr").exists());
}

#[test]
fn mistakes_with_parts_are_one_line() {
    let w = Workspace::new();
    let small = "render demo:cornell -r 8x8 --spp 4";
    for (arguments, code, text) in [
        (format!("{small} --passes 0-3 -o a.png"), 2, "numbered from 1"),
        (format!("{small} --passes 2-5 -o a.png"), 2, "1 to 4"),
        (format!("{small} --passes 1-2 --noise 0.1 -o a.png"), 2, "--noise"),
        (format!("{small} --noise 0 -o a.png"), 2, "above 0"),
        (format!("{small} --resume -o a.png"), 2, "--checkpoint"),
        (format!("{small} --checkpoint no/such/c.vlc -o a.png"), 6, "does not exist"),
        (format!("{small} --checkpoint c.##.vlc -o a.png"), 2, "--frames"),
        ("render demo:julia -f 1-2 --checkpoint c.vlc -o a.##.png".into(), 2, "####"),
        ("merge a.vlc -o a.exr".into(), 3, "a.vlc"),
        ("merge -o a.exr".into(), 2, "FILE.vlc"),
        ("diff a.png b.png -o a.vlc".into(), 2, "no sums"),
    ] {
        w.refused(&arguments, code, text);
    }
    assert_eq!(w.files(), Vec::<String>::new());
}

/// Starts, kills after the first checkpoint, resumes on another number of threads, kills anywhere in the first half of the work, and so
/// on, to the bytes of one run.
fn killed_again_and_again(w: &Workspace, arguments: &str, kills: u32, seed: u32) {
    let start = Instant::now();
    done(w, &format!("{arguments} -o whole.exr"));
    let whole = start.elapsed();
    let kept =
        format!("{arguments} --checkpoint c.vlc --checkpoint-every 1ms --resume --stats s.json -o out.exr");
    let mut survived = 0;
    for kill in 0..kills {
        let mut child = w.spawn(&format!("{kept} -t {}", 1 + kill % 3));
        match kill {
            0 => wait_for(w, "c.vlc"),
            _ => std::thread::sleep(whole * ((seed + kill).wrapping_mul(2_654_435_761) % 512) / 1024),
        }
        survived += u32::from(child.try_wait().expect("asked").is_some());
        let _ = child.kill();
        child.wait().expect("ended");
    }
    assert!(survived < kills, "nothing was killed");
    done(w, &format!("{kept} -t 2"));
    assert!(w.bytes("out.exr") == w.bytes("whole.exr"), "{arguments}");
    assert!(w.json("s.json")["resumed_samples"].as_u64() > Some(0));
    std::fs::remove_file(w.path("c.vlc")).expect("removed");
}

#[test]
fn killed_work_goes_on_to_the_same_bits() {
    let w = Workspace::new();
    let kills = if std::env::var_os("VASTLIGHT_SOAK").is_some() { 20 } else { 3 };
    killed_again_and_again(
        &w,
        "render demo:still-life -r 160x90 --spp 48 --device cpu --aov object",
        kills,
        1,
    );
}

#[test]
fn other_integrators_pages_and_noise_go_on_too() {
    let w = Workspace::new();
    let kills = if std::env::var_os("VASTLIGHT_SOAK").is_some() { 6 } else { 1 };
    done(&w, "pack demo:still-life -o s.vls -q");
    for arguments in [
        "render s.vls -r 64x36 --spp 64 --memory 1GiB --device cpu",
        "render demo:cornell -r 64x36 --spp 400 --integrator whitted --device cpu",
        "render demo:caustic-sphere -r 64x36 --spp 12 --caustics photons --photons 4096 --device cpu",
        "render demo:cornell -r 64x36 --spp 400 --noise 0.05 --device cpu",
    ] {
        killed_again_and_again(&w, arguments, kills, 7);
    }
}

#[test]
fn an_interrupted_render_keeps_what_it_has() {
    let w = Workspace::new();
    let scene = "render demo:still-life -r 128x72 --spp 48 --device cpu";
    done(&w, &format!("{scene} -o whole.png"));
    let kept = format!("{scene} --checkpoint c.vlc --progress json -o out.png");
    for name in ["-TERM", "-INT"] {
        let mut child = w.spawn(&kept);
        wait_for_line(&mut child, "\"progress\"");
        signal(&child, name);
        assert_eq!(child.wait().expect("ended").code(), Some(130), "{name}");
        done(&w, "merge c.vlc -o so-far.png");
        assert!(w.bytes("so-far.png") == w.bytes("out.png"), "{name}");
        done(&w, &format!("{kept} --resume"));
        assert!(w.bytes("out.png") == w.bytes("whole.png"), "{name}");
        std::fs::remove_file(w.path("c.vlc")).expect("removed");
    }
    // What is done is not rendered again, and goes on with more samples.
    done(&w, &format!("{scene} --passes 1-8 --checkpoint c.vlc -o part.png"));
    done(&w, &format!("{kept} --resume --stats s.json"));
    assert_eq!(w.json("s.json")["resumed_passes"].as_u64(), Some(8));
    assert!(w.bytes("out.png") == w.bytes("whole.png"));
    done(&w, &format!("{kept} --resume --stats s.json"));
    assert_eq!(w.json("s.json")["resumed_passes"].as_u64(), Some(48));
}

#[cfg(unix)]
#[test]
fn a_look_at_the_picture_does_not_end_the_work() {
    let w = Workspace::new();
    let scene = "render demo:still-life -r 128x72 --spp 48 --device cpu";
    let mut child = w.spawn(&format!("{scene} --progress json -o out.png"));
    wait_for_line(&mut child, "\"progress\"");
    assert!(!w.path("out.png").exists());
    signal(&child, "-USR1");
    wait_for(&w, "out.png");
    let look = w.bytes("out.png");
    assert!(child.wait().expect("ended").success());
    done(&w, &format!("{scene} -o whole.png"));
    assert!(w.bytes("out.png") == w.bytes("whole.png"));
    assert!(look != w.bytes("whole.png"));
}

#[test]
fn frames_that_are_done_are_skipped() {
    let w = Workspace::new();
    let frames = "render demo:explosion --triangles 20000 -r 48x27 --spp 2 --device cpu -f 0-2 -o f.##.png";
    done(&w, frames);
    let expected: Vec<Vec<u8>> = (0..3).map(|i| w.bytes(&format!("f.0{i}.png"))).collect();
    let kept = format!("{frames} --checkpoint c.##.vlc --resume -v");
    // The first is done; the second has a checkpoint, so it is not.
    std::fs::remove_file(w.path("f.02.png")).expect("removed");
    done(
        &w,
        "render demo:explosion --triangles 20000 -r 48x27 --spp 2 --device cpu -f 1 --passes 1 --checkpoint c.##.vlc -o g.##.png",
    );
    assert!(!w.path("c.01.vlc").exists(), "a frame that is done leaves none");
    done(
        &w,
        "render demo:explosion --triangles 20000 -r 48x27 --spp 2 --device cpu --time 0.041666668 --passes 1 --checkpoint c.01.vlc -o g.png",
    );
    let outcome = w.run(&kept);
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("f.00.png: is done"), "{}", outcome.stderr);
    assert!(!outcome.stderr.contains("f.01.png: is done"), "{}", outcome.stderr);
    for (i, expected) in expected.iter().enumerate() {
        assert!(&w.bytes(&format!("f.0{i}.png")) == expected, "frame {i}");
        assert!(!w.path(&format!("c.0{i}.vlc")).exists());
    }
}

#[test]
fn samples_go_where_the_noise_is() {
    let w = Workspace::new();
    let scene = "render demo:cornell -r 64x48 --device cpu";
    done(&w, &format!("{scene} --spp 512 --seed 9 -o reference.exr"));
    let mut errors = Vec::new();
    for noise in ["0.12", "0.06"] {
        done(&w, &format!("{scene} --spp 512 --noise {noise} -t 1 --stats s.json -o a.exr"));
        done(&w, &format!("{scene} --spp 512 --noise {noise} -t 3 -o b.exr"));
        assert!(w.bytes("a.exr") == w.bytes("b.exr"), "threads do not matter");
        let stats = w.json("s.json");
        let (mean, least) = (stats["spp_mean"].as_f64().expect("a number"), stats["spp_done"].as_u64());
        assert!(least < Some(512) && mean > least.expect("a number") as f64 && mean < 500.0, "{stats}");
        assert_eq!(stats["ending"], "complete");
        let outcome = w.run("diff a.exr reference.exr");
        let figures: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("JSON");
        let error = figures["relmse"].as_f64().expect("a number").sqrt();
        let tolerance: f64 = noise.parse().expect("a number");
        // The reference has noise of its own, colours a little more than their luminance; blocks stop at doubling counts.
        assert!(error < 1.3 * tolerance && error > 0.3 * tolerance, "{error} for {noise}");
        errors.push(error);
    }
    assert!(errors[1] < 0.8 * errors[0], "{errors:?}");
}

#[test]
fn a_graphics_processor_goes_on_with_its_own_sums_alone() {
    let w = Workspace::new();
    let outcome = w.run("bench sort -n 100 --repeat 1 --device gpu");
    if outcome.code == 5 && outcome.stderr.contains("mesa-vulkan-drivers") {
        println!("skipped: no adapter: no software Vulkan driver (Debian: mesa-vulkan-drivers libvulkan1)");
        return;
    }
    let scene = "render demo:cornell -r 32x18 --spp 20 --noise 0.3";
    done(&w, &format!("{scene} --device gpu -o whole.exr"));
    // Stopped after the first pass, with a part of the picture done by its noise or not.
    let limited = w.run(&format!("{scene} --device gpu --time-limit 1ms --checkpoint c.vlc -o part.exr"));
    assert_eq!(limited.code, 0, "{}", limited.stderr);
    assert!(w.bytes("part.exr") != w.bytes("whole.exr"));
    w.refused(&format!("{scene} --device cpu --checkpoint c.vlc --resume -o x.exr"), 3, "device");
    done(&w, &format!("{scene} --device gpu --checkpoint c.vlc --resume --stats s.json -o out.exr"));
    assert!(w.bytes("out.exr") == w.bytes("whole.exr"));
    assert!(w.json("s.json")["resumed_passes"].as_u64() > Some(0));
}
