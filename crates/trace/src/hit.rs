//! Hits, and the filter that may refuse them.

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter, in units of the ray direction's length.
    pub t: f32,
    /// Weight of the triangle's second corner.
    pub u: f32,
    /// Weight of the triangle's third corner; the first has `1 - u - v`.
    pub v: f32,
    /// Instance id; [`Hit::NONE`] for a miss.
    pub instance: u32,
    /// Triangle of the instance's mesh; [`Hit::NONE`] for a miss.
    pub prim: u32,
}

impl Hit {
    /// The id that no instance and no triangle has.
    pub const NONE: u32 = u32::MAX;

    /// No hit.
    pub const MISS: Self = Self { t: f32::INFINITY, u: 0.0, v: 0.0, instance: Self::NONE, prim: Self::NONE };

    /// Whether there is a hit.
    #[inline]
    #[must_use]
    pub fn is_hit(&self) -> bool {
        self.instance != Self::NONE
    }
}

/// Decides whether a hit counts, for surfaces with alpha.
///
/// The answer must depend on its arguments alone: hits are offered in the order in which the tracer finds them, which
/// is not the order along the ray.
pub trait HitFilter: Sync {
    /// Whether every hit counts; lets the tracer skip the call.
    fn accepts_all(&self) -> bool {
        false
    }

    /// Whether `hit` of the ray number `ray` in the batch counts.
    fn accepts(&self, ray: usize, hit: &Hit) -> bool;
}

/// Every hit counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct AcceptAll;

impl HitFilter for AcceptAll {
    fn accepts_all(&self) -> bool {
        true
    }

    #[inline]
    fn accepts(&self, _ray: usize, _hit: &Hit) -> bool {
        true
    }
}
