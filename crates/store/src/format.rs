//! The bytes of a store: see docs/store-format.md. All numbers are little-endian.

use bytemuck::{Pod, Zeroable};

/// What a store starts with.
pub const MAGIC: [u8; 8] = *b"vastlite";
/// The version of the format that this code reads and writes.
pub const VERSION: u32 = 5;
/// Bytes before the first page.
pub const HEADER_BYTES: u64 = 4096;
/// Pages start at multiples of this.
pub const PAGE_ALIGNMENT: u64 = 64;

/// The first bytes of a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Header {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// [`VERSION`].
    pub version: u32,
    /// Number of sections.
    pub sections: u32,
    /// Bytes of the whole store.
    pub bytes: u64,
    /// Where the table of sections is.
    pub sections_at: u64,
    /// CRC-32 of the table of sections.
    pub sections_crc32: u32,
    /// CRC-32 of the bytes of the header before this one.
    pub crc32: u32,
}

/// A row of the table of sections.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct SectionRow {
    /// A [`Section`].
    pub kind: u32,
    /// CRC-32 of the bytes.
    pub crc32: u32,
    /// First byte.
    pub offset: u64,
    /// Length.
    pub bytes: u64,
}

/// What is resident when a store is open, by parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Section {
    /// The scene without geometry, as `postcard` writes it.
    Scene = 1,
    /// Rows of [`MeshRow`].
    Meshes = 2,
    /// Nodes above pages, 256 bytes each.
    Nodes = 3,
    /// Subtrees of pages, 32 bytes each.
    Roots = 4,
    /// [`EntryRow`] of each page of geometry.
    Geometry = 5,
    /// [`EntryRow`] of each page of attributes.
    Attributes = 6,
    /// By page of geometry, and one more: the first of its pages of attributes, u32.
    AttributesOfPage = 7,
    /// By page of attributes: the place in its page of geometry of its first triangle, u16.
    FirstTriangles = 8,
    /// [`InstanceRow`] of each instance, in the order of their meshes.
    Instances = 9,
    /// [`TextureRow`] of each image whose texels are in tiles.
    Textures = 10,
    /// [`EntryRow`] of each tile.
    Tiles = 11,
    /// By mesh, its first instance, u32.
    InstancesOfMesh = 12,
    /// By mesh, the name of all its instances, u32; or [`Section::NamesOfInstances`].
    NamesOfMeshes = 13,
    /// By instance, its name, u32.
    NamesOfInstances = 14,
    /// What the scene was made of, as `postcard` writes a list of `SourceFile`.
    Sources = 16,
    /// Who reads the movement, and numbers of instances in it, as `postcard` writes them: a string, and pairs of u32.
    Motion = 17,
    /// The movement, as its writer wrote it.
    Movement = 18,
}

impl Section {
    /// All of them, by number.
    pub const ALL: [Self; 17] = [
        Self::Scene,
        Self::Meshes,
        Self::Nodes,
        Self::Roots,
        Self::Geometry,
        Self::Attributes,
        Self::AttributesOfPage,
        Self::FirstTriangles,
        Self::Instances,
        Self::Textures,
        Self::Tiles,
        Self::InstancesOfMesh,
        Self::NamesOfMeshes,
        Self::NamesOfInstances,
        Self::Sources,
        Self::Motion,
        Self::Movement,
    ];

    /// What to call it in a message.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Meshes => "meshes",
            Self::Nodes => "nodes",
            Self::Roots => "subtrees",
            Self::Geometry => "geometry directory",
            Self::Attributes => "attribute directory",
            Self::AttributesOfPage => "attribute index",
            Self::FirstTriangles => "attribute places",
            Self::Instances => "instances",
            Self::Textures => "textures",
            Self::Tiles => "tile directory",
            Self::InstancesOfMesh => "instances of meshes",
            Self::NamesOfMeshes => "names of meshes",
            Self::NamesOfInstances => "names of instances",
            Self::Sources => "sources",
            Self::Motion => "motion",
            Self::Movement => "movement",
        }
    }
}

/// A mesh.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct MeshRow {
    /// Number of triangles.
    pub triangles: u64,
    /// Its first node above pages, and how many there are.
    pub first_node: u32,
    /// See there.
    pub nodes: u32,
    /// Its first subtree, and how many there are.
    pub first_root: u32,
    /// See there.
    pub roots: u32,
    /// Its first page, and how many there are.
    pub first_page: u32,
    /// See there.
    pub pages: u32,
    /// A node by number, or a subtree with the highest bit set, from the mesh's first on; all bits set for no triangles.
    pub root: u32,
    /// Nodes on the longest way down.
    pub levels: u32,
    /// Smallest and largest corner of all triangles, times `scale`.
    pub bounds: [[f32; 3]; 2],
    /// Smallest and largest corner of all triangles.
    pub object_bounds: [[f32; 3]; 2],
    /// Largest absolute coordinate of a vertex, times `scale`.
    pub extent: f32,
    /// Positions in pages are the mesh's times this power of two.
    pub scale: f32,
    /// Which attributes the vertices have: see [`crate::AttributeLayout`].
    pub attributes: u32,
    /// What its pages are: 0 treelets, 1 blocks, [`DEFORMS`] none.
    pub strategy: u32,
}

/// What stands in the place of a strategy of a mesh that deforms: it has no pages, its geometry is in the scene.
pub const DEFORMS: u32 = 2;

/// Where a page is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct EntryRow {
    /// First byte.
    pub offset: u64,
    /// Length.
    pub bytes: u32,
    /// CRC-32 of the bytes.
    pub crc32: u32,
}

/// A placement of a mesh: object space to world space, three columns and an offset.
pub type InstanceRow = vastlight_math::Affine3;

/// An image whose texels are in tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct TextureRow {
    /// Number of the image.
    pub image: u32,
    /// Number of a `vastlight_scene::Content`.
    pub content: u32,
    /// Edge of a tile in texels, as a power of two.
    pub edge: u32,
    /// The first of its tiles.
    pub first_page: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_accel::compact::{PackedNode, PageRoot};
    use vastlight_accel::wide::Node8;

    #[test]
    fn structs_have_the_documented_sizes() {
        let found = [
            size_of::<Header>(),
            size_of::<SectionRow>(),
            size_of::<MeshRow>(),
            size_of::<EntryRow>(),
            size_of::<InstanceRow>(),
            size_of::<TextureRow>(),
            size_of::<Node8>(),
            size_of::<PageRoot>(),
            size_of::<PackedNode>(),
        ];
        let row = InstanceRow::from_cols_array(&std::array::from_fn(|i| i as f32));
        let numbers: &[f32] = bytemuck::cast_slice(bytemuck::bytes_of(&row));
        assert!(numbers.iter().zip(0..12).all(|(&x, i)| x == i as f32));
        assert_eq!(found, [40, 24, 104, 16, 48, 16, 256, 32, 92]);
    }
}
