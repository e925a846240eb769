//! A scene of several files: a list of files and places, as TOML or JSON.
//!
//! ```toml
//! [[place]]
//! file = "house.glb"                 # beside this file
//! translate = [10.0, 0.0, -4.0]      # metres
//! rotate = [0.0, 90.0, 0.0]          # degrees about x, then y, then z
//! scale = 2.0                        # or three numbers
//!
//! [[place]]                          # the same file again: its meshes are shared
//! file = "house.glb"
//! matrix = [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0]]   # rows, instead of the others
//! ```

use crate::Error;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use vastlight_math::glam::{DAffine3, DMat3, DQuat, DVec3, EulerRot};
use vastlight_math::{Affine3, Mat3, Vec3};

/// The parsed file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    place: Vec<Place>,
}

/// A file at a place.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Place {
    file: PathBuf,
    translate: Option<[f64; 3]>,
    rotate: Option<[f64; 3]>,
    scale: Option<Scale>,
    matrix: Option<[[f64; 4]; 3]>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
enum Scale {
    Even(f64),
    ByAxis([f64; 3]),
}

/// Whether a scene's name is that of a manifest: it ends in `.toml`, or in `.manifest.json`.
pub(crate) fn is_manifest(source: &str) -> bool {
    let lower = source.to_ascii_lowercase();
    !lower.starts_with("demo:") && (lower.ends_with(".toml") || lower.ends_with(".manifest.json"))
}

/// The files of a manifest, each once, with all its places.
///
/// # Errors
/// The file cannot be read, or says something else than places of files.
pub(crate) fn read(path: &Path) -> Result<Vec<(PathBuf, Vec<Affine3>)>, Error> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|e| Error::scene(e.to_string(), &name, ""))?;
    let hint = "a manifest is a list of [[place]] with file, translate, rotate, scale or matrix";
    let is_json = name.to_ascii_lowercase().ends_with("json");
    let parsed: Result<Manifest, String> = if is_json {
        serde_json::from_str(&text).map_err(|e| e.to_string())
    } else {
        toml::from_str(&text).map_err(|e| e.message().to_owned())
    };
    let manifest = parsed.map_err(|what| Error::scene(what, &name, hint))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut files: Vec<(PathBuf, Vec<Affine3>)> = Vec::new();
    for place in &manifest.place {
        let transform = place.transform().ok_or_else(|| {
            let what = format!("the place of \"{}\" has a matrix and something else", place.file.display());
            Error::scene(what, &name, "give the matrix alone")
        })?;
        let file = folder.join(&place.file);
        match files.iter_mut().find(|(known, _)| *known == file) {
            Some((_, places)) => places.push(transform),
            None => files.push((file, vec![transform])),
        }
    }
    Ok(files)
}

impl Place {
    /// None where a matrix and its parts are given.
    fn transform(&self) -> Option<Affine3> {
        if let Some([x, y, z]) = self.matrix {
            let alone = self.translate.is_none() && self.rotate.is_none() && self.scale.is_none();
            let column = |i: usize| DVec3::new(x[i], y[i], z[i]);
            let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
            return alone.then(|| single(&DAffine3 { matrix3, translation: column(3) }));
        }
        let [x, y, z] = self.rotate.unwrap_or_default().map(f64::to_radians);
        let scale = match self.scale {
            None => DVec3::ONE,
            Some(Scale::Even(scale)) => DVec3::splat(scale),
            Some(Scale::ByAxis(scale)) => scale.into(),
        };
        let rotation = DQuat::from_euler(EulerRot::ZYX, z, y, x);
        let translation = self.translate.unwrap_or_default().into();
        Some(single(&DAffine3::from_scale_rotation_translation(scale, rotation, translation)))
    }
}

fn single(map: &DAffine3) -> Affine3 {
    let column = |v: DVec3| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
    let DMat3 { x_axis, y_axis, z_axis } = map.matrix3;
    let matrix3 = Mat3::from_cols(column(x_axis), column(y_axis), column(z_axis));
    Affine3 { matrix3, translation: column(map.translation) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(name: &str, text: &str) -> Result<Vec<(PathBuf, Vec<Affine3>)>, Error> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("writes");
        let files = read(&path)?;
        let strip = |file: PathBuf| file.strip_prefix(folder.path()).expect("beside").to_owned();
        Ok(files.into_iter().map(|(file, places)| (strip(file), places)).collect())
    }

    #[test]
    fn files_are_gathered_with_their_places() {
        let text = "[[place]]\nfile = 'a.ply'\n[[place]]\nfile = 'b/c.glb'\nscale = 2.0\ntranslate = [1, 2, 3]\n\
            [[place]]\nfile = 'a.ply'\nrotate = [90, 90, 0]\n\
            [[place]]\nfile = 'a.ply'\nmatrix = [[1, 0, 0, 5], [0, 2, 0, 6], [0, 0, 3, 7]]";
        let found = places("city.manifest.toml", text).expect("reads");
        assert_eq!(found.len(), 2);
        let (a, b) = (&found[0], &found[1]);
        assert_eq!(
            (a.0.as_path(), a.1.len(), b.0.as_path(), b.1.len()),
            (Path::new("a.ply"), 3, Path::new("b/c.glb"), 1)
        );
        let p = Vec3::new(1.0, 10.0, 100.0);
        assert_eq!(a.1[0].transform_point3(p), p);
        assert_eq!(b.1[0].transform_point3(p), Vec3::new(3.0, 22.0, 203.0));
        // About x first: y becomes z; then about y: z becomes x.
        assert!((a.1[1].transform_point3(Vec3::Y) - Vec3::X).length() < 1e-6);
        assert_eq!(a.1[2].transform_point3(p), Vec3::new(6.0, 26.0, 307.0));
        let json = r#"{"place": [{"file": "a.ply", "scale": [1, 2, 3]}]}"#;
        let found = places("city.manifest.json", json).expect("reads");
        assert_eq!(found[0].1[0].transform_point3(Vec3::ONE), Vec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn what_is_not_understood_is_an_error() {
        let wrong = [
            "[[place]]\nfle = 'a'",
            "place = 3",
            "[[place]]\nfile = 'a'\nscale = 1\nmatrix = [[1,0,0,0],[0,1,0,0],[0,0,1,0]]",
        ];
        for text in wrong {
            assert!(places("x.toml", text).is_err(), "{text}");
        }
        assert!(is_manifest("x/city.toml") && is_manifest("c.manifest.json"));
        assert!(!is_manifest("scene.json") && !is_manifest("demo:x.toml"));
    }
}
