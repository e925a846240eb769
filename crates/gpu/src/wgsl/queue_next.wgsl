// Turns what a queue holds into the workgroups of the next dispatch over it, and empties the queue that is filled next.
//#include group

struct Parameters {
    capacity: u32,
    full: u32,
    empty: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> tails: array<u32>;
@group(0) @binding(2) var<storage, read_write> workgroups: array<u32>;

@compute @workgroup_size(1)
fn main() {
    let held = min(tails[parameters.full], parameters.capacity);
    workgroups[0] = (held + GROUP - 1u) / GROUP;
    workgroups[1] = 1u;
    workgroups[2] = 1u;
    tails[parameters.empty] = 0u;
}
