// Pages of the compact layout, read as words: see `vastlight-accel`, `compact`. A node has 23 words; behind a node with
// leaves stand an anchor of four and the cluster of their triangles. Who includes this has a function `pool_word`.

const NODE_WORDS: u32 = 23u;
const ANCHOR_WORDS: u32 = 4u;

/// The byte at this place of the pool.
fn page_byte(at: u32) -> u32 {
    return (pool_word(at >> 2u) >> ((at & 3u) * 8u)) & 255u;
}

/// `count` bits (at most 32) from the bit `bit` behind the byte `at` on.
fn page_bits(at: u32, bit: u32, count: u32) -> u32 {
    let first = bit + (at & 3u) * 8u;
    let word = (at >> 2u) + (first >> 5u);
    let shift = first & 31u;
    var bits = pool_word(word) >> shift;
    if (shift + count > 32u) {
        bits |= pool_word(word + 1u) << (32u - shift);
    }
    if (count >= 32u) {
        return bits;
    }
    return bits & ((1u << count) - 1u);
}

/// The power of two with these exponent bits.
fn power(exponent: u32) -> f32 {
    return bitcast<f32>(exponent << 23u);
}

/// How the cluster behind a node is packed.
struct Cluster {
    corner: vec3<f32>,
    step: vec3<f32>,
    bits: vec3<u32>,
    /// Bytes of a vertex.
    stride: u32,
    /// Places in bytes of the pool.
    corners_at: u32,
    vertices_at: u32,
    numbers_at: u32,
    number_bits: u32,
    least_number: u32,
}

fn read_cluster(node: u32) -> Cluster {
    let a = pool_word(node + 20u);
    let b = pool_word(node + 21u);
    let c = pool_word(node + 22u);
    let anchor = node + NODE_WORDS;
    var cluster: Cluster;
    cluster.corner = vec3<f32>(
        bitcast<f32>(pool_word(anchor)),
        bitcast<f32>(pool_word(anchor + 1u)),
        bitcast<f32>(pool_word(anchor + 2u)),
    );
    cluster.least_number = pool_word(anchor + 3u);
    cluster.step = vec3<f32>(power(a >> 24u), power(b & 255u), power((b >> 8u) & 255u));
    cluster.bits = min(vec3<u32>((b >> 16u) & 255u, b >> 24u, c & 255u), vec3<u32>(24u));
    cluster.stride = (cluster.bits.x + cluster.bits.y + cluster.bits.z + 7u) / 8u;
    cluster.number_bits = min(c >> 24u, 32u);
    cluster.corners_at = (anchor + ANCHOR_WORDS) * 4u;
    cluster.vertices_at = cluster.corners_at + 3u * ((c >> 8u) & 255u);
    cluster.numbers_at = cluster.vertices_at + ((c >> 16u) & 255u) * cluster.stride;
    return cluster;
}

/// The vertex that the byte at `at` names.
fn page_vertex(cluster: Cluster, at: u32) -> vec3<f32> {
    let vertex = cluster.vertices_at + page_byte(at) * cluster.stride;
    let bits = cluster.bits;
    let offset = vec3<u32>(
        page_bits(vertex, 0u, bits.x),
        page_bits(vertex, bits.x, bits.y),
        page_bits(vertex, bits.x + bits.y, bits.z),
    );
    // Exact, as the product is.
    return cluster.corner + vec3<f32>(offset) * cluster.step;
}

/// The number in its mesh of the cluster's triangle `i`.
fn page_number(cluster: Cluster, i: u32) -> u32 {
    return cluster.least_number + page_bits(cluster.numbers_at, i * cluster.number_bits, cluster.number_bits);
}

/// A triangle in a page: its node, the leaf's slot of the node, the number in the leaf, and the page.
struct PageTriangle {
    node: u32,
    run: u32,
    i: u32,
    page: u32,
}

/// The place of a triangle in its page.
fn page_place(at: PageTriangle) -> u32 {
    return ((pool_word(at.node + 20u) >> 8u) & 0xffffu) + (at.run & 255u) + at.i;
}

/// A corner of a triangle of a leaf with this cluster.
fn page_corner(cluster: Cluster, at: PageTriangle, corner: u32) -> vec3<f32> {
    let count = ((at.run >> 8u) & 7u) + 1u;
    return page_vertex(cluster, cluster.corners_at + 3u * (at.run & 255u) + corner * count + at.i);
}
