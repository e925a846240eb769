//! The device's random numbers against the CPU's: the same bits.

use crate::common::{answers, probe};
use vastlight_math::rng::{hash_to_unit, hash_words};
use vastlight_math::{Rng, Sampler};

probe!(RANDOM_PROBE = "random_probe", 2);

/// Pixel, sample, seed and dimension: small ones as pictures have them, then any.
fn records() -> Vec<[u32; 5]> {
    let mut rng = Rng::new(3);
    let small = |i: u32| [i % 7, i / 7 % 5, i / 35 % 9, i % 3, i / 315];
    let mut any = |_| std::array::from_fn(|_| rng.next_u32());
    (0..20_000).map(small).chain((0..20_000).map(&mut any)).collect()
}

fn expected([x, y, sample, seed, dimension]: [u32; 5]) -> [u32; 5] {
    let key = hash_words(&[x, y, seed]);
    let point = Sampler::new([x, y], sample, seed).at_dimension(dimension).next_2d();
    let unit = hash_to_unit(&[x, sample, dimension]);
    [key as u32, (key >> 32) as u32, point.x.to_bits(), point.y.to_bits(), unit.to_bits()]
}

#[test]
fn random_numbers_are_those_of_the_cpu() {
    let records = records();
    let Some(found) = answers(&RANDOM_PROBE, &[records.as_flattened()], records.len(), 5) else { return };
    for (record, found) in records.into_iter().zip(found.chunks_exact(5)) {
        assert_eq!(found, expected(record), "{record:?}");
    }
}
