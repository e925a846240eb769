//! What is done to decoded attributes: the filters of EXT_meshopt_compression, and the colour filter of its successor.

use super::{Fault, MeshoptFilter};

/// Applies `filter` in place.
pub(super) fn apply(filter: MeshoptFilter, elements: &mut [u8], stride: usize) -> Result<(), Fault> {
    match (filter, stride) {
        (MeshoptFilter::None, _) => {}
        (MeshoptFilter::Octahedral, 4) => {
            bytes(elements, |e| octahedral(e.map(|b| i32::from(b as i8)), 127.0))
        }
        (MeshoptFilter::Octahedral, 8) => {
            shorts(elements, |e| octahedral(e.map(|s| i32::from(s as i16)), 32767.0));
        }
        (MeshoptFilter::Quaternion, 8) => shorts(elements, |e| quaternion(e.map(|s| i32::from(s as i16)))),
        (MeshoptFilter::Exponential, _) if stride.is_multiple_of(4) => {
            elements.as_chunks_mut::<4>().0.iter_mut().for_each(|word| {
                *word = exponential(u32::from_le_bytes(*word)).to_le_bytes();
            });
        }
        (MeshoptFilter::Color, 4) => {
            bytes(elements, |[y, co, cg, a]| {
                color([i32::from(y), i32::from(co as i8), i32::from(cg as i8), i32::from(a)], 255.0)
            });
        }
        (MeshoptFilter::Color, 8) => shorts(elements, |[y, co, cg, a]| {
            color([i32::from(y), i32::from(co as i16), i32::from(cg as i16), i32::from(a)], 65535.0)
        }),
        _ => return Err("the filter does not fit the stride"),
    }
    Ok(())
}

fn bytes(elements: &mut [u8], f: impl Fn([u8; 4]) -> [i32; 4]) {
    elements.as_chunks_mut::<4>().0.iter_mut().for_each(|e| *e = f(*e).map(|x| x as u8));
}

fn shorts(elements: &mut [u8], f: impl Fn([u16; 4]) -> [i32; 4]) {
    for element in elements.as_chunks_mut::<8>().0 {
        let [a, b, c, d, e, g, h, i] = *element;
        let stored = [[a, b], [c, d], [e, g], [h, i]].map(u16::from_le_bytes);
        let decoded = f(stored).map(|x| (x as u16).to_le_bytes());
        element.copy_from_slice(decoded.as_flattened());
    }
}

/// Rounds half away from zero.
fn round(x: f32) -> i32 {
    (x + if x >= 0.0 { 0.5 } else { -0.5 }) as i32
}

/// x and y on the octahedron, z its size; w stays.
fn octahedral([x, y, one, w]: [i32; 4], largest: f32) -> [i32; 4] {
    let (x, y) = (x as f32, y as f32);
    let z = one as f32 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let unfold = |c: f32| c + if c >= 0.0 { fold } else { -fold };
    let (x, y) = (unfold(x), unfold(y));
    let scale = largest / (x * x + y * y + z * z).sqrt();
    [round(x * scale), round(y * scale), round(z * scale), w]
}

/// Three components, and in the last the scale with the number of the missing one.
fn quaternion([x, y, z, last]: [i32; 4]) -> [i32; 4] {
    let scale = std::f32::consts::FRAC_1_SQRT_2 / (last | 3) as f32;
    let [x, y, z] = [x, y, z].map(|c| c as f32 * scale);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let missing = (last & 3) as usize;
    let mut out = [0; 4];
    for (k, c) in [w, x, y, z].into_iter().enumerate() {
        out[(missing + k) & 3] = round(c * 32767.0);
    }
    out
}

/// 8 bits of exponent, 24 bits of mantissa, both signed.
fn exponential(word: u32) -> f32 {
    let exponent = (word as i32) >> 24;
    let mantissa = ((word << 8) as i32) >> 8;
    let power = |e: i32| f32::from_bits(((e + 127) as u32) << 23);
    // Two steps, so that every exponent from -128 to 127 is a normal factor.
    mantissa as f32 * power(exponent / 2) * power(exponent - exponent / 2)
}

/// Luma and chroma; the highest bit of alpha tells how many bits all have.
fn color([y, co, cg, a]: [i32; 4], largest: f32) -> [i32; 4] {
    let ones = [1, 2, 4, 8].into_iter().fold(a, |ones, shift| ones | (ones >> shift));
    let rgb = [y + co - cg, y + cg, y - co - cg];
    let alpha = ((a << 1) & ones) | (a & 1);
    let scale = largest / ones as f32;
    [rgb[0], rgb[1], rgb[2], alpha].map(|c| (c as f32 * scale + 0.5) as i32)
}
