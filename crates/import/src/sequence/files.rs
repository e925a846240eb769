//! Files whose names differ in a number: `mesh.####.ply` stands for mesh.0001.ply, mesh.0002.ply and so on.

use crate::{ErrorKind, ImportError, Limits};
use std::path::{Path, PathBuf};

/// The files of a sequence: those of all numbers from the first to the last.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Files {
    name: Name,
    first: u64,
    count: u64,
}

/// A path with marks for the digits of a number.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Name {
    path: PathBuf,
    /// The file's name before and behind the marks.
    before: String,
    behind: String,
    /// How many marks there are: the fewest digits.
    width: usize,
}

impl Name {
    /// The last run of marks in a file's name; `None` without marks, or if a file has just this name.
    fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let (marked, behind) = name.split_at(name.rfind('#')? + 1);
        if path.is_file() {
            return None;
        }
        let before = marked.trim_end_matches('#');
        let width = marked.len() - before.len();
        Some(Self { path: path.to_owned(), before: before.to_owned(), behind: behind.to_owned(), width })
    }

    /// The number of a file's name: as many digits as marks, or more that do not start with 0.
    fn number(&self, name: &str) -> Option<u64> {
        let digits = name.strip_prefix(self.before.as_str())?.strip_suffix(self.behind.as_str())?;
        let length = digits.len();
        let is_padded = length == self.width || length > self.width && !digits.starts_with('0');
        let is_number = digits.bytes().all(|b| b.is_ascii_digit());
        if is_padded && is_number { digits.parse().ok() } else { None }
    }

    fn file(&self, number: u64) -> PathBuf {
        let Self { before, behind, width, .. } = self;
        self.path.with_file_name(format!("{before}{number:0width$}{behind}"))
    }

    /// The numbers of all files there are, ascending.
    fn numbers(&self) -> Result<Vec<u64>, ImportError> {
        let folder = self.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let entries = std::fs::read_dir(folder).map_err(|e| ImportError::io(&e, folder))?;
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let mut numbers: Vec<u64> = names.filter_map(|name| self.number(&name)).collect();
        numbers.sort_unstable();
        Ok(numbers)
    }
}

impl Files {
    /// The files that a path with marks stands for; `None` if it has no marks.
    ///
    /// # Errors
    /// There are none, too many, or one between them is missing.
    pub(crate) fn find(path: &Path, limits: &Limits) -> Result<Option<Self>, ImportError> {
        let Some(name) = Name::of(path) else { return Ok(None) };
        let numbers = name.numbers()?;
        let place = path.display().to_string();
        let Some(&first) = numbers.first() else {
            let error = ImportError::new(ErrorKind::Io, "there is no file of this sequence", place);
            return Err(error.with_hint("each # stands for a digit of the files' numbers"));
        };
        if let Some(gap) = numbers.windows(2).find(|pair| pair[1] != pair[0] + 1) {
            let missing = name.file(gap[0] + 1);
            let what = "this file of the sequence is missing";
            return Err(ImportError::new(ErrorKind::Io, what, missing.display().to_string()));
        }
        let count = numbers.len() as u64;
        limits.check_count(count, limits.items, "files of a sequence", &place)?;
        Ok(Some(Self { name, first, count }))
    }

    /// How many there are; at least one.
    pub(crate) fn len(&self) -> u64 {
        self.count
    }

    /// The file of a key, counted from 0.
    pub(crate) fn key(&self, key: u64) -> PathBuf {
        self.name.file(self.first + key.min(self.count - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(names: &[&str], pattern: &str) -> Result<Option<Files>, ImportError> {
        let folder = tempfile::tempdir().expect("a folder");
        names.iter().for_each(|name| std::fs::write(folder.path().join(name), "").expect("written"));
        Files::find(&folder.path().join(pattern), &Limits::default())
    }

    /// Names of the files.
    fn names(found: Result<Option<Files>, ImportError>) -> Vec<String> {
        let files = found.expect("found").expect("a sequence");
        let name = |key| files.key(key).file_name().expect("a name").to_string_lossy().into_owned();
        (0..files.len()).map(name).collect()
    }

    #[test]
    fn marks_stand_for_digits() {
        let there = [
            "a.08.ply",
            "a.09.ply",
            "a.10.ply",
            "a.7.ply",
            "a.007.ply",
            "a.08.obj",
            "b.11.ply",
            "a.x1.ply",
            "a.+9.ply",
        ];
        assert_eq!(names(found(&there, "a.##.ply")), ["a.08.ply", "a.09.ply", "a.10.ply"]);
        let error = found(&there, "a.#.ply").expect_err("7, 10");
        assert!(error.place.ends_with("a.8.ply"), "{error}");
    }

    #[test]
    fn numbers_may_outgrow_the_marks() {
        assert_eq!(names(found(&["a8b", "a9b", "a10b", "a011b"], "a#b")), ["a8b", "a9b", "a10b"]);
        assert_eq!(names(found(&["f#1_3", "f#1_4"], "f#1_#")), ["f#1_3", "f#1_4"]);
        // The largest numbers, one that is none any more, and more marks than a number has digits.
        let large = ["18446744073709551614", "18446744073709551615"];
        assert_eq!(names(found(&[large[0], large[1], "18446744073709551616"], "#")), large);
        let long = [format!("{:0200}", 6), format!("{:0200}", 7)];
        assert_eq!(names(found(&[&long[0], &long[1]], &"#".repeat(200))), long);
        assert!(found(&long.each_ref().map(String::as_str), &"#".repeat(100_000)).is_err());
    }

    #[test]
    fn gaps_and_nothing_are_errors_and_names_with_marks_are_names() {
        let error = found(&["a01", "a02", "a04", "a07"], "a##").expect_err("a gap");
        assert!(error.place.ends_with("a03") && error.what.contains("missing"), "{error}");
        let error = found(&["a01"], "a###").expect_err("nothing");
        assert!(error.to_string().contains("no file of this sequence"), "{error}");
        assert_eq!(found(&["a1"], "a1"), Ok(None));
        assert_eq!(found(&["a#", "a1"], "a#"), Ok(None));
        let few = Limits { items: 1, ..Limits::default() };
        let folder = tempfile::tempdir().expect("a folder");
        ["1", "2"].iter().for_each(|name| std::fs::write(folder.path().join(name), "").expect("written"));
        assert!(Files::find(&folder.path().join("#"), &few).is_err());
    }
}
