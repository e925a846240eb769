//! Pictures whose shutter is open for a while.

use crate::{Error, RenderRequest};
use vastlight_scene::{Pose, Scene};
use vastlight_transport::Integrator;

/// How a shutter opens: at a moment of the scene, for a while. Between its keys everything goes straight on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// For how long, in seconds. At 0 a picture is a moment.
    pub seconds: f32,
    /// Poses of what moves, at equal distances, the first when the shutter opens and the last when it closes; each takes the
    /// memory and the time of one. At least 2.
    pub keys: u32,
}

impl Exposure {
    /// Most keys.
    pub const MOST_KEYS: u32 = 65;

    /// The poses of a scene from `time` on; one alone for a moment.
    pub(crate) fn poses(&self, scene: &Scene, time: f32) -> Result<Vec<Pose>, Error> {
        let Some(motion) = scene.motion() else {
            let hint = "files with animations, sequences of files and some demos do";
            return Err(Error::scene("nothing moves in this scene", "", hint));
        };
        if self.is_moment() {
            return Ok(vec![motion.pose(time)?]);
        }
        let last = self.keys.clamp(2, Self::MOST_KEYS) - 1;
        let at = |key: u32| f64::from(time) + f64::from(self.seconds) * f64::from(key) / f64::from(last);
        (0..=last).map(|key| Ok(motion.pose(at(key) as f32)?)).collect()
    }

    /// Whether the shutter does not open.
    pub(crate) fn is_moment(&self) -> bool {
        // False for NaN.
        let opens = self.seconds > 0.0;
        !opens
    }
}

/// Refuses what does not know the times of rays, where a shutter is open.
pub(crate) fn check(scene: &Scene, request: &RenderRequest) -> Result<(), Error> {
    if scene.shutter().is_none() {
        return Ok(());
    }
    let refuse = |what: &str, place: &str, hint: &str| Err(Error::usage(what, place, hint));
    if matches!(request.settings.integrator, Integrator::Whitted | Integrator::PhotonCaustics) {
        let hint = "use path, direct, primary or ao, or leave --shutter out";
        return refuse("the stream tracer has no shutter", "--integrator", hint);
    }
    if request.settings.caustics.is_some() {
        return refuse("photons have no shutter", "--caustics", "leave photons out, or --shutter");
    }
    request.device.refuse("a shutter is open, which the CPU alone knows")
}
