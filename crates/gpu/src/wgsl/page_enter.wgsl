// Writes where pages are now, or that they are not there.
//#include group
//#include page_words

struct Parameters {
    count: u32,
    uses: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> page_table: array<u32>;
/// Page and place.
@group(0) @binding(2) var<storage, read> changes: array<vec2<u32>>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x < parameters.count) {
        let at = changes[id.x].x * PAGE_WORDS;
        page_table[at] = changes[id.x].y;
        page_table[at + PAGE_USES] = parameters.uses;
    }
}
