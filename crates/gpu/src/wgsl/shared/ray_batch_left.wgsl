// The second kernel over a batch of rays: those that the first one leaves. Who includes this has a function `answered` that puts what a
// ray meets into its place.
//#include accept_all
//#include group
//#include ray_batch
//#include settled

/// The rays that are left, and how many of them there are.
@group(0) @binding(7) var<storage, read> left: array<u32>;
@group(0) @binding(8) var<storage, read> tails: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x < min(tails[0], parameters.count)) {
        _ = answered(left[id.x]);
    }
}
