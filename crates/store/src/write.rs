//! Writing a store, mesh by mesh: pages as they come, all that is resident at the end.
//!
//! The store grows in `NAME.part`, what is done stands in `NAME.journal`; a writer for the same scene goes on from there.

use crate::attributes::AttributeLayout;
use crate::error::StoreError;
use crate::format::{
    DEFORMS, EntryRow, HEADER_BYTES, Header, MAGIC, MeshRow, PAGE_ALIGNMENT, Section, SectionRow, TextureRow,
    VERSION,
};
use crate::journal::{Journal, split_runs};
use crate::lock::open_locked;
use crate::pack::PackedMesh;
use crate::source::SourceFile;
use crate::tiler::Tiler;
use crate::tiles::TileGrid;
use bytemuck::{Pod, bytes_of, cast_slice, pod_collect_to_vec};
use serde::Serialize;
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use vastlight_accel::compact::{CompactMesh, PageBytes, PageRoot};
use vastlight_accel::wide::{ChildRef, Node8};
use vastlight_accel::{BuildConfig, BuildError};
use vastlight_math::{Aabb, Vec3};
use vastlight_scene::{Content, Image, InstanceNames, MeshExtent, Motion, Scene, SceneDesc, Texels};

/// Number of [`Tables`].
const TABLES: usize = 10;

/// A store in the making. Nothing is to be seen under its name before it is finished.
#[derive(Debug)]
pub struct StoreWriter {
    target: PathBuf,
    file: BufWriter<File>,
    journal: Journal,
    offset: u64,
    tables: Tables,
    /// Images in tiles: before all meshes, so the journal need not have them.
    textures: Vec<TextureRow>,
    tiles: Vec<EntryRow>,
    /// Lengths of the tables that the journal has, and where the file ended.
    noted: ([usize; TABLES], u64),
    /// Parts of meshes that are under a tree.
    joined_parts: usize,
}

/// What is resident, as it grows; nothing that stands there changes.
#[derive(Debug, Default)]
struct Tables {
    meshes: Trees,
    geometry: Vec<EntryRow>,
    attributes: Vec<EntryRow>,
    attributes_of_page: Vec<u32>,
    first_triangles: Vec<u16>,
    /// Parts of meshes.
    parts: Trees,
}

/// Meshes, and what is above their pages.
#[derive(Debug, Default)]
struct Trees {
    rows: Vec<MeshRow>,
    nodes: Vec<Node8>,
    roots: Vec<PageRoot>,
}

impl Trees {
    /// Adds a mesh of so many pages from `first_page` on, which `roots` name by their numbers in the store.
    fn push(
        &mut self,
        above: &CompactMesh,
        about: &About,
        (first_page, pages): (u32, u32),
        roots: impl Iterator<Item = PageRoot>,
    ) {
        let (first_node, first_root) = (self.nodes.len() as u32, self.roots.len() as u32);
        self.rows.push(mesh_row(above, about, [first_node, first_root, first_page, pages]));
        self.nodes.extend(&above.nodes);
        self.roots.extend(roots);
    }
}

impl Tables {
    fn lengths(&self) -> [usize; TABLES] {
        [
            self.meshes.rows.len(),
            self.meshes.nodes.len(),
            self.meshes.roots.len(),
            self.geometry.len(),
            self.attributes.len(),
            self.attributes_of_page.len(),
            self.first_triangles.len(),
            self.parts.rows.len(),
            self.parts.nodes.len(),
            self.parts.roots.len(),
        ]
    }

    /// The bytes of what stands behind these lengths.
    fn behind(&self, from: &[usize; TABLES]) -> [&[u8]; TABLES] {
        [
            cast_slice(&self.meshes.rows[from[0]..]),
            cast_slice(&self.meshes.nodes[from[1]..]),
            cast_slice(&self.meshes.roots[from[2]..]),
            cast_slice(&self.geometry[from[3]..]),
            cast_slice(&self.attributes[from[4]..]),
            cast_slice(&self.attributes_of_page[from[5]..]),
            cast_slice(&self.first_triangles[from[6]..]),
            cast_slice(&self.parts.rows[from[7]..]),
            cast_slice(&self.parts.nodes[from[8]..]),
            cast_slice(&self.parts.roots[from[9]..]),
        ]
    }

    fn extend(&mut self, bytes: [&[u8]; TABLES]) {
        fn more<T: Pod>(table: &mut Vec<T>, bytes: &[u8]) {
            table.extend(pod_collect_to_vec::<u8, T>(bytes));
        }
        more(&mut self.meshes.rows, bytes[0]);
        more(&mut self.meshes.nodes, bytes[1]);
        more(&mut self.meshes.roots, bytes[2]);
        more(&mut self.geometry, bytes[3]);
        more(&mut self.attributes, bytes[4]);
        more(&mut self.attributes_of_page, bytes[5]);
        more(&mut self.first_triangles, bytes[6]);
        more(&mut self.parts.rows, bytes[7]);
        more(&mut self.parts.nodes, bytes[8]);
        more(&mut self.parts.roots, bytes[9]);
    }
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

/// `target` with more at its end.
fn beside(target: &Path, end: &str) -> PathBuf {
    let mut name = OsString::from(target);
    name.push(end);
    name.into()
}

impl StoreWriter {
    /// Begins a store that will be found at `target`, or goes on with one of the same `fingerprint` (what says which
    /// scene it is and how it is packed).
    ///
    /// # Errors
    /// If no file can be made in the folder of `target`, or another process packs to the same target.
    pub fn create(target: &Path, fingerprint: &[u8]) -> Result<Self, StoreError> {
        let failed = |error: std::io::Error| StoreError::write(target, &error);
        let Some(file) = open_locked(&beside(target, ".part")).map_err(failed)? else {
            return Err(StoreError::busy(target));
        };
        let (journal, same) = Journal::open(&beside(target, ".journal"), fingerprint).map_err(failed)?;
        if !same {
            file.set_len(0).map_err(failed)?;
        }
        let mut writer = Self {
            target: target.to_owned(),
            file: BufWriter::with_capacity(1 << 20, file),
            journal,
            offset: 0,
            tables: Tables::default(),
            textures: Vec::new(),
            tiles: Vec::new(),
            noted: ([0; TABLES], 0),
            joined_parts: 0,
        };
        writer.put(&[0; HEADER_BYTES as usize])?;
        Ok(writer)
    }

    /// Goes on behind the meshes and parts that are done already: calls `each` with what [`note`](Self::note) was
    /// given for each of them, as long as that understands it. To be called once, before the first mesh.
    ///
    /// # Errors
    /// If the file cannot be read or written.
    pub fn resume(&mut self, mut each: impl FnMut(&[u8]) -> bool) -> Result<(), StoreError> {
        let target = self.target.clone();
        let failed = |error: std::io::Error| StoreError::write(&target, &error);
        self.file.flush().map_err(failed)?;
        let there = self.file.get_ref().metadata().map_err(failed)?.len();
        let (mut tables, mut offset, mut joined) = (std::mem::take(&mut self.tables), self.offset, 0);
        let replayed = self.journal.replay(|step| {
            let Some([place, meshes, nodes, roots, geometry, attributes, of_page, firsts, p, pn, pr, note]) =
                split_runs(step)
            else {
                return false;
            };
            let [start, end, joined_parts] = *pod_collect_to_vec::<u8, u64>(place).as_slice() else {
                return false;
            };
            if start != offset || end > there || !each(note) {
                return false;
            }
            tables.extend([meshes, nodes, roots, geometry, attributes, of_page, firsts, p, pn, pr]);
            (offset, joined) = (end, joined_parts as usize);
            true
        });
        (self.tables, self.offset, self.joined_parts) = (tables, offset, joined);
        replayed.map_err(failed)?;
        self.file.get_ref().set_len(offset).map_err(failed)?;
        self.file.seek(SeekFrom::Start(offset)).map_err(failed)?;
        self.noted = (self.tables.lengths(), offset);
        Ok(())
    }

    /// Notes that what was added so far need not be done again; `note` is for who resumes.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn note(&mut self, note: &[u8]) -> Result<(), StoreError> {
        let written = self.file.flush();
        written.map_err(|error| StoreError::write(&self.target, &error))?;
        let place = [self.noted.1, self.offset, self.joined_parts as u64];
        let tables = self.tables.behind(&self.noted.0);
        let runs: Vec<&[u8]> = [cast_slice(&place)].into_iter().chain(tables).chain([note]).collect();
        let noted = self.journal.append(&runs);
        noted.map_err(|error| StoreError::write(&self.target, &error))?;
        self.noted = (self.tables.lengths(), self.offset);
        Ok(())
    }

    /// Adds the next mesh.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, mesh: &PackedMesh) -> Result<(), StoreError> {
        self.put_mesh(mesh, |tables| &mut tables.meshes)
    }

    /// Adds the next mesh as one that has no pages, since its vertices move: its geometry stays in the scene.
    pub fn add_deforming(&mut self, extent: MeshExtent) {
        let layout = AttributeLayout::default();
        let about = About { layout, strategy: DEFORMS, extent };
        let first_page = self.tables.geometry.len() as u32;
        self.tables.meshes.push(&CompactMesh::EMPTY, &about, (first_page, 0), std::iter::empty());
    }

    /// Adds a part of the next mesh, which [`join_parts`](Self::join_parts) ends.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add_part(&mut self, part: &PackedMesh) -> Result<(), StoreError> {
        self.put_mesh(part, |tables| &mut tables.parts)
    }

    fn put_mesh(
        &mut self,
        mesh: &PackedMesh,
        trees: impl Fn(&mut Tables) -> &mut Trees,
    ) -> Result<(), StoreError> {
        let first_page = self.tables.geometry.len() as u32;
        self.put_pages(mesh)?;
        let PackedMesh { above, layout, strategy, extent, .. } = mesh;
        let about = About { layout: *layout, strategy: *strategy as u32, extent: *extent };
        let roots = above.roots.iter().map(|root| root.moved(first_page));
        trees(&mut self.tables).push(above, &about, (first_page, mesh.pages.len() as u32), roots);
        Ok(())
    }

    /// Number of parts that have no tree above them yet.
    #[must_use]
    pub fn waiting_parts(&self) -> usize {
        self.tables.parts.rows.len() - self.joined_parts
    }

    /// Adds the next mesh, of the parts that came before, under a tree of the builder `accel`.
    ///
    /// # Errors
    /// If there are no parts, or the tree cannot be built.
    pub fn join_parts(&mut self, name: &str, accel: &str) -> Result<(), StoreError> {
        let rows = &self.tables.parts.rows[self.joined_parts..];
        let parts: Vec<CompactMesh> = rows.iter().map(|row| self.part(row)).collect();
        let joined = CompactMesh::join(accel, &parts, &BuildConfig::default());
        let above = joined.map_err(|error: BuildError| StoreError::pack(name, error.to_string()))?;
        let (Some(above), Some(first)) = (above, rows.first()) else {
            return Err(StoreError::pack(name, "it has no parts".into()));
        };
        let boxes = rows.iter().map(object_bounds);
        let extent = MeshExtent {
            bounds: boxes.fold(Aabb::EMPTY, Aabb::union),
            triangles: rows.iter().map(|row| row.triangles).sum(),
        };
        let layout = AttributeLayout(first.attributes);
        let about = About { layout, strategy: first.strategy, extent };
        let pages = (first.first_page, rows.iter().map(|row| row.pages).sum());
        self.joined_parts = self.tables.parts.rows.len();
        self.tables.meshes.push(&above, &about, pages, above.roots.iter().copied());
        Ok(())
    }

    fn part(&self, row: &MeshRow) -> CompactMesh {
        let run = |first: u32, count: u32| first as usize..first as usize + count as usize;
        let [min, max] = row.bounds.map(Vec3::from);
        CompactMesh {
            nodes: self.tables.parts.nodes[run(row.first_node, row.nodes)].to_vec(),
            roots: self.tables.parts.roots[run(row.first_root, row.roots)].to_vec(),
            root: Some(ChildRef(row.root)).filter(|&root| root != ChildRef::NONE),
            levels: row.levels as usize,
            bounds: Aabb { min, max },
            extent: row.extent,
            scale: row.scale,
            shares: PageBytes::default(),
        }
    }

    fn put_pages(&mut self, mesh: &PackedMesh) -> Result<(), StoreError> {
        for (page, attributes) in mesh.pages.iter().zip(&mesh.attributes) {
            let entry = self.put_page(page)?;
            self.tables.geometry.push(entry);
            self.tables.attributes_of_page.push(self.tables.attributes.len() as u32);
            self.tables.first_triangles.extend(&attributes.first_triangles);
            for page in &attributes.pages {
                let entry = self.put_page(page)?;
                self.tables.attributes.push(entry);
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
    pub fn extents(&self) -> Vec<MeshExtent> {
        let extent = |row: &MeshRow| MeshExtent { bounds: object_bounds(row), triangles: row.triangles };
        self.tables.meshes.rows.iter().map(extent).collect()
    }

    /// Takes away all that was done.
    pub fn discard(self) {
        // What cannot be removed is overwritten by the next pack.
        let _ = std::fs::remove_file(beside(&self.target, ".part"));
        let _ = std::fs::remove_file(beside(&self.target, ".journal"));
    }

    /// Writes the rest, and gives the store its name. The meshes of `scene` are those that were added; the geometry that it
    /// has itself stays resident, and so does the record of what moves it. `sources` says what the scene was made of.
    ///
    /// # Errors
    /// If the file cannot be written, or what moves the scene cannot be kept.
    pub fn finish(mut self, scene: Scene, sources: &[SourceFile]) -> Result<StoreSize, StoreError> {
        let (textures, tiles) = (std::mem::take(&mut self.textures), std::mem::take(&mut self.tiles));
        let triangles = self.tables.meshes.rows.iter().map(|mesh| mesh.triangles).sum();
        let tables = std::mem::take(&mut self.tables);
        let instances = scene.instances();
        let names = match instances.names() {
            InstanceNames::OfMesh(names) => (Section::NamesOfMeshes, cast_slice(names)),
            InstanceNames::Own(names) => (Section::NamesOfInstances, cast_slice(names)),
        };
        let of_page = [&tables.attributes_of_page[..], &[tables.attributes.len() as u32]].concat();
        let sources = postcard::to_stdvec(sources);
        let sources = sources.map_err(|error| StoreError::pack("sources", error.to_string()))?;
        let motion = scene.motion().map(|motion| recorded(&**motion)).transpose()?;
        let movement = motion
            .iter()
            .flat_map(|(who, movement)| [(Section::Motion, &who[..]), (Section::Movement, &movement[..])]);
        let sections: [(Section, &[u8]); 13] = [
            (Section::Meshes, cast_slice(&tables.meshes.rows)),
            (Section::Nodes, cast_slice(&tables.meshes.nodes)),
            (Section::Roots, cast_slice(&tables.meshes.roots)),
            (Section::Geometry, cast_slice(&tables.geometry)),
            (Section::Attributes, cast_slice(&tables.attributes)),
            (Section::AttributesOfPage, cast_slice(&of_page)),
            (Section::FirstTriangles, cast_slice(&tables.first_triangles)),
            (Section::Instances, cast_slice(instances.maps())),
            (Section::Textures, cast_slice(&textures)),
            (Section::Tiles, cast_slice(&tiles)),
            (Section::InstancesOfMesh, cast_slice(instances.starts())),
            names,
            (Section::Sources, &sources),
        ];
        let put = |(kind, bytes): (Section, &[u8])| self.put_section(kind, bytes);
        let mut rows =
            sections.into_iter().chain(movement).map(put).collect::<Result<Vec<SectionRow>, StoreError>>()?;
        rows.push(self.put_scene(scene)?);
        let in_pages = |pages: &[EntryRow]| pages.iter().map(|page| u64::from(page.bytes)).sum::<u64>();
        self.finish_file(&rows)?;
        Ok(StoreSize {
            file: self.offset,
            geometry: in_pages(&tables.geometry),
            attributes: in_pages(&tables.attributes),
            tiles: in_pages(&tiles),
            resident: rows.iter().map(|row| row.bytes).sum(),
            pages: tables.geometry.len() as u64,
            triangles,
        })
    }

    /// Writes the scene without instances.
    fn put_scene(&mut self, scene: Scene) -> Result<SectionRow, StoreError> {
        let environment = Some(scene.environment().clone());
        let desc = SceneDesc { environment, ..scene.into_desc() };
        self.align(PAGE_ALIGNMENT)?;
        let (offset, crc32) = (self.offset, crc32fast::Hasher::new());
        let mut summed = Summed { file: &mut self.file, crc32, bytes: 0 };
        let written = postcard::to_io(&desc, &mut summed).map(|_| ());
        let Summed { crc32, bytes, .. } = summed;
        // What fails is the file; the error does not say how.
        written.map_err(|error| StoreError::write(&self.target, &std::io::Error::other(error)))?;
        self.offset += bytes;
        Ok(SectionRow { kind: Section::Scene as u32, crc32: crc32.finalize(), offset, bytes })
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
            self.file.get_ref().sync_data()
        };
        commit().map_err(|error| StoreError::write(&target, &error))?;
        self.persist()
    }

    fn persist(&mut self) -> Result<(), StoreError> {
        let renamed = std::fs::rename(beside(&self.target, ".part"), &self.target);
        renamed.map_err(|error| StoreError::write(&self.target, &error))?;
        // A journal without its store is not believed.
        let _ = std::fs::remove_file(beside(&self.target, ".journal"));
        Ok(())
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

/// The two sections of a movement.
fn recorded(motion: &dyn Motion) -> Result<(Vec<u8>, Vec<u8>), StoreError> {
    let cannot = |what: String| StoreError::pack("motion", what);
    let record = motion.record().ok_or_else(|| cannot("this movement cannot be kept in a store".into()))?;
    let who = postcard::to_stdvec(&(&record.kind, &record.numbers));
    Ok((who.map_err(|error| cannot(error.to_string()))?, record.bytes))
}

/// Sums what is written.
struct Summed<'f> {
    file: &'f mut BufWriter<File>,
    crc32: crc32fast::Hasher,
    bytes: u64,
}

impl Write for Summed<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let count = self.file.write(bytes)?;
        self.crc32.update(&bytes[..count]);
        self.bytes += count as u64;
        Ok(count)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// What is known of a mesh besides its tree.
struct About {
    layout: AttributeLayout,
    /// As a row has it.
    strategy: u32,
    extent: MeshExtent,
}

/// The row of a mesh or a part of one; `places` are its first node, root and page, and the number of pages.
fn mesh_row(above: &CompactMesh, about: &About, places: [u32; 4]) -> MeshRow {
    let [first_node, first_root, first_page, pages] = places;
    let bounds = |b: &Aabb| [b.min.to_array(), b.max.to_array()];
    MeshRow {
        triangles: about.extent.triangles,
        first_node,
        nodes: above.nodes.len() as u32,
        first_root,
        roots: above.roots.len() as u32,
        first_page,
        pages,
        root: above.root.unwrap_or(ChildRef::NONE).0,
        levels: above.levels as u32,
        bounds: bounds(&above.bounds),
        object_bounds: bounds(&about.extent.bounds),
        extent: above.extent,
        scale: above.scale,
        attributes: about.layout.0,
        strategy: about.strategy,
    }
}

fn object_bounds(row: &MeshRow) -> Aabb {
    let [min, max] = row.object_bounds.map(Vec3::from);
    Aabb { min, max }
}

pub(crate) fn header_crc32(header: &Header) -> u32 {
    let bytes = bytes_of(header);
    crc32fast::hash(&bytes[..bytes.len() - 4])
}
