//! What a scene is, in 128 bits: two scenes with the same fingerprint give the same pictures.

use crate::{Error, OpenScene};
use serde::Serialize;
use std::io::{self, BufWriter, Write};
use vastlight_paging::Directory;
use vastlight_scene::{Image, InstanceNames, Mesh, Scene, Texels};
use vastlight_store::StoredPages;
use xxhash_rust::xxh3::Xxh3;

/// The fingerprint of a scene as it is: contents, not files' names or dates. A store has another one than the file that it was packed
/// from; of its pages the checksums count, which are at hand.
pub(crate) fn fingerprint(open: &OpenScene) -> Result<String, Error> {
    let mut hash = BufWriter::with_capacity(1 << 16, Hash(Xxh3::new()));
    let written = write_scene(&mut hash, &open.scene)
        .and_then(|()| open.stored.iter().try_for_each(|stored| write_pages(&mut hash, stored)));
    let hash = written.and_then(|()| hash.into_inner().map_err(io::IntoInnerError::into_error));
    let hash = hash.map_err(|e| Error::scene(e.to_string(), "fingerprint", ""))?;
    Ok(format!("{:032x}", hash.0.digest128()))
}

/// Hashes what is written.
struct Hash(Xxh3);

impl Write for Hash {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn put(out: &mut impl Write, value: &impl Serialize) -> io::Result<()> {
    postcard::to_io(value, out).map(|_| ()).map_err(io::Error::other)
}

/// Numbers with their count in front.
fn put_all<T: bytemuck::NoUninit>(out: &mut impl Write, numbers: &[T]) -> io::Result<()> {
    out.write_all(&(numbers.len() as u64).to_le_bytes())?;
    out.write_all(bytemuck::cast_slice(numbers))
}

fn write_scene(out: &mut impl Write, scene: &Scene) -> io::Result<()> {
    let desc = scene.desc();
    desc.meshes.iter().try_for_each(|mesh| write_mesh(out, mesh))?;
    put_all(out, scene.instances().starts())?;
    put_all(out, scene.instances().maps())?;
    put(out, &desc.names)?;
    let (InstanceNames::OfMesh(names) | InstanceNames::Own(names)) = scene.instances().names();
    put_all(out, names)?;
    desc.images.iter().try_for_each(|image| write_image(out, image))?;
    put(out, &(&desc.materials, &desc.textures, &desc.lights, scene.environment()))
}

fn write_image(out: &mut impl Write, image: &Image) -> io::Result<()> {
    let Image { name: _, width, height, channels, texels } = image;
    put(out, &(width, height, channels, texels.number_bytes()))?;
    match texels {
        Texels::U8(numbers) => put_all(out, numbers),
        Texels::U16(numbers) => put_all(out, numbers),
        Texels::F32(numbers) => put_all(out, numbers),
    }
}

fn write_mesh(out: &mut impl Write, mesh: &Mesh) -> io::Result<()> {
    let Mesh { name: _, positions, triangles, normals, tangents, uvs, colors, parts, implicit } = mesh;
    put(out, &(parts, uvs.len()))?;
    put_all(out, positions)?;
    put_all(out, triangles.as_flattened())?;
    put_all(out, normals)?;
    put_all(out, tangents)?;
    uvs.iter().try_for_each(|set| put_all(out, set))?;
    put_all(out, colors)?;
    match implicit {
        Some(shape) => write!(out, "{shape:?}"),
        None => Ok(()),
    }
}

fn write_pages(out: &mut impl Write, stored: &StoredPages) -> io::Result<()> {
    let mut pages = |pages: &Directory| {
        let checksums: Vec<u32> =
            (0..pages.pages() as u32).filter_map(|i| pages.get(i)).map(|e| e.crc32).collect();
        put_all(out, &checksums)
    };
    pages(&stored.geometry)?;
    pages(&stored.attributes)?;
    pages(&stored.tiles)
}
