//! Measured metals by name.
//!
//! Indices are linear interpolations at the dominant wavelengths of the Rec. 709 primaries (611.4, 549.1, 464.2 nm) of
//! P. B. Johnson and R. W. Christy, Phys. Rev. B 6, 4370 (1972) for gold, silver and copper and Phys. Rev. B 9, 5056
//! (1974) for iron, chromium, nickel and titanium, and of A. D. Rakic, Appl. Opt. 34, 4755 (1995) for aluminium, as
//! tabulated by refractiveindex.info (public domain).

use crate::Conductor;
use vastlight_math::Vec3;

/// Name, eta, k.
const METALS: [(&str, [f32; 3], [f32; 3]); 8] = [
    ("gold", [0.222, 0.428, 1.335], [3.208, 2.461, 1.872]),
    ("silver", [0.058, 0.06, 0.046], [4.106, 3.59, 2.795]),
    ("copper", [0.362, 1.015, 1.246], [3.127, 2.579, 2.453]),
    ("aluminium", [1.322, 1.011, 0.683], [7.311, 6.617, 5.625]),
    ("iron", [2.89, 2.95, 2.643], [3.04, 2.93, 2.803]),
    ("chromium", [3.178, 3.18, 2.449], [3.3, 3.33, 3.206]),
    ("nickel", [1.985, 1.92, 1.763], [3.985, 3.611, 3.042]),
    ("titanium", [2.659, 2.54, 2.303], [3.698, 3.43, 3.08]),
];

impl Conductor {
    /// The measured metal of this name (English, lower case; `aluminum` works too).
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let name = if name == "aluminum" { "aluminium" } else { name };
        let (_, eta, k) = METALS.iter().find(|m| m.0 == name)?;
        Some(Self { eta: Vec3::from_array(*eta), k: Vec3::from_array(*k) })
    }

    /// The names that [`Conductor::named`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        METALS.iter().map(|m| m.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reflectance at normal incidence.
    fn reflectance(name: &str) -> Vec3 {
        let m = Conductor::named(name).expect("known");
        let k2 = m.k * m.k;
        ((m.eta - 1.0) * (m.eta - 1.0) + k2) / ((m.eta + 1.0) * (m.eta + 1.0) + k2)
    }

    #[test]
    fn metals_have_their_colours() {
        let gold = reflectance("gold");
        assert!(gold.x > 0.9 && gold.x > gold.y && gold.y > gold.z && gold.z < 0.45);
        assert!(reflectance("silver").min_element() > 0.95);
        assert!(reflectance("copper").x > reflectance("copper").z + 0.2);
        assert_eq!(Conductor::named("aluminum"), Conductor::named("aluminium"));
        assert!(Conductor::names().all(|n| reflectance(n).max_element() < 1.0));
        assert_eq!(Conductor::named("cheese"), None);
    }
}
