//! Pages of attributes: what vertices have besides positions, for some triangles of a page of geometry that follow
//! each other.
//!
//! ```text
//! triangles   u16
//! vertices    u16, at most 256
//! corners     three u8 a triangle
//!             up to a multiple of 4
//! records     f32s of each vertex, see AttributeLayout
//! ```

use crate::spool::push_attributes;
use bytemuck::pod_read_unaligned;
use std::collections::HashMap;
use vastlight_scene::Mesh;

/// Most bytes of a page of attributes.
pub const ATTRIBUTE_SLOT: usize = 4096;
/// Texture coordinate sets that are kept.
pub const UV_SETS: usize = 4;
/// Most vertices of a page.
const VERTICES: usize = 256;
const HEADER: usize = 4;
/// The bit of positions.
const POSITIONS: u32 = 1 << 3;

/// Which attributes a mesh's vertices have, as bits: 0 normals, 1 tangents, 2 colours, 3 positions (never in a store), 4 to 7
/// texture coordinates by set.
///
/// A record holds them in this order: normal (3), tangent (4), colour (4), coordinates of each set that there is (2),
/// position (3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AttributeLayout(pub u32);

impl AttributeLayout {
    /// Those of a mesh.
    #[must_use]
    pub fn of(mesh: &Mesh) -> Self {
        let mut bits = u32::from(!mesh.normals.is_empty());
        bits |= u32::from(!mesh.tangents.is_empty()) << 1;
        bits |= u32::from(!mesh.colors.is_empty()) << 2;
        for (set, _) in mesh.uvs.iter().enumerate().take(UV_SETS).filter(|(_, uvs)| !uvs.is_empty()) {
            bits |= 1 << (4 + set);
        }
        Self(bits)
    }

    /// The same with positions.
    #[must_use]
    pub fn with_positions(self) -> Self {
        Self(self.0 | POSITIONS)
    }

    /// Where normals stand in a record.
    #[must_use]
    pub fn normals(self) -> Option<usize> {
        (self.0 & 1 == 1).then_some(0)
    }

    /// Where tangents stand in a record.
    #[must_use]
    pub fn tangents(self) -> Option<usize> {
        (self.0 >> 1 & 1 == 1).then_some(3 * (self.0 & 1) as usize)
    }

    /// Where colours stand in a record.
    #[must_use]
    pub fn colors(self) -> Option<usize> {
        (self.0 >> 2 & 1 == 1).then_some(3 * (self.0 & 1) as usize + 4 * (self.0 >> 1 & 1) as usize)
    }

    /// Where the texture coordinates of a set stand in a record.
    #[must_use]
    pub fn uvs(self, set: usize) -> Option<usize> {
        let before = (self.0 >> 4 & ((1 << set.min(UV_SETS)) - 1)).count_ones() as usize;
        (set < UV_SETS && self.0 >> (4 + set) & 1 == 1).then_some(self.floats_before_uvs() + 2 * before)
    }

    /// Floats of a record.
    #[must_use]
    pub fn floats(self) -> usize {
        let positions = if self.0 & POSITIONS == 0 { 0 } else { 3 };
        self.floats_before_uvs() + 2 * (self.0 >> 4 & 15).count_ones() as usize + positions
    }

    fn floats_before_uvs(self) -> usize {
        3 * (self.0 & 1) as usize + 4 * (self.0 >> 1 & 3).count_ones() as usize
    }
}

/// The pages of attributes of one page of geometry.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PackedAttributes {
    /// The pages.
    pub pages: Vec<Vec<u8>>,
    /// By page: the place of its first triangle in the page of geometry.
    pub first_triangles: Vec<u16>,
}

impl PackedAttributes {
    /// Packs the attributes of `triangles` of a mesh, in their order; no pages for a mesh without attributes.
    #[must_use]
    pub fn new(mesh: &Mesh, triangles: &[u32]) -> Self {
        Self::of_layout(mesh, AttributeLayout::of(mesh), triangles)
    }

    /// The same with the attributes of a layout: those of the mesh, with or without positions.
    #[must_use]
    pub fn of_layout(mesh: &Mesh, layout: AttributeLayout, triangles: &[u32]) -> Self {
        let mut packed = Self::default();
        if layout.floats() == 0 {
            return packed;
        }
        let mut page = Writer::new(mesh, layout);
        for (place, &triangle) in triangles.iter().enumerate() {
            let corners = mesh.triangles[triangle as usize];
            if !page.has_room(corners) {
                packed.pages.push(page.finish());
            }
            if page.corners.is_empty() {
                packed.first_triangles.push(place as u16);
            }
            page.add(corners);
        }
        if !page.corners.is_empty() {
            packed.pages.push(page.finish());
        }
        packed
    }
}

/// A page in the making.
struct Writer<'m> {
    mesh: &'m Mesh,
    layout: AttributeLayout,
    /// Places of vertices in the page. Looked up, never iterated.
    places: HashMap<u32, u8>,
    corners: Vec<u8>,
    records: Vec<f32>,
}

impl<'m> Writer<'m> {
    fn new(mesh: &'m Mesh, layout: AttributeLayout) -> Self {
        Self { mesh, layout, places: HashMap::new(), corners: Vec::new(), records: Vec::new() }
    }

    fn has_room(&self, corners: [u32; 3]) -> bool {
        let fresh = corners.iter().filter(|vertex| !self.places.contains_key(vertex)).count();
        let vertices = self.places.len() + fresh;
        let bytes =
            (HEADER + self.corners.len() + 3).next_multiple_of(4) + 4 * self.layout.floats() * vertices;
        vertices <= VERTICES && bytes <= ATTRIBUTE_SLOT
    }

    fn add(&mut self, corners: [u32; 3]) {
        for vertex in corners {
            let next = self.places.len() as u8;
            let place = *self.places.entry(vertex).or_insert(next);
            self.corners.push(place);
            if place == next && self.records.len() < self.places.len() * self.layout.floats() {
                push_attributes(self.mesh, vertex as usize, &mut self.records);
                if self.layout.0 & POSITIONS != 0 {
                    self.records.extend(self.mesh.positions[vertex as usize].to_array());
                }
            }
        }
    }

    fn finish(&mut self) -> Vec<u8> {
        let (triangles, vertices) = (self.corners.len() / 3, self.places.len());
        let mut bytes = Vec::with_capacity(ATTRIBUTE_SLOT);
        bytes.extend((triangles as u16).to_le_bytes());
        bytes.extend((vertices as u16).to_le_bytes());
        bytes.append(&mut self.corners);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        self.records.drain(..).for_each(|x| bytes.extend(x.to_le_bytes()));
        self.places.clear();
        bytes
    }
}

/// Most floats of the attributes of a triangle.
pub const MOST_FLOATS: usize = 3 * (3 + 4 + 4 + 2 * UV_SETS);

/// Copies the records of the three corners of the triangle number `index` of a page to the start of `out`; false, and
/// zeros, where a damaged page has them not. `out` must have room.
pub fn read_corners(page: &[u8], layout: AttributeLayout, index: usize, out: &mut [f32]) -> bool {
    let floats = layout.floats();
    let mut read = || -> Option<()> {
        let triangles = usize::from(u16::from_le_bytes(*page.first_chunk()?));
        let corners = page.get(HEADER + 3 * index..)?.first_chunk::<3>()?;
        let records = page.get((HEADER + 3 * triangles).next_multiple_of(4)..)?;
        for (&corner, out) in corners.iter().zip(out.chunks_exact_mut(floats.max(1))) {
            let record = records.get(4 * floats * usize::from(corner)..)?.get(..4 * floats)?;
            out.iter_mut().zip(record.chunks_exact(4)).for_each(|(x, bytes)| *x = pod_read_unaligned(bytes));
        }
        (index < triangles).then_some(())
    };
    let whole = read().is_some();
    if !whole {
        out.iter_mut().take(3 * floats).for_each(|x| *x = 0.0);
    }
    whole
}

/// Where the attributes of a triangle are.
#[derive(Clone, Debug, Default)]
pub struct AttributeIndex {
    /// By page of geometry, and one more: the first page of attributes.
    pub(crate) first: Vec<u32>,
    /// By page of attributes: the place of its first triangle.
    pub(crate) first_triangles: Vec<u16>,
}

impl AttributeIndex {
    /// The page of attributes of the triangle at a place of a page of geometry, and the triangle's number there.
    #[must_use]
    pub fn find(&self, page: u32, place: u32) -> Option<(u32, usize)> {
        let (&first, &end) = (self.first.get(page as usize)?, self.first.get(page as usize + 1)?);
        let starts = self.first_triangles.get(first as usize..end as usize)?;
        let number = starts.partition_point(|&start| u32::from(start) <= place).checked_sub(1)?;
        Some((first + number as u32, (place - u32::from(starts[number])) as usize))
    }

    /// By page of geometry, and one more: the first page of attributes.
    #[must_use]
    pub fn firsts(&self) -> &[u32] {
        &self.first
    }

    /// By page of attributes: the place of its first triangle.
    #[must_use]
    pub fn first_triangles(&self) -> &[u16] {
        &self.first_triangles
    }

    /// Memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.first[..]) + size_of_val(&self.first_triangles[..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::{Vec2, Vec3, Vec4};

    fn mesh(layout: u32) -> Mesh {
        let n = 1000;
        let on = |bit: u32| if layout >> bit & 1 == 1 { n } else { 0 };
        let x = |i: usize| i as f32 + 0.25;
        Mesh {
            positions: vec![Vec3::ZERO; n],
            triangles: (0..2000_u32).map(|i| [i % 1000, i * 7 % 1000, (i / 3) % 1000]).collect(),
            normals: (0..on(0)).map(|i| Vec3::new(x(i), 1.0, 2.0)).collect(),
            tangents: (0..on(1)).map(|i| Vec4::new(x(i), 3.0, 4.0, 5.0)).collect(),
            colors: (0..on(2)).map(|i| Vec4::new(x(i), 6.0, 7.0, 8.0)).collect(),
            uvs: (4..8).map(|bit| (0..on(bit)).map(|i| Vec2::new(x(i), bit as f32)).collect()).collect(),
            ..Mesh::default()
        }
    }

    #[test]
    fn every_corner_is_found_again() {
        for bits in [0b1, 0b10, 0b111, 0b10000, 0b1010_0001, 0b1111_0111] {
            let mesh = mesh(bits);
            let layout = AttributeLayout::of(&mesh);
            assert_eq!(layout.0, bits);
            let triangles: Vec<u32> = (0..2000).rev().collect();
            let packed = PackedAttributes::new(&mesh, &triangles);
            assert!(packed.pages.iter().all(|page| page.len() <= ATTRIBUTE_SLOT));
            assert!(packed.pages.len() > 5);
            let index = AttributeIndex {
                first: vec![0, packed.pages.len() as u32],
                first_triangles: packed.first_triangles,
            };
            for (place, &triangle) in triangles.iter().enumerate() {
                let (page, number) = index.find(0, place as u32).expect("there");
                let mut out = vec![0.0; 3 * layout.floats()];
                assert!(read_corners(&packed.pages[page as usize], layout, number, &mut out));
                for (record, vertex) in out.chunks(layout.floats()).zip(mesh.triangles[triangle as usize]) {
                    let x = vertex as f32 + 0.25;
                    let starts = [layout.normals(), layout.tangents(), layout.colors()];
                    let uvs = (0..UV_SETS).map(|set| layout.uvs(set));
                    assert!(starts.into_iter().chain(uvs).flatten().all(|at| record[at] == x));
                    let last = (0..UV_SETS).rev().find_map(|set| Some((set, layout.uvs(set)?)));
                    assert!(last.is_none_or(|(set, at)| record[at + 1] == (4 + set) as f32));
                }
            }
        }
    }

    #[test]
    fn damaged_pages_and_meshes_without_attributes_are_read_without_harm() {
        assert!(PackedAttributes::new(&mesh(0), &[1, 2]).pages.is_empty());
        let mesh = mesh(1);
        let page = PackedAttributes::new(&mesh, &[0, 1, 2]).pages.swap_remove(0);
        for cut in 0..page.len() {
            let mut out = [7.0; MOST_FLOATS];
            let whole = read_corners(&page[..cut], AttributeLayout(1), 2, &mut out);
            assert!(!whole && out[..9] == [0.0; 9], "{cut}");
        }
        let mut out = [0.0; MOST_FLOATS];
        assert!(!read_corners(&page, AttributeLayout(1), 3, &mut out), "only three triangles");
        assert_eq!(AttributeIndex::default().find(0, 0), None);
    }
}
