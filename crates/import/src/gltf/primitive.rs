//! One primitive of a mesh: its vertex attributes and triangles.

use super::accessor::{Data, Fault};
use super::json::Json;
use super::topology::Mode;
use vastlight_math::{Vec2, Vec3, Vec4};

/// Vertices and triangles of one primitive. Attribute arrays are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    pub(super) tangents: Vec<Vec4>,
    pub(super) uvs: Vec<Vec<Vec2>>,
    pub(super) colors: Vec<Vec4>,
    /// Joints and weights, four at a time.
    pub(super) influences: Vec<Influences>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// `JOINTS_n` and `WEIGHTS_n` of each vertex.
pub(super) type Influences = (Vec<[u32; 4]>, Vec<[f32; 4]>);

/// Where attributes come from: accessors, or a decoder's output of the same shape.
pub(super) trait Attributes {
    /// Values of an attribute, `None` if the primitive does not have it.
    fn floats<const N: usize>(&self, semantic: &str, fill: f32) -> Result<Option<Vec<[f32; N]>>, Fault>;
    /// Whole-number values of an attribute.
    fn whole<const N: usize>(&self, semantic: &str) -> Result<Option<Vec<[u32; N]>>, Fault>;
    /// The vertex of each corner; `None` if the primitive has no indices.
    fn indices(&self) -> Result<Option<Vec<u32>>, Fault>;
}

/// Attributes in accessors.
#[derive(Clone, Copy, Debug)]
pub(super) struct FromAccessors<'a> {
    pub(super) data: &'a Data<'a>,
    pub(super) primitive: &'a Json<'a>,
}

impl Attributes for FromAccessors<'_> {
    fn floats<const N: usize>(&self, semantic: &str, fill: f32) -> Result<Option<Vec<[f32; N]>>, Fault> {
        let accessor = self.primitive.at("attributes").index(semantic);
        accessor.map(|index| self.data.floats(index, fill)).transpose()
    }

    fn whole<const N: usize>(&self, semantic: &str) -> Result<Option<Vec<[u32; N]>>, Fault> {
        let accessor = self.primitive.at("attributes").index(semantic);
        accessor.map(|index| self.data.whole(index)).transpose()
    }

    fn indices(&self) -> Result<Option<Vec<u32>>, Fault> {
        let Some(index) = self.primitive.index("indices") else { return Ok(None) };
        Ok(Some(self.data.whole::<1>(index)?.into_flattened()))
    }
}

/// Reads a primitive that makes triangles.
pub(super) fn read(attributes: &impl Attributes, mode: Mode, place: &str) -> Result<Surface, Fault> {
    let Some(positions) = attributes.floats::<3>("POSITION", 0.0)? else {
        return Ok(Surface::default());
    };
    let mut surface = Surface {
        positions: positions.into_iter().map(Vec3::from).collect(),
        normals: vectors(attributes.floats::<3>("NORMAL", 0.0)?),
        tangents: vectors(attributes.floats::<4>("TANGENT", 1.0)?),
        colors: vectors(attributes.floats::<4>("COLOR_0", 1.0)?),
        ..Surface::default()
    };
    while let Some(uvs) = attributes.floats::<2>(&format!("TEXCOORD_{}", surface.uvs.len()), 0.0)? {
        surface.uvs.push(vectors(Some(uvs)));
    }
    while let Some(joints) = attributes.whole::<4>(&format!("JOINTS_{}", surface.influences.len()))? {
        let weights = attributes.floats::<4>(&format!("WEIGHTS_{}", surface.influences.len()), 0.0)?;
        surface.influences.push((joints, weights.unwrap_or_default()));
    }
    check_lengths(&surface, place)?;
    let corners = match attributes.indices()? {
        Some(indices) => indices,
        None => (0..vertex_count(&surface, place)?).collect(),
    };
    check_indices(&corners, surface.positions.len(), place)?;
    surface.triangles = mode.triangles(&corners);
    Ok(surface)
}

fn vectors<V: From<[f32; N]>, const N: usize>(values: Option<Vec<[f32; N]>>) -> Vec<V> {
    values.into_iter().flatten().map(V::from).collect()
}

fn vertex_count(surface: &Surface, place: &str) -> Result<u32, Fault> {
    u32::try_from(surface.positions.len())
        .map_err(|_| Fault::new("there are more than 2^32 vertices", place, ""))
}

fn check_lengths(surface: &Surface, place: &str) -> Result<(), Fault> {
    let vertices = surface.positions.len();
    let influences = surface.influences.iter().flat_map(|(joints, weights)| [joints.len(), weights.len()]);
    let lengths = [surface.normals.len(), surface.tangents.len(), surface.colors.len()];
    let mut all = lengths.into_iter().chain(surface.uvs.iter().map(Vec::len)).chain(influences);
    match all.find(|&n| n != 0 && n != vertices) {
        Some(n) => Err(Fault::new(format!("an attribute has {n} values for {vertices} vertices"), place, "")),
        None => Ok(()),
    }
}

fn check_indices(corners: &[u32], vertices: usize, place: &str) -> Result<(), Fault> {
    match corners.iter().max() {
        Some(&i) if i as usize >= vertices => {
            let what = format!("vertex index {i} is out of range, there are {vertices} vertices");
            Err(Fault::new(what, place, ""))
        }
        _ => Ok(()),
    }
}
