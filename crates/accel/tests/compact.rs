//! Pages hold the same triangles as wide trees, to the last bit, and never more than a reader can stand.

mod common;

use common::{Soup, inputs};
use vastlight_accel::BuildConfig;
use vastlight_accel::build::NAMES;
use vastlight_accel::compact::{BlockSizes, CompactError, CompactMesh, PackedPage, Page, SLACK};
use vastlight_accel::wide::{ChildRef, Leaf, MeshBvh, WideNode};
use vastlight_math::Vec3;
use vastlight_paging::Table;
use vastlight_simd::{Kernel, Level, Simd8};

/// Triangles whose corners are moved to a lattice of 23 bits.
fn snapped(triangles: &[[Vec3; 3]]) -> Soup {
    let mut soup = Soup::new(triangles);
    let largest = soup.positions.iter().map(|p| p.abs().max_element()).fold(f32::MIN_POSITIVE, f32::max);
    let step = f64::from(largest).log2().floor().exp2() / 4_194_304.0;
    let snap = |x: f32| ((f64::from(x) / step).round() * step) as f32;
    soup.positions.iter_mut().for_each(|p| *p = Vec3::new(snap(p.x), snap(p.y), snap(p.z)));
    soup
}

/// A bumpy sheet whose triangles share vertices.
fn sheet(side: usize) -> Soup {
    let height = |x: usize, y: usize| ((x * 7 + y * 13) % 32) as f32 / 64.0;
    let vertex = |i: usize| Vec3::new((i % side) as f32, height(i % side, i / side), (i / side) as f32);
    let quad = |i: usize| {
        let a = (i / (side - 1) * side + i % (side - 1)) as u32;
        let (b, c, d) = (a + 1, a + side as u32, a + side as u32 + 1);
        [[a, b, c], [b, d, c]]
    };
    Soup {
        positions: (0..side * side).map(vertex).collect(),
        triangles: (0..(side - 1) * (side - 1)).flat_map(quad).collect(),
    }
}

/// A mesh and its pages.
struct Packed {
    compact: CompactMesh,
    pages: Vec<PackedPage>,
    memory: Table,
}

impl Packed {
    fn new(mesh: &MeshBvh, slot: usize) -> Self {
        let (compact, pages) = CompactMesh::pack(mesh, slot).expect("packed");
        let memory = Table::resident(pages.iter().map(|page| &page.bytes[..]), SLACK);
        Self { compact, pages, memory }
    }

    fn bytes(&self) -> usize {
        self.compact.bytes() + self.memory.bytes()
    }
}

#[test]
fn pages_of_any_size_hold_what_the_wide_tree_holds() {
    for (input, triangles) in inputs() {
        let soup = snapped(&triangles);
        for name in ["binned-sah", "sbvh", "hlbvh2"] {
            assert!(NAMES.contains(&name));
            let wide = soup.build(name);
            let whole = wide.validate(&soup.view()).expect("sound");
            for slot in [1 << 10, 1 << 13, CompactMesh::SLOT, 1 << 20] {
                let Packed { compact, pages, memory } = Packed::new(&wide, slot);
                let report = compact
                    .validate(|page| memory.page(page).map(Page::new), &soup.view())
                    .unwrap_or_else(|violation| panic!("{name}, {input}, {slot}: {violation}"));
                assert_eq!(
                    (report.leaves, report.references, report.largest_leaf),
                    (whole.leaves, whole.references, whole.largest_leaf),
                    "{name}, {input}, {slot}"
                );
                assert!(pages.iter().all(|page| page.bytes.len() <= slot));
                let triangles: usize = pages.iter().map(|page| page.triangles.len()).sum();
                assert_eq!(triangles, whole.references);
            }
        }
    }
}

#[test]
fn blocks_of_any_size_hold_the_mesh() {
    for (input, triangles) in inputs() {
        let soup = snapped(&triangles);
        let scale = soup.build("").scale;
        for (branch, block) in [(64, 16), (1 << 12, 100), (1 << 17, 1 << 13)] {
            // Blocks of a few hundred triangles that lie apart may not fit a page.
            let block = if triangles.len() > 100_000 { block.min(1 << 11) } else { block };
            let sizes = BlockSizes { branch, block };
            let (compact, pages) = CompactMesh::pack_blocks("", &soup.view(), sizes, &BuildConfig::default())
                .unwrap_or_else(|e| panic!("{input}, {block}: {e}"));
            assert_eq!(compact.scale, scale, "{input}");
            let memory = Table::resident(pages.iter().map(|page| &page.bytes[..]), SLACK);
            compact
                .validate(|page| memory.page(page).map(Page::new), &soup.view())
                .unwrap_or_else(|violation| panic!("{input}, {block}: {violation}"));
            assert!(pages.iter().all(|page| page.triangles.len() <= block));
            assert_eq!(compact.roots.len(), pages.len());
        }
    }
}

#[test]
fn shared_vertices_are_stored_once_in_few_bits() {
    let soup = sheet(200);
    let packed = Packed::new(&soup.build(""), CompactMesh::SLOT);
    let of_a_triangle = |bytes: usize| bytes as f64 / soup.triangles.len() as f64;
    let shares = packed.compact.shares;
    // Coordinates are small integers, and 64ths of them: some three bytes a vertex.
    assert!(of_a_triangle(shares.vertices) < 2.5, "{shares:?}");
    assert!(of_a_triangle(packed.bytes()) < 12.0, "{shares:?}");
    assert!(packed.bytes() * 4 < soup.build("").bytes());
}

#[test]
fn small_pages_are_full() {
    let soup = snapped(&inputs().into_iter().find(|input| input.0 == "many").expect("an input").1);
    let Packed { compact, pages, .. } = Packed::new(&soup.build(""), 1 << 14);
    assert!(compact.shares.sum() * 100 > pages.len() * (1 << 14) * 85, "{} pages", pages.len());
}

#[test]
fn meshes_off_the_lattice_and_pages_too_small_are_errors() {
    let mut soup = snapped(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    soup.positions[0].x = 1e-20;
    let refused = |soup: &Soup, slot| CompactMesh::pack(&soup.build(""), slot).err();
    assert_eq!(refused(&soup, 4096), Some(CompactError::Lattice { triangle: 0 }));
    assert_eq!(refused(&sheet(20), 64), Some(CompactError::Slot { bytes: 64 }));
}

/// Reads every word of a page as a node, and all leaves that these name; gives something that depends on them.
struct ReadAll<'a>(Page<'a>);

impl Kernel for ReadAll<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<S: Simd8>(self, simd: S) -> f32 {
        let mut sum = 0.0;
        let nodes = (0..).map_while(|place| self.0.node(place).map(|node| node.to_wide(place)));
        for child in nodes.flat_map(|node| node.children) {
            if child != ChildRef::NONE && child.is_leaf() {
                let leaf = self.0.leaf(simd, child.index());
                for lane in (0..8).filter(|lane| leaf.lanes() >> lane & 1 == 1) {
                    sum += leaf.corners()[2][1][lane] + leaf.prim(lane) as f32;
                }
            }
        }
        sum
    }
}

#[test]
fn damaged_pages_are_read_without_harm() {
    let soup = sheet(60);
    let packed = Packed::new(&soup.build(""), 1 << 13);
    let sound = packed.memory.page(1).expect("a page").to_vec();
    let mut state = 5_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize
    };
    for round in 0..200 {
        // In words, so that it is aligned.
        let mut words: Vec<u32> = bytemuck::pod_collect_to_vec(&sound[..sound.len() / 4 * 4]);
        for _ in 0..1 + round % 20 {
            let place = if round % 2 == 0 { random() % 600 } else { random() % words.len() };
            words[place] = (random() as u32) << 8 | random() as u32;
        }
        words.truncate(if round % 3 == 0 { random() % words.len() } else { words.len() });
        let page = Page::new(bytemuck::cast_slice(&words));
        for level in Level::available() {
            std::hint::black_box(level.dispatch(ReadAll(page)));
        }
    }
}
