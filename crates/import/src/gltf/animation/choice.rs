//! Which of a document's animations is played.

use crate::gltf::findings::Findings;
use crate::gltf::json::Json;

/// The animation that `wanted` names, by name or number, or the first; with its number. An unknown one is an error.
pub(in crate::gltf) fn choose<'j, 'a>(
    root: &'j Json<'a>,
    wanted: Option<&str>,
    findings: &mut Findings,
) -> Option<(usize, &'j Json<'a>)> {
    let animations = root.list("animations");
    let Some(wanted) = wanted else {
        if animations.len() > 1 {
            let what =
                format!("the first of {} animations is played; {}", animations.len(), known(animations));
            findings.warn("SEVERAL_ANIMATIONS", what, "/animations", "");
        }
        return animations.first().map(|first| (0, first));
    };
    let by_name = animations.iter().position(|animation| animation.at("name").text() == Some(wanted));
    let found = by_name.or_else(|| wanted.parse::<usize>().ok().filter(|&i| i < animations.len()));
    if found.is_none() {
        let what = format!("there is no animation \"{wanted}\"");
        findings.error("NO_SUCH_ANIMATION", what, "/animations", &known(animations));
    }
    found.map(|i| (i, &animations[i]))
}

/// What can be asked for.
fn known(animations: &[Json<'_>]) -> String {
    let name = |(i, animation): (usize, &Json<'_>)| match animation.at("name").text() {
        Some(name) => format!("\"{name}\""),
        None => i.to_string(),
    };
    let names: Vec<String> = animations.iter().enumerate().map(name).collect();
    if names.is_empty() { "the file has none".into() } else { format!("the file has {}", names.join(", ")) }
}
