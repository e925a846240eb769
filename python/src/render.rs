//! What is asked of a render, from a dictionary of `vastlight._render`.

use crate::arguments::arguments;
use std::str::FromStr;
use std::time::Duration;
use vastlight::film::Aov;
use vastlight::math::Vec3;
use vastlight::trace::TracerConfig;
use vastlight::transport::photon::PhotonSettings;
use vastlight::transport::{Integrator, PixelFilter, RenderSettings, Tile};
use vastlight::{
    CameraChoice, Denoising, Device, DeviceRequest, Error, Exposure, LARGEST_EDGE, OpenScene, RenderRequest,
    default_size, photon_settings,
};

arguments! {
    /// The words of a request.
    #[derive(Clone, Debug)]
    pub(crate) struct Request {
        size: Option<(u32, u32)>,
        spp: u32,
        device: String,
        seed: u32,
        integrator: String,
        max_depth: u32,
        caustics: String,
        photons: Option<u32>,
        photon_radius: Option<f32>,
        russian_roulette: bool,
        aovs: Vec<String>,
        camera: Option<String>,
        look_at: Option<([f32; 3], [f32; 3])>,
        fov: Option<f32>,
        crop: Option<(u32, u32, u32, u32)>,
        filter: Option<String>,
        passes: Option<(u32, u32)>,
        noise: Option<f32>,
        time_limit: Option<f64>,
        gpu_memory: Option<u64>,
        accel: Option<String>,
        denoise: bool,
        shutter: f32,
        shutter_keys: u32,
        /// Threads, if others than the scene's.
        pub(crate) threads: Option<usize>,
        /// The memory budget in bytes, if another than the scene's.
        pub(crate) memory: Option<u64>,
    }
}

/// A value by its name; `place` is the argument.
fn named<T: FromStr<Err = String>>(name: &str, place: &str) -> Result<T, Error> {
    name.parse().map_err(|what: String| Error::usage(what, format!("{place}=\"{name}\""), ""))
}

/// Refuses what is not so, in words.
fn expect(is_so: bool, what: &str, place: &str) -> Result<(), Error> {
    if is_so { Ok(()) } else { Err(Error::usage(what, place, "")) }
}

/// Whether it is above 0, and finite.
fn is_positive(number: f32) -> bool {
    number > 0.0 && number.is_finite()
}

impl Request {
    /// The shutter.
    pub(crate) fn exposure(&self) -> Exposure {
        Exposure { seconds: self.shutter, keys: self.shutter_keys }
    }

    /// Everything that can be said without the scene.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let edge = 1..=LARGEST_EDGE;
        let fits = self.size.is_none_or(|(width, height)| edge.contains(&width) && edge.contains(&height));
        expect(fits, &format!("edges are 1 to {LARGEST_EDGE} pixels"), "size")?;
        expect((1..=1 << 22).contains(&self.spp), "samples are 1 to 4194304 a pixel", "spp")?;
        expect(self.fov.is_none_or(|fov| fov > 0.0 && fov < 179.0), "between 0 and 179 degrees", "fov")?;
        let apart = |(eye, target): &([f32; 3], [f32; 3])| {
            eye != target && eye.iter().chain(target).all(|x| x.is_finite())
        };
        expect(
            self.look_at.as_ref().is_none_or(apart),
            "eye and target must be finite and apart",
            "look_at",
        )?;
        expect(self.noise.is_none_or(is_positive), "a number above 0 is expected", "noise")?;
        expect(self.photon_radius.is_none_or(is_positive), "a number above 0 is expected", "photon_radius")?;
        expect(self.photons.is_none_or(|n| (1..=1 << 24).contains(&n)), "1 to 16777216", "photons")?;
        expect((0.0..=1e6).contains(&self.shutter), "seconds from 0 on are expected", "shutter")?;
        expect((2..=Exposure::MOST_KEYS).contains(&self.shutter_keys), "2 to 65 poses", "shutter_keys")?;
        expect(matches!(self.caustics.as_str(), "off" | "photons"), "known are off and photons", "caustics")
    }

    /// The denoiser, if the picture is to be denoised.
    pub(crate) fn denoising(&self) -> Result<Option<Denoising>, Error> {
        let aovs = self.aovs()?;
        self.denoise.then(|| Denoising::open(&aovs)).transpose()
    }

    fn aovs(&self) -> Result<Vec<Aov>, Error> {
        self.aovs.iter().map(|name| named(name, "aovs")).collect()
    }

    /// What is rendered of a scene, whose budget is `memory`.
    pub(crate) fn resolve(
        &self,
        open: &OpenScene,
        denoising: Option<&Denoising>,
        memory: Option<u64>,
    ) -> Result<RenderRequest, Error> {
        let look_at = self.look_at.map(|(eye, target)| [Vec3::from_array(eye), Vec3::from_array(target)]);
        let choice = CameraChoice { name: self.camera.clone(), look_at, fov: self.fov };
        let camera = choice.resolve(&open.scene)?;
        let (width, height) = self.size.unwrap_or_else(|| default_size(None, camera.aspect));
        let integrator: Integrator = named(&self.integrator, "integrator")?;
        let filter = self.filter.as_deref().map(|name| named::<PixelFilter>(name, "filter")).transpose()?;
        let settings = RenderSettings {
            crop: self.crop.map(|(x0, y0, x1, y1)| Tile { min: [x0, y0], max: [x1, y1] }),
            integrator,
            caustics: self.photons(integrator)?,
            max_depth: self.max_depth,
            russian_roulette: self.russian_roulette,
            seed: self.seed,
            filter: filter.unwrap_or_default(),
            camera_keys: choice.resolve_keys(&open.scene)?,
            ..RenderSettings::new(camera, width, height)
        };
        expect(settings.region().pixels() > 0, "the crop has no pixel of the picture", "crop")?;
        let accel = self.accel.clone().unwrap_or_default();
        let mut request = RenderRequest {
            aovs: denoising.map_or_else(|| self.aovs(), |denoising| Ok(denoising.rendered_aovs()))?,
            time_limit: self.time_limit()?,
            tracer: TracerConfig { accel, ..TracerConfig::default() },
            device: self.device()?,
            passes: self.passes.map(|(first, end)| first..end),
            noise: self.noise,
            ..RenderRequest::new(settings, self.spp)
        };
        request.paging.memory = memory;
        Ok(request)
    }

    fn photons(&self, integrator: Integrator) -> Result<Option<PhotonSettings>, Error> {
        let settings =
            PhotonSettings { photons: self.photons, radius: self.photon_radius, ..PhotonSettings::default() };
        photon_settings(integrator, self.caustics == "photons", settings)
    }

    fn device(&self) -> Result<DeviceRequest, Error> {
        let device: Device = named(&self.device, "device")?;
        Ok(DeviceRequest { device, gpu_memory: self.gpu_memory, fallback: false })
    }

    fn time_limit(&self) -> Result<Option<Duration>, Error> {
        let seconds = self.time_limit.map(Duration::try_from_secs_f64).transpose();
        seconds.map_err(|error| Error::usage(error.to_string(), "time_limit", "give seconds"))
    }
}
