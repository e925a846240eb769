//! A mesh that is larger than memory, cut into buckets of triangles that lie together.
//!
//! The centres of triangles are counted in the cells of a grid; runs of cells in Morton order with not too many triangles
//! become buckets, whose triangles are written side by side. A cell that alone has too many is cut again by a grid of its
//! own. Each bucket is then a small mesh with the lattice, the extent and the triangle numbers of the whole.

use crate::attributes::AttributeLayout;
use crate::error::StoreError;
use crate::records::Records;
use crate::spool::{SpooledMesh, position};
use bytemuck::cast_slice;
use rayon::prelude::*;
use vastlight_math::{Aabb, Vec2, Vec3, Vec4};
use vastlight_scene::{Mesh, TriangleFindings, is_usable};

/// Cells of the grid along an axis, as a power of two.
const CELL_BITS: u32 = 6;
const CELLS: usize = 1 << (3 * CELL_BITS);
/// Most buckets that are filled at once.
const MOST_RUNS: u64 = 512;
/// Triangles of a bucket that are gathered before they are written.
const GATHERED: usize = 1024;
/// Triangles that are read at a time.
const BLOCK: u64 = 1 << 14;
/// Grids inside grids; beyond that triangles are cut by number.
const DEEPEST: u32 = 12;
/// Bytes of vertices of a bucket that are in memory at once while it is read.
const BUCKET_CACHE: usize = 1 << 20;

/// A triangle on disk: its number in the mesh, and its vertices.
type Numbered = [u32; 4];

/// Triangles that follow each other in a file.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// Index of the file; none for the triangles of the mesh as they came.
    file: Option<usize>,
    first: u64,
    count: u64,
}

/// A mesh on disk in buckets.
#[derive(Debug)]
pub struct Buckets {
    mesh: SpooledMesh,
    files: Vec<Records>,
    runs: Vec<Run>,
    findings: TriangleFindings,
}

/// A bucket as a mesh of its own. Its last two vertices are the corners of the box around the vertices of the whole; no
/// triangle uses them.
#[derive(Clone, Debug)]
pub struct Bucket {
    /// Vertices and triangles.
    pub mesh: Mesh,
    /// By triangle, its number in the whole; they ascend.
    pub numbers: Vec<u32>,
}

impl SpooledMesh {
    /// Number of triangles.
    #[must_use]
    pub fn triangles(&self) -> u64 {
        self.triangles.len()
    }

    /// Which attributes vertices have.
    #[must_use]
    pub fn layout(&self) -> AttributeLayout {
        self.layout
    }

    /// Bytes on disk.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let attributes = self.attributes.as_ref().map_or(0, Records::bytes);
        self.positions.bytes() + self.triangles.bytes() + attributes
    }

    /// Cuts the mesh into buckets of at most `most` triangles.
    ///
    /// # Errors
    /// If a vertex does not exist, there are too many triangles, or a file fails.
    pub fn cut(mut self, name: &str, most: usize) -> Result<Buckets, StoreError> {
        let count = self.triangles.len();
        if count > u64::from(u32::MAX) {
            return Err(StoreError::pack(name, format!("{count} triangles are too many for one mesh")));
        }
        self.triangles.flush()?;
        self.positions.cache(self.cache_bytes)?;
        let bounds = self.bounds;
        let mut buckets = Buckets {
            mesh: self,
            files: Vec::new(),
            runs: Vec::new(),
            findings: TriangleFindings::default(),
        };
        let whole = Run { file: None, first: 0, count };
        let most = most.max(1) as u64;
        let mut waiting = vec![(whole, bounds, 0)];
        while let Some((run, bounds, depth)) = waiting.pop() {
            let cut = buckets.cut_run(name, run, &bounds, most)?;
            for &part in cut.iter().rev() {
                if part.count <= most {
                    continue;
                }
                let bounds = buckets.centres(part)?;
                if depth < DEEPEST && bounds.size().max_element() > 0.0 {
                    waiting.push((part, bounds, depth + 1));
                }
            }
            buckets.keep(&cut, &waiting, most);
        }
        buckets.mesh.triangles.clear()?;
        buckets.mesh.positions.cache(BUCKET_CACHE)?;
        if let Some(attributes) = &mut buckets.mesh.attributes {
            attributes.cache(BUCKET_CACHE)?;
        }
        Ok(buckets)
    }
}

impl Buckets {
    /// Number of buckets.
    #[must_use]
    pub fn len(&self) -> usize {
        self.runs.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// Triangles of a bucket.
    #[must_use]
    pub fn triangles(&self, bucket: usize) -> u64 {
        self.runs.get(bucket).map_or(0, |run| run.count)
    }

    /// What was found about the mesh's triangles.
    #[must_use]
    pub fn findings(&self) -> &TriangleFindings {
        &self.findings
    }

    /// Keeps the runs that are not cut again; those that are too large and cannot be cut by place are cut by number.
    fn keep(&mut self, cut: &[Run], waiting: &[(Run, Aabb, u32)], most: u64) {
        for run in cut {
            let again = waiting.iter().any(|(w, ..)| w.file == run.file && w.first == run.first);
            if again {
                continue;
            }
            for at in (0..run.count).step_by(most as usize) {
                let count = most.min(run.count - at);
                self.runs.push(Run { first: run.first + at, count, ..*run });
            }
        }
    }

    /// Reads triangles of a run from the `at`-th on.
    fn read(&mut self, run: Run, at: u64, out: &mut Vec<Numbered>) -> Result<(), StoreError> {
        let count = BLOCK.min(run.count - at) as usize;
        let first = run.first + at;
        out.clear();
        match run.file {
            Some(file) => {
                out.resize(count, [0; 4]);
                self.files[file].read(first, out)
            }
            None => {
                let mut corners = vec![[0; 3]; count];
                self.mesh.triangles.read(first, &mut corners)?;
                let number = |(i, [a, b, c]): (usize, [u32; 3])| [first as u32 + i as u32, a, b, c];
                out.extend(corners.into_iter().enumerate().map(number));
                Ok(())
            }
        }
    }

    fn corners(&mut self, [_, a, b, c]: Numbered) -> Result<[Vec3; 3], StoreError> {
        let positions = &mut self.mesh.positions;
        let mut at = |vertex: u32| positions.get(u64::from(vertex)).map(position);
        Ok([at(a)?, at(b)?, at(c)?])
    }

    /// The box around the centres of a run's triangles.
    fn centres(&mut self, run: Run) -> Result<Aabb, StoreError> {
        let (mut block, mut bounds) = (Vec::new(), Aabb::EMPTY);
        for at in (0..run.count).step_by(BLOCK as usize) {
            self.read(run, at, &mut block)?;
            for &triangle in &block {
                let centre = centre(self.corners(triangle)?);
                bounds = if is_usable(centre) { bounds.grow(centre) } else { bounds };
            }
        }
        Ok(bounds)
    }

    /// Writes the triangles of a run to a new file, bucket by bucket; gives those.
    fn cut_run(&mut self, name: &str, run: Run, bounds: &Aabb, most: u64) -> Result<Vec<Run>, StoreError> {
        let (mut cells, counts) = self.cells(name, run, bounds)?;
        let (range_of_cell, ranges) = ranges(&counts, most.max(run.count.div_ceil(MOST_RUNS)));
        let mut file = Records::new(&self.mesh.folder, 4)?;
        let mut next: Vec<u64> = Vec::with_capacity(ranges.len());
        let mut runs = Vec::with_capacity(ranges.len());
        let mut first = 0;
        for &count in &ranges {
            next.push(first);
            runs.push(Run { file: Some(self.files.len()), first, count });
            first += count;
        }
        let mut gathered: Vec<Vec<Numbered>> = vec![Vec::new(); ranges.len()];
        let (mut block, mut codes) = (Vec::new(), Vec::new());
        for at in (0..run.count).step_by(BLOCK as usize) {
            self.read(run, at, &mut block)?;
            codes.resize(block.len(), 0_u32);
            cells.read(at, &mut codes)?;
            for (&[number, a, b, c], &code) in block.iter().zip(&codes) {
                let range = range_of_cell[(code & !BROKEN) as usize] as usize;
                let corners = if code & BROKEN == 0 { [a, b, c] } else { [0; 3] };
                let some = &mut gathered[range];
                some.push([number, corners[0], corners[1], corners[2]]);
                if some.len() == GATHERED {
                    file.put(next[range], some)?;
                    next[range] += some.len() as u64;
                    some.clear();
                }
            }
        }
        for (some, &at) in gathered.iter().zip(&next) {
            file.put(at, some)?;
        }
        self.files.push(file);
        Ok(runs)
    }

    /// The cell of each triangle of a run, on disk, and how many triangles each cell has.
    fn cells(&mut self, name: &str, run: Run, bounds: &Aabb) -> Result<(Records, Vec<u64>), StoreError> {
        let mut cells = Records::new(&self.mesh.folder, 1)?;
        let mut counts = vec![0_u64; CELLS];
        let vertices = self.mesh.positions.len();
        let (mut block, mut codes) = (Vec::new(), Vec::new());
        for at in (0..run.count).step_by(BLOCK as usize) {
            self.read(run, at, &mut block)?;
            codes.clear();
            for &triangle in &block {
                if let Some(i) = triangle[1..].iter().find(|&&i| u64::from(i) >= vertices) {
                    let what = format!("vertex index {i} is out of range, there are {vertices} vertices");
                    return Err(StoreError::pack(name, what));
                }
                let corners = self.corners(triangle)?;
                // The first time each triangle is looked at as it came.
                let usable = run.file.is_some() || self.findings.look_at(corners);
                let code = if usable { cell(centre(corners), bounds) } else { 0 };
                counts[code as usize] += 1;
                codes.push(if usable { code } else { code | BROKEN });
            }
            cells.push(&codes)?;
        }
        cells.flush()?;
        Ok((cells, counts))
    }

    /// Reads a bucket.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub fn load(&mut self, bucket: usize) -> Result<Bucket, StoreError> {
        let Some(&run) = self.runs.get(bucket) else {
            return Ok(Bucket { mesh: Mesh::default(), numbers: Vec::new() });
        };
        let count = run.count as usize;
        let mut numbers = Vec::with_capacity(count);
        let mut uses: Vec<u64> = Vec::with_capacity(3 * count);
        let mut block = Vec::new();
        for at in (0..run.count).step_by(BLOCK as usize) {
            self.read(run, at, &mut block)?;
            for [number, corners @ ..] in &block {
                let place = 3 * numbers.len() as u64;
                numbers.push(*number);
                uses.extend((place..).zip(corners).map(|(place, &vertex)| u64::from(vertex) << 32 | place));
            }
        }
        uses.par_sort_unstable();
        let (used, triangles) = local(&uses, count);
        drop(uses);
        let mesh = Mesh { triangles, ..self.vertices(&used)? };
        Ok(Bucket { mesh, numbers })
    }

    /// Some vertices by ascending number, and the corners of the whole.
    fn vertices(&mut self, used: &[u32]) -> Result<Mesh, StoreError> {
        let SpooledMesh { positions, attributes, layout, lattice, vertices, .. } = &mut self.mesh;
        let mut mesh = Mesh { positions: Vec::with_capacity(used.len() + 2), ..Mesh::default() };
        for &vertex in used {
            let p = position(positions.get(u64::from(vertex))?);
            let p = if is_usable(p) { p } else { Vec3::ZERO };
            mesh.positions.push(lattice.map_or(p, |lattice| lattice.snap(p)));
        }
        mesh.positions.extend([vertices.min, vertices.max]);
        if let Some(attributes) = attributes {
            let mut values = Attributes::new(*layout, used.len());
            for &vertex in used {
                values.push(attributes.get(u64::from(vertex))?);
            }
            values.give(&mut mesh);
        }
        Ok(mesh)
    }
}

/// Attributes of vertices, taken from records.
struct Attributes {
    layout: AttributeLayout,
    normals: Vec<Vec3>,
    tangents: Vec<Vec4>,
    colors: Vec<Vec4>,
    uvs: [Vec<Vec2>; crate::attributes::UV_SETS],
}

impl Attributes {
    fn new(layout: AttributeLayout, count: usize) -> Self {
        fn room<T>(there: bool, count: usize) -> Vec<T> {
            Vec::with_capacity(if there { count } else { 0 })
        }
        Self {
            layout,
            normals: room(layout.normals().is_some(), count),
            tangents: room(layout.tangents().is_some(), count),
            colors: room(layout.colors().is_some(), count),
            uvs: std::array::from_fn(|set| room(layout.uvs(set).is_some(), count)),
        }
    }

    fn push(&mut self, record: &[u32]) {
        let record: &[f32] = cast_slice(record);
        let layout = self.layout;
        self.normals.extend(layout.normals().map(|at| Vec3::from_slice(&record[at..])));
        self.tangents.extend(layout.tangents().map(|at| Vec4::from_slice(&record[at..])));
        self.colors.extend(layout.colors().map(|at| Vec4::from_slice(&record[at..])));
        for (set, uvs) in self.uvs.iter_mut().enumerate() {
            uvs.extend(layout.uvs(set).map(|at| Vec2::from_slice(&record[at..])));
        }
    }

    fn give(self, mesh: &mut Mesh) {
        let sets = self.uvs.iter().rposition(|set| !set.is_empty()).map_or(0, |last| last + 1);
        mesh.uvs = self.uvs.into_iter().take(sets).collect();
        (mesh.normals, mesh.tangents, mesh.colors) = (self.normals, self.tangents, self.colors);
    }
}

/// Set for triangles whose corners are not usable.
const BROKEN: u32 = 1 << 31;

fn centre([a, b, c]: [Vec3; 3]) -> Vec3 {
    (a + b + c) / 3.0
}

/// The cell of a point, in Morton order.
fn cell(p: Vec3, bounds: &Aabb) -> u32 {
    let cells = (1 << CELL_BITS) as f32;
    let size = bounds.size().max(Vec3::splat(f32::MIN_POSITIVE));
    let place = ((p - bounds.min) / size * cells).to_array();
    // Casts keep to the range, and take what is no number for 0.
    let [x, y, z] = place.map(|x| (x as u32).min((1 << CELL_BITS) - 1));
    (0..CELL_BITS).fold(0, |code, bit| {
        let bits = (x >> bit & 1) << 2 | (y >> bit & 1) << 1 | (z >> bit & 1);
        code | bits << (3 * bit)
    })
}

/// Runs of cells with at most `most` triangles, or of a single cell: by cell the number of its run, and by run how many
/// triangles it has.
fn ranges(counts: &[u64], most: u64) -> (Vec<u32>, Vec<u64>) {
    let (mut of_cell, mut ranges) = (Vec::with_capacity(counts.len()), Vec::new());
    for &count in counts {
        match ranges.last_mut() {
            Some(last) if *last + count <= most || count == 0 => *last += count,
            _ => ranges.push(count),
        }
        of_cell.push(ranges.len() as u32 - 1);
    }
    (of_cell, ranges)
}

/// From sorted uses (vertex, place of the corner) to the vertices that are used, and triangles by those.
fn local(uses: &[u64], count: usize) -> (Vec<u32>, Vec<[u32; 3]>) {
    let (mut used, mut triangles) = (Vec::new(), vec![[0; 3]; count]);
    for &entry in uses {
        let (vertex, place) = ((entry >> 32) as u32, entry as u32 as usize);
        if used.last() != Some(&vertex) {
            used.push(vertex);
        }
        triangles[place / 3][place % 3] = used.len() as u32 - 1;
    }
    (used, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spool::Spool;
    use vastlight_scene::{Material, MeshPreparation, SceneDesc};

    fn spooled(mesh: &Mesh) -> SpooledMesh {
        let mut spool = Spool::new(&std::env::temp_dir(), 1 << 16).expect("a file");
        let read = mesh.stream(&mut spool);
        spool.finish::<Failed>(read).expect("spooled")
    }

    #[derive(Debug)]
    struct Failed;
    impl From<StoreError> for Failed {
        fn from(_: StoreError) -> Self {
            Self
        }
    }
    impl From<vastlight_scene::SceneError> for Failed {
        fn from(_: vastlight_scene::SceneError) -> Self {
            Self
        }
    }

    /// Clusters of triangles of very different size, one in a single place, and broken ones.
    fn mesh() -> Mesh {
        let mut mesh = Mesh { uvs: vec![Vec::new()], ..Mesh::default() };
        let mut state = 7_u64;
        let mut chance = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        for i in 0..30_000_u32 {
            let size = [1.0, 1e-3, 1e-6, 0.0][i as usize % 4];
            let mut p = Vec3::splat(0.3) + Vec3::new(chance(), chance(), chance()) * size;
            if i % 5000 == 17 {
                p.y = [f32::NAN, f32::INFINITY, 1e30][i as usize % 3];
            }
            mesh.positions.push(p);
            mesh.normals.push(Vec3::new(i as f32, 0.5, chance()));
            mesh.uvs[0].push(Vec2::new(chance(), i as f32));
        }
        mesh.triangles =
            (0..40_000_u32).map(|i| [i * 4, i * 4 + 4, i * 4 + 8].map(|v| (v + i % 4) % 30_000)).collect();
        mesh
    }

    #[test]
    fn buckets_hold_every_triangle_of_the_prepared_mesh_once() {
        let original = mesh();
        let mut prepared = original.clone();
        let desc = SceneDesc { materials: vec![Material::new("plain")], ..SceneDesc::default() };
        let found = MeshPreparation::new(&desc).prepare(&mut prepared).expect("sound");
        for most in [1, 100, 3000, 1 << 20] {
            if most == 1 && prepared.triangles.len() > 5000 {
                prepared.triangles.truncate(5000);
            }
            let whole = Mesh {
                triangles: original.triangles[..prepared.triangles.len()].to_vec(),
                ..original.clone()
            };
            let mut buckets = spooled(&whole).cut("mesh", most).expect("cut");
            let mut seen = vec![false; prepared.triangles.len()];
            for index in 0..buckets.len() {
                let Bucket { mesh, numbers } = buckets.load(index).expect("loads");
                assert!(numbers.len() <= most && numbers.is_sorted() && !numbers.is_empty());
                assert_eq!(numbers.len() as u64, buckets.triangles(index));
                assert_eq!(mesh.positions.len(), mesh.normals.len() + 2);
                for (triangle, &number) in mesh.triangles.iter().zip(&numbers) {
                    assert!(!std::mem::replace(&mut seen[number as usize], true));
                    let expected = prepared.triangles[number as usize];
                    for (&own, &vertex) in triangle.iter().zip(&expected) {
                        let (own, vertex) = (own as usize, vertex as usize);
                        assert_eq!(mesh.positions[own], prepared.positions[vertex]);
                        assert_eq!(mesh.normals[own], prepared.normals[vertex]);
                        assert_eq!(mesh.uvs[0][own], prepared.uvs[0][vertex]);
                    }
                }
            }
            assert!(seen.iter().all(|&seen| seen));
            if prepared.triangles.len() == original.triangles.len() {
                assert_eq!(buckets.findings().of_mesh(""), found);
            } else {
                prepared = original.clone();
                MeshPreparation::new(&desc).prepare(&mut prepared).expect("sound");
            }
        }
    }

    #[test]
    fn the_box_around_the_vertices_is_that_of_the_prepared_mesh() {
        for unusable in [false, true] {
            let mut whole = mesh();
            if !unusable {
                whole.positions.iter_mut().for_each(|p| p.y = if is_usable(*p) { p.y } else { 0.4 });
            }
            let buckets = spooled(&whole).cut("mesh", 1000).expect("cut");
            let desc = SceneDesc { materials: vec![Material::new("plain")], ..SceneDesc::default() };
            MeshPreparation::new(&desc).prepare(&mut whole).expect("sound");
            assert_eq!(buckets.mesh.vertices, Aabb::from_points(whole.positions.iter().copied()));
        }
    }

    #[test]
    fn a_vertex_that_does_not_exist_is_an_error() {
        let mut whole = mesh();
        whole.triangles.push([0, 1, 30_000]);
        let error = spooled(&whole).cut("mesh", 1000).expect_err("wrong");
        assert!(error.what.contains("vertex index 30000"), "{error}");
        let empty = spooled(&Mesh::default()).cut("mesh", 10).expect("cut");
        assert!(empty.is_empty());
    }
}
