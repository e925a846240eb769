//! A file for each moment: sequences of OBJ and PLY files with the same triangles, between which vertices go straight.

mod files;

pub(crate) use files::Files;

use crate::polygon::Triangulator;
use crate::texels::Deferral;
use crate::{ImportError, Limits, LoadOptions, SceneFormat, detect, obj, ply};
use std::borrow::Cow;
use std::collections::VecDeque;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use vastlight_math::Vec3;
use vastlight_scene::{Mesh, MeshPose, Motion, Pose, SceneDesc, SceneError};

/// Files that are kept: those before and after a moment.
const KEPT: usize = 2;
/// Parts of the time from key to key below which a moment is the key's.
const SAME_KEY: f64 = 1e-3;

/// All files that a path stands for: those of a sequence, or itself.
///
/// # Errors
/// There are no files of the sequence, or one is missing.
pub fn files_of(path: &Path, limits: &Limits) -> Result<Vec<PathBuf>, ImportError> {
    let files = Files::find(path, limits)?;
    Ok(files
        .map_or_else(|| vec![path.to_owned()], |files| (0..files.len()).map(|key| files.key(key)).collect()))
}

/// The first file of a sequence, or the path itself if it names one file.
pub(crate) fn first_file<'p>(path: &'p Path, limits: &Limits) -> Result<Cow<'p, Path>, ImportError> {
    Ok(Files::find(path, limits)?.map_or(Cow::Borrowed(path), |files| Cow::Owned(files.key(0))))
}

/// The scene of the first file, which moves as the others say; and the files that the first one names.
///
/// # Errors
/// The first file cannot be read, or is of another format than OBJ and PLY.
pub(crate) fn load(files: Files, options: &LoadOptions) -> Result<(SceneDesc, Vec<PathBuf>), ImportError> {
    let first = files.key(0);
    let place = first.display().to_string();
    let fps = options.sequence_fps;
    if !(fps.is_finite() && fps > 0.0) {
        let what = format!("{fps} files a second are no number above 0");
        return Err(ImportError::unsupported(what, place));
    }
    let format = detect(&first, &options.limits)?;
    let mut triangulator = Triangulator::first_of_many();
    let (mut desc, named, triangulator) = match format {
        SceneFormat::Obj => obj::read_cut(&first, options, &mut Deferral::never(), triangulator)?,
        SceneFormat::Ply => (ply::load_cut(&first, options, &mut triangulator)?, Vec::new(), triangulator),
        SceneFormat::Gltf | SceneFormat::Stl => {
            let error = ImportError::unsupported("this format has no sequences of files", place);
            return Err(error.with_hint("OBJ and PLY have"));
        }
    };
    let meshes = desc.meshes.iter().map(Topology::of).collect();
    let (options, cuts) = (options.clone(), triangulator.into_cuts());
    desc.motion = Some(Arc::new(Sequence { files, format, options, cuts, meshes, kept: Mutex::default() }));
    Ok((desc, named))
}

/// What meshes of all files have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Topology {
    vertices: usize,
    normals: usize,
    triangles: usize,
    hash_of_triangles: u64,
}

impl Topology {
    fn of(mesh: &Mesh) -> Self {
        let mut hasher = DefaultHasher::new();
        mesh.triangles.hash(&mut hasher);
        Self {
            vertices: mesh.positions.len(),
            normals: mesh.normals.len(),
            triangles: mesh.triangles.len(),
            hash_of_triangles: hasher.finish(),
        }
    }

    /// In which way another mesh differs.
    fn difference(&self, other: &Self) -> Option<String> {
        let counts = [
            ("vertices", self.vertices, other.vertices),
            ("triangles", self.triangles, other.triangles),
            ("normals", self.normals, other.normals),
        ];
        if let Some((what, first, here)) = counts.into_iter().find(|(_, first, here)| first != here) {
            return Some(format!("it has {here} {what}, the first file has {first}"));
        }
        (self != other).then(|| "its triangles have other corners than those of the first file".into())
    }
}

/// Vertices of all meshes of a file.
type Key = Arc<Vec<Mesh>>;

/// Files of the same triangles at even times.
#[derive(Debug)]
struct Sequence {
    files: Files,
    format: SceneFormat,
    options: LoadOptions,
    /// How polygons of the first file are cut into triangles.
    cuts: Arc<[[u32; 3]]>,
    /// Of the first file.
    meshes: Vec<Topology>,
    /// Files that were read last, the newest at the end.
    kept: Mutex<VecDeque<(u64, Key)>>,
}

impl Sequence {
    /// The vertices of a file, read unless they are kept.
    fn key(&self, key: u64) -> Result<Key, SceneError> {
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept().iter().find(|(number, _)| *number == key).map(|(_, meshes)| Arc::clone(meshes));
        if let Some(found) = found {
            return Ok(found);
        }
        // Nothing is locked meanwhile: reading may take part in other work of its thread.
        let meshes = Arc::new(self.read(&self.files.key(key))?);
        let mut kept = kept();
        kept.retain(|(number, _)| *number != key);
        kept.push_back((key, Arc::clone(&meshes)));
        let surplus = kept.len().saturating_sub(KEPT);
        drop(kept.drain(..surplus));
        Ok(meshes)
    }

    fn read(&self, path: &Path) -> Result<Vec<Mesh>, SceneError> {
        let mut triangulator = Triangulator::like(&self.cuts);
        let mut meshes = match self.format {
            SceneFormat::Ply => ply::load_cut(path, &self.options, &mut triangulator)?.meshes,
            _ => obj::read_meshes(path, &self.options, triangulator)?,
        };
        let refuse = |what: String| {
            let what = format!("files of a sequence must have the same triangles: {what}");
            SceneError::new(what, path.display().to_string(), "only vertices may move")
        };
        if meshes.len() != self.meshes.len() {
            let [here, first] = [meshes.len(), self.meshes.len()];
            return Err(refuse(format!("it has {here} meshes, the first file has {first}")));
        }
        for (mesh, first) in meshes.iter_mut().zip(&self.meshes) {
            if let Some(difference) = first.difference(&Topology::of(mesh)) {
                return Err(refuse(difference));
            }
            let (positions, normals) =
                (std::mem::take(&mut mesh.positions), std::mem::take(&mut mesh.normals));
            *mesh = Mesh { positions, normals, ..Mesh::default() };
        }
        Ok(meshes)
    }

    /// The keys before and after a moment, and how far it is from the first to the second.
    fn moment(&self, time: f32) -> (u64, u64, f32) {
        let last = self.files.len() - 1;
        // Also right for no number.
        let position = (f64::from(time) * f64::from(self.options.sequence_fps)).max(0.0).min(last as f64);
        let nearest = position.round();
        if (position - nearest).abs() < SAME_KEY {
            return (nearest as u64, nearest as u64, 0.0);
        }
        let before = position.floor();
        (before as u64, before as u64 + 1, (position - before) as f32)
    }
}

impl Motion for Sequence {
    fn duration(&self) -> f32 {
        ((self.files.len() - 1) as f64 / f64::from(self.options.sequence_fps)) as f32
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let (before, after, part) = self.moment(time);
        let (before, after) =
            (self.key(before)?, if after == before { None } else { Some(self.key(after)?) });
        let pose = |(mesh, start): (usize, &Mesh)| match after.as_ref().and_then(|after| after.get(mesh)) {
            Some(end) => between(mesh, start, end, part),
            None => posed(mesh, start.positions.clone(), start.normals.clone()),
        };
        Ok(Pose { meshes: before.iter().enumerate().map(pose).collect(), ..Pose::default() })
    }
}

/// Vertices a part of the way from `start` to `end`; normals keep unit length.
fn between(mesh: usize, start: &Mesh, end: &Mesh, part: f32) -> MeshPose {
    let normal = |(a, b): (&Vec3, &Vec3)| a.lerp(*b, part).normalize_or(*a);
    posed(
        mesh,
        start.positions.iter().zip(&end.positions).map(|(a, b)| a.lerp(*b, part)).collect(),
        start.normals.iter().zip(&end.normals).map(normal).collect(),
    )
}

fn posed(mesh: usize, positions: Vec<Vec3>, normals: Vec<Vec3>) -> MeshPose {
    MeshPose { mesh: mesh as u32, positions, normals, tangents: Vec::new() }
}

#[cfg(test)]
mod tests;
