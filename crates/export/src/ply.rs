//! PLY: all instances as one mesh in world space, binary little-endian.

use crate::ExportError;
use crate::flatten::Placed;
use crate::source::Source;
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

/// Vertices and triangles of all placements, and what all or some meshes have.
#[derive(Clone, Copy, Debug)]
struct Totals {
    vertices: u64,
    triangles: u64,
    all_have_normals: bool,
    some_have_uvs: bool,
}

pub(crate) fn write(scene: &impl Source, path: &Path, lost: &mut Diagnostics) -> Result<(), ExportError> {
    if let Some(triangles) = scene.triangles() {
        // Known within 1 %.
        refuse_if_beyond(path, 0, triangles - triangles / 64)?;
    }
    let totals = totals(scene)?;
    refuse_if_beyond(path, totals.vertices, totals.triangles)?;
    let tables = scene.tables();
    note_losses(tables, lost);
    let layout = Layout {
        normals: totals.vertices > 0 && totals.all_have_normals,
        uvs: !tables.textures().is_empty() && totals.some_have_uvs,
        colors: true,
    };
    let mut file = Target::create(path)?;
    file.put(header(layout, totals.vertices, totals.triangles).as_bytes())?;
    scene.placements(&mut |mesh, instances| {
        instances.iter().try_for_each(|i| write_vertices(&mut file, tables, &Placed::new(mesh, i), layout))
    })?;
    let mut first = 0;
    scene.placements(&mut |mesh, instances| {
        for instance in instances {
            write_faces(&mut file, &Placed::new(mesh, instance), first)?;
            first += mesh.positions.len() as u32;
        }
        Ok(())
    })?;
    file.finish()
}

fn totals(scene: &impl Source) -> Result<Totals, ExportError> {
    let mut totals = Totals { vertices: 0, triangles: 0, all_have_normals: true, some_have_uvs: false };
    scene.placements(&mut |mesh, instances| {
        totals.vertices += mesh.positions.len() as u64 * instances.len() as u64;
        totals.triangles += mesh.triangles.len() as u64 * instances.len() as u64;
        totals.all_have_normals &= !mesh.normals.is_empty();
        totals.some_have_uvs |= !mesh.uvs.is_empty();
        Ok(())
    })?;
    Ok(totals)
}

fn refuse_if_beyond(path: &Path, vertices: u64, triangles: u64) -> Result<(), ExportError> {
    if vertices.max(triangles) <= u64::from(u32::MAX) {
        return Ok(());
    }
    let what = format!("{vertices} vertices and {triangles} triangles do not fit 32-bit numbers");
    Err(ExportError::too_large(path, what, "ask for fewer triangles, or write .glb, which keeps instances"))
}

fn write_faces(file: &mut Target, placed: &Placed<'_>, first: u32) -> Result<(), ExportError> {
    for t in 0..placed.mesh.triangles.len() {
        let mut face = [3_u8; 13];
        for (slot, index) in face[1..].chunks_exact_mut(4).zip(placed.triangle(t)) {
            slot.copy_from_slice(&(first + index).to_le_bytes());
        }
        file.put(&face)?;
    }
    Ok(())
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
