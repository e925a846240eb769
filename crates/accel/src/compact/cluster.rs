//! Clusters: the triangles of all leaves below one node, over vertices that they share, in as few bits as they need.

use vastlight_simd::Words;

/// Most triangles of a cluster: eight leaves of eight.
pub(super) const TRIANGLES: usize = 64;

/// The corners of a triangle, and its number in the mesh.
pub(super) type Numbered = ([[f32; 3]; 3], u32);

/// How the vertices and numbers of a cluster are packed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Packing {
    /// Distance between vertices, by axis: the exponent bits of an f32.
    pub(super) exponents: [u8; 3],
    /// Bits of a vertex's offset, by axis.
    pub(super) bits: [u8; 3],
    /// Number of triangles.
    pub(super) triangles: u8,
    /// Number of vertices.
    pub(super) vertices: u8,
    /// Bits of a triangle's number.
    pub(super) number_bits: u8,
}

/// Where a cluster's vertices and numbers are counted from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Anchor {
    /// Bits of an f32, by axis.
    pub(super) corner: [u32; 3],
    /// Least number of a triangle.
    pub(super) number: u32,
}

/// A packed cluster.
#[derive(Clone, Debug, Default)]
pub(super) struct Cluster {
    pub(super) packing: Packing,
    pub(super) anchor: Anchor,
    /// Three vertices a triangle, leaf by leaf: all first corners, all second, all third.
    pub(super) corners: Vec<u8>,
    pub(super) vertices: Vec<u8>,
    pub(super) numbers: Vec<u8>,
}

impl Packing {
    /// Bits of a vertex.
    #[inline(always)]
    fn vertex_bits(&self) -> u32 {
        let [a, b, c] = self.bits;
        u32::from(a) + u32::from(b) + u32::from(c)
    }

    /// Bytes of a vertex.
    #[inline(always)]
    pub(super) fn stride(&self) -> usize {
        self.vertex_bits().div_ceil(8) as usize
    }

    /// How vertices are packed.
    #[inline(always)]
    pub(super) fn words(&self) -> Words {
        Words { stride: self.stride() as u8, bits: self.bits }
    }

    /// How vertices of more than 64 bits are packed as seen from their second byte, from which on they have no more.
    #[inline(always)]
    pub(super) fn words_from_second_byte(&self) -> Option<Words> {
        let [a, b, c] = self.bits;
        (self.vertex_bits() > 64).then(|| Words { bits: [a.saturating_sub(8), b, c], ..self.words() })
    }

    /// Where vertices start, bytes behind the corners' start.
    #[inline(always)]
    pub(super) fn vertices_at(&self) -> usize {
        3 * usize::from(self.triangles)
    }

    /// Where numbers start, bytes behind the corners' start.
    #[inline(always)]
    pub(super) fn numbers_at(&self) -> usize {
        self.vertices_at() + usize::from(self.vertices) * self.stride()
    }

    /// The number of the triangle `i`, of the memory that starts with the numbers.
    #[inline(always)]
    pub(super) fn number(&self, anchor: &Anchor, i: usize, numbers: &[u8]) -> u32 {
        let bits = usize::from(self.number_bits.min(32));
        let word = read(numbers, i * bits / 8) >> (i * bits % 8);
        anchor.number.wrapping_add((word & ((1 << bits) - 1)) as u32)
    }
}

/// Eight bytes from `at` on, zeros behind the end.
#[inline(always)]
fn read(bytes: &[u8], at: usize) -> u64 {
    let rest = bytes.get(at..).unwrap_or_default();
    match rest.first_chunk() {
        Some(word) => u64::from_le_bytes(*word),
        None => rest.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte)),
    }
}

impl Cluster {
    /// Packs the triangles of leaves; none where the vertices are on no lattice of 24 bits. At most [`TRIANGLES`] in all.
    pub(super) fn new(leaves: &[Vec<Numbered>]) -> Option<Self> {
        let mut cluster = Self::default();
        let triangles = || leaves.iter().flatten();
        let mut vertices: Vec<[u32; 3]> = triangles().flat_map(|t| t.0).map(key).collect();
        vertices.sort_unstable();
        vertices.dedup();
        cluster.pack_vertices(&vertices)?;
        let find = |vertex: [f32; 3]| vertices.binary_search(&key(vertex)).unwrap_or(0) as u8;
        for leaf in leaves {
            (0..3).for_each(|corner| cluster.corners.extend(leaf.iter().map(|t| find(t.0[corner]))));
        }
        cluster.packing.triangles = triangles().count() as u8;
        cluster.pack_numbers(triangles().map(|t| t.1));
        Some(cluster)
    }

    fn pack_vertices(&mut self, vertices: &[[u32; 3]]) -> Option<()> {
        let mut spans = [Span::EMPTY; 3];
        for vertex in vertices {
            spans.iter_mut().zip(vertex).for_each(|(span, &x)| span.grow(f32::from_bits(x)));
        }
        let [x, y, z] = &spans;
        let bits = [x.bits()?, y.bits()?, z.bits()?];
        self.packing.bits = bits;
        let stride = self.packing.stride();
        for vertex in vertices {
            let [x, y, z] = std::array::from_fn(|axis| spans[axis].steps(f32::from_bits(vertex[axis])));
            let word = u128::from(x) | u128::from(y) << bits[0] | u128::from(z) << (bits[0] + bits[1]);
            self.vertices.extend(&word.to_le_bytes()[..stride]);
        }
        self.anchor.corner = spans.map(|span| span.first.to_bits());
        self.packing.exponents = spans.map(|span| (span.exponent + 127) as u8);
        self.packing.vertices = vertices.len() as u8;
        Some(())
    }

    fn pack_numbers(&mut self, numbers: impl Iterator<Item = u32> + Clone) {
        let least = numbers.clone().min().unwrap_or(0);
        let most = numbers.clone().max().unwrap_or(0);
        let bits = 32 - (most - least).leading_zeros();
        let (mut word, mut filled) = (0_u64, 0);
        for number in numbers {
            word |= u64::from(number - least) << filled;
            filled += bits;
            while filled >= 8 {
                self.numbers.push(word as u8);
                (word, filled) = (word >> 8, filled - 8);
            }
        }
        if filled > 0 {
            self.numbers.push(word as u8);
        }
        (self.anchor.number, self.packing.number_bits) = (least, bits as u8);
    }
}

/// The bits of a vertex; those of minus zero are zero's.
fn key(vertex: [f32; 3]) -> [u32; 3] {
    vertex.map(|x| (x + 0.0).to_bits())
}

/// Coordinates along an axis, as multiples of a power of two.
#[derive(Clone, Copy, Debug)]
struct Span {
    first: f32,
    last: f32,
    /// The power of which all are multiples.
    exponent: i32,
}

impl Span {
    const EMPTY: Self = Self { first: f32::INFINITY, last: f32::NEG_INFINITY, exponent: 127 };

    fn grow(&mut self, x: f32) {
        (self.first, self.last) = (self.first.min(x), self.last.max(x));
        self.exponent = self.exponent.min(lowest_bit(x));
    }

    /// How many steps `x` is away from the first coordinate; the largest number where 32 bits are too few.
    fn steps(&self, x: f32) -> u32 {
        let step = f64::from_bits(((self.exponent + 1023) as u64) << 52);
        ((f64::from(x) - f64::from(self.first)) / step) as u32
    }

    /// Bits of the offsets; none for more than 24, or where the step is no normal f32.
    fn bits(&self) -> Option<u8> {
        let bits = 32 - self.steps(self.last).leading_zeros() as u8;
        (bits <= 24 && self.exponent >= -126).then_some(bits)
    }
}

/// The exponent of the largest power of two that `x` is a multiple of; 127 for zero.
fn lowest_bit(x: f32) -> i32 {
    let (exponent, fraction) = ((x.to_bits() >> 23 & 0xff) as i32, x.to_bits() & 0x7f_ffff);
    let mantissa = if exponent == 0 { fraction } else { fraction | 1 << 23 };
    if mantissa == 0 {
        return 127;
    }
    exponent.max(1) - 150 + mantissa.trailing_zeros() as i32
}
