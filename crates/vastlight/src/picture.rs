//! What a picture is if nobody says more.

use crate::Error;
use vastlight_transport::Integrator;
use vastlight_transport::photon::PhotonSettings;

/// Rows of a picture whose size nobody asked for.
const DEFAULT_ROWS: u32 = 720;
/// Largest edge of a picture.
pub const LARGEST_EDGE: u32 = 65_536;
/// Photons of a point light where they are sent by a grid.
const PUBLISHED: u32 = 256 * 256;

/// Width and height of a picture of so many rows, or as many as are usual, for a camera of this shape; 16:9 without.
#[must_use]
pub fn default_size(rows: Option<u32>, aspect: Option<f32>) -> (u32, u32) {
    let rows = rows.unwrap_or(DEFAULT_ROWS);
    let aspect = aspect.filter(|a| a.is_finite() && *a > 0.0).unwrap_or(16.0 / 9.0);
    (((rows as f32 * aspect).round() as u32).clamp(1, LARGEST_EDGE), rows)
}

/// How photons are sent, if they are: `brought` says whether they bring the caustics of paths.
///
/// # Errors
/// They are to bring those of an integrator that has none.
pub fn photon_settings(
    integrator: Integrator,
    brought: bool,
    settings: PhotonSettings,
) -> Result<Option<PhotonSettings>, Error> {
    match (brought, integrator) {
        (_, Integrator::PhotonCaustics) => {
            let edge = f64::from(settings.photons.unwrap_or(PUBLISHED)).sqrt() as u32;
            Ok(Some(PhotonSettings { grid: Some([edge; 2]), ..settings }))
        }
        (false, _) => Ok(None),
        (true, Integrator::Path) => Ok(Some(settings)),
        (true, _) => Err(Error::usage("photons go with path alone", "--caustics", "use --integrator path")),
    }
}
