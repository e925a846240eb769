// Queues of paths: the queue of a number has room for `parameters.capacity` slots. Who includes this has `queues` and what the part
// `queue` asks for.
//#include queue

fn queue_entry(number: u32, i: u32) -> u32 {
    return queues[number * parameters.capacity + i];
}

/// Appends the slots of those invocations that want it. To be called by all.
fn enqueue(lane: u32, number: u32, slot: u32, wanted: bool) {
    let place = reserve(lane, u32(wanted), number);
    if (wanted) {
        queues[number * parameters.capacity + place] = slot;
    }
}
