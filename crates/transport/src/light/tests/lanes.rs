//! Lanes against single points.

use super::*;
use vastlight_math::lanes::{LANES, Lanes2, Lanes3};
use vastlight_math::warp;
use vastlight_scene::{LightKind, Sky};

/// Points around the origin, every fifth without normal, every seventh unwanted.
fn queries(rng: &mut Rng) -> LightQueries {
    let (from, normal, u) = (Lanes3::ZERO, Lanes3::ZERO, Lanes2::ZERO);
    let mut q =
        LightQueries { wanted: [true; LANES], from, normal, pick: [0.0; LANES], u, time: [0.0; LANES] };
    for lane in 0..LANES {
        q.wanted[lane] = lane % 7 != 3;
        q.from.set(lane, warp::uniform_sphere(rng.next_2d()) * 2.0 * rng.next_1d());
        q.normal.set(lane, if lane % 5 == 4 { Vec3::ZERO } else { warp::uniform_sphere(rng.next_2d()) });
        q.pick[lane] = rng.next_1d();
        q.u.set(lane, rng.next_2d());
    }
    q
}

/// How many of the answers are samples; `shift` of the random choice of the single points makes it wrong.
fn agreeing(lights: &Lights, shift: f32) -> (usize, bool) {
    let mut rng = Rng::new(23);
    let (mut samples, mut same) = (0, true);
    for _ in 0..50 {
        let q = queries(&mut rng);
        let answers = lights.draw_lanes(&q);
        for lane in 0..LANES {
            let (from, normal) = (q.from.get(lane), q.normal.get(lane));
            let wanted = q.wanted[lane];
            let alone = lights.sample(from, normal, (q.pick[lane] + shift).fract(), q.u.get(lane));
            let odds = lights.weights(from, normal).map_or(Odds::default(), |w| w.odds);
            let odds = if wanted { odds } else { Odds::default() };
            same &= answers.samples[lane] == alone.filter(|_| wanted) && answers.odds[lane] == odds;
            samples += usize::from(answers.samples[lane].is_some());
        }
    }
    (samples, same)
}

#[test]
fn lanes_have_the_bits_of_single_points() {
    let sun = irradiance::lamp(LightKind::Directional, Affine3::from_rotation_x(0.3));
    let few = SceneDesc { instances: mixed_lights().instances[..2].to_vec(), ..mixed_lights() };
    let under_sky = SceneDesc { environment: Some(Environment::Sky(Sky::default())), ..mixed_lights() };
    let with_sun = SceneDesc { lights: vec![sun], ..mixed_lights() };
    for (name, desc, limit) in [
        ("list", few, 1 << 20),
        ("tree", mixed_lights(), 1 << 20),
        ("shared", mixed_lights(), 0),
        ("sky", under_sky, 1 << 20),
        ("directional", with_sun, 1 << 20),
        ("dark", dark(Vec::new()), 1 << 20),
    ] {
        with_lights(desc, limit, |_, lights| {
            let (samples, same) = agreeing(lights, 0.0);
            assert!(same, "{name}");
            assert_eq!(samples > 300, name != "dark", "{name}: {samples}");
            assert!(name == "dark" || !agreeing(lights, 0.5).1, "negative control: {name}");
        });
    }
}
