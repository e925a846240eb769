//! Reading ahead: triangles that will be shaded soon are asked of the caches in two steps, indices and then corners, so
//! that shading does not wait for memory.

use crate::surface::mesh_of;
use vastlight_scene::Scene;
use vastlight_simd::Simd8;
use vastlight_trace::Hit;

/// Hits between asking for a triangle's indices and its corners, and again until it is shaded.
const STEP: usize = 12;

/// Asks for what the hit `2 * STEP` and the one `STEP` places behind the one number `met[i]` need.
#[inline(always)]
pub(super) fn fetch_ahead<L: Simd8>(level: L, scene: &Scene, hits: &[Hit], met: &[u32], i: usize) {
    if let Some(&later) = met.get(i + 2 * STEP) {
        let hit = &hits[later as usize];
        if let Some(triangle) = mesh_of(scene, hit).triangles.get(hit.prim as usize) {
            level.prefetch::<1>((&raw const *triangle).cast());
        }
    }
    if let Some(&later) = met.get(i + STEP) {
        let hit = &hits[later as usize];
        let mesh = mesh_of(scene, hit);
        for &corner in mesh.triangles.get(hit.prim as usize).into_iter().flatten() {
            level.prefetch::<1>((&raw const mesh.positions[corner as usize]).cast());
            if let Some(normal) = mesh.normals.get(corner as usize) {
                level.prefetch::<1>((&raw const *normal).cast());
            }
        }
    }
}
