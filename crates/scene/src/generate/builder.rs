//! Collects meshes, materials and places into a [`SceneDesc`].

use super::shape::{Assembly, Shape};
use crate::{
    Encoding, Image, ImplicitShape, Instance, Material, Mesh, Part, SceneDesc, Texture, TextureTransform,
};
use std::sync::Arc;
use vastlight_math::{Affine3, Vec2, Vec3};

/// A scene that grows.
#[derive(Clone, Debug, Default)]
pub(super) struct Builder {
    /// What has been collected so far; open for what needs no bookkeeping (lights, cameras, environment).
    pub(super) desc: SceneDesc,
}

impl Builder {
    /// Adds a material.
    pub(super) fn material(&mut self, material: Material) -> u32 {
        self.desc.materials.push(material);
        (self.desc.materials.len() - 1) as u32
    }

    /// Adds an image as a repeating texture that covers `metres` of the surface.
    pub(super) fn texture(&mut self, image: Image, encoding: Encoding, metres: Vec2) -> u32 {
        self.desc.images.push(image);
        let mut texture = Texture::new((self.desc.images.len() - 1) as u32, encoding);
        texture.transform = TextureTransform { scale: metres.recip(), ..TextureTransform::IDENTITY };
        self.desc.textures.push(texture);
        (self.desc.textures.len() - 1) as u32
    }

    /// Adds a mesh without placing it.
    pub(super) fn mesh(&mut self, name: &str, assembly: Assembly) -> u32 {
        self.desc.meshes.push(assembly.into_mesh(name));
        (self.desc.meshes.len() - 1) as u32
    }

    /// Triangles of all instances so far.
    pub(super) fn instanced_triangles(&self) -> u64 {
        let count = |i: &Instance| self.desc.meshes[i.mesh as usize].triangles.len() as u64;
        self.desc.instances.iter().map(count).sum()
    }

    /// Places a mesh; the instance is called like it.
    pub(super) fn place(&mut self, mesh: u32, world_from_object: Affine3) {
        let name = &self.desc.meshes[mesh as usize].name;
        let known = self.desc.names.iter().rposition(|n| n == name);
        let name = known.unwrap_or_else(|| {
            self.desc.names.push(name.clone());
            self.desc.names.len() - 1
        });
        self.desc.instances.push(Instance { world_from_object, mesh, name: name as u32 });
    }

    /// Places a mesh without turning it.
    pub(super) fn place_at(&mut self, mesh: u32, position: Vec3) {
        self.place(mesh, Affine3::from_translation(position));
    }

    /// Adds a mesh of one shape and one material, and places it where it is.
    pub(super) fn object(&mut self, name: &str, material: u32, shape: &Shape) {
        let mut assembly = Assembly::default();
        assembly.add(material, shape);
        self.assembled(name, assembly);
    }

    /// Adds an implicit surface of one material, and places it where it is.
    pub(super) fn implicit(&mut self, name: &str, material: u32, shape: ImplicitShape) {
        self.desc.meshes.push(Mesh {
            name: name.into(),
            parts: vec![Part { first_triangle: 0, material }],
            implicit: Some(Arc::new(shape)),
            ..Mesh::default()
        });
        self.place((self.desc.meshes.len() - 1) as u32, Affine3::IDENTITY);
    }

    /// Adds a mesh of several materials, and places it where it is.
    pub(super) fn assembled(&mut self, name: &str, assembly: Assembly) {
        let mesh = self.mesh(name, assembly);
        self.place(mesh, Affine3::IDENTITY);
    }
}
