//! The planes of a film in the order in which files have them.

use super::number::Number;
use crate::{Film, FilmSettings, FilmTile, Window};
use std::io;

/// A plane of numbers, one a pixel; it is empty where it was not asked for.
pub(super) struct Plane<N> {
    pub(super) get: fn(&FilmTile) -> &[N],
    pub(super) get_mut: fn(&mut FilmTile) -> &mut [N],
}

/// What is done with every plane.
pub(super) trait EachPlane {
    fn plane<N: Number>(&mut self, plane: &Plane<N>) -> io::Result<()>;
}

/// Visits the planes but for those of mattes.
pub(super) fn each_plane(visitor: &mut impl EachPlane) -> io::Result<()> {
    visitor.plane(&Plane { get: |t| &t.samples, get_mut: |t| &mut t.samples })?;
    visitor.plane(&Plane { get: |t| &t.color, get_mut: |t| &mut t.color })?;
    visitor.plane(&Plane { get: |t| &t.squares, get_mut: |t| &mut t.squares })?;
    visitor.plane(&Plane { get: |t| &t.hits, get_mut: |t| &mut t.hits })?;
    visitor.plane(&Plane { get: |t| &t.albedo, get_mut: |t| &mut t.albedo })?;
    visitor.plane(&Plane { get: |t| &t.normal, get_mut: |t| &mut t.normal })?;
    visitor.plane(&Plane { get: |t| &t.depth, get_mut: |t| &mut t.depth })?;
    visitor.plane(&Plane { get: |t| &t.position, get_mut: |t| &mut t.position })
}

/// What the planes take in a file.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Measure {
    /// Bytes of a pixel, mattes apart.
    pub(super) bytes_per_pixel: u64,
    /// Planes, mattes included: each has a checksum.
    pub(super) count: u64,
}

/// What the planes of a film with these settings take.
pub(super) fn measure(settings: &FilmSettings) -> Measure {
    struct Sum<'t>(&'t FilmTile, Measure);
    impl EachPlane for Sum<'_> {
        fn plane<N: Number>(&mut self, plane: &Plane<N>) -> io::Result<()> {
            let pixels = (plane.get)(self.0).len() as u64;
            self.1.bytes_per_pixel += pixels * N::BYTES as u64;
            self.1.count += pixels;
            Ok(())
        }
    }
    let pixel = FilmTile::new(Window::whole(1, 1), settings);
    let mut sum = Sum(&pixel, Measure::default());
    // Summing does not fail.
    let _ = each_plane(&mut sum);
    let mattes = (pixel.objects.len() + pixel.materials.len()) as u64;
    Measure { count: sum.1.count + mattes, ..sum.1 }
}

/// Whether a film has a plane.
pub(super) fn has<N>(film: &Film, plane: &Plane<N>) -> bool {
    film.tiles().iter().any(|tile| !(plane.get)(tile).is_empty())
}
