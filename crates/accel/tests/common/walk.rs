//! Rays through one wide tree, the plainest way; and by trying every triangle.
#![allow(dead_code, reason = "each file uses a part")]

use vastlight_accel::ray::{BoxRay, ScaledRay, TriangleRay};
use vastlight_accel::triangle::intersect;
use vastlight_accel::wide::traverse::{Memory, RayLanes, Waiting, stack_entries};
use vastlight_accel::wide::{Block8, MeshBvh};
use vastlight_math::Vec3;
use vastlight_simd::{Kernel, Portable, Simd8};

/// A closest hit: distance and triangle, the lowest number on a tie.
pub(crate) type Hit = (f32, u32);

/// What a ray has that hits nothing.
pub(crate) const MISS: Hit = (f32::INFINITY, u32::MAX);

/// The closest hits of rays, given with origin and direction.
pub(crate) struct Closest<'a> {
    pub(crate) bvh: &'a MeshBvh,
    pub(crate) rays: &'a [[Vec3; 2]],
    /// Look at every block.
    pub(crate) every_block: bool,
}

/// What rays found.
#[derive(Default)]
pub(crate) struct Found {
    pub(crate) hits: Vec<Hit>,
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
            let [origin, direction] = *ray;
            let scaled = ScaledRay::new(origin * self.bvh.scale, direction);
            let best = match scaled.and_then(|ray| ray.for_triangles(self.bvh.extent)) {
                None => MISS,
                Some(ray) if self.every_block => every_block(simd, self.bvh, &ray.1),
                Some(ray) => closest(simd, self.bvh, &ray, &mut entries, &mut found.tests),
            };
            found.hits.push(best);
        }
        found
    }
}

/// The closest hit of a ray in the tree's space.
pub(crate) fn closest_hit(bvh: &MeshBvh, ray: &(BoxRay, TriangleRay)) -> Hit {
    closest(Portable, bvh, ray, &mut vec![0; stack_entries(bvh.levels)], &mut [0; 2])
}

/// Takes the hits of a block into account.
#[inline(always)]
pub(crate) fn meet<S: Simd8>(simd: S, block: &Block8, ray: &TriangleRay, best: &mut Hit) {
    let hits = intersect(simd, block, ray);
    for lane in (0..8).filter(|lane| hits.lanes >> lane & 1 == 1) {
        let hit = (hits.t[lane], block.prims[lane]);
        if hit.0 >= 0.0 && hit < *best {
            *best = hit;
        }
    }
}

#[inline(always)]
fn closest<S: Simd8>(
    simd: S,
    bvh: &MeshBvh,
    (boxes, triangles): &(BoxRay, TriangleRay),
    entries: &mut [u64],
    tests: &mut [u64; 2],
) -> Hit {
    let Some(mut child) = bvh.root else { return MISS };
    let lanes = RayLanes::new(simd, boxes, 0.0);
    let memory = Memory::new(&bvh.nodes, &bvh.blocks);
    let mut waiting = Waiting { entries, depth: 0 };
    let mut best = MISS;
    loop {
        tests[usize::from(child.is_leaf())] += 1;
        if child.is_leaf() {
            meet(simd, &bvh.blocks[child.index()], triangles, &mut best);
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
fn every_block<S: Simd8>(simd: S, bvh: &MeshBvh, ray: &TriangleRay) -> Hit {
    let mut best = MISS;
    bvh.blocks.iter().for_each(|block| meet(simd, block, ray, &mut best));
    best
}
