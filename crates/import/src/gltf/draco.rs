//! Primitives compressed by KHR_draco_mesh_compression.

use super::accessor::{Data, Fault, Source};
use super::json::Json;
use super::model::{Accessor, Component, Shape};
use super::primitive::Attributes;
use crate::Limits;
use crate::decode::{self, DracoAttribute, DracoMesh};

const EXTENSION: &str = "KHR_draco_mesh_compression";

/// A decompressed primitive. Attributes that are not in the stream stand in accessors.
#[derive(Debug)]
pub(super) struct FromDraco<'a> {
    data: &'a Data,
    primitive: &'a Json<'a>,
    ids: &'a Json<'a>,
    mesh: DracoMesh,
}

impl<'a> FromDraco<'a> {
    /// Decompresses a primitive; `None` if it is not compressed.
    pub(super) fn read(
        data: &'a Data,
        primitive: &'a Json<'a>,
        limits: &Limits,
        place: &str,
    ) -> Result<Option<Self>, Fault> {
        let Some(extension) = primitive.extension(EXTENSION) else { return Ok(None) };
        let place = format!("{place}/extensions/{EXTENSION}");
        let view = extension.index("bufferView");
        let view = view.ok_or_else(|| Fault::new("the property \"bufferView\" is missing", &place, ""))?;
        let mesh = decode::draco(&data.view_bytes(view)?, limits, &place)
            .map_err(|error| Fault::new(error.what, &place, ""))?;
        Ok(Some(Self { data, primitive, ids: extension.at("attributes"), mesh }))
    }

    /// Number of vertices.
    pub(super) fn vertices(&self) -> usize {
        self.mesh.vertices as usize
    }

    /// The vertex of each corner, three a triangle.
    pub(super) fn corners(&self) -> Vec<u32> {
        self.mesh.triangles.iter().flatten().copied().collect()
    }

    /// The stream's values of an attribute, or else those of its accessor.
    fn source(&self, semantic: &str) -> Result<Option<Source<'_>>, Fault> {
        let index = self.primitive.at("attributes").index(semantic);
        let id = self.ids.index(semantic).and_then(|id| u32::try_from(id).ok());
        match (id.and_then(|id| self.mesh.attribute(id)), index) {
            (Some(attribute), _) => {
                let declared = index.and_then(|i| self.data.accessor(i));
                Ok(packed(attribute, declared.is_some_and(|a| a.normalized), self.vertices()))
            }
            (None, Some(index)) => self.data.source(index).map(Some),
            (None, None) => Ok(None),
        }
    }
}

/// Decompressed values as elements of an accessor.
fn packed(attribute: &DracoAttribute, normalized: bool, count: usize) -> Option<Source<'_>> {
    let shape = match attribute.components {
        1 => Shape::Scalar,
        2 => Shape::Vec2,
        3 => Shape::Vec3,
        4 => Shape::Vec4,
        _ => return None,
    };
    // glTF has no signed integers of 32 bits; those in a stream are indices of joints.
    let code = if attribute.component_type == 5124 { 5125 } else { attribute.component_type };
    let component = Component::from_code(code as usize)?;
    let accessor = Accessor { view: None, offset: 0, component, normalized, count, shape, sparse: None };
    Source::packed(accessor, &attribute.bytes)
}

impl Attributes for FromDraco<'_> {
    fn floats<const N: usize>(&self, semantic: &str, fill: f32) -> Result<Option<Vec<[f32; N]>>, Fault> {
        Ok(self.source(semantic)?.and_then(|source| source.floats(fill, None)))
    }

    fn whole<const N: usize>(&self, semantic: &str) -> Result<Option<Vec<[u32; N]>>, Fault> {
        Ok(self.source(semantic)?.and_then(|source| source.whole(None)))
    }
}
