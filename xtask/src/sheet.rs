//! Renders every model of a collection as a thumbnail, and one overview to look at.
//!
//! The collection is a folder with `LICENSES.tsv` (path, bytes, licence, source, note); it is not part of the project.
//! Thumbnails go to docs/gallery/models, the overview and the failures to target/sheet.

use crate::gallery::keep;
use crate::process::{cargo, root, step};
use image::{RgbImage, imageops};
use std::path::{Path, PathBuf};
use std::process::Command;

const WIDTH: u32 = 192;
const HEIGHT: u32 = 144;
const COLUMNS: u32 = 8;
const FOLDERS: [&str; 5] = ["gltf", "furniture", "mesh", "cad", "scene"];
const EXTENSIONS: [&str; 5] = ["gltf", "glb", "obj", "ply", "stl"];

/// Renders all models below the folder that is the command's first argument.
pub(crate) fn run() -> Result<(), String> {
    let folder = std::env::args().nth(2).ok_or("usage: cargo xtask sheet MODELS_FOLDER")?;
    step("build", &mut cargo(&["build", "--quiet", "--release"], &[]))?;
    let thumbnails = root().join("docs/gallery/models");
    let scratch = root().join("target/sheet");
    for made in [&thumbnails, &scratch] {
        std::fs::create_dir_all(made).map_err(|e| format!("{}: {e}", made.display()))?;
    }
    let mut pictures = Vec::new();
    for model in FOLDERS.iter().flat_map(|f| models_below(&Path::new(&folder).join(f))) {
        match render(&model, &scratch) {
            Ok(picture) => {
                keep(&picture, &thumbnails.join(format!("{}.jpg", stem(&model))))?;
                pictures.push(picture);
            }
            Err(message) => eprintln!("{message}"),
        }
    }
    let overview = scratch.join("overview.png");
    overview_of(&pictures).save(&overview).map_err(|e| format!("{}: {e}", overview.display()))?;
    eprintln!("{} pictures; all of them in {}", pictures.len(), overview.display());
    Ok(())
}

/// Scene files below a folder, in order of their paths.
fn models_below(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    paths.sort();
    let is_model = |p: &PathBuf| p.extension().is_some_and(|e| EXTENSIONS.iter().any(|x| e == *x));
    paths
        .iter()
        .flat_map(|p| if p.is_dir() { models_below(p) } else { vec![p.clone()] })
        .filter(is_model)
        .collect()
}

fn stem(model: &Path) -> String {
    model.file_stem().unwrap_or_default().to_string_lossy().replace(' ', "_")
}

fn render(model: &Path, scratch: &Path) -> Result<PathBuf, String> {
    let target = scratch.join(format!("{}.png", stem(model)));
    let output = Command::new(root().join("target/release/vastlight"))
        .args(["render".as_ref(), model.as_os_str(), "-o".as_ref(), target.as_os_str()])
        .args(["-r", &format!("{WIDTH}x{HEIGHT}"), "--spp", "128", "-q"])
        .output()
        .map_err(|e| format!("{}: {e}", model.display()))?;
    if !output.status.success() {
        return Err(format!(
            "{}: {} {}",
            model.display(),
            output.status,
            String::from_utf8_lossy(&output.stderr)
        ));
    }
    Ok(target)
}

fn overview_of(pictures: &[PathBuf]) -> RgbImage {
    let rows = (pictures.len() as u32).div_ceil(COLUMNS).max(1);
    let mut sheet = RgbImage::new(COLUMNS * WIDTH, rows * HEIGHT);
    for (i, picture) in (0_u32..).zip(pictures) {
        let Ok(picture) = image::open(picture) else { continue };
        let (x, y) = (i % COLUMNS * WIDTH, i / COLUMNS * HEIGHT);
        imageops::replace(&mut sheet, &picture.to_rgb8(), i64::from(x), i64::from(y));
    }
    sheet
}
