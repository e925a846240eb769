// Which surfaces focus light, and which receive photons, as in `vastlight-transport`, `bsdf` and `photon::flight`.
//#include bsdf

/// Up to this width a lobe focuses light.
const FOCUS_ALPHA: f32 = 0.1;

fn focus_is_narrow(alpha: vec2<f32>) -> bool {
    return max(alpha.x, alpha.y) <= FOCUS_ALPHA;
}

/// Whether nothing leaves but in narrow lobes.
fn bsdf_focuses(bsdf: Bsdf) -> bool {
    let s = bsdf.layered;
    let black = vec3<f32>(0.0);
    let is_diffuse = any(s.cosine.front.diffuse != black) || any(s.cosine.back.diffuse != black);
    return !bsdf.lambert
        && !is_diffuse
        && s.sheen.strength <= 0.0
        && focus_is_narrow(s.base.alpha)
        && (s.coat.weight <= 0.0 || focus_is_narrow(s.coat.alpha));
}

/// Whether photons land on a surface.
fn bsdf_receives(bsdf: Bsdf) -> bool {
    return bsdf_has_nondelta(bsdf) && !bsdf_focuses(bsdf);
}
