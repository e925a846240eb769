//! What sums are sums of: names and values, so that a refusal can say what differs.

/// Everything that decides what the samples of a picture are, as names with values. Sums of equal recipes belong together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recipe {
    entries: Vec<(String, String)>,
}

/// Longest value that a message shows.
const SHOWN: usize = 40;

impl Recipe {
    /// Adds a value; `{:?}` of numbers tells all of their bits.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.entries.push((name.to_owned(), value.to_string()));
        self
    }

    /// Names and values.
    #[must_use]
    pub fn entries(&self) -> &[(String, String)] {
        &self.entries
    }

    pub(crate) fn from_entries(entries: Vec<(String, String)>) -> Self {
        Self { entries }
    }

    /// What of `other` is not as it is here, in words; `None` if nothing.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<String> {
        let value = |of: &Self, name: &str| of.entries.iter().find(|e| e.0 == name).map(|e| e.1.clone());
        let names = self.entries.iter().chain(&other.entries).map(|entry| entry.0.as_str());
        let mut shown: Vec<&str> = Vec::new();
        for name in names.filter(|name| value(self, name) != value(other, name)) {
            if !shown.contains(&name) {
                shown.push(name);
            }
        }
        let words = |name: &&str| match (value(self, name), value(other, name)) {
            (Some(a), Some(b)) if a.len() <= SHOWN && b.len() <= SHOWN => format!("{name} ({a} and {b})"),
            _ => (*name).to_owned(),
        };
        (!shown.is_empty()).then(|| shown.iter().map(words).collect::<Vec<_>>().join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_named() {
        let recipe = |seed: u32, camera: &str| Recipe::default().with("seed", seed).with("camera", camera);
        let long = "x".repeat(80);
        assert_eq!(recipe(1, "a").difference(&recipe(1, "a")), None);
        assert_eq!(recipe(1, "a").difference(&recipe(2, &long)).as_deref(), Some("seed (1 and 2), camera"));
        let more = recipe(1, "a").with("noise", 0.1);
        assert_eq!(recipe(1, "a").difference(&more).as_deref(), Some("noise"));
        assert_eq!(more.difference(&recipe(1, "a")).as_deref(), Some("noise"));
    }
}
