//! Pages come and go, hits stay: against the same scene in memory.

use crate::common::shapes::{closed_surface, random_soup, thin_soup};
use crate::common::{Random, beams, closest, occluded, rays_at, scene, tracer};
use std::collections::BTreeSet;
use std::sync::Arc;
use vastlight_accel::compact::{CompactMesh, PackedPage, SLACK};
use vastlight_accel::wide::{MeshBvh, MeshView};
use vastlight_accel::{BuildConfig, Scratch};
use vastlight_math::{Affine3, Ray, Vec3};
use vastlight_paging::Table;
use vastlight_scene::{Instance, MeshPose, Motion, Pose, Scene, SceneDesc, SceneError};
use vastlight_simd::Level;
use vastlight_trace::paged::{Found, PagedBatch, PagedFilter, Pager, Verdict};
use vastlight_trace::{Hit, HitFilter, Layout, TopLevel, TraceError, Tracer, TracerConfig};

/// Small pages, so that there are many.
const SLOT: usize = 1 << 11;

/// A scene in pages.
struct Paged {
    tracer: Tracer,
    pages: Vec<PackedPage>,
    all: Table,
}

impl Paged {
    fn new(scene: &Scene, level: Level, top: TopLevel) -> Self {
        Self::beside(scene, &[], (level, top))
    }

    /// With some meshes beside the pages.
    fn beside(scene: &Scene, deforming: &[u32], (level, top): (Level, TopLevel)) -> Self {
        let (mut meshes, mut pages) = (Vec::new(), Vec::new());
        for (number, mesh) in (0..).zip(scene.meshes()) {
            if deforming.contains(&number) {
                meshes.push(None);
                continue;
            }
            let view = MeshView { positions: &mesh.positions, triangles: &mesh.triangles };
            let config = BuildConfig { level, ..BuildConfig::default() };
            let (wide, _) = MeshBvh::build("", &view, &config, &mut Scratch::default()).expect("built");
            let (mut compact, mut own) = CompactMesh::pack(&wide, SLOT).expect("packed");
            compact.renumber(pages.len() as u32);
            pages.append(&mut own);
            meshes.push(Some(Arc::new(compact)));
        }
        let config = TracerConfig { level: Some(level), top, ..TracerConfig::default() };
        let tracer = Tracer::over_pages(scene, meshes, &config).expect("placed");
        let all = Table::resident(pages.iter().map(|page| &page.bytes[..]), SLACK);
        Self { tracer, pages, all }
    }
}

/// Keeps few pages and gives away random ones. Every page has one page of attributes, of the same number.
struct Careless<'a> {
    paged: &'a Paged,
    random: Random,
    slots: usize,
    resident: BTreeSet<u32>,
    /// Pages of attributes in memory.
    known: BTreeSet<u32>,
    fetches: usize,
    most_fetches: usize,
}

impl Pager for Careless<'_> {
    type Error = &'static str;

    fn attributes(&self) -> Table {
        let mut table = Table::new(self.paged.pages.len());
        for &page in &self.known {
            table.set(page, Table::resident([&[1_u8][..]].into_iter(), 0).set(0, None));
        }
        table
    }

    fn geometry(&self) -> Table {
        let mut table = Table::new(self.paged.pages.len());
        for &page in &self.resident {
            let alone = Table::resident([&self.paged.pages[page as usize].bytes[..]].into_iter(), SLACK);
            table.set(page, alone.clone().set(0, None));
        }
        table
    }

    fn fetch(&mut self, geometry: &[u32], attributes: &[u32]) -> Result<(), Self::Error> {
        self.fetches += 1;
        if self.fetches > self.most_fetches {
            return Err("it does not end");
        }
        let granted = 1 + self.random.below(self.slots);
        let keep = self.random.unit();
        self.resident.retain(|_| self.random.unit() < keep);
        self.resident.extend(geometry.iter().take(granted));
        if !attributes.is_empty() {
            self.known.clear();
            self.known.extend(attributes.iter().take(granted));
        }
        Ok(())
    }

    fn used(&mut self, pages: &[u64]) {
        for page in 0..self.paged.pages.len() as u32 {
            let used = pages[page as usize / 64] >> (page % 64) & 1 == 1;
            assert!(!used || self.resident.contains(&page), "page {page} is not there");
        }
    }
}

/// Passes triangles of every third number; for those of every other page it needs to see attributes.
struct Thirds;

fn counts(hit: &Hit) -> bool {
    !hit.prim.is_multiple_of(3)
}

impl PagedFilter for Thirds {
    fn judge(&self, _ray: usize, hit: &Hit, found: &Found, attributes: &Table) -> Verdict {
        let known = attributes.page(found.page).is_some();
        match (found.page % 2 == 1 && !known, counts(hit)) {
            (true, _) => Verdict::Unknown(found.page),
            (false, true) => Verdict::Counts,
            (false, false) => Verdict::Passes,
        }
    }
}

impl HitFilter for Thirds {
    fn accepts(&self, _ray: usize, hit: &Hit) -> bool {
        counts(hit)
    }
}

fn scenes() -> Vec<(&'static str, Scene)> {
    let mut random = Random(11);
    let soup = random_soup(&mut random, 1500, 0.2, 1.0, Vec3::ZERO);
    let thin = thin_soup(&mut random, 800, 1e-3);
    let ball = closed_surface(60, 5, |_| 1.0);
    let moved = |x: f32| Affine3::from_translation(Vec3::new(x, 0.2, -0.1));
    vec![
        ("soup", scene(vec![(soup.clone(), vec![Affine3::IDENTITY])])),
        ("instances", scene(vec![(ball, vec![moved(0.0), moved(0.5)]), (thin, vec![moved(-0.3); 2])])),
    ]
}

fn check(name: &str, scene: &Scene, (level, top): (Level, TopLevel), slots: usize) {
    let mut random = Random(slots as u64 + 1);
    let alone = rays_at(&mut random, 400, Vec3::ZERO, 1.0);
    let rays: Vec<Ray> = [beams(&mut random, &alone[..12]), alone].concat();
    check_rays(name, scene, (level, top), (slots, 0), &rays);
}

/// Traces rays through pages of which the first `there` are in memory at the beginning.
fn check_rays(
    name: &str,
    scene: &Scene,
    (level, top): (Level, TopLevel),
    (slots, there): (usize, usize),
    rays: &[Ray],
) {
    let paged = Paged::new(scene, level, top);
    let resident = tracer(scene, level);
    for filtered in [false, true] {
        let filter = filtered.then_some(&Thirds as &dyn PagedFilter);
        let mut pager = Careless {
            paged: &paged,
            random: Random(7 * slots as u64 + 3),
            slots,
            resident: (0..paged.pages.len().min(there) as u32).collect(),
            known: BTreeSet::new(),
            fetches: 0,
            most_fetches: 400 * paged.pages.len(),
        };
        let (mut expected, mut hidden) = (closest(&resident, rays), occluded(&resident, rays));
        if filtered {
            resident.closest(rays, &Thirds, &mut expected);
            resident.occluded(rays, &Thirds, &mut hidden);
        }
        assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 100, "{name}");
        let (mut batch, mut hits, mut places) = (PagedBatch::default(), Vec::new(), Vec::new());
        let take = |_, hit: &Hit, found: &Found| (hits.push(*hit), places.push(*found)).0;
        batch.closest(&paged.tracer, &mut pager, rays, filter, take).expect("ends");
        assert_eq!(hits, expected, "{name}, {slots}, {filtered}");
        assert!(pager.fetches > 0, "pages did come");
        check_places(scene, &paged, &hits, &places);
        let mut answers = vec![false; rays.len()];
        batch.occluded(&paged.tracer, &mut pager, rays, filter, &mut answers).expect("ends");
        assert_eq!(answers, hidden, "{name}, {slots}, {filtered}");
    }
}

/// What a hit says about its place is so.
fn check_places(scene: &Scene, paged: &Paged, hits: &[Hit], places: &[Found]) {
    for (hit, place) in hits.iter().zip(places).filter(|(hit, _)| hit.is_hit()) {
        let triangles = &paged.pages[place.page as usize].triangles;
        assert_eq!(triangles[place.place as usize], hit.prim);
        let mesh = &scene.meshes()[scene.instances().mesh(hit.instance as usize) as usize];
        assert_eq!(place.corners, mesh.corners(hit.prim));
    }
    assert!(paged.all.pages() > 20, "{} pages", paged.all.pages());
}

#[test]
fn hits_do_not_depend_on_which_pages_are_in_memory() {
    for (name, scene) in scenes() {
        for level in Level::available() {
            for slots in [1, 2, 7, 50] {
                check(name, &scene, (level, TopLevel::Tree), slots);
            }
        }
    }
}

/// More rays than see the same pages: some leave between one ray and the next before any ray has waited.
#[test]
fn nor_on_pages_that_leave_in_the_first_pass() {
    let rays = rays_at(&mut Random(5), 7000, Vec3::ZERO, 1.0);
    for (name, scene) in scenes() {
        check_rays(name, &scene, (Level::detect(), TopLevel::Tree), (50, usize::MAX), &rays);
    }
}

#[test]
fn nor_on_whether_a_tree_or_a_grid_is_above_them() {
    for (name, scene) in scenes() {
        for (per_axis, slots) in [(1, 7), (5, 2), (5, 50), (32, 7)] {
            check(name, &scene, (Level::detect(), TopLevel::Grid(per_axis)), slots);
        }
    }
}

/// Without pages to wait for: also rays from far away, for which cells have no order; and a scene that is a little different
/// has other hits.
#[test]
fn a_grid_gives_the_hits_of_a_tree() {
    let mut random = Random(23);
    let soup = random_soup(&mut random, 900, 0.2, 1.0, Vec3::ZERO);
    let maps = |shift: f32| -> Vec<Affine3> {
        let turned = |i: usize| Affine3::from_rotation_y(i as f32) * Affine3::from_scale(Vec3::splat(0.4));
        (0..20).map(|i| Affine3::from_translation(Vec3::X * (i as f32 * 0.2 + shift)) * turned(i)).collect()
    };
    let whole = scene(vec![(soup.clone(), maps(0.0))]);
    let tracer_over = |scene: &Scene, layout: Layout, top: TopLevel| {
        Tracer::new(scene, &TracerConfig { layout, top, ..TracerConfig::default() })
    };
    let near = rays_at(&mut random, 6000, Vec3::X * 2.0, 2.0);
    let far = near[..100].iter().map(|ray| Ray { origin: ray.origin - ray.direction * 1e4, ..*ray });
    let rays: Vec<Ray> = near.iter().copied().chain(far).collect();
    let expected = closest(&tracer_over(&whole, Layout::Wide, TopLevel::Tree).expect("built"), &rays);
    assert!(expected.iter().filter(|hit| hit.is_hit()).count() > 1000);
    for per_axis in [1, 2, 20] {
        let grid = tracer_over(&whole, Layout::Compact, TopLevel::Grid(per_axis)).expect("built");
        assert_eq!(closest(&grid, &rays), expected, "{per_axis}");
        assert_eq!(occluded(&grid, &rays), expected.iter().map(Hit::is_hit).collect::<Vec<_>>());
        let moved = scene(vec![(soup.clone(), maps(1e-3))]);
        let grid = tracer_over(&moved, Layout::Compact, TopLevel::Grid(per_axis)).expect("built");
        assert_ne!(closest(&grid, &rays), expected);
    }
    assert_eq!(tracer_over(&whole, Layout::Wide, TopLevel::Grid(4)).err(), Some(TraceError::Grid));
}

/// All pages are in memory.
struct Whole<'a>(&'a Paged);

impl Pager for Whole<'_> {
    type Error = &'static str;

    fn geometry(&self) -> Table {
        self.0.all.clone()
    }

    fn attributes(&self) -> Table {
        Table::default()
    }

    fn fetch(&mut self, geometry: &[u32], _attributes: &[u32]) -> Result<(), Self::Error> {
        if geometry.is_empty() { Ok(()) } else { Err("a page is missing") }
    }

    fn used(&mut self, _pages: &[u64]) {}
}

/// A million rays, a hundred million with `VASTLIGHT_SOAK` in the environment, from inside a closed mesh at corners and
/// edges of its triangles, many of which lie in two pages.
#[test]
fn no_ray_gets_out_between_pages() {
    let count = if std::env::var_os("VASTLIGHT_SOAK").is_some() { 100_000_000 } else { 1_000_000 };
    let bumpy = |p: Vec3| 1.0 + 0.2 * (p.x * 9.0).sin() * (p.y * 7.0).cos();
    let mut mesh = closed_surface(60, 120, bumpy);
    let scene = scene(vec![(mesh.clone(), vec![Affine3::IDENTITY])]);
    let paged = Paged::new(&scene, Level::detect(), TopLevel::Tree);
    assert!(paged.pages.len() > 50);
    mesh.positions.clone_from(&scene.meshes()[0].positions);
    let (mut random, mut batch, mut escaped) = (Random(17), PagedBatch::default(), 0);
    for first in (0..count).step_by(1 << 16) {
        let mut ray = |i: usize| {
            let [a, b, _] = mesh.corners(random.below(mesh.triangles.len()) as u32);
            let target = if i.is_multiple_of(3) { a } else { a + (b - a) * random.unit() };
            let origin = random.point() * 0.05;
            Ray::new(origin, target - origin)
        };
        let rays: Vec<Ray> = (0..(count - first).min(1 << 16)).map(&mut ray).collect();
        let take = |_, hit: &Hit, _: &Found| escaped += u32::from(!hit.is_hit());
        batch.closest(&paged.tracer, &mut Whole(&paged), &rays, None, take).expect("all is there");
    }
    assert_eq!(escaped, 0);
}

const DEFORMING: u32 = 1;

/// Balls in pages of which one turns and one comes and goes, among them a soup that breathes.
fn moving() -> SceneDesc {
    let mut random = Random(11);
    let soup = random_soup(&mut random, 300, 0.2, 1.0, Vec3::ZERO);
    let place = |mesh, x: f32| Instance {
        world_from_object: Affine3::from_translation(Vec3::new(x, 0.2, -0.1)),
        mesh,
        name: 0,
    };
    SceneDesc {
        meshes: vec![closed_surface(60, 5, |_| 0.8), soup, thin_soup(&mut random, 800, 1e-3)],
        instances: [(0, 0.0), (0, 0.5), (0, -0.5), (1, 0.1), (1, -0.2), (2, 0.0), (2, 0.3)]
            .map(|(mesh, x)| place(mesh, x))
            .to_vec(),
        ..SceneDesc::default()
    }
}

/// Moves two of the balls, one of the thin soups and the soup.
fn pose_at(time: f32) -> Pose {
    let turned = Affine3::from_rotation_y(time) * Affine3::from_translation(Vec3::X * (0.3 * time));
    let seen = Affine3::from_scale(Vec3::splat(if time.fract() == 0.5 { 0.0 } else { 0.9 }));
    let breathe = |p: &Vec3| *p * (1.0 + 0.2 * (time + 3.0 * p.x).sin());
    let positions = moving().meshes[DEFORMING as usize].positions.iter().map(breathe).collect();
    Pose {
        meshes: vec![MeshPose { mesh: DEFORMING, positions, ..MeshPose::default() }],
        instances: vec![(1, turned), (2, seen), (5, turned)],
        ..Pose::default()
    }
}

#[test]
fn instances_that_move_and_meshes_that_deform_beside_pages_are_met_as_in_memory() {
    let rays = rays_at(&mut Random(5), 3000, Vec3::ZERO, 1.2);
    let rays = [beams(&mut Random(6), &rays[..12]), rays].concat();
    let mut scene = Scene::new(moving()).expect("valid");
    let mut paged = Paged::beside(&scene, &[DEFORMING], (Level::detect(), TopLevel::Tree));
    let mut before = Vec::new();
    // Forwards, a jump, backwards.
    for time in [0.25, 0.5, 4.5, 4.0, 0.25] {
        paged.tracer.pose(&mut scene, pose_at(time)).expect("fits");
        let mut desc = moving();
        desc.apply(pose_at(time)).expect("fits");
        desc.motion = Some(Arc::new(Still));
        let fresh = Scene::new(desc).expect("valid");
        let resident = tracer(&fresh, Level::detect());
        for (slots, filtered) in [(2, false), (2, true), (20, false)] {
            let filter = filtered.then_some(&Beside as &dyn PagedFilter);
            let mut pager = Careless {
                paged: &paged,
                random: Random(slots as u64),
                slots,
                resident: BTreeSet::new(),
                known: BTreeSet::new(),
                fetches: 0,
                most_fetches: 400 * paged.pages.len(),
            };
            let (mut expected, mut hidden) = (closest(&resident, &rays), occluded(&resident, &rays));
            if filtered {
                resident.closest(&rays, &Thirds, &mut expected);
                resident.occluded(&rays, &Thirds, &mut hidden);
            }
            let (mut batch, mut hits, mut places) = (PagedBatch::default(), Vec::new(), Vec::new());
            let take = |_, hit: &Hit, found: &Found| (hits.push(*hit), places.push(*found)).0;
            batch.closest(&paged.tracer, &mut pager, &rays, filter, take).expect("ends");
            assert!(hits == expected, "{time}, {slots}, {filtered}");
            check_beside(&scene, &hits, &places);
            let mut answers = vec![false; rays.len()];
            batch.occluded(&paged.tracer, &mut pager, &rays, filter, &mut answers).expect("ends");
            assert!(answers == hidden, "{time}, {slots}, {filtered}");
            if !filtered && slots == 2 {
                assert_eq!(time == 0.25 && !before.is_empty(), before.first() == Some(&hits));
                before.push(hits);
            }
        }
    }
    assert!(before[0] == before[4] && before[0] != before[1], "moments differ, and come again");
}

/// For scenes whose instances are hidden, not dropped.
#[derive(Debug)]
struct Still;

impl Motion for Still {
    fn duration(&self) -> f32 {
        0.0
    }

    fn pose(&self, _time: f32) -> Result<Pose, SceneError> {
        Ok(Pose::default())
    }
}

/// [`Thirds`], but for meshes beside the pages nothing is ever missing.
struct Beside;

impl PagedFilter for Beside {
    fn judge(&self, ray: usize, hit: &Hit, found: &Found, attributes: &Table) -> Verdict {
        match (found.page, counts(hit)) {
            (Hit::NONE, true) => Verdict::Counts,
            (Hit::NONE, false) => Verdict::Passes,
            _ => Thirds.judge(ray, hit, found, attributes),
        }
    }
}

/// Hits say whether they are in pages, and have the corners of the triangles.
fn check_beside(scene: &Scene, hits: &[Hit], places: &[Found]) {
    let mut met = [0; 2];
    for (hit, place) in hits.iter().zip(places).filter(|(hit, _)| hit.is_hit()) {
        let number = scene.instances().mesh(hit.instance as usize);
        let mesh = &scene.meshes()[number as usize];
        assert_eq!(place.corners, mesh.corners(hit.prim));
        assert_eq!(place.page == Hit::NONE, number == DEFORMING);
        met[usize::from(number == DEFORMING)] += 1;
    }
    assert!(met.iter().all(|&count| count > 50), "{met:?}");
}

#[test]
fn a_grid_over_pages_follows_instances_and_refuses_meshes_without_pages() {
    let mut scene = Scene::new(moving()).expect("valid");
    let rays = rays_at(&mut Random(5), 500, Vec3::ZERO, 1.2);
    let mut paged = Paged::new(&scene, Level::detect(), TopLevel::Grid(4));
    let pose = Pose { meshes: Vec::new(), ..pose_at(0.25) };
    paged.tracer.pose(&mut scene, pose).expect("fits");
    let expected = closest(&tracer(&scene, Level::detect()), &rays);
    let mut hits = Vec::new();
    let take = |_, hit: &Hit, _: &Found| hits.push(*hit);
    PagedBatch::default().closest(&paged.tracer, &mut Whole(&paged), &rays, None, take).expect("there");
    assert!(hits == expected);
    let config = TracerConfig { top: TopLevel::Grid(4), ..TracerConfig::default() };
    let beside = Tracer::over_pages(&scene, vec![None, None, None], &config);
    assert_eq!(beside.err(), Some(TraceError::Grid));
}

#[test]
fn a_page_that_cannot_be_had_is_an_error() {
    let (_, scene) = scenes().swap_remove(0);
    let paged = Paged::new(&scene, Level::PORTABLE, TopLevel::Tree);
    let mut pager = Careless {
        paged: &paged,
        random: Random(1),
        slots: 1,
        resident: BTreeSet::new(),
        known: BTreeSet::new(),
        fetches: 0,
        most_fetches: 2,
    };
    let rays = rays_at(&mut Random(5), 50, Vec3::ZERO, 1.0);
    let ended = PagedBatch::default().closest(&paged.tracer, &mut pager, &rays, None, |_, _, _| {});
    assert_eq!(ended, Err("it does not end"));
}
