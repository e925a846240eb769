//! What goes into the filter.

use crate::DenoiseError;

/// A noisy picture and its guides: planes of linear numbers, rows from the top.
#[derive(Clone, Copy, Debug)]
pub struct NoisyPicture<'p> {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance: red, green and blue, 0 or more, of any unit.
    pub color: [&'p [f32]; 3],
    /// Reflectance of the first surface, 0 to 1.
    pub albedo: [&'p [f32]; 3],
    /// Shading normal of the first surface, -1 to 1, in any space.
    pub normal: [&'p [f32]; 3],
}

impl NoisyPicture<'_> {
    /// Pixels of each plane.
    ///
    /// # Errors
    /// If a plane has another number of them, or there are none.
    pub(crate) fn pixels(&self) -> Result<usize, DenoiseError> {
        let pixels = self.width as usize * self.height as usize;
        let all = [self.color, self.albedo, self.normal];
        let fits = pixels > 0 && all.as_flattened().iter().all(|plane| plane.len() == pixels);
        if fits { Ok(pixels) } else { Err(DenoiseError::Shape(pixels)) }
    }
}

/// The numbers of three planes pixel by pixel.
pub(crate) fn interleaved([x, y, z]: [&[f32]; 3]) -> Vec<[f32; 3]> {
    x.iter().zip(y).zip(z).map(|((&x, &y), &z)| [x, y, z]).collect()
}

/// A plane of each of the three numbers of pixels.
pub(crate) fn planes(pixels: &[[f32; 3]]) -> [Vec<f32>; 3] {
    std::array::from_fn(|axis| pixels.iter().map(|pixel| pixel[axis]).collect())
}
