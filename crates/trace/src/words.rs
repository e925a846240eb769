//! A scene made traceable, as words: what a device needs to trace the rays that a [`Tracer`] traces.
//!
//! An array of 32-bit words. The *tree* holds wide nodes of [`NODE_WORDS`] words (planes by axis, side and slot, then
//! children), those over the instances and those above every mesh's pages, and behind them the instances. What would be
//! its first node is a header. A child is the number of a node, or with [`LEAF`] set a leaf: above instances an
//! instance's number, above pages the number of a page, shifted by [`header::PAGE_SHIFT`], and the word of the page where a
//! subtree begins. Pages themselves are brought one by one.

use crate::mesh::MeshTree;
use crate::{TraceError, Tracer};
use vastlight_accel::compact::CompactMesh;
use vastlight_accel::kdtree::KdNode;
use vastlight_accel::wide::{Block8, ChildRef, InstanceNodes, Node8, WideNode};
use vastlight_paging::Table;

/// Words of a node.
pub const NODE_WORDS: usize = size_of::<Node8>() / 4;
/// Marks children that are leaves.
pub const LEAF: u32 = 1 << 31;
/// Words of an instance: the rows of the map from the world to its mesh's scaled space, the mesh's root and largest
/// coordinate, whether the map changes nothing, and whether rays may pass its surfaces.
pub const INSTANCE_WORDS: usize = 16;
/// Words of a node of a kd-tree.
pub const KD_NODE_WORDS: usize = size_of::<KdNode>() / 4;
/// Words of a block of eight triangles in the leaves of kd-trees.
pub const KD_BLOCK_WORDS: usize = size_of::<Block8>() / 4;

/// What stands where in the header.
pub mod header {
    /// Where rays start: a node, an instance's number as a leaf, or `u32::MAX`.
    pub const ROOT: usize = 0;
    /// The word where the instances begin.
    pub const INSTANCES: usize = 1;
    /// How many instances there are.
    pub const COUNT: usize = 2;
    /// The largest coordinate of the world, as the bits of an f32.
    pub const EXTENT: usize = 3;
    /// How much wider margins of the world's boxes are than those of a mesh, as the bits of an f32.
    pub const MARGIN: usize = 4;
    /// How far the number of a page is shifted in leaves.
    pub const PAGE_SHIFT: usize = 7;
    /// Of threaded kd-trees: the word where the numbers of instances in leaves begin.
    pub const ITEMS: usize = 5;
    /// Of threaded kd-trees: the word where the boxes of instances begin, six words each.
    pub const BOXES: usize = 6;
}

/// See the module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TracerWords {
    /// Nodes and instances.
    pub tree: Vec<u32>,
    /// The blocks of triangles in the leaves of kd-trees; none of other trees.
    pub blocks: Vec<u32>,
    /// Nodes on the longest way from the root to a leaf of a page, for the stack of a walk; 0 where it needs none.
    pub levels: usize,
}

impl TracerWords {
    /// Marks the instances whose surfaces rays may pass, by alpha or otherwise; none are at first.
    pub fn set_veils(&mut self, is_veiled: impl Fn(u32) -> bool) {
        let first = self.tree[header::INSTANCES] as usize;
        for (number, instance) in self.tree[first..].chunks_exact_mut(INSTANCE_WORDS).enumerate() {
            instance[INSTANCE_WORDS - 1] = u32::from(is_veiled(number as u32));
        }
    }
}

impl Tracer {
    /// The tracer as words, for pages of at most so many bytes.
    ///
    /// # Errors
    /// Its meshes are not in the layout [`Compact`](crate::Layout::Compact), there is no tree over the instances, or pages
    /// have 2^31 words or more.
    pub fn words(&self, page_bytes: usize) -> Result<TracerWords, TraceError> {
        self.refuse_implicit_surfaces()?;
        if self.grid.is_some() || self.kd.is_some() {
            return Err(TraceError::Words("there is no tree over the instances"));
        }
        let shift = page_bytes.div_ceil(4).next_power_of_two().trailing_zeros();
        let mut tree = vec![0; NODE_WORDS];
        let root = push_top(&mut tree, &self.top.nodes, self.top.root);
        let mut roots = Vec::with_capacity(self.meshes.len());
        for mesh in &self.meshes {
            let MeshTree::Compact(mesh) = mesh else {
                return Err(TraceError::Words("the layout is not compact"));
            };
            roots.push((push_mesh(&mut tree, mesh, shift)?, mesh.extent));
        }
        self.put_instances(&mut tree, root, &roots);
        tree[header::PAGE_SHIFT] = shift;
        let deepest = self.meshes.iter().map(MeshTree::levels).max().unwrap_or(0);
        Ok(TracerWords { tree, blocks: Vec::new(), levels: self.top.levels + deepest })
    }

    /// The pages in memory, of the layout [`Compact`](crate::Layout::Compact).
    #[must_use]
    pub fn pages(&self) -> &Table {
        &self.pages
    }

    /// The mesh of each page in memory.
    #[must_use]
    pub fn page_meshes(&self) -> Vec<u32> {
        let mut meshes = vec![0; self.pages.pages()];
        for (number, mesh) in (0..).zip(&self.meshes) {
            let MeshTree::Compact(mesh) = mesh else { continue };
            for root in &mesh.roots {
                if let Some(of_page) = meshes.get_mut(root.page as usize) {
                    *of_page = number;
                }
            }
        }
        meshes
    }

    /// What positions of a mesh in its pages are to be multiplied with.
    #[must_use]
    pub fn unscale(&self, mesh: u32) -> f32 {
        self.meshes.get(mesh as usize).map_or(1.0, |mesh| 1.0 / mesh.space().scale)
    }

    /// Fills in the header, and appends the instances; `roots` has each mesh's root and largest coordinate.
    pub(crate) fn put_instances(&self, tree: &mut Vec<u32>, root: u32, roots: &[(u32, f32)]) {
        tree[header::ROOT] = root;
        tree[header::INSTANCES] = tree.len() as u32;
        tree[header::COUNT] = self.places.len() as u32;
        tree[header::EXTENT] = self.places.extent.to_bits();
        tree[header::MARGIN] = self.places.margin_factor.to_bits();
        let mut room = None;
        for number in 0..self.places.len() {
            let Some(placed) = self.places.get(number, &mut room) else { continue };
            let (root, extent) = roots[placed.mesh as usize];
            tree.extend(placed.rows().as_flattened().iter().map(|x| x.to_bits()));
            tree.extend([root, extent.to_bits(), u32::from(placed.is_identity()), 0]);
        }
    }
}

/// Appends the nodes over the instances; gives the root.
fn push_top(tree: &mut Vec<u32>, nodes: &InstanceNodes, root: Option<ChildRef>) -> u32 {
    let first = (tree.len() / NODE_WORDS) as u32;
    let child = |child: ChildRef| if child.is_leaf() { child.0 } else { child.0 + first };
    match nodes {
        InstanceNodes::Full(nodes) => nodes.iter().for_each(|node| push_node(tree, node, child)),
        InstanceNodes::Small(nodes) => {
            nodes.iter().enumerate().for_each(|(place, node)| push_node(tree, &node.to_wide(place), child));
        }
    }
    root.map_or(ChildRef::NONE.0, child)
}

/// Appends the nodes above a mesh's pages; gives the root.
fn push_mesh(tree: &mut Vec<u32>, mesh: &CompactMesh, shift: u32) -> Result<u32, TraceError> {
    let first = (tree.len() / NODE_WORDS) as u32;
    let child = |child: ChildRef| {
        if !child.is_leaf() {
            return child.0 + first;
        }
        let root = &mesh.roots[child.index()];
        LEAF | root.page << shift | root.node().index() as u32
    };
    if mesh.roots.iter().any(|root| root.page >= LEAF >> shift) {
        return Err(TraceError::Words("the pages have 8 GiB or more"));
    }
    mesh.nodes.iter().for_each(|node| push_node(tree, node, child));
    Ok(mesh.root.map_or(ChildRef::NONE.0, child))
}

fn push_node(tree: &mut Vec<u32>, node: &Node8, child: impl Fn(ChildRef) -> u32) {
    tree.extend(node.planes.as_flattened().as_flattened().iter().map(|x| x.to_bits()));
    tree.extend(node.children.map(|c| if c == ChildRef::NONE { c.0 } else { child(c) }));
    tree.extend(node.reserved);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Layout, TopLevel, TracerConfig};
    use std::collections::BTreeSet;
    use vastlight_accel::compact::{Page, SLACK};
    use vastlight_math::{Affine3, Vec3};
    use vastlight_scene::{Instance, Mesh, Scene, SceneDesc};

    /// Small triangles in rows of twenty.
    fn mesh(count: usize) -> Mesh {
        Mesh {
            positions: (0..3 * count)
                .map(|i| {
                    Vec3::new((i / 3 % 20) as f32, (i / 60) as f32, 0.0)
                        + [Vec3::ZERO, Vec3::X, Vec3::Y][i % 3] * 0.5
                })
                .collect(),
            triangles: (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Mesh::default()
        }
    }

    /// Two meshes, and one without triangles, placed some times.
    fn scene(places: usize) -> Scene {
        let instance = |i: usize| Instance {
            world_from_object: Affine3::from_translation(Vec3::Z * i as f32),
            mesh: (i % 3) as u32,
            name: 0,
        };
        let desc = SceneDesc {
            meshes: vec![mesh(400), mesh(9), mesh(0)],
            instances: (0..places).map(instance).collect(),
            names: vec![String::new()],
            ..SceneDesc::default()
        };
        Scene::new(desc).expect("a scene")
    }

    fn words(places: usize, config: &TracerConfig) -> Result<TracerWords, TraceError> {
        Tracer::new(&scene(places), config).expect("built").words(PAGE_BYTES)
    }

    /// Bytes of the longest page.
    const PAGE_BYTES: usize = CompactMesh::SLOT + SLACK;

    fn compact() -> TracerConfig {
        TracerConfig { layout: Layout::Compact, ..TracerConfig::default() }
    }

    /// Follows every child from the root; gives the instances that are met.
    fn instances_below(words: &TracerWords, child: u32, met: &mut Vec<u32>) {
        if child == ChildRef::NONE.0 {
        } else if child & LEAF != 0 {
            met.push(child & !LEAF);
        } else {
            let node = child as usize * NODE_WORDS;
            assert!(child > 0 && node < words.tree[header::INSTANCES] as usize);
            words.tree[node + 48..][..8].iter().for_each(|&child| instances_below(words, child, met));
        }
    }

    #[test]
    fn every_instance_is_found_from_the_root_and_knows_its_mesh() {
        for places in [1, 2, 30, 100] {
            let words = words(places, &compact()).expect("words");
            let mut met = Vec::new();
            instances_below(&words, words.tree[header::ROOT], &mut met);
            met.sort_unstable();
            let scene = scene(places);
            let has_triangles = |i: usize| scene.instances().mesh(i) != 2;
            let expected: Vec<u32> = (0..places as u32).filter(|&i| has_triangles(i as usize)).collect();
            assert_eq!(met, expected, "instances without triangles have no leaf");
            assert_eq!(words.tree[header::COUNT] as usize, places);
            let first = words.tree[header::INSTANCES] as usize;
            assert_eq!(words.tree.len(), first + places * INSTANCE_WORDS);
            for (i, instance) in words.tree[first..].chunks_exact(INSTANCE_WORDS).enumerate() {
                let moved = scene.instances().map(i).translation.z;
                assert_eq!(f32::from_bits(instance[11]), -moved * f32::from_bits(instance[0]));
                let root = instance[12];
                assert_eq!(root == ChildRef::NONE.0, !has_triangles(i));
            }
        }
    }

    /// Gathers the triangles of the pages below a node.
    fn triangles_below(words: &TracerWords, pages: &Table, child: u32, met: &mut BTreeSet<(u32, u32)>) {
        if child == ChildRef::NONE.0 {
        } else if child & LEAF == 0 {
            let node = child as usize * NODE_WORDS;
            words.tree[node + 48..][..8].iter().for_each(|&child| triangles_below(words, pages, child, met));
        } else {
            let number = (child & !LEAF) >> words.tree[header::PAGE_SHIFT];
            let page = Page::new(pages.page(number).expect("in memory"));
            let within = (child & ((1 << words.tree[header::PAGE_SHIFT]) - 1)) as usize;
            assert!(page.node(within).is_some());
            met.extend(page.triangles().into_iter().map(|triangle| (number, triangle)));
        }
    }

    #[test]
    fn every_mesh_finds_the_triangles_of_its_own_pages() {
        let mesh = |count: u32| Mesh {
            positions: (0..3 * count)
                .map(|i| Vec3::new((i % 97) as f32, (i % 89) as f32, (i % 7) as f32))
                .collect(),
            triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Mesh::default()
        };
        let instance = |mesh| Instance { world_from_object: Affine3::IDENTITY, mesh, name: 0 };
        let desc = SceneDesc {
            meshes: vec![mesh(30), mesh(20_000), mesh(9000)],
            instances: (0..3).map(instance).collect(),
            names: vec![String::new()],
            ..SceneDesc::default()
        };
        let scene = Scene::new(desc).expect("a scene");
        let tracer = Tracer::new(&scene, &compact()).expect("built");
        let (words, of_pages) = (tracer.words(PAGE_BYTES).expect("words"), tracer.page_meshes());
        assert!(of_pages.len() > 10);
        let first = words.tree[header::INSTANCES] as usize;
        for (number, instance) in words.tree[first..].chunks_exact(INSTANCE_WORDS).enumerate() {
            let mut met = BTreeSet::new();
            triangles_below(&words, tracer.pages(), instance[12], &mut met);
            assert!(met.iter().all(|&(page, _)| of_pages[page as usize] == number as u32));
            let triangles: BTreeSet<u32> = met.iter().map(|met| met.1).collect();
            assert_eq!(triangles.len(), scene.meshes()[number].triangles.len());
        }
    }

    /// Adds up how often each node above pages is met from a child on, and gives the leaves.
    fn nodes_below(words: &TracerWords, child: u32, met: &mut [u32], leaves: &mut Vec<u32>) {
        if child & LEAF != 0 {
            leaves.extend((child != ChildRef::NONE.0).then_some(child & !LEAF));
            return;
        }
        met[child as usize] += 1;
        let children = &words.tree[child as usize * NODE_WORDS + 48..][..8];
        children.iter().for_each(|&child| nodes_below(words, child, met, leaves));
    }

    /// Each mesh has pages of its own, which follow those of the meshes before it.
    #[test]
    fn nodes_above_the_pages_of_every_mesh_are_met_once_and_lead_to_its_pages() {
        let mesh = |count| {
            let mut mesh = self::mesh(count);
            mesh.positions.iter_mut().for_each(|p| p.y *= 0.125);
            mesh
        };
        let places = [0, 1, 2].map(|mesh| Instance { world_from_object: Affine3::IDENTITY, mesh, name: 0 });
        let desc = SceneDesc {
            meshes: [20_000, 9000, 30_000].map(mesh).to_vec(),
            instances: places.to_vec(),
            names: vec![String::new()],
            ..SceneDesc::default()
        };
        let scene = Scene::new(desc).expect("a scene");
        let tracer = Tracer::new(&scene, &compact()).expect("built");
        let words = tracer.words(PAGE_BYTES).expect("words");
        let first = words.tree[header::INSTANCES] as usize;
        let (mut met, mut all) = (vec![0; first / NODE_WORDS], Vec::new());
        for instance in words.tree[first..].chunks_exact(INSTANCE_WORDS) {
            let (nodes, leaves) = (met.iter().sum::<u32>(), all.len());
            nodes_below(&words, instance[12], &mut met, &mut all);
            assert!(met.iter().sum::<u32>() > nodes, "a mesh has nodes above its pages");
            assert!(all[leaves..].iter().min() > all[..leaves].iter().max());
        }
        nodes_below(&words, words.tree[header::ROOT], &mut met, &mut Vec::new());
        // The first stands for the header.
        assert!(met[0] == 0 && met[1..].iter().all(|&times| times == 1), "{met:?}");
        let shift = words.tree[header::PAGE_SHIFT];
        assert!(all.iter().all(|&leaf| (leaf >> shift) < tracer.pages().pages() as u32));
    }

    #[test]
    fn veils_are_marked_and_nothing_else() {
        let plain = words(5, &compact()).expect("words");
        let mut veiled = plain.clone();
        veiled.set_veils(|i| i == 3);
        let differ: Vec<usize> = (0..plain.tree.len()).filter(|&i| plain.tree[i] != veiled.tree[i]).collect();
        assert_eq!(differ, [plain.tree[header::INSTANCES] as usize + 4 * INSTANCE_WORDS - 1]);
    }

    #[test]
    fn what_is_not_in_pages_under_a_tree_has_no_words() {
        let wide = TracerConfig::default();
        let grid = TracerConfig { top: TopLevel::Grid(4), ..compact() };
        let kd = TracerConfig { accel: "kd-threaded".to_owned(), ..TracerConfig::default() };
        for config in [wide, grid, kd] {
            assert!(matches!(words(4, &config), Err(TraceError::Words(_))), "{config:?}");
        }
    }
}
