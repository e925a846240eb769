//! Shapes sorted by material, until they become one mesh.

use crate::Mesh;
use crate::generate::chance::Chance;
use crate::generate::shape::{Assembly, Shape};

/// Shapes by material.
#[derive(Debug, Default)]
pub(super) struct Pile {
    shapes: Vec<Shape>,
    triangles: usize,
}

impl Pile {
    /// Adds a shape with a material.
    pub(super) fn add(&mut self, material: u32, shape: &Shape) {
        let material = material as usize;
        if material >= self.shapes.len() {
            self.shapes.resize_with(material + 1, Shape::default);
        }
        self.triangles += shape.triangles.len();
        self.shapes[material].merge(shape);
    }

    /// Triangles so far.
    pub(super) const fn triangles(&self) -> usize {
        self.triangles
    }

    /// The mesh, one part a material.
    pub(super) fn into_mesh(self, name: &str) -> Mesh {
        let mut assembly = Assembly::default();
        let vertices = self.shapes.iter().map(|s| s.positions.len()).sum();
        assembly.reserve(vertices, self.triangles);
        for (material, shape) in self.shapes.into_iter().enumerate() {
            assembly.add(material as u32, &shape);
        }
        assembly.into_mesh(name)
    }
}

/// A measure as it leaves the workshop: within 3 % of what was drawn, so that no two parts are alike.
pub(super) fn vary(measure: f32, chance: &mut Chance) -> f32 {
    measure * chance.range(0.97, 1.03)
}
