//! A mesh on its way through the disk: vertices and triangles as they come, in temporary files.

use crate::attributes::{AttributeLayout, UV_SETS};
use crate::error::StoreError;
use crate::records::Records;
use std::path::Path;
use vastlight_math::{Aabb, Vec3};
use vastlight_scene::{Lattice, Mesh, MeshSink, SceneError, is_usable};

/// Takes in a mesh and keeps it on disk.
#[derive(Debug)]
pub struct Spool {
    folder: Box<Path>,
    positions: Records,
    attributes: Option<Records>,
    triangles: Records,
    layout: AttributeLayout,
    /// Around all usable positions as they came.
    bounds: Aabb,
    /// Whether there are positions that are not usable.
    unusable: bool,
    /// What went wrong with the files: a sink's errors do not say of which kind they are.
    failed: Option<StoreError>,
    cache_bytes: usize,
    /// Whether positions are on their lattice already.
    snapped: bool,
}

/// A mesh that is on disk as a whole.
#[derive(Debug)]
pub struct SpooledMesh {
    pub(crate) folder: Box<Path>,
    pub(crate) positions: Records,
    pub(crate) attributes: Option<Records>,
    pub(crate) triangles: Records,
    pub(crate) layout: AttributeLayout,
    /// Around all usable positions as they came.
    pub(crate) bounds: Aabb,
    /// Where positions are snapped to; none for a mesh whose positions are.
    pub(crate) lattice: Option<Lattice>,
    /// Around all vertices when they are snapped.
    pub(crate) vertices: Aabb,
    pub(crate) cache_bytes: usize,
}

impl Spool {
    /// An empty mesh in the file system of `folder`. Positions are looked up through about `cache_bytes` of memory.
    ///
    /// # Errors
    /// If no file can be made there.
    pub fn new(folder: &Path, cache_bytes: usize) -> Result<Self, StoreError> {
        Ok(Self {
            folder: folder.into(),
            positions: Records::new(folder, 3)?,
            attributes: None,
            triangles: Records::new(folder, 3)?,
            layout: AttributeLayout::default(),
            bounds: Aabb::EMPTY,
            unusable: false,
            failed: None,
            cache_bytes,
            snapped: false,
        })
    }

    /// The same for a mesh that went through `vastlight_scene::MeshPreparation`.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn of_prepared(folder: &Path, cache_bytes: usize) -> Result<Self, StoreError> {
        Ok(Self { snapped: true, ..Self::new(folder, cache_bytes)? })
    }

    /// The mesh, when all of it came; `read` is what its reader said.
    ///
    /// # Errors
    /// That of the files if one of them failed, else that of the reader.
    pub fn finish<E: From<StoreError> + From<SceneError>>(
        mut self,
        read: Result<(), SceneError>,
    ) -> Result<SpooledMesh, E> {
        match (self.failed.take(), read) {
            (Some(error), _) => return Err(error.into()),
            (None, Err(error)) => return Err(error.into()),
            (None, Ok(())) => {}
        }
        let largest = if self.bounds.is_empty() {
            0.0
        } else {
            self.bounds.min.abs().max(self.bounds.max.abs()).max_element()
        };
        let lattice = (!self.snapped).then(|| Lattice::for_extent(largest));
        let mut vertices = self.bounds;
        if let Some(lattice) = lattice.filter(|_| !vertices.is_empty()) {
            // Snapping keeps the order.
            vertices = Aabb { min: lattice.snap(vertices.min), max: lattice.snap(vertices.max) };
        }
        if self.unusable {
            vertices = vertices.grow(Vec3::ZERO);
        }
        Ok(SpooledMesh {
            folder: self.folder,
            positions: self.positions,
            attributes: self.attributes,
            triangles: self.triangles,
            layout: self.layout,
            bounds: self.bounds,
            lattice,
            vertices,
            cache_bytes: self.cache_bytes,
        })
    }

    fn take_vertices(&mut self, block: &Mesh) -> Result<(), StoreError> {
        if self.positions.len() == 0 {
            self.layout = AttributeLayout::of(block);
            if self.layout.floats() > 0 {
                self.attributes = Some(Records::new(&self.folder, self.layout.floats())?);
            }
        }
        for &p in &block.positions {
            if is_usable(p) {
                self.bounds = self.bounds.grow(p);
            } else {
                self.unusable = true;
            }
        }
        self.positions.push(&block.positions)?;
        let Some(attributes) = &mut self.attributes else { return Ok(()) };
        let mut records = Vec::with_capacity(block.positions.len() * self.layout.floats());
        for vertex in 0..block.positions.len() {
            push_attributes(block, vertex, &mut records);
        }
        attributes.push(&records)
    }

    fn note<T>(&mut self, result: Result<T, StoreError>) -> Result<T, SceneError> {
        result.map_err(|error| {
            let told = SceneError::new(error.what.clone(), error.place.clone(), error.hint);
            self.failed = Some(error);
            told
        })
    }
}

impl MeshSink for Spool {
    fn vertices(&mut self, block: &Mesh) -> Result<(), SceneError> {
        if self.positions.len() > 0 && AttributeLayout::of(block) != self.layout {
            return Err(SceneError::new("blocks of vertices have different attributes", "mesh", ""));
        }
        let taken = self.take_vertices(block);
        self.note(taken)
    }

    fn triangles(&mut self, block: &[[u32; 3]]) -> Result<(), SceneError> {
        let taken = self.triangles.push(block);
        self.note(taken)
    }

    fn position(&mut self, vertex: u32) -> Result<Vec3, SceneError> {
        if u64::from(vertex) >= self.positions.len() {
            return Ok(Vec3::ZERO);
        }
        let found = self.look_up(vertex);
        self.note(found)
    }
}

impl Spool {
    fn look_up(&mut self, vertex: u32) -> Result<Vec3, StoreError> {
        if !self.positions.has_cache() {
            self.positions.cache(self.cache_bytes)?;
        }
        self.positions.get(u64::from(vertex)).map(position)
    }
}

/// A position as it stands in a file.
#[inline]
pub(crate) fn position(words: &[u32]) -> Vec3 {
    Vec3::new(f32::from_bits(words[0]), f32::from_bits(words[1]), f32::from_bits(words[2]))
}

/// Adds the record of a vertex as pages of attributes have it.
pub(crate) fn push_attributes(mesh: &Mesh, vertex: usize, records: &mut Vec<f32>) {
    let Mesh { normals, tangents, colors, uvs, .. } = mesh;
    normals.get(vertex).iter().for_each(|v| records.extend(v.to_array()));
    tangents.get(vertex).iter().for_each(|v| records.extend(v.to_array()));
    colors.get(vertex).iter().for_each(|v| records.extend(v.to_array()));
    for set in uvs.iter().take(UV_SETS) {
        set.get(vertex).iter().for_each(|v| records.extend(v.to_array()));
    }
}
