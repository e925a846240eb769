// What has to change so that the pages that deserve it most are there: marks those that are to come, in the order of their merit,
// and those that may leave, in the opposite order. `keys` and `numbers` are sorted.
//#include group
//#include page_words

struct Parameters {
    pages: u32,
    second: u32,
    third: u32,
    fourth: u32,
    slots_of_first: u32,
    slots_of_second: u32,
    slots_of_third: u32,
    slots_of_fourth: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> page_table: array<u32>;
@group(0) @binding(2) var<storage, read> keys: array<u32>;
@group(0) @binding(3) var<storage, read> numbers: array<u32>;
@group(0) @binding(4) var<storage, read_write> comes: array<u32>;
@group(0) @binding(5) var<storage, read_write> leaves: array<u32>;
@group(0) @binding(6) var<storage, read_write> backwards: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= parameters.pages) {
        return;
    }
    let firsts = vec4<u32>(0u, parameters.second, parameters.third, parameters.fourth);
    let slots = vec4<u32>(parameters.slots_of_first, parameters.slots_of_second, parameters.slots_of_third,
        parameters.slots_of_fourth);
    let kind = keys[i] >> KIND_SHIFT;
    let is_wanted = (keys[i] & (2u * KEY_IS_ABSENT - 1u)) != KEY_IS_ABSENT;
    let has_place = is_wanted && i - firsts[kind] < slots[kind];
    let is_there = page_table[numbers[i] * PAGE_WORDS] != ABSENT_PAGE;
    comes[i] = u32(has_place && !is_there);
    let mirrored = parameters.pages - 1u - i;
    leaves[mirrored] = u32(is_there && !has_place);
    backwards[mirrored] = numbers[i];
}
