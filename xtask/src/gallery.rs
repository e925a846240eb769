//! Renders the pictures of docs/gallery again, from the commands that its README lists.

use crate::process::{cargo, root, step};
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame};
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

const PROMPT: &str = "cargo run --release -- render ";
const JPEG_QUALITY: u8 = 90;

/// Runs every `cargo run --release -- render ... -o NAME.png` line of docs/gallery/README.md (or only that of the name
/// which is the command's first argument) and keeps the picture as docs/gallery/NAME.jpg; of `NAME.####.png`, the frames as
/// docs/gallery/NAME.gif, which repeats for ever.
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
        let name = output.trim_end_matches(".png").trim_end_matches(['#', '.']).to_owned();
        if only.as_ref().is_some_and(|only| *only != name) {
            continue;
        }
        let is_sequence = output.contains('#');
        let folder = scratch.join(&name);
        let picture = if is_sequence { folder.join(&*output) } else { scratch.join(&*output) };
        *output = picture.display().to_string();
        if is_sequence {
            empty(&folder)?;
        }
        render(command, &arguments)?;
        if is_sequence {
            keep_frames(&folder, &gallery.join(format!("{name}.gif")))?;
        } else {
            keep(&picture, &gallery.join(format!("{name}.jpg")))?;
        }
        made += 1;
    }
    if made == 0 { Err(format!("{}: lists no such command", list.display())) } else { Ok(()) }
}

fn render(title: &str, arguments: &[String]) -> Result<(), String> {
    let fixed = ["run", "--quiet", "--release", "--", "render"];
    let all: Vec<&str> = fixed.into_iter().chain(arguments.iter().map(String::as_str)).collect();
    step(title, &mut cargo(&all, &[]))
}

/// A folder with nothing in it.
fn empty(folder: &Path) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(folder).map_err(failed)?;
    }
    std::fs::create_dir_all(folder).map_err(failed)
}

/// How long a frame is shown.
const FRAME: Duration = Duration::from_millis(80);

/// Stores all pictures of a folder, in the order of their names, as one that moves.
fn keep_frames(folder: &Path, target: &Path) -> Result<(), String> {
    let failed = |e: &dyn std::fmt::Display| format!("{}: {e}", target.display());
    let entries = std::fs::read_dir(folder).map_err(|e| failed(&e))?;
    let mut pictures: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    pictures.sort();
    let mut encoder = GifEncoder::new_with_speed(File::create(target).map_err(|e| failed(&e))?, 1);
    encoder.set_repeat(Repeat::Infinite).map_err(|e| failed(&e))?;
    for picture in pictures {
        let pixels = image::open(&picture).map_err(|e| format!("{}: {e}", picture.display()))?.to_rgba8();
        let frame = Frame::from_parts(pixels, 0, 0, Delay::from_saturating_duration(FRAME));
        encoder.encode_frame(frame).map_err(|e| failed(&e))?;
    }
    Ok(())
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
