//! Checks of the node hierarchy: transforms, parents, loops, and which scene holds what.

use crate::gltf::findings::Findings;
use crate::gltf::json::Json;

/// Largest deviation of a rotation's length from 1 (8 bits of quantisation).
const UNIT_TOLERANCE: f64 = 0.00769;
/// Largest cosine between two axes of a matrix that counts as a right angle.
const SHEAR_TOLERANCE: f64 = 1e-3;

/// Parent and children of each node.
#[derive(Debug)]
pub(super) struct Graph {
    pub(super) parents: Vec<Option<usize>>,
    pub(super) children: Vec<Vec<usize>>,
    /// Nodes below a node without parent, each after its parent. Nodes of a loop, and what hangs on them, are missing.
    pub(super) order: Vec<usize>,
}

impl Graph {
    /// The first parent of each node counts.
    pub(super) fn new(root: &Json<'_>) -> Self {
        let nodes = root.list("nodes");
        let valid = |child: &usize| *child < nodes.len();
        let list =
            |node: &Json<'_>| node.list("children").iter().filter_map(Json::integer).filter(valid).collect();
        let children: Vec<Vec<usize>> = nodes.iter().map(list).collect();
        let mut parents = vec![None; nodes.len()];
        for (i, list) in children.iter().enumerate() {
            for &child in list {
                parents[child].get_or_insert(i);
            }
        }
        let mut order: Vec<usize> = (0..nodes.len()).filter(|&i| parents[i].is_none()).collect();
        let mut next = 0;
        while let Some(&node) = order.get(next) {
            order.extend(children[node].iter().filter(|&&child| parents[child] == Some(node)));
            next += 1;
        }
        Self { parents, children, order }
    }

    /// The topmost ancestor of each node; `None` in a loop.
    pub(super) fn tops(&self) -> Vec<Option<usize>> {
        let mut tops = vec![None; self.parents.len()];
        for &node in &self.order {
            tops[node] = self.parents[node].map_or(Some(node), |parent| tops[parent]);
        }
        tops
    }

    /// For each node whether it or an ancestor is marked.
    pub(super) fn spread_down(&self, mut marked: Vec<bool>) -> Vec<bool> {
        for &node in &self.order {
            marked[node] |= self.parents[node].is_some_and(|parent| marked[parent]);
        }
        marked
    }
}

/// Checks all nodes and scenes.
pub(super) fn check(root: &Json<'_>, findings: &mut Findings) {
    let graph = Graph::new(root);
    for (i, node) in root.list("nodes").iter().enumerate() {
        check_transform(node, &format!("/nodes/{i}"), findings);
        check_mesh(root, node, &format!("/nodes/{i}"), findings);
    }
    check_parents(root, &graph, findings);
    check_loops(&graph, findings);
    check_scenes(root, &graph, findings);
}

fn check_transform(node: &Json<'_>, place: &str, findings: &mut Findings) {
    let has = |key: &str| node.get(key).is_some();
    if has("matrix") && (has("translation") || has("rotation") || has("scale")) {
        let what = "a node has either a matrix or translation, rotation and scale";
        findings.error("NODE_MATRIX_TRS", what, &format!("{place}/matrix"), "");
    }
    if let Some(matrix) = node.doubles("matrix") {
        check_matrix(&matrix, &format!("{place}/matrix"), findings);
    }
    if let Some(rotation) = node.doubles::<4>("rotation") {
        let length = rotation.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            let what = format!("the rotation is no unit quaternion, its length is {length}");
            findings.error("ROTATION_NON_UNIT", what, &format!("{place}/rotation"), "");
        }
    }
}

/// The last row is (0, 0, 0, 1). Axes should stand at right angles; CAD files have others, which render as they are.
fn check_matrix(matrix: &[f64; 16], place: &str, findings: &mut Findings) {
    let last_row = [matrix[3], matrix[7], matrix[11], matrix[15]];
    if last_row != [0.0, 0.0, 0.0, 1.0] {
        let what =
            "the matrix is no product of translation, rotation and scale: its last row is not 0, 0, 0, 1";
        findings.error("NODE_MATRIX_NON_TRS", what, place, "");
    } else if !has_right_angles(matrix) {
        let what = "the matrix is no product of translation, rotation and scale: it shears";
        findings.warn("NODE_MATRIX_NON_TRS", what, place, "it is used as it is");
    }
}

fn has_right_angles(m: &[f64; 16]) -> bool {
    let axis = |i: usize| [m[4 * i], m[4 * i + 1], m[4 * i + 2]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(i, j)| {
        let (a, b) = (axis(i), axis(j));
        dot(a, b).abs() <= SHEAR_TOLERANCE * (dot(a, a) * dot(b, b)).sqrt()
    })
}

/// Skin and morph weights suit the mesh.
fn check_mesh(root: &Json<'_>, node: &Json<'_>, place: &str, findings: &mut Findings) {
    let Some(mesh) = node.index("mesh").and_then(|m| root.list("meshes").get(m)) else { return };
    let primitives = mesh.list("primitives");
    let is_skinned = primitives.iter().any(|p| p.at("attributes").get("JOINTS_0").is_some());
    if node.get("skin").is_some() && !is_skinned {
        let what = "the node has a skin, but its mesh has no joints";
        findings.error("NODE_SKIN_WITH_NON_SKINNED_MESH", what, place, "");
    }
    if node.get("skin").is_none() && is_skinned {
        let what = "the node's mesh has joints, but the node has no skin";
        findings.warn("NODE_SKINNED_MESH_WITHOUT_SKIN", what, place, "the mesh stands as it is stored");
    }
    let targets = primitives.first().map_or(0, |p| p.list("targets").len());
    let weights = node.list("weights").len();
    if weights != 0 && weights != targets {
        let what = format!("there are {weights} weights for {targets} morph targets");
        findings.error("NODE_WEIGHTS_INVALID", what, &format!("{place}/weights"), "");
    }
}

fn check_parents(root: &Json<'_>, graph: &Graph, findings: &mut Findings) {
    for (i, node) in root.list("nodes").iter().enumerate() {
        for (k, child) in node.list("children").iter().enumerate() {
            let Some(child) = child.integer() else { continue };
            let parent = graph.parents.get(child).copied().flatten();
            if parent.is_some_and(|parent| parent != i) {
                let what = format!("node {child} has another parent already");
                findings.error("NODE_PARENT_OVERRIDE", what, &format!("/nodes/{i}/children/{k}"), "");
            }
        }
    }
}

/// A node is in a loop if the search below it comes back to it, or to a node above it that is still open.
fn check_loops(graph: &Graph, findings: &mut Findings) {
    const NEW: usize = usize::MAX;
    const DONE: usize = usize::MAX - 1;
    // Depth of open nodes in the search.
    let mut depth = vec![NEW; graph.parents.len()];
    let mut looped: Vec<usize> = Vec::new();
    for start in 0..graph.parents.len() {
        if depth[start] != NEW {
            continue;
        }
        // Node, its next child, and the least depth that the search below it came back to.
        let mut stack = vec![(start, 0, NEW)];
        depth[start] = 0;
        while let Some((node, next, least)) = stack.last_mut() {
            let (node, at) = (*node, *next);
            if let Some(&child) = graph.children[node].get(at) {
                *next += 1;
                match depth[child] {
                    NEW => {
                        depth[child] = stack.len();
                        stack.push((child, 0, NEW));
                    }
                    DONE => {}
                    open => *least = (*least).min(open),
                }
                continue;
            }
            let least = *least;
            if least <= depth[node] {
                looped.push(node);
            }
            depth[node] = DONE;
            stack.pop();
            if let Some((_, _, above)) = stack.last_mut() {
                *above = (*above).min(least);
            }
        }
    }
    looped.sort_unstable();
    for i in looped {
        findings.error("NODE_LOOP", "the node is its own ancestor", &format!("/nodes/{i}"), "");
    }
}

/// Scenes of which all nodes are visited; files have a handful.
const CHECKED_SCENES: usize = 64;

fn check_scenes(root: &Json<'_>, graph: &Graph, findings: &mut Findings) {
    for (i, scene) in root.list("scenes").iter().enumerate() {
        let roots: Vec<usize> = scene.list("nodes").iter().filter_map(Json::integer).collect();
        for (k, &node) in roots.iter().enumerate() {
            if graph.parents.get(node).copied().flatten().is_some() {
                let what = format!("node {node} is the child of another node");
                findings.error("SCENE_NON_ROOT_NODE", what, &format!("/scenes/{i}/nodes/{k}"), "");
            }
        }
        if i < CHECKED_SCENES {
            check_joints_in_scene(root, graph, &roots, findings);
        }
    }
}

/// A skinned mesh needs its joints in the same scene.
fn check_joints_in_scene(root: &Json<'_>, graph: &Graph, roots: &[usize], findings: &mut Findings) {
    let mut in_scene = vec![false; graph.children.len()];
    let mut stack: Vec<usize> = roots.to_vec();
    while let Some(node) = stack.pop() {
        if in_scene.get(node).is_some_and(|seen| !seen) {
            in_scene[node] = true;
            stack.extend(&graph.children[node]);
        }
    }
    let is_outside = |joint: usize| in_scene.get(joint).is_some_and(|inside| !inside);
    let lacks_joints: Vec<bool> = root
        .list("skins")
        .iter()
        .map(|skin| skin.list("joints").iter().filter_map(Json::integer).any(is_outside))
        .collect();
    for (i, node) in root.list("nodes").iter().enumerate().filter(|(i, _)| in_scene[*i]) {
        if node.index("skin").is_some_and(|skin| lacks_joints.get(skin) == Some(&true)) {
            let what = "the scene shows a skinned mesh, but not its joints";
            findings.error("NODE_SKIN_NO_SCENE", what, &format!("/nodes/{i}"), "");
        }
    }
}
