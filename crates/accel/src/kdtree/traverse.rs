//! Walks through a kd-tree from leaf to leaf, near ones first: by threads, or with a stack for comparison.
//!
//! A walk visits every leaf whose part of space, grown by the margin of [`crate::ray`], the ray meets. Where a cut is
//! nearer than the margin, that is both sides of it.
//!
//! Hits found in a leaf may lie beyond it, since triangles reach through several leaves. Such a hit bounds the way,
//! but it ends the walk only if it lies in the leaf's own interval ([`Span::safe`]): everything that comes later then
//! lies behind it.

use super::KdNode;
use super::thread::near_and_far;
use crate::ray::BoxRay;
use vastlight_math::Aabb;

/// The part of a ray that is in a node's cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Span {
    /// Where the ray enters, margin included.
    pub enter: f32,
    /// Where it leaves, margin included.
    pub leave: f32,
    /// What a walk meets after this node lies at or behind this parameter.
    pub safe: f32,
}

/// A ray prepared for walking.
#[derive(Clone, Copy, Debug, Default)]
pub struct KdRay {
    boxes: BoxRay,
    octant: usize,
    t_min: f32,
}

impl KdRay {
    /// The walk of a ray from `t_min >= 0` on.
    #[inline(always)]
    #[must_use]
    pub fn new(boxes: &BoxRay, t_min: f32) -> Self {
        let [x, y, z] = boxes.enters_by_upper;
        Self { boxes: *boxes, octant: (x | y << 1 | z << 2) & 7, t_min }
    }

    /// The ray's part in `bounds` up to `t_max`.
    #[inline(always)]
    #[must_use]
    pub fn span(&self, bounds: &Aabb, t_max: f32) -> Span {
        let (lower, upper) = (bounds.min.to_array(), bounds.max.to_array());
        let mut span = Span { enter: self.t_min, leave: t_max, safe: f32::INFINITY };
        for k in 0..3 {
            let (near, far) =
                if self.octant >> k & 1 == 0 { (lower[k], upper[k]) } else { (upper[k], lower[k]) };
            span.enter = larger(span.enter, self.before(near, k));
            span.leave = smaller(span.leave, self.behind(far, k));
            span.safe = smaller(span.safe, self.before(far, k));
        }
        span
    }

    /// Where the ray crosses a plane, less the margin.
    #[inline(always)]
    fn before(&self, plane: f32, axis: usize) -> f32 {
        plane * self.boxes.reciprocal[axis] - self.boxes.near_offset[axis]
    }

    /// Where the ray crosses a plane, and the margin.
    #[inline(always)]
    fn behind(&self, plane: f32, axis: usize) -> f32 {
        plane * self.boxes.reciprocal[axis] - self.boxes.far_offset[axis]
    }

    /// From a node that the ray meets in `span` down to the first leaf below it. `aside` is told of far children that
    /// the ray meets as well; threads find them without it.
    #[inline(always)]
    fn descend(
        &self,
        nodes: &[KdNode],
        mut node: usize,
        span: &mut Span,
        mut aside: impl FnMut(usize, Span),
    ) -> usize {
        while !nodes[node].is_leaf() {
            let (axis, cut) = (nodes[node].axis(), nodes[node].cut());
            let (before, behind) = (self.before(cut, axis), self.behind(cut, axis));
            let (near, far) = near_and_far(nodes[node].lower(), axis, self.octant);
            let beyond = Span { enter: larger(span.enter, before), ..*span };
            if span.enter <= behind {
                if beyond.enter <= span.leave {
                    aside(far, beyond);
                }
                span.leave = smaller(span.leave, behind);
                span.safe = smaller(span.safe, before);
                node = near;
            } else {
                *span = beyond;
                node = far;
            }
        }
        node
    }

    /// The first leaf that the ray meets before `t_max`, by threads.
    #[inline(always)]
    #[must_use]
    pub fn first(&self, nodes: &[KdNode], t_max: f32) -> Option<(usize, Span)> {
        if nodes.is_empty() { None } else { self.from(nodes, 0, t_max) }
    }

    /// The leaf after `leaf`, by threads.
    #[inline(always)]
    #[must_use]
    pub fn after(&self, nodes: &[KdNode], leaf: usize, t_max: f32) -> Option<(usize, Span)> {
        self.from(nodes, nodes[leaf].next[self.octant] as usize, t_max)
    }

    /// The first leaf at or after `node`.
    #[inline(always)]
    fn from(&self, nodes: &[KdNode], mut node: usize, t_max: f32) -> Option<(usize, Span)> {
        while node != KdNode::END as usize {
            let mut span = self.span(&nodes[node].bounds, t_max);
            if span.enter <= span.leave {
                let leaf = self.descend(nodes, node, &mut span, |_, _| {});
                return Some((leaf, span));
            }
            node = nodes[node].next[self.octant] as usize;
        }
        None
    }

    /// The first leaf that the ray meets before `t_max`; far children are put on `stack`, which is emptied first.
    #[inline(always)]
    #[must_use]
    pub fn first_stacked(
        &self,
        nodes: &[KdNode],
        t_max: f32,
        stack: &mut Vec<(u32, Span)>,
    ) -> Option<(usize, Span)> {
        stack.clear();
        let mut span = self.span(&nodes.first()?.bounds, t_max);
        if span.enter > span.leave {
            return None;
        }
        let leaf = self.descend(nodes, 0, &mut span, |far, beyond| stack.push((far as u32, beyond)));
        Some((leaf, span))
    }

    /// The next leaf from `stack`.
    #[inline(always)]
    #[must_use]
    pub fn after_stacked(
        &self,
        nodes: &[KdNode],
        t_max: f32,
        stack: &mut Vec<(u32, Span)>,
    ) -> Option<(usize, Span)> {
        while let Some((node, mut span)) = stack.pop() {
            span.leave = smaller(span.leave, t_max);
            if span.enter <= span.leave {
                let aside = |far, beyond| stack.push((far as u32, beyond));
                let leaf = self.descend(nodes, node as usize, &mut span, aside);
                return Some((leaf, span));
            }
        }
        None
    }
}

#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
