// Answers of batches of rays: whether they meet anything.

/// 1 or 0.
@group(0) @binding(6) var<storage, read_write> blocked: array<u32>;

fn answered(ray: u32) -> bool {
    let met = trace(ray, true).prim != NONE;
    blocked[ray] = u32(met);
    return met || !is_unsettled();
}
