// Photons gathered into the order of their voxels, behind the header of their map; a word an invocation.
//#include group
//#include photon_grid

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> photons: array<u32>;
@group(0) @binding(2) var<storage, read> order: array<u32>;
@group(0) @binding(3) var<storage, read_write> photon_map: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    for (var k = 0u; k < ITEMS * PHOTON_WORDS; k++) {
        let at = tile.x * TILE * PHOTON_WORDS + k * GROUP + lane;
        if (at < parameters.count * PHOTON_WORDS) {
            let word = order[at / PHOTON_WORDS] * PHOTON_WORDS + at % PHOTON_WORDS;
            photon_map[GRID_WORDS + at] = photons[word];
        }
    }
}
