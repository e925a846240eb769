//! Compressed meshes inside glTF.

use crate::limits;
use vastlight::import::decode::{
    MeshoptFilter, MeshoptMode, draco as decode_draco, meshopt as decode_meshopt,
};

/// A Draco mesh.
pub(crate) fn draco(bytes: &[u8]) -> bool {
    let Ok(mesh) = decode_draco(bytes, &limits(), "mesh") else { return false };
    assert!(mesh.triangles.iter().flatten().all(|&i| i < mesh.vertices));
    for attribute in &mesh.attributes {
        let size = match attribute.component_type {
            5120 | 5121 => 1,
            5122 | 5123 => 2,
            5124..=5126 => 4,
            other => panic!("{other} is no type of glTF"),
        };
        let numbers = mesh.vertices as usize * usize::from(attribute.components);
        assert_eq!(attribute.bytes.len(), numbers * size);
    }
    true
}

/// A meshopt stream: mode, filter, stride and a count of two bytes stand in front.
pub(crate) fn meshopt(bytes: &[u8]) -> bool {
    let Some((&[mode, filter, stride, low, high], stream)) = bytes.split_first_chunk() else { return false };
    let mode = match mode % 3 {
        0 => MeshoptMode::Attributes,
        1 => MeshoptMode::Triangles,
        _ => MeshoptMode::Indices,
    };
    let filter = match filter % 5 {
        0 => MeshoptFilter::None,
        1 => MeshoptFilter::Octahedral,
        2 => MeshoptFilter::Quaternion,
        3 => MeshoptFilter::Exponential,
        _ => MeshoptFilter::Color,
    };
    let (count, stride) = (usize::from(u16::from_le_bytes([low, high])), usize::from(stride));
    let decoded = decode_meshopt(stream, count, stride, mode, filter, &limits(), "view");
    decoded.is_ok_and(|decoded| {
        assert_eq!(decoded.len(), count * stride);
        true
    })
}
