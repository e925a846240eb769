// Queues of paths: the queue of a number has room for `parameters.capacity` slots. Who includes this has `queues`, the part
// `page_table`, and what the part `queue` asks for.
//#include queue

/// The path number `i` of the queue that is worked off: it is who asks for pages.
fn take_path(i: u32) -> u32 {
    asker = queues[parameters.full * parameters.capacity + i];
    holds = parameters.again != 0u;
    return asker;
}

/// Appends the slots of those invocations that want it. To be called by all.
fn enqueue(lane: u32, number: u32, slot: u32, wanted: bool) {
    let place = reserve(lane, u32(wanted), number);
    if (wanted) {
        queues[number * parameters.capacity + place] = slot;
    }
}
