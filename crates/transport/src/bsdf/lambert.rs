//! Ideal diffuse reflection (Lambert 1760), the same on both sides of the surface.

use vastlight_math::{Vec3, warp};

/// `f * cos` of a diffuse reflector and the density of [`sample`]; zero for directions on different sides.
#[inline(always)]
pub(crate) fn evaluate(albedo: Vec3, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
    if wo.z * wi.z <= 0.0 {
        return (Vec3::ZERO, 0.0);
    }
    let pdf = warp::cosine_hemisphere_pdf(wi.z.abs());
    (albedo * pdf, pdf)
}

/// The direction `cosine`, drawn by [`warp::cosine_hemisphere`], on the side of `wo`, and its density; `None` on the
/// horizon.
#[inline(always)]
pub(crate) fn sample(wo: Vec3, cosine: Vec3) -> Option<(Vec3, f32)> {
    let mut wi = cosine;
    let pdf = warp::cosine_hemisphere_pdf(wi.z);
    wi.z = wi.z.copysign(wo.z);
    (pdf > 0.0 && wo.z != 0.0).then_some((wi, pdf))
}
