//! What users say of a scene that is opened.

use crate::{Error, LoadOptions, Overrides};
use std::path::{Path, PathBuf};

/// Where changes of looks are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LookChoice {
    /// In a TOML file.
    File(PathBuf),
    /// Here, in JSON.
    Json(String),
}

impl LookChoice {
    /// The changes.
    ///
    /// # Errors
    /// They cannot be read, or mean nothing.
    pub fn read(&self) -> Result<Overrides, Error> {
        match self {
            Self::File(path) => Overrides::read(path),
            Self::Json(text) => Overrides::parse_json(text, "".as_ref(), "overrides"),
        }
    }
}

/// How a scene is opened, and what is changed about it, in the words of users.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneChoice {
    /// Which of a file's scenes, by name or number.
    pub file_scene: Option<String>,
    /// Which of a file's animations, by name or number.
    pub animation: Option<String>,
    /// Files a second of a sequence.
    pub sequence_fps: f32,
    /// Triangles of a demo scene.
    pub triangles: Option<u64>,
    /// Bytes of texture of a demo scene.
    pub texture_bytes: Option<u64>,
    /// The moment in seconds.
    pub time: Option<f32>,
    /// A latitude-longitude map.
    pub environment: Option<PathBuf>,
    /// Azimuth and elevation of the sun, degrees.
    pub sun: Option<[f32; 2]>,
    /// Changes of looks, the last with the last word.
    pub overrides: Vec<LookChoice>,
}

impl Default for SceneChoice {
    fn default() -> Self {
        Self {
            file_scene: None,
            animation: None,
            sequence_fps: Self::SEQUENCE_FPS,
            triangles: None,
            texture_bytes: None,
            time: None,
            environment: None,
            sun: None,
            overrides: Vec::new(),
        }
    }
}

impl SceneChoice {
    /// Files a second of a sequence, unless said.
    pub const SEQUENCE_FPS: f32 = 24.0;

    /// Puts it into options.
    ///
    /// # Errors
    /// A number means nothing, or there are two environments.
    pub fn apply(&self, mut options: LoadOptions) -> Result<LoadOptions, Error> {
        self.check()?;
        options.import.scene.clone_from(&self.file_scene);
        options.import.animation.clone_from(&self.animation);
        options.import.sequence_fps = self.sequence_fps;
        options.generate.triangles = self.triangles;
        options.generate.texture_bytes = self.texture_bytes;
        options.time = self.time;
        options.environment.clone_from(&self.environment);
        options.sun = self.sun;
        options.overrides = self.overrides.iter().map(LookChoice::read).collect::<Result<_, _>>()?;
        Ok(options)
    }

    /// The same on a command line, but for the moment, and for changes that are in no file.
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        let path = |path: &Path| path.display().to_string();
        let file = |choice: &LookChoice| match choice {
            LookChoice::File(file) => Some(path(file)),
            LookChoice::Json(_) => None,
        };
        let overrides = self.overrides.iter().map(|choice| ("--override", file(choice)));
        let given = [
            ("--env", self.environment.as_deref().map(path)),
            ("--sun", self.sun.map(|[azimuth, elevation]| format!("{azimuth},{elevation}"))),
            ("--file-scene", self.file_scene.clone()),
            ("--animation", self.animation.clone()),
            (
                "--sequence-fps",
                (self.sequence_fps != Self::SEQUENCE_FPS).then(|| self.sequence_fps.to_string()),
            ),
            ("--triangles", self.triangles.map(|n| n.to_string())),
            ("--texture-bytes", self.texture_bytes.map(|n| n.to_string())),
        ];
        let given = given.into_iter().chain(overrides);
        given.filter_map(|(flag, value)| Some([flag.to_owned(), value?])).flatten().collect()
    }

    fn check(&self) -> Result<(), Error> {
        let refuse = |what: &str, place: &str| Err(Error::usage(what, place, ""));
        if self.environment.is_some() && self.sun.is_some() {
            return refuse("the environment is a map or a sky, not both", "--sun");
        }
        if !(self.sequence_fps > 0.0 && self.sequence_fps.is_finite()) {
            return refuse("a number above 0 is expected", "--sequence-fps");
        }
        if !self.time.is_none_or(f32::is_finite) {
            return refuse("a finite number of seconds is expected", "--time");
        }
        match self.sun {
            Some([azimuth, elevation]) if !(azimuth.is_finite() && (-90.0..=90.0).contains(&elevation)) => {
                refuse("azimuth and elevation are degrees, the elevation -90 to 90", "--sun")
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_means_nothing_is_refused() {
        let none = SceneChoice::default();
        let sun = |sun| SceneChoice { sun: Some(sun), ..none.clone() };
        let fps = |sequence_fps| SceneChoice { sequence_fps, ..none.clone() };
        let both = SceneChoice { environment: Some("a.exr".into()), ..sun([0.0, 10.0]) };
        let late = SceneChoice { time: Some(f32::INFINITY), ..none.clone() };
        for wrong in [
            sun([f32::NAN, 2.0]),
            sun([0.0, 900.0]),
            fps(0.0),
            fps(-1.0),
            fps(f32::NAN),
            fps(f32::INFINITY),
            both,
            late,
        ] {
            assert!(wrong.apply(LoadOptions::default()).is_err(), "{wrong:?}");
        }
        let options = sun([10.0, 90.0]).apply(LoadOptions::default()).expect("right");
        assert_eq!(options.sun, Some([10.0, 90.0]));
    }

    #[test]
    fn a_command_line_says_the_same() {
        let overrides = vec![LookChoice::Json("{}".into()), LookChoice::File("a.toml".into())];
        let choice = SceneChoice {
            sun: Some([10.0, 45.5]),
            triangles: Some(500),
            overrides,
            ..SceneChoice::default()
        };
        assert_eq!(choice.words(), ["--sun", "10,45.5", "--triangles", "500", "--override", "a.toml"]);
    }
}
