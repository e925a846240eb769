//! Typed forms of the parts of a document that several files read: accessors, buffer views, and enumerations.

use super::json::Json;

/// Type of one component of an accessor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    /// From `accessor.componentType`.
    pub(super) fn from_code(code: usize) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    /// Size in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The name that the specification uses.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::I8 => "BYTE",
            Self::U8 => "UNSIGNED_BYTE",
            Self::I16 => "SHORT",
            Self::U16 => "UNSIGNED_SHORT",
            Self::U32 => "UNSIGNED_INT",
            Self::F32 => "FLOAT",
        }
    }
}

/// Shape of an accessor's element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

impl Shape {
    /// From `accessor.type`.
    pub(super) fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "SCALAR" => Self::Scalar,
            "VEC2" => Self::Vec2,
            "VEC3" => Self::Vec3,
            "VEC4" => Self::Vec4,
            "MAT2" => Self::Mat2,
            "MAT3" => Self::Mat3,
            "MAT4" => Self::Mat4,
            _ => return None,
        })
    }

    /// The name that the specification uses.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Scalar => "SCALAR",
            Self::Vec2 => "VEC2",
            Self::Vec3 => "VEC3",
            Self::Vec4 => "VEC4",
            Self::Mat2 => "MAT2",
            Self::Mat3 => "MAT3",
            Self::Mat4 => "MAT4",
        }
    }

    /// Rows of a column, and columns; a vector is one column.
    fn rows_columns(self) -> (usize, usize) {
        match self {
            Self::Scalar => (1, 1),
            Self::Vec2 => (2, 1),
            Self::Vec3 => (3, 1),
            Self::Vec4 => (4, 1),
            Self::Mat2 => (2, 2),
            Self::Mat3 => (3, 3),
            Self::Mat4 => (4, 4),
        }
    }

    /// Numbers in an element.
    pub(super) fn components(self) -> usize {
        let (rows, columns) = self.rows_columns();
        rows * columns
    }

    /// Whether an element is a matrix.
    pub(super) fn is_matrix(self) -> bool {
        self.rows_columns().1 > 1
    }
}

/// Where values that replace some of an accessor's elements stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sparse {
    pub(super) count: usize,
    pub(super) index_view: usize,
    pub(super) index_offset: usize,
    pub(super) index_component: Component,
    pub(super) value_view: usize,
    pub(super) value_offset: usize,
}

/// `accessors[i]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Accessor {
    pub(super) view: Option<usize>,
    pub(super) offset: usize,
    pub(super) component: Component,
    pub(super) normalized: bool,
    pub(super) count: usize,
    pub(super) shape: Shape,
    pub(super) sparse: Option<Sparse>,
}

impl Accessor {
    /// Reads an accessor; `None` if a required property is missing or of a wrong type.
    pub(super) fn read(json: &Json<'_>) -> Option<Self> {
        let sparse = match json.get("sparse") {
            Some(sparse) => Some(Sparse::read(sparse)?),
            None => None,
        };
        Some(Self {
            view: json.index("bufferView"),
            offset: json.index("byteOffset").unwrap_or(0),
            component: Component::from_code(json.index("componentType")?)?,
            normalized: json.flag("normalized"),
            count: json.index("count")?,
            shape: Shape::from_name(json.at("type").text()?)?,
            sparse,
        })
    }

    /// Bytes from one column to the next: columns of matrices start on multiples of 4.
    pub(super) fn column_stride(&self) -> usize {
        let bytes = self.shape.rows_columns().0 * self.component.size();
        if self.shape.is_matrix() { bytes.next_multiple_of(4) } else { bytes }
    }

    /// Bytes of one element.
    pub(super) fn element_size(&self) -> usize {
        self.column_stride() * self.shape.rows_columns().1
    }

    /// Bytes of one element without the padding of its last column.
    pub(super) fn tight_size(&self) -> usize {
        let (rows, columns) = self.shape.rows_columns();
        self.column_stride() * (columns - 1) + rows * self.component.size()
    }

    /// Byte offset of a component within its element.
    pub(super) fn component_offset(&self, component: usize) -> usize {
        let rows = self.shape.rows_columns().0;
        (component / rows) * self.column_stride() + (component % rows) * self.component.size()
    }

    /// The format in the words of the specification.
    pub(super) fn format(&self) -> String {
        let normalized = if self.normalized { " normalized" } else { "" };
        format!("{} {}{normalized}", self.shape.name(), self.component.name())
    }
}

impl Sparse {
    fn read(json: &Json<'_>) -> Option<Self> {
        let (indices, values) = (json.get("indices")?, json.get("values")?);
        Some(Self {
            count: json.index("count")?,
            index_view: indices.index("bufferView")?,
            index_offset: indices.index("byteOffset").unwrap_or(0),
            index_component: Component::from_code(indices.index("componentType")?)?,
            value_view: values.index("bufferView")?,
            value_offset: values.index("byteOffset").unwrap_or(0),
        })
    }
}

/// `bufferViews[i]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct View {
    pub(super) buffer: usize,
    pub(super) offset: usize,
    pub(super) length: usize,
    pub(super) stride: Option<usize>,
}

impl View {
    /// Reads a buffer view; `None` if a required property is missing or of a wrong type.
    pub(super) fn read(json: &Json<'_>) -> Option<Self> {
        Some(Self {
            buffer: json.index("buffer")?,
            offset: json.index("byteOffset").unwrap_or(0),
            length: json.index("byteLength")?,
            stride: json.index("byteStride"),
        })
    }
}
