// The first kernel over a batch of rays: it leaves those that single precision does not settle. Who includes this has a function
// `answered` that puts what a ray meets into its place and says whether that is all.
//#include queue
//#include ray_batch
//#include unsettled

/// The rays that are left, and how many of them there are.
@group(0) @binding(7) var<storage, read_write> left: array<u32>;
@group(0) @binding(8) var<storage, read_write> tails: array<atomic<u32>>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let is_left = id.x < parameters.count && !answered(id.x);
    let place = reserve(lane, u32(is_left), 0u);
    if (is_left) {
        left[place] = id.x;
    }
}
