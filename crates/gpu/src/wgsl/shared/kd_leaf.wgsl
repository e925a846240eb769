// The triangles in a leaf of a kd-tree. Who includes this has what `kd` asks for, and the binding `blocks`: blocks of eight triangles.
//#include kd

const KD_BLOCK_WORDS: u32 = 80u;

/// The intersection of the stream tracer: tests the triangles of the leaf at which a ray stands; whether one is a closer hit.
fn kd_test(ray: ptr<function, MeshRay>, leaf: u32, best: ptr<function, Hit>) -> bool {
    let first = tree[leaf * KD_NODE_WORDS + 7u] & KD_INDEX;
    let lanes = tree[leaf * KD_NODE_WORDS + 6u] * 8u;
    var found = false;
    for (var lane = 0u; lane < lanes; lane++) {
        let at = (first + lane / 8u) * KD_BLOCK_WORDS + lane % 8u;
        let prim = blocks[at + 72u];
        if (prim == NONE) {
            break;
        }
        let met = triangle((*ray).triangles, kd_corner(at), kd_corner(at + 24u), kd_corner(at + 48u));
        if (reaches(ray, met)) {
            found = takes(ray, met, prim, best) || found;
        }
    }
    return found;
}

fn kd_corner(at: u32) -> vec3<f32> {
    return vec3<f32>(bitcast<f32>(blocks[at]), bitcast<f32>(blocks[at + 8u]), bitcast<f32>(blocks[at + 16u]));
}
