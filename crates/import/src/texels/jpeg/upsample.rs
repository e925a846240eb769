//! Samples of a component that are fewer than texels, to texels: a triangle filter where there are half as many, with the rounding of
//! the Independent JPEG Group's library ("fancy upsampling"); else the nearest sample.

use zune_jpeg::PlaneInfo;

/// How the samples of a component become texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Filter {
    kind: Kind,
    /// Sampling factors of the component and of the image, across and down.
    across: [usize; 2],
    down: [usize; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A sample is a texel.
    Same,
    /// The nearest sample.
    Nearest,
    /// Twice as many texels across.
    Across,
    /// Twice as many down.
    Down,
    /// Twice as many in both directions.
    Both,
}

impl Filter {
    /// For a component of an image with these largest sampling factors, across and down.
    pub(super) fn new(info: &PlaneInfo, most: [usize; 2]) -> Self {
        let across = [info.horizontal_sampling_factor, most[0]];
        let down = [info.vertical_sampling_factor, most[1]];
        let (same, twice) = (|[n, of]: [usize; 2]| n == of, |[n, of]: [usize; 2]| 2 * n == of);
        // The library leaves narrow ones to the nearest.
        let wide = info.width > 2;
        let kind = match () {
            () if same(across) && same(down) => Kind::Same,
            () if twice(across) && same(down) && wide => Kind::Across,
            () if same(across) && twice(down) => Kind::Down,
            () if twice(across) && twice(down) && wide => Kind::Both,
            () => Kind::Nearest,
        };
        Self { kind, across, down }
    }

    /// The same without a filter.
    #[cfg(test)]
    pub(super) fn nearest(self) -> Self {
        Self { kind: Kind::Nearest, ..self }
    }

    /// The rows of samples that the row of texels `y` is made from, of `height` rows: the nearest, and the one on the other side.
    pub(super) fn rows(&self, y: usize, height: usize) -> [usize; 2] {
        let last = height.saturating_sub(1);
        let near = (y * self.down[0] / self.down[1]).min(last);
        match self.kind {
            Kind::Down | Kind::Both if y.is_multiple_of(2) => [near, near.saturating_sub(1)],
            Kind::Down | Kind::Both => [near, (near + 1).min(last)],
            Kind::Same | Kind::Nearest | Kind::Across => [near, near],
        }
    }

    /// Makes the row of texels `y` from its rows of samples.
    pub(super) fn apply(&self, [near, far]: [&[u8]; 2], y: usize, out: &mut [u8]) {
        let (near_of, three) =
            (|x: usize| u32::from(near[x]), |x: usize| 3 * u32::from(near[x]) + u32::from(far[x]));
        match self.kind {
            Kind::Same => out.copy_from_slice(near),
            Kind::Nearest => {
                let [n, of] = self.across;
                let last = near.len() - 1;
                out.iter_mut().enumerate().for_each(|(x, out)| *out = near[(x * n / of).min(last)]);
            }
            Kind::Down => {
                let bias = if y.is_multiple_of(2) { 1 } else { 2 };
                out.iter_mut().enumerate().for_each(|(x, out)| *out = ((three(x) + bias) >> 2) as u8);
            }
            Kind::Across => twice_across(near.len(), near_of, [1, 2], 2, out),
            Kind::Both => twice_across(near.len(), three, [8, 7], 4, out),
        }
    }
}

/// Twice as many numbers: of each three parts, and one of its neighbour; `bias` is that of the left and of the right one, divided by
/// two to the power of `shift`. What is at an edge is its own neighbour.
fn twice_across(count: usize, of: impl Fn(usize) -> u32, bias: [u32; 2], shift: u32, out: &mut [u8]) {
    let mix = |x: usize, other: usize, bias: u32| ((3 * of(x) + of(other) + bias) >> shift) as u8;
    let (pairs, odd) = out.as_chunks_mut::<2>();
    for (x, pair) in pairs.iter_mut().enumerate() {
        *pair = [mix(x, x.saturating_sub(1), bias[0]), mix(x, (x + 1).min(count - 1), bias[1])];
    }
    if let [last] = odd {
        *last = mix(count - 1, count.saturating_sub(2), bias[0]);
    }
}
