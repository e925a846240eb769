//! Meshes compressed by Draco, for KHR_draco_mesh_compression.
//!
//! The bit stream is decoded by the crate `draco-core`, safe Rust that follows the reference decoder; here its result
//! becomes plain arrays, one value a vertex.

use crate::texels::guarded;
use crate::{ImportError, Limits};
use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex};

/// One attribute of a decoded mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct DracoAttribute {
    /// The number by which glTF's extension refers to it.
    pub unique_id: u32,
    /// Numbers a vertex.
    pub components: u8,
    /// Type of the numbers as glTF codes it: 5120 to 5126.
    pub component_type: u32,
    /// `vertices * components` little-endian numbers without gaps.
    pub bytes: Vec<u8>,
}

/// A decoded mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DracoMesh {
    /// Number of vertices.
    pub vertices: u32,
    /// Three vertex indices a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Attributes in the stream's order.
    pub attributes: Vec<DracoAttribute>,
}

impl DracoMesh {
    /// The attribute with a unique id.
    #[must_use]
    pub fn attribute(&self, unique_id: u32) -> Option<&DracoAttribute> {
        self.attributes.iter().find(|a| a.unique_id == unique_id)
    }
}

/// Decodes a mesh. `place` is for messages.
///
/// # Errors
/// Malformed, beyond the limits, or with numbers that glTF does not have (64 bits).
pub fn draco(bytes: &[u8], limits: &Limits, place: &str) -> Result<DracoMesh, ImportError> {
    guarded(place, || decode(bytes, limits, place))
}

fn decode(bytes: &[u8], limits: &Limits, place: &str) -> Result<DracoMesh, ImportError> {
    let most_vertices = limits.vertices.min(u64::from(u32::MAX));
    let ceilings = DecodeLimits::default()
        .with_max_points(most_vertices)
        .with_max_faces(limits.triangles.min(u64::from(u32::MAX)))
        .with_max_decoded_bytes(limits.decoded_bytes);
    let mut buffer = DecoderBuffer::new(bytes).with_limits(ceilings);
    let mut mesh = Mesh::new();
    let outcome = MeshDecoder::new().decode(&mut buffer, &mut mesh);
    outcome.map_err(|e| ImportError::malformed(format!("Draco: {e}"), place))?;
    // The crate's ceilings are coarse for sequential streams.
    limits.check_count(mesh.num_points() as u64, most_vertices, "vertices", place)?;
    let vertices = mesh.num_points() as u32;
    let triangles: Vec<[u32; 3]> = mesh.faces().iter().map(|face| face.map(|point| point.0)).collect();
    if triangles.iter().flatten().any(|&i| i >= vertices) {
        return Err(ImportError::malformed(
            "Draco: a triangle refers to a vertex that does not exist",
            place,
        ));
    }
    let mut attributes = Vec::new();
    for id in 0..mesh.num_attributes() {
        attributes.push(values(mesh.attribute(id), vertices, place)?);
    }
    Ok(DracoMesh { vertices, triangles, attributes })
}

/// The values of an attribute in the order of vertices; vertices without one get zeros.
fn values(attribute: &PointAttribute, vertices: u32, place: &str) -> Result<DracoAttribute, ImportError> {
    let component_type = match attribute.data_type() {
        DataType::Int8 => 5120,
        DataType::Uint8 | DataType::Bool => 5121,
        DataType::Int16 => 5122,
        DataType::Uint16 => 5123,
        DataType::Int32 => 5124,
        DataType::Uint32 => 5125,
        DataType::Float32 => 5126,
        other => {
            let what = format!("Draco: attributes of type {other:?} are not supported");
            return Err(ImportError::unsupported(what, place));
        }
    };
    let size = usize::from(attribute.num_components()) * attribute.data_type().byte_length();
    let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0);
    let stored = attribute.buffer().data();
    let mut bytes = vec![0; vertices as usize * size];
    for (point, out) in (0..vertices).zip(bytes.chunks_exact_mut(size.max(1))) {
        let first = attribute.mapped_index(PointIndex(point)).0 as usize * stride;
        if let Some(value) = stored.get(first..first.saturating_add(size)) {
            out.copy_from_slice(value);
        }
    }
    let components = attribute.num_components();
    Ok(DracoAttribute { unique_id: attribute.unique_id(), components, component_type, bytes })
}

#[cfg(test)]
mod tests;
