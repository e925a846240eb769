// Random numbers of samples, and hashes of words, for records of five words.
//#include random

struct Parameters {
    count: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read_write> answers: array<u32>;
@group(0) @binding(2) var<storage, read> records: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let at = id.x * 5u;
    let pixel_hash = hash_pair(records[at], records[at + 1u]);
    let sampler = Sampler(hash_more(pixel_hash, records[at + 3u]), reverseBits(records[at + 2u]));
    let drawn = point_at(sampler, records[at + 4u]);
    let answer = id.x * 5u;
    answers[answer] = sampler.key.x;
    answers[answer + 1u] = sampler.key.y;
    answers[answer + 2u] = bitcast<u32>(drawn.x);
    answers[answer + 3u] = bitcast<u32>(drawn.y);
    answers[answer + 4u] = bitcast<u32>(hash_to_unit(records[at], records[at + 2u], records[at + 4u]));
}
