// Walks over threaded kd-trees, from leaf to leaf, near ones first and without a stack, as in `vastlight-accel`,
// `kdtree::traverse`, and `vastlight-trace`, `kd::walk`. All that a ray must remember is in which leaf of each level it
// stands ([`Place`]). Words are those of `vastlight-trace`, `kd::words`. Who includes this has what `instance_ray` asks for.
//#include instance_ray

const KD_NODE_WORDS: u32 = 16u;
const KD_LEAF: u32 = 3u;
const KD_INDEX: u32 = 0x3fffffffu;
const TREE_ITEMS: u32 = 5u;
const TREE_BOXES: u32 = 6u;

/// A ray prepared for walking.
struct KdRay {
    boxes: BoxRay,
    /// Bit k is set where the direction is negative along axis k.
    octant: u32,
    t_min: f32,
}

/// The part of a ray that is in a node's cell, and what everything that a walk meets later lies at or behind.
struct KdSpan {
    enter: f32,
    leave: f32,
    safe: f32,
}

/// Where a walk stands: the instance that is being crossed and the leaf of its mesh, NONE outside of all; the leaf among
/// instances, NONE before the first; the next of its items, and the instances that were crossed last.
struct KdPlace {
    instance: u32,
    leaf: u32,
    safe: f32,
    top_leaf: u32,
    top_item: u32,
    top_safe: f32,
    seen: vec4<u32>,
}

fn kd_start() -> KdPlace {
    return KdPlace(NONE, NONE, 0.0, NONE, 0u, 0.0, vec4<u32>(NONE));
}

fn kd_ray(boxes: BoxRay, t_min: f32) -> KdRay {
    let backwards = vec3<u32>(boxes.reciprocal < vec3<f32>(0.0));
    return KdRay(boxes, backwards.x | (backwards.y << 1u) | (backwards.z << 2u), t_min);
}

/// The ray's part in the box whose six words begin at `at`, up to `t_max`.
fn kd_span(ray: KdRay, at: u32, t_max: f32) -> KdSpan {
    let low = vec3<f32>(tree_f32(at), tree_f32(at + 1u), tree_f32(at + 2u));
    let high = vec3<f32>(tree_f32(at + 3u), tree_f32(at + 4u), tree_f32(at + 5u));
    let backwards = ray.boxes.reciprocal < vec3<f32>(0.0);
    let far = select(high, low, backwards) * ray.boxes.reciprocal;
    let enter = select(low, high, backwards) * ray.boxes.reciprocal - ray.boxes.near_offset;
    let leave = far - ray.boxes.far_offset;
    let safe = far - ray.boxes.near_offset;
    return KdSpan(
        max(max(max(enter.x, enter.y), enter.z), ray.t_min),
        min(min(min(leave.x, leave.y), leave.z), t_max),
        min(min(safe.x, safe.y), safe.z),
    );
}

fn kd_is_leaf(node: u32) -> bool {
    return (tree[node * KD_NODE_WORDS + 7u] >> 30u) == KD_LEAF;
}

/// Where a walk goes on after a node and all below it.
fn kd_next(ray: KdRay, node: u32) -> u32 {
    return tree[node * KD_NODE_WORDS + 8u + ray.octant];
}

/// From a node that the ray meets in `span` down to the first leaf below it; far children are found again by threads.
fn kd_descend(ray: KdRay, from_node: u32, span: ptr<function, KdSpan>) -> u32 {
    var node = from_node;
    while (!kd_is_leaf(node)) {
        let link = tree[node * KD_NODE_WORDS + 7u];
        let axis = link >> 30u;
        let cut = tree_f32(node * KD_NODE_WORDS + 6u) * ray.boxes.reciprocal[axis];
        let before = cut - ray.boxes.near_offset[axis];
        let behind = cut - ray.boxes.far_offset[axis];
        let near = (ray.octant >> axis) & 1u;
        if ((*span).enter <= behind) {
            (*span).leave = min((*span).leave, behind);
            (*span).safe = min((*span).safe, before);
            node = (link & KD_INDEX) + near;
        } else {
            (*span).enter = max((*span).enter, before);
            node = (link & KD_INDEX) + (near ^ 1u);
        }
    }
    return node;
}

/// The first leaf at or after `first` that the ray meets before `t_max`; NONE if there is none.
fn kd_from(ray: KdRay, first: u32, t_max: f32, safe: ptr<function, f32>) -> u32 {
    var node = first;
    while (node != NONE) {
        var span = kd_span(ray, node * KD_NODE_WORDS, t_max);
        if (span.enter <= span.leave) {
            let leaf = kd_descend(ray, node, &span);
            *safe = span.safe;
            return leaf;
        }
        node = kd_next(ray, node);
    }
    return NONE;
}

/// The next instance in the leaf that the walk stands in, whose box the ray meets and that was not crossed lately; NONE at
/// the end of the leaf.
fn kd_item(way: KdRay, t_max: f32, place: ptr<function, KdPlace>) -> u32 {
    if ((*place).top_leaf == NONE) {
        return NONE;
    }
    let leaf = (*place).top_leaf * KD_NODE_WORDS;
    let first = tree[TREE_ITEMS] + (tree[leaf + 7u] & KD_INDEX);
    while ((*place).top_item < tree[leaf + 6u]) {
        let instance = tree[first + (*place).top_item];
        (*place).top_item++;
        let span = kd_span(way, tree[TREE_BOXES] + 6u * instance, t_max);
        if (span.enter <= span.leave && all((*place).seen != vec4<u32>(instance))) {
            (*place).seen = vec4<u32>(instance, (*place).seen.xyz);
            return instance;
        }
    }
    return NONE;
}

/// A node from which a walk goes on: the tree's root before the first leaf, else what follows that leaf, unless everything
/// there lies behind `t_max`.
fn kd_resume(way: KdRay, root: u32, leaf: u32, safe: f32, t_max: f32) -> u32 {
    if (leaf == NONE) {
        return root;
    }
    if (t_max < safe) {
        return NONE;
    }
    return kd_next(way, leaf);
}

/// The traversal of the stream tracer: brings a ray to the next leaf of a mesh on its way; whether there is one. `t` is how far
/// the ray goes, or where its closest hit so far is.
fn kd_advance(world: WorldRay, t: f32, place: ptr<function, KdPlace>) -> bool {
    let scaled = scaled_ray(world.origin, world.direction);
    if (!scaled.fits || tree[TREE_ROOT] == NONE) {
        return false;
    }
    let top_boxes = box_ray(scaled, tree_f32(TREE_EXTENT), tree_f32(TREE_MARGIN));
    let top_way = kd_ray(top_boxes, world.t_min / scaled.t_scale);
    let top_t = min(t / scaled.t_scale, FAR);
    loop {
        // One search serves both levels: drivers copy what is called into every place from which it is called.
        var way = top_way;
        var t_max = top_t;
        var node = NONE;
        let in_mesh = (*place).instance != NONE;
        if (in_mesh) {
            let ray = mesh_ray(world, (*place).instance, t);
            if (ray.fits) {
                way = kd_ray(ray.boxes, ray.t_min);
                t_max = ray.t_max;
                node = kd_resume(way, ray.root, (*place).leaf, (*place).safe, t_max);
            }
        } else {
            node = kd_resume(way, tree[TREE_ROOT], (*place).top_leaf, (*place).top_safe, t_max);
        }
        var safe = 0.0;
        let leaf = kd_from(way, node, t_max, &safe);
        if (in_mesh && leaf != NONE) {
            (*place).leaf = leaf;
            (*place).safe = safe;
            return true;
        }
        if (!in_mesh) {
            if (leaf == NONE) {
                return false;
            }
            (*place).top_leaf = leaf;
            (*place).top_item = 0u;
            (*place).top_safe = safe;
        }
        (*place).leaf = NONE;
        (*place).instance = kd_item(top_way, top_t, place);
    }
    return false;
}
