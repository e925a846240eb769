// The words of pages on the device, in one binding. Who includes this has `pool_a`.

fn pool_word(at: u32) -> u32 {
    return pool_a[at];
}
