//! Writing a store, mesh by mesh: pages as they come, all that is resident at the end.

use crate::error::StoreError;
use crate::format::{
    EntryRow, HEADER_BYTES, Header, InstanceRow, MAGIC, MeshRow, PAGE_ALIGNMENT, Section, SectionRow,
    TextureRow, VERSION,
};
use crate::pack::PackedMesh;
use crate::tiler::Tiler;
use crate::tiles::TileGrid;
use bytemuck::bytes_of;
use serde::Serialize;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use vastlight_accel::compact::PageRoot;
use vastlight_accel::wide::{ChildRef, Node8};
use vastlight_scene::{Content, Image, Instance, MeshExtent, Scene, SceneDesc, Texels};

/// A store in the making. Nothing is to be seen under its name before it is finished.
#[derive(Debug)]
pub struct StoreWriter {
    target: PathBuf,
    file: BufWriter<NamedTempFile>,
    offset: u64,
    meshes: Vec<MeshRow>,
    nodes: Vec<Node8>,
    roots: Vec<PageRoot>,
    geometry: Vec<EntryRow>,
    attributes: Vec<EntryRow>,
    attributes_of_page: Vec<u32>,
    first_triangles: Vec<u16>,
    extents: Vec<MeshExtent>,
    textures: Vec<TextureRow>,
    tiles: Vec<EntryRow>,
}

/// What a store came to, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StoreSize {
    /// The file.
    pub file: u64,
    /// Pages of geometry.
    pub geometry: u64,
    /// Pages of attributes.
    pub attributes: u64,
    /// Tiles of textures.
    pub tiles: u64,
    /// All that is in memory as long as the store is open.
    pub resident: u64,
    /// Number of pages of geometry.
    pub pages: u64,
    /// Triangles of all meshes.
    pub triangles: u64,
}

impl StoreWriter {
    /// Begins a store that will be found at `target`.
    ///
    /// # Errors
    /// If no file can be made in the folder of `target`.
    pub fn create(target: &Path) -> Result<Self, StoreError> {
        let folder = target.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let failed = |error: std::io::Error| StoreError::write(target, &error);
        let file = NamedTempFile::new_in(folder).map_err(failed)?;
        let mut writer = Self {
            target: target.to_owned(),
            file: BufWriter::with_capacity(1 << 20, file),
            offset: 0,
            meshes: Vec::new(),
            nodes: Vec::new(),
            roots: Vec::new(),
            geometry: Vec::new(),
            attributes: Vec::new(),
            attributes_of_page: Vec::new(),
            first_triangles: Vec::new(),
            extents: Vec::new(),
            textures: Vec::new(),
            tiles: Vec::new(),
        };
        writer.put(&[0; HEADER_BYTES as usize])?;
        Ok(writer)
    }

    /// Adds the next mesh.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, mesh: &PackedMesh) -> Result<(), StoreError> {
        let first_page = self.geometry.len() as u32;
        let above = &mesh.above;
        self.meshes.push(MeshRow {
            triangles: mesh.extent.triangles,
            first_node: self.nodes.len() as u32,
            nodes: above.nodes.len() as u32,
            first_root: self.roots.len() as u32,
            roots: above.roots.len() as u32,
            first_page,
            pages: mesh.pages.len() as u32,
            root: above.root.map_or(ChildRef::NONE, |root| root).0,
            levels: above.levels as u32,
            bounds: [above.bounds.min.to_array(), above.bounds.max.to_array()],
            object_bounds: [mesh.extent.bounds.min.to_array(), mesh.extent.bounds.max.to_array()],
            extent: above.extent,
            scale: above.scale,
            attributes: mesh.layout.0,
            strategy: mesh.strategy as u32,
        });
        self.nodes.extend(&above.nodes);
        self.roots.extend(above.roots.iter().map(|root| root.moved(first_page)));
        self.extents.push(mesh.extent);
        for (page, attributes) in mesh.pages.iter().zip(&mesh.attributes) {
            let entry = self.put_page(page)?;
            self.geometry.push(entry);
            self.attributes_of_page.push(self.attributes.len() as u32);
            self.first_triangles.extend(&attributes.first_triangles);
            for page in &attributes.pages {
                let entry = self.put_page(page)?;
                self.attributes.push(entry);
            }
        }
        Ok(())
    }

    /// Adds the pyramid of an image that comes row by row; the image's own texels do not matter, what they are does. Its texels
    /// need not be in the scene that [`finish`](Self::finish) gets. False, and nothing is added, for an image that is too large for page numbers.
    ///
    /// # Errors
    /// If the file cannot be written, or `next_row` fails.
    pub fn add_texture<E: From<StoreError>>(
        &mut self,
        (number, image): (u32, &Image),
        content: Content,
        tile_bytes: usize,
        mut next_row: impl FnMut(&mut Texels) -> Result<(), E>,
    ) -> Result<bool, E> {
        let Image { width, height, channels, texels: kind, .. } = image;
        let (edge, first_page) = (TileGrid::edge_of(tile_bytes, *channels, kind), self.tiles.len() as u32);
        let Some(grid) = TileGrid::new(*width, *height, edge, first_page) else { return Ok(false) };
        let nothing = EntryRow { offset: 0, bytes: 0, crc32: 0 };
        self.tiles.resize(self.tiles.len() + grid.pages() as usize, nothing);
        let mut tiler = Tiler::new(grid, *channels, kind, content);
        let mut row = kind.none_like();
        for _ in 0..*height {
            row.clear();
            next_row(&mut row)?;
            tiler.push(&row, |page, bytes| {
                self.tiles[page as usize] = self.put_page(bytes)?;
                Ok::<(), StoreError>(())
            })?;
        }
        let (page, bytes) = tiler.last();
        self.tiles[page as usize] = self.put_page(bytes)?;
        self.textures.push(TextureRow { image: number, content: content as u32, edge, first_page });
        Ok(true)
    }

    /// Sizes of the meshes so far.
    #[must_use]
    pub fn extents(&self) -> &[MeshExtent] {
        &self.extents
    }

    /// Writes the rest, and gives the store its name. The meshes of `scene` are those that were added; the geometry that it
    /// has itself stays resident.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self, scene: &Scene) -> Result<StoreSize, StoreError> {
        self.attributes_of_page.push(self.attributes.len() as u32);
        let instances: Vec<InstanceRow> = scene.instances().iter().map(instance_row).collect();
        let described = self.describe(scene)?;
        let mut rows = Vec::new();
        let (meshes, nodes, roots) = (take(&mut self.meshes), take(&mut self.nodes), take(&mut self.roots));
        let (geometry, attributes) = (take(&mut self.geometry), take(&mut self.attributes));
        let (textures, tiles) = (take(&mut self.textures), take(&mut self.tiles));
        let (of_page, firsts) = (take(&mut self.attributes_of_page), take(&mut self.first_triangles));
        rows.push(self.put_section(Section::Scene, &described)?);
        rows.push(self.put_section(Section::Meshes, bytemuck::cast_slice(&meshes))?);
        rows.push(self.put_section(Section::Nodes, bytemuck::cast_slice(&nodes))?);
        rows.push(self.put_section(Section::Roots, bytemuck::cast_slice(&roots))?);
        rows.push(self.put_section(Section::Geometry, bytemuck::cast_slice(&geometry))?);
        rows.push(self.put_section(Section::Attributes, bytemuck::cast_slice(&attributes))?);
        rows.push(self.put_section(Section::AttributesOfPage, bytemuck::cast_slice(&of_page))?);
        rows.push(self.put_section(Section::FirstTriangles, bytemuck::cast_slice(&firsts))?);
        rows.push(self.put_section(Section::Instances, bytemuck::cast_slice(&instances))?);
        rows.push(self.put_section(Section::Textures, bytemuck::cast_slice(&textures))?);
        rows.push(self.put_section(Section::Tiles, bytemuck::cast_slice(&tiles))?);
        let resident = rows.iter().map(|row| row.bytes).sum();
        let in_pages = |pages: &[EntryRow]| pages.iter().map(|page| u64::from(page.bytes)).sum::<u64>();
        self.finish_file(&rows)?;
        Ok(StoreSize {
            file: self.offset,
            geometry: in_pages(&geometry),
            attributes: in_pages(&attributes),
            tiles: in_pages(&tiles),
            resident,
            pages: geometry.len() as u64,
            triangles: self.extents.iter().map(|extent| extent.triangles).sum(),
        })
    }

    /// The scene without instances, as bytes.
    fn describe(&self, scene: &Scene) -> Result<Vec<u8>, StoreError> {
        let desc = SceneDesc {
            instances: Vec::new(),
            environment: Some(scene.environment().clone()),
            ..scene.desc().clone()
        };
        postcard::to_stdvec(&desc).map_err(|error| StoreError::pack("scene", error.to_string()))
    }

    fn finish_file(&mut self, rows: &[SectionRow]) -> Result<(), StoreError> {
        self.align(8)?;
        let sections_at = self.offset;
        let table: &[u8] = bytemuck::cast_slice(rows);
        self.put(table)?;
        let mut header = Header {
            magic: MAGIC,
            version: VERSION,
            sections: rows.len() as u32,
            bytes: self.offset,
            sections_at,
            sections_crc32: crc32fast::hash(table),
            crc32: 0,
        };
        header.crc32 = header_crc32(&header);
        let target = self.target.clone();
        let mut commit = || -> std::io::Result<()> {
            self.file.seek(SeekFrom::Start(0))?;
            self.file.write_all(bytes_of(&header))?;
            self.file.flush()?;
            self.file.get_ref().as_file().sync_data()
        };
        commit().map_err(|error| StoreError::write(&target, &error))?;
        self.persist()
    }

    fn persist(&mut self) -> Result<(), StoreError> {
        let failed = |error: &std::io::Error| StoreError::write(&self.target, error);
        // A temporary file is its owner's alone; a store is as open as other files.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let permissions = std::fs::Permissions::from_mode(0o644);
            self.file.get_ref().as_file().set_permissions(permissions).map_err(|e| failed(&e))?;
        }
        std::fs::rename(self.file.get_ref().path(), &self.target).map_err(|e| failed(&e))
    }

    fn put_section(&mut self, kind: Section, bytes: &[u8]) -> Result<SectionRow, StoreError> {
        self.align(PAGE_ALIGNMENT)?;
        let row = SectionRow {
            kind: kind as u32,
            crc32: crc32fast::hash(bytes),
            offset: self.offset,
            bytes: bytes.len() as u64,
        };
        self.put(bytes)?;
        Ok(row)
    }

    fn put_page(&mut self, page: &[u8]) -> Result<EntryRow, StoreError> {
        self.align(PAGE_ALIGNMENT)?;
        let entry = EntryRow { offset: self.offset, bytes: page.len() as u32, crc32: crc32fast::hash(page) };
        self.put(page)?;
        Ok(entry)
    }

    fn align(&mut self, to: u64) -> Result<(), StoreError> {
        let missing = self.offset.next_multiple_of(to) - self.offset;
        self.put(&[0; PAGE_ALIGNMENT as usize][..missing as usize])
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), StoreError> {
        self.file.write_all(bytes).map_err(|error| StoreError::write(&self.target, &error))?;
        self.offset += bytes.len() as u64;
        Ok(())
    }
}

fn take<T: Default>(value: &mut T) -> T {
    std::mem::take(value)
}

pub(crate) fn header_crc32(header: &Header) -> u32 {
    let bytes = bytes_of(header);
    crc32fast::hash(&bytes[..bytes.len() - 4])
}

fn instance_row(instance: &Instance) -> InstanceRow {
    let map = &instance.world_from_object;
    let columns = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation];
    InstanceRow { columns: columns.map(|c| c.to_array()), mesh: instance.mesh, name: instance.name }
}
