//! The operations that every feature level has.

/// Bytes that [`Simd8::unpack`] may look at: 256 words of at most nine.
pub const WINDOW: usize = 256 * 9;

/// How words of three unsigned numbers stand in memory, the first number in the lowest bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Words {
    /// Bytes from word to word, at most 9.
    pub stride: u8,
    /// Bits of each number: at most 24, so that f32 holds it. Only the first 64 bits of a word are looked at.
    pub bits: [u8; 3],
}

/// Eight f32 lanes at one feature level.
///
/// A value of the implementing type is the proof that the machine has the level's instructions; it has no size and is
/// handed down to whatever uses vectors.
pub trait Simd8: Copy + Send + Sync + 'static {
    /// Eight f32.
    type F: Copy;
    /// Eight truth values.
    type M: Copy;

    /// All lanes `x`.
    fn splat(self, x: f32) -> Self::F;
    /// Lanes from memory.
    fn load(self, x: &[f32; 8]) -> Self::F;
    /// Lanes as an array.
    fn to_array(self, a: Self::F) -> [f32; 8];

    /// Lanes from small integers.
    fn widen(self, x: &[u8; 8]) -> Self::F;
    /// The three numbers of the words `at` of `window`, by number.
    fn unpack(self, window: &[u8; WINDOW], words: Words, at: &[u8; 8]) -> [Self::F; 3];

    /// `a + b`
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a - b`
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a * b`
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a / b`
    fn div(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a * b - c`, rounded once or twice: only for results whose rounding does not matter.
    fn mul_sub(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `if a < b { a } else { b }`: the second operand where one is NaN.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// `if a > b { a } else { b }`: the second operand where one is NaN.
    fn max(self, a: Self::F, b: Self::F) -> Self::F;

    /// The square root, rounded correctly; NaN of what is negative.
    fn sqrt(self, a: Self::F) -> Self::F;
    /// `|a|`
    fn abs(self, a: Self::F) -> Self::F;
    /// `a` with the signs of `sign`.
    fn copysign(self, a: Self::F, sign: Self::F) -> Self::F;

    /// Lanes 4 to 7 before lanes 0 to 3.
    fn swap_halves(self, a: Self::F) -> Self::F;

    /// `a <= b`, false where one is NaN.
    fn le(self, a: Self::F, b: Self::F) -> Self::M;
    /// `a != b`, true where one is NaN.
    fn ne(self, a: Self::F, b: Self::F) -> Self::M;
    /// Both.
    fn and(self, a: Self::M, b: Self::M) -> Self::M;
    /// One or both.
    fn or(self, a: Self::M, b: Self::M) -> Self::M;
    /// Lane `i` as bit `i`.
    fn bits(self, a: Self::M) -> u32;

    /// Asks the caches for `LINES` lines of 64 bytes, the first of them at `start`, which may be any address.
    fn prefetch<const LINES: usize>(self, start: *const u8);
}
