// Trees of lights, descended at random by importance, as in `vastlight-transport`, `light::tree`.
//#include light_node

/// In place of the number of leaves: not a list, but a tree.
const LIGHT_DEEP: u32 = 0xffffffffu;

struct LightTree {
    /// The root; children follow each other.
    nodes: u32,
    /// How many leaves a list has, or LIGHT_DEEP.
    few: u32,
}

/// A tree, and the point from which it is asked, in the tree's space. Without `directions` the lights' normals are not
/// looked at.
struct LightView {
    tree: LightTree,
    at: vec3<f32>,
    normal: vec3<f32>,
    directions: bool,
}

/// What a point may expect of a tree.
struct LightEstimate {
    /// Importance of all lights together.
    total: f32,
    /// Importance of each light of a list.
    each: vec4<f32>,
}

struct LightChoice {
    light: u32,
    /// 0 where no light can matter.
    probability: f32,
    /// What is left of the random number, in [0, 1).
    u: f32,
}

fn light_tree_at(at: u32) -> LightTree {
    return LightTree(lights[at], lights[at + 1u]);
}

fn light_estimate(view: LightView) -> LightEstimate {
    var estimate = LightEstimate(0.0, vec4<f32>(0.0));
    // Of a tree the root alone: one place calls, since drivers inline every call.
    let count = select(view.tree.few, 1u, view.tree.few == LIGHT_DEEP);
    for (var i = 0u; i < count; i++) {
        let node = view.tree.nodes + i * LIGHT_NODE_WORDS;
        let value = light_importance(node, view.at, view.normal, view.directions);
        // Not by index: some compilers cannot write a component that they do not know.
        estimate.each = select(estimate.each, vec4<f32>(value), vec4<u32>(0u, 1u, 2u, 3u) == vec4<u32>(i));
        estimate.total += value;
    }
    return estimate;
}

/// The probability of the left of two children; below 0 where neither can matter.
fn light_left_probability(view: LightView, children: u32) -> f32 {
    var left = 0.0;
    var right = 0.0;
    for (var i = 0u; i < 2u; i++) {
        left = right;
        right = light_importance(children + i * LIGHT_NODE_WORDS, view.at, view.normal, view.directions);
    }
    let sum = left + right;
    if (!(sum > 0.0)) {
        return -1.0;
    }
    // A division may be off by its last bits, but must not choose what cannot matter.
    return select(left / sum, 1.0, right <= 0.0);
}

fn light_sample_list(tree: LightTree, estimate: LightEstimate, u: f32) -> LightChoice {
    var rest = u * estimate.total;
    var chosen = LightChoice(LIGHT_NONE, 0.0, 0.0);
    for (var i = 0u; i < tree.few; i++) {
        let value = estimate.each[i];
        if (value > 0.0) {
            let link = lights[tree.nodes + i * LIGHT_NODE_WORDS + LIGHT_LINK];
            chosen = LightChoice(link, value / estimate.total, min(rest / value, LIGHT_BELOW_ONE));
            if (rest < value) {
                break;
            }
            rest -= value;
        }
    }
    return chosen;
}

/// Chooses a light with probability by importance. `estimate` must be the view's.
fn light_choose(view: LightView, estimate: LightEstimate, u: f32) -> LightChoice {
    if (view.tree.few != LIGHT_DEEP) {
        return light_sample_list(view.tree, estimate, u);
    }
    var node = view.tree.nodes;
    var rest = u;
    var probability = 1.0;
    while (!light_is_leaf(node)) {
        let children = view.tree.nodes + lights[node + LIGHT_LINK] * LIGHT_NODE_WORDS;
        let p = light_left_probability(view, children);
        if (p < 0.0) {
            return LightChoice(LIGHT_NONE, 0.0, 0.0);
        }
        if (rest < p) {
            node = children;
            rest = rest / p;
            probability *= p;
        } else {
            node = children + LIGHT_NODE_WORDS;
            rest = (rest - p) / (1.0 - p);
            probability *= 1.0 - p;
        }
        rest = min(rest, LIGHT_BELOW_ONE);
    }
    return LightChoice(lights[node + LIGHT_LINK], probability, rest);
}

/// The probability with which `light_choose` chooses the light whose way from the root stands at the word `trail`.
fn light_probability(view: LightView, estimate: LightEstimate, trail: u32) -> f32 {
    var low = lights[trail];
    var high = lights[trail + 1u];
    if ((low & high) == LIGHT_NONE || !(estimate.total > 0.0)) {
        return 0.0;
    }
    if (view.tree.few != LIGHT_DEEP) {
        return estimate.each[low] / estimate.total;
    }
    var node = view.tree.nodes;
    var probability = 1.0;
    while (!light_is_leaf(node)) {
        let children = view.tree.nodes + lights[node + LIGHT_LINK] * LIGHT_NODE_WORDS;
        let p = light_left_probability(view, children);
        if (p < 0.0) {
            return 0.0;
        }
        let right = low & 1u;
        probability *= select(1.0 - p, p, right == 0u);
        node = children + right * LIGHT_NODE_WORDS;
        low = (low >> 1u) | (high << 31u);
        high = high >> 1u;
    }
    return probability;
}
