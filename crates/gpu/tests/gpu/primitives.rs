//! Primitives on the software adapter against their counterparts on the CPU: sizes around those of workgroups, adversarial
//! keys, poisoned buffers, and a negative control.

use crate::common::{POISON, software};
use vastlight_accel::sort::{key, pair, payload, radix_sort};
use vastlight_gpu::primitives::reduce::Operation;
use vastlight_gpu::primitives::{bitonic, compact, histogram, queue, radix, reduce, runs, scan};
use vastlight_gpu::{Executor, Recording};
use vastlight_math::rng::hash_words;

/// Nothing, one, and around multiples of a subgroup, a workgroup, a tile, and a tile of tiles' worth of rest.
const SIZES: [usize; 16] = [0, 1, 2, 7, 8, 9, 255, 256, 257, 2047, 2048, 2049, 4095, 4096, 4097, 100_003];

/// 32 bits that look random.
fn random(i: u32, seed: u32) -> u32 {
    (hash_words(&[i, seed]) >> 32) as u32
}

/// Arrays of `n` keys that are hard in one way each.
fn adversarial(n: usize) -> Vec<(&'static str, Vec<u32>)> {
    let of = |f: fn(u32, u32) -> u32| (0..n as u32).map(|i| f(i, n as u32)).collect::<Vec<u32>>();
    vec![
        ("random", of(|i, _| random(i, 1))),
        ("all equal", of(|_, _| 0x1234_5678)),
        ("all greatest", of(|_, _| u32::MAX)),
        ("sorted", of(|i, _| i * 3)),
        ("reversed", of(|i, n| n - i)),
        ("extremes", of(|i, _| if random(i, 2).is_multiple_of(2) { 0 } else { u32::MAX })),
        ("few", of(|i, _| (random(i, 3) % 3) << 30)),
        ("runs", of(|i, _| random(i / 8, 4))),
    ]
}

/// All sizes with random keys, and some with hard ones.
fn cases() -> Vec<(String, Vec<u32>)> {
    let mut cases: Vec<(String, Vec<u32>)> = Vec::new();
    for n in SIZES {
        let hard = if n == 2049 || n == 4096 { adversarial(n) } else { adversarial(n)[..1].to_vec() };
        cases.extend(hard.into_iter().map(|(name, keys)| (format!("{n} {name}"), keys)));
    }
    cases
}

#[test]
fn reduce_is_that_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (name, values) in cases() {
        for operation in [Operation::Add, Operation::Min, Operation::Max] {
            let mut recording = Recording::new();
            let input = recording.upload("values", &values);
            let result = reduce::record(&mut recording, input, values.len() as u32, operation).expect("few");
            let result = recording.download(result, 1);
            let result = executor.run(&recording).expect("runs").words(result);
            assert_eq!(result, [reduce::reduce(&values, operation)], "{name} {operation:?}");
        }
    }
}

fn gpu_scan(executor: &mut Executor, values: &[u32]) -> Vec<u32> {
    let mut recording = Recording::new();
    let input = recording.upload("values", values);
    let sums = scan::record(&mut recording, input, values.len() as u32).expect("few");
    let sums = recording.download(sums, values.len() as u64 + 1);
    executor.run(&recording).expect("runs").words(sums)
}

#[test]
fn exclusive_scan_is_that_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (name, values) in cases() {
        assert!(gpu_scan(&mut executor, &values) == scan::exclusive_scan(&values), "{name}");
    }
}

#[test]
fn a_word_that_differs_is_found() {
    let Some(mut executor) = software() else { return };
    let values: Vec<u32> = (0..5000).map(|i| random(i, 9)).collect();
    let mut wrong = values.clone();
    wrong[4321] ^= 1;
    assert!(gpu_scan(&mut executor, &wrong) != scan::exclusive_scan(&values));
    // Poison shows where nothing was written.
    let mut recording = Recording::new();
    let unwritten = recording.buffer("unwritten", 100);
    let unwritten = recording.download(unwritten, 100);
    assert_eq!(executor.run(&recording).expect("runs").words(unwritten), [POISON; 100]);
}

#[test]
fn compact_is_that_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (name, values) in cases() {
        for (density, mask) in [("none", 0), ("some", 1), ("few", 1 << 13), ("all", u32::MAX)] {
            let flag = |i| if mask == u32::MAX { 7 } else { random(i, 5) & mask };
            let flags: Vec<u32> = (0..values.len() as u32).map(flag).collect();
            let mut recording = Recording::new();
            let (flag_buffer, input) =
                (recording.upload("flags", &flags), recording.upload("values", &values));
            let n = values.len() as u32;
            let kept = compact::record(&mut recording, flag_buffer, input, n).expect("few");
            let (count, kept) = (recording.download(kept.count, 1), recording.download(kept.kept, n.into()));
            let results = executor.run(&recording).expect("runs");
            let expected = compact::compact(&flags, &values);
            assert_eq!(results.words(count), [expected.len() as u32], "{name} {density}");
            assert!(results.words(kept)[..expected.len()] == expected, "{name} {density}");
        }
    }
}

#[test]
fn runs_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (name, keys) in cases() {
        for shift in [0, 15, 31] {
            let (mut recording, n) = (Recording::new(), keys.len() as u64);
            let input = recording.upload("keys", &keys);
            let encoded = runs::record(&mut recording, input, keys.len() as u32, shift).expect("few");
            let count = recording.download(encoded.count, 1);
            let (heads, starts) =
                (recording.download(encoded.keys, n), recording.download(encoded.starts, n + 1));
            let results = executor.run(&recording).expect("runs");
            let (expected_keys, expected_starts) = runs::runs(&keys, shift);
            assert_eq!(results.words(count), [expected_keys.len() as u32], "{name} {shift}");
            assert!(results.words(heads)[..expected_keys.len()] == expected_keys, "{name} {shift}");
            assert!(results.words(starts)[..expected_starts.len()] == expected_starts, "{name} {shift}");
        }
    }
}

#[test]
fn histograms_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (name, keys) in cases() {
        for (shift, bits) in [(0, 8), (22, 10), (31, 1), (5, 0)] {
            let mut recording = Recording::new();
            let input = recording.upload("keys", &keys);
            let counts =
                histogram::record(&mut recording, input, keys.len() as u32, shift, bits).expect("few");
            let counts = recording.download(counts, 1 << bits);
            let counts = executor.run(&recording).expect("runs").words(counts);
            assert!(counts == histogram::histogram(&keys, shift, bits), "{name} {shift} {bits}");
        }
    }
}

/// The keys and payloads, sorted by the CPU.
fn sorted(keys: &[u32], key_bits: u32) -> (Vec<u32>, Vec<u32>) {
    let mask = u32::MAX.checked_shr(32 - key_bits).unwrap_or(0);
    let mut pairs: Vec<u64> = (0..).zip(keys).map(|(i, key)| pair(key & mask, i)).collect();
    let mut spare = vec![0; pairs.len()];
    let pairs = radix_sort(&mut pairs, &mut spare, key_bits);
    let payloads: Vec<u32> = pairs.iter().map(|&pair| payload(pair)).collect();
    assert!(pairs.is_sorted_by_key(|&pair| key(pair)));
    (payloads.iter().map(|&i| keys[i as usize]).collect(), payloads)
}

fn gpu_sort(
    executor: &mut Executor,
    keys: &[u32],
    key_bits: u32,
    with_payloads: bool,
) -> (Vec<u32>, Vec<u32>) {
    let (mut recording, n) = (Recording::new(), keys.len() as u32);
    let payloads: Vec<u32> = (0..n).collect();
    let input = radix::Pairs {
        keys: recording.upload("keys", keys),
        payloads: with_payloads.then(|| recording.upload("payloads", &payloads)),
    };
    let output = radix::record(&mut recording, input, n, key_bits).expect("few");
    let keys = recording.download(output.keys, n.into());
    let payloads = output.payloads.map(|buffer| recording.download(buffer, n.into()));
    let results = executor.run(&recording).expect("runs");
    (results.words(keys), payloads.map(|payloads| results.words(payloads)).unwrap_or_default())
}

#[test]
fn radix_sort_is_that_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (name, keys) in cases() {
        let expected = sorted(&keys, 32);
        assert!(gpu_sort(&mut executor, &keys, 32, true) == expected, "{name}");
        assert!(gpu_sort(&mut executor, &keys, 32, false).0 == expected.0, "{name}, keys alone");
    }
}

#[test]
fn radix_sort_looks_at_the_bits_it_is_told() {
    let Some(mut executor) = software() else { return };
    let keys: Vec<u32> = (0..5000).map(|i| random(i, 6)).collect();
    assert_eq!(gpu_sort(&mut executor, &keys, 0, true).0, keys);
    for key_bits in [8, 16, 24] {
        assert!(gpu_sort(&mut executor, &keys, key_bits, true) == sorted(&keys, key_bits), "{key_bits}");
    }
    let small: Vec<u32> = keys.iter().map(|key| key >> 19).collect();
    assert!(gpu_sort(&mut executor, &small, 13, true) == sorted(&small, 13));
    assert!(gpu_sort(&mut executor, &keys, 13, true) == sorted(&keys, 16), "whole digits");
}

#[test]
fn a_million_keys() {
    let Some(mut executor) = software() else { return };
    let keys: Vec<u32> = (0..1_000_000).map(|i| random(i, 7)).collect();
    assert!(gpu_sort(&mut executor, &keys, 32, true) == sorted(&keys, 32));
    assert!(gpu_scan(&mut executor, &keys) == scan::exclusive_scan(&keys));
}

#[test]
fn a_scan_of_tiles_of_tiles() {
    let Some(mut executor) = software() else { return };
    let values: Vec<u32> = (0..2048 * 2048 + 5).map(|i| random(i, 8)).collect();
    assert!(gpu_scan(&mut executor, &values) == scan::exclusive_scan(&values));
}

/// Stretches that follow each other, of these lengths.
fn stretches(lengths: &[u32]) -> Vec<[u32; 2]> {
    let starts = scan::exclusive_scan(lengths);
    starts.iter().zip(lengths).map(|(start, length)| [*start, *length]).collect()
}

#[test]
fn bitonic_sorts_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    let stretches = stretches(&[0, 1, 2, 3, 7, 255, 256, 257, 511, 512, 1000, 1023, 1024, 5, 0, 1024]);
    let n = stretches.iter().map(|stretch| stretch[1]).sum::<u32>();
    for (name, mut keys) in adversarial(n as usize) {
        let mut payloads: Vec<u32> = (0..n).map(|i| random(i, 11)).collect();
        let mut recording = Recording::new();
        let inputs = (recording.upload("keys", &keys), recording.upload("payloads", &payloads));
        let sorted = bitonic::record(&mut recording, &stretches, inputs.0, inputs.1, n).expect("short");
        assert_eq!(recording.dispatches(), 1);
        let gpu_keys = recording.download(sorted.keys, n.into());
        let gpu_payloads = sorted.payloads.map(|payloads| recording.download(payloads, n.into()));
        let results = executor.run(&recording).expect("runs");
        bitonic::bitonic(&stretches, &mut keys, &mut payloads).expect("short");
        assert!(results.words(gpu_keys) == keys, "{name}");
        assert!(gpu_payloads.map(|payloads| results.words(payloads)) == Some(payloads), "{name}");
    }
}

#[test]
fn stretches_that_do_not_fit_are_refused() {
    let mut recording = Recording::new();
    let buffer = recording.buffer("keys", 4096);
    for stretch in [[0, 1025], [4000, 97], [u32::MAX, 2]] {
        assert!(bitonic::record(&mut recording, &[stretch], buffer, buffer, 4096).is_err(), "{stretch:?}");
        assert!(bitonic::bitonic(&[stretch], &mut [0; 4096], &mut [0; 4096]).is_err(), "{stretch:?}");
    }
}

/// The leaves that queues of this capacity give, sorted, and how many there were to be.
fn gpu_leaves(executor: &mut Executor, count: u32, leaf: u32, capacity: u32) -> (Vec<[u32; 2]>, u32) {
    let mut recording = Recording::new();
    let leaves = queue::record(&mut recording, count, leaf, capacity).expect("few");
    let (tails, ranges) =
        (recording.download(leaves.tails, 3), recording.download(leaves.ranges, 2 * u64::from(capacity)));
    let results = executor.run(&recording).expect("runs");
    let wanted = results.words(tails)[2];
    let words = results.words(ranges);
    let mut leaves: Vec<[u32; 2]> =
        words.chunks_exact(2).take(wanted.min(capacity) as usize).map(|pair| [pair[0], pair[1]]).collect();
    leaves.sort_unstable();
    (leaves, wanted)
}

#[test]
fn queues_give_the_leaves_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for (count, leaf) in
        [(0, 1), (1, 1), (2, 1), (3, 1), (255, 1), (256, 4), (1000, 3), (30_000, 2), (30_000, 29_999)]
    {
        let expected = queue::split_ranges(count, leaf);
        let (leaves, wanted) = gpu_leaves(&mut executor, count, leaf, 1 << 15);
        assert_eq!(wanted as usize, expected.len(), "{count} {leaf}");
        assert!(leaves == expected, "{count} {leaf}");
    }
}

#[test]
fn queues_that_overflow_drop_entries_and_say_how_many_there_were() {
    let Some(mut executor) = software() else { return };
    let (leaves, wanted) = gpu_leaves(&mut executor, 1024, 512, 1);
    assert_eq!((leaves, wanted), (vec![[0, 512]], 1), "one half is lost");
    let (leaves, wanted) = gpu_leaves(&mut executor, 3, 1, 2);
    assert_eq!((leaves, wanted), (vec![[0, 1], [1, 2]], 3), "the last leaf is lost");
    let (leaves, wanted) = gpu_leaves(&mut executor, 1024, 128, 6);
    let all = queue::split_ranges(1024, 128);
    assert!(leaves.iter().all(|leaf| all.contains(leaf)), "{leaves:?}");
    assert_eq!((leaves.len(), wanted), (6, 6), "two of eight were lost with their queue");
}
