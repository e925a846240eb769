//! Messages from the page: `[1, frame as u32]` confirms a picture, `[2, JSON]` is a command.

use crate::develop::Channel;
use crate::edits::{EnvironmentEdit, LightEdit, MaterialEdit};
use crate::objects::Rows;
use crate::view::{CameraView, Region, RenderView, Size, ToneView};
use serde::Deserialize;

/// Longest message, bytes.
pub(crate) const LONGEST: usize = 16 << 10;
/// The first byte of a confirmation, and of a command.
const CONFIRMATION: u8 = 1;
const COMMAND: u8 = 2;

/// A message from the page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Message {
    /// The picture of this number was shown.
    Shown(u32),
    /// Something is to be done.
    Do(Command),
}

/// What is to be done.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Command {
    /// Looks from somewhere; pictures that show it carry the number `input`.
    Camera { camera: CameraView, input: u32 },
    /// Takes a camera of the scene.
    SceneCamera { name: String },
    /// Makes pictures of this size.
    Size { size: Size },
    /// Develops pictures in another way.
    Tone { tone: ToneView },
    /// Renders in another way.
    Render { render: RenderView },
    /// Shows another output.
    Channel { channel: Channel },
    /// Limits refining to a part of the picture, or to none.
    Region { region: Option<Region> },
    /// Stops refining, or goes on.
    Pause { paused: bool },
    /// Begins the picture anew.
    Reset {},
    /// Says what is at a point of the picture, from 0 to 1 from the left and the top.
    Pick { x: f32, y: f32 },
    /// Changes a material.
    Material { name: String, edit: MaterialEdit },
    /// Changes a light.
    Light { name: String, edit: LightEdit },
    /// Changes the environment.
    Environment { edit: EnvironmentEdit },
    /// Puts an instance elsewhere, or back to where the scene has it.
    Object { instance: u32, place: Option<Rows> },
    /// Gives the scene its own looks and places again.
    Revert {},
    /// Brings the scene to a moment, in seconds.
    Time { seconds: f32 },
    /// Opens a scene.
    Open { source: String },
    /// Lists a folder.
    Files { folder: String },
    /// Asks for the command line and the program that make this picture.
    Share {},
    /// Takes over.
    Steer {},
}

impl Command {
    /// Whether it changes what all see, so that only the one who steers may give it.
    pub(crate) fn steers(&self) -> bool {
        !matches!(self, Self::Pick { .. } | Self::Files { .. } | Self::Share {} | Self::Steer {})
    }

    /// What is wrong with its numbers, if anything.
    fn check(&self) -> Result<(), String> {
        let finite = |name: &str, numbers: &[f32]| match numbers.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(format!("{name} must be finite")),
        };
        match self {
            Self::Camera { camera, .. } => camera.check(),
            Self::Size { size } => size.check(),
            Self::Tone { tone } => tone.check(),
            Self::Render { render } => render.check(),
            Self::Region { region } => region.map_or(Ok(()), Region::check),
            Self::Pick { x, y } => finite("the point", &[*x, *y]),
            Self::Material { edit, .. } => edit.check(),
            Self::Light { edit, .. } => edit.check(),
            Self::Environment { edit } => edit.check(),
            Self::Object { place, .. } => {
                finite("the place", place.as_ref().map_or(&[], |rows| rows.as_flattened()))
            }
            Self::Time { seconds } => finite("the time", &[*seconds]),
            _ => Ok(()),
        }
    }
}

/// Reads a message.
pub(crate) fn parse(bytes: &[u8]) -> Result<Message, String> {
    match bytes.split_first() {
        Some((&CONFIRMATION, frame)) => {
            let frame = frame.try_into().map_err(|_| "a confirmation is a number of four bytes")?;
            Ok(Message::Shown(u32::from_le_bytes(frame)))
        }
        Some((&COMMAND, text)) => {
            let command: Command = serde_json::from_slice(text).map_err(|e| e.to_string())?;
            command.check()?;
            Ok(Message::Do(command))
        }
        _ => Err("a message begins with 1 (a confirmation) or 2 (a command)".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn command(text: &str) -> Result<Message, String> {
        parse(&[&[COMMAND], text.as_bytes()].concat())
    }

    #[test]
    fn commands_are_read_and_checked() {
        assert_eq!(parse(&[1, 5, 1, 0, 0]), Ok(Message::Shown(261)));
        assert_eq!(
            command(r#"{"do":"pause","paused":true}"#),
            Ok(Message::Do(Command::Pause { paused: true }))
        );
        assert_eq!(command(r#"{"do":"reset"}"#), Ok(Message::Do(Command::Reset {})));
        let camera = |eye: &str, fov: &str| {
            command(&format!(
                r#"{{"do":"camera","camera":{{"eye":{eye},"target":[0,0,0],"fov":{fov}}},"input":3}}"#
            ))
        };
        assert!(camera("[1,2,3]", "40").is_ok());
        for (eye, fov) in
            [("[1,2]", "40"), ("[0,0,0]", "40"), ("[1,2,3]", "0"), ("[1,2,3]", "200"), ("[1e39,0,0]", "9")]
        {
            assert!(camera(eye, fov).is_err(), "{eye} {fov}");
        }
        for wrong in [
            "",
            "{}",
            r#"{"do":"dance"}"#,
            r#"{"do":"reset","more":1}"#,
            r#"{"do":"size","size":{"width":100000,"height":10}}"#,
            r#"{"do":"size","size":{"width":4000,"height":4000}}"#,
            r#"{"do":"time","seconds":1e300}"#,
            r#"{"do":"render","render":{"integrator":"path","max_depth":5,"spp":0,"seed":0,"caustics":false}}"#,
            r#"{"do":"material","name":"a","edit":{"roughness":-1}}"#,
            r#"{"do":"object","instance":0,"place":[[1,0,0,1e39],[0,1,0,0],[0,0,1,0]]}"#,
            r#"{"do":"object","instance":0,"place":[[1,0,0,0],[0,1,0,0]]}"#,
            r#"{"do":"region","region":[0.5,0,0.5,1]}"#,
            r#"{"do":"region","region":[0,0,1,1.5]}"#,
            r#"{"do":"object","instance":-1,"place":null}"#,
        ] {
            assert!(command(wrong).is_err(), "{wrong}");
        }
    }

    proptest! {
        /// Whatever comes is read or refused, and what is read holds no number that is not finite.
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&bytes);
            let _ = parse(&[&[COMMAND], &bytes[..]].concat());
        }

        #[test]
        fn damaged_commands_are_read_or_refused(place in 0_usize..90, byte in any::<u8>()) {
            let mut text = br#".{"do":"camera","camera":{"eye":[1,2,3],"target":[0,0,-0.5],"fov":40},"input":3}"#.to_vec();
            text[0] = COMMAND;
            let place = place % text.len();
            text[place] = byte;
            if let Ok(Message::Do(Command::Camera { camera, .. })) = parse(&text) {
                prop_assert!(camera.eye.iter().chain(&camera.target).all(|x| x.is_finite()));
                prop_assert!(camera.fov > 0.0 && camera.fov < 179.0 && camera.eye != camera.target);
            }
        }
    }
}
