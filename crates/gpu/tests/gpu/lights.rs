//! Lights on the software adapter against the same lights on the CPU.

use crate::common::{answers, probe};
use crate::lights_scenes::{self as scenes, HALVES};
use vastlight_math::{Rng, Vec2, Vec3, warp};
use vastlight_scene::{Scene, SceneDesc};
use vastlight_transport::words::lights as place;
use vastlight_transport::{Lights, MaterialTable};

probe!(LIGHTS_PROBE = "lights_probe", 4);

const QUERY_WORDS: usize = 17;
const ANSWER_WORDS: usize = 17;
/// Points of a scene.
const COUNT: usize = 6000;
/// Relative difference that an answer may have, and share of answers that may have more, since rounding took them over
/// a boundary between two lights, made them black, or was most of what they are (triangles seen from within their plane).
const TOLERANCE: f32 = 2e-4;
const ODD_SHARE: f32 = 2e-3;

/// What is asked at a point.
#[derive(Clone, Copy, Debug)]
struct Query {
    at: Vec3,
    normal: Vec3,
    pick: f32,
    u: Vec2,
    wi: Vec3,
    hit: (u32, u32),
    position: Vec3,
}

/// The parts of an answer, named for messages.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Answer {
    flags: u32,
    wi: Vec3,
    distance: f32,
    radiance: Vec3,
    pdf: f32,
    odds: Vec3,
    environment: Vec3,
    of_direction: f32,
    of_hit: f32,
}

impl Query {
    fn words(&self) -> [u32; QUERY_WORDS] {
        let mut words = [0; QUERY_WORDS];
        let (a, n, w, p) = (self.at, self.normal, self.wi, self.position);
        let numbers = [a.x, a.y, a.z, n.x, n.y, n.z, self.pick, self.u.x, self.u.y, w.x, w.y, w.z];
        numbers.iter().zip(&mut words).for_each(|(number, word)| *word = number.to_bits());
        (words[12], words[13]) = self.hit;
        p.to_array().iter().zip(&mut words[14..]).for_each(|(number, word)| *word = number.to_bits());
        words
    }

    /// What the CPU says.
    fn answer(&self, lights: &Lights) -> Answer {
        let sample = lights.sample(self.at, self.normal, self.pick, self.u);
        let odds = lights.odds(self.at, self.normal);
        Answer {
            flags: sample.map_or(0, |s| 1 | u32::from(s.delta) << 1),
            wi: sample.map_or(Vec3::ZERO, |s| s.wi),
            distance: sample.map_or(0.0, |s| s.distance),
            radiance: sample.map_or(Vec3::ZERO, |s| s.radiance),
            pdf: sample.map_or(0.0, |s| s.pdf),
            odds: Vec3::new(odds.local, odds.background, odds.sun),
            environment: lights.environment(self.wi),
            of_direction: lights.pdf_environment(self.at, self.normal, self.wi),
            of_hit: lights.pdf_hit(self.at, self.normal, self.hit.0, self.hit.1, self.position),
        }
    }
}

impl Answer {
    fn from_words(words: &[u32]) -> Self {
        let f = |i: usize| f32::from_bits(words[i]);
        let vec3 = |i: usize| Vec3::new(f(i), f(i + 1), f(i + 2));
        Self {
            flags: words[8],
            wi: vec3(0),
            distance: f(3),
            radiance: vec3(4),
            pdf: f(7),
            odds: vec3(9),
            environment: vec3(12),
            of_direction: f(15),
            of_hit: f(16),
        }
    }

    /// The largest relative difference of sample, odds, environment and densities.
    fn differences(&self, other: &Self) -> [f32; 4] {
        let number = |a: f32, b: f32| {
            let scale = a.abs().max(b.abs());
            if scale > 1e-20 { (a - b).abs() / scale } else { 0.0 }
        };
        let vector = |a: Vec3, b: Vec3| {
            let scale = a.length().max(b.length());
            if scale > 1e-20 { a.distance(b) / scale } else { 0.0 }
        };
        let sample = [
            if self.flags == other.flags { 0.0 } else { 1.0 },
            self.wi.distance(other.wi),
            number(self.distance, other.distance),
            vector(self.radiance, other.radiance),
            number(self.pdf, other.pdf),
        ];
        let densities = number(self.of_direction, other.of_direction).max(number(self.of_hit, other.of_hit));
        [
            sample.into_iter().fold(0.0, nan_max),
            (self.odds - other.odds).abs().max_element(),
            vector(self.environment, other.environment),
            densities,
        ]
        .map(|d| nan_max(0.0, d))
    }
}

/// The larger one; what is no number is large.
fn nan_max(a: f32, b: f32) -> f32 {
    if b.is_nan() { f32::MAX } else { a.max(b) }
}

/// A point of a triangle of the scene, and what it is on.
fn on_scene(scene: &Scene, rng: &mut Rng) -> ((u32, u32), Vec3) {
    let count = scene.instances().len();
    if count == 0 {
        return ((0, 0), Vec3::ZERO);
    }
    let instance = ((rng.next_1d() * count as f32) as usize).min(count - 1);
    let mesh = &scene.meshes()[scene.instances().mesh(instance) as usize];
    let prim = ((rng.next_1d() * mesh.triangles.len() as f32) as u32).min(mesh.triangles.len() as u32 - 1);
    let [a, b, c] = mesh.corners(prim);
    let w = warp::uniform_triangle(rng.next_2d());
    let position = a * (1.0 - w.x - w.y) + b * w.x + c * w.y;
    ((instance as u32, prim), scene.instances().map(instance).transform_point3(position))
}

/// Points near and far, close to lights and behind them; every fifth without normal; directions often into lights.
fn queries(scene: &Scene, lights: &Lights) -> Vec<Query> {
    let mut rng = Rng::new(31);
    let query = |i: usize| {
        let (hit, position) = on_scene(scene, &mut rng);
        let around = warp::uniform_sphere(rng.next_2d());
        let at = match i % 8 {
            0 => position + around * 0.01,
            1 => position + around * 0.3,
            2 => around * 1e4 * rng.next_1d(),
            3 => around * 1e9,
            // On a triangle, seen from which rounding alone decides what is in front.
            4 if i.is_multiple_of(64) => position,
            _ => around * 4.0 * rng.next_1d(),
        };
        let normal = if i % 5 == 4 { Vec3::ZERO } else { warp::uniform_sphere(rng.next_2d()) };
        let anywhere = warp::uniform_sphere(rng.next_2d());
        let seen = lights.sample(at, normal, rng.next_1d(), rng.next_2d());
        let wi = seen.filter(|s| i.is_multiple_of(2) && !s.delta).map_or(anywhere, |s| s.wi);
        let (pick, u) = (rng.next_1d(), rng.next_2d());
        Query { at, normal, pick, u, wi, hit, position }
    };
    (0..COUNT).map(query).collect()
}

/// Colours and texture coordinates of the first mesh's triangles, all that are textured have the same.
fn texture(scene: &Scene) -> Vec<u32> {
    let colors = HALVES.iter().flat_map(|color| color.to_array());
    let first = scene.meshes().first().into_iter();
    let coordinates =
        first.flat_map(|mesh| mesh.triangles.iter().flatten().map(|&i| mesh.uvs[0][i as usize].x));
    colors.chain(coordinates).map(f32::to_bits).collect()
}

/// How a scene's lights on the device agree with those on the CPU.
#[derive(Debug)]
struct Agreement {
    /// Shares of points whose sample, odds, environment and densities differ.
    differ: [f32; 4],
    /// Share of points with a sample.
    lit: f32,
    /// Share of points with a density of the hit.
    hits: f32,
}

impl Agreement {
    fn is_good(&self) -> bool {
        self.differ.iter().all(|share| *share <= ODD_SHARE)
    }
}

/// Asks both; none without an adapter. `spoil` changes what the device gets.
fn compare(desc: SceneDesc, flat_limit: u64, spoil: &dyn Fn(&mut [u32])) -> Option<Agreement> {
    let scene = Scene::new(desc).expect("valid");
    let materials = MaterialTable::new(&scene);
    let lights = Lights::with_flat_limit(&scene, &materials, flat_limit);
    let queries = queries(&scene, &lights);
    let mut words = lights.pack();
    spoil(&mut words);
    let asked: Vec<u32> = queries.iter().flat_map(Query::words).collect();
    let found = answers(&LIGHTS_PROBE, &[&words, &asked, &texture(&scene)], COUNT, ANSWER_WORDS)?;
    let found = found.chunks_exact(ANSWER_WORDS).map(Answer::from_words);
    let expected: Vec<Answer> = queries.iter().map(|query| query.answer(&lights)).collect();
    let differences: Vec<[f32; 4]> = expected.iter().zip(found).map(|(e, f)| e.differences(&f)).collect();
    let share = |of: &dyn Fn(usize) -> bool| (0..COUNT).filter(|&i| of(i)).count() as f32 / COUNT as f32;
    Some(Agreement {
        differ: [0, 1, 2, 3].map(|what| share(&|i| differences[i][what] > TOLERANCE)),
        lit: share(&|i| expected[i].flags != 0),
        hits: share(&|i| expected[i].of_hit > 0.0),
    })
}

const FLAT: u64 = 1 << 20;

#[test]
fn lights_on_the_device_are_those_of_the_cpu() {
    let cases = [
        ("one area", scenes::one_area(), FLAT),
        ("many triangles", scenes::many_triangles(), FLAT),
        ("textured", scenes::lamps(), FLAT),
        ("shared trees", scenes::lamps(), 0),
        ("punctual", scenes::punctual(), FLAT),
        ("directional", scenes::directional(), FLAT),
        ("image", scenes::image(32, 16, 0.7), FLAT),
        ("odd image", scenes::image(7, 5, -2.0), FLAT),
        ("day", scenes::sky(0.8), FLAT),
        ("evening", scenes::sky(0.05), FLAT),
        ("night", scenes::sky(-0.3), FLAT),
        ("none", scenes::dark(Vec::new()), FLAT),
    ];
    for (name, desc, flat_limit) in cases {
        let (surfaces, dark) = (!desc.instances.is_empty(), name == "none");
        let Some(agreement) = compare(desc, flat_limit, &|_| ()) else { return };
        assert!(agreement.is_good(), "{name}: {agreement:?}");
        assert_eq!(agreement.lit > 0.2, !dark, "{name}: {agreement:?}");
        assert_eq!(agreement.hits > 0.1, surfaces, "{name}: {agreement:?}");
    }
}

/// Multiplies a number in each of the first `count` records of `stride` words of a section with 1.2.
fn scale(words: &mut [u32], place: usize, [stride, field, count]: [usize; 3]) {
    let start = words[place] as usize + field;
    for word in words[start..].iter_mut().step_by(stride).take(count) {
        *word = (f32::from_bits(*word) * 1.2).to_bits();
    }
}

/// Whether a scene's lights differ when numbers of a section are wrong; true without an adapter.
fn is_found(desc: SceneDesc, flat_limit: u64, place: usize, numbers: [usize; 3]) -> bool {
    let agreement = compare(desc, flat_limit, &|words| scale(words, place, numbers));
    agreement.is_none_or(|agreement| !agreement.is_good())
}

#[test]
fn what_is_packed_wrongly_is_found() {
    for field in [0, 3, 6, 7, 9, 10] {
        assert!(is_found(scenes::many_triangles(), FLAT, place::TREE, [13, field, 300]), "node {field}");
    }
    for field in [0, 3, 6, 12] {
        assert!(
            is_found(scenes::many_triangles(), FLAT, place::SURFACES, [16, field, 100]),
            "surface {field}"
        );
    }
    assert!(is_found(scenes::lamps(), 0, place::SURFACES, [16, 3, 7]), "maps of shared trees");
    for field in [0, 3, 12, 15, 17, 18] {
        assert!(is_found(scenes::punctual(), FLAT, place::PUNCTUAL, [20, field, 9]), "punctual {field}");
    }
    assert!(is_found(scenes::directional(), FLAT, place::DIRECTIONAL, [7, 4, 3]), "directional");
    for field in [4, 5] {
        assert!(
            is_found(scenes::image(32, 16, 0.7), FLAT, place::BACKGROUND, [1, field, 1]),
            "image {field}"
        );
    }
    for field in [4, 9, 12, 15] {
        assert!(is_found(scenes::sky(0.8), FLAT, place::BACKGROUND, [1, field, 1]), "sky {field}");
    }
    for field in [9, 12, 14] {
        assert!(is_found(scenes::sky(0.8), FLAT, place::SUN, [1, field, 1]), "sun {field}");
    }
}

#[test]
fn wrong_ways_from_the_root_are_found() {
    let turned = |words: &mut [u32]| {
        let first = words[place::TRAILS] as usize;
        words[first..first + 100].iter_mut().step_by(2).for_each(|trail| *trail ^= 1);
    };
    let agreement = compare(scenes::many_triangles(), FLAT, &turned);
    assert!(agreement.is_none_or(|agreement| !agreement.is_good()));
}
