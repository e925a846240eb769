//! Renders the pictures of docs/gallery again, from the commands that its README lists.

use crate::process::{cargo, root, step};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use std::path::Path;

const PROMPT: &str = "cargo run --release -- render ";
const JPEG_QUALITY: u8 = 90;

/// Runs every `cargo run --release -- render ... -o NAME.png` line of docs/gallery/README.md (or only that of the name
/// which is the command's first argument) and keeps the picture as docs/gallery/NAME.jpg.
pub(crate) fn run() -> Result<(), String> {
    let gallery = root().join("docs/gallery");
    let scratch = root().join("target/gallery");
    std::fs::create_dir_all(&scratch).map_err(|e| format!("{}: {e}", scratch.display()))?;
    let list = gallery.join("README.md");
    let text = std::fs::read_to_string(&list).map_err(|e| format!("{}: {e}", list.display()))?;
    let only = std::env::args().nth(2);
    let mut made = 0;
    for command in text.lines().filter_map(|line| line.trim().strip_prefix(PROMPT)) {
        let mut arguments: Vec<String> = command.split_whitespace().map(String::from).collect();
        let output = arguments.iter().position(|a| a == "-o").and_then(|i| arguments.get_mut(i + 1));
        let output = output.ok_or_else(|| format!("{command}: has no -o NAME.png"))?;
        let name = output.trim_end_matches(".png").to_owned();
        if only.as_ref().is_some_and(|only| *only != name) {
            continue;
        }
        let picture = scratch.join(&*output);
        *output = picture.display().to_string();
        render(command, &arguments)?;
        keep(&picture, &gallery.join(format!("{name}.jpg")))?;
        made += 1;
    }
    if made == 0 { Err(format!("{}: lists no such command", list.display())) } else { Ok(()) }
}

fn render(title: &str, arguments: &[String]) -> Result<(), String> {
    let fixed = ["run", "--quiet", "--release", "--", "render"];
    let all: Vec<&str> = fixed.into_iter().chain(arguments.iter().map(String::as_str)).collect();
    step(title, &mut cargo(&all, &[]))
}

/// Stores a picture as a small file.
pub(crate) fn keep(picture: &Path, target: &Path) -> Result<(), String> {
    let failed = |e: &dyn std::fmt::Display| format!("{}: {e}", target.display());
    let pixels = image::open(picture).map_err(|e| format!("{}: {e}", picture.display()))?.to_rgb8();
    let sides = [pixels.width(), pixels.height()].map(u16::try_from);
    let [Ok(width), Ok(height)] = sides else { return Err(failed(&"too large a picture")) };
    let mut encoder = Encoder::new_file(target, JPEG_QUALITY).map_err(|e| failed(&e))?;
    encoder.set_sampling_factor(SamplingFactor::F_1_1);
    encoder.encode(&pixels, width, height, ColorType::Rgb).map_err(|e| failed(&e))
}
