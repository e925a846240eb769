//! Error figures between two pictures.

use crate::{FilmError, Picture};

/// How two pictures differ, over all pixels and the three colour channels, in linear values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Mean of (a-b)^2.
    pub mse: f64,
    /// Mean of (a-b)^2 / (b^2 + 0.01).
    pub relmse: f64,
    /// Peak signal-to-noise ratio in dB for a peak of 1; infinite for equal pictures.
    pub psnr: f64,
    /// Largest |a-b|.
    pub max: f64,
    /// Mean of a over mean of b; 1 if both are 0.
    pub mean_ratio: f64,
    /// Values that are not finite in one of the two; they are left out of everything else.
    pub non_finite: u64,
}

/// Compares `a` with the reference `b`.
///
/// # Errors
/// If one has no colour channels, or their sizes differ.
pub fn compare(a: &Picture, b: &Picture) -> Result<Figures, FilmError> {
    let mut sums = Sums::default();
    for (a, b) in colour_planes(a, b)? {
        a.iter().zip(b).for_each(|(&a, &b)| sums.add(f64::from(a), f64::from(b)));
    }
    Ok(sums.figures())
}

/// |a - b| per colour channel.
///
/// # Errors
/// As [`compare`].
pub fn difference(a: &Picture, b: &Picture) -> Result<Picture, FilmError> {
    let [width, height] = a.size();
    let planes = colour_planes(a, b)?.map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()).collect());
    Ok(Picture::from_rgb(width, height, planes))
}

type PlanePair<'a> = (&'a [f32], &'a [f32]);

/// The channels R, G and B of both.
fn colour_planes<'a>(a: &'a Picture, b: &'a Picture) -> Result<[PlanePair<'a>; 3], FilmError> {
    if a.size() != b.size() {
        let [[aw, ah], [bw, bh]] = [a.size(), b.size()];
        return Err(FilmError::mismatch(format!("one is {aw} x {ah} pixels, the other {bw} x {bh}")));
    }
    let no_colour = || FilmError::mismatch("one has no channels R, G and B");
    let ([ar, ag, ab], [br, bg, bb]) = a.rgb().zip(b.rgb()).ok_or_else(no_colour)?;
    Ok([(ar, br), (ag, bg), (ab, bb)])
}

#[derive(Default)]
struct Sums {
    count: u64,
    squares: f64,
    relative: f64,
    max: f64,
    a: f64,
    b: f64,
    non_finite: u64,
}

impl Sums {
    fn add(&mut self, a: f64, b: f64) {
        if !(a.is_finite() && b.is_finite()) {
            self.non_finite += 1;
            return;
        }
        let square = (a - b) * (a - b);
        self.count += 1;
        self.squares += square;
        self.relative += square / (b * b + 0.01);
        self.max = self.max.max((a - b).abs());
        self.a += a;
        self.b += b;
    }

    fn figures(&self) -> Figures {
        let n = self.count.max(1) as f64;
        let mse = self.squares / n;
        Figures {
            mse,
            relmse: self.relative / n,
            psnr: if mse > 0.0 { -10.0 * mse.log10() } else { f64::INFINITY },
            max: self.max,
            mean_ratio: if self.a == self.b { 1.0 } else { self.a / self.b },
            non_finite: self.non_finite,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32) -> Picture {
        Picture::from_rgb(4, 2, [vec![value; 8], vec![value; 8], vec![value; 8]])
    }

    #[test]
    fn figures_by_hand() {
        let figures = compare(&flat(0.75), &flat(0.5)).expect("same size");
        assert_eq!(figures.mse, 0.0625);
        assert!((figures.relmse - 0.0625 / 0.26).abs() < 1e-12);
        assert!((figures.psnr - 12.041_199_8).abs() < 1e-6);
        assert_eq!((figures.max, figures.mean_ratio), (0.25, 1.5));
        assert_eq!(difference(&flat(0.75), &flat(0.5)).expect("same size").planes[2].values, vec![0.25; 8]);
    }

    #[test]
    fn equal_pictures_differ_in_nothing_and_one_value_shows() {
        let a = flat(0.3);
        let figures = compare(&a, &a).expect("same");
        assert_eq!((figures.mse, figures.max, figures.mean_ratio), (0.0, 0.0, 1.0));
        assert_eq!(figures.psnr, f64::INFINITY);
        let mut b = flat(0.3);
        b.planes[1].values[3] += 1e-3;
        assert!(compare(&b, &a).expect("same size").mse > 0.0);
        b.planes[1].values[3] = f32::NAN;
        assert_eq!(compare(&b, &a).expect("same size").non_finite, 1);
    }

    #[test]
    fn sizes_must_agree() {
        let small = Picture::from_rgb(1, 1, [vec![0.0], vec![0.0], vec![0.0]]);
        assert!(compare(&small, &flat(0.0)).is_err());
    }
}
