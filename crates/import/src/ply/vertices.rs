//! Where the numbers of a PLY vertex go.

use super::header::{Element, Kind, Property};
use crate::ImportError;
use crate::environment::linear;
use vastlight_math::{Vec2, Vec3, Vec4};
use vastlight_scene::Mesh;

/// Which number of a vertex a property holds: an attribute and a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    Position(usize),
    Normal(usize),
    Uv(usize),
    Color(usize),
}

impl Slot {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "x" => Self::Position(0),
            "y" => Self::Position(1),
            "z" => Self::Position(2),
            "nx" | "normal_x" => Self::Normal(0),
            "ny" | "normal_y" => Self::Normal(1),
            "nz" | "normal_z" => Self::Normal(2),
            "u" | "s" | "texture_u" | "texture_s" | "u0" | "s0" => Self::Uv(0),
            "v" | "t" | "texture_v" | "texture_t" | "v0" | "t0" => Self::Uv(1),
            "red" | "r" | "diffuse_red" => Self::Color(0),
            "green" | "g" | "diffuse_green" => Self::Color(1),
            "blue" | "b" | "diffuse_blue" => Self::Color(2),
            "alpha" | "a" | "diffuse_alpha" => Self::Color(3),
            _ => return None,
        })
    }
}

/// A column of one attribute: component `offset` of each group of `step` floats.
pub(super) struct Lane<'a> {
    pub(super) values: &'a mut [f32],
    pub(super) offset: usize,
    pub(super) step: usize,
}

/// The vertices of a block as they grow.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colors: Vec<Vec4>,
    /// For each property of the element, where it goes.
    pub(super) slots: Vec<Option<Slot>>,
    color_kinds: [Option<Kind>; 4],
}

impl Vertices {
    /// Decides where each property goes. Attributes with missing components are left out.
    pub(super) fn plan(element: &Element, file: &str) -> Result<Self, ImportError> {
        let mut plan = Self::default();
        for property in &element.properties {
            let slot = match property {
                Property::Scalar { name, .. } => Slot::of(name).filter(|s| !plan.slots.contains(&Some(*s))),
                Property::List { .. } => None,
            };
            if let (Some(Slot::Color(c)), Property::Scalar { kind, .. }) = (slot, property) {
                plan.color_kinds[c] = Some(*kind);
            }
            plan.slots.push(slot);
        }
        if !(0..3).all(|i| plan.has(Slot::Position(i))) {
            return Err(ImportError::malformed("the vertices have no x, y and z", file));
        }
        let complete = [
            (0..3).all(|i| plan.has(Slot::Normal(i))),
            (0..2).all(|i| plan.has(Slot::Uv(i))),
            (0..3).all(|i| plan.has(Slot::Color(i))),
        ];
        for slot in &mut plan.slots {
            let keep = match slot {
                Some(Slot::Normal(_)) => complete[0],
                Some(Slot::Uv(_)) => complete[1],
                Some(Slot::Color(_)) => complete[2],
                _ => true,
            };
            if !keep {
                *slot = None;
            }
        }
        Ok(plan)
    }

    fn has(&self, slot: Slot) -> bool {
        self.slots.contains(&Some(slot))
    }

    /// Whether vertices have colours.
    pub(super) fn has_colors(&self) -> bool {
        self.has(Slot::Color(0))
    }

    /// Makes `rows` more vertices, to be filled through [`Self::lane`].
    pub(super) fn grow(&mut self, rows: usize) {
        let count = self.positions.len() + rows;
        self.positions.resize(count, Vec3::ZERO);
        if self.has(Slot::Normal(0)) {
            self.normals.resize(count, Vec3::ZERO);
        }
        if self.has(Slot::Uv(0)) {
            self.uvs.resize(count, Vec2::ZERO);
        }
        if self.has(Slot::Color(0)) {
            self.colors.resize(count, Vec4::ONE);
        }
    }

    /// The column of a slot, from vertex `first` on.
    pub(super) fn lane(&mut self, slot: Slot, first: usize) -> Lane<'_> {
        match slot {
            Slot::Position(i) => lane(bytemuck::cast_slice_mut(&mut self.positions[first..]), i, 3),
            Slot::Normal(i) => lane(bytemuck::cast_slice_mut(&mut self.normals[first..]), i, 3),
            Slot::Uv(i) => lane(bytemuck::cast_slice_mut(&mut self.uvs[first..]), i, 2),
            Slot::Color(i) => lane(bytemuck::cast_slice_mut(&mut self.colors[first..]), i, 4),
        }
    }

    /// Brings stored colours to linear numbers in [0, 1] by their types.
    fn convert_colors(&mut self) {
        if self.colors.is_empty() {
            return;
        }
        for (c, kind) in self.color_kinds.into_iter().enumerate() {
            let Some(maximum) = kind.and_then(largest) else { continue };
            let table: Vec<f32> = (0..=255_u8).map(|i| linear(f32::from(i) / 255.0)).collect();
            for color in &mut self.colors {
                let value = color[c];
                color[c] = match (c, maximum) {
                    (3, _) => value / maximum,
                    (_, 255.0) => table[value as u8 as usize],
                    _ => linear((value / maximum).clamp(0.0, 1.0)),
                };
            }
        }
    }

    /// The vertices as a mesh without triangles; none are left.
    pub(super) fn take(&mut self) -> Mesh {
        self.convert_colors();
        for normal in &mut self.normals {
            *normal = normal.normalize_or_zero();
        }
        // In a PLY file v grows upwards.
        for uv in &mut self.uvs {
            uv.y = 1.0 - uv.y;
        }
        let uvs = std::mem::take(&mut self.uvs);
        Mesh {
            positions: std::mem::take(&mut self.positions),
            normals: std::mem::take(&mut self.normals),
            uvs: if uvs.is_empty() { Vec::new() } else { vec![uvs] },
            colors: std::mem::take(&mut self.colors),
            ..Mesh::default()
        }
    }
}

fn lane(values: &mut [f32], offset: usize, step: usize) -> Lane<'_> {
    Lane { values, offset, step }
}

/// The number that stands for 1; `None` for floats, which are linear already.
fn largest(kind: Kind) -> Option<f32> {
    match kind {
        Kind::I8 | Kind::U8 => Some(255.0),
        Kind::I16 | Kind::U16 => Some(65535.0),
        Kind::I32 | Kind::U32 => Some(4_294_967_295.0),
        Kind::F32 | Kind::F64 => None,
    }
}
