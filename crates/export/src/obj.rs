//! OBJ and its MTL: all instances in world space, one object each; textures as PNG files beside it.

use crate::flatten::Placed;
use crate::source::Source;
use crate::target::Target;
use crate::{ExportError, png};
use std::fmt::Write;
use std::path::Path;
use vastlight_scene::{Diagnostics, Material, Mesh, Scene, TextureTransform};

/// First numbers of the next object's vertices, texture coordinates and normals; OBJ counts from 1 over the file.
struct Numbers {
    position: u64,
    uv: u64,
    normal: u64,
}

pub(crate) fn write(scene: &impl Source, path: &Path, lost: &mut Diagnostics) -> Result<(), ExportError> {
    let library = path.with_extension("mtl");
    let tables = scene.tables();
    write_library(tables, &library, lost)?;
    let mut file = Target::create(path)?;
    let mut text = String::from("# vastlight\n");
    let library_name = library.file_name().unwrap_or_default().to_string_lossy();
    text.push_str(&format!("mtllib {library_name}\n"));
    let mut numbers = Numbers { position: 1, uv: 1, normal: 1 };
    let mut number = 0_u64;
    scene.placements(&mut |mesh, instances| {
        for instance in instances {
            text.push_str(&format!("o {}_{number}\n", token(tables.name(instance.name))));
            number += 1;
            let placed = Placed::new(mesh, instance);
            write_vertices(&mut file, &mut text, tables, &placed)?;
            write_faces(&mut file, &mut text, tables, &placed, &numbers)?;
            numbers.position += mesh.positions.len() as u64;
            numbers.normal += mesh.normals.len() as u64;
            numbers.uv += mesh.uvs.first().map_or(0, |set| set.len() as u64);
        }
        Ok(())
    })?;
    drain(&mut file, &mut text, 0)?;
    lost.warn("OBJ holds no cameras, lights and sky", "", "write .glb to keep cameras and lights");
    file.finish()
}

/// Writes the text out once it is longer than `limit`.
fn drain(file: &mut Target, text: &mut String, limit: usize) -> Result<(), ExportError> {
    if text.len() > limit {
        file.put(text.as_bytes())?;
        text.clear();
    }
    Ok(())
}

const CHUNK: usize = 1 << 16;

fn write_vertices(
    file: &mut Target,
    text: &mut String,
    scene: &Scene,
    placed: &Placed<'_>,
) -> Result<(), ExportError> {
    let mesh = placed.mesh;
    for i in 0..mesh.positions.len() {
        let p = placed.position(i);
        let _ = write!(text, "v {} {} {}", p.x, p.y, p.z);
        if let Some(c) = mesh.colors.get(i) {
            let _ = write!(text, " {} {} {}", c.x, c.y, c.z);
        }
        text.push('\n');
        drain(file, text, CHUNK)?;
    }
    if let Some(set) = mesh.uvs.first() {
        let scale = uv_transform(scene, mesh);
        for uv in set {
            // OBJ has no texture transform, so a scale goes into the coordinates; v grows upwards.
            let uv = *uv * scale.scale + scale.offset;
            let _ = writeln!(text, "vt {} {}", uv.x, 1.0 - uv.y);
            drain(file, text, CHUNK)?;
        }
    }
    for i in 0..mesh.normals.len() {
        let n = placed.normal(i).unwrap_or_default();
        let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
        drain(file, text, CHUNK)?;
    }
    Ok(())
}

/// The transform of the first texture that the mesh's materials use.
fn uv_transform(scene: &Scene, mesh: &Mesh) -> TextureTransform {
    let materials = mesh.parts.iter().map(|p| p.material).chain(mesh.parts.is_empty().then_some(0));
    materials
        .filter_map(|m| scene.materials()[m as usize].base_color.texture)
        .find_map(|t| scene.textures().get(t as usize))
        .map_or(TextureTransform::IDENTITY, |texture| texture.transform)
}

fn write_faces(
    file: &mut Target,
    text: &mut String,
    scene: &Scene,
    placed: &Placed<'_>,
    numbers: &Numbers,
) -> Result<(), ExportError> {
    let mesh = placed.mesh;
    let (has_uv, has_normal) = (mesh.uvs.first().is_some_and(|s| !s.is_empty()), !mesh.normals.is_empty());
    let mut material = u32::MAX;
    for t in 0..mesh.triangles.len() {
        let wanted = mesh.material_of(t as u32);
        if wanted != material {
            material = wanted;
            let _ = writeln!(text, "usemtl {}", material_name(scene, material));
        }
        text.push('f');
        for index in placed.triangle(t).map(u64::from) {
            let _ = write!(text, " {}", numbers.position + index);
            match (has_uv, has_normal) {
                (true, true) => write!(text, "/{}/{}", numbers.uv + index, numbers.normal + index),
                (true, false) => write!(text, "/{}", numbers.uv + index),
                (false, true) => write!(text, "//{}", numbers.normal + index),
                (false, false) => Ok(()),
            }
            .ok();
        }
        text.push('\n');
        drain(file, text, CHUNK)?;
    }
    Ok(())
}

/// A name without blanks, unique by the material's number.
fn material_name(scene: &Scene, material: u32) -> String {
    format!("{}_{material}", token(&scene.materials()[material as usize].name))
}

fn token(name: &str) -> String {
    let clean = |c: char| if c.is_whitespace() || c == '#' { '_' } else { c };
    if name.is_empty() { "unnamed".into() } else { name.chars().map(clean).collect() }
}

fn write_library(scene: &Scene, path: &Path, lost: &mut Diagnostics) -> Result<(), ExportError> {
    let mut text = String::from("# vastlight\n");
    for (i, material) in scene.materials().iter().enumerate() {
        let map = match material.base_color.texture {
            Some(texture) => Some(write_texture(scene, path, texture, lost)?),
            None => None,
        };
        describe(&mut text, &material_name(scene, i as u32), material, map.as_deref());
    }
    let mut file = Target::create(path)?;
    file.put(text.as_bytes())?;
    file.finish()
}

fn describe(text: &mut String, name: &str, material: &Material, map: Option<&str>) {
    let color = |text: &mut String, key: &str, c: vastlight_math::Vec3| {
        let _ = writeln!(text, "{key} {} {} {}", c.x, c.y, c.z);
    };
    let _ = writeln!(text, "\nnewmtl {name}");
    color(text, "Kd", material.base_color.factor);
    let specular = 0.5 * material.specular.factor * (1.0 - material.metallic.factor);
    color(
        text,
        "Ks",
        vastlight_math::Vec3::splat(specular).max(material.base_color.factor * material.metallic.factor),
    );
    if material.is_emissive() {
        color(text, "Ke", material.emission.factor);
    }
    let _ = writeln!(text, "Ni {}", material.ior);
    let _ = writeln!(text, "Pr {}\nPm {}", material.roughness.factor, material.metallic.factor);
    if material.transmission.factor > 0.0 {
        let t = 1.0 - material.transmission.factor;
        let _ = writeln!(text, "illum 7\nTf {0} {0} {0}\nd {t}", material.transmission.factor);
    } else {
        let _ = writeln!(text, "illum 2\nd {}", material.alpha.factor);
    }
    if let Some(map) = map {
        let _ = writeln!(text, "map_Kd {map}");
    }
}

/// Writes a texture's image as PNG beside the library; returns the file's name.
fn write_texture(
    scene: &Scene,
    library: &Path,
    texture: u32,
    lost: &mut Diagnostics,
) -> Result<String, ExportError> {
    let number = scene.textures()[texture as usize].image;
    let stem = library.file_stem().unwrap_or_default().to_string_lossy();
    let name = format!("{stem}_{number}.png");
    let bytes = png::encode(&scene.images()[number as usize], lost)?;
    let mut file = Target::create(&library.with_file_name(&name))?;
    file.put(&bytes)?;
    file.finish()?;
    Ok(name)
}
