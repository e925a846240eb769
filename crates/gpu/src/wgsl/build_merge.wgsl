// A tree over sorted codes from the bottom up, in one pass: Apetrei 2014, "Fast and simple agglomerative LBVH construction".
//
// An invocation starts at each element and goes up. A node's parent is on the side where the codes are closer to each
// other; it has the number of its split, the last element on its left. Of two siblings the first to come leaves there
// where they end on the outer side, and stops; the second goes on with both. What they tell each other is one word, exchanged by one atomic
// operation: WGSL promises nothing about the order in which others see anything else. Boxes come later.
//#include group
//#include place_of
//#include splits

struct Parameters {
    count: u32,
    leaf: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> codes: array<u32>;
/// For each split what the first of two siblings left: the outer element of its run, and one more; zeros at first.
@group(0) @binding(2) var<storage, read_write> left_behind: array<atomic<u32>>;
/// For each split that is one of the tree, the start and the end of its node's run; zeros at first.
@group(0) @binding(3) var<storage, read_write> spans: array<vec2<u32>>;
/// How many nodes start at each element; zeros at first.
@group(0) @binding(4) var<storage, read_write> starting: array<atomic<u32>>;

/// After how many halvings of a run of `length` elements (x) the element `i` and the next one are parted, and how many
/// elements were together with them until then (y).
fn halved(i: u32, length: u32) -> vec2<u32> {
    var low = 0u;
    var rest = length;
    var depth = 0u;
    while (rest > 1u) {
        let middle = low + rest / 2u;
        if (middle == i + 1u) {
            break;
        }
        if (middle > i) {
            rest /= 2u;
        } else {
            low = middle;
            rest -= rest / 2u;
        }
        depth++;
    }
    return vec2<u32>(depth, rest);
}

/// Whether the split behind element `right` is below the one behind `left`, in the tree; elements between them have
/// codes that are closer to each other.
fn is_below(right: u32, left: u32) -> bool {
    let code = codes[right];
    let differ = code ^ codes[right + 1u];
    let differ_left = codes[left] ^ codes[left + 1u];
    if ((differ | differ_left) != 0u) {
        return differ < differ_left;
    }
    // All codes from `left` to behind `right` are the same: they are halved.
    let first = place_of(code, 0u, parameters.count);
    let length = place_of(code + 1u, first, parameters.count) - first;
    return halved(right - first, length).x > halved(left - first, length).x;
}

/// Whether the node above a run, which is its left or its right child, holds more than `most` elements; `most` is no less than
/// the run has.
fn is_parent_longer(first: u32, last: u32, is_left: bool, most: u32) -> bool {
    let split = select(first - 1u, last, is_left);
    let differ = codes[split] ^ codes[split + 1u];
    if (differ == 0u) {
        let start = place_of(codes[split], 0u, parameters.count);
        let length = place_of(codes[split] + 1u, start, parameters.count) - start;
        return halved(split - start, length).y > most;
    }
    // The element that is one too far, and the one at the near end.
    let beyond = select((last < most), (first + most >= parameters.count), is_left);
    if (beyond) {
        return false;
    }
    let far = codes[select(last - most, first + most, is_left)];
    return countLeadingZeros(far ^ codes[select(last, first, is_left)]) == countLeadingZeros(differ);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = parameters.count;
    if (id.x >= count) {
        return;
    }
    var first = id.x;
    var last = id.x;
    var split = 0u;
    loop {
        let is_root = first == 0u && last + 1u == count;
        let is_left = first == 0u || (last + 1u < count && is_below(last, first - 1u));
        let length = last + 1u - first;
        if (length > 2u * parameters.leaf) {
            put_split(first, last + 1u, split);
        } else if (length > parameters.leaf) {
            // A run that two leaves can hold is parted so that two do, as near as possible to its split.
            if (is_root || is_parent_longer(first, last, is_left, 2u * parameters.leaf)) {
                let left = clamp(split + 1u - first, length - parameters.leaf, parameters.leaf);
                put_split(first, last + 1u, first + left - 1u);
            }
        }
        if (is_root) {
            break;
        }
        split = select(first - 1u, last, is_left);
        let other = atomicExchange(&left_behind[split], select(last, first, is_left) + 1u);
        if (other == 0u) {
            break;
        }
        if (is_left) {
            last = other - 1u;
        } else {
            first = other - 1u;
        }
    }
}
