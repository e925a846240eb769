//! Links lead somewhere, and every page is in the book.

use super::markdown::{Document, documents, root};
use std::path::{Component, Path, PathBuf};

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                assert!(plain.pop(), "{}: leaves the checkout", path.display());
            }
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// What is wrong with a link of a page.
fn fault(page: &Document, target: &str, pages: &[Document]) -> Option<&'static str> {
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    let path = match file {
        "" => page.path.clone(),
        file => plain(&page.path.parent().expect("a folder").join(file)),
    };
    if !root().join(&path).exists() {
        return Some("there is no such file");
    }
    if page.path.starts_with("docs") && !path.starts_with("docs") {
        return Some("the book has only what is in docs");
    }
    let linked = pages.iter().find(|page| page.path == path);
    let has_anchor =
        anchor.is_empty() || linked.is_some_and(|page| page.anchors().iter().any(|a| a == anchor));
    (!has_anchor).then_some("there is no such heading")
}

#[test]
fn every_link_leads_to_a_file_and_a_heading() {
    let pages = documents();
    let (mut checked, mut faults) = (0, Vec::new());
    for page in &pages {
        let links = page.links();
        let here = links.iter().filter(|(_, target)| !target.contains("://"));
        for (line, target) in here {
            checked += 1;
            if let Some(fault) = fault(page, target, &pages) {
                faults.push(format!("{}: {target}: {fault}", page.place(*line)));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(checked > 150, "{checked} links were found");
}

#[test]
fn broken_links_are_noticed() {
    let pages = documents();
    let page = pages.iter().find(|page| page.path.ends_with("outputs.md")).expect("a page");
    assert_eq!(fault(page, "checkpoints.md#noise", &pages), None);
    assert_eq!(fault(page, "checkpoint.md", &pages), Some("there is no such file"));
    assert_eq!(fault(page, "checkpoints.md#noises", &pages), Some("there is no such heading"));
    assert_eq!(fault(page, "../Cargo.toml", &pages), Some("the book has only what is in docs"));
}

#[test]
fn every_page_is_a_chapter_of_the_book_once() {
    let pages = documents();
    let summary = pages.iter().find(|page| page.path.ends_with("SUMMARY.md")).expect("a summary");
    let mut chapters: Vec<PathBuf> =
        summary.links().into_iter().map(|(_, target)| Path::new("docs").join(target)).collect();
    chapters.sort();
    let files = pages.iter().map(|page| page.path.clone()).filter(|path| path.starts_with("docs"));
    let files: Vec<PathBuf> = files.filter(|path| *path != summary.path).collect();
    assert_eq!(chapters, files);
}

/// Folders of the checkout whose files the text names as code.
const FOLDERS: [&str; 5] = ["apps/", "benches/", "crates/", "docs/", "xtask/"];

#[test]
fn files_and_programs_that_the_text_names_exist() {
    let (mut checked, mut faults) = (0, Vec::new());
    for page in documents() {
        for (line, code) in page.inline_code() {
            let words: Vec<&str> = code.split_whitespace().collect();
            let files = words.iter().filter(|word| FOLDERS.iter().any(|folder| word.starts_with(folder)));
            let mut known: Vec<bool> =
                files.flat_map(|file| braces(file)).map(|file| root().join(file).exists()).collect();
            known.extend(words.windows(2).filter_map(|pair| is_program(pair[0], pair[1])));
            checked += known.len();
            if known.contains(&false) {
                faults.push(format!("{}: {code}", page.place(line)));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(checked > 20, "{checked} names were found");
}

/// `a/{b,c}.rs` as a/b.rs and a/c.rs.
fn braces(text: &str) -> Vec<String> {
    let parts = text.split_once('{').and_then(|(start, rest)| Some((start, rest.split_once('}')?)));
    match parts {
        Some((start, (names, end))) => names.split(',').map(|name| format!("{start}{name}{end}")).collect(),
        None => vec![text.to_owned()],
    }
}

/// Whether `--example NAME` or `--test NAME` is there; none for other words.
fn is_program(flag: &str, name: &str) -> Option<bool> {
    let folder = match flag {
        "--example" => "examples",
        "--test" => "tests",
        _ => return None,
    };
    let crates =
        ["apps", "crates"].into_iter().flat_map(|all| std::fs::read_dir(root().join(all)).expect("listed"));
    let mut folders = crates.map(|entry| entry.expect("an entry").path().join(folder));
    Some(folders.any(|folder| {
        folder.join(format!("{name}.rs")).is_file() || folder.join(name).join("main.rs").is_file()
    }))
}
