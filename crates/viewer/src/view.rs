//! What is looked at, and how: the state that connections share and change.

use crate::develop::Channel;
use crate::edits::Edits;
use crate::objects::Places;
use serde::{Deserialize, Serialize};
use vastlight::film::{BitDepth, PngOptions, ToneCurve};
use vastlight::math::Vec3;
use vastlight::scene::{Camera, Projection, Scene};
use vastlight::transport::photon::PhotonSettings;
use vastlight::transport::{Integrator, RenderSettings, Tile};
use vastlight::{CameraChoice, Error, RenderRequest};

/// All of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct View {
    pub(crate) camera: CameraView,
    pub(crate) size: Size,
    pub(crate) tone: ToneView,
    pub(crate) render: RenderView,
    pub(crate) channel: Channel,
    pub(crate) paused: bool,
    /// To what of the picture refining is limited.
    pub(crate) region: Option<Region>,
    /// The moment of a scene that moves, seconds.
    pub(crate) time: f32,
    pub(crate) edits: Edits,
    /// Instances that were put elsewhere.
    pub(crate) objects: Places,
}

impl View {
    /// A view with so many samples, before there is a scene.
    pub(crate) fn new(spp: u32) -> Self {
        Self {
            camera: CameraView::default(),
            size: Size { width: 1280, height: 720 },
            tone: ToneView { exposure: 0.0, curve: ToneCurve::default().name().to_owned() },
            render: RenderView {
                integrator: IntegratorName::Path,
                max_depth: 16,
                spp,
                seed: 0,
                caustics: false,
            },
            channel: Channel::Beauty,
            paused: false,
            region: None,
            time: 0.0,
            edits: Edits::default(),
            objects: Places::default(),
        }
    }

    /// What is rendered, scaled to a part of its size.
    pub(crate) fn request(&self, scene: &Scene, scale: f32) -> Result<RenderRequest, Error> {
        let camera = self.camera.choice().resolve(scene)?;
        let scaled = |n: u32| ((n as f32 * scale).round() as u32).max(1);
        let (width, height) = (scaled(self.size.width), scaled(self.size.height));
        let is_path = self.render.integrator == IntegratorName::Path;
        let caustics = (self.render.caustics && is_path && scale == 1.0).then(PhotonSettings::default);
        let own = self.channel.integrator();
        let settings = RenderSettings {
            integrator: own.unwrap_or(self.render.integrator.integrator()),
            caustics: caustics.filter(|_| own.is_none()),
            max_depth: self.render.max_depth,
            seed: self.render.seed,
            ..RenderSettings::new(camera, width, height)
        };
        let aovs = self.channel.aov().into_iter().collect();
        Ok(RenderRequest { aovs, ..RenderRequest::new(settings, self.render.spp) })
    }
}

/// A camera: one of the scene, by its name, or a free one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CameraView {
    /// Where it stands, world space.
    pub(crate) eye: [f32; 3],
    /// What it looks at; orbits go around it.
    pub(crate) target: [f32; 3],
    /// Full vertical angle of view, degrees.
    pub(crate) fov: f32,
    /// The scene's camera that it is, with its lens and all.
    #[serde(default)]
    pub(crate) name: Option<String>,
}

impl CameraView {
    /// A camera of a scene.
    pub(crate) fn of(camera: &Camera, scene: &Scene) -> Self {
        let map = camera.world_from_camera;
        let eye = map.translation;
        let forward = map.transform_vector3(Vec3::NEG_Z).normalize_or(Vec3::NEG_Z);
        let (fov, distance) = match camera.projection {
            Projection::Perspective { vertical_fov, focus_distance, .. } => (vertical_fov, focus_distance),
            Projection::Orthographic { half_height } => (0.6, half_height),
        };
        let bounds = scene.bounds();
        let to_middle = if bounds.is_empty() { distance } else { (bounds.center() - eye).dot(forward) };
        let distance = if to_middle > 1e-3 * distance { to_middle } else { distance };
        let target = eye + forward * distance.max(f32::MIN_POSITIVE);
        Self {
            eye: eye.to_array(),
            target: target.to_array(),
            fov: fov.to_degrees(),
            name: Some(camera.name.clone()),
        }
    }

    /// The camera of a choice.
    pub(crate) fn chosen(choice: &CameraChoice, scene: &Scene) -> Result<Self, Error> {
        let mut view = Self::of(&choice.resolve(scene)?, scene);
        if let Some([eye, target]) = choice.look_at {
            (view.eye, view.target) = (eye.to_array(), target.to_array());
        }
        view.fov = choice.fov.unwrap_or(view.fov);
        if choice.look_at.is_some() || choice.fov.is_some() {
            view.name = None;
        }
        Ok(view)
    }

    /// The same as it is asked for on a command line.
    pub(crate) fn choice(&self) -> CameraChoice {
        match &self.name {
            Some(name) => CameraChoice { name: Some(name.clone()), ..CameraChoice::default() },
            None => CameraChoice {
                name: None,
                look_at: Some([Vec3::from_array(self.eye), Vec3::from_array(self.target)]),
                fov: Some(self.fov),
            },
        }
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        let (eye, target) = (Vec3::from_array(self.eye), Vec3::from_array(self.target));
        if !eye.is_finite() || !target.is_finite() || eye == target {
            return Err("eye and target must be finite and apart".to_owned());
        }
        match self.fov > 0.0 && self.fov < 179.0 {
            true => Ok(()),
            false => Err("the angle of view is between 0 and 179 degrees".to_owned()),
        }
    }
}

/// Size of the picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Size {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Size {
    /// Longest edge, and most pixels.
    pub(crate) const LONGEST: u32 = 4096;
    pub(crate) const MOST_PIXELS: u32 = 2_560_000;
    /// A size of that many pixels, for budgets.
    pub(crate) const LARGEST: Self = Self { width: 2048, height: 1250 };

    pub(crate) fn check(self) -> Result<(), String> {
        let edges = 1..=Self::LONGEST;
        let fits = edges.contains(&self.width) && edges.contains(&self.height);
        match fits && self.width * self.height <= Self::MOST_PIXELS {
            true => Ok(()),
            false => Err(format!(
                "edges are 1 to {} pixels, and pictures at most {} pixels",
                Self::LONGEST,
                Self::MOST_PIXELS
            )),
        }
    }
}

/// A rectangle of the picture: left, top, right and bottom, in parts of its edges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Region([f32; 4]);

impl Region {
    pub(crate) fn check(self) -> Result<(), String> {
        let [x0, y0, x1, y1] = self.0;
        match 0.0 <= x0 && x0 < x1 && x1 <= 1.0 && 0.0 <= y0 && y0 < y1 && y1 <= 1.0 {
            true => Ok(()),
            false => Err("a region is left, top, right and bottom, 0 to 1".to_owned()),
        }
    }

    /// All pixels of which it has a part.
    pub(crate) fn pixels(self, Size { width, height }: Size) -> Tile {
        let [x0, y0, x1, y1] = self.0;
        let first = |part: f32, edge: u32| ((part * edge as f32) as u32).min(edge - 1);
        let last = |part: f32, edge: u32| ((part * edge as f32).ceil() as u32).min(edge);
        Tile { min: [first(x0, width), first(y0, height)], max: [last(x1, width), last(y1, height)] }
    }
}

/// From radiance to the screen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ToneView {
    /// Stops.
    pub(crate) exposure: f32,
    /// Tone curve by its name.
    pub(crate) curve: String,
}

impl ToneView {
    pub(crate) fn options(&self) -> PngOptions {
        let curve = self.curve.parse().unwrap_or_default();
        PngOptions { exposure: self.exposure, curve, depth: BitDepth::Eight, dither: true }
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        if !(-40.0..=40.0).contains(&self.exposure) {
            return Err("the exposure is -40 to 40 stops".to_owned());
        }
        self.curve.parse::<ToneCurve>().map(|_| ())
    }
}

/// How light is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RenderView {
    pub(crate) integrator: IntegratorName,
    /// Longest path in segments.
    pub(crate) max_depth: u32,
    /// Samples a pixel at which a picture at rest is done.
    pub(crate) spp: u32,
    pub(crate) seed: u32,
    /// Whether photons bring what mirrors and lenses focus; of `path` alone.
    pub(crate) caustics: bool,
}

impl RenderView {
    pub(crate) fn check(self) -> Result<(), String> {
        if !(1..=1 << 16).contains(&self.spp) {
            return Err("samples are 1 to 65536 a pixel".to_owned());
        }
        match self.max_depth <= 1024 {
            true => Ok(()),
            false => Err("paths have at most 1024 segments".to_owned()),
        }
    }
}

/// The integrators of the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum IntegratorName {
    Path,
    Direct,
    Primary,
    Ao,
}

impl IntegratorName {
    /// The name on the command line.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Direct => "direct",
            Self::Primary => "primary",
            Self::Ao => "ao",
        }
    }

    fn integrator(self) -> Integrator {
        match self {
            Self::Path => Integrator::Path,
            Self::Direct => Integrator::Direct,
            Self::Primary => Integrator::Primary,
            Self::Ao => Integrator::Ao,
        }
    }
}
