//! Measured luminaires.

use vastlight::import::parse_ies;
use vastlight::scene::Diagnostics;

/// The text of an IES file.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let Ok(profile) = parse_ies(bytes, "lamp.ies", &mut Diagnostics::default()) else { return false };
    assert_eq!(profile.candela.len(), profile.vertical.len() * profile.horizontal.len());
    assert!(profile.peak_candela.is_finite() && profile.peak_candela > 0.0);
    assert!(profile.candela.iter().all(|candela| (0.0..=1.0).contains(candela)));
    for angles in [&profile.vertical, &profile.horizontal] {
        assert!(angles.iter().all(|angle| angle.is_finite()) && angles.windows(2).all(|w| w[0] < w[1]));
    }
    true
}
