//! The commands that the documents show work.

use super::common::Outcome;
use super::excluded::{EXCLUDED, FOREIGN_FLAGS};
use super::fixtures;
use super::markdown::{Block, Document, documents, root};
use super::reduce::reduce;
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;

const SHELL: [&str; 3] = ["sh", "bash", "console"];
/// How the command is started in the checkout, and installed.
const PROMPTS: [&str; 2] = ["cargo run --release -- ", "vastlight "];
const ON_GPU: &str = "--device gpu";
/// What else is run.
const OTHERS: [&str; 1] = ["mkdir "];
/// Pages are worked on at the same time.
const WORKERS: usize = 2;

/// A line of a shell, and where it stands.
struct Line {
    place: String,
    text: String,
}

impl Line {
    fn is_run(&self) -> bool {
        PROMPTS.iter().chain(&OTHERS).any(|start| self.text.starts_with(start))
    }

    /// Why it is not run.
    fn reason(&self) -> Option<&'static str> {
        EXCLUDED.iter().find(|(start, _)| self.text.starts_with(start)).map(|(_, reason)| *reason)
    }

    /// The line with cheap commands, as a shell takes it.
    fn cheap(&self) -> String {
        let text = self.text.replace(PROMPTS[0], PROMPTS[1]);
        let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
        let mut cheap: Vec<String> = Vec::new();
        let mut rest = words.as_slice();
        while let Some((first, after)) = rest.split_first() {
            cheap.push(first.clone());
            rest = after;
            if first == "vastlight" {
                let end = rest.iter().position(|word| is_operator(word)).unwrap_or(rest.len());
                cheap.extend(reduce(&rest[..end]));
                rest = &rest[end..];
            }
        }
        cheap.join(" ")
    }
}

fn is_operator(word: &str) -> bool {
    ["|", "||", "&&", ";", ">", ">>", "<", "2>"].contains(&word) || word.ends_with(';')
}

/// The lines of a block without comments, those that end in a backslash joined. In a console, what follows `$`.
fn lines(page: &Document, block: &Block) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    let mut goes_on = false;
    for (i, line) in block.text.lines().enumerate() {
        let line = match block.language.as_str() {
            "console" if !goes_on => line.strip_prefix("$ ").unwrap_or(""),
            _ => line,
        };
        let code = line.split(" #").next().unwrap_or("").trim();
        let code = if code.starts_with('#') { "" } else { code };
        let (code, ends) = code.strip_suffix('\\').map_or((code, true), |code| (code.trim_end(), false));
        match lines.last_mut() {
            Some(last) if goes_on => last.text += &format!(" {code}"),
            _ if code.is_empty() => {}
            _ => lines.push(Line { place: page.place(block.line + i), text: code.to_owned() }),
        }
        goes_on = !ends;
    }
    lines
}

/// All lines of a page.
fn commands(page: &Document) -> Vec<Line> {
    let blocks = page.blocks();
    let of_shell = blocks.iter().filter(|block| SHELL.contains(&block.language.as_str()));
    of_shell.flat_map(|block| lines(page, block)).collect()
}

/// A folder in which commands run in a shell that finds `vastlight`.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    /// With all that another has.
    fn like(other: &Self) -> Self {
        let folder = Self::new();
        let status =
            Command::new("cp").args(["-al", "."]).arg(folder.0.path()).current_dir(other.0.path()).status();
        assert!(status.is_ok_and(|status| status.success()));
        folder
    }

    fn shell(&self, line: &str) -> Command {
        let program = Path::new(env!("CARGO_BIN_EXE_vastlight")).parent().expect("a folder");
        let others = std::env::var("PATH").unwrap_or_default();
        let mut command = Command::new("sh");
        command.args(["-euc", line]).current_dir(self.0.path()).stdin(Stdio::null());
        command.env("PATH", format!("{}:{others}", program.display())).env("HOME", self.0.path());
        command
    }

    fn run(&self, line: &str) -> Outcome {
        Outcome::of(&mut self.shell(line))
    }

    /// Starts `view`, waits for its address, and ends it as Ctrl-C does.
    fn view(&self, line: &str) -> Outcome {
        let mut child = self.shell(&format!("exec {line}")).stdout(Stdio::piped()).spawn().expect("started");
        let mut address = String::new();
        let read = BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut address);
        super::common::interrupt(&child);
        let status = child.wait().expect("ended");
        assert!(read.is_ok() && address.starts_with("http://127.0.0.1:"), "{line}: {address}");
        Outcome { code: status.code().unwrap_or(-1), stdout: address, stderr: String::new() }
    }
}

/// The files that all pages may use.
fn fixtures() -> Folder {
    let folder = Folder::new();
    fixtures::write(folder.0.path());
    for command in fixtures::MADE {
        let outcome = folder.run(&format!("vastlight {command}"));
        assert_eq!(outcome.code, 0, "{command}: {outcome:?}");
    }
    folder
}

/// Writes the blocks that name their file in a comment on their first line; their names.
fn write_examples(page: &Document, folder: &Folder) -> Vec<String> {
    let mut names = Vec::new();
    for block in page.blocks().iter().filter(|block| block.language == "toml") {
        let name = block.text.strip_prefix("# ").and_then(|text| text.split_whitespace().next());
        let name = name.filter(|name| name.ends_with(".toml")).map(str::to_owned);
        let name = name.unwrap_or_else(|| panic!("{}: begin with # NAME.toml", page.place(block.line)));
        std::fs::write(folder.0.path().join(&name), &block.text).expect("written");
        names.push(name);
    }
    names
}

/// What became of lines.
#[derive(Default)]
struct Report {
    run: usize,
    left_out: Vec<(String, &'static str)>,
    faults: Vec<String>,
}

impl Report {
    fn add(&mut self, other: Self) {
        self.run += other.run;
        self.left_out.extend(other.left_out);
        self.faults.extend(other.faults);
    }
}

/// Runs the lines of a page, one after the other, in one folder.
fn run(page: &Document, files: &Folder, has_gpu: bool) -> Report {
    let mut report = Report::default();
    let lines = commands(page);
    let folder = Folder::like(files);
    for example in write_examples(page, &folder) {
        if !lines.iter().any(|line| line.text.contains(&example)) {
            report.faults.push(format!("{}: no command uses {example}", page.path.display()));
        }
    }
    for line in lines {
        let named = format!("{}: {}", line.place, line.text);
        if let Some(reason) = line.reason() {
            report.left_out.push((named, reason));
        } else if !line.is_run() {
            report.faults.push(format!("{named}: say in excluded.rs why it is not run"));
        } else {
            let mut cheap = line.cheap();
            if !has_gpu && cheap.contains(ON_GPU) {
                cheap = cheap.replace(ON_GPU, "--device cpu");
                report
                    .left_out
                    .push((named.clone(), "on the CPU instead; cargo xtask soak compiles the kernels"));
            }
            let outcome =
                if cheap.starts_with("vastlight view") { folder.view(&cheap) } else { folder.run(&cheap) };
            report.run += 1;
            if outcome.code != 0 {
                let error =
                    format!("{named}\n  as {cheap}\n  ended with {}: {}", outcome.code, outcome.stderr);
                report.faults.push(error);
            }
        }
    }
    report
}

#[test]
fn every_command_of_the_documents_works() {
    let files = fixtures();
    let is_soak = std::env::var_os("VASTLIGHT_SOAK").is_some();
    let has_gpu = is_soak && files.run("vastlight bench sort -n 100 --repeat 1 --device gpu").code == 0;
    let pages = documents();
    let (queue, report) = (Mutex::new(pages.iter()), Mutex::new(Report::default()));
    std::thread::scope(|scope| {
        for _ in 0..WORKERS {
            scope.spawn(|| {
                while let Some(page) = { queue.lock().expect("no panic").next() } {
                    let one = run(page, &files, has_gpu);
                    report.lock().expect("no panic").add(one);
                }
            });
        }
    });
    let mut report = report.into_inner().expect("no panic");
    report.left_out.sort();
    println!(
        "{} command lines of the documents were run, {} were not or not as they are:",
        report.run,
        report.left_out.len()
    );
    for (line, reason) in &report.left_out {
        println!("skipped: documents: {line}: {reason}");
    }
    assert!(report.faults.is_empty(), "{}", report.faults.join("\n"));
    assert!(report.run > 80, "{} lines were run", report.run);
}

#[test]
fn commands_that_are_wrong_are_noticed() {
    let text = "
```console
$ vastlight render demo:cornell --integrater path -o a.png
error: that was a mistake
$ vastlight diff \\
    a.exr b.exr   # none is there
$ frobnicate
```

    vastlight info demo:cornell

Or:

    rustup update
    cargo build

```rust
ssh farm vastlight info demo:cornell
```

```sh
# Right:
vastlight info demo:cornell --json > info.json && test -s info.json
```
";
    let page = Document::new(PathBuf::from("page.md"), text.into());
    let lines: Vec<(String, String)> =
        commands(&page).into_iter().map(|line| (line.place, line.text)).collect();
    let expected = [
        ("page.md:3", "vastlight render demo:cornell --integrater path -o a.png"),
        ("page.md:5", "vastlight diff a.exr b.exr"),
        ("page.md:7", "frobnicate"),
        ("page.md:23", "vastlight info demo:cornell --json > info.json && test -s info.json"),
    ];
    assert_eq!(lines, expected.map(|(place, text)| (place.to_owned(), text.to_owned())));
    assert_eq!(hidden(&page), ["page.md:10", "page.md:14", "page.md:18"]);
    let report = run(&page, &Folder::new(), false);
    assert_eq!((report.run, report.faults.len()), (3, 3), "{:?}", report.faults);
    for (fault, part) in report.faults.iter().zip(["--integrater", "a.exr", "excluded.rs"]) {
        assert!(fault.contains(part), "{fault}");
    }
}

#[test]
fn what_is_left_out_is_still_there() {
    let lines: Vec<Line> = documents().iter().flat_map(commands).collect();
    for (start, _) in EXCLUDED {
        assert!(lines.iter().any(|line| line.text.starts_with(start)), "no document has {start}");
    }
}

/// Where commands stand in a block that is not of the shell.
fn hidden(page: &Document) -> Vec<String> {
    let is_other = |block: &Block| block.language != "text" && !SHELL.contains(&block.language.as_str());
    let excluded = EXCLUDED.iter().map(|(start, _)| *start);
    let known: Vec<&str> = PROMPTS.into_iter().chain(["cargo ", "rustup "]).chain(excluded).collect();
    let starts = |line: &str| known.iter().any(|start| line.trim().starts_with(start));
    let hidden = page.blocks().into_iter().filter(|block| is_other(block) && block.text.lines().any(starts));
    hidden.map(|block| page.place(block.line)).collect()
}

#[test]
fn commands_stand_in_blocks_of_the_shell() {
    let hidden: Vec<String> = documents().iter().flat_map(hidden).collect();
    assert!(hidden.is_empty(), "write ```sh before commands: {hidden:?}");
}

/// The words of a text that are flags.
fn flags(text: &str) -> BTreeSet<String> {
    let is_part = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let words = text.split(|c| !is_part(c)).filter(|word| word.len() > 2 && word.starts_with("--"));
    words.filter(|word| !word.starts_with("---")).map(|word| word.trim_end_matches('-').to_owned()).collect()
}

/// The texts of benches/*.py and crates/*/examples/*.rs, which have flags of their own.
fn programs_beside() -> Vec<String> {
    let list =
        |folder: PathBuf| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let examples = list(root().join("crates")).flat_map(|folder| list(folder.join("examples")));
    let files = list(root().join("benches")).chain(examples).filter(|path| path.is_file());
    files.map(|path| std::fs::read_to_string(path).expect("a text")).collect()
}

#[test]
fn flags_that_the_text_names_exist() {
    let mut known = flags(&Folder::new().run("vastlight completions bash").stdout);
    known.extend(programs_beside().iter().flat_map(|text| flags(text)));
    let mut faults = Vec::new();
    for page in documents() {
        for (line, code) in page.inline_code() {
            let unknown = flags(&code).into_iter().filter(|flag| !known.contains(flag));
            let unknown = unknown.filter(|flag| !FOREIGN_FLAGS.contains(&flag.as_str()));
            faults.extend(unknown.map(|flag| format!("{}: {flag}", page.place(line))));
        }
    }
    assert!(
        known.contains("--spp") && known.contains("--packets") && faults.is_empty(),
        "{}",
        faults.join("\n")
    );
}
