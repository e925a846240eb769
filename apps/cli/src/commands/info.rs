//! `vastlight info SCENE`: what is in it, what it needs, what was ignored.

use crate::arguments::{Common, SceneArguments};
use crate::exit::Exit;
use crate::findings;
use crate::output::print;
use clap::Args;
use serde_json::json;
use vastlight::scene::{Camera, Environment, Projection, Scene};
use vastlight::store::SourceFile;
use vastlight::{
    Error, MemoryEstimate, OpenScene, SceneCounts, StoredMemory, default_budget_bytes, human_bytes,
    stored_memory,
};

/// Show what is in a scene, how much memory it needs, and what was ignored
#[derive(Args, Debug)]
pub(crate) struct Info {
    #[command(flatten)]
    scene: SceneArguments,
    /// One JSON object
    #[arg(long)]
    json: bool,
}

/// Pixels of the picture that the memory estimate is for.
const PIXELS: u64 = 1920 * 1080;

/// What pictures need.
enum Memory {
    Whole(MemoryEstimate),
    Stored(StoredMemory),
}

pub(crate) fn run(arguments: &Info, common: &Common) -> Result<Exit, Error> {
    let open = arguments.scene.open(common)?;
    let memory = match stored_memory(&open, PIXELS)? {
        Some(stored) => Memory::Stored(stored),
        None => Memory::Whole(MemoryEstimate::new(&open.scene, PIXELS, &[], rayon::current_num_threads())),
    };
    let OpenScene { scene, stored } = open;
    let sources = stored.map(|stored| stored.sources).unwrap_or_default();
    let text = if arguments.json {
        let mut value = as_json(&arguments.scene.shown(), &scene, &memory);
        value["sources"] = json!(sources.iter().map(source_json).collect::<Vec<_>>());
        format!("{value}\n")
    } else {
        let text = as_text(&arguments.scene.shown(), &scene, &memory, common);
        sources.iter().fold(text, |text, source| text + &source_line(source))
    };
    print(text.as_bytes())?;
    Ok(Exit::Done)
}

fn source_json(source: &SourceFile) -> serde_json::Value {
    json!({
        "name": source.name, "bytes": source.bytes, "modified_ns": source.modified_ns,
        "changed": source.has_changed(),
    })
}

fn source_line(source: &SourceFile) -> String {
    let size = if source.bytes > 0 { format!(", {}", human_bytes(source.bytes)) } else { String::new() };
    let changed = if source.has_changed() { "; changed since" } else { "" };
    format!("  packed from  {}{size}{changed}\n", source.name)
}

fn as_json(name: &str, scene: &Scene, memory: &Memory) -> serde_json::Value {
    let bounds = scene.bounds();
    let bounds = (!bounds.is_empty()).then(|| [bounds.min.to_array(), bounds.max.to_array()]);
    json!({
        "scene": name,
        "counts": SceneCounts::new(scene),
        "bounds": bounds,
        "environment": environment(scene),
        "cameras": scene.cameras().iter().map(|c| &c.name).collect::<Vec<_>>(),
        "materials": scene.materials().iter().map(|m| &m.name).collect::<Vec<_>>(),
        "lights": scene.lights().iter().map(|l| &l.name).collect::<Vec<_>>(),
        "memory_bytes": match memory {
            Memory::Whole(whole) => json!({
                "scene": whole.scene, "structure": whole.structure, "film_1080p": whole.film, "total": whole.total(),
            }),
            Memory::Stored(stored) => json!({"least": stored.least, "all_pages": stored.all_pages}),
        },
        "findings": scene.diagnostics().items().iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}

fn as_text(name: &str, scene: &Scene, memory: &Memory, common: &Common) -> String {
    let counts = SceneCounts::new(scene);
    let mut lines = vec![
        name.to_owned(),
        format!(
            "  triangles    {} ({} with all instances)",
            grouped(counts.unique_triangles),
            grouped(counts.instanced_triangles)
        ),
        format!("  meshes       {}, instances {}", counts.meshes, counts.instances),
        format!(
            "  materials    {}, textures {}, images {}",
            counts.materials,
            counts.textures,
            scene.images().len()
        ),
        format!("  lights       {}; environment: {}", counts.lights, environment(scene)),
        format!("  emitters     {} materials", scene.materials().iter().filter(|m| m.is_emissive()).count()),
    ];
    lines.push(if scene.bounds().is_empty() {
        "  bounds       empty".into()
    } else {
        let size = scene.bounds().size();
        format!(
            "  bounds       {} to {}, size {:.4} x {:.4} x {:.4}",
            scene.bounds().min,
            scene.bounds().max,
            size.x,
            size.y,
            size.z
        )
    });
    lines.extend(scene.cameras().iter().map(|c| format!("  camera       {}", camera(c))));
    lines.push(memory_line(memory, common));
    let kinds = findings::by_kind(scene.diagnostics().items());
    lines.extend(kinds.iter().map(|line| format!("  warning      {line}")));
    lines.join("\n") + "\n"
}

fn memory_line(memory: &Memory, common: &Common) -> String {
    let budget = common.memory.or_else(default_budget_bytes).map_or("unknown".into(), human_bytes);
    match memory {
        Memory::Whole(whole) => format!(
            "  memory       about {} for 1920 x 1080 (scene {}, structure {}, film {}); budget {budget}",
            human_bytes(whole.total()),
            human_bytes(whole.scene),
            human_bytes(whole.structure),
            human_bytes(whole.film),
        ),
        Memory::Stored(stored) => format!(
            "  memory       at least {} for 1920 x 1080, {} more for all pages; budget {budget}",
            human_bytes(stored.least),
            human_bytes(stored.all_pages),
        ),
    }
}

fn environment(scene: &Scene) -> String {
    match scene.environment() {
        Environment::Constant(color) if color.max_element() <= 0.0 => "none".into(),
        Environment::Constant(color) => format!("constant {color}"),
        Environment::Map { image, .. } => {
            let image = scene.images().get(*image as usize);
            image.map_or("map".into(), |i| format!("map {} ({} x {})", i.name, i.width, i.height))
        }
        Environment::Sky(sky) => format!(
            "sky, sun at azimuth {:.0} and elevation {:.0} degrees",
            sky.sun_azimuth.to_degrees(),
            sky.sun_elevation.to_degrees()
        ),
    }
}

fn camera(camera: &Camera) -> String {
    let eye = camera.world_from_camera.translation;
    let kind = match camera.projection {
        Projection::Perspective { vertical_fov, lens_radius, .. } => {
            let lens = if lens_radius > 0.0 { format!(", lens radius {lens_radius}") } else { String::new() };
            format!("perspective {:.1} degrees{lens}", vertical_fov.to_degrees())
        }
        Projection::Orthographic { half_height } => format!("orthographic, height {}", 2.0 * half_height),
    };
    format!("{} ({kind}, at {eye})", camera.name)
}

/// `1234567` as `1 234 567`.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(digit);
    }
    out
}
