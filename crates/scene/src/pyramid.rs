//! Mip pyramids: an image at half the size, again and again (L. Williams 1983, "Pyramidal parametrics").
//!
//! A level is the exact mean over areas of the one before it: two texels wide, or 2 + 1/k where 2k + 1 texels become k
//! (S. Guthe, P. Heckbert 2005, "Non-power-of-two mipmap creation"). Sums are linear; colours are weighted by alpha; normals
//! are made unit again when they are stored. What is handed on from level to level is not rounded. Rows come one after the other,
//! so that no more than three rows of each level are in memory.

use crate::{Encoding, Image, TexelReader, Texels};
use std::collections::VecDeque;
use vastlight_math::{Vec3, Vec4};

/// What the numbers of an image are, which decides how they are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Content {
    /// Colours, sRGB-encoded, with alpha if there are two or four channels.
    Color = 0,
    /// Numbers.
    Data = 1,
    /// Unit vectors, -1..1 as 0..1.
    Normals = 2,
}

impl Content {
    /// The content of this number.
    #[must_use]
    pub fn from_number(number: u32) -> Option<Self> {
        [Self::Color, Self::Data, Self::Normals].into_iter().find(|&content| content as u32 == number)
    }

    /// How the numbers are stored.
    #[must_use]
    pub fn encoding(self) -> Encoding {
        match self {
            Self::Color => Encoding::Srgb,
            Self::Data | Self::Normals => Encoding::Linear,
        }
    }
}

/// Width and height of all levels, the image itself first and one texel last.
#[must_use]
pub fn level_sizes(width: u32, height: u32) -> Vec<[u32; 2]> {
    let mut size = [width.max(1), height.max(1)];
    let mut sizes = vec![size];
    while size != [1, 1] {
        size = size.map(|n| (n / 2).max(1));
        sizes.push(size);
    }
    sizes
}

/// The levels of `image` above itself, each stored like it. None for an image that does not have all of its texels.
#[must_use]
pub fn pyramid(image: &Image, content: Content) -> Vec<Image> {
    let channels = image.channels.clamp(1, 4);
    let row = image.width as usize * usize::from(channels);
    if row == 0 || image.height == 0 || image.texels.len() < row * image.height as usize {
        return Vec::new();
    }
    let level = |[width, height]: [u32; 2]| {
        let texels = image.texels.none_like();
        Image { name: String::new(), width, height, channels, texels }
    };
    let mut levels: Vec<Image> =
        level_sizes(image.width, image.height).into_iter().skip(1).map(level).collect();
    let mut rows = PyramidRows::new(image.width, image.height, channels, content);
    let mut texels = image.texels.none_like();
    for y in 0..image.height as usize {
        texels.clear();
        texels.append(&image.texels, y * row..(y + 1) * row);
        rows.push(&texels, |number, row| levels[number - 1].texels.append(row, 0..row.len()));
    }
    levels
}

/// The levels of a pyramid from the rows of its image.
#[derive(Debug)]
pub struct PyramidRows {
    channels: u8,
    content: Content,
    /// Steps from a level to the next.
    steps: Vec<Step>,
}

impl PyramidRows {
    /// The pyramid of an image of this size.
    #[must_use]
    pub fn new(width: u32, height: u32, channels: u8, content: Content) -> Self {
        let sizes = level_sizes(width, height);
        let steps = sizes.windows(2).map(|pair| Step::new(pair[0], pair[1])).collect();
        Self { channels: channels.clamp(1, 4), content, steps }
    }

    /// Takes the image's next row. `each` is told the number of a level (1 and up) and its next row, stored like `row`.
    pub fn push(&mut self, row: &Texels, mut each: impl FnMut(usize, &Texels)) {
        let carry = self.carry();
        let reader = TexelReader::new(self.content.encoding());
        let count = row.len() / usize::from(self.channels);
        let linear = (0..count).map(|i| carry.enter(reader.read(row, self.channels, i)));
        let mut waiting = vec![(0, linear.collect::<Vec<Vec4>>())];
        while let Some((level, values)) = waiting.pop() {
            if level > 0 {
                let mut texels = row.none_like();
                for &value in &values {
                    texels.push(self.channels, self.content.encoding(), carry.leave(value));
                }
                each(level, &texels);
            }
            if let Some(next) = self.steps.get_mut(level).and_then(|step| step.push(&values)) {
                waiting.push((level + 1, next));
            }
        }
    }

    fn carry(&self) -> Carry {
        match (self.content, self.channels) {
            (Content::Color, 2 | 4) => Carry::Weighted,
            (Content::Normals, _) => Carry::Normals,
            _ => Carry::Plain,
        }
    }
}

/// How texels are summed.
#[derive(Clone, Copy, Debug)]
enum Carry {
    Plain,
    /// Colours times alpha.
    Weighted,
    /// Vectors.
    Normals,
}

/// What a colour without any alpha weighs: so little that it counts only where all are such.
const LEAST_WEIGHT: f32 = 1.0 / 65_536.0;

impl Carry {
    #[inline]
    fn enter(self, value: Vec4) -> Vec4 {
        match self {
            Self::Plain => value,
            Self::Weighted => (value.truncate() * (value.w + LEAST_WEIGHT)).extend(value.w),
            Self::Normals => (value.truncate() * 2.0 - 1.0).extend(value.w),
        }
    }

    #[inline]
    fn leave(self, sum: Vec4) -> Vec4 {
        match self {
            Self::Plain => sum,
            Self::Weighted => (sum.truncate() / (sum.w + LEAST_WEIGHT)).extend(sum.w),
            Self::Normals => ((sum.truncate().normalize_or(Vec3::Z) + 1.0) * 0.5).extend(sum.w),
        }
    }
}

/// From a level to the next.
#[derive(Debug)]
struct Step {
    from: [u32; 2],
    to: [u32; 2],
    /// Rows that are averaged along themselves, the first of them, and the next that comes out.
    rows: VecDeque<Vec<Vec4>>,
    first: u32,
    next: u32,
}

impl Step {
    fn new(from: [u32; 2], to: [u32; 2]) -> Self {
        Self { from, to, rows: VecDeque::new(), first: 0, next: 0 }
    }

    /// Takes a row; gives the next row of the next level if it is complete.
    fn push(&mut self, row: &[Vec4]) -> Option<Vec<Vec4>> {
        self.rows.push_back(averaged(row, self.from[0], self.to[0]));
        let taps = taps(self.next, self.from[1], self.to[1]);
        if self.next >= self.to[1] || self.first + (self.rows.len() as u32) < 2 * self.next + taps.count {
            return None;
        }
        let row = |i: u32| self.rows.get((2 * self.next + i - self.first) as usize);
        let rows: Vec<&Vec<Vec4>> = (0..taps.count).filter_map(row).collect();
        let out = (0..self.to[0] as usize).map(|x| {
            let weighted = rows.iter().zip(taps.weights).map(|(row, weight)| row[x] * weight);
            weighted.reduce(|sum, v| sum + v).unwrap_or(Vec4::ZERO)
        });
        let out = out.collect();
        self.next += 1;
        while self.first < 2 * self.next && self.rows.pop_front().is_some() {
            self.first += 1;
        }
        Some(out)
    }
}

/// A row at the next level's width.
fn averaged(row: &[Vec4], from: u32, to: u32) -> Vec<Vec4> {
    (0..to)
        .map(|x| {
            let Taps { count, weights } = taps(x, from, to);
            let texels = row.get(2 * x as usize..).unwrap_or_default().iter().take(count as usize);
            let weighted = texels.zip(weights).map(|(&v, weight)| v * weight);
            weighted.reduce(|sum, v| sum + v).unwrap_or(Vec4::ZERO)
        })
        .collect()
}

/// The texels that one of the next level is the mean of, from twice its number on, and their shares.
struct Taps {
    count: u32,
    weights: [f32; 3],
}

#[inline]
fn taps(to: u32, from_size: u32, to_size: u32) -> Taps {
    if from_size == 1 {
        return Taps { count: 1, weights: [1.0, 0.0, 0.0] };
    }
    if from_size == 2 * to_size {
        return Taps { count: 2, weights: [0.5, 0.5, 0.0] };
    }
    let share = |part: u32| part as f32 / from_size as f32;
    Taps { count: 3, weights: [share(to_size - to), share(to_size), share(to + 1)] }
}

#[cfg(test)]
mod tests;
