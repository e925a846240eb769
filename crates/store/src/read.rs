//! Opening a store: all but its pages is read, and checked, so that nothing behind it need doubt an index.

use crate::attributes::{AttributeIndex, AttributeLayout};
use crate::error::StoreError;
use crate::format::{
    DEFORMS, EntryRow, HEADER_BYTES, Header, InstanceRow, MAGIC, MeshRow, Section, SectionRow, TextureRow,
    VERSION,
};
use crate::pack::PageStrategy;
use crate::source::SourceFile;
use crate::tiles::{StoredTexture, TileGrid};
use crate::write::header_crc32;
use bytemuck::{Pod, Zeroable, cast_slice_mut, zeroed_vec};
use crc32fast::Hasher;
use std::sync::Arc;
use vastlight_accel::compact::{CompactMesh, PageBytes, PageRoot};
use vastlight_accel::wide::{ChildRef, Node8};
use vastlight_math::{Aabb, Vec3};
use vastlight_paging::{Directory, PageEntry, Source};
use vastlight_scene::{Content, Image, InstanceNames, Instances, Mesh, MeshExtent, MotionRecord, SceneDesc};

/// Most levels of a tree that is believed.
const MOST_LEVELS: u32 = 512;
/// Most bytes of a section that are read at a time.
const READ_BYTES: usize = 16 << 20;
/// Most bytes of a page that is believed.
pub const MOST_PAGE_BYTES: u32 = 1 << 18;

/// An open store.
#[derive(Debug)]
pub struct Store {
    /// Everything but geometry, and that of meshes that shine or deform.
    pub desc: SceneDesc,
    /// Placements of the meshes.
    pub instances: Instances,
    /// Sizes of the meshes.
    pub extents: Vec<MeshExtent>,
    /// What moves the scene, for who understands it.
    pub motion: Option<MotionRecord>,
    /// Where all else is.
    pub pages: StoredPages,
}

/// What a store has beside its scene.
#[derive(Debug)]
pub struct StoredPages {
    /// Where pages come from.
    pub source: Arc<dyn Source>,
    /// What is above the pages of each mesh; none of meshes that deform, which have no pages.
    pub meshes: Vec<Option<Arc<CompactMesh>>>,
    /// Which attributes the vertices of each mesh have.
    pub layouts: Vec<AttributeLayout>,
    /// What pages of geometry are.
    pub strategy: PageStrategy,
    /// Where pages of geometry are.
    pub geometry: Directory,
    /// Where pages of attributes are.
    pub attributes: Directory,
    /// Where the attributes of a triangle are.
    pub index: AttributeIndex,
    /// Images whose texels are in tiles; in the scene they have none.
    pub textures: Vec<StoredTexture>,
    /// Where tiles are.
    pub tiles: Directory,
    /// What the scene was made of.
    pub sources: Vec<SourceFile>,
}

impl Store {
    /// Reads what is resident of a store.
    ///
    /// # Errors
    /// If it cannot be read, is of another version, or damaged.
    pub fn open(source: Arc<dyn Source>) -> Result<Self, StoreError> {
        let file = StoreFile::open(&*source)?;
        let scene = file.bytes(Section::Scene)?;
        let desc: SceneDesc =
            postcard::from_bytes(&scene).map_err(|error| file.damaged(Section::Scene, &error.to_string()))?;
        drop(scene);
        let rows: Vec<MeshRow> = file.rows(Section::Meshes)?;
        let geometry = file.directory(Section::Geometry)?;
        let attributes = file.directory(Section::Attributes)?;
        let meshes = file.meshes(&rows, geometry.pages())?;
        let index = file.attribute_index(geometry.pages(), attributes.pages())?;
        let instances = file.instances()?;
        if rows.len() != desc.meshes.len() || rows.len() != instances.starts().len() {
            return Err(file.damaged(Section::Scene, "has other meshes"));
        }
        file.check_deforming(&rows, &desc)?;
        let motion = file.motion()?;
        let tiles = file.directory(Section::Tiles)?;
        let textures = file.textures(&desc.images, tiles.pages())?;
        let sources = file.sources()?;
        let extents = rows.iter().map(extent).collect();
        let layouts = rows.iter().map(|row| AttributeLayout(row.attributes)).collect();
        drop(file);
        let blocks = rows.iter().any(|row| row.strategy == PageStrategy::Blocks as u32);
        let strategy = if blocks { PageStrategy::Blocks } else { PageStrategy::Treelets };
        let pages = StoredPages {
            source,
            meshes,
            layouts,
            strategy,
            geometry,
            attributes,
            index,
            textures,
            tiles,
            sources,
        };
        Ok(Self { desc, instances, extents, motion, pages })
    }
}

fn extent(row: &MeshRow) -> MeshExtent {
    let [min, max] = row.object_bounds.map(Vec3::from);
    MeshExtent { bounds: Aabb { min, max }, triangles: row.triangles }
}

/// The resident parts of a file.
struct StoreFile<'s> {
    source: &'s dyn Source,
    bytes: u64,
    sections: Vec<SectionRow>,
}

impl<'s> StoreFile<'s> {
    fn open(source: &'s dyn Source) -> Result<Self, StoreError> {
        let damaged = |what: &str| StoreError::damaged(source.name(), what);
        let mut header = Header::zeroed();
        let bytes = source.bytes()?;
        if bytes < HEADER_BYTES {
            return Err(damaged("it is too short for a store"));
        }
        source.read(0, bytemuck::bytes_of_mut(&mut header))?;
        if header.magic != MAGIC {
            return Err(damaged("it does not start as a store does"));
        }
        if header.crc32 != header_crc32(&header) {
            return Err(damaged("the header is damaged"));
        }
        if header.version != VERSION {
            let what =
                format!("the store has version {}, this is a reader of version {VERSION}", header.version);
            let hint = "pack the scene again with this version";
            return Err(StoreError { hint, ..damaged(&what) });
        }
        if header.bytes != bytes {
            let what = format!("it has {bytes} bytes and should have {}", header.bytes);
            return Err(damaged(&what));
        }
        let table = u64::from(header.sections) * size_of::<SectionRow>() as u64;
        if header.sections > 1024 || header.sections_at.checked_add(table).is_none_or(|end| end > bytes) {
            return Err(damaged("the table of sections is not in it"));
        }
        let mut sections = vec![SectionRow::zeroed(); header.sections as usize];
        source.read(header.sections_at, bytemuck::cast_slice_mut(&mut sections))?;
        if crc32fast::hash(bytemuck::cast_slice(&sections)) != header.sections_crc32 {
            return Err(damaged("the table of sections is damaged"));
        }
        Ok(Self { source, bytes, sections })
    }

    fn damaged(&self, section: Section, what: &str) -> StoreError {
        StoreError::damaged(self.source.name(), format!("{}: {what}", section.name()))
    }

    fn has(&self, section: Section) -> bool {
        self.sections.iter().any(|row| row.kind == section as u32)
    }

    /// The bytes of a section, checked.
    fn bytes(&self, section: Section) -> Result<Vec<u8>, StoreError> {
        self.rows(section)
    }

    /// The rows of a section, checked.
    fn rows<T: Pod>(&self, section: Section) -> Result<Vec<T>, StoreError> {
        let row = self.sections.iter().find(|row| row.kind == section as u32);
        let row = row.ok_or_else(|| self.damaged(section, "is missing"))?;
        if row.offset.checked_add(row.bytes).is_none_or(|end| end > self.bytes) {
            return Err(self.damaged(section, "is not in the file"));
        }
        if !row.bytes.is_multiple_of(size_of::<T>() as u64) {
            return Err(self.damaged(section, "is no whole number of rows"));
        }
        let mut rows: Vec<T> = zeroed_vec(row.bytes as usize / size_of::<T>());
        let (mut offset, mut hasher) = (row.offset, Hasher::new());
        // Piece by piece, since sources may have buffers of their own.
        for piece in cast_slice_mut::<T, u8>(&mut rows).chunks_mut(READ_BYTES) {
            self.source.read(offset, piece)?;
            hasher.update(piece);
            offset += piece.len() as u64;
        }
        if hasher.finalize() != row.crc32 {
            return Err(self.damaged(section, "the checksum is wrong"));
        }
        Ok(rows)
    }

    fn instances(&self) -> Result<Instances, StoreError> {
        let maps: Vec<InstanceRow> = self.rows(Section::Instances)?;
        let starts = self.rows(Section::InstancesOfMesh)?;
        let names = if self.has(Section::NamesOfMeshes) {
            InstanceNames::OfMesh(self.rows(Section::NamesOfMeshes)?)
        } else {
            InstanceNames::Own(self.rows(Section::NamesOfInstances)?)
        };
        let fitting = Instances::from_tables(maps, starts, names);
        fitting.map_err(|error| self.damaged(Section::Instances, &error.to_string()))
    }

    fn directory(&self, section: Section) -> Result<Directory, StoreError> {
        let rows: Vec<EntryRow> = self.rows(section)?;
        let fits = |row: &EntryRow| {
            row.bytes <= MOST_PAGE_BYTES
                && row.offset.checked_add(u64::from(row.bytes)).is_some_and(|end| end <= self.bytes)
        };
        if let Some(page) = rows.iter().position(|row| !fits(row)) {
            return Err(self.damaged(section, &format!("page {page} is not in the file")));
        }
        let entry = |row: &EntryRow| PageEntry { offset: row.offset, bytes: row.bytes, crc32: row.crc32 };
        Ok(rows.iter().map(entry).collect())
    }

    fn meshes(&self, rows: &[MeshRow], pages: usize) -> Result<Vec<Option<Arc<CompactMesh>>>, StoreError> {
        let nodes: Vec<Node8> = self.rows(Section::Nodes)?;
        let roots: Vec<PageRoot> = self.rows(Section::Roots)?;
        let mesh = |(number, row): (usize, &MeshRow)| {
            if row.strategy == DEFORMS {
                return Ok(None);
            }
            compact(row, &nodes, &roots, pages)
                .map(|mesh| Some(Arc::new(mesh)))
                .ok_or_else(|| self.damaged(Section::Meshes, &format!("mesh {number} leads nowhere")))
        };
        rows.iter().enumerate().map(mesh).collect()
    }

    /// Refuses a mesh that deforms and is not in the scene.
    fn check_deforming(&self, rows: &[MeshRow], desc: &SceneDesc) -> Result<(), StoreError> {
        let differs = |(row, mesh): (&MeshRow, &Mesh)| {
            row.strategy == DEFORMS && row.triangles != mesh.triangles.len() as u64
        };
        match rows.iter().zip(&desc.meshes).position(differs) {
            Some(number) => {
                Err(self.damaged(Section::Scene, &format!("mesh {number} deforms and is not there")))
            }
            None => Ok(()),
        }
    }

    fn motion(&self) -> Result<Option<MotionRecord>, StoreError> {
        if !self.has(Section::Motion) {
            return Ok(None);
        }
        let who = postcard::from_bytes(&self.bytes(Section::Motion)?);
        let (kind, numbers) = who.map_err(|error| self.damaged(Section::Motion, &error.to_string()))?;
        Ok(Some(MotionRecord { kind, bytes: self.bytes(Section::Movement)?, numbers }))
    }

    /// What the scene was made of; nothing where the store does not say.
    fn sources(&self) -> Result<Vec<SourceFile>, StoreError> {
        if !self.has(Section::Sources) {
            return Ok(Vec::new());
        }
        let bytes = self.bytes(Section::Sources)?;
        postcard::from_bytes(&bytes).map_err(|error| self.damaged(Section::Sources, &error.to_string()))
    }

    fn attribute_index(&self, pages: usize, attributes: usize) -> Result<AttributeIndex, StoreError> {
        let first: Vec<u32> = self.rows(Section::AttributesOfPage)?;
        let first_triangles: Vec<u16> = self.rows(Section::FirstTriangles)?;
        let ascending = first.is_sorted() && first.len() == pages + 1;
        if !ascending || first.last() != Some(&(attributes as u32)) || first_triangles.len() != attributes {
            return Err(self.damaged(Section::AttributesOfPage, "does not fit the pages"));
        }
        Ok(AttributeIndex { first, first_triangles })
    }

    fn textures(&self, images: &[Image], tiles: usize) -> Result<Vec<StoredTexture>, StoreError> {
        let rows: Vec<TextureRow> = self.rows(Section::Textures)?;
        let texture = |(number, row): (usize, &TextureRow)| {
            stored_texture(row, images, tiles)
                .ok_or_else(|| self.damaged(Section::Textures, &format!("texture {number} leads nowhere")))
        };
        rows.iter().enumerate().map(texture).collect()
    }
}

/// An image in tiles; none where it leads out of the tables.
fn stored_texture(row: &TextureRow, images: &[Image], tiles: usize) -> Option<StoredTexture> {
    let image = images.get(row.image as usize)?;
    let grid = TileGrid::new(image.width, image.height, row.edge, row.first_page)?;
    let end = grid.first_page().checked_add(grid.pages())?;
    let content = Content::from_number(row.content).filter(|_| end as usize <= tiles)?;
    Some(StoredTexture { image: row.image, content, grid: Arc::new(grid) })
}

/// The tree above a mesh's pages; none where it leads out of the tables, or back.
fn compact(row: &MeshRow, nodes: &[Node8], roots: &[PageRoot], pages: usize) -> Option<CompactMesh> {
    let part = |first: u32, count: u32| first as usize..first as usize + count as usize;
    let nodes = nodes.get(part(row.first_node, row.nodes))?;
    let roots = roots.get(part(row.first_root, row.roots))?;
    let exists = |child: ChildRef, parent: Option<usize>| match child {
        ChildRef::NONE => parent.is_some() || row.triangles == 0,
        leaf if leaf.is_leaf() => leaf.index() < roots.len(),
        node => node.index() < nodes.len() && parent.is_none_or(|parent| node.index() > parent),
    };
    let root = ChildRef(row.root);
    let children = || nodes.iter().flat_map(|node| node.children).filter(|&child| child != ChildRef::NONE);
    let sound = exists(root, None)
        && are_distinct(children().filter(|child| !child.is_leaf()), nodes.len())
        && are_distinct(children().filter(|child| child.is_leaf()), roots.len())
        && roots.iter().all(|root| (root.page as usize) < pages)
        && nodes.iter().enumerate().all(|(i, node)| node.children.iter().all(|&c| exists(c, Some(i))))
        && row.scale > 0.0
        && row.scale.is_finite()
        && row.extent.is_finite()
        && (row.triangles == 0
            || row.bounds.iter().chain(&row.object_bounds).flatten().all(|x| x.is_finite()))
        && row.levels <= MOST_LEVELS;
    let [min, max] = row.bounds.map(Vec3::from);
    sound.then(|| CompactMesh {
        nodes: nodes.to_vec(),
        roots: roots.to_vec(),
        root: (root != ChildRef::NONE).then_some(root),
        levels: row.levels as usize,
        bounds: Aabb { min, max },
        extent: row.extent,
        scale: row.scale,
        shares: PageBytes::default(),
    })
}

/// Whether no two of these are the same, so that ways through a tree do not meet again. Those that are not below `end` are left out.
fn are_distinct(children: impl Iterator<Item = ChildRef>, end: usize) -> bool {
    let mut seen = vec![false; end];
    children
        .map(ChildRef::index)
        .all(|index| seen.get_mut(index).is_none_or(|seen| !std::mem::replace(seen, true)))
}
