//! Stanford PLY: text and both binary byte orders, any property types in any order.
//!
//! One mesh, streamed block by block to whoever takes it: into memory, or onto the disk. Colours of integer types are taken as sRGB (what
//! scanners and editors write), floats as linear.

mod ascii;
mod binary;
mod header;
mod vertices;

use crate::polygon::Triangulator;
use crate::scan::Source;
use crate::single::{Stopped, streamed_mesh};
use crate::{FileSize, ImportError, Limits, LoadOptions, Streamed, single_mesh_scene};
use header::{Element, Encoding, Header, Property};
use std::io::Read;
use std::path::Path;
use vastlight_math::Vec3;
use vastlight_scene::{Diagnostics, Mesh, MeshSink, SceneDesc, SceneError};
use vertices::Vertices;

/// Reads a PLY file as a scene of one mesh.
pub(crate) fn load(path: &Path, options: &LoadOptions) -> Result<SceneDesc, ImportError> {
    load_cut(path, options, &mut Triangulator::default())
}

/// Reads a PLY file whose polygons are cut as is said.
pub(crate) fn load_cut(
    path: &Path,
    options: &LoadOptions,
    triangulator: &mut Triangulator,
) -> Result<SceneDesc, ImportError> {
    let mut diagnostics = Diagnostics::default();
    let file_bytes = std::fs::metadata(path).map_err(|e| ImportError::io(&e, path))?.len();
    let source = Source::open(path, &options.limits)?;
    let mesh = read(source, file_bytes, &options.limits, triangulator, &mut diagnostics)?;
    Ok(single_mesh_scene(mesh, path, diagnostics))
}

/// A PLY file as a scene of one mesh that is read block by block.
pub(crate) fn stream(path: &Path, options: &LoadOptions) -> Result<Streamed, ImportError> {
    let file_bytes = std::fs::metadata(path).map_err(|e| ImportError::io(&e, path))?.len();
    let header = Header::read(&mut Source::open(path, &options.limits)?)?;
    let mut diagnostics = Diagnostics::default();
    let faces = faces_of(&header);
    let strips = header.element("tristrips").is_some();
    if faces == 0 && !strips {
        warn_no_faces(&mut diagnostics, &path.display().to_string());
    }
    let vertices = header.element("vertex").map(|e| Vertices::plan(e, &path.display().to_string()));
    let colored = vertices.transpose()?.is_some_and(|vertices| vertices.has_colors());
    let (path_again, limits) = (path.to_owned(), options.limits);
    let read = move |sink: &mut dyn MeshSink| {
        let source = Source::open(&path_again, &limits)?;
        Ok(read_into(source, file_bytes, &limits, &mut Triangulator::default(), sink)?)
    };
    // Polygons with more corners make more triangles than there are faces; most files have triangles.
    let triangles = (!strips).then_some(faces);
    Ok(streamed_mesh(path, colored, triangles, diagnostics, Box::new(read)))
}

/// What a file's header says of its size.
pub(crate) fn file_size(path: &Path, options: &LoadOptions) -> Result<FileSize, ImportError> {
    let bytes = std::fs::metadata(path).map_err(|e| ImportError::io(&e, path))?.len();
    let header = Header::read(&mut Source::open(path, &options.limits)?)?;
    // A list of strips is in memory as it stands in the file, whose buffer doubles, and as numbers of 8 bytes.
    let streaming_bytes = if header.element("tristrips").is_some() { bytes.saturating_mul(4) } else { 0 };
    Ok(FileSize { streaming_bytes, triangles: faces_of(&header), ..FileSize::default() })
}

fn faces_of(header: &Header) -> u64 {
    let faces = header.elements.iter().filter(|e| e.name == "face");
    faces.fold(0, |sum: u64, element| sum.saturating_add(element.count))
}

fn warn_no_faces(diagnostics: &mut Diagnostics, file: &str) {
    diagnostics.warn("the file has no faces", file, "point clouds are not drawn");
}

/// Reads a mesh from a source of `file_bytes` bytes.
fn read<R: Read>(
    source: Source<R>,
    file_bytes: u64,
    limits: &Limits,
    triangulator: &mut Triangulator,
    diagnostics: &mut Diagnostics,
) -> Result<Mesh, ImportError> {
    let (mut mesh, file) = (Mesh::default(), source.file().to_owned());
    read_into(source, file_bytes, limits, triangulator, &mut mesh).map_err(Stopped::into_import)?;
    if mesh.triangles.is_empty() {
        warn_no_faces(diagnostics, &file);
    }
    Ok(mesh)
}

/// Reads a mesh block by block.
fn read_into<R: Read>(
    mut source: Source<R>,
    file_bytes: u64,
    limits: &Limits,
    triangulator: &mut Triangulator,
    sink: &mut dyn MeshSink,
) -> Result<(), Stopped> {
    let header = Header::read(&mut source)?;
    let file = source.file().to_owned();
    let vertex_count = header.element("vertex").map_or(0, |e| e.count);
    limits.check_count(vertex_count, limits.vertices.min(u64::from(u32::MAX)), "vertices", &file)?;
    let mut body = Body { source, encoding: header.encoding, file_bytes };
    let mut faces = Faces::new(vertex_count as u32, limits.triangles, triangulator);
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => body.vertices(element, sink)?,
            "face" | "tristrips" => body.faces(element, sink, &mut faces)?,
            _ => body.skip(element)?,
        }
    }
    Ok(())
}

/// The data after the header.
struct Body<R> {
    source: Source<R>,
    encoding: Encoding,
    file_bytes: u64,
}

impl<R: Read> Body<R> {
    fn vertices(&mut self, element: &Element, sink: &mut dyn MeshSink) -> Result<(), Stopped> {
        let mut vertices = Vertices::plan(element, self.source.file())?;
        sink.expect_vertices(self.plausible_rows(element));
        match self.encoding {
            Encoding::Ascii => ascii::read_vertices(&mut self.source, element, &mut vertices, sink),
            Encoding::Binary(order) => {
                binary::read_vertices(&mut self.source, element, order, &mut vertices, sink)
            }
        }
    }

    fn faces(
        &mut self,
        element: &Element,
        sink: &mut dyn MeshSink,
        faces: &mut Faces<'_>,
    ) -> Result<(), Stopped> {
        let Some(list) = element.index_list() else { return Ok(self.skip(element)?) };
        sink.expect_triangles(self.plausible_rows(element));
        faces.strips = element.name == "tristrips";
        let (mut row, mut failed) = (0, None);
        let mut take = |corners: &[i64]| {
            row += 1;
            faces.push(corners, sink).map_err(|refusal| match refusal {
                Refusal::File(what) => format!("{} {}: {what}", element.name, row - 1),
                Refusal::Sink(error) => failed.insert(error).what.clone(),
            })
        };
        let read = match self.encoding {
            Encoding::Ascii => ascii::read_lists(&mut self.source, element, list, &mut take),
            Encoding::Binary(order) => binary::read_lists(&mut self.source, element, order, list, &mut take),
        };
        match (failed, read) {
            (Some(error), _) => Err(error.into()),
            (None, read) => {
                read?;
                Ok(faces.flush(sink)?)
            }
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

/// Triangles of a block.
const BLOCK_TRIANGLES: usize = 1 << 14;

/// Triangles as they grow.
struct Faces<'a> {
    /// Those that the sink does not have yet.
    triangles: Vec<[u32; 3]>,
    /// How many the sink has.
    given: u64,
    vertex_count: u32,
    limit: u64,
    strips: bool,
    triangulator: &'a mut Triangulator,
    corners: Vec<Vec3>,
}

/// Why a polygon is not taken.
enum Refusal {
    /// The file is wrong.
    File(String),
    /// The sink has no room.
    Sink(SceneError),
}

impl From<String> for Refusal {
    fn from(what: String) -> Self {
        Self::File(what)
    }
}

impl From<SceneError> for Refusal {
    fn from(error: SceneError) -> Self {
        Self::Sink(error)
    }
}

impl<'a> Faces<'a> {
    fn new(vertex_count: u32, limit: u64, triangulator: &'a mut Triangulator) -> Self {
        Self {
            triangles: Vec::new(),
            given: 0,
            vertex_count,
            limit: limit.min(u64::from(u32::MAX)),
            strips: false,
            triangulator,
            corners: Vec::new(),
        }
    }

    /// Adds a polygon, or a triangle strip with -1 between its pieces.
    #[inline]
    fn push(&mut self, corners: &[i64], sink: &mut dyn MeshSink) -> Result<(), Refusal> {
        if self.strips {
            self.push_strips(corners, sink)?;
        } else {
            for &corner in corners {
                self.check(corner)?;
            }
            if let &[a, b, c] = corners {
                self.triangles.push([a as u32, b as u32, c as u32]);
            } else {
                self.push_polygon(corners, sink)?;
            }
            self.check_limit()?;
        }
        if self.triangles.len() >= BLOCK_TRIANGLES { Ok(self.flush(sink)?) } else { Ok(()) }
    }

    /// Gives the sink what it does not have yet.
    fn flush(&mut self, sink: &mut dyn MeshSink) -> Result<(), SceneError> {
        sink.triangles(&self.triangles)?;
        self.given += self.triangles.len() as u64;
        self.triangles.clear();
        Ok(())
    }

    fn push_polygon(&mut self, corners: &[i64], sink: &mut dyn MeshSink) -> Result<(), SceneError> {
        // Where faces stand before vertices there is nothing to measure: a fan.
        self.corners.clear();
        for &corner in corners {
            self.corners.push(sink.position(corner as u32)?);
        }
        let triangles = &mut self.triangles;
        self.triangulator
            .triangulate(&self.corners, |t| triangles.push(t.map(|i| corners[i as usize] as u32)));
        Ok(())
    }

    fn push_strips(&mut self, strips: &[i64], sink: &mut dyn MeshSink) -> Result<(), Refusal> {
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
                // A file often has one list of all strips.
                if self.triangles.len() >= BLOCK_TRIANGLES {
                    self.check_limit()?;
                    self.flush(sink)?;
                }
            }
        }
        Ok(self.check_limit()?)
    }

    #[inline]
    fn check(&self, corner: i64) -> Result<(), String> {
        if (0..i64::from(self.vertex_count)).contains(&corner) {
            return Ok(());
        }
        Err(format!("vertex {corner} does not exist, there are {}", self.vertex_count))
    }

    fn check_limit(&self) -> Result<(), String> {
        if self.given + self.triangles.len() as u64 <= self.limit {
            return Ok(());
        }
        Err(format!("more triangles than the limit of {}", self.limit))
    }
}

#[cfg(test)]
mod tests;
