// Work queues with one atomic operation a workgroup: Garanzha, Pantaleoni, McAllister 2011, "Simpler and faster HLBVH
// with work queues". Who includes this has a buffer of `tails`: how many entries each queue holds.
//#include group_scan

var<workgroup> queue_first: u32;

/// The place of this invocation's first of `wanted` entries in a queue. To be called by all. The tail counts what was
/// wanted, also where the queue is full.
fn reserve(lane: u32, wanted: u32, queue: u32) -> u32 {
    let place = group_scan(lane, wanted);
    if (lane == 0u) {
        queue_first = atomicAdd(&tails[queue], place.y);
    }
    workgroupBarrier();
    let first = queue_first;
    workgroupBarrier();
    return first + place.x;
}
