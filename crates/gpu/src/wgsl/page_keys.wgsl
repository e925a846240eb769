// Which pages deserve their place most, as keys to be sorted: by kind; first those that are asked for, by who asks; then those that
// are there, by how often they were used; then the others. Afterwards nobody asks for any. See the part `page_table`.
//#include group
//#include page_words

struct Parameters {
    pages: u32,
    second: u32,
    third: u32,
    fourth: u32,
    forget: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> page_table: array<u32>;
@group(0) @binding(2) var<storage, read_write> keys: array<u32>;
@group(0) @binding(3) var<storage, read_write> numbers: array<u32>;

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let page = id.x;
    if (page >= parameters.pages) {
        return;
    }
    let at = page * PAGE_WORDS;
    let uses = min(page_table[at + PAGE_USES], MOST_USES);
    var key = KEY_IS_ABSENT;
    if (page_table[at + PAGE_ASKER] != ABSENT_PAGE) {
        key = min(page_table[at + PAGE_ASKER], KEY_IS_THERE - 1u);
    } else if (page_table[at] != ABSENT_PAGE) {
        key = KEY_IS_THERE + MOST_USES - uses;
    }
    let kind =
        u32(page >= parameters.second) + u32(page >= parameters.third) + u32(page >= parameters.fourth);
    keys[page] = (kind << KIND_SHIFT) + key;
    numbers[page] = page;
    page_table[at + PAGE_ASKER] = ABSENT_PAGE;
    if (parameters.forget != 0u) {
        page_table[at + PAGE_USES] = 0u;
    }
}
