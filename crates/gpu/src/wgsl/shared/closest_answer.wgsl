// Answers of batches of rays: closest hits.

/// t, weights of the second and third corner, instance, triangle; all bits of these where there is none.
@group(0) @binding(6) var<storage, read_write> hits: array<u32>;

fn answered(ray: u32) -> bool {
    let hit = trace(ray, false);
    let at = ray * 5u;
    hits[at] = bitcast<u32>(hit.t);
    hits[at + 1u] = bitcast<u32>(hit.u);
    hits[at + 2u] = bitcast<u32>(hit.v);
    hits[at + 3u] = hit.instance;
    hits[at + 4u] = hit.prim;
    return !is_unsettled();
}
