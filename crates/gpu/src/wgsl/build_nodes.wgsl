// The nodes of a tree whose splits are known: numbers, depth first, and boxes. A pair of children is followed by all that is below
// the left one, and this by all that is below the right one.
//
// The place of a node's children follows from how many nodes come before it in that order: all that start at an element further left,
// and those that start where it does and are longer. These are found by going up as long as a node is a left child.
//#include range_box
//#include tree_node
//#include group

struct Parameters {
    count: u32,
    most: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
@group(0) @binding(1) var<storage, read> spans: array<vec2<u32>>;
/// How many nodes with children start further left than each element.
@group(0) @binding(2) var<storage, read> before: array<u32>;
@group(0) @binding(3) var<storage, read> pyramid: array<Box>;
@group(0) @binding(4) var<storage, read_write> nodes: array<Node>;

fn put(place: u32, first: u32, end: u32, left: u32) {
    let around = range_box(first, end, parameters.most);
    nodes[place] = Node(coordinates(around), left, first, end - first);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = parameters.count;
    let split = id.x;
    if (split >= count) {
        return;
    }
    if (split == 0u && before[count] == 0u) {
        put(0u, 0u, count, 0u);
    }
    let span = spans[split];
    if (span.y == 0u) {
        return;
    }
    if (span.x == 0u && span.y == count) {
        put(0u, 0u, count, 1u);
    }
    var longer = 0u;
    var end = span.y;
    while (end < count) {
        let above = spans[end - 1u];
        if (above.x != span.x || above.y <= end) {
            break;
        }
        end = above.y;
        longer++;
    }
    let pair = 1u + 2u * (before[span.x] + longer);
    let has_left = before[span.x + 1u] > before[span.x] + longer + 1u;
    let middle = split + 1u;
    let has_right = before[middle + 1u] > before[middle];
    put(pair, span.x, middle, select(0u, pair + 2u, has_left));
    put(pair + 1u, middle, span.y, select(0u, 1u + 2u * before[middle], has_right));
}
