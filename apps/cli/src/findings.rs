//! Findings about a scene, for people: one line each, each kind once.

use vastlight::scene::Diagnostic;

/// A message without line breaks, whatever a library put into it.
pub(crate) fn one_line(message: &str) -> String {
    let lines: Vec<&str> = message.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    lines.join(" ")
}

/// One line for each kind of finding, in the order of the first ones: the first, and how many are like it.
pub(crate) fn by_kind(findings: &[Diagnostic]) -> Vec<String> {
    let mut kinds: Vec<(&Diagnostic, usize)> = Vec::new();
    for finding in findings {
        match kinds.iter_mut().find(|(first, _)| first.what == finding.what) {
            Some((_, count)) => *count += 1,
            None => kinds.push((finding, 1)),
        }
    }
    kinds.into_iter().map(describe).collect()
}

fn describe((first, count): (&Diagnostic, usize)) -> String {
    let line = one_line(&first.to_string());
    if count == 1 { line } else { format!("{line} [and {} more like it]", count - 1) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight::scene::Diagnostics;

    #[test]
    fn kinds_are_counted_and_lines_are_one() {
        let mut diagnostics = Diagnostics::default();
        diagnostics.warn("bent", "a", "");
        diagnostics.warn("torn\n at the edge", "b", "mend it");
        diagnostics.warn("bent", "c", "");
        let lines = by_kind(diagnostics.items());
        assert_eq!(lines, ["a: bent [and 1 more like it]", "b: torn at the edge (mend it)"]);
    }
}
