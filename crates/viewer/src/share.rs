//! The command line and the program that make the picture of the page again.

use crate::develop::Channel;
use crate::view::{IntegratorName, View};
use serde_json::{Value, json};

/// Both, and the override file that they need.
pub(crate) fn of_view(view: &View, source: &str, arguments: &[String]) -> Value {
    let overrides = view.edits.text();
    json!({
        "kind": "share",
        "command": command(view, source, arguments),
        "python": python(view, source, arguments),
        "overrides": overrides,
    })
}

/// What to call the file of overrides.
const OVERRIDES: &str = "edits.toml";

/// The command line; arguments are those that say how the scene is opened.
pub(crate) fn command(view: &View, source: &str, arguments: &[String]) -> String {
    let is_beauty = view.channel == Channel::Beauty;
    let (output, integrator) = match view.channel.aov() {
        None => ("picture.png", view.render.integrator),
        Some(_) => ("picture.exr", IntegratorName::Primary),
    };
    let mut words: Vec<String> = ["vastlight", "render", source, "-o", output].map(quoted).into();
    words.extend(arguments.iter().map(|word| quoted(word)));
    let mut flag = |name: &str, value: String| words.extend([name.to_owned(), quoted(&value)]);
    flag("-r", format!("{}x{}", view.size.width, view.size.height));
    flag("--spp", view.render.spp.to_string());
    flag("--max-depth", view.render.max_depth.to_string());
    flag("--seed", view.render.seed.to_string());
    flag("--integrator", integrator.name().to_owned());
    if view.render.caustics && is_beauty && integrator == IntegratorName::Path {
        flag("--caustics", "photons".to_owned());
    }
    match &view.camera.name {
        Some(name) => flag("--camera", name.clone()),
        None => {
            let numbers = [view.camera.eye, view.camera.target];
            let numbers: Vec<String> = numbers.as_flattened().iter().map(ToString::to_string).collect();
            flag("--look-at", numbers.join(","));
            flag("--fov", view.camera.fov.to_string());
        }
    }
    match view.channel.aov() {
        Some(aov) => flag("--aov", aov.name().to_owned()),
        None => {
            flag("--exposure", view.tone.exposure.to_string());
            flag("--tonemap", view.tone.curve.clone());
        }
    }
    if view.time != 0.0 {
        flag("--time", view.time.to_string());
    }
    if !view.edits.is_empty() {
        flag("--override", OVERRIDES.to_owned());
    }
    words.join(" ")
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A text as Python takes it.
fn string(text: &str) -> String {
    Value::from(text).to_string()
}

/// A program for the Python package; arguments are those of the command line.
fn python(view: &View, source: &str, arguments: &[String]) -> String {
    let mut load = vec![string(source)];
    let mut overrides = Vec::new();
    for pair in arguments.chunks_exact(2) {
        let (name, value) = (pair[0].trim_start_matches('-').replace('-', "_"), &pair[1]);
        match name.as_str() {
            "override" => overrides.push(string(value)),
            "sun" => load.push(format!("sun=({})", value.replace(',', ", "))),
            "sequence_fps" | "triangles" | "texture_bytes" => load.push(format!("{name}={value}")),
            _ => load.push(format!("{name}={}", string(value))),
        }
    }
    if view.time != 0.0 {
        load.push(format!("time={:?}", view.time));
    }
    if !view.edits.is_empty() {
        overrides.push(string(OVERRIDES));
    }
    if !overrides.is_empty() {
        load.push(format!("overrides=[{}]", overrides.join(", ")));
    }
    let save = match view.channel.aov() {
        Some(_) => "\"picture.exr\"".to_owned(),
        None => {
            let (exposure, curve) = (view.tone.exposure, string(&view.tone.curve));
            format!("\"picture.png\", exposure={exposure:?}, tonemap={curve}")
        }
    };
    let (load, render) = (load.join(", "), picture_arguments(view).join(", "));
    format!(
        "import vastlight as vl\n\ns = vl.load({load})\nimg = vl.render(s, {render}, progress=True)\nimg.save({save})\n"
    )
}

/// What decides the picture, as arguments of Python.
fn picture_arguments(view: &View) -> Vec<String> {
    let View { size, render, camera, .. } = view;
    let aov = view.channel.aov();
    let integrator = if aov.is_some() { IntegratorName::Primary } else { render.integrator };
    let mut given = vec![
        format!("size=({}, {})", size.width, size.height),
        format!("spp={}, max_depth={}, seed={}", render.spp, render.max_depth, render.seed),
        format!("integrator={}", string(integrator.name())),
    ];
    if render.caustics && aov.is_none() && integrator == IntegratorName::Path {
        given.push("caustics=\"photons\"".to_owned());
    }
    given.push(match &camera.name {
        Some(name) => format!("camera={}", string(name)),
        None => format!("look_at=({:?}, {:?}), fov={:?}", camera.eye, camera.target, camera.fov),
    });
    given.extend(aov.map(|aov| format!("aovs=[{}]", string(aov.name()))));
    given
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::CameraView;

    #[test]
    fn the_program_does_what_the_command_does() {
        let mut view = View::new(32);
        view.camera.name = Some("Camera 1".into());
        let arguments =
            ["--sun", "10,45", "--animation", "walk", "--override", "a.toml", "--triangles", "500"];
        let text = python(&view, "my house.glb", &arguments.map(String::from));
        assert_eq!(
            text,
            "import vastlight as vl\n\ns = vl.load(\"my house.glb\", sun=(10, 45), animation=\"walk\", triangles=500, \
             overrides=[\"a.toml\"])\nimg = vl.render(s, size=(1280, 720), spp=32, max_depth=16, seed=0, integrator=\"path\", \
             camera=\"Camera 1\", progress=True)\nimg.save(\"picture.png\", exposure=0.0, tonemap=\"filmic\")\n"
        );
        view.camera = CameraView { eye: [0.0, 1.0, 3.0], target: [0.0; 3], fov: 39.5, name: None };
        view.channel = Channel::Normal;
        let text = python(&view, "demo:cornell", &[]);
        assert!(
            text.contains("look_at=([0.0, 1.0, 3.0], [0.0, 0.0, 0.0]), fov=39.5, aovs=[\"normal\"]"),
            "{text}"
        );
    }

    #[test]
    fn the_command_names_what_decides_the_picture() {
        let mut view = View::new(32);
        view.camera.name = Some("Camera 1".into());
        let text = command(&view, "my house.glb", &["--sun".into(), "10,45".into()]);
        assert_eq!(
            text,
            "vastlight render 'my house.glb' -o picture.png --sun 10,45 -r 1280x720 --spp 32 --max-depth 16 --seed 0 \
             --integrator path --camera 'Camera 1' --exposure 0 --tonemap filmic"
        );
        view.camera = CameraView { eye: [-0.1, 1e-7, 3.0], target: [0.0, 0.0, 1e9], fov: 39.5, name: None };
        view.channel = Channel::Normal;
        let text = command(&view, "a.glb", &[]);
        assert!(
            text.contains("--integrator primary --look-at -0.1,0.0000001,3,0,0,1000000000 --fov 39.5"),
            "{text}"
        );
        assert!(text.ends_with("--aov normal"), "{text}");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
