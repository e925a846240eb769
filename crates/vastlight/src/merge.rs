//! Several scenes as one: tables stand behind each other, and what refers to them is moved.

use std::collections::VecDeque;
use std::path::PathBuf;
use vastlight_import::Streamed;
use vastlight_math::Affine3;
use vastlight_scene::{
    Environment, ImageRows, LargeMesh, Light, Material, Mesh, Part, Piece, PieceInstance, Pieces, SceneDesc,
    SceneError, SceneStream,
};

/// Scenes that were put together so far.
pub(crate) struct Merged {
    desc: SceneDesc,
    pieces: MovedPieces,
    large: Vec<LargeMesh>,
    triangles: Option<u64>,
    rows: Vec<ImageRows>,
    files: Vec<PathBuf>,
}

impl Default for Merged {
    fn default() -> Self {
        Self {
            desc: SceneDesc::default(),
            pieces: MovedPieces::default(),
            large: Vec::new(),
            triangles: Some(0),
            rows: Vec::new(),
            files: Vec::new(),
        }
    }
}

/// How far the tables of a scene are moved, and where the scene stands.
#[derive(Clone)]
struct Placing {
    materials: u32,
    names: u32,
    transforms: Vec<Affine3>,
}

impl Placing {
    fn instances(&self, own: Vec<PieceInstance>) -> Vec<PieceInstance> {
        let place = |transform: &Affine3, i: &PieceInstance| PieceInstance {
            world_from_object: *transform * i.world_from_object,
            name: i.name + self.names,
        };
        match self.transforms.as_slice() {
            // Where they stand, since there may be many.
            [transform] => own.into_iter().map(|i| place(transform, &i)).collect(),
            many => many.iter().flat_map(|t| own.iter().map(move |i| place(t, i))).collect(),
        }
    }

    fn parts(&self, parts: Vec<Part>) -> Vec<Part> {
        if parts.is_empty() && self.materials > 0 {
            return vec![Part { first_triangle: 0, material: self.materials }];
        }
        parts.into_iter().map(|part| Part { material: part.material + self.materials, ..part }).collect()
    }

    fn piece(&self, piece: Piece) -> Piece {
        let (parts, instances) = (self.parts(piece.mesh.parts), self.instances(piece.instances));
        Piece { mesh: Mesh { parts, ..piece.mesh }, instances, ..piece }
    }

    fn large(&self, mesh: LargeMesh) -> LargeMesh {
        let (parts, instances) = (self.parts(mesh.parts), self.instances(mesh.instances));
        LargeMesh { parts, instances, ..mesh }
    }
}

/// The pieces of all scenes, one scene after the other.
#[derive(Default)]
struct MovedPieces {
    scenes: VecDeque<(Pieces, Placing)>,
}

impl Iterator for MovedPieces {
    type Item = Result<Piece, SceneError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.nth(0)
    }

    /// Pieces of the last scene that are passed over are not made; nobody knows how many those before it have.
    fn nth(&mut self, mut n: usize) -> Option<Self::Item> {
        while self.scenes.len() > 1 {
            match self.scenes[0].0.next() {
                Some(piece) if n == 0 => return Some(piece.map(|piece| self.scenes[0].1.piece(piece))),
                Some(_) => n -= 1,
                None => drop(self.scenes.pop_front()),
            }
        }
        let (pieces, placing) = self.scenes.front_mut()?;
        pieces.nth(n).map(|piece| piece.map(|piece| placing.piece(piece)))
    }
}

impl Merged {
    /// Adds a scene at each of the given places; its cameras come along to the first.
    pub(crate) fn add(&mut self, scene: Streamed, transforms: Vec<Affine3>) {
        let Streamed { stream, large, files } = scene;
        self.files.extend(files);
        let SceneStream { desc: own, pieces, triangles, rows } = stream;
        let images = self.desc.images.len() as u32;
        self.rows.extend(rows.into_iter().map(|rows| ImageRows { image: rows.image + images, ..rows }));
        let placing = Placing {
            materials: self.desc.materials.len() as u32,
            names: self.desc.names.len() as u32,
            transforms,
        };
        self.add_tables(own, &placing.transforms);
        self.triangles = self.triangles.zip(triangles).map(|(a, b)| a + b);
        self.large.extend(large.into_iter().map(|mesh| placing.large(mesh)));
        self.pieces.scenes.push_back((pieces, placing));
    }

    fn add_tables(&mut self, mut own: SceneDesc, transforms: &[Affine3]) {
        let desc = &mut self.desc;
        let (images, textures) = (desc.images.len() as u32, desc.textures.len() as u32);
        if own.materials.is_empty() {
            own.materials.push(Material::new("neutral"));
        }
        own.materials.iter_mut().for_each(|material| material.move_textures(textures));
        own.textures.iter_mut().for_each(|texture| texture.image += images);
        if let Some(Environment::Map { image, .. }) = &mut own.environment {
            *image += images;
        }
        let first = transforms.first().copied().unwrap_or(Affine3::IDENTITY);
        own.cameras.iter_mut().for_each(|c| c.world_from_camera = first * c.world_from_camera);
        let moved = |t: &Affine3, light: &Light| Light {
            world_from_light: *t * light.world_from_light,
            ..light.clone()
        };
        desc.lights
            .extend(transforms.iter().flat_map(|t| own.lights.iter().map(move |light| moved(t, light))));
        desc.names.append(&mut own.names);
        desc.materials.append(&mut own.materials);
        desc.textures.append(&mut own.textures);
        desc.images.append(&mut own.images);
        desc.cameras.append(&mut own.cameras);
        desc.environment = desc.environment.take().or(own.environment);
        own.diagnostics.items().iter().for_each(|item| desc.diagnostics.push(item.clone()));
    }

    /// All of them as one.
    pub(crate) fn finish(self) -> Streamed {
        let Self { desc, pieces, large, triangles, rows, files } = self;
        let pieces = Box::new(pieces);
        Streamed { stream: SceneStream { pieces, triangles, rows, ..desc.into() }, large, files }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Vec3;
    use vastlight_scene::generate::{GenerateOptions, stream};

    fn demo(name: &str) -> Streamed {
        let options = GenerateOptions::default();
        stream(name, &options).expect("a demo").into()
    }

    #[test]
    fn scenes_keep_their_looks_and_stand_where_they_should() {
        let single = |name| demo(name).stream.collect().expect("whole");
        let (first, second) = (single("cornell"), single("still-life"));
        let mut merged = Merged::default();
        let aside = Affine3::from_translation(Vec3::X * 10.0);
        merged.add(demo("cornell"), vec![Affine3::IDENTITY]);
        merged.add(demo("still-life"), vec![Affine3::IDENTITY, aside]);
        let both = merged.finish().stream.collect().expect("whole");
        assert_eq!(both.meshes.len(), first.meshes.len() + second.meshes.len());
        assert_eq!(both.instances.len(), first.instances.len() + 2 * second.instances.len());
        for instance in &second.instances {
            let number = instance.mesh + first.meshes.len() as u32;
            let name = |desc: &SceneDesc, name: u32| desc.names[name as usize].clone();
            let copies: Vec<_> = both
                .instances
                .iter()
                .filter(|i| i.mesh == number && name(&both, i.name) == name(&second, instance.name))
                .collect();
            for place in [instance.world_from_object, aside * instance.world_from_object] {
                assert!(copies.iter().any(|copy| copy.world_from_object == place));
            }
        }
        for (number, mesh) in second.meshes.iter().enumerate() {
            let moved = &both.meshes[first.meshes.len() + number];
            for triangle in [0, mesh.triangles.len() as u32 - 1] {
                let (a, b) = (mesh.material_of(triangle), moved.material_of(triangle));
                let (a, b) = (&second.materials[a as usize], &both.materials[b as usize]);
                assert_eq!(a.name, b.name);
                let image = |desc: &SceneDesc, m: &Material| {
                    let texture = m.base_color.texture.map(|t| desc.textures[t as usize].image);
                    texture.map(|image| desc.images[image as usize].name.clone())
                };
                assert_eq!(image(&second, a), image(&both, b));
            }
        }
    }
}
