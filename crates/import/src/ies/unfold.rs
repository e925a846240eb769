//! From what was measured to the whole sphere: symmetries of type C, and types B and A in terms of type C.

use vastlight_math::Vec3;
use vastlight_math::real::{asin, atan2, cos, sin};

/// Degrees between the angles that types B and A are resampled to.
const STEP: f32 = 1.0;

/// Coordinates of the measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Photometry {
    /// Polar axis down: architectural and road lighting.
    C,
    /// Polar axis horizontal: floodlights.
    B,
    /// Polar axis up: headlamps and signals.
    A,
}

/// Intensities over ascending angles in degrees, the vertical angle fastest.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    pub(super) vertical: Vec<f32>,
    pub(super) horizontal: Vec<f32>,
    pub(super) candela: Vec<f32>,
}

impl Table {
    /// The same luminaire in type C over the whole circle: horizontal angles from 0 to less than 360, or a single 0.
    pub(super) fn unfolded(self, photometry: Photometry) -> Result<Self, String> {
        match photometry {
            Photometry::C => self.check(-1e-3..=180.001, -1e-3..=360.001)?.unfolded_c(),
            _ => self.check(-90.001..=90.001, -90.001..=90.001)?.resampled(photometry),
        }
    }

    fn check(
        self,
        vertical: std::ops::RangeInclusive<f32>,
        horizontal: std::ops::RangeInclusive<f32>,
    ) -> Result<Self, String> {
        let outside = |angles: &[f32], range: &std::ops::RangeInclusive<f32>| {
            angles.iter().find(|a| !range.contains(a)).copied()
        };
        let wrong = outside(&self.vertical, &vertical).or_else(|| outside(&self.horizontal, &horizontal));
        wrong.map_or(Ok(self), |angle| Err(format!("the angle {angle} is outside of the sphere")))
    }

    /// The row of a horizontal angle.
    fn row(&self, h: usize) -> &[f32] {
        &self.candela[h * self.vertical.len()..(h + 1) * self.vertical.len()]
    }

    fn unfolded_c(self) -> Result<Self, String> {
        let is = |angle: Option<&f32>, value: f32| angle.is_some_and(|a| (a - value).abs() < 0.5);
        let (first, last) = (self.horizontal.first(), self.horizontal.last());
        if self.horizontal.len() == 1 {
            return Ok(Self { horizontal: vec![0.0], ..self });
        }
        // For each stored angle, the angles at which the same is seen.
        let images: fn(f32) -> Vec<f32> = if is(first, 0.0) && is(last, 90.0) {
            |h| vec![h, 180.0 - h, 180.0 + h, 360.0 - h]
        } else if is(first, 0.0) && is(last, 180.0) {
            |h| vec![h, 360.0 - h]
        } else if is(first, 90.0) && is(last, 270.0) {
            |h| vec![h, 540.0 - h]
        } else if is(first, 0.0) && last.is_some_and(|&l| l > 180.0) {
            |h| vec![h]
        } else {
            let range = format!("{} to {}", self.horizontal[0], self.horizontal[self.horizontal.len() - 1]);
            return Err(format!("horizontal angles from {range} are of no known symmetry"));
        };
        let mut rows: Vec<(f32, usize)> = Vec::new();
        for (i, &h) in self.horizontal.iter().enumerate() {
            rows.extend(images(h).into_iter().map(|angle| (angle.rem_euclid(360.0), i)));
        }
        rows.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        rows.dedup_by(|a, b| (a.0 - b.0).abs() < 1e-3);
        Ok(Self {
            horizontal: rows.iter().map(|r| r.0).collect(),
            candela: rows.iter().flat_map(|r| self.row(r.1)).copied().collect(),
            vertical: self.vertical,
        })
    }

    /// Types B and A over the hemisphere in front of the luminaire. In the light's frame -z is the axis, +x is right
    /// and +y up.
    fn resampled(&self, photometry: Photometry) -> Result<Self, String> {
        let vertical: Vec<f32> = (0..=90).map(|i| i as f32 * STEP).collect();
        let horizontal: Vec<f32> = (0..360).map(|i| i as f32 * STEP).collect();
        let mut candela = Vec::with_capacity(vertical.len() * horizontal.len());
        for &h in &horizontal {
            for &v in &vertical {
                let (h, v) = (h.to_radians(), v.to_radians());
                let d = Vec3::new(sin(v) * cos(h), sin(v) * sin(h), -cos(v));
                // Type B turns about the horizontal axis first, type A about the vertical one.
                let (across, along) = match photometry {
                    Photometry::B => (asin(d.x.clamp(-1.0, 1.0)), atan2(d.y, -d.z)),
                    _ => (atan2(d.x, -d.z), asin(d.y.clamp(-1.0, 1.0))),
                };
                candela.push(self.interpolate(along.to_degrees(), across.to_degrees()));
            }
        }
        Ok(Self { vertical, horizontal, candela })
    }

    /// Bilinear; dark outside of what was measured. Angles that start at 0 are mirrored to the negative side.
    fn interpolate(&self, vertical: f32, horizontal: f32) -> f32 {
        let (Some(v), Some(h)) = (bracket(&self.vertical, vertical), bracket(&self.horizontal, horizontal))
        else {
            return 0.0;
        };
        let row = |i: usize| self.row(i)[v.0] * (1.0 - v.2) + self.row(i)[v.1] * v.2;
        row(h.0) * (1.0 - h.2) + row(h.1) * h.2
    }
}

/// Neighbours and the fraction between them.
fn bracket(angles: &[f32], x: f32) -> Option<(usize, usize, f32)> {
    const SLACK: f32 = 1e-2;
    let (first, last) = (angles[0], angles[angles.len() - 1]);
    let x = if first >= -SLACK { x.abs() } else { x };
    if angles.len() == 1 {
        return Some((0, 0, 0.0));
    }
    if x < first - SLACK || x > last + SLACK {
        return None;
    }
    let above = angles.partition_point(|&a| a <= x).clamp(1, angles.len() - 1);
    let fraction = (x - angles[above - 1]) / (angles[above] - angles[above - 1]);
    Some((above - 1, above, fraction.clamp(0.0, 1.0)))
}
