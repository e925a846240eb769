//! One primitive of a mesh: its vertex attributes and triangles.

use super::accessor::{Data, Fault};
use super::json::Json;
use super::topology::Mode;
use serde::{Deserialize, Serialize};
use vastlight_math::{Vec2, Vec3, Vec4};

/// Vertices and triangles of one primitive. Attribute arrays are empty or as long as `positions`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
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
}

/// Attributes in accessors.
#[derive(Clone, Copy, Debug)]
pub(super) struct FromAccessors<'a> {
    pub(super) data: &'a Data,
    pub(super) primitive: &'a Json<'a>,
    pub(super) selection: Option<&'a [u32]>,
}

impl Attributes for FromAccessors<'_> {
    fn floats<const N: usize>(&self, semantic: &str, fill: f32) -> Result<Option<Vec<[f32; N]>>, Fault> {
        let accessor = self.primitive.at("attributes").index(semantic);
        accessor.map(|index| self.data.floats_of(index, fill, self.selection)).transpose()
    }

    fn whole<const N: usize>(&self, semantic: &str) -> Result<Option<Vec<[u32; N]>>, Fault> {
        let accessor = self.primitive.at("attributes").index(semantic);
        accessor.map(|index| self.data.whole_of(index, self.selection)).transpose()
    }
}

/// The vertex of each corner, and which vertices these are.
#[derive(Clone, Debug)]
pub(super) struct Corners {
    /// Numbers within the selection, or within all vertices.
    pub(super) vertices: Vec<u32>,
    /// The vertices that are used, ascending, where these are a small part of all.
    pub(super) selection: Option<Vec<u32>>,
}

impl Corners {
    /// From indices into `count` vertices; `None` stands for all vertices in order.
    pub(super) fn new(indices: Option<Vec<u32>>, count: usize, place: &str) -> Result<Self, Fault> {
        let Some(mut vertices) = indices else {
            let count = u32::try_from(count)
                .map_err(|_| Fault::new("there are more than 2^32 vertices", place, ""))?;
            return Ok(Self { vertices: (0..count).collect(), selection: None });
        };
        if let Some(&i) = vertices.iter().max().filter(|&&i| i as usize >= count) {
            let what = format!("vertex index {i} is out of range, there are {count} vertices");
            return Err(Fault::new(what, place, ""));
        }
        if vertices.len() >= count {
            return Ok(Self { vertices, selection: None });
        }
        let mut used = vertices.clone();
        used.sort_unstable();
        used.dedup();
        vertices.iter_mut().for_each(|v| *v = used.partition_point(|u| u < v) as u32);
        Ok(Self { vertices, selection: Some(used) })
    }
}

/// Reads the vertices of a primitive and joins its corners to triangles.
pub(super) fn read(
    attributes: &impl Attributes,
    mode: Mode,
    corners: &[u32],
    place: &str,
) -> Result<Surface, Fault> {
    let mut surface = Surface {
        positions: vectors(attributes.floats::<3>("POSITION", 0.0)?),
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
    surface.triangles = mode.triangles(corners);
    Ok(surface)
}

fn vectors<V: From<[f32; N]>, const N: usize>(values: Option<Vec<[f32; N]>>) -> Vec<V> {
    values.into_iter().flatten().map(V::from).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_corners_select_their_vertices() {
        let corners = Corners::new(Some(vec![7, 3, 7]), 100, "").expect("in range");
        assert_eq!(corners.vertices, [1, 0, 1]);
        assert_eq!(corners.selection, Some(vec![3, 7]));
        let corners = Corners::new(Some(vec![1, 0, 1]), 2, "").expect("in range");
        assert_eq!((corners.vertices, corners.selection), (vec![1, 0, 1], None));
        assert_eq!(Corners::new(None, 2, "").expect("in range").vertices, [0, 1]);
        assert!(Corners::new(Some(vec![2]), 2, "").is_err());
    }
}
