//! Findings while a file is read: each with the Khronos validator's code, at most a few of one kind.

use super::accessor::Fault;
use std::collections::BTreeMap;
use vastlight_scene::{Diagnostic, Diagnostics, Severity};

/// How many findings of one code are listed one by one.
const LISTED: usize = 8;

/// A finding with the name that the Khronos glTF validator has for it (or one in its style).
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Finding {
    pub(super) code: &'static str,
    pub(super) diagnostic: Diagnostic,
}

/// Collects findings about one file; places are JSON pointers or byte offsets within it.
#[derive(Clone, Debug, Default)]
pub(super) struct Findings {
    list: Vec<Finding>,
    counts: BTreeMap<(&'static str, Severity), usize>,
}

impl Findings {
    /// Adds an error.
    pub(super) fn error(&mut self, code: &'static str, what: impl Into<String>, place: &str, hint: &str) {
        self.push(Severity::Error, code, what.into(), place, hint);
    }

    /// Adds a warning.
    pub(super) fn warn(&mut self, code: &'static str, what: impl Into<String>, place: &str, hint: &str) {
        self.push(Severity::Warning, code, what.into(), place, hint);
    }

    /// Adds what stands in a fault.
    pub(super) fn fault(&mut self, code: &'static str, fault: Fault) {
        self.push(fault.severity, code, fault.what, &fault.place, fault.hint);
    }

    fn push(&mut self, severity: Severity, code: &'static str, what: String, place: &str, hint: &str) {
        let count = self.counts.entry((code, severity)).or_insert(0);
        *count += 1;
        if *count <= LISTED {
            let diagnostic = Diagnostic { severity, what, place: place.into(), hint: hint.into() };
            self.list.push(Finding { code, diagnostic });
        }
    }

    /// Appends the findings of another collector, in its order.
    pub(super) fn append(&mut self, other: Findings) {
        let mut unlisted = other.counts;
        for finding in other.list {
            let key = (finding.code, finding.diagnostic.severity);
            unlisted.entry(key).and_modify(|count| *count -= 1);
            let count = self.counts.entry(key).or_insert(0);
            *count += 1;
            if *count <= LISTED {
                self.list.push(finding);
            }
        }
        for (key, count) in unlisted {
            *self.counts.entry(key).or_insert(0) += count;
        }
    }

    /// Whether an error was found.
    pub(super) fn has_errors(&self) -> bool {
        self.counts.keys().any(|(_, severity)| *severity == Severity::Error)
    }

    /// The findings that are listed one by one.
    #[cfg(test)]
    pub(super) fn list(&self) -> &[Finding] {
        &self.list
    }

    /// Moves everything to `out`; `file` goes before each place.
    pub(super) fn report(mut self, file: &str, out: &mut Diagnostics) {
        let first_error = self.list.iter_mut().find(|f| f.diagnostic.severity == Severity::Error);
        if let Some(Finding { diagnostic, .. }) = first_error.filter(|f| f.diagnostic.hint.is_empty()) {
            diagnostic.hint = "export the file again; `vastlight validate` lists all findings".into();
        }
        for Finding { mut diagnostic, .. } in self.list {
            diagnostic.place = match diagnostic.place.as_str() {
                "" => file.to_owned(),
                place if place.starts_with('/') => format!("{file}#{place}"),
                place => format!("{file}: {place}"),
            };
            out.push(diagnostic);
        }
        for ((code, severity), count) in self.counts {
            if count > LISTED {
                let what = format!("{} more findings of the kind {code}", count - LISTED);
                out.push(Diagnostic { severity, what, place: file.to_owned(), hint: String::new() });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_findings_of_one_kind_are_counted_not_listed() {
        let mut findings = Findings::default();
        for i in 0..100 {
            findings.warn("X", format!("{i}"), &format!("/a/{i}"), "");
        }
        let mut all = Findings::default();
        all.append(findings.clone());
        all.append(findings);
        let mut diagnostics = Diagnostics::default();
        all.report("f.gltf", &mut diagnostics);
        assert_eq!(diagnostics.items().len(), LISTED + 1);
        assert_eq!(diagnostics.items()[1].place, "f.gltf#/a/1");
        assert_eq!(diagnostics.items()[LISTED].what, format!("{} more findings of the kind X", 200 - LISTED));
    }
}
