//! The command from outside: exit codes, messages, files, figures, determinism.

mod common;
// The server that the paging crate is tested with.
#[cfg(feature = "object-store")]
#[path = "../../../crates/paging/src/source/object/server.rs"]
#[allow(dead_code, reason = "a part is used here")]
mod server;

use common::{Outcome, Workspace};
#[cfg(feature = "object-store")]
use server::{Answer, Server};

#[test]
fn mistakes_are_one_line_and_have_their_exit_code() {
    let w = Workspace::new();
    let cases: &[(&str, i32, &str)] = &[
        ("render demo:cornell -o a.bmp", 2, "write to .png or .exr"),
        ("render demo:cornell -o a.png --ssp 3", 2, "--spp"),
        ("render demo:cornell", 2, "--output"),
        ("render demo:cornell -o a.png -r 0x9", 2, "--resolution"),
        ("render demo:cornell -o a.png --aov depth", 2, "write to .exr"),
        ("render demo:cornell -o a.exr --aov colour", 2, "known are albedo"),
        ("render demo:cornell -o a.png --accel nope", 2, "nope"),
        ("render demo:cornell -o a.png --crop 900,900,901,901 -r 8x8", 2, "--crop"),
        ("render demo:cornell -o a.png --tonemap sepia", 2, "filmic"),
        ("render demo:cornell -o a.png --filter lanczos", 2, "known are box"),
        ("render demo:nothing -o a.png", 3, "there are"),
        ("render demo:cornell --time 2 -o a.png", 3, "nothing moves"),
        ("render demo:julia --time nan -o a.png", 2, "write a number"),
        ("render demo:julia --time 1e9 -o a.png", 3, "out of range"),
        ("render demo:cornell -f 1-3 -o a.##.png", 3, "nothing moves"),
        ("render demo:julia -f 1-3 -o a.png", 2, "####"),
        ("render demo:julia -f 3-1 -o a.##.png", 2, "before the first"),
        ("render demo:julia -o a.##.png", 2, "--frames"),
        ("render demo:metaballs --device gpu -o a.png", 5, "the CPU alone"),
        ("render demo:walker --shutter 0.5 -o a.png", 2, "--time or --frames"),
        ("render demo:walker --time 1 --shutter 200 -o a.png", 2, "between 0 and 100"),
        ("render demo:walker --time 1 --shutter 0.5 --caustics photons -o a.png", 2, "leave photons out"),
        ("render demo:walker --time 1 --shutter 0.5 --integrator whitted -o a.png", 2, "no shutter"),
        ("render demo:walker --time 1 --shutter 0.5 --device gpu -o a.png", 5, "the CPU alone"),
        ("render demo:walker --time 1 --shutter 0.5 --accel kd-threaded -o a.png", 2, "one moment"),
        ("render demo:julia --time 1 --shutter 0.5 -o a.png", 2, "no shutter"),
        ("render demo:cornell --time 1 --shutter 0.5 -o a.png", 3, "nothing moves"),
        ("generate metaballs -o a.glb", 3, "demo:metaballs"),
        ("pack demo:julia -o a.vls", 3, "implicit surfaces"),
        ("render missing.glb -o a.png", 3, "missing.glb"),
        ("render demo:cornell -o a.png --env missing.hdr", 3, "missing.hdr"),
        ("render demo:cornell -o a.png --override missing.toml", 3, "missing.toml"),
        ("render demo:cornell -o a.png --camera nobody", 3, "no camera"),
        ("render demo:cornell -o a.png --memory 1MiB", 4, "budget"),
        ("info demo:cornell --device gpu", 5, "cpu"),
        ("render demo:cornell -o a.png --gpu-memory much", 2, "8GiB"),
        ("render demo:cornell -o a.png --device gpu:x", 2, "gpu:N"),
        ("render demo:cornell -o no/such/a.png", 6, "does not exist"),
        ("render demo:cornell -o a.png --stats no/such/s.json", 6, "does not exist"),
        ("diff a.png b.png", 3, "a.png"),
        ("validate missing.ply", 3, "missing.ply"),
        ("generate cornell -o a.xyz", 2, ".glb"),
        ("bench trace demo:cornell --rays missing.rays", 3, "missing.rays"),
    ];
    for (arguments, code, text) in cases {
        w.refused(arguments, *code, text);
    }
    assert_eq!(w.files(), Vec::<String>::new(), "nothing may be left behind");
}

#[test]
fn frames_are_the_pictures_of_their_moments() {
    let w = Workspace::new();
    let scene = "render demo:explosion --triangles 20000 -r 32x18 --spp 1";
    let outcome = w.run(&format!("{scene} -f 0-24x12 -o f.###.png --stats s.##.json"));
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let names = ["f.000.png", "f.012.png", "f.024.png"];
    assert_eq!(w.files(), [&names[..], &["s.00.json", "s.12.json", "s.24.json"]].concat());
    for (name, time) in names.iter().zip(["0", "0.5", "1"]) {
        assert_eq!(w.run(&format!("{scene} --time {time} -o still.png")).code, 0);
        assert_eq!(w.bytes(name), w.bytes("still.png"), "{name}");
    }
    assert_ne!(w.bytes(names[0]), w.bytes(names[2]), "it moves");
}

#[test]
fn a_render_writes_a_picture_and_its_statistics() {
    let w = Workspace::new();
    let outcome = w.run("render demo:cornell -o a.exr -r 24x16 --spp 3 --stats s.json -t 2");
    assert_eq!((outcome.code, outcome.stdout.as_str()), (0, ""), "{}", outcome.stderr);
    assert!(outcome.stderr.contains("3 of 3 spp"), "{}", outcome.stderr);
    let stats = w.json("s.json");
    assert_eq!((&stats["device"], &stats["ending"]), (&"cpu".into(), &"complete".into()));
    assert_eq!([stats["width"].as_u64(), stats["height"].as_u64()], [Some(24), Some(16)]);
    assert_eq!([stats["samples"].as_u64(), stats["spp_done"].as_u64()], [Some(24 * 16 * 3), Some(3)]);
    assert_eq!([stats["threads"].as_u64(), stats["passes"].as_u64()], [Some(2), Some(3)]);
    assert_eq!(stats["non_finite"].as_u64(), Some(0));
    for positive in ["rays", "shadow_rays", "first_image_ms", "total_ms", "msamples_per_s", "structure_bytes"]
    {
        assert!(stats[positive].as_f64().is_some_and(|x| x > 0.0), "{positive}: {stats}");
    }
    assert!(stats["scene"]["unique_triangles"].as_u64().is_some_and(|n| n > 0));
    assert_eq!(w.files(), ["a.exr", "s.json"]);
}

#[test]
fn progress_is_json_lines_when_asked_for() {
    let w = Workspace::new();
    let outcome = w.run("render demo:cornell -o a.png -r 24x16 --spp 2 --progress json");
    assert_eq!((outcome.code, outcome.stdout.as_str()), (0, ""));
    let events: Vec<serde_json::Value> =
        outcome.stderr.lines().map(|l| serde_json::from_str(l).expect("a JSON line")).collect();
    assert_eq!(events.first().map(|e| &e["event"]), Some(&"progress".into()));
    assert!(events[0]["fraction"].as_f64().is_some_and(|f| f > 0.0 && f <= 1.0));
    let last = events.last().expect("events");
    assert_eq!((&last["event"], &last["output"]), (&"done".into(), &"a.png".into()));
    let quiet = w.run("render demo:cornell -o a.png -r 8x8 --spp 1 -q");
    assert_eq!(quiet, Outcome { code: 0, stdout: String::new(), stderr: String::new() });
}

#[test]
fn the_picture_does_not_depend_on_threads_but_on_the_seed() {
    let w = Workspace::new();
    let render = |name: &str, flags: &str| {
        let outcome = w.run(&format!(
            "render demo:cornell -o {name} -r 40x30 --spp 5 {flags} --aov albedo,normal,depth,alpha,position,object,material"
        ));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        w.bytes(name)
    };
    let one = render("1.exr", "-t 1");
    assert_eq!(render("2.exr", "-t 2"), one);
    assert_eq!(render("16.exr", "-t 16"), one);
    assert_ne!(render("seed.exr", "--seed 1"), one);
    let png = |name: &str, threads: u32| {
        w.run(&format!("render demo:cornell -o {name} -r 40x30 --spp 5 -t {threads}"));
        w.bytes(name)
    };
    assert_eq!(png("1.png", 1), png("2.png", 16));
}

#[test]
fn a_crop_is_the_crop_of_the_whole_picture_bit_for_bit() {
    let w = Workspace::new();
    w.run("render demo:cornell -o whole.exr -r 40x30 --spp 3 --aov normal");
    w.run("render demo:cornell -o crop.exr -r 40x30 --spp 3 --aov normal --crop 7,5,31,26");
    let read = |name: &str| vastlight::film::read_picture(&w.path(name)).expect("a picture");
    let (whole, crop) = (read("whole.exr"), read("crop.exr"));
    assert_eq!((crop.full_size, crop.size()), ([40, 30], [24, 21]));
    for plane in &crop.planes {
        let of_whole = whole.plane(&plane.name).expect("the same planes");
        for (i, value) in plane.values.iter().enumerate() {
            let (x, y) = (7 + i % 24, 5 + i / 24);
            assert_eq!(value.to_bits(), of_whole[y * 40 + x].to_bits(), "{} {x} {y}", plane.name);
        }
    }
}

#[test]
fn diff_tells_equal_from_perturbed() {
    let w = Workspace::new();
    w.run("render demo:cornell -o a.exr -r 24x16 --spp 2");
    w.run("render demo:cornell -o b.exr -r 24x16 --spp 2 --seed 7");
    let same = w.run("diff a.exr a.exr --tolerance 0");
    assert_eq!(same.code, 0);
    let line: serde_json::Value = serde_json::from_str(&same.stdout).expect("one JSON line");
    assert_eq!((line["mse"].as_f64(), line["max"].as_f64()), (Some(0.0), Some(0.0)));
    assert_eq!(line["mean_ratio"].as_f64(), Some(1.0));
    assert!(line["psnr"].is_null());
    let other = w.run("diff a.exr b.exr -o d.exr --tolerance 1e-9");
    assert_eq!(other.code, 1);
    let line: serde_json::Value = serde_json::from_str(&other.stdout).expect("one JSON line");
    for figure in ["mse", "relmse", "max", "psnr"] {
        assert!(line[figure].as_f64().is_some_and(|x| x != 0.0), "{figure}: {line}");
    }
    assert!(w.path("d.exr").exists());
    w.run("render demo:cornell -o small.exr -r 8x8 --spp 1");
    assert_eq!(w.run("diff a.exr small.exr").code, 3);
}

#[test]
fn non_finite_samples_are_counted_and_fail_only_under_strict() {
    let workspace = Workspace::new();
    // The emission is beyond the largest number in single precision.
    workspace.write(
        "bright.gltf",
        r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}],
            "extensionsUsed": ["KHR_materials_emissive_strength"],
            "materials": [{"emissiveFactor": [1, 1, 1],
                "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 1e39}}}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                "min": [-5, -5, 0], "max": [5, 5, 0]}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AACgwAAAoMAAAAAAAACgQAAAoMAAAAAAAAAAAAAAoEAAAAAA"}]}"#,
    );
    let arguments = "render bright.gltf -r 4x4 --spp 4 --look-at 0,0,9,0,0,0";
    let strict = workspace.run(&format!("{arguments} -o strict.png --strict"));
    assert_eq!(strict.code, 7, "{}", strict.stderr);
    assert!(strict.stderr.contains("not finite"), "{}", strict.stderr);
    assert_eq!(workspace.run(&format!("{arguments} -o plain.png")).code, 0);
    assert_eq!(workspace.bytes("strict.png"), workspace.bytes("plain.png"));
    let sane = workspace.run("render demo:cornell -r 4x4 --spp 4 -o sane.png --strict");
    assert_eq!(sane.code, 0, "{}", sane.stderr);
}

#[test]
fn a_time_limit_ends_well_with_an_even_picture() {
    let w = Workspace::new();
    let outcome =
        w.run("render demo:cornell -o a.png -r 32x32 --spp 1000000 --time-limit 300ms --stats s.json");
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let stats = w.json("s.json");
    assert_eq!(stats["ending"], "time_limit");
    assert!(stats["spp_done"].as_u64().is_some_and(|n| (1..1_000_000).contains(&n)));
    assert!(w.path("a.png").exists());
}

#[test]
fn an_override_changes_the_picture_and_a_wrong_one_is_an_error() {
    let w = Workspace::new();
    w.write("dark.toml", "[materials.\"*\"]\nbase_color = [0.01, 0.01, 0.01]\n");
    w.write("wrong.toml", "[materials.\"*\"]\nbase_colour = [0.01, 0.01, 0.01]\n");
    w.run("render demo:cornell -o a.exr -r 16x16 --spp 4");
    assert_eq!(w.run("render demo:cornell -o b.exr -r 16x16 --spp 4 --override dark.toml").code, 0);
    assert_eq!(w.run("diff a.exr b.exr --tolerance 0.01").code, 1);
    w.refused("render demo:cornell -o c.exr -r 16x16 --spp 4 --override wrong.toml", 3, "wrong.toml:2");
}

#[test]
fn the_last_of_several_overrides_has_the_last_word() {
    let w = Workspace::new();
    w.write("dark.toml", "[materials.\"*\"]\nbase_color = [0.01, 0.01, 0.01]\nroughness = 0.2\n");
    w.write("light.toml", "[materials.\"*\"]\nbase_color = [0.7, 0.7, 0.7]\n");
    w.write("both.toml", "[materials.\"*\"]\nbase_color = [0.7, 0.7, 0.7]\nroughness = 0.2\n");
    let picture = |overrides: &[&str]| {
        let flags: String = overrides.iter().map(|name| format!(" --override {name}.toml")).collect();
        let outcome = w.run(&format!("render demo:cornell -o a.png -r 16x16 --spp 4{flags}"));
        assert_eq!(outcome.code, 0, "{flags}: {}", outcome.stderr);
        w.bytes("a.png")
    };
    assert!(
        picture(&["dark", "light"]) == picture(&["both"]),
        "the second has the last word, the first what it alone says"
    );
    assert!(picture(&["light", "dark"]) == picture(&["dark"]));
    assert!(picture(&["light", "dark"]) != picture(&["dark", "light"]));
}

#[test]
fn a_generated_file_is_repeatable_valid_and_renders() {
    let w = Workspace::new();
    for name in ["a.glb", "b.glb", "a.obj", "a.ply"] {
        let outcome = w.run(&format!("generate cornell -o {name} --seed 3"));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    }
    assert_eq!(w.bytes("a.glb"), w.bytes("b.glb"));
    for name in ["a.glb", "a.obj", "a.ply"] {
        assert_eq!(w.run(&format!("validate {name}")).code, 0, "{name}");
        assert_eq!(w.run(&format!("render {name} -o {name}.png -r 8x8 --spp 1")).code, 0, "{name}");
    }
    let info = w.run("info a.glb --json");
    let info: serde_json::Value = serde_json::from_str(&info.stdout).expect("one JSON object");
    assert!(info["counts"]["unique_triangles"].as_u64().is_some_and(|n| n > 0));
    assert!(w.run("info a.glb").stdout.contains("triangles"));
}

#[test]
fn a_store_and_an_exchange_file_come_from_either_command() {
    let w = Workspace::new();
    for (first, second) in [
        ("generate cornell -o a.vls -q", "pack demo:cornell -o b.vls -q"),
        ("generate statue --triangles 20000 -o a.ply -q", "pack demo:statue --triangles 20000 -o b.ply -q"),
        ("pack a.ply -o a.glb -q", "pack a.ply -o b.glb -q"),
    ] {
        for command in [first, second] {
            let outcome = w.run(command);
            assert_eq!(outcome.code, 0, "{command}: {}", outcome.stderr);
        }
        let last = first.split(' ').rfind(|word| word.starts_with("a.")).expect("a file");
        assert!(w.bytes(last) == w.bytes(&last.replace("a.", "b.")), "{first}");
    }
    assert_eq!(w.run("pack a.ply b.ply -o c.glb").code, 2);
}

#[test]
fn a_file_that_does_not_fit_is_refused_before_it_is_read() {
    let w = Workspace::new();
    assert_eq!(w.run("generate statue --triangles 400000 -o a.glb -q").code, 0);
    let outcome = w.run("render a.glb -o a.png --memory 100MiB");
    assert_eq!(outcome.code, 4, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("--cache-dir"), "{}", outcome.stderr);
    assert!(!w.path("a.png").exists());
    // The same file mesh by mesh: what is read of it beside the mesh is a part of it.
    assert_eq!(w.run("pack a.glb -o a.vls --memory 160MiB -q").code, 0);
}

#[test]
fn benches_print_one_json_line_with_the_agreed_fields() {
    let w = Workspace::new();
    let ray = [0.0_f32, 1.0, 20.0, 0.0, 0.0, 0.0, -1.0, 1e30];
    let rays: Vec<u8> = ray.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>().repeat(64);
    std::fs::write(w.path("a.rays"), rays).expect("written");
    let line = |arguments: &str| -> serde_json::Value {
        let outcome = w.run(arguments);
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        serde_json::from_str(&outcome.stdout).expect("one JSON line")
    };
    let trace = line("bench trace demo:cornell --rays a.rays --repeat 1");
    let fields = "bench accel triangles build_ms bytes_per_triangle rays mrays_per_s mrays_per_cpu_s sorted sort_ms \
                  trace_ms hits sum_t peak_rss_bytes";
    fields.split(' ').for_each(|f| assert!(!trace[f].is_null(), "{f}: {trace}"));
    assert_eq!(trace["rays"].as_u64(), Some(64));
    let both = w.run("bench trace demo:cornell --rays a.rays --repeat 1 --sort-rays both").stdout;
    let both = both.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect("JSON"));
    let sorted: Vec<_> = both.map(|line| (line["sorted"].as_bool(), line["sum_t"].as_f64())).collect();
    assert_eq!(sorted, [(Some(false), trace["sum_t"].as_f64()), (Some(true), trace["sum_t"].as_f64())]);
    let build = line("bench build demo:cornell --repeat 1");
    let fields = "bench accel triangles references nodes build_ms cpu_ms mtri_per_s cost depth overlap bytes \
                  peak_build_bytes peak_build_bytes_per_triangle peak_rss_bytes stages";
    fields.split(' ').for_each(|f| assert!(!build[f].is_null(), "{f}: {build}"));
    let caustics = line("bench caustics -r 32x18 --grids 16 --search voxel --frames 1");
    let fields = "bench device search photons trace_ms sort_index_ms gather_ms render_ms frames_per_s";
    fields.split(' ').for_each(|f| assert!(!caustics[f].is_null(), "{f}: {caustics}"));
    let moving = "demo:explosion --triangles 20000 -f 36-38 -r 32x24 --method refit,auto";
    let lines = |arguments: &str| -> Vec<serde_json::Value> {
        let outcome = w.run(arguments);
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        outcome.stdout.lines().map(|line| serde_json::from_str(line).expect("a JSON line")).collect()
    };
    let update = lines(&format!("bench update {moving}"));
    assert_eq!(update.len(), 2 * 3 + 2);
    let fields = "bench sequence method update_ms rebuild_ms trace_ratio rebuilt_fraction migrated_fraction";
    for line in &update {
        fields.split(' ').for_each(|f| assert!(!line[f].is_null(), "{f}: {line}"));
        assert_eq!(line["same_hits"], true, "{line}");
        assert!(line["frame"].is_null() || line["rays"].as_u64() > Some(32 * 24), "rays bounce: {line}");
    }
    let animate = lines(&format!("bench animate {moving} --rays 1,10"));
    assert_eq!(animate.len(), 2 * 2);
    let fields = "bench sequence method rays_per_frame update_ms trace_ms against_best";
    animate.iter().for_each(|l| fields.split(' ').for_each(|f| assert!(!l[f].is_null(), "{f}: {l}")));
    let shutter = line("bench shutter demo:explosion --triangles 20000 --time 1.5 -r 32x24");
    let fields = "bench sequence keys rays moving_triangles still_mrays_per_s open_mrays_per_s slowdown";
    fields.split(' ').for_each(|f| assert!(!shutter[f].is_null(), "{f}: {shutter}"));
    let clusters =
        "bench clusters demo:explosion --triangles 20000 -f 36-37 -r 32x24 -o c.png --max-count 20";
    for (line, heuristic) in lines(&format!("{clusters} --heuristic acc,error")).iter().zip(["acc", "error"])
    {
        let fields = "bench max_count clusters build_ms build_ms_without trace_ratio";
        fields.split(' ').for_each(|f| assert!(!line[f].is_null(), "{f}: {line}"));
        assert_eq!((line["heuristic"].as_str(), line["same_hits"].as_bool()), (Some(heuristic), Some(true)));
        let [clusters, triangles] = ["clusters", "triangles"].map(|f| line[f].as_u64().expect("a count"));
        assert!((triangles / 20..triangles).contains(&clusters), "{line}");
    }
    let by_color = w.bytes("c.png");
    lines(&clusters.replace("--max-count 20", "--max-count 200"));
    assert!(by_color != w.bytes("c.png"), "larger clusters are fewer colours");
    for still in ["cornell", "traffic"] {
        let outcome = w.run(&format!("bench clusters demo:{still} -f 0 -r 32x24 --max-count 50"));
        assert_eq!(outcome.code, 3, "{still}: {}", outcome.stderr);
    }
    let path = line("bench path demo:cornell -r 16x16 --spp 2");
    let fields = "bench device msamples_per_s first_image_ms";
    fields.split(' ').for_each(|f| assert!(!path[f].is_null(), "{f}: {path}"));
}

/// Ctrl-C while rendering: the picture so far is written, and the code is 130.
#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_stops_cleanly() {
    let w = Workspace::new();
    let arguments = "render demo:cornell -o a.png -r 64x64 --spp 4000000 --progress json --stats s.json";
    let mut child = w.spawn(arguments);
    common::wait_for_line(&mut child, "\"progress\"");
    common::interrupt(&child);
    let status = child.wait().expect("ended");
    assert_eq!(status.code(), Some(130));
    assert_eq!(w.json("s.json")["ending"], "interrupted");
    assert_eq!(w.files(), ["a.png", "s.json"]);
}

/// A mesh that a budget of 96 MiB packs in some ten parts, and the store that comes of it.
fn mesh_and_store(work: &Workspace) -> Vec<u8> {
    assert_eq!(work.run("generate statue --triangles 700000 -o mesh.ply -q").code, 0);
    assert_eq!(work.run("pack mesh.ply -o once.vls --memory 96MiB -q").code, 0);
    work.bytes("once.vls")
}

#[test]
fn a_killed_pack_goes_on_and_gives_the_same_bytes() {
    let work = Workspace::new();
    let expected = mesh_and_store(&work);
    let mut child = work.spawn("pack mesh.ply -o scene.vls --memory 96MiB -q");
    let journal = work.path("scene.vls.journal");
    let some_done = || std::fs::metadata(&journal).is_ok_and(|file| file.len() > 1 << 12);
    while !some_done() && child.try_wait().expect("runs").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child.kill().expect("killed");
    assert!(!child.wait().expect("ends").success());
    assert_eq!(work.files(), ["mesh.ply", "once.vls", "scene.vls.journal", "scene.vls.part"]);
    let outcome = work.run("pack mesh.ply -o scene.vls --memory 96MiB --progress json");
    assert_eq!(outcome.code, 0, "{outcome:?}");
    assert!(!outcome.stderr.contains("\"triangles_resumed\":0,"), "{outcome:?}");
    assert!(work.bytes("scene.vls") == expected);
    assert_eq!(work.files(), ["mesh.ply", "once.vls", "scene.vls"]);
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_said_and_the_pack_goes_on_when_there_is_room() {
    let work = Workspace::new();
    let expected = mesh_and_store(&work);
    // No file may have more than 12 to 24 MB, as the shell counts.
    let script = format!(
        "trap '' XFSZ; ulimit -f 24000; exec {} pack mesh.ply -o scene.vls --memory 96MiB -q",
        env!("CARGO_BIN_EXE_vastlight")
    );
    let shell = std::process::Command::new("sh").current_dir(work.path("")).args(["-c", &script]).output();
    let output = shell.expect("a shell");
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(6), "{error}");
    assert!(error.lines().count() == 1 && error.contains("make room"), "{error}");
    assert!(!work.files().contains(&"scene.vls".to_owned()));
    assert_eq!(work.run("pack mesh.ply -o scene.vls --memory 96MiB -q").code, 0);
    assert!(work.bytes("scene.vls") == expected);
}

#[test]
fn a_pack_without_enough_memory_says_how_much_is_needed() {
    let work = Workspace::new();
    work.refused("pack demo:cornell -o scene.vls --memory 16MiB", 4, "needed");
    assert!(work.files().is_empty());
}

#[test]
fn a_source_that_changed_is_noticed() {
    let work = Workspace::new();
    assert_eq!(work.run("generate statue --triangles 20000 -o mesh.ply -q").code, 0);
    assert_eq!(work.run("pack mesh.ply -o scene.vls -q").code, 0);
    let render = "render scene.vls -o picture.png -r 16x9 --spp 1";
    assert!(!work.run(render).stderr.contains("changed"));
    assert!(work.run("info scene.vls").stdout.contains("packed from  mesh.ply"));
    assert_eq!(work.run("generate statue --triangles 30000 -o mesh.ply -q").code, 0);
    assert!(work.run(render).stderr.contains("mesh.ply has changed"));
    assert!(work.run("info scene.vls").stdout.contains("changed since"));
}

/// A glTF file of one mesh of separate triangles, whose positions stand in `mesh.bin`.
fn write_gltf(work: &Workspace, positions: &[[f32; 3]]) {
    let bytes = size_of_val(positions);
    let bound = |best: fn(f32, f32) -> f32| {
        let bounds = positions.iter().copied().reduce(|a, b| std::array::from_fn(|i| best(a[i], b[i])));
        bounds.unwrap_or_default().map(f64::from)
    };
    let buffer = format!(r#""buffers": [{{"byteLength": {bytes}, "uri": "mesh.bin"}}]"#);
    let view = format!(r#""bufferViews": [{{"buffer": 0, "byteLength": {bytes}}}]"#);
    let accessor = format!(
        r#""accessors": [{{"bufferView": 0, "componentType": 5126, "count": {}, "type": "VEC3",
        "min": {:?}, "max": {:?}}}]"#,
        positions.len(),
        bound(f32::min),
        bound(f32::max)
    );
    let mesh = r#""meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}]"#;
    let text = format!(r#"{{"asset": {{"version": "2.0"}}, {buffer}, {view}, {accessor}, {mesh}}}"#);
    work.write("mesh.gltf", &text);
    write_buffer(work, positions);
}

fn write_buffer(work: &Workspace, positions: &[[f32; 3]]) {
    let buffer: Vec<u8> = positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    std::fs::write(work.path("mesh.bin"), buffer).expect("written");
}

#[test]
fn files_that_a_source_names_are_sources_too() {
    let work = Workspace::new();
    let write = |name: &str, text: &str| std::fs::write(work.path(name), text).expect("written");
    write("mesh.obj", "mtllib mesh.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    write("mesh.mtl", "newmtl red\nKd 1 0 0\nmap_Kd missing.png\n");
    write_gltf(&work, &[[0.0; 3]; 3]);
    assert_eq!(work.run("pack mesh.gltf mesh.obj -o scene.vls -q").code, 0);
    let info = work.run("info scene.vls").stdout;
    for name in ["mesh.gltf", "mesh.obj", "mesh.mtl", "mesh.bin"] {
        assert!(info.contains(&format!("packed from  {name}")), "{name}: {info}");
    }
    assert!(!info.contains("packed from  missing.png") && !info.contains("changed since"), "{info}");
    write("mesh.mtl", "newmtl red\nKd 0 1 0\n");
    assert!(
        work.run("render scene.vls -o picture.png -r 16x9 --spp 1").stderr.contains("mesh.mtl has changed")
    );
}

#[test]
fn info_says_what_a_store_needs_at_least_and_that_is_enough() {
    let work = Workspace::new();
    assert_eq!(work.run("pack demo:statue --triangles 100000 -o scene.vls -q").code, 0);
    let info = work.run("info scene.vls --json");
    let info: serde_json::Value = serde_json::from_str(&info.stdout).expect("one JSON object");
    let least = info["memory_bytes"]["least"].as_u64().expect("a number");
    assert!(info["memory_bytes"]["all_pages"].as_u64().is_some_and(|all| all > 0));
    let render =
        |bytes: u64| work.run(&format!("render scene.vls -o a.png -r 1920x1080 --spp 1 --memory {bytes} -q"));
    assert_eq!(render(least / 2).code, 4);
    let outcome = render(least + (8 << 20));
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
}

#[test]
fn a_scene_that_does_not_fit_is_packed_once_and_gives_the_same_picture() {
    let work = Workspace::new();
    let render = |more: &str| {
        let common = "render demo:statue --triangles 600000 -r 32x18 --spp 1 -q -o";
        work.run(&format!("{common} {more}"))
    };
    assert_eq!(render("memory.png").code, 0);
    assert_eq!(render("store.png --memory 180MiB --cache-dir stores").code, 0);
    assert_eq!(work.bytes("memory.png"), work.bytes("store.png"));
    let stores = || std::fs::read_dir(work.path("stores")).expect("listed").count();
    let before = stores();
    assert_eq!(render("store.png --memory 180MiB --cache-dir stores").code, 0);
    assert_eq!((before, stores()), (1, 1));
    assert_eq!(render("fits.png --cache-dir other").code, 0);
    assert!(!work.files().contains(&"other".to_owned()));
}

#[test]
fn a_cached_store_is_packed_anew_when_a_file_of_the_scene_changed() {
    let work = Workspace::new();
    let done = |arguments: &str| {
        let outcome = work.run(arguments);
        assert_eq!(outcome.code, 0, "{arguments}: {}", outcome.stderr);
    };
    work.write("sky.toml", "[environment]\nmap = \"sky.exr\"\n");
    let scene = "render mesh.gltf -r 32x18 --spp 1 --override sky.toml -q -o";
    let sky = |spp: u32| done(&format!("render demo:cornell -o sky.exr -r 16x8 --spp {spp} -q"));
    let number = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 8) as f32 / 16_777_216.0;
    let place = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2].map(number);
    let mut positions: Vec<_> = (0..1_800_000).map(place).collect();
    let same_as_in_memory = || {
        done(&format!("{scene} store.png --memory 150MiB --cache-dir stores"));
        done(&format!("{scene} memory.png"));
        assert!(work.bytes("store.png") == work.bytes("memory.png"));
        work.bytes("store.png")
    };
    sky(1);
    write_gltf(&work, &positions);
    let mut pictures = vec![same_as_in_memory()];
    sky(64);
    pictures.push(same_as_in_memory());
    positions.rotate_left(1);
    write_buffer(&work, &positions);
    pictures.push(same_as_in_memory());
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
}

#[test]
fn pages_that_no_reader_takes_are_refused_before_work() {
    let work = Workspace::new();
    for flag in ["--page-bytes", "--tile-bytes"] {
        work.refused(&format!("pack demo:cornell -o scene.vls {flag} 1MiB -q"), 2, flag);
        assert!(work.files().is_empty(), "{flag}");
    }
}

#[cfg(feature = "object-store")]
#[test]
fn a_store_on_a_server_gives_the_picture_of_the_file() {
    let work = Workspace::new();
    assert_eq!(work.run("pack demo:statue --triangles 20000 -o scene.vls -q").code, 0);
    let render = |scene: &str, picture: &str| {
        work.run(&format!("render {scene} -o {picture} -r 32x18 --spp 2 --memory 100MiB"))
    };
    assert_eq!(render("scene.vls", "file.png").code, 0);
    let served = Server::start(work.bytes("scene.vls"), |number| match number % 7 {
        3 => Answer::Status("503 Service Unavailable"),
        _ => Answer::Right,
    });
    let outcome = render(&format!("{}?signature=abc", served.address()), "server.png");
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    assert!(served.requests() > 1 && work.bytes("server.png") == work.bytes("file.png"));
    assert!(!outcome.stderr.contains("signature"), "{}", outcome.stderr);
    let info = work.run(&format!("info {}?signature=abc", served.address())).stdout;
    assert!(info.contains("demo:statue") && !info.contains("signature"), "{info}");
    let missing = render(&format!("{}/none.vls?signature=abc", served.host()), "none.png");
    missing.is_refusal(3, "none.vls");
    assert!(!missing.stderr.contains("signature"), "{missing:?}");
    let other = render(&format!("{}/mesh.glb?signature=abc", served.host()), "none.png");
    other.is_refusal(2, "pack");
    assert!(!other.stderr.contains("signature"), "{other:?}");
    assert!(!work.files().contains(&"none.png".to_owned()));
}
