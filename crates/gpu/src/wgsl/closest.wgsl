// The closest hit of each ray with one mesh in pages: a tree of eight-wide nodes above pages of quantised ones (Ylitie,
// Karras, Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs"), walked from near to far.
//#include group
//#include page
//#include ray

const NONE: u32 = 0xffffffffu;
/// In a reference: a node in a page, and not one above.
const IN_PAGE: u32 = 0x80000000u;
/// Nodes above pages, in words.
const TOP_WORDS: u32 = 64u;
const STACK: u32 = 96u;

struct Parameters {
    count: u32,
    root: u32,
    extent: u32,
}

@group(0) @binding(0) var<uniform> parameters: Parameters;
/// Above the pages: by axis, lower or upper, and slot; then children by slot.
@group(0) @binding(1) var<storage, read> nodes: array<u32>;
/// The first node of each subtree in a page, as its word of all pages.
@group(0) @binding(2) var<storage, read> roots: array<u32>;
@group(0) @binding(3) var<storage, read> pages: array<u32>;
/// Origin and least t, direction and greatest t.
@group(0) @binding(4) var<storage, read> rays: array<vec4<f32>>;
/// t, weights of the second and third corner, number of the triangle; all bits of the number where there is none.
@group(0) @binding(5) var<storage, read_write> hits: array<vec4<u32>>;

struct Hit {
    t: f32,
    u: f32,
    v: f32,
    prim: u32,
}

struct Stack {
    nodes: array<u32, STACK>,
    enter: array<f32, STACK>,
    held: u32,
}

/// Puts a node in its place among those of this visit, the nearest on top.
fn push(stack: ptr<function, Stack>, bottom: u32, node: u32, enter: f32) {
    var place = (*stack).held;
    if (place >= STACK) {
        return;
    }
    (*stack).held = place + 1u;
    while (place > bottom && (*stack).enter[place - 1u] < enter) {
        (*stack).nodes[place] = (*stack).nodes[place - 1u];
        (*stack).enter[place] = (*stack).enter[place - 1u];
        place--;
    }
    (*stack).nodes[place] = node;
    (*stack).enter[place] = enter;
}

/// A child's reference as the stack has it.
fn resolve(child: u32) -> u32 {
    if ((child & IN_PAGE) != 0u) {
        return roots[child & ~IN_PAGE] | IN_PAGE;
    }
    return child;
}

fn top_corner(node: u32, side: u32, slot: u32) -> vec3<f32> {
    let at = node * TOP_WORDS + side * 8u + slot;
    return vec3<f32>(bitcast<f32>(nodes[at]), bitcast<f32>(nodes[at + 16u]), bitcast<f32>(nodes[at + 32u]));
}

fn visit_top(ray: MeshRay, node: u32, t_min: f32, t_max: f32, stack: ptr<function, Stack>) {
    let bottom = (*stack).held;
    for (var slot = 0u; slot < 8u; slot++) {
        let child = nodes[node * TOP_WORDS + 48u + slot];
        if (child == NONE) {
            continue;
        }
        let range = box_range(ray, top_corner(node, 0u, slot), top_corner(node, 1u, slot));
        if (max(range.x, t_min) <= min(range.y, t_max)) {
            push(stack, bottom, resolve(child), range.x);
        }
    }
}

/// The byte `i` of each word.
fn bytes_of(words: vec3<u32>, i: u32) -> vec3<f32> {
    return vec3<f32>((words >> vec3<u32>(i * 8u)) & vec3<u32>(255u));
}

/// Planes of four slots along all axes: the words at `at`, and those of the next axes.
fn planes(at: u32) -> vec3<u32> {
    return vec3<u32>(pages[at], pages[at + 4u], pages[at + 8u]);
}

fn visit_leaf(ray: MeshRay, node: u32, run: u32, t_min: f32, hit: ptr<function, Hit>) {
    let cluster = read_cluster(node);
    let first = run & 255u;
    let count = ((run >> 8u) & 7u) + 1u;
    let corners = cluster.corners_at + 3u * first;
    for (var i = 0u; i < count; i++) {
        let a = page_vertex(cluster, corners + i);
        let b = page_vertex(cluster, corners + count + i);
        let c = page_vertex(cluster, corners + 2u * count + i);
        let met = triangle(ray, a, b, c);
        if (met.x == 0.0 || met.y < t_min || met.y > (*hit).t) {
            continue;
        }
        let prim = page_number(cluster, first + i);
        // Of hits at the same place the one with the least number counts.
        if (met.y < (*hit).t || prim < (*hit).prim) {
            *hit = Hit(met.y, met.z, met.w, prim);
        }
    }
}

/// What a slot of a node points to.
fn page_child(node: u32, slot: u32) -> u32 {
    return (pages[node + 16u + (slot >> 1u)] >> ((slot & 1u) * 16u)) & 0xffffu;
}

fn visit_page(ray: MeshRay, node: u32, t_min: f32, hit: ptr<function, Hit>, stack: ptr<function, Stack>) {
    let exponents = pages[node + 3u];
    let step = vec3<f32>(power(exponents & 255u), power((exponents >> 8u) & 255u), power((exponents >> 16u) & 255u));
    let first = vec3<f32>(bitcast<f32>(pages[node]), bitcast<f32>(pages[node + 1u]), bitcast<f32>(pages[node + 2u]));
    let leaves = pages[node + 20u] & 255u;
    var open = exponents >> 24u;
    let bottom = (*stack).held;
    for (var half = 0u; half < 2u; half++) {
        let lower = planes(node + 4u + half);
        let upper = planes(node + 6u + half);
        for (var i = 0u; i < 4u; i++) {
            let slot = half * 4u + i;
            let range = box_range(ray, first + bytes_of(lower, i) * step, first + bytes_of(upper, i) * step);
            let missed = max(range.x, t_min) > min(range.y, (*hit).t);
            if (missed || ((open >> slot) & 1u) == 0u) {
                open &= ~(1u << slot);
            } else if (((leaves >> slot) & 1u) == 0u) {
                open &= ~(1u << slot);
                push(stack, bottom, (node + 1u + page_child(node, slot)) | IN_PAGE, range.x);
            }
        }
    }
    // Leaves together, so that invocations that go side by side wait less for each other.
    while (open != 0u) {
        let slot = firstTrailingBit(open);
        open &= open - 1u;
        visit_leaf(ray, node, page_child(node, slot), t_min, hit);
    }
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= parameters.count) {
        return;
    }
    let start = rays[id.x * 2u];
    let along = rays[id.x * 2u + 1u];
    let ray = mesh_ray(start.xyz, along.xyz, bitcast<f32>(parameters.extent));
    var hit = Hit(along.w, 0.0, 0.0, NONE);
    var stack: Stack;
    if (parameters.root != NONE) {
        stack.nodes[0] = resolve(parameters.root);
        stack.enter[0] = start.w;
        stack.held = 1u;
    }
    while (stack.held > 0u) {
        stack.held--;
        let node = stack.nodes[stack.held];
        if (stack.enter[stack.held] > hit.t) {
            continue;
        }
        if ((node & IN_PAGE) != 0u) {
            visit_page(ray, node & ~IN_PAGE, start.w, &hit, &stack);
        } else {
            visit_top(ray, node, start.w, hit.t, &stack);
        }
    }
    hits[id.x] = vec4<u32>(bitcast<u32>(hit.t), bitcast<u32>(hit.u), bitcast<u32>(hit.v), hit.prim);
}
