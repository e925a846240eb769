// The words of pages on the device, in two bindings, one behind the other. Who includes this has `pool_a` and `pool_b`.

fn pool_word(at: u32) -> u32 {
    let first = arrayLength(&pool_a);
    if (at < first) {
        return pool_a[at];
    }
    return pool_b[at - first];
}
