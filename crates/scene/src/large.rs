//! Meshes that come block by block, so that one may be larger than memory.

use crate::{Mesh, Part, PieceInstance, SceneError};
use std::fmt;
use vastlight_math::Vec3;

/// Takes in a mesh block by block. Vertices are numbered from 0 over all blocks; triangles may name vertices that come
/// later.
pub trait MeshSink {
    /// So many vertices will come at least, as far as is known.
    fn expect_vertices(&mut self, _count: usize) {}

    /// So many triangles will come at least, as far as is known.
    fn expect_triangles(&mut self, _count: usize) {}

    /// Takes more vertices: positions and attributes of `block`, whose triangles do not count. All blocks have the same
    /// attributes.
    ///
    /// # Errors
    /// There is no room for them, or they have other attributes.
    fn vertices(&mut self, block: &Mesh) -> Result<(), SceneError>;

    /// Takes more triangles.
    ///
    /// # Errors
    /// There is no room for them.
    fn triangles(&mut self, block: &[[u32; 3]]) -> Result<(), SceneError>;

    /// The position of a vertex that came before; the origin for one that did not.
    ///
    /// # Errors
    /// It cannot be read.
    fn position(&mut self, vertex: u32) -> Result<Vec3, SceneError>;
}

/// Reads a mesh into a sink.
pub type ReadMesh = Box<dyn FnOnce(&mut dyn MeshSink) -> Result<(), SceneError> + Send>;

/// A mesh that is read block by block, with its placements.
pub struct LargeMesh {
    /// Name, as of a [`Mesh`].
    pub name: String,
    /// Material runs, as of a [`Mesh`].
    pub parts: Vec<Part>,
    /// Where it stands.
    pub instances: Vec<PieceInstance>,
    /// Triangles, if that is known.
    pub triangles: Option<u64>,
    /// Reads it.
    pub read: ReadMesh,
}

impl fmt::Debug for LargeMesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut f = f.debug_struct("LargeMesh");
        f.field("name", &self.name).field("triangles", &self.triangles).finish_non_exhaustive()
    }
}

impl LargeMesh {
    /// The mesh in memory.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn collect(self) -> Result<Mesh, SceneError> {
        let mut mesh = Mesh::default();
        (self.read)(&mut mesh)?;
        Ok(Mesh { name: self.name, parts: self.parts, ..mesh })
    }
}

impl MeshSink for Mesh {
    fn expect_vertices(&mut self, count: usize) {
        self.positions.reserve_exact(count);
    }

    fn expect_triangles(&mut self, count: usize) {
        self.triangles.reserve_exact(count);
    }

    fn vertices(&mut self, block: &Mesh) -> Result<(), SceneError> {
        /// Adds to an attribute, with room for as many vertices as there is for positions.
        fn add<T: Copy>(all: &mut Vec<T>, more: &[T], room: usize) {
            if !more.is_empty() {
                all.reserve_exact(room.saturating_sub(all.len()));
                all.extend_from_slice(more);
            }
        }
        self.positions.extend(&block.positions);
        let room = self.positions.capacity();
        add(&mut self.normals, &block.normals, room);
        add(&mut self.tangents, &block.tangents, room);
        add(&mut self.colors, &block.colors, room);
        if self.uvs.len() < block.uvs.len() {
            self.uvs.resize(block.uvs.len(), Vec::new());
        }
        self.uvs.iter_mut().zip(&block.uvs).for_each(|(set, more)| add(set, more, room));
        Ok(())
    }

    fn triangles(&mut self, block: &[[u32; 3]]) -> Result<(), SceneError> {
        self.triangles.extend(block);
        Ok(())
    }

    fn position(&mut self, vertex: u32) -> Result<Vec3, SceneError> {
        Ok(self.positions.get(vertex as usize).copied().unwrap_or_default())
    }
}

impl Mesh {
    /// Gives the mesh to a sink, block by block.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn stream(&self, sink: &mut dyn MeshSink) -> Result<(), SceneError> {
        const BLOCK: usize = 1 << 16;
        let count = self.positions.len();
        for first in (0..count).step_by(BLOCK) {
            let block = first..(first + BLOCK).min(count);
            sink.vertices(&self.vertices_in(block))?;
        }
        self.triangles.chunks(BLOCK).try_for_each(|block| sink.triangles(block))
    }

    /// Some of the vertices, as a mesh without triangles.
    fn vertices_in(&self, range: std::ops::Range<usize>) -> Mesh {
        fn part<T: Copy>(all: &[T], range: &std::ops::Range<usize>) -> Vec<T> {
            all.get(range.clone()).map(<[T]>::to_vec).unwrap_or_default()
        }
        Mesh {
            positions: part(&self.positions, &range),
            normals: part(&self.normals, &range),
            tangents: part(&self.tangents, &range),
            colors: part(&self.colors, &range),
            uvs: self.uvs.iter().map(|set| part(set, &range)).collect(),
            ..Mesh::default()
        }
    }
}
