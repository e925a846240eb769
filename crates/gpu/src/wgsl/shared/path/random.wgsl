// Random numbers without state: hashes (`vastlight-math`, `rng`) and the sampler (`sampler`, `sobol`), the same bits as there.
//#include whole_numbers

/// The words of 0x9e3779b97f4a7c15, low and high.
const RANDOM_STEP: vec2<u32> = vec2<u32>(0x7f4a7c15u, 0x9e3779b9u);

/// A permutation of the numbers of 64 bits.
fn hash_u64(given: vec2<u32>) -> vec2<u32> {
    var x = given;
    x = u64_product(x ^ u64_shifted_right(x, 30u), vec2<u32>(0x1ce4e5b9u, 0xbf58476du));
    x = u64_product(x ^ u64_shifted_right(x, 27u), vec2<u32>(0x133111ebu, 0x94d049bbu));
    return x ^ u64_shifted_right(x, 31u);
}

/// The hash of the words that gave `hash` followed by `word`.
fn hash_more(hash: vec2<u32>, word: u32) -> vec2<u32> {
    let turned = u64_shifted_left(hash, 23u) | u64_shifted_right(hash, 41u);
    return hash_u64(turned ^ vec2<u32>(word, 0u));
}

fn hash_pair(a: u32, b: u32) -> vec2<u32> {
    return hash_more(hash_more(RANDOM_STEP, a), b);
}

fn unit_f32(x: u32) -> f32 {
    return f32(x >> 8u) * (1.0 / 16777216.0);
}

/// A number in [0, 1) that depends on three words.
fn hash_to_unit(a: u32, b: u32, c: u32) -> f32 {
    return unit_f32(hash_more(hash_pair(a, b), c).y);
}

/// Numbers for one sample of one pixel.
struct Sampler {
    key: vec2<u32>,
    index_reversed: u32,
}

fn owen_reversed(given: u32, seed: u32) -> u32 {
    var x = given ^ (given * 0x3d20adeau);
    x = (x + seed) * ((seed >> 16u) | 1u);
    x = x ^ (x * 0x05526c56u);
    return x ^ (x * 0x53a22864u);
}

fn second_dimension_reversed(index: u32) -> u32 {
    var x = index ^ ((index & 0xaaaaaaaau) >> 1u);
    x = x ^ ((x & 0xccccccccu) >> 2u);
    x = x ^ ((x & 0xf0f0f0f0u) >> 4u);
    x = x ^ ((x & 0xff00ff00u) >> 8u);
    return x ^ (x >> 16u);
}

fn to_unit(reversed: u32) -> f32 {
    return unit_f32(reverseBits(reversed));
}

/// The point at a dimension; its x is also the number there.
fn point_at(sampler: Sampler, dimension: u32) -> vec2<f32> {
    let step = u64_product(vec2<u32>(dimension + 1u, 0u), RANDOM_STEP);
    let h = hash_u64(u64_sum(sampler.key, step));
    let shuffle = u64_product(h, vec2<u32>(0xde82ef95u, 0xd1342543u)).y;
    let index = reverseBits(owen_reversed(sampler.index_reversed, shuffle));
    return vec2<f32>(
        to_unit(owen_reversed(index, h.x)),
        to_unit(owen_reversed(second_dimension_reversed(index), h.y)),
    );
}
