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

#[test]
fn sorts_run_on_a_graphics_processor_or_say_why_not() {
    let w = Workspace::new();
    let outcome = w.run("bench sort -n 5000 --repeat 1 --device gpu:99");
    assert_eq!((outcome.code, outcome.stdout.as_str()), (5, ""), "{}", outcome.stderr);
    let outcome = w.run("bench sort -n 5000 --repeat 1 --device gpu");
    if outcome.code == 5 && outcome.stderr.contains("mesa-vulkan-drivers") {
        println!("skipped: no adapter: no software Vulkan driver (Debian: mesa-vulkan-drivers libvulkan1)");
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
