// Rays on their way through both levels: instances, then the triangles of their meshes; the walk over eight-wide nodes and
// pages of quantised ones (Ylitie, Karras, Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide
// BVHs"), from near to far. Words are those of `vastlight-trace`, `words`.
//
// Who includes this has the bindings `tree` and `pages`, the part `settled` or `unsettled`, and a function `accepts` that says
// whether a hit counts, of a surface that rays may pass or not.
//#include page
//#include instance_ray

/// In a reference: a leaf of the nodes in `tree`.
const LEAF: u32 = 0x80000000u;
const NODE_WORDS_OF_TREE: u32 = 64u;
const STACK: u32 = 192u;

/// References that wait, the nearest of a visit on top.
struct Stack {
    nodes: array<u32, STACK>,
    enter: array<f32, STACK>,
    held: u32,
}

/// Puts a reference in its place among those of this visit.
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

fn tree_corner(node: u32, side: u32, slot: u32) -> vec3<f32> {
    let at = node * NODE_WORDS_OF_TREE + side * 8u + slot;
    return vec3<f32>(tree_f32(at), tree_f32(at + 16u), tree_f32(at + 32u));
}

/// Puts the children of a full node that the ray meets aside.
fn visit_tree(ray: BoxRay, node: u32, t_min: f32, t_max: f32, stack: ptr<function, Stack>) {
    let bottom = (*stack).held;
    for (var slot = 0u; slot < 8u; slot++) {
        let child = tree[node * NODE_WORDS_OF_TREE + 48u + slot];
        if (child == NONE) {
            continue;
        }
        let range = box_range(ray, tree_corner(node, 0u, slot), tree_corner(node, 1u, slot));
        if (max(range.x, t_min) <= min(range.y, t_max)) {
            push(stack, bottom, child, range.x);
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

/// Tests the triangles of a leaf; whether one became the closest hit.
fn visit_leaf(ray: ptr<function, MeshRay>, node: u32, run: u32, best: ptr<function, Hit>) -> bool {
    let cluster = read_cluster(node);
    let first = run & 255u;
    let count = ((run >> 8u) & 7u) + 1u;
    let corners_at = cluster.corners_at + 3u * first;
    var found = false;
    for (var i = 0u; i < count; i++) {
        let a = page_vertex(cluster, corners_at + i);
        let b = page_vertex(cluster, corners_at + count + i);
        let c = page_vertex(cluster, corners_at + 2u * count + i);
        let met = triangle((*ray).triangles, a, b, c);
        if (reaches(ray, met)) {
            found = takes(ray, met, page_number(cluster, first + i), best) || found;
        }
    }
    return found;
}

/// What a slot of a node points to.
fn page_child(node: u32, slot: u32) -> u32 {
    return (pages[node + 16u + (slot >> 1u)] >> ((slot & 1u) * 16u)) & 0xffffu;
}

/// Goes through a node of a page: leaves at once, nodes aside. Whether there was a closer hit.
fn visit_page(ray: ptr<function, MeshRay>, node: u32, best: ptr<function, Hit>, stack: ptr<function, Stack>) -> bool {
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
            let range = box_range((*ray).boxes, first + bytes_of(lower, i) * step, first + bytes_of(upper, i) * step);
            let missed = max(range.x, (*ray).t_min) > min(range.y, (*ray).t_max);
            if (missed || ((open >> slot) & 1u) == 0u) {
                open &= ~(1u << slot);
            } else if (((leaves >> slot) & 1u) == 0u) {
                open &= ~(1u << slot);
                push(stack, bottom, (node + 1u + page_child(node, slot)) | LEAF, range.x);
            }
        }
    }
    // Leaves together, so that invocations that go side by side wait less for each other.
    var found = false;
    while (open != 0u) {
        let slot = firstTrailingBit(open);
        open &= open - 1u;
        found = visit_leaf(ray, node, page_child(node, slot), best) || found;
    }
    return found;
}

/// Goes through an instance, all of it or with `any` until there is a hit; whether there was a closer one.
fn cross_instance(
    world: WorldRay, instance: u32, any: bool, best: ptr<function, Hit>, stack: ptr<function, Stack>
) -> bool {
    var ray = mesh_ray(world, instance, (*best).t);
    if (!ray.fits || ray.root == NONE) {
        return false;
    }
    let floor = (*stack).held;
    push(stack, floor, ray.root, ray.t_min);
    var found = false;
    while ((*stack).held > floor && !(found && any) && !ends_unsettled(any)) {
        (*stack).held--;
        let node = (*stack).nodes[(*stack).held];
        if ((*stack).enter[(*stack).held] > ray.t_max) {
            continue;
        }
        if ((node & LEAF) != 0u) {
            found = visit_page(&ray, node & ~LEAF, best, stack) || found;
        } else {
            visit_tree(ray.boxes, node, ray.t_min, ray.t_max, stack);
        }
    }
    (*stack).held = floor;
    return found;
}

/// The closest hit of a ray, or with `any` one of its hits.
fn walk(given: WorldRay, any: bool) -> Hit {
    var ray = given;
    ray.t_min = max(ray.t_min, 0.0);
    var best = Hit(ray.t_max, 0.0, 0.0, NONE, NONE);
    let scaled = scaled_ray(ray.origin, ray.direction);
    let root = tree[TREE_ROOT];
    if (!(ray.t_min <= ray.t_max) || !scaled.fits || root == NONE) {
        return best;
    }
    let boxes = box_ray(scaled, tree_f32(TREE_EXTENT), tree_f32(TREE_MARGIN));
    let t_min = ray.t_min / scaled.t_scale;
    var stack: Stack;
    push(&stack, 0u, root, t_min);
    while (stack.held > 0u && !ends_unsettled(any)) {
        stack.held--;
        let node = stack.nodes[stack.held];
        let t_max = min(best.t / scaled.t_scale, FAR);
        if (stack.enter[stack.held] > t_max) {
            continue;
        }
        if ((node & LEAF) == 0u) {
            visit_tree(boxes, node, t_min, t_max, &stack);
        } else if (cross_instance(ray, node & ~LEAF, any, &best, &stack) && any) {
            return best;
        }
    }
    return best;
}
