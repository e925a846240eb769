//! Files of sums: what is written comes back, damage is found, lies are not believed.

use super::header::{BYTES, Header, MAGIC};
use super::read::{body, front};
use super::write::to_writer;
use crate::{
    Accumulator, Aov, Cryptomatte, Film, FilmSettings, PixelSample, Recipe, SampleSet, Window, name_hash,
};
use std::ops::Range;
use vastlight_math::{Rng, Vec3, rng::hash_words};

const NAMES: [&str; 4] = ["chair", "table", "lamp", "стул"];

fn settings(aovs: &[Aov], tile_size: u32) -> FilmSettings {
    let window = Window { x0: 12, y0: 14, x1: 19, y1: 18 };
    FilmSettings { full_size: [40, 30], window, tile_size, aovs: aovs.to_vec(), squares: true }
}

/// Sums of the given samples: a sample is a function of its pixel and number.
fn sums_in(settings: FilmSettings, passes: &[Range<u32>]) -> Accumulator {
    let recipe = Recipe::default().with("seed", 1).with("scene", "0123");
    let mattes = [Film::OBJECT_LAYER, Film::MATERIAL_LAYER].map(|layer| Cryptomatte::new(layer, NAMES));
    let mut sums = Accumulator::new(settings, recipe, mattes.into());
    for pass in passes {
        sums.begin_pass(pass.clone());
        let waiting = sums.waiting();
        for (tile, parts) in sums.tiles_mut().iter_mut().zip(&waiting) {
            for part in parts {
                for (x, y) in (part.y0..part.y1).flat_map(|y| (part.x0..part.x1).map(move |x| (x, y))) {
                    pass.clone().for_each(|i| tile.add(x, y, &sample(x, y, i)));
                }
            }
        }
        waiting.iter().for_each(|parts| sums.note_done(parts));
        sums.counters.samples += 28 * pass.len() as u64;
        sums.counters.rays += 90 * pass.len() as u64;
        assert!(sums.end_pass());
    }
    sums
}

fn sums(passes: &[Range<u32>]) -> Accumulator {
    sums_in(settings(&Aov::ALL, 16), passes)
}

fn sample(x: u32, y: u32, number: u32) -> PixelSample {
    let mut random = Rng::new(hash_words(&[x, y, number]));
    let mut vector = || Vec3::new(random.next_1d(), random.next_1d(), random.next_1d());
    let (radiance, albedo, normal, position) = (vector() * 30.0, vector(), vector(), vector() * 99.0);
    let pick = |i: f32| name_hash(NAMES[(i * 4.0) as usize % 4]);
    let is_broken = x == 13 && number.is_multiple_of(7);
    PixelSample {
        radiance: if is_broken { Vec3::NAN } else { radiance },
        hit: albedo.x > 0.2,
        albedo,
        normal,
        depth: radiance.x,
        position,
        object: pick(normal.y),
        material: pick(albedo.z),
    }
}

fn bytes(sums: &Accumulator) -> Vec<u8> {
    let mut out = Vec::new();
    to_writer(&mut out, sums).expect("written");
    out
}

fn read(mut bytes: &[u8], tile_size: u32) -> std::io::Result<Accumulator> {
    let length = bytes.len() as u64;
    let (header, notes) = front(&mut bytes, length)?;
    body(&mut bytes, &header, notes, tile_size)
}

#[test]
fn what_is_written_comes_back_in_any_tiles() {
    for aovs in [&Aov::ALL[..], &[], &[Aov::Depth, Aov::Material]] {
        let written = sums_in(settings(aovs, 16), &[0..3, 8..12]);
        let file = bytes(&written);
        for tile_size in [16, 64] {
            let read = read(&file, tile_size).expect("read");
            assert!(bytes(&read) == file, "{aovs:?} in tiles of {tile_size}");
            assert!(read.develop().planes == written.develop().planes);
            assert_eq!(read.samples().to_string(), "1-3, 9-12");
            assert_eq!((&read.recipe, &read.mattes), (&written.recipe, &written.mattes));
            assert_eq!(
                (read.counters, read.film().non_finite()),
                (written.counters, written.film().non_finite())
            );
        }
    }
    assert!(sums(&[0..4, 4..8]).film().non_finite() > 0);
}

#[test]
fn a_pass_left_in_the_middle_goes_on_where_it_was() {
    let mut half = sums(std::slice::from_ref(&(0..2)));
    half.begin_pass(2..5);
    let waiting = half.waiting();
    let first = waiting[0].clone();
    for (x, y) in (first[0].y0..first[0].y1).flat_map(|y| (first[0].x0..first[0].x1).map(move |x| (x, y))) {
        (2..5).for_each(|i| half.tiles_mut()[0].add(x, y, &sample(x, y, i)));
    }
    half.note_done(&first);
    assert!(!half.end_pass());
    let read = read(&bytes(&half), 16).expect("read");
    assert_eq!(read.open_pass(), Some(2..5));
    let expected: Vec<_> = std::iter::once(Vec::new()).chain(waiting[1..].iter().cloned()).collect();
    assert_eq!(read.waiting(), expected);
    let whole = sums(&[0..2, 2..5]);
    assert!(whole.clone().merge(&half).expect_err("half").to_string().contains("middle"));
}

#[test]
fn every_bit_that_flips_is_noticed() {
    let file = bytes(&sums(std::slice::from_ref(&(0..2))));
    for bit in 0..8 * file.len() {
        let mut damaged = file.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(read(&damaged, 16).is_err(), "bit {bit}");
    }
    assert!(read(&file, 16).is_ok());
}

#[test]
fn every_truncation_and_addition_is_noticed() {
    let file = bytes(&sums(std::slice::from_ref(&(0..2))));
    for length in 0..file.len() {
        assert!(read(&file[..length], 16).is_err(), "{length} bytes");
        // As a file that is cut while it is read.
        let mut cut = &file[..length];
        let outcome =
            front(&mut cut, file.len() as u64).and_then(|(header, notes)| body(&mut cut, &header, notes, 16));
        assert!(outcome.is_err(), "{length} bytes");
    }
    assert!(read(&[&file[..], &[0]].concat(), 16).is_err());
}

/// A header with a right checksum.
fn forged(change: impl Fn(&mut Header)) -> Vec<u8> {
    let file = bytes(&sums(std::slice::from_ref(&(0..2))));
    let mut first = [0; BYTES];
    first.copy_from_slice(&file[..BYTES]);
    let mut header = Header::from_bytes(&first).expect("sound");
    change(&mut header);
    [&header.to_bytes()[..], &file[BYTES..]].concat()
}

#[test]
fn lies_with_right_checksums_are_not_believed() {
    assert!(read(&forged(|_| {}), 16).is_ok());
    let lies: [fn(&mut Header); 9] = [
        |h| h.window.x1 = u32::MAX,
        |h| (h.full_size, h.window) = ([u32::MAX; 2], Window::whole(u32::MAX, u32::MAX)),
        |h| h.planes |= 1 << 20,
        |h| h.notes_bytes = u32::MAX,
        |h| h.mattes_bytes = u64::MAX,
        |h| h.mattes_bytes -= 8,
        |h| h.open_pass = 1..4,
        |h| h.open_pass = 0..u32::MAX,
        |h| h.counters.rays = u64::MAX,
    ];
    for (i, lie) in lies.into_iter().enumerate() {
        assert!(read(&forged(lie), 16).is_err(), "lie {i}");
    }
    // A window as large as all numbers allow, in a file that says it is as long.
    let huge = forged(|h| (h.full_size, h.window) = ([1 << 30; 2], Window::whole(1 << 30, 1 << 8)));
    let mut input = &huge[..];
    let mut first = [0; BYTES];
    first.copy_from_slice(&huge[..BYTES]);
    let length = Header::from_bytes(&first).expect("sound").file_bytes().expect("a number");
    let outcome = front(&mut input, length).and_then(|(header, notes)| body(&mut input, &header, notes, 64));
    assert!(outcome.is_err());
}

#[test]
fn counts_beyond_the_samples_are_not_believed() {
    let mut lying = sums(std::slice::from_ref(&(0..2)));
    lying.film.tiles_mut()[0].samples[3] = 3;
    assert!(read(&bytes(&lying), 16).expect_err("counts").to_string().contains("counts"));
    let mut lying = sums(std::slice::from_ref(&(0..2)));
    lying.film.tiles_mut()[0].hits[0] = 9;
    assert!(read(&bytes(&lying), 16).expect_err("counts").to_string().contains("counts"));
}

#[test]
fn other_files_are_refused_in_words() {
    let message = |bytes: &[u8]| read(bytes, 16).expect_err("refused").to_string();
    assert!(message(b"").contains("ends early"));
    assert!(message(&[b'x'; 400]).contains("does not start"));
    let mut other = bytes(&sums(&[]));
    other[8] = 2;
    assert!(message(&other).contains("version 2"));
    assert_eq!(other[..8], MAGIC);
}

#[test]
fn parts_add_up_to_the_bytes_of_one_run() {
    let whole = bytes(&sums(std::slice::from_ref(&(0..24))));
    let parts = [0..5, 5..6, 6..20, 20..24].map(|part| sums(&[part]));
    for order in [[0, 1, 2, 3], [3, 1, 0, 2], [2, 3, 1, 0]] {
        let mut merged = parts[order[0]].clone();
        order[1..].iter().for_each(|&i| merged.merge(&parts[i]).expect("fits"));
        assert!(bytes(&merged) == whole, "{order:?}");
    }
    let mut pairs = parts[2].clone();
    pairs.merge(&parts[0]).expect("fits");
    let mut others = parts[3].clone();
    others.merge(&parts[1]).expect("fits");
    pairs.merge(&others).expect("fits");
    assert!(bytes(&pairs) == whole);
    let mut less = parts[0].clone();
    less.merge(&parts[2]).expect("fits");
    less.merge(&parts[3]).expect("fits");
    assert!(bytes(&less) != whole, "a part is missing");
}

#[test]
fn what_does_not_fit_is_not_merged() {
    let refusal = |a: &Accumulator, b: &Accumulator| a.clone().merge(b).expect_err("refused").to_string();
    let first = sums(std::slice::from_ref(&(0..8)));
    assert!(refusal(&first, &sums(std::slice::from_ref(&(4..12)))).contains("passes 5-8"));
    let mut other = sums(std::slice::from_ref(&(8..12)));
    other.recipe = Recipe::default().with("seed", 2).with("scene", "0123");
    assert!(refusal(&first, &other).contains("seed (1 and 2)"));
    let mut many = first.clone();
    many.samples = SampleSet::from(8..SampleSet::MOST + 1);
    assert!(refusal(&first, &many).contains("more than"));
    let mut quiet = sums(std::slice::from_ref(&(8..24)));
    quiet.stop_quiet(1e9);
    assert!(refusal(&first, &quiet).contains("noise"));
}
