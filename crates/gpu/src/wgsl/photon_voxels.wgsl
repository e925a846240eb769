// The first photon of each voxel and the one behind its last, of photons in the order of their voxels: D. Bogolepov, D. Sopin,
// V. Turlapov 2010, "Simulation of caustics in real time", section 2.4. A photon is the first of its voxel where the one before is in
// another, and the last where the next is; so no two invocations write to one place.
//#include group

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> keys: array<u32>;
@group(0) @binding(2) var<storage, read_write> voxels: array<vec2<u32>>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    for (var k = 0u; k < ITEMS; k++) {
        let i = tile.x * TILE + k * GROUP + lane;
        if (i < parameters.count) {
            let own = keys[i];
            if (i == 0u || keys[max(i, 1u) - 1u] != own) {
                voxels[own].x = i;
            }
            if (i + 1u == parameters.count || keys[min(i + 1u, parameters.count - 1u)] != own) {
                voxels[own].y = i + 1u;
            }
        }
    }
}
