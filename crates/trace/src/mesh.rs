//! A mesh in one of its layouts.

use crate::follow::MovingMesh;
use crate::instance::MeshSpace;
use std::sync::Arc;
use vastlight_accel::compact::CompactMesh;
use vastlight_accel::wide::traverse::Memory;
use vastlight_accel::wide::{Block8, ChildRef, MeshBvh, MeshKeys, MeshView, Node8};

/// How meshes lie in memory. Hits do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Full boxes and unpacked triangles: fast.
    #[default]
    Wide,
    /// Pages of quantised boxes and packed triangles: small.
    Compact,
}

impl Layout {
    /// Names of all layouts, the default first.
    pub const NAMES: [&'static str; 2] = ["wide", "compact"];

    /// The layout of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Wide, Self::Compact].into_iter().find(|layout| layout.name() == name)
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// A mesh as rays find it.
#[derive(Debug)]
pub(crate) enum MeshTree {
    Wide(MeshBvh),
    /// The same, kept with what updating it needs.
    Moving(Box<MovingMesh>),
    Compact(Arc<CompactMesh>),
}

/// Without triangles.
impl Default for MeshTree {
    fn default() -> Self {
        Self::Wide(MeshBvh::default())
    }
}

/// A mesh, whatever else is kept with it.
#[derive(Clone, Copy)]
enum Kind<'a> {
    Wide(&'a MeshBvh),
    Compact(&'a CompactMesh),
}

/// What the leaves of a mesh's upper nodes are.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Leaves<'a> {
    Blocks(&'a [Block8]),
    Pages(&'a CompactMesh),
    /// The leaves of all nodes, at keys of an open shutter.
    Keys(&'a MeshKeys),
}

impl MeshTree {
    /// Lets rays of an open shutter see the mesh at keys, the first of which it was built for.
    pub(crate) fn open(&mut self, keys: &[MeshView<'_>]) {
        if let Self::Wide(bvh) = self {
            *self = Self::Moving(Box::new(MovingMesh::of(std::mem::take(bvh))));
        }
        if let Self::Moving(moving) = self {
            moving.open(keys);
        }
    }

    /// What rays of an open shutter see of a mesh whose vertices move.
    #[inline(always)]
    pub(crate) fn keys(&self) -> Option<&MeshKeys> {
        match self {
            Self::Moving(m) => m.keys(),
            _ => None,
        }
    }

    #[inline(always)]
    fn kind(&self) -> Kind<'_> {
        match self {
            Self::Wide(m) => Kind::Wide(m),
            Self::Moving(m) => Kind::Wide(m.bvh()),
            Self::Compact(m) => Kind::Compact(m),
        }
    }

    pub(crate) fn space(&self) -> MeshSpace {
        if let Some(keys) = self.keys() {
            return MeshSpace { bounds: keys.bounds, extent: keys.extent, scale: keys.scale };
        }
        match self.kind() {
            Kind::Wide(m) => MeshSpace { bounds: m.bounds, extent: m.extent, scale: m.scale },
            Kind::Compact(m) => MeshSpace { bounds: m.bounds, extent: m.extent, scale: m.scale },
        }
    }

    /// Nodes on the longest way from the root to a block.
    pub(crate) fn levels(&self) -> usize {
        match self.kind() {
            Kind::Wide(m) => m.levels,
            Kind::Compact(m) => m.levels,
        }
    }

    /// Memory of all but pages.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Wide(m) => m.bytes(),
            Self::Moving(m) => m.bytes(),
            Self::Compact(m) => m.bytes(),
        }
    }

    /// Bytes of the triangles' numbers.
    pub(crate) fn number_bytes(&self) -> usize {
        match self.kind() {
            Kind::Wide(m) => m.blocks.len() * size_of::<[u32; 8]>(),
            Kind::Compact(m) => m.shares.numbers,
        }
    }

    #[inline(always)]
    pub(crate) fn root(&self) -> Option<ChildRef> {
        match self.kind() {
            Kind::Wide(m) => m.root,
            Kind::Compact(m) => m.root,
        }
    }

    /// The nodes below the root as far as they have full boxes.
    #[inline(always)]
    pub(crate) fn nodes(&self) -> &[Node8] {
        match self.kind() {
            Kind::Wide(m) => &m.nodes,
            Kind::Compact(m) => &m.nodes,
        }
    }

    /// What is below these.
    #[inline(always)]
    pub(crate) fn leaves(&self) -> Leaves<'_> {
        if let Some(keys) = self.keys() {
            return Leaves::Keys(keys);
        }
        match self.kind() {
            Kind::Wide(m) => Leaves::Blocks(&m.blocks),
            Kind::Compact(m) => Leaves::Pages(m),
        }
    }

    #[inline(always)]
    pub(crate) fn memory(&self) -> Memory {
        match self.kind() {
            Kind::Wide(m) => Memory::new(&m.nodes, &m.blocks),
            Kind::Compact(m) => Memory::new(&m.nodes, &m.roots),
        }
    }
}
