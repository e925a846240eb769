//! One tree over a mesh at several keys, for rays that have a time of their own.
//!
//! Nodes and blocks stand at the same places at every key. Between two keys boxes and corners are blended alike
//! ([`Between`]), so that blended boxes contain blended triangles to the last bit, and triangles that share vertices share blended
//! ones. Bundles of rays of all times walk boxes around all keys.

use super::{Block8, ChildRef, MeshBvh, MeshView, Node8, WideNode, extent};
use crate::Pages;
use crate::update::refit_scaled;
use vastlight_math::{Aabb, Between};
use vastlight_simd::Simd8;

/// What stands in the place of an empty box's planes: blends and products with it are never NaN.
const FAR_PLANE: f32 = 1e37;

/// A mesh at keys.
#[derive(Clone, Debug)]
pub struct MeshKeys {
    keys: Vec<MeshBvh>,
    /// Nodes with boxes around all keys.
    swept: Pages<Node8>,
    /// Around all triangles at all keys, scaled.
    pub bounds: Aabb,
    /// Largest absolute coordinate of all vertices at all keys, scaled.
    pub extent: f32,
    /// Positions are the mesh's times this power of two, at all keys.
    pub scale: f32,
}

impl MeshKeys {
    /// The tree `bvh` over a mesh at the keys `views`, which have the same triangles.
    #[must_use]
    pub fn new(bvh: &MeshBvh, views: &[MeshView<'_>]) -> Self {
        let around = views.iter().map(MeshView::bounds).fold(Aabb::EMPTY, Aabb::union);
        let scale = views.first().map_or(1.0, |view| view.scale(&around));
        let extent = extent(&around) * scale;
        let key = |view| {
            let mut key = MeshBvh { scale, extent, ..bvh.clone() };
            refit_scaled(&mut key, view);
            key
        };
        let mut keys: Vec<MeshBvh> = views.iter().map(key).collect();
        let mut swept = bvh.nodes.clone();
        for (place, node) in swept.iter_mut().enumerate() {
            for slot in 0..8 {
                let bounds = keys.iter().map(|key| key.nodes[place].bounds(slot));
                node.set(slot, node.children[slot], &bounds.fold(Aabb::EMPTY, Aabb::union));
            }
        }
        keys.iter_mut().flat_map(|key| key.nodes.iter_mut()).for_each(make_finite);
        let bounds = keys.iter().map(|key| key.bounds).fold(Aabb::EMPTY, Aabb::union);
        Self { keys, swept, bounds, extent, scale }
    }

    /// Where rays start; none for a mesh without triangles.
    #[must_use]
    pub fn root(&self) -> Option<ChildRef> {
        self.keys.first().and_then(|key| key.root)
    }

    /// Nodes with boxes around all keys.
    #[inline(always)]
    #[must_use]
    pub fn swept(&self) -> &[Node8] {
        &self.swept
    }

    /// A time, from 0 to 1, among the keys.
    #[inline(always)]
    #[must_use]
    pub fn between(&self, time: f32) -> Between {
        Between::new(time, self.keys.len())
    }

    /// Nodes and blocks at the earlier key of a moment.
    #[inline(always)]
    #[must_use]
    pub fn earlier(&self, between: &Between) -> (&[Node8], &[Block8]) {
        self.keys.get(between.key).map_or((&[], &[]), |key| (&key.nodes, &key.blocks))
    }

    /// The node at a place, at a moment.
    #[inline(always)]
    #[must_use]
    pub fn node(&self, place: usize, between: &Between) -> Option<BlendedNode<'_>> {
        let [a, b] = between.ends(&self.keys)?;
        Some(BlendedNode { ends: [a.nodes.get(place)?, b.nodes.get(place)?], between: *between })
    }

    /// The triangles of a leaf, at a moment.
    #[inline(always)]
    #[must_use]
    pub fn block<S: Simd8>(&self, s: S, leaf: usize, between: &Between) -> Option<Block8> {
        let [a, b] = between.ends(&self.keys)?;
        let (a, b) = (a.blocks.get(leaf)?, b.blocks.get(leaf)?);
        let mut block = Block8 { prims: a.prims, ..Block8::EMPTY };
        for (corner, of_corner) in block.corners.iter_mut().enumerate() {
            for (axis, lanes) in of_corner.iter_mut().enumerate() {
                *lanes = s.to_array(blend(s, &a.corners[corner][axis], &b.corners[corner][axis], between));
            }
        }
        Some(block)
    }

    /// Memory of nodes and blocks.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.keys.iter().map(MeshBvh::bytes).sum::<usize>() + size_of_val(&self.swept[..])
    }
}

/// [`Between::blend`] in lanes.
#[inline(always)]
fn blend<S: Simd8>(s: S, a: &[f32; 8], b: &[f32; 8], between: &Between) -> S::F {
    let [before, after] = between.parts;
    s.add(s.mul(s.load(a), s.splat(before)), s.mul(s.load(b), s.splat(after)))
}

/// Gives slots without box planes that no ray meets, and that stay so when they are blended.
fn make_finite(node: &mut Node8) {
    for [lower, upper] in &mut node.planes {
        for (lower, upper) in lower.iter_mut().zip(upper) {
            if *lower > *upper {
                (*lower, *upper) = (FAR_PLANE, -FAR_PLANE);
            }
        }
    }
}

/// A node between two keys.
#[derive(Clone, Copy, Debug)]
pub struct BlendedNode<'k> {
    ends: [&'k Node8; 2],
    between: Between,
}

impl WideNode for BlendedNode<'_> {
    #[inline(always)]
    fn child(&self, _place: usize, slot: usize) -> ChildRef {
        self.ends[0].children[slot]
    }

    #[inline(always)]
    fn planes<S: Simd8>(&self, s: S, axis: usize, side: usize) -> S::F {
        let [a, b] = self.ends;
        blend(s, &a.planes[axis][side], &b.planes[axis][side], &self.between)
    }

    #[inline(always)]
    fn bounds(&self, slot: usize) -> Aabb {
        let [a, b] = self.ends.map(|node| node.bounds(slot));
        Aabb { min: self.between.blend(a.min, b.min), max: self.between.blend(a.max, b.max) }
    }

    #[inline(always)]
    fn used(&self) -> u32 {
        // The boxes of the others are empty at both keys.
        0xff
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BuildConfig, Scratch};
    use vastlight_math::{Rng, Vec3};
    use vastlight_simd::Level;

    const KEYS: usize = 4;

    fn positions(rng: &mut Rng, size: f32) -> Vec<Vec3> {
        let mut unit = || rng.next_1d() * 2.0 - 1.0;
        (0..3 * 200).map(|_| Vec3::new(unit(), unit(), unit()) * size).collect()
    }

    struct Check<'a> {
        keys: &'a MeshKeys,
        positions: &'a [Vec<Vec3>],
    }

    impl vastlight_simd::Kernel for Check<'_> {
        type Output = ();

        /// Every triangle stands in a leaf at its blended place, in all boxes above it.
        fn run<S: Simd8>(self, simd: S) {
            for time in [0.0, 0.1, 1.0 / 3.0, 0.777, 1.0] {
                let between = Between::new(time, KEYS);
                let [a, b] = between.ends(self.positions).expect("keys");
                let mut seen = vec![false; a.len() / 3];
                let mut waiting = vec![(self.keys.root().expect("triangles"), Vec::<Aabb>::new())];
                while let Some((child, boxes)) = waiting.pop() {
                    if !child.is_leaf() {
                        let node = self.keys.node(child.index(), &between).expect("a node");
                        let swept = &self.keys.swept()[child.index()];
                        for slot in (0..8).filter(|&s| node.child(0, s) != ChildRef::NONE) {
                            let mut boxes = boxes.clone();
                            boxes.extend([node.bounds(slot), swept.bounds(slot)]);
                            waiting.push((node.child(0, slot), boxes));
                        }
                        continue;
                    }
                    let block = self.keys.block(simd, child.index(), &between).expect("a block");
                    for lane in block.used() {
                        let prim = block.prims[lane] as usize;
                        seen[prim] = true;
                        for corner in 0..3 {
                            let p = block.triangle(lane)[corner];
                            let vertex = 3 * prim + corner;
                            let expected =
                                between.blend(a[vertex] * self.keys.scale, b[vertex] * self.keys.scale);
                            assert_eq!(p, expected);
                            assert!(boxes.iter().all(|b| p.cmpge(b.min).all() && p.cmple(b.max).all()));
                        }
                    }
                }
                assert!(seen.into_iter().all(|seen| seen));
            }
        }
    }

    #[test]
    fn blended_boxes_contain_blended_triangles() {
        // Nowhere, everyday, growing until products would overflow.
        for sizes in [[1.0; KEYS], [1.0, 3.0, 0.01, 2.0], [1.0, 1e9, 1e14, 1e3]] {
            let mut rng = Rng::new(11);
            let positions: Vec<_> = sizes.iter().map(|&size| positions(&mut rng, size)).collect();
            let triangles: Vec<[u32; 3]> = (0..200).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let view = |positions| MeshView { positions, triangles: &triangles };
            let views: Vec<_> = positions.iter().map(|p| view(p)).collect();
            let config = BuildConfig::default();
            let (bvh, _) = MeshBvh::build("", &views[0], &config, &mut Scratch::default()).expect("built");
            let keys = MeshKeys::new(&bvh, &views);
            for level in Level::available() {
                level.dispatch(Check { keys: &keys, positions: &positions });
            }
        }
    }
}
