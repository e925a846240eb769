//! Every structure against brute force.

use super::search::{Kept, Search};
use super::*;
use vastlight_math::{Rng, warp};

const RADIUS: f32 = 0.1;

/// A point of the unit cube.
fn point(rng: &mut Rng) -> Vec3 {
    Vec3::new(rng.next_1d(), rng.next_1d(), rng.next_1d())
}

fn photon(position: Vec3, rng: &mut Rng) -> Photon {
    let [from, normal] = [(); 2].map(|()| warp::uniform_sphere(rng.next_2d()));
    Photon { position, flux: point(rng), from, normal, segments: 2 + (rng.next_1d() * 300.0) as u32 }
}

/// Photons where `place` says.
fn photons(count: usize, place: impl Fn(usize, Vec3) -> Vec3) -> Vec<Photon> {
    let mut rng = Rng::new(11);
    (0..count)
        .map(|i| {
            let position = place(i, point(&mut rng));
            photon(position, &mut rng)
        })
        .collect()
}

/// Irradiance, m, from all that is near, and a sum over what else is known of it.
fn sums(map: &PhotonMap, at: Vec3) -> (Vec3, f32) {
    let (mut irradiance, mut rest) = (Vec3::ZERO, 0.0);
    map.near_at(at, |near| {
        irradiance += near.flux * near.weight;
        rest += near.weight * (near.from.dot(near.normal) + near.segments as f32);
    });
    (irradiance, rest)
}

/// Whether two maps give the same around all points, to rounding.
fn same(a: &PhotonMap, b: &PhotonMap, points: &[Vec3]) -> bool {
    let close = |a: f32, b: f32| (a - b).abs() <= 2e-4 * (1.0 + a.abs().max(b.abs()));
    points.iter().all(|&at| {
        let ((a, more), (b, as_much)) = (sums(a, at), sums(b, at));
        (0..3).all(|i| close(a[i], b[i])) && close(more, as_much)
    })
}

/// Points in the unit cube, around it, far from it, at its corners, and at photons.
fn queries(photons: &[Photon]) -> Vec<Vec3> {
    let mut rng = Rng::new(5);
    let mut points: Vec<Vec3> = (0..300).map(|_| point(&mut rng) * 1.4 - 0.2).collect();
    points.extend(photons.iter().step_by(photons.len() / 100 + 1).map(|photon| photon.position));
    points.extend([Vec3::ZERO, Vec3::ONE, Vec3::ONE * 1.05, -Vec3::ONE * 0.05, Vec3::splat(1e30)]);
    points.extend([Vec3::INFINITY, Vec3::NEG_INFINITY, Vec3::NAN, Vec3::new(0.5, 0.5, 1.1)]);
    points
}

/// Checks every structure and kernel.
fn check(photons: &[Photon], radius: f32) {
    let points = queries(photons);
    for kernel in Kernel::ALL {
        let brute = PhotonMap::new(photons, SearchKind::Brute, radius, kernel);
        for kind in SearchKind::ALL {
            let map = PhotonMap::new(photons, kind, radius, kernel);
            assert_eq!((map.len(), map.lost()), (brute.len(), brute.lost()));
            assert!(same(&map, &brute, &points), "{kind:?} {kernel:?} {radius}");
        }
    }
}

#[test]
fn brute_force_sums_weights_and_fluxes() {
    let all = photons(2000, |_, at| at);
    let map = PhotonMap::new(&all, SearchKind::Brute, RADIUS, Kernel::Linear);
    let at = Vec3::splat(0.5);
    let (mut expected, mut near) = (Vec3::ZERO, 0);
    for photon in &all {
        let distance = photon.position.distance(at);
        if distance < RADIUS {
            expected += photon.flux * Kernel::Linear.peak(RADIUS) * (1.0 - distance / RADIUS);
            near += 1;
        }
    }
    assert!(near > 3 && sums(&map, at).0.distance(expected) < 1e-4 * expected.length());
    map.near_at(at, |near| {
        let close = |photon: &&Photon| photon.flux == near.flux;
        let photon = all.iter().find(close).expect("one of them");
        assert!(near.from.distance(photon.from) < 1e-3 && near.normal.distance(photon.normal) < 1e-3);
        assert_eq!(near.segments, photon.segments.min(255));
    });
}

#[test]
fn structures_find_what_brute_force_finds() {
    check(&photons(3000, |_, at| at), RADIUS);
    check(&photons(3000, |_, at| at), 0.013);
    // Longest along z, then y.
    check(&photons(3000, |_, at| at * Vec3::new(0.2, 0.5, 1.0)), RADIUS);
    check(&photons(20_000, |_, at| at.powf(3.0)), 0.03);
}

#[test]
fn photons_on_borders_and_in_one_cell_are_found() {
    check(
        &photons(1331, |i, _| Vec3::new((i % 11) as f32, (i / 11 % 11) as f32, (i / 121) as f32) * 0.1),
        0.1,
    );
    check(
        &photons(4096, |i, _| Vec3::new((i % 16) as f32, (i / 16 % 16) as f32, (i / 256) as f32) / 16.0),
        0.0625,
    );
    check(&photons(500, |_, at| at * 0.01 + 0.5), RADIUS);
    check(&photons(500, |_, _| Vec3::splat(0.3)), RADIUS);
    check(&photons(500, |i, at| if i == 7 { Vec3::ONE } else { at * 0.1 }), RADIUS);
    check(&[], RADIUS);
    check(&photons(1, |_, at| at), RADIUS);
}

#[test]
fn flat_receivers_are_searched_whichever_way_they_face() {
    for axis in 0..3 {
        let mut flat = Vec3::ONE;
        flat[axis] = 0.0;
        check(&photons(5000, |_, at| at * flat), 0.02);
    }
    // A floor and a wall.
    check(
        &photons(5000, |i, at| if i % 2 == 0 { at * Vec3::new(1.0, 0.0, 1.0) } else { at.with_x(0.0) }),
        0.02,
    );
}

#[test]
fn photons_that_are_no_numbers_are_left_out() {
    let mut all = photons(2000, |_, at| at);
    let good: Vec<Photon> = all.iter().enumerate().filter(|(i, _)| i % 7 != 3).map(|(_, &p)| p).collect();
    for (i, photon) in all.iter_mut().enumerate().filter(|(i, _)| i % 7 == 3) {
        match i % 4 {
            0 => photon.position.x = f32::NAN,
            1 => photon.position = Vec3::INFINITY,
            2 => photon.flux.y = f32::NEG_INFINITY,
            _ => photon.flux = Vec3::NAN,
        }
    }
    check(&all, RADIUS);
    for kind in SearchKind::ALL {
        let [with, without] = [&all, &good].map(|p| PhotonMap::new(p, kind, RADIUS, Kernel::Linear));
        assert_eq!((with.lost(), with.len()), (all.len() - good.len(), good.len()));
        assert_eq!(sums(&with, Vec3::splat(0.4)), sums(&without, Vec3::splat(0.4)), "{kind:?}");
    }
    all.iter_mut().for_each(|photon| photon.flux.x = f32::NAN);
    check(&all, RADIUS);
}

#[test]
fn odd_radii_and_scales_are_survived() {
    let all = photons(3000, |_, at| at);
    for kind in SearchKind::ALL {
        for radius in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-30, 1e30] {
            let map = PhotonMap::new(&all, kind, radius, Kernel::Linear);
            assert_eq!((map.len(), map.radius()), (all.len(), 0.0));
            assert_eq!(sums(&map, all[0].position), (Vec3::ZERO, 0.0));
        }
        let tiny = PhotonMap::new(&all, kind, 1e-7, Kernel::Linear);
        assert!(sums(&tiny, all[9].position).0.x > 0.0);
        assert!(tiny.bytes() < 256 * 256 * 256 * 8 + 1_000_000, "{kind:?}: {}", tiny.bytes());
        let far = [Vec3::MAX, Vec3::MIN, Vec3::ZERO].map(|at| photons(1, |_, _| at)[0]);
        let map = PhotonMap::new(&far, kind, RADIUS, Kernel::Linear);
        far.iter().for_each(|photon| assert!(sums(&map, photon.position).0.x > 0.0, "{kind:?}"));
    }
    check(&all, 1e-4);
    check(&all, 5.0);
    // Where coordinates are as coarse as the radius.
    let coarse = photons(3000, |_, at| at + Vec3::new(3e5, -3e5, 1e5));
    for kind in SearchKind::ALL {
        let [map, brute] =
            [kind, SearchKind::Brute].map(|k| PhotonMap::new(&coarse, k, 0.05, Kernel::Linear));
        let points: Vec<Vec3> = coarse.iter().step_by(10).map(|photon| photon.position).collect();
        assert!(same(&map, &brute, &points), "{kind:?}");
    }
}

#[test]
fn the_order_depends_on_no_thread() {
    let all = photons(60_000, |i, at| if i % 3 == 0 { (at * 8.0).floor() / 8.0 } else { at });
    let kept = Kept::of(&all);
    for kind in SearchKind::ALL {
        let order = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                let map = PhotonMap::new(&all, kind, 0.02, Kernel::Linear);
                (Search::new(kind, &all, &kept, 0.02).1, sums(&map, Vec3::splat(0.5)))
            })
        };
        let one = order(1);
        assert_eq!(one.0.len(), all.len());
        assert!(one == order(2) && one == order(3), "{kind:?}");
    }
}

#[test]
fn an_index_that_is_wrong_is_noticed() {
    let all = photons(3000, |_, at| at);
    let (points, kept) = (queries(&all), Kept::of(&all));
    let brute = PhotonMap::new(&all, SearchKind::Brute, RADIUS, Kernel::Linear);
    for kind in SearchKind::ALL.into_iter().filter(|&kind| kind != SearchKind::Brute) {
        let other = photons(3000, |_, at| at.with_x(at.x * 0.9));
        let wrong = PhotonMap::new(&all, kind, RADIUS, Kernel::Linear);
        assert!(same(&wrong, &brute, &points));
        let of_other = wrong.with_search(Search::new(kind, &other, &kept, RADIUS * 0.5).0);
        assert!(!same(&of_other, &brute, &points), "{kind:?}");
    }
}

#[test]
fn names_are_those_of_structures() {
    for kind in SearchKind::ALL {
        assert_eq!(SearchKind::from_name(kind.name()), Some(kind));
    }
    assert_eq!((SearchKind::from_name("kd"), SearchKind::default()), (None, SearchKind::Rows));
}
