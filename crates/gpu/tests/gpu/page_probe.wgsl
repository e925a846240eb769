// What the shared part `page_table` answers, and what it leaves in the table: a page of its own for each record.
//#include page_table

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> answers: array<u32>;
/// Whether pages are held.
@group(0) @binding(2) var<storage, read> records: array<u32>;
@group(0) @binding(3) var<storage, read_write> page_table: array<atomic<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    asker = id.x;
    holds = records[id.x] != 0u;
    answers[id.x * 4u] = page_at(id.x);
    answers[id.x * 4u + 1u] = u32(lacks);
    answers[id.x * 4u + 2u] = atomicLoad(&page_table[id.x * PAGE_WORDS + PAGE_ASKER]);
    answers[id.x * 4u + 3u] = atomicLoad(&page_table[id.x * PAGE_WORDS + PAGE_USES]);
}
