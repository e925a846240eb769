//! The command line and the program that make the picture of the page again.

use crate::objects::Rows;
use crate::view::{IntegratorName, View};
use serde_json::{Value, json};
use vastlight::film::Aov;
use vastlight::transport::{Integrator, Tile};

/// Both, and the override file that they need.
pub(crate) fn of_view(view: &View, source: &str, arguments: &[String]) -> Value {
    let notice = notice(view);
    // In front it is a remark, to shells and in override files alike.
    let with_notice = |text: String| match notice.is_empty() || text.is_empty() {
        true => text,
        false => format!("# {notice}\n{text}"),
    };
    json!({
        "kind": "share",
        "command": with_notice(command(view, source, arguments)),
        "python": python(view, source, arguments),
        "overrides": with_notice(view.edits.text()),
        "notice": notice,
    })
}

/// What neither a command line nor an override file can say.
fn notice(view: &View) -> String {
    match view.objects.len() {
        0 => String::new(),
        1 => "Without the object that was put elsewhere: Python alone can do that".to_owned(),
        n => format!("Without the {n} objects that were put elsewhere: Python alone can do that"),
    }
}

/// What to call the file of overrides.
const OVERRIDES: &str = "edits.toml";

/// What decides what is seen.
struct Shown {
    /// The output that is shown in place of the picture.
    aov: Option<Aov>,
    integrator: &'static str,
    caustics: bool,
    /// Whether it is numbers, not light.
    is_data: bool,
}

impl Shown {
    fn new(view: &View) -> Self {
        let aov = view.channel.aov();
        let (integrator, is_data) = match view.channel.integrator() {
            None => (view.render.integrator.name(), false),
            Some(Integrator::Steps) => ("steps", true),
            Some(_) => (IntegratorName::Primary.name(), true),
        };
        let caustics = view.render.caustics && integrator == IntegratorName::Path.name();
        Self { aov, integrator, caustics, is_data }
    }

    /// What to call the picture.
    fn file(&self) -> &'static str {
        if self.is_data { "picture.exr" } else { "picture.png" }
    }
}

/// The command line; arguments are those that say how the scene is opened.
pub(crate) fn command(view: &View, source: &str, arguments: &[String]) -> String {
    let shown = Shown::new(view);
    let mut words: Vec<String> = ["vastlight", "render", source, "-o", shown.file()].map(quoted).into();
    words.extend(arguments.iter().map(|word| quoted(word)));
    let mut flag = |name: &str, value: String| words.extend([name.to_owned(), quoted(&value)]);
    flag("-r", format!("{}x{}", view.size.width, view.size.height));
    if let Some(Tile { min, max }) = view.region.map(|region| region.pixels(view.size)) {
        flag("--crop", format!("{},{},{},{}", min[0], min[1], max[0], max[1]));
    }
    flag("--spp", view.render.spp.to_string());
    flag("--max-depth", view.render.max_depth.to_string());
    flag("--seed", view.render.seed.to_string());
    flag("--integrator", shown.integrator.to_owned());
    if shown.caustics {
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
    match shown.aov {
        Some(aov) => flag("--aov", aov.name().to_owned()),
        None if shown.is_data => {}
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
    let shown = Shown::new(view);
    let mut save = vec![string(shown.file())];
    if !shown.is_data {
        save.push(format!("exposure={:?}, tonemap={}", view.tone.exposure, string(&view.tone.curve)));
    }
    let (load, render) = (load.join(", "), picture_arguments(view, &shown).join(", "));
    let (save, places) = (save.join(", "), places(view));
    format!(
        "import vastlight as vl\n\ns = vl.load({load})\n{places}img = vl.render(s, {render}, progress=True)\nimg.save({save})\n"
    )
}

/// Objects that were put elsewhere, a line each.
fn places(view: &View) -> String {
    let line = |(instance, [x, y, z]): (u32, Rows)| {
        format!("s.set_instance_transform({instance}, [{x:?}, {y:?}, {z:?}, [0, 0, 0, 1]])\n")
    };
    view.objects.iter().map(line).collect()
}

/// What decides the picture, as arguments of Python.
fn picture_arguments(view: &View, shown: &Shown) -> Vec<String> {
    let View { size, render, camera, .. } = view;
    let mut given = vec![
        format!("size=({}, {})", size.width, size.height),
        format!("spp={}, max_depth={}, seed={}", render.spp, render.max_depth, render.seed),
        format!("integrator={}", string(shown.integrator)),
    ];
    if let Some(Tile { min, max }) = view.region.map(|region| region.pixels(view.size)) {
        given.push(format!("crop=({}, {}, {}, {})", min[0], min[1], max[0], max[1]));
    }
    if shown.caustics {
        given.push("caustics=\"photons\"".to_owned());
    }
    given.push(match &camera.name {
        Some(name) => format!("camera={}", string(name)),
        None => format!("look_at=({:?}, {:?}), fov={:?}", camera.eye, camera.target, camera.fov),
    });
    given.extend(shown.aov.map(|aov| format!("aovs=[{}]", string(aov.name()))));
    given
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::develop::Channel;
    use crate::edits::LightEdit;
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
    fn all_that_the_command_says_is_in_the_program() {
        let mut view = View::new(32);
        view.render.caustics = true;
        view.time = 1.5;
        view.edits.edit_light("Lamp".into(), LightEdit { scale: 2.0 });
        let arguments = ["--env", "sky.hdr", "--override", "a.toml"].map(String::from);
        let (text, line) = (python(&view, "a.glb", &arguments), command(&view, "a.glb", &arguments));
        let load = "vl.load(\"a.glb\", env=\"sky.hdr\", time=1.5, overrides=[\"a.toml\", \"edits.toml\"])";
        assert!(text.contains(load), "{text}");
        assert!(text.contains("caustics=\"photons\""), "{text}");
        assert!(
            line.starts_with("vastlight render a.glb -o picture.png --env sky.hdr --override a.toml -r"),
            "{line}"
        );
        assert!(
            line.contains("--caustics photons") && line.ends_with("--time 1.5 --override edits.toml"),
            "{line}"
        );
        for channel in [Channel::Normal, Channel::Depth] {
            view.channel = channel;
            let both = [python(&view, "a.glb", &arguments), command(&view, "a.glb", &arguments)];
            assert!(
                both.iter().all(|text| !text.contains("caustics") && text.contains("primary")),
                "{both:?}"
            );
            assert!(both.iter().all(|text| text.contains("picture.exr")), "{both:?}");
        }
        view.channel = Channel::Steps;
        let both = [python(&view, "a.glb", &arguments), command(&view, "a.glb", &arguments)];
        let says = |word: &str| both.iter().all(|text| text.contains(word));
        assert!(says("steps") && says("picture.exr") && !says("caustics") && !says("tonemap"), "{both:?}");
        view.channel = Channel::NonFinite;
        assert_eq!(command(&view, "a.glb", &arguments), line);
    }

    #[test]
    fn places_are_said_by_python_alone() {
        let mut view = View::new(32);
        view.edits.edit_light("Lamp".into(), LightEdit { scale: 2.0 });
        let share = |view: &View| of_view(view, "a.glb", &[]);
        assert_eq!(share(&view)["notice"], "");
        assert!(share(&view)["command"].as_str().is_some_and(|line| line.starts_with("vastlight render")));
        view.objects.put(7, Some([[1.0, 0.0, 0.0, 0.1], [0.0, 1e-9, 0.0, -2.0], [0.0, 0.0, 1.0, 0.0]]));
        let shared = share(&view);
        let text = |part: &str| shared[part].as_str().expect("text").to_owned();
        let line = "\ns.set_instance_transform(7, [[1.0, 0.0, 0.0, 0.1], [0.0, 1e-9, 0.0, -2.0], [0.0, 0.0, 1.0, 0.0], [0, 0, 0, 1]])\n";
        assert!(text("python").contains(line), "{}", text("python"));
        for part in ["command", "overrides"] {
            assert!(text(part).starts_with("# Without the object"), "{}", text(part));
        }
        assert!(vastlight::Overrides::parse(&text("overrides"), "the page's").is_ok());
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
