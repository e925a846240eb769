//! Devices from outside: their list, and what runs on graphics processors.

mod common;

use common::Workspace;

#[test]
fn devices_are_listed_for_people_and_for_programs() {
    let w = Workspace::new();
    let text = w.run("devices");
    assert_eq!(text.code, 0, "{}", text.stderr);
    assert!(text.stdout.starts_with("cpu     usable "), "{}", text.stdout);
    let listed = w.run("devices --json");
    let listed: serde_json::Value = serde_json::from_str(&listed.stdout).unwrap();
    let devices = listed["devices"].as_array().unwrap();
    assert_eq!((&devices[0]["device"], &devices[0]["usable"]), (&"cpu".into(), &true.into()));
    for (i, gpu) in devices[1..].iter().enumerate() {
        assert_eq!(gpu["device"], format!("gpu:{i}"));
        assert_eq!(gpu["usable"].as_bool().unwrap(), gpu["reason"].is_null());
        assert!(gpu["limits"]["binding_bytes"].is_u64());
        assert!(text.stdout.contains(gpu["name"].as_str().unwrap()), "{}", text.stdout);
    }
    assert_eq!(text.stdout.lines().count(), devices.len().max(2));
}

/// Whether there is an adapter; if not, says that a test was skipped.
fn has_adapter(w: &Workspace) -> bool {
    let outcome = w.run("bench sort -n 100 --repeat 1 --device gpu");
    let missing = outcome.code == 5 && outcome.stderr.contains("mesa-vulkan-drivers");
    if missing {
        println!("skipped: no adapter: no software Vulkan driver (Debian: mesa-vulkan-drivers libvulkan1)");
    }
    !missing
}

#[test]
fn a_graphics_processor_renders_the_picture_of_the_cpu_and_is_named() {
    let w = Workspace::new();
    if !has_adapter(&w) {
        return;
    }
    let picture = "render demo:cornell -r 32x18 --spp 3 --aov depth,object";
    assert_eq!(w.run(&format!("{picture} -o cpu.exr --device cpu")).code, 0);
    let outcome = w.run(&format!("{picture} -o gpu.exr --device gpu --stats s.json --gpu-memory 1GiB"));
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    let stats = w.json("s.json");
    assert_eq!((&stats["device"], &stats["fallback"]), (&"gpu".into(), &serde_json::Value::Null));
    assert!(stats["adapter"].as_str().is_some_and(|name| !name.is_empty()), "{stats}");
    assert_eq!(stats["samples"].as_u64(), Some(32 * 18 * 3));
    let same = w.run("diff cpu.exr gpu.exr --tolerance 1e-5");
    assert_eq!(same.code, 0, "{}", same.stdout);
    assert_eq!(w.run("render demo:cornell -r 32x18 --spp 3 -o other.exr --seed 1 --device cpu").code, 0);
    assert_eq!(w.run("diff other.exr gpu.exr --tolerance 1e-5").code, 1);
    let outcome = w.run("bench path demo:cornell -r 8x8 --spp 1 --device gpu");
    let line: serde_json::Value = serde_json::from_str(outcome.stdout.trim()).unwrap();
    assert_eq!((&line["device"], &line["samples"]), (&"gpu".into(), &64.into()));
}

#[test]
fn what_fails_on_a_graphics_processor_is_an_error_or_goes_on_on_the_cpu_with_a_warning() {
    let w = Workspace::new();
    let render = "render demo:cornell -r 16x9 --spp 1 -o a.exr --stats s.json";
    for fails in ["--device gpu:99", "--device gpu --gpu-memory 1MiB"] {
        let outcome = w.run(&format!("{render} {fails}"));
        assert_eq!(
            (outcome.code, outcome.stderr.lines().last().map(|l| l.starts_with("error: "))),
            (5, Some(true))
        );
        assert!(w.files().is_empty(), "{fails}");
    }
    for fails in ["--device gpu:99", "--device gpu --gpu-memory 1MiB"] {
        let outcome = w.run(&format!("{render} {fails} --gpu-fallback"));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        assert!(outcome.stderr.contains("warning: rendered on the CPU: "), "{}", outcome.stderr);
        let stats = w.json("s.json");
        assert!(stats["device"] == "cpu" && stats["fallback"].is_string(), "{stats}");
    }
    let automatic = w.run(&format!("{render} --device auto"));
    assert_eq!(automatic.code, 0);
}

#[test]
fn a_store_is_rendered_on_a_graphics_processor_within_its_memory() {
    let w = Workspace::new();
    if !has_adapter(&w) {
        return;
    }
    assert_eq!(w.run("pack demo:textured-hall -o hall.vls").code, 0);
    let mut waited = Vec::new();
    for (scene, memory) in [("demo:textured-hall", "1GiB"), ("hall.vls", "1GiB"), ("hall.vls", "24MiB")] {
        let name = format!("{}.exr", waited.len());
        let outcome = w.run(&format!(
            "render {scene} -r 48x27 --spp 2 -o {name} --device gpu --gpu-memory {memory} --stats s.json"
        ));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        waited.push(w.json("s.json")["gpu_paging"]["waits"].as_u64());
        let same = w.run(&format!("diff 0.exr {name} --tolerance 0"));
        assert_eq!(same.code, 0, "{scene} {memory}: {}", same.stdout);
    }
    assert!(waited[..2] == [Some(0); 2] && waited[2] > Some(0), "{waited:?}");
}

#[test]
fn images_that_are_not_worth_tiles_are_on_a_graphics_processor_too() {
    let w = Workspace::new();
    if !has_adapter(&w) {
        return;
    }
    assert_eq!(w.run("render demo:cornell -r 24x16 --spp 4 -o picture.png --device cpu").code, 0);
    w.write("quad.mtl", "newmtl m\nmap_Kd picture.png\n");
    w.write(
        "quad.obj",
        "mtllib quad.mtl\nv -1 0 -1\nv 1 0 -1\nv 1 0.5 1\nv -1 0.5 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
         usemtl m\nf 1/1 4/4 3/3 2/2\n",
    );
    assert_eq!(w.run("pack quad.obj -o quad.vls").code, 0);
    let render = "-r 32x18 --spp 2 --aov albedo";
    assert_eq!(w.run(&format!("render quad.obj {render} -o cpu.exr --device cpu")).code, 0);
    for scene in ["quad.obj", "quad.vls"] {
        let outcome = w.run(&format!("render {scene} {render} -o gpu.exr --device gpu"));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let same = w.run("diff cpu.exr gpu.exr --tolerance 1e-5");
        assert_eq!(same.code, 0, "{scene}: {}", same.stdout);
    }
    w.write("quad.mtl", "newmtl m\nKd 0.5 0.5 0.5\n");
    assert_eq!(w.run(&format!("render quad.obj {render} -o grey.exr --device cpu")).code, 0);
    assert_eq!(w.run("diff cpu.exr grey.exr --tolerance 1e-5").code, 1);
}

#[test]
fn sorts_run_on_a_graphics_processor_or_say_why_not() {
    let w = Workspace::new();
    let outcome = w.run("bench sort -n 5000 --repeat 1 --device gpu:99");
    assert_eq!((outcome.code, outcome.stdout.as_str()), (5, ""), "{}", outcome.stderr);
    let outcome = w.run("bench sort -n 5000 --repeat 1 --device gpu");
    if !has_adapter(&w) {
        return;
    }
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    for line in outcome.stdout.lines() {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        assert_eq!(
            (&line["bench"], &line["device"], &line["n"]),
            (&"sort".into(), &"gpu".into(), &5000.into())
        );
        assert!(!line["adapter"].as_str().unwrap().is_empty() && line["mkeys_per_s"].as_f64().unwrap() > 0.0);
    }
    assert_eq!(outcome.stdout.lines().count(), 4);
}

#[test]
fn the_stream_tracer_is_measured_on_a_graphics_processor() {
    let w = Workspace::new();
    if !has_adapter(&w) {
        return;
    }
    let lines = |device: &str| {
        let outcome =
            w.run(&format!("bench kdtree demo:cornell --resolution 16 --repeat 1 --device {device}"));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let lines = outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap());
        lines.collect::<Vec<serde_json::Value>>()
    };
    let (cpu, gpu) = (lines("cpu"), lines("gpu"));
    let names = gpu.iter().map(|line| line["accel"].as_str().unwrap()).collect::<Vec<_>>();
    assert_eq!(names, ["kd-threaded", "kd-threaded-sah"]);
    assert!(gpu.iter().all(|line| line["device"] == "gpu" && line["frame_ms"].as_f64().unwrap() > 0.0));
    // Hits do not depend on the trees.
    assert_eq!(gpu[0]["picture"], gpu[1]["picture"]);
    let rays = [&cpu[0], &gpu[0]].map(|line| line["rays"].as_f64().unwrap());
    assert!((rays[0] / rays[1] - 1.0).abs() < 0.01, "{rays:?}");
}

#[test]
fn trees_are_built_on_a_graphics_processor_or_it_is_said_why_not() {
    let w = Workspace::new();
    let wrong = w.run("bench build demo:still-life --device gpu --accel sbvh");
    assert_eq!(wrong.code, 2, "{}", wrong.stderr);
    let wrong = w.run("bench build demo:still-life --device gpu --optimize 1");
    assert_eq!(wrong.code, 2, "{}", wrong.stderr);
    for name in ["morton", "morton-queues", "hlbvh2"] {
        let built = w.run(&format!("bench build demo:still-life --device gpu --accel {name} --repeat 1"));
        if built.code == 5 && built.stderr.contains("mesa-vulkan-drivers") {
            println!(
                "skipped: no adapter: no software Vulkan driver (Debian: mesa-vulkan-drivers libvulkan1)"
            );
            return;
        }
        assert_eq!(built.code, 0, "{}", built.stderr);
        let line: serde_json::Value = serde_json::from_str(&built.stdout).unwrap();
        assert_eq!((&line["device"], &line["accel"]), (&"gpu".into(), &name.into()));
        let number = |name: &str| line[name].as_f64().unwrap();
        let stages = line["stages"].as_object().unwrap().values().map(|ms| ms.as_f64().unwrap());
        assert!(number("wide_nodes") > 0.0 && (stages.sum::<f64>() - number("build_ms")).abs() < 1e-6);
        assert!(name != "morton" || number("dispatches") - number("sort_dispatches") > 0.0);
    }
}
