//! Stanford PLY: text and both binary byte orders, any property types in any order.
//!
//! One mesh, streamed: memory is the mesh and one chunk of the file. Colours of integer types are taken as sRGB (what
//! scanners and editors write), floats as linear.

mod ascii;
mod binary;
mod header;
mod vertices;

use crate::polygon::Triangulator;
use crate::scan::Source;
use crate::{ImportError, Limits, LoadOptions, single_mesh_scene};
use header::{Element, Encoding, Header, Property};
use std::io::Read;
use std::path::Path;
use vastlight_math::Vec3;
use vastlight_scene::{Diagnostics, Mesh, SceneDesc};
use vertices::Vertices;

/// Reads a PLY file as a scene of one mesh.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<SceneDesc, ImportError> {
    let mut diagnostics = Diagnostics::default();
    let file_bytes = std::fs::metadata(path).map_err(|e| ImportError::io(&e, path))?.len();
    let source = Source::open(path, &options.limits)?;
    let mesh = read(source, file_bytes, &options.limits, &mut diagnostics)?;
    Ok(single_mesh_scene(mesh, path, diagnostics))
}

/// Reads a mesh from a source of `file_bytes` bytes.
fn read<R: Read>(
    mut source: Source<R>,
    file_bytes: u64,
    limits: &Limits,
    diagnostics: &mut Diagnostics,
) -> Result<Mesh, ImportError> {
    let header = Header::read(&mut source)?;
    let file = source.file().to_owned();
    let vertex_count = header.element("vertex").map_or(0, |e| e.count);
    limits.check_count(vertex_count, limits.vertices.min(u64::from(u32::MAX)), "vertices", &file)?;
    let mut body = Body { source, encoding: header.encoding, file_bytes };
    let mut vertices = Vertices::default();
    let mut faces = Faces::new(vertex_count as u32, limits.triangles);
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => vertices = body.vertices(element)?,
            "face" | "tristrips" => body.faces(element, &vertices.positions, &mut faces)?,
            _ => body.skip(element)?,
        }
    }
    if faces.triangles.is_empty() {
        diagnostics.warn("the file has no faces", &file, "point clouds are not drawn");
    }
    let mut mesh = vertices.into_mesh();
    mesh.triangles = faces.triangles;
    Ok(mesh)
}

/// The data after the header.
struct Body<R> {
    source: Source<R>,
    encoding: Encoding,
    file_bytes: u64,
}

impl<R: Read> Body<R> {
    fn vertices(&mut self, element: &Element) -> Result<Vertices, ImportError> {
        let mut vertices = Vertices::plan(element, self.source.file())?;
        vertices.reserve(self.plausible_rows(element));
        match self.encoding {
            Encoding::Ascii => ascii::read_vertices(&mut self.source, element, &mut vertices)?,
            Encoding::Binary(order) => {
                binary::read_vertices(&mut self.source, element, order, &mut vertices)?
            }
        }
        vertices.convert_colors();
        Ok(vertices)
    }

    fn faces(&mut self, element: &Element, positions: &[Vec3], faces: &mut Faces) -> Result<(), ImportError> {
        let Some(list) = element.index_list() else { return self.skip(element) };
        faces.triangles.reserve(self.plausible_rows(element));
        faces.strips = element.name == "tristrips";
        let mut row = 0;
        let mut sink = |corners: &[i64]| {
            row += 1;
            faces.push(corners, positions).map_err(|what| format!("{} {}: {what}", element.name, row - 1))
        };
        match self.encoding {
            Encoding::Ascii => ascii::read_lists(&mut self.source, element, list, &mut sink),
            Encoding::Binary(order) => binary::read_lists(&mut self.source, element, order, list, &mut sink),
        }
    }

    fn skip(&mut self, element: &Element) -> Result<(), ImportError> {
        let mut ignore = |_: &[i64]| Ok(());
        match self.encoding {
            Encoding::Ascii => ascii::read_lists(&mut self.source, element, usize::MAX, &mut ignore),
            Encoding::Binary(order) => {
                binary::read_lists(&mut self.source, element, order, usize::MAX, &mut ignore)
            }
        }
    }

    /// The count of rows that the header states, or what the file can hold at most if that is less.
    fn plausible_rows(&self, element: &Element) -> usize {
        let smallest = |p: &Property| match (self.encoding, p) {
            (Encoding::Ascii, _) => 2,
            (_, Property::Scalar { kind, .. }) => kind.bytes(),
            (_, Property::List { count, .. }) => count.bytes(),
        };
        let row: usize = element.properties.iter().map(smallest).sum();
        element.count.min(self.file_bytes / row.max(1) as u64) as usize
    }
}

/// Triangles as they grow.
struct Faces {
    triangles: Vec<[u32; 3]>,
    vertex_count: u32,
    limit: u64,
    strips: bool,
    triangulator: Triangulator,
    corners: Vec<Vec3>,
}

impl Faces {
    fn new(vertex_count: u32, limit: u64) -> Self {
        Self {
            triangles: Vec::new(),
            vertex_count,
            limit: limit.min(u64::from(u32::MAX)),
            strips: false,
            triangulator: Triangulator::default(),
            corners: Vec::new(),
        }
    }

    /// Adds a polygon, or a triangle strip with -1 between its pieces.
    #[inline]
    fn push(&mut self, corners: &[i64], positions: &[Vec3]) -> Result<(), String> {
        if self.strips {
            return self.push_strips(corners);
        }
        for &corner in corners {
            self.check(corner)?;
        }
        if let &[a, b, c] = corners {
            self.triangles.push([a as u32, b as u32, c as u32]);
        } else {
            self.push_polygon(corners, positions);
        }
        self.check_limit()
    }

    fn push_polygon(&mut self, corners: &[i64], positions: &[Vec3]) {
        // Where faces stand before vertices there is nothing to measure: a fan.
        let position = |&c: &i64| positions.get(c as usize).copied().unwrap_or_default();
        self.corners.clear();
        self.corners.extend(corners.iter().map(position));
        let triangles = &mut self.triangles;
        self.triangulator
            .triangulate(&self.corners, |t| triangles.push(t.map(|i| corners[i as usize] as u32)));
    }

    fn push_strips(&mut self, strips: &[i64]) -> Result<(), String> {
        for strip in strips.split(|&i| i < 0) {
            for &corner in strip {
                self.check(corner)?;
            }
            for (i, w) in strip.windows(3).enumerate() {
                let [a, b, c] = [w[0] as u32, w[1] as u32, w[2] as u32];
                let triangle = if i % 2 == 0 { [a, b, c] } else { [b, a, c] };
                // Strips repeat vertices to turn corners; such triangles have no area.
                if a != b && b != c && c != a {
                    self.triangles.push(triangle);
                }
            }
        }
        self.check_limit()
    }

    #[inline]
    fn check(&self, corner: i64) -> Result<(), String> {
        if (0..i64::from(self.vertex_count)).contains(&corner) {
            return Ok(());
        }
        Err(format!("vertex {corner} does not exist, there are {}", self.vertex_count))
    }

    fn check_limit(&self) -> Result<(), String> {
        if self.triangles.len() as u64 <= self.limit {
            return Ok(());
        }
        Err(format!("more triangles than the limit of {}", self.limit))
    }
}

#[cfg(test)]
mod tests;
