//! What a triangle's corners have, wherever it is: in a mesh in memory, or in pages.

use vastlight_math::{Vec2, Vec3, Vec4};
use vastlight_scene::Mesh;
use vastlight_store::AttributeLayout;
use vastlight_trace::Hit;

/// The corners of a triangle in its mesh's space. What the mesh has not is `None`.
pub(crate) trait Corners {
    fn points(&self) -> [Vec3; 3];
    fn normals(&self) -> Option<[Vec3; 3]>;
    fn tangents(&self) -> Option<[Vec4; 3]>;
    fn colors(&self) -> Option<[Vec4; 3]>;
    fn uvs(&self, set: usize) -> Option<[Vec2; 3]>;
}

/// Corners in a mesh.
pub(crate) struct MeshCorners<'m> {
    mesh: &'m Mesh,
    index: [usize; 3],
}

impl<'m> MeshCorners<'m> {
    /// The corners of the hit triangle. A mesh without triangles has none of all that corners have: then only points must not be
    /// asked for.
    #[inline(always)]
    pub(crate) fn new(mesh: &'m Mesh, hit: &Hit) -> Self {
        let corners = mesh.triangles.get(hit.prim as usize).copied().unwrap_or_default();
        Self { mesh, index: corners.map(|i| i as usize) }
    }

    /// Which vertices they are.
    pub(crate) fn index(&self) -> [usize; 3] {
        self.index
    }

    #[inline(always)]
    fn of<T: Copy>(&self, values: &[T]) -> Option<[T; 3]> {
        (!values.is_empty()).then(|| self.index.map(|i| values[i]))
    }
}

impl Corners for MeshCorners<'_> {
    #[inline(always)]
    fn points(&self) -> [Vec3; 3] {
        self.index.map(|i| self.mesh.positions[i])
    }

    #[inline(always)]
    fn normals(&self) -> Option<[Vec3; 3]> {
        self.of(&self.mesh.normals)
    }

    #[inline(always)]
    fn tangents(&self) -> Option<[Vec4; 3]> {
        self.of(&self.mesh.tangents)
    }

    #[inline(always)]
    fn colors(&self) -> Option<[Vec4; 3]> {
        self.of(&self.mesh.colors)
    }

    #[inline(always)]
    fn uvs(&self, set: usize) -> Option<[Vec2; 3]> {
        self.of(self.mesh.uvs.get(set)?)
    }
}

/// Corners wherever they are.
pub(crate) enum HitCorners<'a> {
    Mesh(MeshCorners<'a>),
    Page(PageCorners<'a>),
}

impl<'a> HitCorners<'a> {
    /// Those in a page, or where there is none those in the mesh.
    pub(crate) fn new(page: Option<PageCorners<'a>>, mesh: &'a Mesh, hit: &Hit) -> Self {
        page.map_or_else(|| Self::Mesh(MeshCorners::new(mesh, hit)), Self::Page)
    }

    /// Those in a page.
    pub(crate) fn page(self) -> Option<PageCorners<'a>> {
        if let Self::Page(corners) = self { Some(corners) } else { None }
    }
}

impl Corners for HitCorners<'_> {
    fn points(&self) -> [Vec3; 3] {
        match self {
            Self::Mesh(corners) => corners.points(),
            Self::Page(corners) => corners.points(),
        }
    }

    fn normals(&self) -> Option<[Vec3; 3]> {
        match self {
            Self::Mesh(corners) => corners.normals(),
            Self::Page(corners) => corners.normals(),
        }
    }

    fn tangents(&self) -> Option<[Vec4; 3]> {
        match self {
            Self::Mesh(corners) => corners.tangents(),
            Self::Page(corners) => corners.tangents(),
        }
    }

    fn colors(&self) -> Option<[Vec4; 3]> {
        match self {
            Self::Mesh(corners) => corners.colors(),
            Self::Page(corners) => corners.colors(),
        }
    }

    fn uvs(&self, set: usize) -> Option<[Vec2; 3]> {
        match self {
            Self::Mesh(corners) => corners.uvs(set),
            Self::Page(corners) => corners.uvs(set),
        }
    }
}

/// Corners that were found in pages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PageCorners<'r> {
    pub(crate) points: [Vec3; 3],
    pub(crate) layout: AttributeLayout,
    /// Three records of the layout.
    pub(crate) records: &'r [f32],
}

impl PageCorners<'_> {
    /// The three values that stand at `at` in the records.
    #[inline]
    fn of<const N: usize, T>(&self, at: usize, value: impl Fn([f32; N]) -> T) -> [T; 3] {
        let floats = self.layout.floats();
        [0, 1, 2].map(|corner| value(std::array::from_fn(|i| self.records[corner * floats + at + i])))
    }
}

impl Corners for PageCorners<'_> {
    #[inline]
    fn points(&self) -> [Vec3; 3] {
        self.points
    }

    #[inline]
    fn normals(&self) -> Option<[Vec3; 3]> {
        Some(self.of(self.layout.normals()?, Vec3::from_array))
    }

    #[inline]
    fn tangents(&self) -> Option<[Vec4; 3]> {
        Some(self.of(self.layout.tangents()?, Vec4::from_array))
    }

    #[inline]
    fn colors(&self) -> Option<[Vec4; 3]> {
        Some(self.of(self.layout.colors()?, Vec4::from_array))
    }

    #[inline]
    fn uvs(&self, set: usize) -> Option<[Vec2; 3]> {
        Some(self.of(self.layout.uvs(set)?, Vec2::from_array))
    }
}
