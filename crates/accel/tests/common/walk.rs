//! Rays through one wide tree, the plainest way; and by trying every triangle.

use vastlight_accel::ray::ScaledRay;
use vastlight_accel::triangle::intersect;
use vastlight_accel::wide::traverse::{Memory, RayLanes, Waiting, stack_entries};
use vastlight_accel::wide::{Block8, MeshBvh};
use vastlight_math::Vec3;
use vastlight_simd::{Kernel, Simd8};

/// The closest hits of rays, given with origin and direction: distance and triangle, the lowest number on a tie.
pub(crate) struct Closest<'a> {
    pub(crate) bvh: &'a MeshBvh,
    pub(crate) rays: &'a [[Vec3; 2]],
    /// Look at every block.
    pub(crate) every_block: bool,
}

/// What rays found.
#[derive(Default)]
pub(crate) struct Found {
    pub(crate) hits: Vec<(f32, u32)>,
    /// Nodes and blocks that were tested.
    pub(crate) tests: [u64; 2],
}

impl Kernel for Closest<'_> {
    type Output = Found;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> Self::Output {
        let mut entries = vec![0; stack_entries(self.bvh.levels)];
        let mut found = Found::default();
        for ray in self.rays {
            let best = if self.every_block {
                every_block(simd, self.bvh, *ray)
            } else {
                closest(simd, self.bvh, *ray, &mut entries, &mut found.tests)
            };
            found.hits.push(best);
        }
        found
    }
}

const MISS: (f32, u32) = (f32::INFINITY, u32::MAX);

#[inline(always)]
fn closest<S: Simd8>(
    simd: S,
    bvh: &MeshBvh,
    [origin, direction]: [Vec3; 2],
    entries: &mut [u64],
    tests: &mut [u64; 2],
) -> (f32, u32) {
    let ray = ScaledRay::new(origin * bvh.scale, direction).and_then(|ray| ray.for_triangles(bvh.extent));
    let (Some((boxes, triangles)), Some(mut child)) = (ray, bvh.root) else { return MISS };
    let lanes = RayLanes::new(simd, &boxes, 0.0);
    let memory = Memory::new(&bvh.nodes, &bvh.blocks);
    let mut waiting = Waiting { entries, depth: 0 };
    let mut best = MISS;
    loop {
        tests[usize::from(child.is_leaf())] += 1;
        if child.is_leaf() {
            test(simd, &bvh.blocks[child.index()], &triangles, &mut best);
        } else {
            let node = &bvh.nodes[child.index()];
            let hits = lanes.test(simd, node, best.0.min(f32::MAX));
            let next = waiting.descend::<S, true, false>(simd, (child.index(), node), hits, &memory);
            if let Some(next) = next {
                child = next;
                continue;
            }
        }
        match waiting.pop(0, best.0) {
            Some(next) => child = next,
            None => return best,
        }
    }
}

#[inline(always)]
fn every_block<S: Simd8>(simd: S, bvh: &MeshBvh, [origin, direction]: [Vec3; 2]) -> (f32, u32) {
    let ray = ScaledRay::new(origin * bvh.scale, direction).and_then(|ray| ray.for_triangles(bvh.extent));
    let mut best = MISS;
    if let Some((_, triangles)) = ray {
        bvh.blocks.iter().for_each(|block| test(simd, block, &triangles, &mut best));
    }
    best
}

#[inline(always)]
fn test<S: Simd8>(simd: S, block: &Block8, ray: &vastlight_accel::ray::TriangleRay, best: &mut (f32, u32)) {
    let hits = intersect(simd, block, ray);
    for lane in (0..8).filter(|lane| hits.lanes >> lane & 1 == 1) {
        let hit = (hits.t[lane], block.prims[lane]);
        if hit.0 >= 0.0 && hit < *best {
            *best = hit;
        }
    }
}
