// Regions of cells of a level of detail, and the plane of least cost through one: A4 of the grid builder. Level 0 has 1024 cells a
// side, and each level half as many as the one below.
//#include morton
//#include whole_numbers

/// Coarsest level of detail, 8 cells a side.
const COARSEST: u32 = 7u;

/// Cells from `low` to `high`, at most eight a side.
struct Region {
    low: array<u32, 3>,
    high: array<u32, 3>,
    level: u32,
}

/// A plane: bins up to `last` go left, with `count` elements; `axis` 3 for none.
struct Plane {
    axis: u32,
    last: u32,
    count: u32,
}

/// Elements in the bins of each axis, and which bins of the next axis, and of the one after that, have any together with each.
var<private> bin_counts: array<u32, 24>;
var<private> bin_rows: array<u32, 24>;

fn pack_region(r: Region) -> vec2<u32> {
    let low = r.low[0] | (r.low[1] << 10u) | (r.low[2] << 20u);
    let x = r.high[0] - r.low[0];
    let y = r.high[1] - r.low[1];
    let z = r.high[2] - r.low[2];
    return vec2<u32>(low, x | (y << 3u) | (z << 6u) | (r.level << 9u));
}

fn unpack_region(words: vec2<u32>) -> Region {
    let low = array<u32, 3>(words.x & 1023u, (words.x >> 10u) & 1023u, words.x >> 20u);
    let x = low[0] + (words.y & 7u);
    let y = low[1] + ((words.y >> 3u) & 7u);
    let z = low[2] + ((words.y >> 6u) & 7u);
    return Region(low, array<u32, 3>(x, y, z), words.y >> 9u);
}

/// The number of a cell of its level: the upper bits of the codes in it.
fn cell_number(x: u32, y: u32, z: u32) -> u32 {
    return (spread(x) << 2u) | (spread(y) << 1u) | spread(z);
}

/// The same region by finer cells, where at most four a side become at most eight.
fn refined(region: Region, finest: u32) -> Region {
    var r = region;
    var side = 0u;
    for (var axis = 0u; axis < 3u; axis++) {
        side = max(side, r.high[axis] - r.low[axis] + 1u);
    }
    for (; side <= 4u && r.level > finest; side *= 2u) {
        for (var axis = 0u; axis < 3u; axis++) {
            r.low[axis] = 2u * r.low[axis];
            r.high[axis] = 2u * r.high[axis] + 1u;
        }
        r.level--;
    }
    return r;
}

fn clear_bins() {
    for (var i = 0u; i < 24u; i++) {
        bin_counts[i] = 0u;
        bin_rows[i] = 0u;
    }
}

/// Counts what a cell holds, by its place in the region.
fn add_cell(place: vec3<u32>, held: u32) {
    let x = place.x;
    let y = 8u + place.y;
    let z = 16u + place.z;
    bin_counts[x] += held;
    bin_counts[y] += held;
    bin_counts[z] += held;
    bin_rows[x] |= (1u << place.y) | (256u << place.z);
    bin_rows[y] |= (1u << place.z) | (256u << place.x);
    bin_rows[z] |= (1u << place.x) | (256u << place.y);
}

/// What of a region is in the bins `from_bin..end_bin` of an axis, as tight as cells tell.
fn tight_part(region: Region, axis: u32, from_bin: u32, end_bin: u32) -> Region {
    var own = 0u;
    var others = 0u;
    for (var bin = from_bin; bin < end_bin; bin++) {
        let row = bin_rows[8u * axis + bin];
        own |= select(0u, 1u << bin, row != 0u);
        others |= row;
    }
    var r = region;
    var masks = array<u32, 3>(own, others & 255u, others >> 8u);
    for (var k = 0u; k < 3u; k++) {
        let of_axis = (axis + k) % 3u;
        r.high[of_axis] = r.low[of_axis] + firstLeadingBit(masks[k]);
        r.low[of_axis] += firstTrailingBit(masks[k]);
    }
    return r;
}

/// Length of the span between the lowest and the highest bit.
fn span_of(mask: u32) -> u32 {
    return select(firstLeadingBit(mask) - firstTrailingBit(mask) + 1u, 0u, mask == 0u);
}

/// Elements times the area of the box around what is in the rows `others` and `own`, low and high word. Exact: sizes of cells are
/// at most 4095.
fn side_cost(count: u32, own: u32, others: u32, sizes: array<u32, 3>) -> vec2<u32> {
    let a = span_of(own) * sizes[0];
    let b = span_of(others & 255u) * sizes[1];
    let c = span_of(others >> 8u) * sizes[2];
    return u64_of_words(a * b + b * c + c * a, count);
}

fn is_less(a: vec2<u32>, b: vec2<u32>) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

/// The plane of least cost through what was counted, the first of several; cells have these sizes.
fn best_plane(total: u32, cell_sizes: array<u32, 3>) -> Plane {
    var sizes = cell_sizes;
    var best = Plane(3u, 0u, 0u);
    var least = vec2<u32>(0xffffffffu);
    for (var axis = 0u; axis < 3u; axis++) {
        let turned = array<u32, 3>(sizes[axis], sizes[(axis + 1u) % 3u], sizes[(axis + 2u) % 3u]);
        var right: array<vec2<u32>, 8>;
        var count = 0u;
        var own = 0u;
        var others = 0u;
        for (var bin = 7u; bin > 0u; bin--) {
            count += bin_counts[8u * axis + bin];
            own |= select(0u, 1u << bin, bin_counts[8u * axis + bin] != 0u);
            others |= bin_rows[8u * axis + bin];
            right[bin] = side_cost(count, own, others, turned);
        }
        count = 0u;
        own = 0u;
        others = 0u;
        for (var bin = 0u; bin < 7u; bin++) {
            count += bin_counts[8u * axis + bin];
            own |= select(0u, 1u << bin, bin_counts[8u * axis + bin] != 0u);
            others |= bin_rows[8u * axis + bin];
            let left = side_cost(count, own, others, turned);
            let cost = u64_sum(left, right[bin + 1u]);
            if (count > 0u && count < total && is_less(cost, least)) {
                least = cost;
                best = Plane(axis, bin, count);
            }
        }
    }
    return best;
}
