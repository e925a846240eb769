//! The operations that every feature level has.

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
