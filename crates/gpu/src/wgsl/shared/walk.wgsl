// Rays on their way through both levels: instances, then the triangles of their meshes; the walk over eight-wide nodes and
// pages of quantised ones (Ylitie, Karras, Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide
// BVHs"), from near to far. Words are those of `vastlight-trace`, `words`.
//
// Pages may not be there: as in `vastlight-trace`, `paged`, the subtrees in pages have an order for each ray, turns. A walk looks
// through all that are there from the turn `restart` on, and says in `missing` which was the first that is not; the ray walks again
// from there when its page has come.
//
// Who includes this has the binding `tree`, the parts `page_table` and `settled` or `unsettled`, a function `pool_word`, and a
// function `accepts` that says whether a hit counts, of a surface that rays may pass or not; `tested` is where that one is.
//#include page
//#include page_table
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
    return vec3<u32>(pool_word(at), pool_word(at + 4u), pool_word(at + 8u));
}

/// Tests the triangles of a leaf; whether one became the closest hit.
fn visit_leaf(ray: ptr<function, MeshRay>, node: u32, run: u32, page: u32, best: ptr<function, Hit>) -> bool {
    let cluster = read_cluster(node);
    let first = run & 255u;
    let count = ((run >> 8u) & 7u) + 1u;
    var met_any = false;
    for (var i = 0u; i < count; i++) {
        let at = PageTriangle(node, run, i, page);
        let a = page_corner(cluster, at, 0u);
        let b = page_corner(cluster, at, 1u);
        let c = page_corner(cluster, at, 2u);
        let met = triangle((*ray).triangles, a, b, c);
        if (reaches(ray, met)) {
            tested = at;
            if (takes(ray, met, page_number(cluster, first + i), best)) {
                found = at;
                met_any = true;
            }
        }
    }
    return met_any;
}

/// What a slot of a node points to.
fn page_child(node: u32, slot: u32) -> u32 {
    return (pool_word(node + 16u + (slot >> 1u)) >> ((slot & 1u) * 16u)) & 0xffffu;
}

/// Goes through a node of a page: leaves at once, nodes aside. Whether there was a closer hit.
fn visit_page(
    ray: ptr<function, MeshRay>, node: u32, page: u32, best: ptr<function, Hit>, stack: ptr<function, Stack>
) -> bool {
    let exponents = pool_word(node + 3u);
    let step = vec3<f32>(power(exponents & 255u), power((exponents >> 8u) & 255u), power((exponents >> 16u) & 255u));
    let first = vec3<f32>(bitcast<f32>(pool_word(node)), bitcast<f32>(pool_word(node + 1u)), bitcast<f32>(pool_word(node + 2u)));
    let leaves = pool_word(node + 20u) & 255u;
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
                push(stack, bottom, node + 1u + page_child(node, slot), range.x);
            }
        }
    }
    // Leaves together, so that invocations that go side by side wait less for each other.
    var met_any = false;
    while (open != 0u) {
        let slot = firstTrailingBit(open);
        open &= open - 1u;
        met_any = visit_leaf(ray, node, page_child(node, slot), page, best) || met_any;
    }
    return met_any;
}

/// A place in the order in which a ray asks for subtrees: by where it enters them, then by number.
struct Turn {
    /// Bits of a parameter of the ray that is not negative, not above the true one.
    enter: u32,
    instance: u32,
    subtree: u32,
}

/// Subtrees before this turn have been looked through.
var<private> restart: Turn = Turn(0u, 0u, 0u);
/// The first one that could not be.
var<private> missing: Turn = Turn(NONE, NONE, NONE);
/// The triangle whose hit is being judged, and that of the closest hit if it is of this walk.
var<private> tested: PageTriangle;
var<private> found: PageTriangle = PageTriangle(NONE, 0u, 0u, 0u);

fn turn_before(a: Turn, b: Turn) -> bool {
    if (a.enter != b.enter) {
        return a.enter < b.enter;
    }
    return a.instance < b.instance || (a.instance == b.instance && a.subtree < b.subtree);
}

fn page_of(subtree: u32) -> u32 {
    return subtree >> tree[TREE_PAGE_SHIFT];
}

/// Goes through a subtree in a page, if its turn has not been and its page is there, all of it or with `any` until there is a hit;
/// whether there was a closer one.
fn cross_subtree(
    ray: ptr<function, MeshRay>, turn: Turn, any: bool, best: ptr<function, Hit>, stack: ptr<function, Stack>
) -> bool {
    if (turn_before(turn, restart)) {
        return false;
    }
    let page = page_of(turn.subtree);
    let place = page_if_there(page);
    let floor = (*stack).held;
    var met_any = false;
    lacks = place == ABSENT_PAGE;
    if (!lacks) {
        push(stack, floor, place + (turn.subtree & ((1u << tree[TREE_PAGE_SHIFT]) - 1u)), (*ray).t_min);
    }
    while ((*stack).held > floor && !(met_any && any) && !ends_unsettled(any)) {
        (*stack).held--;
        if ((*stack).enter[(*stack).held] <= (*ray).t_max) {
            met_any = visit_page(ray, (*stack).nodes[(*stack).held], page, best, stack) || met_any;
        }
    }
    (*stack).held = floor;
    if (lacks && turn_before(turn, missing)) {
        missing = turn;
    }
    return met_any;
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
    var met_any = false;
    while ((*stack).held > floor && !(met_any && any) && !ends_unsettled(any)) {
        (*stack).held--;
        let node = (*stack).nodes[(*stack).held];
        let enter = (*stack).enter[(*stack).held];
        if (enter > ray.t_max) {
            continue;
        }
        if ((node & LEAF) != 0u) {
            let turn = Turn(bitcast<u32>(max(enter, 0.0) * ray.t_scale), instance, node & ~LEAF);
            met_any = cross_subtree(&ray, turn, any, best, stack) || met_any;
        } else {
            visit_tree(ray.boxes, node, ray.t_min, ray.t_max, stack);
        }
    }
    (*stack).held = floor;
    return met_any;
}

/// Whether a walk with this closest hit has to go on when a page has come, for which it asks.
fn waits(best: Hit) -> bool {
    if (missing.enter == NONE || bitcast<f32>(missing.enter) > best.t) {
        return false;
    }
    ask(page_of(missing.subtree));
    return true;
}

/// Whether a ray that waited for a page still has to, so that walking again is of no use; asks for it again.
fn still_waits() -> bool {
    let page = page_of(restart.subtree);
    let is_start = (restart.enter | restart.instance | restart.subtree) == 0u;
    if (is_start || page_if_there(page) != ABSENT_PAGE) {
        return false;
    }
    ask(page);
    return true;
}

/// Without a hit.
fn miss(t_max: f32) -> Hit {
    return Hit(t_max, 0.0, 0.0, NONE, NONE);
}

/// The closest hit of a ray, or with `any` one of its hits; `known` is the closest of the subtrees before `restart`.
fn walk(given: WorldRay, any: bool, known: Hit) -> Hit {
    var ray = given;
    ray.t_min = max(ray.t_min, 0.0);
    var best = known;
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
