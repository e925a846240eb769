//! The page in a browser, from loading to a lost connection.

mod common;

use common::browser::{self, Browser};
use common::slow::Slow;
use common::{Page, fetch, parts, server};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};
use vastlight_viewer::{Server, Viewer};

/// Whether the last picture is complete.
const DONE: &str = "!!vastlight.measured.last?.isFinal && vastlight.measured.last.full[0] === document.getElementById('viewport').width";
const READY: &str =
    "vastlight.state.phase === 'ready' && vastlight.state.steering && !!vastlight.measured.last";
/// The bytes of the canvas, as one number.
const HASH: &str = "(() => { const c = document.getElementById('viewport'); let h = 0; \
    for (const x of c.getContext('2d').getImageData(0, 0, c.width, c.height).data) h = (h * 31 + x) | 0; return h; })()";

/// A page that shows a scene, in a window of a size.
fn page(source: &str, spp: u32, size: [u32; 2]) -> Option<(Server, Browser)> {
    let mut browser = browser::start()?;
    let server = server(Some(source), spp);
    browser.open(server.url(), size[0], size[1]);
    browser.wait_for(READY);
    Some((server, browser))
}

/// The picture of a file as the canvas would hold it.
fn pixels(file: &[u8]) -> (Vec<u8>, u32) {
    let picture = image::load_from_memory(file).expect("a picture").to_rgba8();
    (picture.as_raw().clone(), picture.width())
}

fn hash(bytes: &[u8]) -> i64 {
    i64::from(bytes.iter().fold(0_i32, |h, &x| h.wrapping_mul(31).wrapping_add(i32::from(x))))
}

fn middle(browser: &mut Browser) -> [f64; 2] {
    let place = browser.eval(
        "(() => { const b = document.getElementById('frame').getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; })()",
    );
    [place[0].as_f64().expect("x"), place[1].as_f64().expect("y")]
}

#[test]
fn a_scene_is_loaded_orbited_picked_edited_and_saved() {
    let Some((server, mut browser)) = page("demo:cornell", 2, [560, 420]) else { return };
    browser.wait_for(DONE);
    let first = browser.eval(HASH);
    let (bytes, width) = pixels(&fetch(server.url(), "snapshot.png").body);
    assert_eq!(browser.eval("document.getElementById('viewport').width"), json!(width));
    assert_eq!(first, json!(hash(&bytes)), "the canvas holds the file's pixels");

    let [x, y] = middle(&mut browser);
    browser.mouse("mousePressed", x, y, 1);
    for i in 1..=6 {
        browser.mouse("mouseMoved", x + f64::from(i * 8), y + f64::from(i), 1);
    }
    browser.mouse("mouseReleased", x + 48.0, y + 6.0, 1);
    browser.wait_for("vastlight.measured.latencies.length > 0");
    browser.wait_for(&format!("{DONE} && vastlight.measured.last.input === vastlight.state.input"));
    let turned = browser.eval(HASH);
    assert_ne!(turned, first);
    let (bytes, _) = pixels(&fetch(server.url(), "snapshot.png").body);
    assert_eq!(turned, json!(hash(&bytes)));
    browser.wait_for("location.hash.includes('camera=')");

    browser.click(x, y);
    browser.wait_for("vastlight.state.picked !== null");
    let material = browser.eval("vastlight.state.picked.material.name");
    assert!(material.as_str().is_some_and(|name| !name.is_empty()), "{material}");

    browser.eval("document.querySelector('input[type=color]').value = '#00ff00'");
    browser.eval("document.querySelector('input[type=color]').dispatchEvent(new Event('input'))");
    browser.wait_for("Object.keys(vastlight.state.view.edits).length > 0");
    browser.wait_for(&format!("{DONE} && {HASH} !== {turned}"));

    browser.eval("document.querySelector('input[value=normal]').click()");
    browser.wait_for("vastlight.state.view.channel === 'normal'");
    browser.wait_for(&format!("{DONE} && {HASH} !== {turned}"));
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

#[test]
fn the_keyboard_does_all() {
    let Some((_server, mut browser)) = page("demo:cornell", 1, [500, 400]) else { return };
    let focused = |browser: &mut Browser| browser.eval("document.activeElement.id");
    for _ in 0..20 {
        if focused(&mut browser) == "viewport" {
            break;
        }
        browser.key("Tab", "Tab", 0);
    }
    assert_eq!(focused(&mut browser), "viewport");
    let outline = "getComputedStyle(document.activeElement).outlineStyle";
    assert_eq!(browser.eval(outline), "solid", "focus is seen");
    let eye = "JSON.stringify(vastlight.camera.plain().eye)";
    let mut last = browser.eval(eye);
    for (key, code, modifiers) in
        [("ArrowLeft", "ArrowLeft", 0), ("ArrowUp", "ArrowUp", 8), ("+", "Equal", 8), ("Home", "Home", 0)]
    {
        browser.key(key, code, modifiers);
        let now = browser.eval(eye);
        assert_ne!(now, last, "{key}");
        last = now;
    }
    browser.key("Enter", "Enter", 0);
    browser.wait_for("vastlight.state.picked !== null");
    browser.key(" ", "Space", 0);
    browser
        .wait_for("vastlight.state.view.paused && document.getElementById('pause').textContent === 'Go on'");
    browser.key(" ", "Space", 0);
    browser.wait_for("!vastlight.state.view.paused");
    browser.key("]", "BracketRight", 0);
    browser.wait_for("vastlight.state.view.tone.exposure === 0.25");
    browser.key("v", "KeyV", 0);
    browser.wait_for("vastlight.state.view.channel === 'albedo'");
    browser.key("!", "Digit1", 8);
    browser.key("ArrowLeft", "ArrowLeft", 0);
    browser.key("1", "Digit1", 0);
    assert_eq!(browser.eval(eye), last, "the bookmark leads back");
    browser.key("?", "Slash", 8);
    browser.wait_for("document.getElementById('help').open");
    browser.key("Escape", "Escape", 0);
    browser.wait_for("!document.getElementById('help').open");
    browser.key("t", "KeyT", 0);
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

/// Types a number into a field of the panel.
fn fill(browser: &mut Browser, label: &str, value: f64) {
    browser.eval(&format!(
        "(() => {{ const f = document.querySelector('[aria-label=\"{label}\"]'); f.focus(); f.value = '{value}'; \
         f.dispatchEvent(new Event('input')); f.blur(); }})()"
    ));
}

fn field(browser: &mut Browser, label: &str) -> f64 {
    let value = browser.eval(&format!("document.querySelector('[aria-label=\"{label}\"]').valueAsNumber"));
    value.as_f64().unwrap_or_else(|| panic!("{label}: {value}"))
}

#[test]
fn a_picked_object_is_moved_turned_scaled_and_put_back() {
    let Some((_server, mut browser)) = page("demo:still-life", 1, [700, 500]) else { return };
    browser.wait_for(DONE);
    let plain = browser.eval(HASH);
    let [x, y] = middle(&mut browser);
    browser.click(x, y);
    browser.wait_for("vastlight.state.picked !== null");
    let instance = browser.eval("vastlight.state.picked.instance");
    let rows = format!("vastlight.state.view.objects[{instance}]");
    let labels =
        ["Move x", "Move y", "Move z", "Turn ° x", "Turn ° y", "Turn ° z", "Scale x", "Scale y", "Scale z"];
    let fields = |browser: &mut Browser| labels.map(|label| field(browser, label));
    assert_eq!(fields(&mut browser), [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    for (label, value) in [("Move y", 0.25), ("Turn ° x", 30.0), ("Turn ° y", -40.0), ("Turn ° z", 50.0)] {
        fill(&mut browser, label, value);
    }
    fill(&mut browser, "Scale x", 2.0);
    let wanted = [0.0, 0.25, 0.0, 30.0, -40.0, 50.0, 2.0, 2.0, 2.0];
    assert_eq!(fields(&mut browser), wanted, "scaled evenly");
    browser.wait_for(&format!("{DONE} && {HASH} !== {plain}"));

    // Who comes later reads the same from the server's matrix.
    browser.call("Page.reload", json!({}));
    browser.wait_for("!!window.vastlight?.measured.last && vastlight.state.steering");
    let found = (1..60).any(|i| {
        browser.click(x + f64::from(i % 8 - 4) * 20.0, y + f64::from(i / 8 - 4) * 20.0);
        std::thread::sleep(Duration::from_millis(100));
        browser.eval("vastlight.state.picked?.instance ?? null") == instance
    });
    assert!(found);
    let read = fields(&mut browser);
    assert!(read.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 0.011), "{read:?}");

    // So it is of an object whose own matrix is turned and scaled.
    let rest = browser.eval(
        "import(document.querySelector('script').src.replace('main.js', 'object.js')).then(({ Placed }) => { \
         const opened = { place: [[0, -2, 0, 1], [3, 0, 0, 2], [0, 0, 1, 3]], bounds: { min: [-1, 5, 3], max: [2, 7, 4] } }; \
         const [a, b] = [new Placed({ instance: 0, opened }), new Placed({ instance: 0, opened })]; \
         Object.assign(a, { move: [1, 2, 3], turn: [10, -20, 30], scale: [-1, 2, 0.5] }); b.take(a.place()); \
         const all = ({ move, turn, scale }) => [...move, ...turn, ...scale]; \
         return Math.max(...all(a).map((x, i) => Math.abs(x - all(b)[i]))); })",
    );
    assert!(rest.as_f64().is_some_and(|rest| rest < 1e-4), "{rest}");
    // Where a turn about y is a right angle, other turns mean the same place.
    let apart = browser.eval(
        "import(document.querySelector('script').src.replace('main.js', 'object.js')).then(({ Placed }) => { \
         const [c, s] = [Math.cos(0.4), Math.sin(0.4)]; \
         const opened = { place: [[c, 0, s, 1], [0, 1, 0, 2], [-s, 0, c, 3]], bounds: { min: [-1, 5, 3], max: [2, 7, 4] } }; \
         return Math.max(...[[30, 90, 0], [0, -90, 40], [20, 90, -50], [10, 89, 0]].map((turn) => { \
         const [a, b] = [new Placed({ instance: 0, opened }), new Placed({ instance: 0, opened })]; \
         Object.assign(a, { turn }); b.take(a.place()); \
         const [x, y] = [a, b].map((placed) => placed.place().flat()); \
         return Math.max(...x.map((value, i) => Math.abs(value - y[i]))); })); })",
    );
    assert!(apart.as_f64().is_some_and(|apart| apart < 1e-3), "{apart}");

    let before = browser.eval(&rows);
    browser.key("ArrowRight", "ArrowRight", 1);
    browser.wait_for(&format!("JSON.stringify({rows}) !== '{before}'"));
    let (before, eye) = (browser.eval(&rows), browser.eval("JSON.stringify(vastlight.camera.plain().eye)"));
    for (kind, to) in
        [("mousePressed", 0.0), ("mouseMoved", 10.0), ("mouseMoved", 30.0), ("mouseReleased", 30.0)]
    {
        let held = json!({"type": kind, "x": x + to, "y": y, "button": "left", "buttons": 1, "modifiers": 1});
        browser.call("Input.dispatchMouseEvent", held);
    }
    browser.wait_for(&format!("JSON.stringify({rows}) !== '{before}'"));
    browser.eval("document.getElementById('viewport').focus()");
    browser.key("c", "KeyC", 0);
    browser.wait_for("document.getElementById('toasts').textContent.includes('Python alone')");
    browser.eval("document.getElementById('text-dialog').close()");
    browser.eval(
        "[...document.querySelectorAll('button')].find((b) => b.textContent === 'Put it back').click()",
    );
    browser.wait_for(&format!("{rows} === undefined && {DONE} && {HASH} === {plain}"));
    assert_eq!(browser.eval("JSON.stringify(vastlight.camera.plain().eye)"), eye);
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

/// A page behind a slow network, that shows a scene.
fn slow_page(source: &str, spp: u32, size: [u32; 2]) -> Option<(Server, Browser)> {
    let mut browser = browser::start()?;
    let server = server(Some(source), spp);
    let (host, token) = parts(server.url());
    let slow = Slow { delay: Duration::from_millis(100), bytes_per_s: 125_000.0 };
    let near = slow.before(host.parse().expect("an address"));
    browser.open(&format!("http://{near}/?token={token}"), size[0], size[1]);
    browser.wait_for(READY);
    Some((server, browser))
}

/// Picks again, moves before that is answered, and turns before the move is back: both are kept.
#[test]
fn what_is_on_its_way_outlives_another_pick() {
    let Some((_server, mut browser)) = slow_page("demo:cornell", 1, [500, 400]) else { return };
    browser.wait_for(DONE);
    browser.eval(
        "(async () => { const nap = (ms) => new Promise((done) => setTimeout(done, ms)); \
         const pick = () => document.body.dispatchEvent(new KeyboardEvent('keydown', { key: 'Enter', code: 'Enter', bubbles: true })); \
         const type = (label, value) => { const f = document.querySelector(`[aria-label='${label}']`); f.value = value; f.dispatchEvent(new Event('input')); }; \
         pick(); while (!vastlight.state.picked) await nap(5); \
         const first = vastlight.state.picked; pick(); await nap(80); type('Move x', 0.25); \
         while (vastlight.state.picked === first) await nap(1); type('Turn ° y', 35); })()",
    );
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(["Move x", "Turn ° y"].map(|label| field(&mut browser, label)), [0.25, 35.0]);
    let place = browser.eval("Object.values(vastlight.state.view.objects)[0]");
    let cosine = place[0][0].as_f64().expect("a matrix");
    assert!((cosine - 35.0_f64.to_radians().cos()).abs() < 1e-5, "{place}");
}

#[test]
fn a_region_is_drawn_refined_and_taken_away() {
    let Some((_server, mut browser)) = page("demo:cornell", 2, [700, 500]) else { return };
    browser.wait_for(DONE);
    let [x, y] = middle(&mut browser);
    let eye = "JSON.stringify(vastlight.camera.plain().eye)";
    let before = browser.eval(eye);
    browser.eval("document.getElementById('viewport').focus()");
    browser.key("b", "KeyB", 0);
    browser.mouse("mousePressed", x - 60.0, y - 40.0, 1);
    browser.mouse("mouseMoved", x, y, 1);
    browser.mouse("mouseMoved", x + 60.0, y + 40.0, 1);
    browser.mouse("mouseReleased", x + 60.0, y + 40.0, 1);
    browser.wait_for("vastlight.state.view.region !== null");
    assert_eq!(browser.eval(eye), before, "the camera stays");
    let mark = "(() => { const b = document.getElementById('region').getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; })()";
    let shown = browser.eval(mark);
    let wanted = [x - 60.0, y - 40.0, x + 60.0, y + 40.0];
    let is_there =
        wanted.iter().enumerate().all(|(i, edge)| (shown[i].as_f64().unwrap_or(-1.0) - edge).abs() < 1.5);
    assert!(is_there, "{shown} is not {wanted:?}");
    browser.wait_for("document.getElementById('activity').textContent.includes('region, done')");
    browser.resize(600, 420, false);
    browser.wait_for(&format!("JSON.stringify({mark}) !== '{shown}'"));
    browser.key("b", "KeyB", 0);
    browser.wait_for("vastlight.state.view.region === null && document.getElementById('region').hidden");
    browser.key("b", "KeyB", 0);
    browser.key("Escape", "Escape", 0);
    browser.key("b", "KeyB", 0);
    browser.key("Enter", "Enter", 0);
    browser.wait_for("JSON.stringify(vastlight.state.view.region) === '[0.25,0.25,0.75,0.75]'");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

/// A server at another port is offered what the browser kept, but not one whose view somebody has changed, nor samples that it was given.
#[test]
fn settings_go_from_one_server_to_the_next() {
    let Some((first, mut browser)) = page("demo:cornell", 64, [500, 400]) else { return };
    let set = |browser: &mut Browser, label: &str, value: f64| {
        browser.eval(&format!(
            "(() => {{ const f = document.querySelector('[aria-label=\"{label}, number\"]'); f.value = '{value}'; \
             f.dispatchEvent(new Event('change')); }})()"
        ));
    };
    for (label, value, place) in [
        ("Exposure", 1.5, "tone.exposure"),
        ("Depth", 3.0, "render.max_depth"),
        ("Samples", 2.0, "render.spp"),
        ("Seed", 9.0, "render.seed"),
    ] {
        set(&mut browser, label, value);
        browser.wait_for(&format!("vastlight.state.view.{place} === {value}"));
    }
    browser.eval("document.querySelector('input[value=albedo]').click()");
    browser.wait_for("vastlight.state.view.channel === 'albedo'");
    drop(first);
    let view = "(({ tone, render, channel }) => [tone.exposure, render.max_depth, render.spp, render.seed, channel].join())(vastlight.state.view)";
    for (spp, expected) in [(5, "1.5,3,5,0,albedo"), (64, "1.5,3,2,0,albedo")] {
        let server = server(Some("demo:cornell"), spp);
        browser.open(server.url(), 500, 400);
        browser.wait_for(&format!("vastlight.state.steering && {view} === '{expected}'"));
    }
    let server = server(Some("demo:cornell"), 64);
    let mut other = Page::open(server.url());
    other.send(&json!({"do": "tone", "tone": {"exposure": -2.0, "curve": "linear"}}));
    other.wait_until("state", |state| state["view"]["tone"]["exposure"] == -2.0);
    browser.open(server.url(), 500, 400);
    browser.complaints.clear();
    drop(other);
    browser.wait_for(READY);
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(browser.eval(view), "-2,16,64,0,beauty");
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

#[test]
fn a_lost_server_is_told_and_the_next_is_found() {
    let Some(mut browser) = browser::start() else { return };
    let server = server(Some("demo:cornell"), 1);
    browser.open(server.url(), 400, 300);
    browser.wait_for(READY);
    drop(server);
    browser.wait_for("!document.getElementById('offline').hidden");
    let text = browser.eval("document.getElementById('offline').textContent");
    assert!(text.as_str().is_some_and(|text| text.contains("stopped")), "{text}");
}

#[test]
fn a_reload_finds_the_camera_and_a_scene_that_fails_says_why() {
    let Some(mut browser) = browser::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("broken.glb"), "no").expect("written");
    let viewer = Viewer {
        source: Some("demo:cornell".into()),
        folder: Some(folder.path().to_owned()),
        spp: 1,
        ..Viewer::default()
    };
    let server = Server::start(viewer).expect("started");
    browser.open(server.url(), 700, 500);
    browser.wait_for(READY);
    browser.eval("document.getElementById('viewport').focus()");
    browser.key("ArrowLeft", "ArrowLeft", 0);
    browser.wait_for("vastlight.measured.last.input === vastlight.state.input");
    let eye = browser.eval("JSON.stringify(vastlight.state.view.camera.eye)");
    browser.call("Page.reload", json!({}));
    browser.wait_for("!!window.vastlight?.measured.last && vastlight.state.steering");
    assert_eq!(browser.eval("JSON.stringify(vastlight.state.view.camera.eye)"), eye);
    browser.eval("document.getElementById('open-scenes').click()");
    browser.wait_for("document.querySelectorAll('#files button').length === 1");
    assert!(browser.eval("document.querySelectorAll('#demos button').length").as_u64() > Some(10));
    browser.eval("document.querySelector('#files button').click()");
    browser.wait_for("!document.getElementById('failed').hidden");
    let what = browser.eval("document.getElementById('failed-what').textContent");
    assert!(what.as_str().is_some_and(|what| what.contains("broken.glb")), "{what}");
}

/// Sizes of phones and of large screens, wide and narrow; and fifty sizes in a row.
#[test]
fn every_size_has_its_picture() {
    let Some((_server, mut browser)) = page("demo:cornell", 1, [390, 844]) else { return };
    let overflow = "document.documentElement.scrollWidth <= innerWidth && document.documentElement.scrollHeight <= innerHeight";
    assert_eq!(browser.eval(overflow), true);
    assert_eq!(browser.eval("document.body.classList.contains('no-panel')"), true);
    browser.eval("document.getElementById('panel-toggle').click()");
    let small = "[...document.querySelectorAll('button, select')].filter((b) => b.offsetHeight > 0 && b.offsetHeight < 30).length";
    assert_eq!(browser.eval(small), 0, "fingers need room");
    assert_eq!(browser.eval(overflow), true);
    browser.eval("document.getElementById('panel-toggle').click()");
    for i in 0..50 {
        browser.resize(300 + i * 7 % 400, 320 + i * 11 % 300, false);
    }
    browser.resize(640, 420, false);
    browser.wait_for(&format!(
        "{DONE} && vastlight.measured.last.full[0] === document.getElementById('frame').clientWidth"
    ));
    assert!(browser.complaints.is_empty(), "{:?}", browser.complaints);
}

/// What screen readers and people with weak eyes need: names, roles, contrast.
#[test]
fn all_controls_have_names_and_contrast() {
    let Some((_server, mut browser)) = page("demo:cornell", 1, [1000, 700]) else { return };
    browser.eval(include_str!("common/accessible.js"));
    for theme in ["dark", "light"] {
        browser.eval(&format!("document.documentElement.dataset.theme = '{theme}'"));
        let found = browser.eval("window.inaccessible()");
        assert_eq!(found["problems"], json!([]), "{theme}");
        assert!(found["checked"].as_u64() > Some(80), "{found}");
    }
    browser.eval("document.body.append(document.createElement('button'))");
    browser.eval("document.getElementById('activity').style.color = '#777'");
    let found = browser.eval("window.inaccessible()");
    assert!(found["problems"].as_array().is_some_and(|p| p.len() >= 2), "the check finds: {found}");
}

/// Where `cargo xtask test` puts axe-core.
const AXE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../target/axe/node_modules/axe-core/axe.min.js");

/// axe-core, or a word that there is none.
#[expect(clippy::print_stdout, reason = "what was skipped is counted from the output")]
fn axe() -> Option<String> {
    let script = std::fs::read_to_string(AXE).ok();
    if script.is_none() {
        println!(
            "skipped: accessibility by axe-core: it is not there (cargo xtask test fetches it with npm)"
        );
    }
    script
}

/// What axe-core finds wrong with the page as it is: rules, and elements that break them.
fn violations(browser: &mut Browser) -> Value {
    browser.eval(
        "axe.run(document, { resultTypes: ['violations'] }).then(({ violations, passes }) => [...violations.map(({ id, nodes }) => \
         `${id}: ${nodes.map(({ html, failureSummary }) => html.slice(0, 160) + failureSummary).join('; ')}`), ...(passes.length > 9 ? [] : ['nothing was checked'])])",
    )
}

/// Both themes, on desktops and phones, with all that opens.
#[test]
fn axe_finds_nothing_that_people_cannot_use() {
    let Some(axe) = axe() else { return };
    let Some((_server, mut browser)) = page("demo:cornell", 1, [1360, 850]) else { return };
    browser.eval(&format!("{axe}; 0"));
    let [x, y] = middle(&mut browser);
    browser.click(x, y);
    browser.wait_for("vastlight.state.picked !== null");
    // Bookmarks, a region, the timeline.
    browser.eval("document.getElementById('viewport').focus()");
    for (key, code, modifiers) in [("!", "Digit1", 8), ("b", "KeyB", 0), ("Enter", "Enter", 0)] {
        browser.key(key, code, modifiers);
    }
    browser.eval("document.getElementById('timeline').hidden = false");
    let dialogs = [
        ("scenes", "open-scenes", "click"),
        ("help", "help-open", "click"),
        ("text-dialog", "text-dialog", "showModal"),
    ];
    let notices = ["loading", "failed", "welcome", "offline", "take-over", "steer-state"];
    for (width, height) in [(1360, 850), (390, 844)] {
        browser.resize(width, height, width < 500);
        for theme in ["dark", "light"] {
            browser.eval(&format!("document.documentElement.dataset.theme = '{theme}'"));
            browser.eval("document.body.classList.remove('no-panel')");
            let clean = |browser: &mut Browser, what: &str| {
                assert_eq!(violations(browser), json!([]), "{width} x {height}, {theme}, {what}");
            };
            clean(&mut browser, "panel");
            for (dialog, opener, act) in dialogs {
                browser.eval(&format!("document.getElementById('{opener}').{act}()"));
                browser.wait_for(&format!("document.getElementById('{dialog}').open"));
                clean(&mut browser, dialog);
                browser.eval(&format!("document.getElementById('{dialog}').close()"));
            }
            for notice in notices {
                browser.eval(&format!("document.getElementById('{notice}').hidden = false"));
                clean(&mut browser, notice);
                browser.eval(&format!("document.getElementById('{notice}').hidden = true"));
            }
        }
    }
    browser.eval("document.querySelector('main').append(document.createElement('button'))");
    browser.eval("document.getElementById('activity').style.color = '#777'");
    let found = violations(&mut browser).to_string();
    assert!(found.contains("button-name") && found.contains("color-contrast"), "the check finds: {found}");
}

/// Percentile of times.
fn at(sorted: &[f64], part: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * part).round() as usize]
}

/// A number of the environment: `VASTLIGHT_VIEW_MEMORY` is a budget in bytes, `VASTLIGHT_VIEW_SPP` are samples a pixel.
fn number<T: std::str::FromStr>(name: &str) -> Option<T> {
    std::env::var(name).ok().and_then(|text| text.parse().ok())
}

/// A page without a scene that opens one itself; that of `VASTLIGHT_VIEW_SCENE` within `VASTLIGHT_VIEW_MEMORY` bytes, if they are there.
fn opening(size: [u32; 2]) -> Option<(Server, Browser, String)> {
    let mut browser = browser::start()?;
    let source = std::env::var("VASTLIGHT_VIEW_SCENE").unwrap_or_else(|_| "demo:cornell".into());
    let path = Path::new(&source);
    let folder = (!source.starts_with("demo:")).then(|| path.parent().expect("a folder").to_owned());
    let name =
        folder.as_ref().map_or(&source[..], |_| path.file_name().expect("a file").to_str().expect("UTF-8"));
    let memory = number("VASTLIGHT_VIEW_MEMORY");
    let server = Server::start(Viewer { folder, memory, spp: 64, ..Viewer::default() }).expect("started");
    browser.open(server.url(), size[0], size[1]);
    browser.wait_for("vastlight.state.phase === 'idle' && vastlight.state.steering");
    browser.eval(&format!("vastlight.open({})", json!(name)));
    browser.wait_for(READY);
    Some((server, browser, source))
}

/// Opening to first picture, and input to picture under a scripted drag. `VASTLIGHT_SOAK` measures at 1280 x 720 what a short run only tries.
#[test]
fn pictures_follow_a_drag() {
    let soak = std::env::var_os("VASTLIGHT_SOAK").is_some();
    let (size, steps) = if soak { ([1280, 768], 300) } else { ([480, 360], 40) };
    let Some((_server, mut browser, scene)) = opening(size) else { return };
    let first =
        browser.eval("vastlight.measured.first - vastlight.measured.opened").as_f64().expect("a time");
    assert!(first > 0.0);
    if soak {
        browser.eval("(() => { const s = [...document.querySelectorAll('select')].find((s) => s.value.startsWith('fit') || s.value.includes('x')); \
                      s.value = '1280x720'; s.dispatchEvent(new Event('change')); })()");
    }
    browser.eval("document.getElementById('panel-toggle').click()");
    std::thread::sleep(Duration::from_secs(2));
    let [x, y] = middle(&mut browser);
    browser.eval("Object.assign(vastlight.measured, { latencies: [], pictures: 0, bytes: 0 })");
    let start = Instant::now();
    browser.mouse("mousePressed", x, y, 1);
    for i in 0..steps {
        let angle = f64::from(i) * 0.05;
        browser.mouse("mouseMoved", x + 150.0 * angle.sin(), y + 60.0 * (angle * 0.7).sin(), 1);
        std::thread::sleep(Duration::from_millis(16));
    }
    let drag = start.elapsed().as_secs_f64();
    let measured = browser.eval("vastlight.measured");
    browser.mouse("mouseReleased", x, y, 1);
    let mut times: Vec<f64> =
        measured["latencies"].as_array().expect("times").iter().filter_map(Value::as_f64).collect();
    times.sort_by(f64::total_cmp);
    assert!(times.len() > 10, "{measured}");
    let (pictures, bytes) =
        (measured["pictures"].as_f64().expect("a number"), measured["bytes"].as_f64().expect("a number"));
    println!(
        "{scene} {}x{}: first picture after {first:.0} ms, input to picture p50 {:.0} ms, p95 {:.0} ms of {}, {:.1} pictures/s, {:.0} kB a picture, {:.0} kB/s",
        measured["last"]["full"][0],
        measured["last"]["full"][1],
        at(&times, 0.5),
        at(&times, 0.95),
        times.len(),
        pictures / drag,
        bytes / pictures / 1e3,
        bytes / drag / 1e3,
    );
    assert!(at(&times, 0.5) < 2000.0, "pictures do not follow");
}

/// A megabit a second and 200 ms: the newest picture comes, not a queue of old ones. A tab that is closed then leaves no work.
#[test]
fn a_slow_network_shows_the_newest_and_a_closed_tab_ends_the_work() {
    let Some((server, mut browser)) = slow_page("demo:still-life", 60_000, [1400, 1000]) else { return };
    // What is computed fast is large: the network is what is slow.
    browser.eval("document.querySelector('input[value=albedo]').click()");
    std::thread::sleep(Duration::from_secs(3));
    let [x, y] = middle(&mut browser);
    browser.eval("Object.assign(vastlight.measured, { latencies: [], pictures: 0, bytes: 0 })");
    let start = Instant::now();
    browser.mouse("mousePressed", x, y, 1);
    for i in 0..150 {
        let angle = f64::from(i) * 0.05;
        browser.mouse("mouseMoved", x + 150.0 * angle.sin(), y + 60.0 * (angle * 0.7).sin(), 1);
        std::thread::sleep(Duration::from_millis(20));
    }
    browser.mouse("mouseReleased", x, y, 1);
    let drag = start.elapsed().as_secs_f64();
    let measured = browser.eval("vastlight.measured");
    browser.wait_for("vastlight.measured.last.input === vastlight.state.input");
    let behind = start.elapsed().as_secs_f64() - drag;
    let mut times: Vec<f64> =
        measured["latencies"].as_array().expect("times").iter().filter_map(Value::as_f64).collect();
    times.sort_by(f64::total_cmp);
    let middling = at(&times, 0.5);
    assert!(middling < 1000.0 && behind < 1.5, "{middling:.0} ms, {behind:.1} s after the drag: {measured}");

    // Samples are counted when a pass is done: that of a small picture is soon.
    browser.resize(420, 240, false);
    browser.wait_for("vastlight.measured.last.full[1] < 240");
    let rests = || {
        let before = server.rendered_samples();
        std::thread::sleep(Duration::from_millis(800));
        server.rendered_samples() == before
    };
    assert!(!rests(), "it refines while somebody looks");
    browser.call("Page.close", json!({}));
    assert!((0..50).any(|_| rests()), "it goes on when nobody looks");
}

/// The pictures of docs/gallery, into the folder that `VASTLIGHT_SCREENSHOTS` names.
#[test]
#[ignore = "makes pictures, proves nothing"]
fn screenshots() {
    let folder = std::env::var_os("VASTLIGHT_SCREENSHOTS").expect("VASTLIGHT_SCREENSHOTS names a folder");
    let scene = std::env::var("VASTLIGHT_VIEW_SCENE").unwrap_or_else(|_| "demo:still-life".into());
    for (name, size, scheme) in [
        ("viewer-dark", [1360, 850], "dark"),
        ("viewer-light", [1360, 850], "light"),
        ("viewer-phone", [390, 844], "dark"),
    ] {
        let Some(mut browser) = browser::start() else { return };
        let (memory, spp) = (number("VASTLIGHT_VIEW_MEMORY"), number("VASTLIGHT_VIEW_SPP").unwrap_or(32));
        let viewer = Viewer { source: Some(scene.clone()), memory, spp, ..Viewer::default() };
        let server = Server::start(viewer).expect("started");
        browser.prefer(scheme);
        browser.open(server.url(), size[0], size[1]);
        browser.wait_for(READY);
        let [x, y] = middle(&mut browser);
        browser.click(x, y);
        browser.wait_for("vastlight.state.picked !== null");
        if name == "viewer-phone" {
            browser.eval("document.getElementById('panel-toggle').click()");
        }
        browser.wait_for(DONE);
        std::thread::sleep(Duration::from_secs(1));
        let file = std::path::Path::new(&folder).join(format!("{name}.png"));
        std::fs::write(file, browser.screenshot()).expect("written");
    }
}
