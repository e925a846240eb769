// Values whose flag is set, one after the other.
//#include compact
//#include select_emit

@group(0) @binding(2) var<storage, read> values: array<u32>;
@group(0) @binding(3) var<storage, read> firsts: array<u32>;
@group(0) @binding(4) var<storage, read_write> kept: array<u32>;

fn emit(i: u32, place: u32) {
    kept[place] = values[i];
}

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    emit_selected(lane, tile.x, parameters.count, firsts[tile.x]);
}
