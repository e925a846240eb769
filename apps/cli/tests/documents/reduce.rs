//! The same command at a price that a test can pay.
//!
//! - Samples and passes are divided by 128, and at most two; `render` without `--spp` takes one.
//! - Pictures have 32 x 24 pixels; crops are the same parts of them, or some part.
//! - Scenes whose size can be chosen have their fewest triangles.
//! - Of several frames the first two are rendered.
//! - `view` takes any free port, and opens no browser.

/// What samples are divided by.
const LESS: u32 = 128;
const MOST: u32 = 2;
const SIZE: &str = "32x24";
const EDGES: [u32; 2] = [32, 24];
const CROP: &str = "4,4,20,16";

/// Demos whose size can be chosen, and their fewest triangles.
const SIZES: [(&str, &str); 9] = [
    ("bodies", "30000"),
    ("caustic-sphere", "1000"),
    ("city", "200000"),
    ("cloth", "20000"),
    ("explosion", "20000"),
    ("plant", "400000"),
    ("statue", "20000"),
    ("terrain", "20000"),
    ("traffic", "400000"),
];

/// Rewrites the arguments of `vastlight`.
pub(crate) fn reduce(arguments: &[String]) -> Vec<String> {
    let mut reduced: Vec<String> = arguments.to_vec();
    let resolution =
        arguments.iter().skip_while(|word| !["-r", "--resolution"].contains(&word.as_str())).nth(1);
    for i in 1..reduced.len() {
        let value = match reduced[i - 1].as_str() {
            "--spp" | "--samples" => samples(&reduced[i]).to_string(),
            "--passes" => passes(&reduced[i]),
            "-r" | "--resolution" => SIZE.into(),
            "--crop" => crop(&reduced[i], resolution).unwrap_or_else(|| CROP.into()),
            "-f" | "--frames" => frames(&reduced[i]),
            "--triangles" => fewest(arguments).unwrap_or(&reduced[i]).to_owned(),
            "--port" => "0".into(),
            _ => continue,
        };
        reduced[i] = value;
    }
    let has = |names: &[&str]| arguments.iter().any(|word| names.contains(&word.as_str()));
    let mut add = |words: &[&str]| reduced.extend(words.iter().map(|&word| word.to_owned()));
    match arguments.first().map(String::as_str) {
        Some("render") => {
            if !has(&["-r", "--resolution"]) {
                add(&["-r", SIZE]);
            }
            if !has(&["--spp", "--samples"]) {
                add(&["--spp", "1"]);
            }
        }
        Some("view") if !has(&["--no-open"]) => add(&["--no-open"]),
        _ => {}
    }
    if let Some(fewest) = fewest(arguments)
        && !has(&["--triangles"])
    {
        add(&["--triangles", fewest]);
    }
    reduced
}

fn samples(text: &str) -> u32 {
    text.parse::<u32>().map_or(1, |n| n.div_ceil(LESS).min(MOST))
}

/// The same part of a smaller picture, if the size of the larger one is given in pixels.
fn crop(text: &str, resolution: Option<&String>) -> Option<String> {
    let (width, height) = resolution?.split_once('x')?;
    let full: [u32; 2] = [width.parse().ok()?, height.parse().ok()?];
    let scaled =
        |(i, edge): (usize, &str)| Some((edge.parse::<u32>().ok()? * EDGES[i % 2] / full[i % 2]).to_string());
    text.split(',').enumerate().map(scaled).collect::<Option<Vec<String>>>().map(|edges| edges.join(","))
}

/// `1-128` becomes `1-1`, `129-256` becomes `2-2`.
fn passes(text: &str) -> String {
    text.split_once('-').map_or_else(|| text.to_owned(), |(a, b)| format!("{}-{}", samples(a), samples(b)))
}

/// The first two of `A-BxS`.
fn frames(text: &str) -> String {
    let (range, step) = text.split_once('x').unwrap_or((text, "1"));
    let first = range.split('-').next().and_then(|a| a.parse::<u32>().ok());
    match (first, step.parse::<u32>()) {
        (Some(first), Ok(step)) if range.contains('-') => format!("{first}-{}x{step}", first + step),
        _ => text.to_owned(),
    }
}

/// The fewest triangles of the demo that is named.
fn fewest(arguments: &[String]) -> Option<&'static str> {
    let is_named = |name: &str| match arguments.first().map(String::as_str) {
        Some("generate") => arguments.iter().any(|word| word == name),
        _ => arguments.iter().any(|word| word.strip_prefix("demo:") == Some(name)),
    };
    SIZES.iter().find(|(name, _)| is_named(name)).map(|(_, fewest)| *fewest)
}

#[test]
fn commands_become_cheap_and_stay_themselves() {
    let reduced = |line: &str| {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        reduce(&words).join(" ")
    };
    assert_eq!(
        reduced("render a.glb --spp 256 --passes 129-256 -o b.vlc"),
        "render a.glb --spp 2 --passes 2-2 -o b.vlc -r 32x24"
    );
    assert_eq!(
        reduced("render demo:explosion -f 4-40x2 -o b.####.png -r 256x144"),
        "render demo:explosion -f 4-6x2 -o b.####.png -r 32x24 --spp 1 --triangles 20000"
    );
    assert_eq!(
        reduced("generate statue -o a.ply --triangles 10000000"),
        "generate statue -o a.ply --triangles 20000"
    );
    assert_eq!(
        reduced("render a.glb -r 1920x1080 --crop 960,0,1920,1080 -o b.vlc"),
        "render a.glb -r 32x24 --crop 16,0,32,24 -o b.vlc --spp 1"
    );
    assert_eq!(reduced("diff a.exr b.exr"), "diff a.exr b.exr");
}
