//! Straight ways from key to key.

use crate::{Affine3, Vec4};
use std::ops::{Add, Mul};

/// A moment between two keys that follow each other, and the parts that they have in it.
///
/// A blend is `a * parts[0] + b * parts[1]`, rounded at each step. Every step is monotone: what lies between others at both
/// keys lies between them at every moment, to the last bit. So boxes blended like this contain what is blended in them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    /// The earlier key; the later one follows it.
    pub key: usize,
    /// What they count, together 1.
    pub parts: [f32; 2],
}

impl Between {
    /// The moment `time`, from 0 to 1, among so many keys at equal distances; two at least.
    #[inline(always)]
    #[must_use]
    pub fn new(time: f32, keys: usize) -> Self {
        let segments = keys.max(2) - 1;
        // What is no number is the start.
        let along = if time > 0.0 { time.min(1.0) * segments as f32 } else { 0.0 };
        let key = (along as usize).min(segments - 1);
        let after = along - key as f32;
        Self { key, parts: [1.0 - after, after] }
    }

    /// What is `a` at the earlier key and `b` at the later one.
    #[inline(always)]
    #[must_use]
    pub fn blend<T: Mul<f32, Output = T> + Add<Output = T>>(&self, a: T, b: T) -> T {
        a * self.parts[0] + b * self.parts[1]
    }

    /// The two values of `keys` at this moment; none where there are too few.
    #[inline(always)]
    pub fn ends<'k, T>(&self, keys: &'k [T]) -> Option<[&'k T; 2]> {
        Some([keys.get(self.key)?, keys.get(self.key + 1)?])
    }

    /// A map whose elements are blended: every point goes straight on.
    #[inline(always)]
    #[must_use]
    pub fn map(&self, a: &Affine3, b: &Affine3) -> Affine3 {
        Affine3 {
            matrix3: self.blend(a.matrix3, b.matrix3),
            translation: self.blend(a.translation, b.translation),
        }
    }

    /// A tangent, whose sign stays that of the earlier key.
    #[inline]
    #[must_use]
    pub fn tangent(&self, a: Vec4, b: Vec4) -> Vec4 {
        self.blend(a.truncate(), b.truncate()).extend(a.w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    #[test]
    fn keys_are_met_exactly_and_times_outside_are_held() {
        let keys = [3.0_f32, -7.0, 1e20, 0.1, 5.0];
        let at = |time: f32| {
            let between = Between::new(time, keys.len());
            let [a, b] = between.ends(&keys).expect("keys");
            between.blend(*a, *b)
        };
        for (i, key) in keys.iter().enumerate() {
            assert_eq!(at(i as f32 / 4.0), *key);
        }
        assert_eq!([at(-1.0), at(2.0), at(f32::NAN)], [3.0, 5.0, 3.0]);
        assert_eq!(at(0.125), -2.0);
        assert_eq!(Between::new(0.5, 0), Between { key: 0, parts: [0.5, 0.5] });
    }

    #[test]
    fn blends_stay_between_blends() {
        let mut rng = Rng::new(5);
        for _ in 0..100_000 {
            let between = Between::new(rng.next_1d(), 2);
            let [a, b] = [rng.next_1d() * 2.0 - 1.0, rng.next_1d() * 1e3];
            let [low, high] = [a.min(rng.next_1d()), b.max(rng.next_1d() * 1e3)];
            assert!(between.blend(low, b) <= between.blend(a, b));
            assert!(between.blend(a, b) <= between.blend(a, high));
        }
    }
}
