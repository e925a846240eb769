//! How far a ray has come through a scene of which parts are not in memory.

use super::Found;
use crate::{Hit, Tracer};
use vastlight_accel::compact::PageRoot;
use vastlight_accel::ray::{BoxRay, ScaledRay};
use vastlight_math::Ray;

/// A place in the order in which a ray asks for subtrees of pages: by where it enters them, then by number. The order
/// depends on the ray and the scene alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Turn {
    /// Bits of the ray parameter, not negative, not above the true one.
    entry: u32,
    instance: u32,
    subtree: u32,
}

impl Turn {
    /// Before all subtrees.
    pub(crate) const FIRST: Self = Self { entry: 0, instance: 0, subtree: 0 };
    /// Behind all subtrees.
    pub(crate) const NEVER: Self = Self { entry: u32::MAX, instance: u32::MAX, subtree: u32::MAX };

    /// The turn of a subtree of an instance's mesh, for a ray in the mesh's space whose parameters times `t_scale` are those
    /// of the given ray.
    #[inline(always)]
    pub(crate) fn in_mesh(
        (ray, t_scale): (&BoxRay, f32),
        instance: u32,
        (subtree, root): (u32, &PageRoot),
    ) -> Self {
        let entry = ray.enter(&root.bounds()).max(0.0) * t_scale;
        Self { entry: entry.to_bits(), instance, subtree }
    }

    /// The same for a ray in the world.
    #[inline(never)]
    pub(crate) fn in_world(tracer: &Tracer, ray: &Ray, instance: u32, subtree: (u32, &PageRoot)) -> Self {
        let mut room = None;
        let Some(placed) = tracer.places.get(instance as usize, &mut room) else { return Self::NEVER };
        let (origin, direction) = placed.map_ray(ray.origin, ray.direction);
        let extent = tracer.meshes[placed.mesh as usize].space().extent;
        match ScaledRay::new(origin, direction) {
            Some(scaled) => {
                Self::in_mesh((&scaled.for_boxes(extent, 1.0), scaled.t_scale), instance, subtree)
            }
            None => Self { entry: 0, instance, subtree: subtree.0 },
        }
    }

    /// The ray parameter before which nothing comes at or behind this turn: what is hit in a subtree is behind where the
    /// ray enters it.
    #[inline(always)]
    pub(crate) fn entry(&self) -> f32 {
        f32::from_bits(self.entry)
    }
}

/// What a ray needs that is not in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Missing {
    pub(crate) turn: Turn,
    /// The page of the subtree whose turn it is.
    pub(crate) page: u32,
    /// A page of attributes without which a hit there is not decided; [`Hit::NONE`] where it is the page itself that is
    /// missing.
    pub(crate) attributes: u32,
}

impl Missing {
    pub(crate) const NOTHING: Self = Self { turn: Turn::NEVER, page: Hit::NONE, attributes: Hit::NONE };

    /// Takes in that something else is missing: only the first counts.
    #[inline]
    pub(crate) fn or(&mut self, other: Self) {
        if other.turn < self.turn {
            *self = other;
        }
    }

    /// Whether a ray with this closest hit needs it.
    pub(crate) fn matters(&self, best: &Hit) -> bool {
        self.turn != Turn::NEVER && self.turn.entry() <= best.t
    }
}

/// What a ray begins a pass with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Begin {
    pub(crate) best: Hit,
    pub(crate) found: Found,
    /// Subtrees before this turn have been looked through.
    pub(crate) restart: Turn,
}

impl Begin {
    pub(crate) const AFRESH: Self = Self { best: Hit::MISS, found: Found::NONE, restart: Turn::FIRST };
}

/// What a ray ends a pass with, besides its closest hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    pub(crate) found: Found,
    pub(crate) missing: Missing,
}

impl End {
    pub(crate) const COMPLETE: Self = Self { found: Found::NONE, missing: Missing::NOTHING };
}
