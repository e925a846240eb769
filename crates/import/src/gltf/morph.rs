//! Morph targets: displacements of vertex attributes, added with weights at load and, where these move, at each moment.

use super::accessor::{Data, Fault};
use super::json::Json;
use super::primitive::Surface;
use serde::{Deserialize, Serialize};
use vastlight_math::{Vec2, Vec3, Vec4};

/// The weights that a still picture shows: the node's, else the mesh's, else none.
pub(super) fn weights(mesh: &Json<'_>, node: &Json<'_>) -> Vec<f32> {
    let own = [node, mesh].into_iter().map(|json| json.list("weights")).find(|list| !list.is_empty());
    let weights: Vec<f32> = own.unwrap_or(&[]).iter().map(|w| w.number().unwrap_or(0.0) as f32).collect();
    if weights.iter().all(|&w| w == 0.0) { Vec::new() } else { weights }
}

/// Adds the weighted displacements of a primitive's targets.
pub(super) fn apply(
    surface: &mut Surface,
    primitive: &Json<'_>,
    weights: &[f32],
    data: &Data,
    selection: Option<&[u32]>,
) -> Result<(), Fault> {
    for (target, &weight) in primitive.list("targets").iter().zip(weights).filter(|(_, w)| **w != 0.0) {
        Target::read(target, data, selection)?.add(surface, weight);
        for (set, uvs) in surface.uvs.iter_mut().enumerate() {
            let deltas = target
                .index(&format!("TEXCOORD_{set}"))
                .map(|i| data.floats_of::<2>(i, 0.0, selection))
                .transpose()?;
            add(uvs, deltas.as_deref(), |d| Vec2::from(d) * weight);
        }
        let colors = target.index("COLOR_0").map(|i| data.floats_of::<4>(i, 0.0, selection)).transpose()?;
        add(&mut surface.colors, colors.as_deref(), |d| Vec4::from(d) * weight);
    }
    surface.colors.iter_mut().for_each(|c| *c = c.clamp(Vec4::ZERO, Vec4::ONE));
    Ok(())
}

/// Displacements of what poses a vertex.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Target {
    positions: Option<Vec<[f32; 3]>>,
    normals: Option<Vec<[f32; 3]>>,
    tangents: Option<Vec<[f32; 3]>>,
}

impl Target {
    /// Reads a target of a primitive.
    pub(super) fn read(json: &Json<'_>, data: &Data, selection: Option<&[u32]>) -> Result<Self, Fault> {
        let read = |name: &str| json.index(name).map(|i| data.floats_of::<3>(i, 0.0, selection)).transpose();
        Ok(Self { positions: read("POSITION")?, normals: read("NORMAL")?, tangents: read("TANGENT")? })
    }

    /// Adds the displacements to a surface.
    pub(super) fn add(&self, surface: &mut Surface, weight: f32) {
        add(&mut surface.positions, self.positions.as_deref(), |d| Vec3::from(d) * weight);
        add(&mut surface.normals, self.normals.as_deref(), |d| Vec3::from(d) * weight);
        add(&mut surface.tangents, self.tangents.as_deref(), |d| Vec3::from(d).extend(0.0) * weight);
    }
}

fn add<V: Copy + std::ops::AddAssign, D: Copy>(
    values: &mut [V],
    deltas: Option<&[D]>,
    convert: impl Fn(D) -> V,
) {
    for (value, delta) in values.iter_mut().zip(deltas.into_iter().flatten()) {
        *value += convert(*delta);
    }
}
