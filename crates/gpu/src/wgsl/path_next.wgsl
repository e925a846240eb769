// Turns what a queue of paths holds into the workgroups of the next dispatch over it, counts it, and empties others, a bit each.
//#include group

struct Parameters {
    full: u32,
    empties: u32,
    total: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> tails: array<u32>;
@group(0) @binding(2) var<storage, read_write> workgroups: array<u32>;

@compute @workgroup_size(1)
fn main() {
    let held = tails[parameters.full];
    workgroups[0] = (held + GROUP - 1u) / GROUP;
    workgroups[1] = 1u;
    workgroups[2] = 1u;
    for (var queue = 0u; queue < 32u; queue++) {
        if (((parameters.empties >> queue) & 1u) != 0u) {
            tails[queue] = 0u;
        }
    }
    tails[parameters.total] += held;
}
