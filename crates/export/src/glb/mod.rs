//! GLB (glTF 2.0 in one file): the JSON chunk first, then the vertex data, mesh by mesh.

mod document;
mod layout;
mod material;
mod number;

use crate::source::Source;
use crate::target::Target;
use crate::{ExportError, png};
use document::Document;
use layout::{Layout, Primitive};
use std::path::Path;
use vastlight_math::{Frame, Vec3, Vec4};
use vastlight_scene::{Diagnostics, Mesh, Scene};

/// A GLB's length is a 32-bit number.
const LIMIT: u64 = u32::MAX as u64;
/// Goes with what glTF has no place for.
const EXTRAS_HINT: &str = "vastlight reads it there, other programs do not";
const HINT: &str = "write .ply, or ask for fewer triangles";

pub(crate) fn write(scene: &impl Source, path: &Path, lost: &mut Diagnostics) -> Result<(), ExportError> {
    let tables = scene.tables();
    // Six bytes a triangle at least; the number is known within 1 %.
    refuse_if_beyond(path, scene.triangles().unwrap_or(0).saturating_mul(5))?;
    let images = encode_images(tables, lost)?;
    let mut layout = Layout::default();
    scene.meshes(&mut |mesh, instances| {
        layout.add(mesh, instances);
        refuse_if_beyond(path, layout.bytes)
    })?;
    layout.add_images(&images);
    refuse_if_beyond(path, layout.bytes)?;
    let mut file = Target::create(path)?;
    file.put(b"glTF\x02\0\0\0\0\0\0\0\0\0\0\0JSON")?;
    let instances = scene.instances().unwrap_or(&layout.instances);
    Document { scene: tables, layout: &layout, instances }.write(&mut file, lost)?;
    file.pad(b' ')?;
    let json_bytes = file.written() - 20;
    refuse_if_beyond(path, file.written() + 8 + layout.bytes)?;
    file.put(&(layout.bytes as u32).to_le_bytes())?;
    file.put(b"BIN\0")?;
    let mut places = layout.meshes.iter();
    scene.meshes(&mut |mesh, _| {
        places.next().map_or(Ok(()), |place| write_mesh(&mut file, mesh, &place.primitives))
    })?;
    for image in &images {
        file.put(image)?;
        file.pad(0)?;
    }
    let total = file.written();
    file.patch(8, &(total as u32).to_le_bytes())?;
    file.patch(12, &(json_bytes as u32).to_le_bytes())?;
    file.finish()
}

fn refuse_if_beyond(path: &Path, bytes: u64) -> Result<(), ExportError> {
    if bytes <= LIMIT {
        return Ok(());
    }
    let what = format!("the scene needs {bytes} bytes or more, a GLB ends at 4 GiB");
    Err(ExportError::too_large(path, what, HINT))
}

/// PNG bytes of every image that a texture uses; nothing for the others.
fn encode_images(scene: &Scene, lost: &mut Diagnostics) -> Result<Vec<Vec<u8>>, ExportError> {
    let used = |i: usize| scene.textures().iter().any(|t| t.image as usize == i);
    let encode = |(i, image)| if used(i) { png::encode(image, lost) } else { Ok(Vec::new()) };
    scene.images().iter().enumerate().map(encode).collect()
}

/// Attribute by attribute, then the indices of each primitive counted from its first vertex.
fn write_mesh(file: &mut Target, mesh: &Mesh, primitives: &[Primitive]) -> Result<(), ExportError> {
    file.put(bytemuck::cast_slice(&mesh.positions))?;
    file.put(bytemuck::cast_slice(&mesh.normals))?;
    for (i, tangent) in mesh.tangents.iter().enumerate() {
        file.put(bytemuck::bytes_of(&unit_tangent(mesh, i, *tangent)))?;
    }
    for set in &mesh.uvs {
        file.put(bytemuck::cast_slice(set))?;
    }
    file.put(bytemuck::cast_slice(&mesh.colors))?;
    for primitive in primitives {
        let triangles = &mesh.triangles[primitive.triangles.clone()];
        for index in triangles.iter().flatten().map(|i| i - primitive.first_vertex) {
            if primitive.short_indices {
                file.put(&(index as u16).to_le_bytes())?;
            } else {
                file.put(&index.to_le_bytes())?;
            }
        }
        file.pad(0)?;
    }
    Ok(())
}

/// glTF wants unit tangents; where the texture coordinates give none, any direction in the surface will do.
fn unit_tangent(mesh: &Mesh, vertex: usize, tangent: Vec4) -> Vec4 {
    if tangent.truncate().length_squared() > 0.5 {
        return tangent;
    }
    let normal = mesh.normals.get(vertex).copied().unwrap_or(Vec3::Z);
    Frame::from_z(normal).x.extend(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_beyond_four_gibibytes_is_refused() {
        let path = Path::new("big.glb");
        assert!(refuse_if_beyond(path, LIMIT).is_ok());
        let error = refuse_if_beyond(path, LIMIT + 1).expect_err("too large");
        assert!(error.to_string().contains("4 GiB"), "{error}");
    }
}
