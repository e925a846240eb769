//! From facets to blocks of vertices and triangles.

use super::weld::Welder;
use crate::Limits;
use crate::single::Stopped;
use vastlight_math::{Vec3, Vec4};
use vastlight_scene::{Mesh, MeshSink};

/// Triangles of a block.
const BLOCK_TRIANGLES: usize = 1 << 14;

/// Takes facets, and gives a sink what they make.
pub(super) struct Facets<'a> {
    welder: Welder,
    /// Those that the sink does not have yet.
    triangles: Vec<[u32; 3]>,
    /// How many the sink has.
    given: u64,
    /// The colour of a tag; none where nothing has a colour.
    color: Option<&'a dyn Fn(u16) -> Vec4>,
    limits: &'a Limits,
    /// For messages.
    file: String,
    sink: &'a mut dyn MeshSink,
}

impl<'a> Facets<'a> {
    pub(super) fn new(
        file: &str,
        limits: &'a Limits,
        color: Option<&'a dyn Fn(u16) -> Vec4>,
        sink: &'a mut dyn MeshSink,
    ) -> Self {
        let (welder, triangles) = (Welder::new(), Vec::new());
        Self { welder, triangles, given: 0, color, limits, file: file.to_owned(), sink }
    }

    /// Takes a facet whose corners have a tag.
    #[inline]
    pub(super) fn push(&mut self, corners: [Vec3; 3], tag: u16) -> Result<(), Stopped> {
        self.triangles.push(corners.map(|corner| self.welder.vertex(corner, tag)));
        if self.triangles.len() >= BLOCK_TRIANGLES {
            self.give_triangles()?;
        }
        if self.welder.is_full() { self.give_vertices() } else { Ok(()) }
    }

    /// Gives the sink what it does not have yet.
    pub(super) fn finish(mut self) -> Result<(), Stopped> {
        self.give_triangles()?;
        self.give_vertices()
    }

    fn give_triangles(&mut self) -> Result<(), Stopped> {
        self.given += self.triangles.len() as u64;
        self.limits.check_count(self.given, self.limits.triangles, "triangles", &self.file)?;
        self.sink.triangles(&self.triangles)?;
        self.triangles.clear();
        Ok(())
    }

    fn give_vertices(&mut self) -> Result<(), Stopped> {
        let most = self.limits.vertices.min(u64::from(u32::MAX));
        self.limits.check_count(self.welder.vertices(), most, "vertices", &self.file)?;
        let (positions, tags) = self.welder.take();
        let colors = self.color.map_or_else(Vec::new, |color| tags.iter().map(|&tag| color(tag)).collect());
        Ok(self.sink.vertices(&Mesh { positions, colors, ..Mesh::default() })?)
    }
}
