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
        "python": python(view, source),
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

/// A program for the Python package.
fn python(view: &View, source: &str) -> String {
    let string = |text: &str| Value::from(text).to_string();
    let mut lines = vec!["import vastlight as vl".to_owned(), String::new()];
    lines.push(format!("s = vl.load({})", string(source)));
    if view.time != 0.0 {
        lines.push(format!("s.set_time({:?})", view.time));
    }
    for (name, edit) in &view.edits.materials {
        let values = json!(edit);
        for (key, value) in values.as_object().into_iter().flatten() {
            lines.push(format!("s.materials[{}].{key} = {value}", string(name)));
        }
    }
    let View { size, render, .. } = view;
    lines.push(format!(
        "img = vl.render(s, size=({}, {}), spp={}, seed={})",
        size.width, size.height, render.spp, render.seed
    ));
    lines.push("img.save(\"picture.exr\")".to_owned());
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::CameraView;

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
