//! One mesh into a mesh for each object, with a part for each material.

use super::builder::NONE;
use super::parse::{Run, Sections};
use vastlight_scene::{Mesh, Part};

/// Groups become meshes only up to this number ...
const MAX_GROUPS: usize = 256;
/// ... and only if they have at least this many triangles on average.
const MIN_GROUP_TRIANGLES: usize = 64;
/// More objects than this become one mesh.
const MAX_OBJECTS: usize = 1 << 16;

/// Triangles `first..end` of the whole file, and their material.
#[derive(Clone, Copy, Debug)]
struct Piece {
    first: u32,
    end: u32,
    material: u32,
}

/// Splits `whole` into meshes by object or group; `stem` names what has no name.
pub(super) fn into_meshes(whole: Mesh, runs: &[Run], names: &Sections, stem: &str) -> Vec<Mesh> {
    let section = section_of(runs, whole.triangles.len());
    let section_names: &[String] = match runs.first() {
        Some(run) if section(run) == run.object => &names.objects.list,
        _ => &names.groups.list,
    };
    let mut pieces: Vec<Vec<Piece>> = Vec::new();
    let mut slots = vec![usize::MAX; names.objects.list.len().max(names.groups.list.len())];
    let mut order: Vec<u32> = Vec::new();
    let ends = runs.iter().skip(1).map(|r| r.first_triangle).chain([whole.triangles.len() as u32]);
    for (run, end) in runs.iter().zip(ends) {
        let id = section(run);
        let slot = &mut slots[id as usize];
        if *slot == usize::MAX {
            *slot = pieces.len();
            pieces.push(Vec::new());
            order.push(id);
        }
        pieces[*slot].push(Piece { first: run.first_triangle, end, material: run.material });
    }
    let named = |id: u32| match section_names.get(id as usize) {
        Some(name) if !name.is_empty() => name.clone(),
        _ => stem.to_owned(),
    };
    finish(whole, pieces, order.into_iter().map(named), stem)
}

/// Which number of a run decides: the object, the group, or nothing.
fn section_of(runs: &[Run], triangles: usize) -> fn(&Run) -> u32 {
    let distinct = |f: fn(&Run) -> u32| {
        let mut ids: Vec<u32> = runs.iter().map(f).collect();
        ids.sort_unstable();
        ids.dedup();
        ids.len()
    };
    let by_object: fn(&Run) -> u32 = |r| r.object;
    let by_group: fn(&Run) -> u32 = |r| r.group;
    let has_objects = runs.iter().any(|r| r.object != 0);
    let groups = distinct(by_group);
    if has_objects && distinct(by_object) <= MAX_OBJECTS {
        by_object
    } else if !has_objects && groups <= MAX_GROUPS && groups * MIN_GROUP_TRIANGLES <= triangles {
        by_group
    } else {
        |_| 0
    }
}

fn finish(
    mut whole: Mesh,
    mut pieces: Vec<Vec<Piece>>,
    names: impl Iterator<Item = String>,
    stem: &str,
) -> Vec<Mesh> {
    // Stable: within a material, triangles stay in the file's order.
    pieces.iter_mut().for_each(|p| p.sort_by_key(|piece| piece.material));
    match pieces.as_slice() {
        [] => {
            whole.name = stem.to_owned();
            vec![whole]
        }
        [only] => {
            whole.name = names.last().unwrap_or_default();
            whole.triangles = gather(&whole, only);
            whole.parts = parts(only);
            vec![whole]
        }
        _ => {
            let mut remap = vec![NONE; whole.positions.len()];
            pieces.iter().zip(names).map(|(p, name)| extract(&whole, p, name, &mut remap)).collect()
        }
    }
}

fn gather(whole: &Mesh, pieces: &[Piece]) -> Vec<[u32; 3]> {
    pieces.iter().flat_map(|p| &whole.triangles[p.first as usize..p.end as usize]).copied().collect()
}

fn parts(pieces: &[Piece]) -> Vec<Part> {
    let (mut parts, mut count) = (Vec::<Part>::new(), 0);
    for piece in pieces {
        if parts.last().is_none_or(|last| last.material != piece.material) {
            parts.push(Part { first_triangle: count, material: piece.material });
        }
        count += piece.end - piece.first;
    }
    parts
}

/// A mesh of some pieces with its own vertices. `remap` holds [`NONE`] everywhere, before and after.
fn extract(whole: &Mesh, pieces: &[Piece], name: String, remap: &mut [u32]) -> Mesh {
    let mut used: Vec<u32> = Vec::new();
    let mut triangles = gather(whole, pieces);
    for index in triangles.as_flattened_mut() {
        let slot = &mut remap[*index as usize];
        if *slot == NONE {
            *slot = used.len() as u32;
            used.push(*index);
        }
        *index = *slot;
    }
    used.iter().for_each(|&v| remap[v as usize] = NONE);
    Mesh {
        name,
        triangles,
        positions: pick(&whole.positions, &used),
        normals: pick(&whole.normals, &used),
        tangents: Vec::new(),
        uvs: whole.uvs.iter().map(|set| pick(set, &used)).collect(),
        colors: pick(&whole.colors, &used),
        parts: parts(pieces),
        implicit: None,
    }
}

fn pick<T: Copy>(values: &[T], used: &[u32]) -> Vec<T> {
    if values.is_empty() { Vec::new() } else { used.iter().map(|&v| values[v as usize]).collect() }
}
