//! Every operation against plain f32 arithmetic, at every level of the machine.

use vastlight_simd::{Kernel, Level, Simd8, WINDOW, Words};

/// All results of one pair of vectors, as bits.
#[derive(Debug, PartialEq)]
struct Results {
    values: Vec<[u32; 8]>,
    masks: Vec<u32>,
    mul_sub: [f32; 8],
}

struct AllOperations {
    a: [f32; 8],
    b: [f32; 8],
}

impl Kernel for AllOperations {
    type Output = Results;

    #[inline(always)]
    fn run<S: Simd8>(self, s: S) -> Results {
        let (a, b) = (s.load(&self.a), s.load(&self.b));
        let values = [
            s.splat(self.a[3]),
            s.add(a, b),
            s.sub(a, b),
            s.mul(a, b),
            s.div(a, b),
            s.min(a, b),
            s.max(a, b),
            s.sqrt(a),
            s.abs(a),
            s.copysign(a, b),
            s.swap_halves(a),
        ];
        let (le, ne) = (s.le(a, b), s.ne(a, b));
        let masks = [le, ne, s.and(le, ne), s.or(le, ne)];
        s.prefetch::<2>(self.a.as_ptr().cast());
        s.prefetch::<1>(std::ptr::null());
        Results {
            values: values.map(|v| s.to_array(v).map(canonical_bits)).to_vec(),
            masks: masks.map(|m| s.bits(m)).to_vec(),
            mul_sub: s.to_array(s.mul_sub(a, b, s.splat(1.0))),
        }
    }
}

/// All NaNs are one: their payload has no meaning.
fn canonical_bits(x: f32) -> u32 {
    if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() }
}

fn oracle(a: [f32; 8], b: [f32; 8]) -> Results {
    let zip =
        |f: &dyn Fn(f32, f32) -> f32| -> [u32; 8] { std::array::from_fn(|i| canonical_bits(f(a[i], b[i]))) };
    let mask = |f: &dyn Fn(f32, f32) -> bool| (0..8).map(|i| u32::from(f(a[i], b[i])) << i).sum();
    Results {
        values: vec![
            [canonical_bits(a[3]); 8],
            zip(&|a, b| a + b),
            zip(&|a, b| a - b),
            zip(&|a, b| a * b),
            zip(&|a, b| a / b),
            zip(&|a, b| if a < b { a } else { b }),
            zip(&|a, b| if a > b { a } else { b }),
            a.map(|a| canonical_bits(a.sqrt())),
            a.map(|a| canonical_bits(a.abs())),
            zip(&f32::copysign),
            std::array::from_fn(|i| canonical_bits(a[(i + 4) % 8])),
        ],
        masks: vec![mask(&|a, b| a <= b), mask(&|a, b| a != b), mask(&|a, b| a < b), mask(&|_, _| true)],
        mul_sub: std::array::from_fn(|i| a[i] * b[i] - 1.0),
    }
}

#[test]
fn every_level_gives_the_bits_of_scalar_arithmetic() {
    let special =
        [0.0, -0.0, 1.0, -2.5, 1e-42, 3.0e38, f32::INFINITY, f32::NEG_INFINITY, 0.1, 1e20, -7.25e-20];
    for level in Level::available() {
        for i in 0..special.len() * special.len() {
            let a = std::array::from_fn(|k| special[(i + k) % special.len()]);
            let b = std::array::from_fn(|k| special[(i / special.len() + k * 3) % special.len()]);
            let (found, expected) = (level.dispatch(AllOperations { a, b }), oracle(a, b));
            assert_eq!(found.values, expected.values, "{} {a:?} {b:?}", level.name());
            for (f, e) in found.mul_sub.iter().zip(expected.mul_sub) {
                let close = (f - e).abs() <= 1e-6 * e.abs().max(1.0);
                assert!(close || f.is_nan() && e.is_nan() || *f == e, "{} {f} {e}", level.name());
            }
            assert_eq!(found.masks[..3], expected.masks[..3], "{} {a:?} {b:?}", level.name());
        }
    }
}

#[test]
fn comparisons_with_nan_are_those_of_the_language() {
    let (a, b) = (
        [f32::NAN, 1.0, f32::NAN, 2.0, 0.0, 0.0, 0.0, 0.0],
        [1.0, f32::NAN, f32::NAN, 2.0, 0.0, 0.0, 0.0, 0.0],
    );
    for level in Level::available() {
        let found = level.dispatch(AllOperations { a, b });
        assert_eq!(found.masks[0], 0b1111_1000, "le at {}", level.name());
        assert_eq!(found.masks[1], 0b0000_0111, "ne at {}", level.name());
        assert_eq!(found.values[5][0], 1.0_f32.to_bits(), "min gives the second at {}", level.name());
    }
}

#[test]
fn a_wrong_operation_would_be_found() {
    let (a, b) = ([1.0; 8], [3.0; 8]);
    let found = Level::detect().dispatch(AllOperations { a, b });
    assert_ne!(found.values[1], oracle(a, [4.0; 8]).values[1]);
}

#[test]
fn levels_are_found_by_name() {
    for level in Level::available() {
        assert_eq!(Level::from_name(level.name()).map(Level::name), Some(level.name()));
    }
    assert!(Level::from_name("sse9").is_none());
}

struct Unpack<'a> {
    window: &'a [u8; WINDOW],
    words: Words,
    at: [u8; 8],
}

impl Kernel for Unpack<'_> {
    type Output = [[f32; 8]; 4];

    #[inline(always)]
    fn run<S: Simd8>(self, s: S) -> [[f32; 8]; 4] {
        let [a, b, c] = s.unpack(self.window, self.words, &self.at);
        [s.to_array(a), s.to_array(b), s.to_array(c), s.to_array(s.widen(&self.at))]
    }
}

#[test]
fn words_of_any_width_are_unpacked_bit_by_bit() {
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    let window: [u8; WINDOW] = std::array::from_fn(|_| random());
    let bit = |i: usize| u32::from(window[i / 8] >> (i % 8) & 1);
    for bits in [[0, 0, 0], [1, 2, 3], [8, 8, 8], [16, 16, 16], [24, 24, 16], [0, 24, 24], [21, 21, 21]] {
        let stride = bits.iter().sum::<u8>().div_ceil(8) + u8::from(bits[0] == 24);
        let words = Words { stride, bits };
        for _ in 0..50 {
            let at: [u8; 8] = std::array::from_fn(|lane| if lane == 0 { 255 } else { random() });
            let expected: [[f32; 8]; 3] = std::array::from_fn(|number| {
                at.map(|at| {
                    let before: usize = bits[..number].iter().map(|&b| usize::from(b)).sum();
                    let first = 8 * usize::from(at) * usize::from(words.stride) + before;
                    (0..usize::from(bits[number])).map(|i| bit(first + i) << i).sum::<u32>() as f32
                })
            });
            for level in Level::available() {
                let [a, b, c, widened] = level.dispatch(Unpack { window: &window, words, at });
                assert_eq!([a, b, c], expected, "{level:?} {words:?} {at:?}");
                assert_eq!(widened, at.map(f32::from));
            }
        }
    }
}
