//! Triangles cut into parts on the software adapter, against the CPU's splitter, and trees over the parts.

use crate::common::software;
use crate::trace::noise;
use vastlight_accel::build::{clip_triangle, presplit};
use vastlight_accel::{Clip, Reference, validate_parts};
use vastlight_gpu::build::parts::{self, most_parts};
use vastlight_gpu::build::{Builder, boxes, record_counted, tree_of_words};
use vastlight_gpu::{Executor, Recording, build};
use vastlight_math::{Aabb, Vec3};
use vastlight_scene::Mesh;

/// By how much nearly all boxes of the device may be larger, in units of the largest coordinate.
const LARGER: f32 = 1.0 / 65_536.0;

struct Soup(Vec<[Vec3; 3]>);

impl Clip for Soup {
    fn clip(&self, prim: u32, bounds: &Aabb) -> Aabb {
        clip_triangle(self.0[prim as usize], bounds)
    }
}

fn point(i: usize, salt: u32) -> Vec3 {
    Vec3::new(noise(i, salt), noise(i, salt + 1), noise(i, salt + 2)) * 2.0 - 1.0
}

/// Triangles of which all but each fourth are long along one axis alone, by up to `length`.
fn needles(count: usize, length: f32) -> Soup {
    let triangle = |i: usize| {
        let mut long = point(i, 20) * 0.003;
        long[i % 3] = if i.is_multiple_of(4) { 0.002 } else { noise(i, 31) * length };
        let start = point(i, 10);
        [start, start + long, start + point(i, 40) * 0.002]
    };
    Soup((0..count).map(triangle).collect())
}

/// Triangles of all sizes up to `size`.
fn mixed(count: usize, size: f32) -> Soup {
    let corner = |i: usize, k: u32| point(i, 10) + point(i, 20 + 3 * k) * size * noise(i, 40).powi(4);
    Soup((0..count).map(|i| [0, 1, 2].map(|k| corner(i, k))).collect())
}

impl Soup {
    fn mesh(&self) -> Mesh {
        let triangles = (0..self.0.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Mesh { positions: self.0.concat(), triangles, ..Mesh::default() }
    }

    fn boxes(&self) -> Vec<Aabb> {
        self.0.iter().map(|t| Aabb::from_points(*t)).collect()
    }

    /// What the CPU cuts it into, by triangle and place.
    fn expected(&self, most: u32) -> Vec<(u32, Aabb)> {
        let mut references: Vec<Reference> =
            self.boxes().iter().zip(0..).map(|(b, i)| Reference::new(b, i)).collect();
        presplit(&mut references, self, most as usize, f32::INFINITY);
        sorted(references.iter().map(|r| (r.prim(), r.bounds())).collect())
    }

    /// What the device cuts it into.
    fn found(&self, executor: &mut Executor, most: u32) -> Vec<(u32, Aabb)> {
        let (mut recording, mesh) = (Recording::new(), self.mesh());
        let count = self.0.len() as u32;
        let buffers =
            [recording.upload("positions", &mesh.positions), recording.upload("triangles", &mesh.triangles)];
        let whole = boxes::record(&mut recording, buffers[0], buffers[1], count).expect("few");
        let found = parts::record(&mut recording, buffers, whole, (count, most)).expect("few");
        let known = found.count.known.expect("of the device");
        let downloads = [(found.boxes, 6 * most), (found.owners, most), (known, 1)]
            .map(|(buffer, words)| recording.download(buffer, words.into()));
        let results = executor.run(&recording).expect("runs");
        let [boxes, owners, count] = downloads.map(|download| results.words(download));
        assert!(count[0] <= most, "{} parts of {most}", count[0]);
        let boxes = boxes.chunks_exact(6).take(count[0] as usize).map(bounds_of);
        sorted(owners.into_iter().zip(boxes).collect())
    }

    /// Whether points of a triangle are each in one of the boxes.
    fn covered(&self, prim: u32, boxes: &[Aabb]) -> bool {
        let [a, b, c] = self.0[prim as usize];
        let point = |i: u32| {
            let (u, v) = ((i % 20) as f32 / 19.0, (i / 20) as f32 / 19.0);
            a + (b - a) * (u * (1.0 - v)) + (c - a) * (u * v)
        };
        let slack = 1e-6;
        (0..400).map(point).all(|p| boxes.iter().any(|b| grown(b, slack).contains(&Aabb::point(p))))
    }
}

/// The box of six words.
fn bounds_of(words: &[u32]) -> Aabb {
    let x = |k: usize| {
        let word = words[k];
        f32::from_bits(if word >> 31 == 0 { !word } else { word ^ 1 << 31 })
    };
    Aabb { min: Vec3::new(x(0), x(1), x(2)), max: Vec3::new(x(3), x(4), x(5)) }
}

fn grown(b: &Aabb, by: f32) -> Aabb {
    Aabb { min: b.min - by, max: b.max + by }
}

/// By triangle, and where they begin along the axis on which that says most.
fn sorted(mut parts: Vec<(u32, Aabb)>) -> Vec<(u32, Aabb)> {
    let place = |b: &Aabb| (b.min + b.max).to_array().map(f64::from).iter().sum::<f64>();
    parts.sort_by(|a, b| a.0.cmp(&b.0).then(place(&a.1).total_cmp(&place(&b.1))));
    parts
}

/// Whether parts are the same, up to larger boxes, and nearly all larger by little: where an edge stands across the axis, a little along the axis
/// is much along the edge.
fn same(found: &[(u32, Aabb)], expected: &[(u32, Aabb)]) -> bool {
    let largest = |b: &Aabb| b.min.abs().max(b.max.abs()).max_element();
    let pairs = || found.iter().zip(expected);
    let holds = pairs().all(|(found, expected)| found.0 == expected.0 && found.1.contains(&expected.1));
    let is_larger = |(found, expected): &(&(u32, Aabb), &(u32, Aabb))| {
        !grown(&expected.1, LARGER * largest(&expected.1)).contains(&found.1)
    };
    found.len() == expected.len() && holds && 50 * pairs().filter(is_larger).count() <= found.len()
}

#[test]
fn parts_of_needles_are_those_of_the_cpu() {
    let Some(mut executor) = software() else { return };
    for count in [1, 2, 255, 256, 257, 3000] {
        let soup = needles(count, 1.0);
        for budget in [1.0, 1.1, 1.5, 2.0, 3.7, 100.0] {
            let most = most_parts(count as u32, budget);
            let (found, expected) = (soup.found(&mut executor, most), soup.expected(most));
            assert_eq!(found.len(), expected.len(), "{count} {budget}");
            assert!(same(&found, &expected), "{count} {budget}");
            let wanted = if count < 255 || budget < 1.5 { 0 } else { count / 8 };
            assert!(found.len() >= count + wanted, "{count} {budget}: {} parts", found.len());
        }
    }
}

#[test]
fn a_part_that_differs_is_found() {
    let Some(mut executor) = software() else { return };
    let soup = needles(1000, 1.0);
    let expected = soup.expected(1500);
    assert!(same(&soup.found(&mut executor, 1500), &expected));
    assert!(!same(&soup.found(&mut executor, 1501), &expected) || soup.expected(1501) == expected);
    let other = Soup(soup.0.iter().map(|t| t.map(|p| p * Vec3::new(1.0, 1.0, 0.999))).collect());
    assert!(!same(&other.found(&mut executor, 1500), &expected));
}

#[test]
fn the_budget_is_a_bound_and_parts_cover() {
    let Some(mut executor) = software() else { return };
    for (soup, budget) in [(mixed(2000, 2.0), 1.3), (mixed(2000, 2.0), 4.0), (mixed(300, 0.5), 30.0)] {
        let most = most_parts(soup.0.len() as u32, budget);
        let (found, expected) = (soup.found(&mut executor, most), soup.expected(most));
        // Boxes that are larger by the slack may ask for a cut more in the second pass.
        assert!(
            found.len().abs_diff(expected.len()) * 200 <= expected.len(),
            "{} {}",
            found.len(),
            expected.len()
        );
        let area = |parts: &[(u32, Aabb)]| parts.iter().map(|p| f64::from(p.1.half_area())).sum::<f64>();
        let ratio = area(&found) / area(&expected);
        assert!((0.99..1.01).contains(&ratio), "{ratio}");
        for prim in 0..soup.0.len() as u32 {
            let boxes: Vec<Aabb> = found.iter().filter(|p| p.0 == prim).map(|p| p.1).collect();
            assert!(soup.covered(prim, &boxes), "{prim}");
        }
    }
}

#[test]
fn trees_over_parts_are_sound() {
    let Some(mut executor) = software() else { return };
    for (count, budget) in [(1, 5.0), (7, 1.0), (300, 1.7), (2500, 2.0), (2500, 1.0)] {
        let (soup, most) = (mixed(count, 2.0), most_parts(count as u32, budget));
        for (name, builder) in Builder::ALL {
            let (mut recording, mesh) = (Recording::new(), soup.mesh());
            let buffers = [
                recording.upload("positions", &mesh.positions),
                recording.upload("triangles", &mesh.triangles),
            ];
            let whole = boxes::record(&mut recording, buffers[0], buffers[1], count as u32).expect("few");
            let parts = parts::record(&mut recording, buffers, whole, (count as u32, most)).expect("few");
            let tree =
                record_counted(&mut recording, builder, parts.boxes, (parts.count, 4), &mut Vec::new());
            let tree = tree.expect("few");
            let words = build::NODE_WORDS * u64::from(tree.most_nodes());
            let downloads = [
                (tree.nodes, words),
                (tree.pairs, 1),
                (tree.order, most.into()),
                (parts.owners, most.into()),
            ]
            .map(|(buffer, words)| recording.download(buffer, words));
            let results = executor.run(&recording).expect("runs");
            let [nodes, pairs, order, owners] = downloads.map(|download| results.words(download));
            let mut tree = tree_of_words(&nodes, pairs[0], order);
            tree.prims.iter_mut().for_each(|prim| *prim = owners[*prim as usize]);
            let covered = |prim: u32, boxes: &[Aabb]| soup.covered(prim, boxes);
            let report = validate_parts(&tree, &soup.boxes(), 4, covered)
                .unwrap_or_else(|e| panic!("{count} {budget} {name}: {e}"));
            assert!(report.references >= count && report.references <= most as usize);
        }
    }
}
