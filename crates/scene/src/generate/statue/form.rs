//! The head as a signed distance (approximately): negative inside. Metres; y up, the face looks along +z.
//!
//! y = 0 is where the neck's cut meets the plinth, the crown is at about 0.52.

use vastlight_math::{Vec2, Vec3};

/// Smooth union: the minimum, rounded over a distance of `k`.
fn join(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// Smooth removal of `b` from `a`.
fn carve(a: f32, b: f32, k: f32) -> f32 {
    -join(-a, b, k)
}

fn ellipsoid(p: Vec3, center: Vec3, half: Vec3) -> f32 {
    let q = p - center;
    let (k0, k1) = ((q / half).length(), (q / (half * half)).length());
    if k1 > 0.0 { k0 * (k0 - 1.0) / k1 } else { -half.min_element() }
}

/// A round stick from `a` to `b` whose radius goes from `ra` to `rb`.
fn stick(p: Vec3, a: Vec3, b: Vec3, ra: f32, rb: f32) -> f32 {
    let (pa, ba) = (p - a, b - a);
    let h = (pa.dot(ba) / ba.length_squared()).clamp(0.0, 1.0);
    (pa - ba * h).length() - (ra + (rb - ra) * h)
}

/// The whole form at `p`.
pub(super) fn distance(p: Vec3) -> f32 {
    // The face is the same on both sides.
    let q = Vec3::new(p.x.abs(), p.y, p.z);
    let skull = ellipsoid(q, Vec3::new(0.0, 0.393, -0.028), Vec3::new(0.101, 0.116, 0.133));
    let face = ellipsoid(q, Vec3::new(0.0, 0.335, 0.035), Vec3::new(0.086, 0.132, 0.088));
    let jaw = stick(q, Vec3::new(0.0, 0.235, 0.088), Vec3::new(0.066, 0.29, 0.005), 0.027, 0.03);
    let mut d = join(skull, face, 0.05);
    d = join(d, jaw, 0.045);
    d = join(d, features(q), 0.012);
    d = sockets(d, q);
    d = join(d, eyes(q), 0.004);
    d = mouth(d, q);
    d = join(d, ears(q), 0.01);
    let neck = stick(p, Vec3::new(0.0, 0.30, -0.035), Vec3::new(0.0, 0.10, -0.05), 0.060, 0.068);
    d = join(d, neck, 0.035);
    d = join(d, shoulders(q), 0.06);
    join(d, hair(p), 0.012)
}

/// Brow, nose, cheekbones, chin.
fn features(q: Vec3) -> f32 {
    let brow = stick(q, Vec3::new(0.012, 0.388, 0.112), Vec3::new(0.062, 0.388, 0.078), 0.013, 0.012);
    let bridge = stick(q, Vec3::new(0.0, 0.385, 0.114), Vec3::new(0.0, 0.322, 0.143), 0.0105, 0.0125);
    let tip = ellipsoid(q, Vec3::new(0.0, 0.3185, 0.142), Vec3::new(0.0135, 0.012, 0.0145));
    let wing = ellipsoid(q, Vec3::new(0.0135, 0.314, 0.128), Vec3::new(0.0095, 0.0095, 0.013));
    let cheek = ellipsoid(q, Vec3::new(0.054, 0.325, 0.072), Vec3::new(0.026, 0.021, 0.026));
    let chin = ellipsoid(q, Vec3::new(0.0, 0.222, 0.105), Vec3::new(0.022, 0.018, 0.018));
    let nose = join(join(bridge, tip, 0.014), wing, 0.008);
    let forehead = ellipsoid(q, Vec3::new(0.0, 0.42, 0.058), Vec3::new(0.075, 0.05, 0.056));
    join(join(join(brow, nose, 0.012), join(cheek, chin, 0.01), 0.02), forehead, 0.03)
}

/// The hollows beside the nose.
fn sockets(d: f32, q: Vec3) -> f32 {
    let socket = ellipsoid(q, Vec3::new(0.036, 0.362, 0.128), Vec3::new(0.027, 0.0175, 0.028));
    carve(d, socket, 0.018)
}

/// Balls with an upper and a lower lid.
fn eyes(q: Vec3) -> f32 {
    let center = Vec3::new(0.0355, 0.3615, 0.0935);
    let ball = (q - center).length() - 0.0172;
    let lid = (q - center).length() - 0.0192;
    // The lids leave an almond open.
    let open = {
        let r = q - center;
        let almond = |y: f32| (Vec2::new(r.x / 0.0195, (r.y - y) / 0.0175).length() - 1.0) * 0.0175;
        almond(-0.0105).max(almond(0.0105))
    };
    join(ball, lid.max(-open), 0.002)
}

/// Lips with the line between them.
fn mouth(d: f32, q: Vec3) -> f32 {
    let upper = stick(q, Vec3::new(0.0, 0.2825, 0.1225), Vec3::new(0.0225, 0.2765, 0.1085), 0.0078, 0.003);
    let lower = stick(q, Vec3::new(0.0, 0.2685, 0.1195), Vec3::new(0.0195, 0.2735, 0.1085), 0.0088, 0.003);
    let line = stick(q, Vec3::new(0.0, 0.2762, 0.1335), Vec3::new(0.0255, 0.2748, 0.1155), 0.0022, 0.0016);
    let groove = stick(q, Vec3::new(0.0, 0.306, 0.1325), Vec3::new(0.0, 0.291, 0.1335), 0.0035, 0.0035);
    let under = stick(q, Vec3::new(0.0, 0.2515, 0.1285), Vec3::new(0.015, 0.2525, 0.1205), 0.007, 0.005);
    let d = join(d, join(upper, lower, 0.004), 0.010);
    let d = carve(d, line, 0.004);
    carve(carve(d, groove, 0.007), under, 0.012)
}

fn ears(q: Vec3) -> f32 {
    let shell = ellipsoid(q, Vec3::new(0.094, 0.345, -0.022), Vec3::new(0.014, 0.034, 0.021));
    let bowl = ellipsoid(q, Vec3::new(0.108, 0.348, -0.016), Vec3::new(0.010, 0.021, 0.012));
    carve(shell, bowl, 0.006)
}

/// A bust cut as the ancients cut it: chest and shoulders end in an even curve.
fn shoulders(q: Vec3) -> f32 {
    let yoke = stick(q, Vec3::new(0.0, 0.085, -0.06), Vec3::new(0.155, 0.045, -0.065), 0.058, 0.052);
    let chest = ellipsoid(q, Vec3::new(0.06, 0.02, 0.0), Vec3::new(0.11, 0.085, 0.085));
    let collar = stick(q, Vec3::new(0.026, 0.092, 0.03), Vec3::new(0.14, 0.098, -0.03), 0.009, 0.009);
    let cord = stick(q, Vec3::new(0.030, 0.105, 0.016), Vec3::new(0.062, 0.285, -0.035), 0.014, 0.016);
    join(join(join(yoke, chest, 0.06), collar, 0.03), cord, 0.025)
}

/// Positive where the hair begins, above the forehead in front and behind the ears.
pub(super) fn hairline(p: Vec3) -> f32 {
    (p.y - 0.418) + (p.z - 0.06) * -0.75
}

/// Positive below the hair's end at the nape.
pub(super) fn nape(p: Vec3) -> f32 {
    0.275 - p.y + (p.z + 0.05).max(0.0) * 2.0
}

/// A cap of curls: rows of knobs that stand off the skull, in the manner of archaic heads, with a headband.
fn hair(p: Vec3) -> f32 {
    let center = Vec3::new(0.0, 0.386, -0.034);
    let cap = ellipsoid(p, center, Vec3::new(0.112, 0.131, 0.143));
    // Where the hair ends: above the forehead in front, down to the nape behind.
    let line = hairline(p);
    let nape = nape(p);
    let edge = (-line * 0.72).max(nape);
    let band =
        ellipsoid(p, center, Vec3::new(0.1165, 0.136, 0.1475)).max((line * 0.72 - 0.050).abs() - 0.0075);
    join(cap.max(edge), band, 0.004)
}
