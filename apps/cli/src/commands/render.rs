//! `vastlight render SCENE -o FILE`.

use crate::arguments::{Common, SceneArguments};
use crate::commands::keep::KeepArguments;
use crate::exit::Exit;
use crate::findings;
use crate::interrupt;
use crate::output::{self, PictureFile, PngArguments};
use crate::progress::{ProgressKind, Reporter};
use crate::values::{self, Frames, Resolution};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use vastlight::film::{Accumulator, Aov, Picture, PngOptions};
use vastlight::math::Vec3;
use vastlight::scene::{Camera, Scene};
use vastlight::trace::TracerConfig;
use vastlight::transport::photon::{PhotonSettings, SearchKind};
use vastlight::transport::{Integrator, PixelFilter, RenderSettings, Tile};
use vastlight::{
    CameraChoice, Control, Denoising, Ending, Error, ErrorClass, Exposure, LoadOptions, OpenScene,
    PackControl, PackProgress, RenderRequest, Rendered, Session, Snapshot, Stats, check_request, human_bytes,
    open_within, photon_settings,
};

/// The arguments of `render`.
#[derive(Args, Debug)]
pub(crate) struct Render {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    picture: PictureArguments,
    #[command(flatten)]
    output: OutputArguments,
    /// Frames of a scene that moves: 7, 1-100 or 1-100x2; frame F is the moment F / fps. The output's name has #### for the
    /// number
    #[arg(short, long, value_name = "A-BxS", value_parser = values::frames, conflicts_with = "time")]
    frames: Option<Frames>,
    /// Frames a second
    #[arg(long, value_name = "N", default_value_t = 24.0, value_parser = values::positive)]
    fps: f32,
    /// How long the shutter is open, as a part of a frame's time (0.5 is usual): it opens at the frame's moment, or at --time. 0: each
    /// picture is a moment
    #[arg(long, value_name = "PART", default_value_t = 0.0, value_parser = values::shutter)]
    shutter: f32,
    /// Poses of what moves while the shutter is open; between them everything goes straight on. Fast turns want more
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(2..=i64::from(Exposure::MOST_KEYS)))]
    shutter_keys: u32,
    /// Where scenes that do not fit into the memory budget are packed, once, and rendered from
    #[arg(long, value_name = "DIR")]
    cache_dir: Option<PathBuf>,
    #[command(flatten)]
    keep: KeepArguments,
}

/// What is rendered, and how long.
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture options")]
pub(crate) struct PictureArguments {
    /// Size: 1920x1080, 1080p, 4k, or 50% of the default [default: 720 rows in the camera's shape, else 16:9]
    #[arg(short, long, value_name = "SIZE", value_parser = values::resolution)]
    pub(crate) resolution: Option<Resolution>,
    /// Samples a pixel
    #[arg(long, alias = "samples", value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 22))]
    pub(crate) spp: u32,
    /// Longest path in segments: 1 sees emission alone, 2 adds direct light
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub(crate) max_depth: u32,
    /// Another seed is another noise
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u32,
    /// How light is computed
    #[arg(long, value_name = "NAME", default_value = "path")]
    pub(crate) integrator: IntegratorName,
    /// Light that mirrors and lenses focus on other surfaces: found by paths alone, or brought by photons
    #[arg(long, value_name = "off|photons", default_value = "off")]
    caustics: Caustics,
    /// Photons that are sent for each sample of the picture [default: a quarter of its pixels, 65536 to 1048576]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    photons: Option<u32>,
    /// One radius for the first photons, as a part of the scene's longest edge [default: radii by their density]
    #[arg(long, value_name = "PART", value_parser = values::positive)]
    photon_radius: Option<f32>,
    /// How photons are found: brute, lexicographic, voxel, planar, rows
    #[arg(long, value_name = "NAME", default_value = SearchKind::default().name(), value_parser = values::photon_search)]
    photon_search: SearchKind,
    /// End paths at the depth limit alone
    #[arg(long)]
    no_russian_roulette: bool,
    /// Only this part of the picture, pixels
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = values::crop)]
    crop: Option<Tile>,
    /// Pixel filter: box, triangle, gaussian, blackman-harris; a radius may follow, such as gaussian:2
    #[arg(long, value_name = "NAME")]
    filter: Option<PixelFilter>,
    /// Camera by name, or by number from 0 [default: the first]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Eye and target
    #[arg(long, value_name = "EX,EY,EZ,TX,TY,TZ", value_parser = values::look_at, allow_hyphen_values = true)]
    look_at: Option<[Vec3; 2]>,
    /// Full vertical angle of view, degrees
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view)]
    fov: Option<f32>,
    /// Stop after this time, loading included, with an even picture of at least 1 spp: 90s, 10m, 1.5h
    #[arg(long, value_name = "TIME", value_parser = values::duration)]
    time_limit: Option<Duration>,
    /// Acceleration structure by name
    #[arg(long, value_name = "NAME")]
    accel: Option<String>,
}

/// What is written, and what is shown meanwhile.
#[derive(Args, Debug)]
#[command(next_help_heading = "Output options")]
struct OutputArguments {
    /// The picture: .png (tone-mapped sRGB) or .exr (linear, with AOVs); or .vlc, its sums, for `merge`
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Auxiliary outputs in the EXR, separated by commas: albedo, normal, depth, alpha, position, object, material
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    aov: Vec<Aov>,
    /// Take the noise out of the colour with Open Image Denoise, where it is installed (see docs/outputs.md)
    #[arg(long)]
    denoise: bool,
    #[command(flatten)]
    png: PngArguments,
    /// Progress on stderr
    #[arg(long, value_name = "KIND", default_value = "auto")]
    progress: ProgressKind,
    /// Write what it cost as JSON; of several frames each where the name has ####, else the last
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Samples that are not finite are an error (exit code 7); the picture is written all the same
    #[arg(long)]
    strict: bool,
}

/// Where caustics come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Caustics {
    /// Paths find what they find
    Off,
    /// Photons
    Photons,
}

/// Integrators by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum IntegratorName {
    /// Global illumination
    Path,
    /// Direct light alone
    Direct,
    /// Shape and base colour
    Primary,
    /// Ambient occlusion
    Ao,
    /// How many nodes and blocks of triangles each camera ray goes through
    Steps,
    /// Phong's shading, mirrors and glass by the stream tracer
    Whitted,
    /// The same, with the light that mirrors and lenses focus by photons from point lights
    PhotonCaustics,
}

impl IntegratorName {
    fn integrator(self) -> Integrator {
        match self {
            Self::Path => Integrator::Path,
            Self::Direct => Integrator::Direct,
            Self::Primary => Integrator::Primary,
            Self::Ao => Integrator::Ao,
            Self::Steps => Integrator::Steps,
            Self::Whitted => Integrator::Whitted,
            Self::PhotonCaustics => Integrator::PhotonCaustics,
        }
    }
}

impl PictureArguments {
    /// What to render of a scene.
    pub(crate) fn request(&self, scene: &Scene, aovs: Vec<Aov>) -> Result<RenderRequest, Error> {
        let choice = CameraChoice { name: self.camera.clone(), look_at: self.look_at, fov: self.fov };
        let mut settings = self.settings(choice.resolve(scene)?)?;
        settings.camera_keys = choice.resolve_keys(scene)?;
        let tracer =
            TracerConfig { accel: self.accel.clone().unwrap_or_default(), ..TracerConfig::default() };
        let time_limit = self.time_limit;
        Ok(RenderRequest { time_limit, aovs, tracer, ..RenderRequest::new(settings, self.spp) })
    }

    /// How photons are sent, if they are.
    fn photon_settings(&self, integrator: Integrator) -> Result<Option<PhotonSettings>, Error> {
        let settings = PhotonSettings {
            photons: self.photons,
            radius: self.photon_radius,
            search: self.photon_search,
            ..PhotonSettings::default()
        };
        photon_settings(integrator, self.caustics == Caustics::Photons, settings)
    }

    fn settings(&self, camera: Camera) -> Result<RenderSettings, Error> {
        let integrator = self.integrator.integrator();
        let (width, height) = self.resolution.unwrap_or_default().size(camera.aspect);
        let settings = RenderSettings {
            crop: self.crop,
            integrator,
            caustics: self.photon_settings(integrator)?,
            max_depth: self.max_depth,
            russian_roulette: !self.no_russian_roulette,
            seed: self.seed,
            filter: self.filter.unwrap_or_default(),
            ..RenderSettings::new(camera, width, height)
        };
        if settings.region().pixels() == 0 {
            let what = format!("the crop is outside the picture of {width} x {height}");
            return Err(Error::usage(what, "--crop", ""));
        }
        Ok(settings)
    }
}

impl Render {
    /// How the shutter opens.
    fn exposure(&self) -> Exposure {
        Exposure { seconds: self.shutter / self.fps, keys: self.shutter_keys }
    }

    /// Opens the scene, or its store in the folder of those that do not fit.
    fn open(
        &self,
        options: &LoadOptions,
        common: &Common,
        cancel: &AtomicBool,
        reporter: &Reporter,
        start: Instant,
    ) -> Result<OpenScene, Error> {
        let progress = |p: &PackProgress| reporter.update_pack(p, start.elapsed());
        let control = PackControl { memory: common.memory, cancel, progress: &progress };
        open_within(self.scene.name(), options, self.cache_dir.as_deref(), control)
    }
}

impl OutputArguments {
    /// Everything about the output that can be found out before the work.
    fn check(&self, is_sequence: bool) -> Result<(PictureFile, PngOptions), Error> {
        let file = PictureFile::new(&self.output, is_sequence)?;
        file.check_aovs(&self.aov)?;
        if let Some(path) = &self.stats {
            vastlight::film::check_writable(path)?;
        }
        if self.denoise {
            file.refuse_sums("sums are not denoised")?;
        }
        Ok((file, self.png.options()?))
    }

    /// The denoiser, if the picture is to be denoised.
    fn denoising(&self) -> Result<Option<Denoising>, Error> {
        self.denoise.then(|| Denoising::open(&self.aov)).transpose()
    }
}

pub(crate) fn run(arguments: &Render, common: &Common, start: Instant) -> Result<Exit, Error> {
    arguments.keep.check(arguments.frames.is_some())?;
    let (file, png) = arguments.output.check(arguments.frames.is_some())?;
    let denoising = arguments.output.denoising()?;
    let reporter = Reporter::new(arguments.output.progress, common.quiet);
    let cancel = interrupt::flag()?;
    let snapshot = interrupt::snapshot_flag()?;

    let options = arguments.scene.options(common)?;
    let open = arguments.open(&options, common, cancel, &reporter, start)?;
    show_findings(&open.scene, common, &reporter);
    warn_of_changes(&open, common, &reporter);
    let load_ms = millis(start.elapsed());
    common.say(|| format!("loaded {} in {load_ms:.0} ms", arguments.scene.shown()));
    let mut session = Session::new(open, arguments.scene.name(), &options);
    let job = Job { arguments, common, png, denoising, reporter, cancel, snapshot: &snapshot };
    match arguments.frames {
        None => {
            job.expose_moment(&mut session)?;
            job.check(&session, start)?;
            job.picture(&mut session, (&file, None), start, load_ms)
        }
        Some(frames) => job.frames(&mut session, &file, frames, start),
    }
}

/// How pictures are made and where they go.
struct Job<'a> {
    arguments: &'a Render,
    common: &'a Common,
    png: PngOptions,
    denoising: Option<Denoising>,
    reporter: Reporter,
    cancel: &'a AtomicBool,
    snapshot: &'a AtomicBool,
}

impl Job<'_> {
    /// Opens the shutter at the moment of a single picture, if it is to be open.
    fn expose_moment(&self, session: &mut Session) -> Result<(), Error> {
        if self.arguments.shutter == 0.0 {
            return Ok(());
        }
        let Some(time) = self.arguments.scene.time() else {
            let what = "a shutter opens at a moment, and there is none";
            return Err(Error::usage(what, "--shutter", "give --time or --frames"));
        };
        session.expose(time, &self.arguments.exposure())?;
        self.warn_of_shutter(session);
        Ok(())
    }

    /// Says what an open shutter does not show as it is.
    fn warn_of_shutter(&self, session: &Session) {
        let scene = &session.open().scene;
        let Some(shutter) = scene.shutter() else { return };
        for &mesh in shutter.sharp() {
            let name = &scene.meshes()[mesh as usize].name;
            let message = format!("mesh \"{name}\" stays sharp: its triangles are others at each moment");
            warn(&self.reporter, self.common, &message);
        }
    }

    /// Renders frame after frame. One that is interrupted is not written, so that what is there is whole.
    fn frames(
        &self,
        session: &mut Session,
        file: &PictureFile,
        frames: Frames,
        start: Instant,
    ) -> Result<Exit, Error> {
        let (mut start, mut is_first) = (start, true);
        for frame in frames.iter() {
            if self.arguments.keep.is_done(frame, file.of_frame(frame).path()) {
                self.common.say(|| format!("{}: is done", file.of_frame(frame).name()));
                continue;
            }
            session.expose(values::moment(frame, self.arguments.fps), &self.arguments.exposure())?;
            if std::mem::take(&mut is_first) {
                self.warn_of_shutter(session);
                self.check(session, start)?;
            }
            let load_ms = millis(start.elapsed());
            let exit = self.picture(session, (file, Some(frame)), start, load_ms)?;
            if exit != Exit::Done {
                return Ok(exit);
            }
            start = Instant::now();
        }
        Ok(Exit::Done)
    }

    /// Renders the scene as it is, into a file or that of a frame. Work on the picture began at `start`.
    fn picture(
        &self,
        session: &mut Session,
        (file, frame): (&PictureFile, Option<u32>),
        start: Instant,
        load_ms: f64,
    ) -> Result<Exit, Error> {
        let Self { arguments, common, png, denoising, reporter, cancel, .. } = self;
        let of_frame = frame.map(|frame| file.of_frame(frame));
        let file = of_frame.as_ref().unwrap_or(file);
        let mut request = self.request(session.open(), start)?;
        arguments.keep.apply(&mut request, frame);
        request.keep_recipe = file.is_sums();
        let take = |sums: &Accumulator| look(file, sums, png, common, reporter);
        let snapshot = Some(Snapshot { wanted: self.snapshot, take: &take });
        let control = Control { cancel, progress: &|p| reporter.update(p), snapshot };
        let rendered = session.render(&request, &control)?;
        reporter.finish();
        common.say(|| details(&rendered.stats));
        let is_interrupted = rendered.stats.ending == Ending::Interrupted;
        if rendered.sums.film().samples() == 0 || is_interrupted && frame.is_some() {
            let when = if rendered.sums.film().samples() == 0 { " before the first sample" } else { "" };
            eprintln!("interrupted{when}, {} is not written", file.name());
            return Ok(Exit::Interrupted);
        }
        let finished = Finished::new(&rendered, denoising.as_ref());
        if file.is_sums() {
            file.write(&rendered.sums, png)?;
        } else {
            file.write_picture(&finished.picture, png)?;
        }
        if let (Some(frame), Ending::Complete) = (frame, rendered.stats.ending) {
            arguments.keep.forget(frame);
        }
        if let Some(path) = &arguments.output.stats {
            let of_frame = frame.and_then(|frame| output::numbered(path, frame));
            let text = stats_json(&rendered, &finished, load_ms, start);
            output::write_text(of_frame.as_ref().unwrap_or(path), &text)?;
        }
        finished.denoised.map_err(|e| Error { hint: "the picture is written with its noise".into(), ..e })?;
        conclude(arguments, common, reporter, file, &rendered, start)
    }

    /// Refuses what cannot be done with the scene, or does not fit into the memory budget.
    fn check(&self, session: &Session, start: Instant) -> Result<(), Error> {
        let mut request = self.request(session.open(), start)?;
        self.arguments.keep.apply(&mut request, None);
        check_request(session.open(), &request, session.moving_triangles())?;
        match &self.denoising {
            Some(denoising) => denoising.check_memory(request.settings.region().pixels(), self.common.memory),
            None => Ok(()),
        }
    }

    /// What is rendered of the scene as it is.
    fn request(&self, open: &OpenScene, start: Instant) -> Result<RenderRequest, Error> {
        let Self { arguments, common, denoising, .. } = self;
        let aovs = denoising.as_ref().map_or_else(|| arguments.output.aov.clone(), Denoising::rendered_aovs);
        let mut request = arguments.picture.request(&open.scene, aovs)?;
        request.paging.memory = common.memory;
        request.device = common.device_request();
        request.time_limit = request.time_limit.map(|limit| limit.saturating_sub(start.elapsed()));
        Ok(request)
    }
}

/// Writes the picture so far; the work goes on even if it cannot be written.
fn look(file: &PictureFile, sums: &Accumulator, png: &PngOptions, common: &Common, reporter: &Reporter) {
    match file.write(sums, png) {
        Ok(()) => common.say(|| format!("{}: a look at {} passes", file.name(), sums.samples().len())),
        Err(error) => warn(reporter, common, &error.to_string()),
    }
}

/// The picture as it is written.
struct Finished {
    picture: Picture,
    /// Whether it could be denoised, where it was to be.
    denoised: Result<(), Error>,
    denoise_ms: f64,
}

impl Finished {
    fn new(rendered: &Rendered, denoising: Option<&Denoising>) -> Self {
        let mut picture = rendered.develop();
        let start = Instant::now();
        let denoised = denoising.map_or(Ok(()), |denoising| denoising.run(&mut picture));
        Self { picture, denoised, denoise_ms: millis(start.elapsed()) }
    }
}

/// Says what was rendered, and how it ended.
fn conclude(
    arguments: &Render,
    common: &Common,
    reporter: &Reporter,
    file: &PictureFile,
    rendered: &Rendered,
    start: Instant,
) -> Result<Exit, Error> {
    let stats = &rendered.stats;
    if let Some(reason) = &stats.fallback {
        warn(reporter, common, &format!("rendered on the CPU: {reason}"));
    }
    if reporter.is_json() {
        let line = json!({"event": "done", "output": file.name(), "stats": stats});
        eprintln!("{line}");
    } else if !common.quiet {
        eprintln!("{}", summary(rendered, file, start));
    }
    if stats.non_finite > 0 {
        let what = format!("{} of {} samples were not finite and left out", stats.non_finite, stats.samples);
        if arguments.output.strict {
            return Err(Error::new(ErrorClass::NonFinite, what, file.name(), "the picture is written"));
        }
        warn(reporter, common, &what);
    }
    Ok(if stats.ending == Ending::Interrupted { Exit::Interrupted } else { Exit::Done })
}

fn summary(rendered: &Rendered, file: &PictureFile, start: Instant) -> String {
    let stats = &rendered.stats;
    let ending = match stats.ending {
        Ending::Complete => "",
        Ending::TimeLimit => ", stopped by the time limit",
        Ending::Interrupted => ", interrupted",
    };
    let mean = stats.noise.map_or(String::new(), |_| format!(" ({:.1} in the mean)", stats.spp_mean));
    format!(
        "{}: {} x {}, {} of {} spp{mean}, {:.1} s ({:.2} Msamples/s, peak {}){ending}",
        file.name(),
        stats.width,
        stats.height,
        stats.spp_done,
        stats.spp,
        start.elapsed().as_secs_f64(),
        stats.msamples_per_s,
        stats.peak_rss_bytes.map_or("unknown".into(), human_bytes),
    )
}

/// What took how long.
fn details(stats: &Stats) -> String {
    format!(
        "on {}: built {} triangles in {:.0} ms ({}), prepared in {:.0} ms, first pass after {:.0} ms, {} rays and {} shadow rays in {:.0} ms",
        stats.adapter.as_deref().unwrap_or("the CPU"),
        stats.scene.unique_triangles,
        stats.build_ms,
        human_bytes(stats.structure_bytes),
        stats.prepare_ms,
        stats.first_pass_ms,
        stats.rays,
        stats.shadow_rays,
        stats.render_ms,
    )
}

/// The contents of `--stats`: the render's own figures, and the times of the whole process.
fn stats_json(rendered: &Rendered, finished: &Finished, load_ms: f64, start: Instant) -> String {
    let stats = &rendered.stats;
    let mut value = json!(stats);
    value["load_ms"] = json!(load_ms);
    value["first_image_ms"] = json!(load_ms + stats.build_ms + stats.prepare_ms + stats.first_pass_ms);
    value["denoiser"] = json!(finished.picture.denoiser);
    value["denoise_ms"] = json!(finished.picture.denoiser.as_ref().map(|_| finished.denoise_ms));
    value["total_ms"] = json!(millis(start.elapsed()));
    value["version"] = json!(env!("CARGO_PKG_VERSION"));
    format!("{value:#}\n")
}

fn millis(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// Warnings about the scene: each kind once, the first kinds in full.
fn show_findings(scene: &Scene, common: &Common, reporter: &Reporter) {
    const SHOWN: usize = 8;
    let kinds = findings::by_kind(scene.diagnostics().items());
    let shown = if common.verbose { kinds.len() } else { SHOWN };
    kinds.iter().take(shown).for_each(|line| warn(reporter, common, line));
    if kinds.len() > shown {
        let message = format!("{} more kinds of warnings (see vastlight validate)", kinds.len() - shown);
        warn(reporter, common, &message);
    }
}

/// Says which sources of a store are others by now.
fn warn_of_changes(open: &OpenScene, common: &Common, reporter: &Reporter) {
    let sources = open.stored.iter().flat_map(|stored| &stored.sources);
    for source in sources.filter(|source| source.has_changed()) {
        let name = &source.name;
        warn(reporter, common, &format!("{name} has changed since the store was packed (pack it again)"));
    }
}

fn warn(reporter: &Reporter, common: &Common, message: &str) {
    if reporter.is_json() {
        eprintln!("{}", json!({"event": "warning", "message": message}));
    } else if !common.quiet {
        eprintln!("warning: {message}");
    }
}
