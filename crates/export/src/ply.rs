//! PLY: all instances as one mesh in world space, binary little-endian.

use crate::ExportError;
use crate::flatten::{Placed, totals};
use crate::target::Target;
use std::path::Path;
use vastlight_math::{Vec3, Vec4, real::pow};
use vastlight_scene::{Diagnostics, Scene};

/// What the file's vertices carry.
#[derive(Clone, Copy, Debug)]
struct Layout {
    normals: bool,
    uvs: bool,
    colors: bool,
}

pub(crate) fn write(scene: &Scene, path: &Path, lost: &mut Diagnostics) -> Result<(), ExportError> {
    let (vertices, triangles) = totals(scene);
    if vertices > u64::from(u32::MAX) || triangles > u64::from(u32::MAX) {
        let what = format!("{vertices} vertices and {triangles} triangles do not fit 32-bit numbers");
        return Err(ExportError::too_large(path, what, "write .glb, which keeps instances"));
    }
    note_losses(scene, lost);
    let used = |has: fn(&vastlight_scene::Mesh) -> bool| scene.meshes().iter().any(has);
    let layout = Layout {
        normals: !scene.meshes().is_empty() && !used(|m| m.normals.is_empty()),
        uvs: !scene.textures().is_empty() && used(|m| !m.uvs.is_empty()),
        colors: true,
    };
    let mut file = Target::create(path)?;
    file.put(header(layout, vertices, triangles).as_bytes())?;
    for instance in scene.instances() {
        write_vertices(&mut file, scene, &Placed::new(scene, instance), layout)?;
    }
    let mut first = 0;
    for instance in scene.instances() {
        let placed = Placed::new(scene, instance);
        for t in 0..placed.mesh.triangles.len() {
            let mut face = [3_u8; 13];
            for (slot, index) in face[1..].chunks_exact_mut(4).zip(placed.triangle(t)) {
                slot.copy_from_slice(&(first + index).to_le_bytes());
            }
            file.put(&face)?;
        }
        first += placed.mesh.positions.len() as u32;
    }
    file.finish()
}

fn header(layout: Layout, vertices: u64, triangles: u64) -> String {
    let mut header =
        format!("ply\nformat binary_little_endian 1.0\ncomment vastlight\nelement vertex {vertices}\n");
    let mut properties = |kind: &str, names: &[&str]| {
        for name in names {
            header.push_str(&format!("property {kind} {name}\n"));
        }
    };
    properties("float", &["x", "y", "z"]);
    if layout.normals {
        properties("float", &["nx", "ny", "nz"]);
    }
    if layout.uvs {
        properties("float", &["s", "t"]);
    }
    if layout.colors {
        properties("uchar", &["red", "green", "blue"]);
    }
    header.push_str(&format!(
        "element face {triangles}\nproperty list uchar uint vertex_indices\nend_header\n"
    ));
    header
}

fn write_vertices(
    file: &mut Target,
    scene: &Scene,
    placed: &Placed<'_>,
    layout: Layout,
) -> Result<(), ExportError> {
    let mesh = placed.mesh;
    let base = base_colors(scene, mesh);
    for i in 0..mesh.positions.len() {
        let mut record = [0_u8; 4 * 8 + 3];
        let mut length = 0;
        let mut put = |x: f32| {
            record[length..length + 4].copy_from_slice(&x.to_le_bytes());
            length += 4;
        };
        placed.position(i).to_array().into_iter().for_each(&mut put);
        if layout.normals {
            placed.normal(i).unwrap_or(Vec3::Y).to_array().into_iter().for_each(&mut put);
        }
        if layout.uvs {
            // PLY's t grows upwards.
            let uv = mesh.uvs.first().map_or([0.0, 1.0], |set| set[i].to_array());
            put(uv[0]);
            put(1.0 - uv[1]);
        }
        if layout.colors {
            let color = base[i % base.len()] * mesh.colors.get(i).map_or(Vec3::ONE, |c| Vec4::truncate(*c));
            record[length..length + 3].copy_from_slice(&color.to_array().map(srgb_byte));
            length += 3;
        }
        file.put(&record[..length])?;
    }
    Ok(())
}

/// The material's colour of each vertex; one entry if the mesh has one material.
fn base_colors(scene: &Scene, mesh: &vastlight_scene::Mesh) -> Vec<Vec3> {
    let color = |material: u32| scene.materials()[material as usize].base_color.factor;
    if mesh.parts.len() <= 1 {
        return vec![color(mesh.material_of(0))];
    }
    let mut colors = vec![Vec3::ONE; mesh.positions.len().max(1)];
    for (i, part) in mesh.parts.iter().enumerate() {
        let end = mesh.parts.get(i + 1).map_or(mesh.triangles.len(), |p| p.first_triangle as usize);
        for &vertex in mesh.triangles[part.first_triangle as usize..end].iter().flatten() {
            colors[vertex as usize] = color(part.material);
        }
    }
    colors
}

fn srgb_byte(x: f32) -> u8 {
    let x = x.clamp(0.0, 1.0);
    let y = if x <= 0.003_130_8 { x * 12.92 } else { 1.055 * pow(x, 1.0 / 2.4) - 0.055 };
    (y * 255.0 + 0.5) as u8
}

fn note_losses(scene: &Scene, lost: &mut Diagnostics) {
    let hint = "write .glb to keep them";
    if scene.materials().len() > 1 || !scene.textures().is_empty() {
        lost.warn("PLY holds no materials and textures; their colours become vertex colours", "", hint);
    }
    lost.warn("PLY holds no cameras, lights and sky", "", hint);
}
