//! Builders: references in, a binary tree out.

mod binned;
mod clip;
mod clustered;
mod codes;
mod grid;
mod hlbvh2;
mod morton;
mod pieces;
mod ploc;
mod presplit;
mod reinsert;
mod sbvh;
mod top_down;

use crate::memory::Pages;
use crate::sort::Pair;
use crate::{BinaryTree, Node, Reference, kdtree};
use vastlight_math::Aabb;
use vastlight_simd::{Level, Simd8};

pub use binned::Binned;
pub(crate) use clip::triangle_slabs;
pub use clip::{Clip, clip_triangle};
pub(crate) use codes::{Boxes, CODE_BITS, codes, sorted_codes};
pub(crate) use hlbvh2::MortonTree;
pub(crate) use morton::Leaves;
pub(crate) use presplit::PORTIONS;
pub use presplit::presplit;

/// Names that [`build`] knows; the first is the default.
pub const NAMES: [&str; 7] = ["binned-sah", "grid-sah", "hlbvh2", "hlbvh2-binned", "morton", "ploc", "sbvh"];

/// How to build.
#[derive(Clone, Copy, Debug)]
pub struct BuildConfig {
    /// Most primitives in a leaf. Eight suit blocks of eight triangles.
    pub max_leaf: u32,
    /// Cost of one step down in units of testing one block of `max_leaf` primitives: larger gives fuller leaves.
    pub traversal_cost: f32,
    /// Rounds of reinsertion after the build, for faster rays: a round takes some 20 to 40 ms for a million triangles with
    /// two threads. 0 for none.
    pub optimize: u32,
    /// Most references in the tree, as a multiple of the primitives: 1.5 lets a builder cut primitives into half as many
    /// parts again; 1 cuts nothing. None cuts those that gain by it, up to 2. Has no effect on primitives that cannot be cut.
    pub split_budget: Option<f32>,
    /// Measure trees over meshes ([`crate::Quality`]); takes some 2 ms for a million triangles.
    pub measure: bool,
    /// Instructions to use; the tree is the same at every level.
    pub level: Level,
}

impl Default for BuildConfig {
    fn default() -> Self {
        Self {
            max_leaf: 8,
            traversal_cost: 0.3,
            optimize: 0,
            split_budget: None,
            measure: false,
            level: Level::detect(),
        }
    }
}

/// Budget where none is given; what of it is used follows from the primitives.
const AUTOMATIC_BUDGET: f32 = 2.0;
/// Cuts that are kept where no budget is given: those whose parts have at most so much of the whole's area.
const AUTOMATIC_KEEP: f32 = 0.55;
/// References from which on `binned-sah` puts clusters of them under its upper levels.
pub(crate) const CLUSTERED: usize = 1 << 14;
/// Budget of spatial splits where none is given.
const SPATIAL_BUDGET: f32 = 3.0;

/// Why nothing was built.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BuildError {
    /// No builder has this name.
    #[error("no acceleration structure is called \"{0}\" (known: {known})", known = known_names())]
    UnknownBuilder(String),
    /// More references than 31 bits count.
    #[error("{0} primitives are too many for one structure (at most 2^31 - 1)")]
    TooMany(usize),
}

/// All names of structures, for people.
fn known_names() -> String {
    NAMES.into_iter().chain(kdtree::NAMES).collect::<Vec<_>>().join(", ")
}

/// Memory that builds reuse: a second build of the same size allocates nothing here.
#[derive(Debug, Default)]
pub struct Scratch {
    /// Room for a caller's references.
    pub references: Vec<Reference>,
    other: Vec<Reference>,
    pairs: [Pages<Pair>; 2],
    /// Room for boxes of what stands below a primitive.
    pub(crate) boxes: Pages<Aabb>,
}

impl Scratch {
    /// Room for sorting `len` pairs, which hold anything.
    pub(crate) fn pairs(&mut self, len: usize) -> (&mut [Pair], &mut [Pair]) {
        for room in self.pairs.iter_mut().filter(|room| room.len() < len) {
            *room = Pages::zeroed(len);
        }
        let [pairs, spare] = &mut self.pairs;
        (&mut pairs[..len], &mut spare[..len])
    }
}

/// Builds by name; an empty name is the default. `references` are reordered, and are more afterwards where primitives
/// were cut with `clip`: then the tree names them in several leaves, each of whose boxes holds a part. The tree is the
/// same for any number of threads and any [`Level`].
///
/// # Errors
/// An unknown name, or too many references.
pub fn build(
    name: &str,
    references: &mut Vec<Reference>,
    clip: Option<&dyn Clip>,
    config: &BuildConfig,
    scratch: &mut Scratch,
) -> Result<BinaryTree, BuildError> {
    if references.len() >= 1 << 31 {
        return Err(BuildError::TooMany(references.len()));
    }
    let name = resolve(name)?;
    let most =
        |unless_given: f32| most_references(references.len(), config.split_budget.unwrap_or(unless_given));
    let (most, most_spatial) = (most(AUTOMATIC_BUDGET), most(SPATIAL_BUDGET));
    if let Some(clip) = clip
        && name != "sbvh"
    {
        let keep = if config.split_budget.is_some() { f32::INFINITY } else { AUTOMATIC_KEEP };
        presplit(references, clip, most, keep);
    }
    let tree = match name {
        _ if let Some(kind) = MortonTree::of_builder(name) => {
            hlbvh2::build(references, kind, config, scratch)
        }
        "grid-sah" => grid::build(references, config, scratch),
        "ploc" => ploc::build(references, config, scratch),
        "sbvh" => sbvh::build(references, clip, most_spatial, config),
        _ if references.len() >= CLUSTERED => {
            clustered::build(&references[..], codes::sorted_codes(references, config.level, scratch), config)
        }
        _ => top_down::build(&Binned::new(config), references, config, scratch),
    };
    Ok(reinsert::optimize(tree, config.optimize))
}

/// Builds as `binned-sah` does over boxes whose sorted codes are known.
pub(crate) fn build_clustered<B: Boxes>(boxes: &B, sorted: &[Pair], config: &BuildConfig) -> BinaryTree {
    reinsert::optimize(clustered::build(boxes, sorted, config), config.optimize)
}

/// Builds as `binned-sah` does over some boxes, without memory to reuse and, where they are few, without other threads.
pub(crate) fn build_some(references: &mut [Reference], config: &BuildConfig) -> BinaryTree {
    if references.is_empty() {
        return BinaryTree::default();
    }
    let (mut there, mut prims) = (references.to_vec(), vec![0; references.len()]);
    let run = top_down::Run { here: references, there: &mut there, prims: &mut prims, depth: 0 };
    let piece = top_down::piece(&Binned::new(config), config, run);
    BinaryTree { nodes: piece.assemble(), prims }
}

/// The number of references that a budget, a multiple of `primitives`, allows.
fn most_references(primitives: usize, budget: f32) -> usize {
    // A budget that is no number allows no more than the primitives.
    let most = primitives as f64 * f64::from(budget.max(1.0));
    (most as usize).clamp(primitives, (1 << 31) - 1)
}

/// The full name behind `name`; an empty one is the default.
///
/// # Errors
/// No builder has this name.
pub fn resolve(name: &str) -> Result<&'static str, BuildError> {
    if name.is_empty() {
        return Ok(NAMES[0]);
    }
    NAMES.into_iter().find(|n| *n == name).ok_or_else(|| BuildError::UnknownBuilder(name.into()))
}

/// Boxes around a run of references.
#[derive(Clone, Copy, Debug)]
pub struct RunBounds {
    /// Around the boxes: lower corner, unused, negated upper corner, unused.
    pub boxes: [f32; 8],
    /// Around twice the centres, in the same form.
    pub centers: [f32; 8],
}

/// The part of a top-down builder that decides: gathers figures about a run of references, and tries to split it.
///
/// Figures of parts of a run can be merged, in any grouping, to those of the run.
pub trait Heuristic: Sync {
    /// Figures about a run.
    type Figures: Send;
    /// A way to part a run in two.
    type Split: Copy + Send + Sync;

    /// The figures of `references`, a part of a run with the bounds `run` and the length `count`.
    fn gather<S: Simd8>(
        &self,
        simd: S,
        references: &[Reference],
        run: &RunBounds,
        count: usize,
    ) -> Self::Figures;
    /// The figures of two parts together.
    fn merge<S: Simd8>(&self, simd: S, a: Self::Figures, b: &Self::Figures) -> Self::Figures;
    /// The best way to split the run, with its cost in the measure of [`Heuristic::leaf_cost`]; none if it has none.
    fn try_split<S: Simd8>(
        &self,
        simd: S,
        figures: &Self::Figures,
        run: &RunBounds,
        count: usize,
    ) -> Option<(Self::Split, f32)>;
    /// The best way to part at most [`FEW`] references: copies them from `from` to `to`, of the same length, those of
    /// the left part first; gives their number and the cost of the split. None, and anything is in `to`, if there is none.
    fn part_few<S: Simd8>(
        &self,
        simd: S,
        from: &[Reference],
        to: &mut [Reference],
        run: &RunBounds,
    ) -> Option<(usize, f32)>;
    /// The cost of making the run a leaf.
    fn leaf_cost(&self, run: &RunBounds, count: usize) -> f32;
    /// Whether a reference goes to the left part.
    fn goes_left(&self, split: &Self::Split, reference: &Reference) -> bool;
}

/// Most references that [`Heuristic::part_few`] parts.
pub const FEW: usize = 32;

/// A node with nothing in it yet.
const BLANK: Node = Node { bounds: Aabb::EMPTY, left: 0, first: 0, count: 0 };
