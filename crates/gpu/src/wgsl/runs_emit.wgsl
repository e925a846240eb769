// Key and start of each run of equal keys; behind the last start, the number of keys.
//#include runs
//#include select_emit

@group(0) @binding(2) var<storage, read> firsts: array<u32>;
@group(0) @binding(3) var<storage, read_write> run_keys: array<u32>;
@group(0) @binding(4) var<storage, read_write> starts: array<u32>;

fn emit(i: u32, place: u32) {
    run_keys[place] = keys[i] >> parameters.shift;
    starts[place] = i;
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) tile: vec3<u32>,
    @builtin(num_workgroups) tiles: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    emit_selected(lane, tile.x, parameters.count, firsts[tile.x]);
    if (tile.x == 0u && lane == 0u) {
        starts[firsts[tiles.x]] = parameters.count;
    }
}
