//! The command line.

use crate::commands::{
    bench, completions, devices, diff, generate, info, man, merge, pack, render, validate, view,
};
use clap::{Args, CommandFactory, Parser, Subcommand};
use vastlight::gpu::{DeviceChoice, Executor};
use vastlight::{Device, DeviceRequest, Error, ErrorClass, LookChoice, SceneChoice, parse_bytes};

/// A path tracer for scenes of any size
///
/// SCENE is a glTF/GLB, OBJ, PLY or STL file, a store (.vls), or demo:NAME. Progress and messages go to stderr, results to stdout.
///
/// Exit codes: 0 done (also at the time limit), 1 pictures differ (diff --tolerance), 2 usage, 3 scene or input, 4 memory budget, 5 device or denoiser, 6 output, 7
/// non-finite samples under --strict, 130 interrupted.
#[derive(Parser, Debug)]
#[command(name = "vastlight", version, propagate_version = true)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) common: Common,
    #[command(subcommand)]
    pub(crate) command: Command,
}

impl Cli {
    /// All commands as they are written about.
    pub(crate) fn described() -> clap::Command {
        let mut root = Self::command().disable_help_subcommand(true);
        root.build();
        root
    }
}

#[derive(Subcommand, Debug)]
pub(crate) enum Command {
    /// Render a picture of a scene
    #[command(visible_alias = "r")]
    Render(Box<render::Render>),
    #[command(visible_alias = "v")]
    View(Box<view::View>),
    Info(info::Info),
    Validate(validate::Validate),
    Generate(generate::Generate),
    Pack(pack::Pack),
    Merge(merge::Merge),
    Diff(diff::Diff),
    Devices(devices::Devices),
    Bench(bench::Bench),
    Completions(completions::Completions),
    Man(man::ManPages),
}

/// Flags of every command.
#[derive(Args, Debug)]
#[command(next_help_heading = "Common options")]
pub(crate) struct Common {
    /// Threads; the picture does not depend on it [default: all processors]
    #[arg(short, long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
    /// Memory budget, such as 8GiB: the largest resident set of the process. Work that needs more is refused before it
    /// starts; scenes larger than the budget are packed to a store first [default: 3/4 of the machine]
    #[arg(long, global = true, value_name = "SIZE", value_parser = parse_bytes)]
    pub(crate) memory: Option<u64>,
    /// Device to compute on; see `vastlight devices`. auto takes a graphics card where there is one, gpu also a software
    /// adapter
    #[arg(long, global = true, value_name = "auto|cpu|gpu[:N]", default_value = "auto")]
    pub(crate) device: Device,
    /// Most memory on a graphics processor, such as 4GiB [default: what it has]
    #[arg(long, global = true, value_name = "SIZE", value_parser = parse_bytes)]
    pub(crate) gpu_memory: Option<u64>,
    /// Go on on the CPU where the graphics processor fails, with a warning; auto does so in any case
    #[arg(long, global = true)]
    pub(crate) gpu_fallback: bool,
    /// More messages
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    pub(crate) verbose: bool,
    /// Errors only
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
}

impl Common {
    /// How files are opened within the memory budget.
    pub(crate) fn load_options(&self) -> vastlight::LoadOptions {
        vastlight::LoadOptions::within(self.memory)
    }
}

impl Common {
    /// What is asked of devices.
    pub(crate) fn device_request(&self) -> DeviceRequest {
        DeviceRequest { device: self.device, gpu_memory: self.gpu_memory, fallback: self.gpu_fallback }
    }

    /// Opens an adapter within the memory budget of graphics processors, and says its name.
    pub(crate) fn executor(&self, choice: DeviceChoice) -> Result<Executor, Error> {
        let executor = Executor::open(choice, self.gpu_memory)?;
        self.say(|| format!("adapter {}", executor.adapter().name));
        Ok(executor)
    }

    /// Refuses devices on which a command does not work yet.
    pub(crate) fn check(&self, command: &Command) -> Result<(), Error> {
        let knows_gpu = match command {
            Command::Devices(_) | Command::Render(_) => true,
            Command::Bench(bench) => bench.knows_gpu(),
            _ => false,
        };
        if matches!(self.device, Device::Gpu(_)) && !knows_gpu {
            let what = "this command does not use graphics processors";
            return Err(Error::new(ErrorClass::Device, what, "--device gpu", "use --device cpu"));
        }
        Ok(())
    }

    /// A message for those who asked for more.
    pub(crate) fn say(&self, message: impl FnOnce() -> String) {
        if self.verbose {
            eprintln!("{}", message());
        }
    }
}

/// Where a scene comes from and what is changed about it.
#[derive(Args, Debug)]
#[command(next_help_heading = "Scene options")]
pub(crate) struct SceneArguments {
    /// glTF, GLB, OBJ, PLY or STL file, manifest of files (.toml), store (.vls), or demo:NAME
    #[arg(value_name = "SCENE")]
    pub(crate) scene: String,
    #[command(flatten)]
    options: SceneOptions,
}

/// How a scene is opened, and what is changed about it.
#[derive(Args, Debug)]
#[command(next_help_heading = "Scene options")]
pub(crate) struct SceneOptions {
    /// Light from a latitude-longitude map (.exr, .hdr)
    #[arg(long, value_name = "FILE", conflicts_with = "sun")]
    env: Option<std::path::PathBuf>,
    /// A clear sky with the sun at azimuth (from -z towards +x) and elevation, degrees
    #[arg(long, value_name = "AZ,EL", value_parser = crate::values::sun, allow_hyphen_values = true)]
    sun: Option<[f32; 2]>,
    /// Changes to materials, lights and environment by name, a TOML file (see docs/overrides.md); may be given several times, the
    /// last has the last word
    #[arg(long = "override", value_name = "FILE")]
    overrides: Vec<std::path::PathBuf>,
    /// Which of a glTF file's scenes, by name or number
    #[arg(long, value_name = "NAME")]
    file_scene: Option<String>,
    /// Which of a glTF file's animations moves the scene, by name or number [default: the first]
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    /// Files a second of a sequence (mesh.####.ply)
    #[arg(long, value_name = "N", default_value_t = SceneChoice::SEQUENCE_FPS, value_parser = crate::values::positive)]
    sequence_fps: f32,
    /// Triangles of a demo scene whose size can be chosen
    #[arg(long, value_name = "N")]
    triangles: Option<u64>,
    /// Bytes of texture, for demo scenes that can be asked for them (8GiB, 512MiB)
    #[arg(long, value_name = "SIZE", value_parser = vastlight::parse_bytes)]
    texture_bytes: Option<u64>,
    /// Moment of a scene that moves, in seconds [default: a file's scene at rest, a demo's at 0]
    #[arg(long, value_name = "SECONDS", value_parser = crate::values::finite, allow_negative_numbers = true)]
    time: Option<f32>,
}

impl SceneOptions {
    /// What is said of the scene.
    fn choice(&self) -> SceneChoice {
        SceneChoice {
            file_scene: self.file_scene.clone(),
            animation: self.animation.clone(),
            sequence_fps: self.sequence_fps,
            triangles: self.triangles,
            texture_bytes: self.texture_bytes,
            time: self.time,
            environment: self.env.clone(),
            sun: self.sun,
            overrides: self.overrides.iter().cloned().map(LookChoice::File).collect(),
        }
    }

    /// How the scene is opened.
    pub(crate) fn load_options(&self, common: &Common) -> Result<vastlight::LoadOptions, Error> {
        self.choice().apply(common.load_options())
    }

    /// The same on a command line, but for the moment.
    pub(crate) fn words(&self) -> Vec<String> {
        self.choice().words()
    }
}

impl SceneArguments {
    /// How the scene is opened.
    pub(crate) fn options(&self, common: &Common) -> Result<vastlight::LoadOptions, Error> {
        self.options.load_options(common)
    }

    /// The moment that was asked for.
    pub(crate) fn time(&self) -> Option<f32> {
        self.options.time
    }

    /// The scene as it was named.
    pub(crate) fn name(&self) -> &str {
        &self.scene
    }

    /// What to call the scene, without secrets of its address.
    pub(crate) fn shown(&self) -> std::borrow::Cow<'_, str> {
        vastlight::paging::shown(&self.scene)
    }

    /// Opens the scene, be it a store or not.
    pub(crate) fn open(&self, common: &Common) -> Result<vastlight::OpenScene, Error> {
        vastlight::open(&self.scene, &self.options(common)?)
    }

    /// Opens the scene in memory.
    pub(crate) fn load(&self, common: &Common) -> Result<vastlight::scene::Scene, Error> {
        vastlight::load(&self.scene, &self.options(common)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        options: SceneOptions,
    }

    #[test]
    fn words_say_all_overrides_in_their_order() {
        let given = ["--triangles", "9", "--override", "b.toml", "--override", "a.toml"];
        let line = |words: &[String]| {
            Line::parse_from(std::iter::once("vastlight").chain(words.iter().map(String::as_str))).options
        };
        let options = line(&given.map(str::to_owned));
        assert_eq!(options.words(), given);
        assert_eq!(line(&options.words()).overrides, ["b.toml", "a.toml"].map(std::path::PathBuf::from));
    }
}
