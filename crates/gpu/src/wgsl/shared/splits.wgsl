// The splits of a tree. Who includes this has `spans: array<vec2<u32>>` and `starting: array<atomic<u32>>`.

/// Notes the node of the run `first..end`, whose left child ends with the element `split`.
fn put_split(first: u32, end: u32, split: u32) {
    spans[split] = vec2<u32>(first, end);
    atomicAdd(&starting[first], 1u);
}
