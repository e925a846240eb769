//! Manual pages and completions follow the flags.

mod common;

use common::Workspace;
use std::io::Write;
use std::process::{Command, Stdio};

/// The commands that a help text lists.
fn listed(help: &str) -> Vec<String> {
    let list = help.split("Commands:").nth(1).unwrap_or_default();
    let lines = list.lines().skip(1).take_while(|line| !line.is_empty());
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next());
    names.filter(|name| *name != "help").map(str::to_owned).collect()
}

#[test]
fn every_command_has_a_manual_page_with_its_flags() {
    let w = Workspace::new();
    assert_eq!(w.run("man -o share/man/man1").code, 0);
    let commands = listed(&w.run("-h").stdout);
    let benchmarks = listed(&w.run("bench -h").stdout);
    assert!(commands.len() > 10 && benchmarks.len() > 10, "{commands:?} {benchmarks:?}");
    let mut pages: Vec<String> = commands.iter().map(|name| format!("vastlight-{name}.1")).collect();
    pages.extend(benchmarks.iter().map(|name| format!("vastlight-bench-{name}.1")));
    pages.push("vastlight.1".into());
    let folder = std::fs::read_dir(w.path("share/man/man1")).expect("listed");
    let mut files: Vec<String> =
        folder.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
    files.sort();
    pages.sort();
    assert_eq!(files, pages);
    let render = String::from_utf8(w.bytes("share/man/man1/vastlight-render.1")).expect("UTF-8");
    assert!(render.contains(r"\-\-caustics") && render.contains(".TH vastlight-render 1"), "{render}");
    assert_eq!(w.run("man").stdout.as_bytes(), w.bytes("share/man/man1/vastlight.1"));
}

#[test]
fn pages_that_cannot_be_written_are_an_error() {
    let w = Workspace::new();
    w.write("file", "");
    w.refused("man -o file/man1", 6, "file/man1");
}

#[test]
fn shells_take_their_completions() {
    let w = Workspace::new();
    for (shell, part) in [
        ("bash", "complete -F _vastlight"),
        ("zsh", "#compdef vastlight"),
        ("fish", "complete -c vastlight"),
        ("elvish", "vastlight"),
        ("powershell", "Register-ArgumentCompleter"),
    ] {
        let script = w.run(&format!("completions {shell}"));
        assert_eq!(script.code, 0, "{script:?}");
        for text in [part, "checkpoint-every", "validate"] {
            assert!(script.stdout.contains(text), "{shell}: no {text}");
        }
        check_syntax(shell, &script.stdout);
    }
    assert_eq!(w.run("completions dash").code, 2);
}

/// Lets a shell that is there read a script without running it.
fn check_syntax(shell: &str, script: &str) {
    if shell == "elvish" || shell == "powershell" {
        return;
    }
    let child = Command::new(shell).arg("-n").stdin(Stdio::piped()).spawn();
    let Ok(mut child) = child else {
        println!("skipped: completions: no {shell} to read them");
        return;
    };
    child.stdin.take().expect("a pipe").write_all(script.as_bytes()).expect("read");
    assert!(child.wait().expect("ended").success(), "{shell} -n");
}
