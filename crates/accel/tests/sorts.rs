//! Sorts give what the standard library's stable sort gives.

use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use vastlight_accel::sort::{Pair, compressed_radix_sort, key, pair, payload, radix_sort};

fn noise(i: u32) -> u32 {
    let x = (u64::from(i) + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((x ^ x >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 32) as u32
}

/// Named keys of many lengths, with the bits that they have.
fn inputs() -> Vec<(&'static str, u32, Vec<Pair>)> {
    let pairs = |n: u32, f: &dyn Fn(u32) -> u32| (0..n).map(|i| pair(f(i), i)).collect::<Vec<_>>();
    vec![
        ("none", 32, vec![]),
        ("one", 32, pairs(1, &noise)),
        ("few", 32, pairs(100, &noise)),
        ("many", 32, pairs(200_000, &noise)),
        ("30 bits", 30, pairs(70_001, &|i| noise(i) >> 2)),
        ("1 bit", 1, pairs(40_000, &|i| noise(i) >> 31)),
        ("no bits", 0, pairs(40_000, &|_| 0)),
        ("equal", 32, pairs(50_000, &|_| 0x8000_0001)),
        ("falling", 32, pairs(65_536, &|i| u32::MAX - i)),
        ("rising", 32, pairs(65_537, &|i| i)),
        ("runs", 32, pairs(100_000, &|i| noise(i / 37))),
        ("two values", 32, pairs(33_000, &|i| if noise(i) < 1 << 30 { 0 } else { u32::MAX })),
    ]
}

type Sort = for<'a> fn(&'a mut [Pair], &'a mut [Pair], u32) -> &'a mut [Pair];
const SORTS: [(&str, Sort); 2] = [("radix", radix_sort), ("compressed", compressed_radix_sort)];

#[test]
fn sorts_are_stable_and_do_not_depend_on_threads() {
    for (input, bits, pairs) in inputs() {
        let mut expected = pairs.clone();
        expected.sort_by_key(|&p| key(p));
        for (name, sort) in SORTS {
            for threads in [1, 2, 5] {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                let (mut own, mut spare) = (pairs.clone(), vec![7; pairs.len()]);
                let sorted = pool.install(|| sort(&mut own, &mut spare, bits));
                assert!(sorted == expected, "{name}, {input}, {threads} threads");
            }
        }
    }
}

#[test]
fn an_unstable_order_would_be_noticed() {
    let mut falling: Vec<Pair> = (0..1000).rev().map(|i| pair(i / 10, i)).collect();
    let by_pair = {
        let mut sorted = falling.clone();
        sorted.sort_unstable();
        sorted
    };
    let mut spare = vec![0; falling.len()];
    let sorted = radix_sort(&mut falling, &mut spare, 32);
    assert_ne!(sorted, by_pair, "equal keys keep the order that they came in");
    assert!(sorted.windows(2).all(|w| key(w[0]) <= key(w[1])));
    assert_eq!(payload(sorted[0]), 9);
}

proptest! {
    #[test]
    fn any_keys_are_sorted(keys in prop::collection::vec(any::<u32>(), 0..3000), mask in any::<u32>()) {
        let pairs: Vec<Pair> = (0..).zip(&keys).map(|(i, &k)| pair(k & mask, i)).collect();
        let mut expected = pairs.clone();
        expected.sort_by_key(|&p| key(p));
        for (_, sort) in SORTS {
            let (mut own, mut spare) = (pairs.clone(), vec![7; pairs.len()]);
            prop_assert_eq!(sort(&mut own, &mut spare, 32), &expected);
        }
    }
}
