//! The server as a browser sees it: who comes in, what is shown, and what happens to those who misbehave.

mod common;

use common::{Event, Page, fetch, get, parts, server};
use serde_json::{Value, json};
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use tungstenite::Message;
use vastlight::film::{PngOptions, encode_exr, encode_png};
use vastlight::math::{Affine3, Vec3};
use vastlight::store::PackConfig;
use vastlight::transport::RenderSettings;
use vastlight::{
    CameraChoice, Control, LoadOptions, Overrides, RenderRequest, Session, open, pack, render, stream,
};
use vastlight_viewer::{Server, Viewer};

const SMALL: [u32; 2] = [64, 48];

fn small() -> Value {
    json!({"do": "size", "size": {"width": SMALL[0], "height": SMALL[1]}})
}

/// What `vastlight render` makes of a scene.
fn rendered(
    source: &str,
    choice: &CameraChoice,
    spp: u32,
    overrides: Option<&str>,
) -> vastlight::film::Picture {
    let overrides = overrides.iter().map(|text| Overrides::parse(text, "edits").expect("parsed")).collect();
    let open = open(source, &LoadOptions { overrides, ..LoadOptions::default() }).expect("opened");
    let camera = choice.resolve(&open.scene).expect("a camera");
    let request = RenderRequest::new(RenderSettings::new(camera, SMALL[0], SMALL[1]), spp);
    let cancel = AtomicBool::new(false);
    render(&open, &request, &Control::new(&cancel, &|_| {})).expect("rendered").develop()
}

#[test]
fn strangers_get_nothing() {
    let server = server(None, 1);
    let (host, token) = parts(server.url());
    let status = |path: &str, name: &str, origin: Option<&str>| get(&host, path, name, origin).status;
    let all = ["/", "/ws", "/snapshot.png", "/snapshot.exr", "/page/wrong/main.js", "/nothing"];
    for path in all {
        assert_eq!(status(path, &host, None), 403, "{path} without token");
        assert_eq!(status(&format!("{path}?token=0{token}"), &host, None), 403, "{path}");
    }
    let page = format!("/?token={token}");
    assert_eq!(status(&page, &host, None), 200);
    assert_eq!(status(&page, "evil.example", None), 403);
    assert_eq!(status(&page, &host, Some("http://evil.example")), 403);
    assert_eq!(status(&format!("/nothing?token={token}"), &host, None), 404);
    let socket = format!("/ws?token={token}");
    let refusal =
        |path: &str, headers: &[(&'static str, &str)]| Page::with_headers(&host, path, headers).err();
    assert_eq!(refusal(&socket, &[]), None);
    assert_eq!(refusal(&socket, &[("origin", &format!("http://{host}"))]), None);
    assert_eq!(refusal("/ws", &[]), Some(403));
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1"] {
        assert_eq!(refusal(&socket, &[("origin", origin)]), Some(403), "{origin}");
    }
    assert_eq!(refusal(&socket, &[("host", "evil.example")]), Some(403));
}

#[test]
fn the_page_is_there_and_may_load_nothing_else() {
    let server = server(None, 1);
    let answer = fetch(server.url(), "");
    let (_, token) = parts(server.url());
    assert!(answer.head.contains("default-src 'none'") && answer.head.contains("no-referrer"));
    let html = String::from_utf8(answer.body).expect("text");
    assert!(html.contains(&format!("page/{token}/main.js")));
    let script = fetch(server.url(), &format!("page/{token}/main.js"));
    assert!(script.status == 200 && script.head.contains("text/javascript"));
    assert_eq!(fetch(server.url(), &format!("page/{token}/other.js")).status, 404);
    assert_eq!(fetch(server.url(), "snapshot.png").status, 409, "there is no scene");
}

#[test]
fn a_picture_at_rest_is_that_of_render() {
    let server = server(Some("demo:cornell"), 3);
    let mut page = Page::open(server.url());
    page.wait_until("scene", |scene| scene["phase"] == "ready");
    page.send(&small());
    let is_done = |p: &common::Picture| p.is_final && p.size == SMALL.map(|n| n as u16);
    let picture = page.picture_until(is_done);
    let expected = rendered("demo:cornell", &CameraChoice::default(), 3, None);
    assert!(picture.file == encode_png(&expected, &PngOptions::default()).expect("encoded"));
    assert!(fetch(server.url(), "snapshot.exr").body == encode_exr(&expected).expect("encoded"));

    // From elsewhere.
    let camera = json!({"eye": [1.5, 1.25, 3.0], "target": [0.1, 0.75, 0.0], "fov": 47.5});
    page.send(&json!({"do": "camera", "camera": camera, "input": 7}));
    let picture = page.picture_until(|p| is_done(p) && p.input == 7);
    let look_at = Some([Vec3::new(1.5, 1.25, 3.0), Vec3::new(0.1, 0.75, 0.0)]);
    let choice = CameraChoice { name: None, look_at, fov: Some(47.5) };
    let expected = rendered("demo:cornell", &choice, 3, None);
    let png = encode_png(&expected, &PngOptions::default()).expect("encoded");
    assert!(picture.file == png && fetch(server.url(), "snapshot.png").body == png);
    let fewer = rendered("demo:cornell", &choice, 2, None);
    assert!(picture.file != encode_png(&fewer, &PngOptions::default()).expect("encoded"));

    // Developed in another way, without another sample.
    let before = server.rendered_samples();
    page.send(&json!({"do": "tone", "tone": {"exposure": 1.0, "curve": "reinhard"}}));
    let options =
        PngOptions { exposure: 1.0, curve: "reinhard".parse().expect("a curve"), ..PngOptions::default() };
    let brighter = encode_png(&expected, &options).expect("encoded");
    page.picture_until(|p| p.is_final && p.file == brighter);
    assert_eq!(server.rendered_samples(), before);

    // More samples go on from those that are there.
    page.send(&json!({"do": "render", "render":
        {"integrator": "path", "max_depth": 16, "spp": 5, "seed": 0, "caustics": false}}));
    let expected = rendered("demo:cornell", &choice, 5, None);
    let png = encode_png(&expected, &options).expect("encoded");
    page.picture_until(|p| p.is_final && p.file == png);
    assert_eq!(server.rendered_samples() - before, u64::from(2 * SMALL[0] * SMALL[1]));
}

#[test]
fn materials_and_moments_change_while_one_looks() {
    let server = server(Some("demo:still-life"), 2);
    let mut page = Page::open(server.url());
    let scene = page.wait_until("scene", |scene| scene["phase"] == "ready");
    let name = scene["inventory"]["materials"][0]["name"].as_str().expect("a name").to_owned();
    page.send(&small());
    let plain = page.picture_until(|p| p.is_final && p.size == SMALL.map(|n| n as u16));
    page.send(&json!({"do": "material", "name": name, "edit": {"base_color": [1.0, 0.0, 0.25]}}));
    page.send(&json!({"do": "material", "name": name, "edit": {"roughness": 0.5}}));
    page.send(&json!({"do": "share"}));
    let shared = page.wait_for("share");
    let text = shared["overrides"].as_str().expect("text");
    let expected = rendered("demo:still-life", &CameraChoice::default(), 2, Some(text));
    let png = encode_png(&expected, &PngOptions::default()).expect("encoded");
    assert!(png != plain.file);
    page.picture_until(|p| p.is_final && p.file == png);
    assert!(
        shared["command"].as_str().is_some_and(|c| c.contains("demo:still-life") && c.contains("--override"))
    );
    page.send(&json!({"do": "revert"}));
    page.picture_until(|p| p.is_final && p.file == plain.file);
    page.send(&json!({"do": "material", "name": "no such thing", "edit": {"roughness": 0.5}}));
    let error = page.wait_for("error");
    assert!(error["what"].as_str().is_some_and(|what| what.contains("no such thing")), "{error}");
    page.send(&json!({"do": "time", "seconds": 1.0}));
    assert!(page.wait_for("error")["what"].as_str().is_some_and(|what| what.contains("moves")));
}

/// What [`Session::place`] and a picture make of a scene.
fn placed(source: &str, instance: u32, rows: [[f32; 4]; 3]) -> Vec<u8> {
    let options = LoadOptions::default();
    let mut session = Session::new(open(source, &options).expect("opened"), source, &options);
    let column = |i: usize| Vec3::new(rows[0][i], rows[1][i], rows[2][i]);
    let place = Affine3::from_cols(column(0), column(1), column(2), column(3));
    session.place(instance, place).expect("placed");
    let camera = CameraChoice::default().resolve(&session.open().scene).expect("a camera");
    let request = RenderRequest::new(RenderSettings::new(camera, SMALL[0], SMALL[1]), 2);
    let cancel = AtomicBool::new(false);
    let rendered = session.render(&request, &Control::new(&cancel, &|_| {})).expect("rendered");
    encode_png(&rendered.develop(), &PngOptions::default()).expect("encoded")
}

fn picked(page: &mut Page, x: f64, y: f64) -> Value {
    page.send(&json!({"do": "pick", "x": x, "y": y}));
    page.wait_for("picked")
}

/// In memory and in a store: the picture is that of a session whose object was put there, and `revert` takes it back.
#[test]
fn an_object_is_put_elsewhere_and_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = folder.path().join("still-life.vls");
    let whole = stream("demo:still-life", &LoadOptions::default()).expect("a demo");
    pack(whole, &store, &PackConfig::default(), |_| {}).expect("packed");
    for source in ["demo:still-life", store.to_str().expect("UTF-8")] {
        let server = server(Some(source), 2);
        let mut page = Page::open(server.url());
        page.wait_until("scene", |scene| scene["phase"] == "ready");
        page.send(&small());
        let plain = page.picture_until(|p| p.is_final && p.size == SMALL.map(|n| n as u16));
        let before = picked(&mut page, 0.5, 0.6);
        assert_eq!(before["held"], Value::Null);
        let instance = before["instance"].as_u64().expect("a number") as u32;
        let mut rows: [[f32; 4]; 3] =
            serde_json::from_value(before["opened"]["place"].clone()).expect("rows");
        (rows[1][3], rows[1][0]) = (rows[1][3] + 0.15, rows[1][0] + 0.1);
        let expected = placed(source, instance, rows);
        assert!(expected != plain.file, "it is seen");
        page.send(&json!({"do": "object", "instance": instance, "place": rows}));
        page.picture_until(|p| p.is_final && p.file == expected);
        page.send(&json!({"do": "share"}));
        let line = format!("s.set_instance_transform({instance}, [{:?}, ", rows[0]);
        let shared = page.wait_for("share");
        assert!(shared["python"].as_str().is_some_and(|text| text.contains(&line)), "{shared}");

        // Where it was is known still.
        let after = picked(&mut page, 0.5, 0.55);
        if after["instance"] == instance {
            assert_eq!(after["opened"], before["opened"]);
            assert_ne!(after["bounds"], before["bounds"]);
        }
        page.send(&json!({"do": "object", "instance": instance, "place": null}));
        page.picture_until(|p| p.is_final && p.file == plain.file);
        page.send(&json!({"do": "object", "instance": instance, "place": rows}));
        page.picture_until(|p| p.is_final && p.file == expected);
        page.send(&json!({"do": "revert"}));
        page.picture_until(|p| p.is_final && p.file == plain.file);

        // What cannot be is told, and changes nothing else.
        let flat = [[0.0; 4]; 3];
        page.send(&json!({"do": "object", "instance": 1 << 30, "place": flat}));
        page.send(&json!({"do": "object", "instance": instance, "place": rows}));
        page.send(&json!({"do": "object", "instance": 1 << 29, "place": flat}));
        page.picture_until(|p| p.is_final && p.file == expected);
        page.send(&json!({"do": "pause", "paused": false}));
        page.wait_until("state", |state| {
            state["view"]["objects"].as_object().is_some_and(|objects| objects.len() == 1)
        });
        page.send(&json!({"do": "revert"}));
        page.picture_until(|p| p.is_final && p.file == plain.file);
        for (instance, place) in [(instance, flat), (1 << 30, rows)] {
            page.send(&json!({"do": "object", "instance": instance, "place": place}));
            assert!(page.wait_for("error")["what"].as_str().is_some_and(|what| !what.is_empty()));
            page.send(&json!({"do": "pause", "paused": false}));
            page.wait_until("state", |state| state["view"]["objects"] == json!({}));
        }
        page.send(&json!({"do": "reset"}));
        page.picture_until(|p| p.is_final && p.file == plain.file);
    }
}

#[test]
fn an_output_that_a_store_does_not_have_is_told_and_light_is_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = folder.path().join("cornell.vls");
    let whole = stream("demo:cornell", &LoadOptions::default()).expect("a demo");
    pack(whole, &store, &PackConfig::default(), |_| {}).expect("packed");
    let server = server(store.to_str(), 2);
    let mut page = Page::open(server.url());
    page.wait_until("scene", |scene| scene["phase"] == "ready");
    page.send(&small());
    let plain = page.picture_until(|p| p.is_final && p.size == SMALL.map(|n| n as u16));
    page.send(&json!({"do": "channel", "channel": "steps"}));
    assert!(page.wait_for("error")["what"].as_str().is_some_and(|what| what.contains("in memory")));
    page.picture_until(|p| p.is_final && p.file == plain.file);
    page.send(&json!({"do": "pause", "paused": false}));
    page.wait_until("state", |state| state["view"]["channel"] == "beauty");
}

/// Pixels of a file, by their places.
fn pixel(file: &[u8], x: u32, y: u32) -> image::Rgb<u8> {
    *image::load_from_memory(file).expect("a picture").to_rgb8().get_pixel(x, y)
}

#[test]
fn a_region_goes_on_and_the_rest_waits() {
    let server = server(Some("demo:cornell"), 2);
    let mut page = Page::open(server.url());
    page.wait_until("scene", |scene| scene["phase"] == "ready");
    page.send(&small());
    let plain = page.picture_until(|p| p.is_final && p.size == SMALL.map(|n| n as u16)).file;
    page.send(&json!({"do": "region", "region": [0.26, 0.3, 0.5, 0.5]}));
    let render =
        |spp: u32| json!({"integrator": "path", "max_depth": 16, "spp": spp, "seed": 0, "caustics": false});
    page.send(&json!({"do": "render", "render": render(12)}));
    let partly = page.picture_until(|p| p.is_final && p.spp == 12).file;
    let choice = CameraChoice::default();
    let finer = rendered("demo:cornell", &choice, 12, None);
    let finer = encode_png(&finer, &PngOptions::default()).expect("encoded");
    let places = || (0..SMALL[1]).flat_map(|y| (0..SMALL[0]).map(move |x| [x, y]));
    let inside = |[x, y]: &[u32; 2]| (16..32).contains(x) && (14..24).contains(y);
    // Tiles are of 16 pixels.
    let outside = |[x, y]: &[u32; 2]| !((16..32).contains(x) && *y < 32);
    assert!(places().filter(inside).all(|[x, y]| pixel(&partly, x, y) == pixel(&finer, x, y)));
    assert!(places().filter(outside).all(|[x, y]| pixel(&partly, x, y) == pixel(&plain, x, y)));
    assert!(partly != plain && partly != finer);

    page.send(&json!({"do": "share"}));
    let shared = page.wait_for("share");
    assert!(shared["command"].as_str().is_some_and(|line| line.contains("--crop 16,14,32,24 ")), "{shared}");
    assert!(shared["python"].as_str().is_some_and(|text| text.contains("crop=(16, 14, 32, 24)")), "{shared}");

    // From elsewhere all of the picture has a sample, and the region all.
    let camera = json!({"eye": [1.5, 1.25, 3.0], "target": [0.1, 0.75, 0.0], "fov": 47.5});
    let before = server.rendered_samples();
    page.send(&json!({"do": "camera", "camera": camera, "input": 7}));
    page.picture_until(|p| p.is_final && p.input == 7);
    let all = u64::from(12 * SMALL[0] * SMALL[1]);
    assert!(server.rendered_samples() - before < all / 2, "the region alone is refined");
    page.send(&json!({"do": "region", "region": null}));
    let look_at = Some([Vec3::new(1.5, 1.25, 3.0), Vec3::new(0.1, 0.75, 0.0)]);
    let whole = rendered("demo:cornell", &CameraChoice { name: None, look_at, fov: Some(47.5) }, 12, None);
    let png = encode_png(&whole, &PngOptions::default()).expect("encoded");
    page.picture_until(|p| p.is_final && p.file == png);
}

#[test]
fn what_moves_by_itself_is_left_where_it_is() {
    for (source, word) in [("demo:traffic", "animation"), ("demo:metaballs", "anew")] {
        let server = server(Some(source), 1);
        let mut page = Page::open(server.url());
        page.wait_until("scene", |scene| scene["phase"] == "ready");
        page.send(&small());
        let seen: Vec<Value> = (1..8)
            .flat_map(|y| (1..8).map(move |x| [x, y]))
            .map(|[x, y]| picked(&mut page, f64::from(x) / 8.0, f64::from(y) / 8.0))
            .collect();
        let held = seen.iter().find(|picked| picked["held"].as_str().is_some_and(|why| why.contains(word)));
        let held = held.unwrap_or_else(|| panic!("nothing moves: {seen:?}"));
        let place = &held["opened"]["place"];
        page.send(&json!({"do": "object", "instance": held["instance"], "place": place}));
        let error = page.wait_for("error");
        assert!(error["what"].as_str().is_some_and(|what| what.contains(word)), "{error}");
    }
}

#[test]
fn what_is_clicked_on_is_named() {
    let server = server(Some("demo:cornell"), 1);
    let mut page = Page::open(server.url());
    page.wait_until("scene", |scene| scene["phase"] == "ready");
    page.send(&small());
    page.send(&json!({"do": "pick", "x": 0.5, "y": 0.95}));
    let picked = page.wait_for("picked");
    assert!(picked["material"]["name"].is_string() && picked["primitive"].is_u64(), "{picked}");
    let away = json!({"eye": [0.0, 1e6, 0.0], "target": [0.0, 2e6, 1.0], "fov": 20.0});
    page.send(&json!({"do": "camera", "camera": away, "input": 1}));
    page.send(&json!({"do": "pick", "x": 0.5, "y": 0.5}));
    assert_eq!(page.wait_for("picked")["object"], Value::Null);
}

#[test]
fn every_output_is_shown() {
    let server = server(Some("demo:cornell"), 1);
    let mut page = Page::open(server.url());
    page.wait_until("scene", |scene| scene["phase"] == "ready");
    page.send(&small());
    let mut files = Vec::new();
    for channel in [
        "albedo",
        "normal",
        "depth",
        "alpha",
        "object",
        "material",
        "steps",
        "samples",
        "non_finite",
        "beauty",
    ] {
        page.send(&json!({"do": "channel", "channel": channel}));
        page.wait_until("state", |state| state["view"]["channel"] == channel);
        let picture = page.picture_until(|p| p.is_final && !files.contains(&p.file));
        assert!(image::load_from_memory(&picture.file).is_ok());
        files.push(picture.file);
    }
}

#[test]
fn nonsense_is_answered_and_giants_are_sent_away() {
    let server = server(Some("demo:cornell"), 1);
    let mut page = Page::open(server.url());
    for nonsense in
        [&b""[..], b"\x01", b"\x02", b"\x02{", b"\x02{\"do\":\"dance\"}", b"\x09abc", b"\x01abcdefgh"]
    {
        page.send_bytes(nonsense.to_vec());
        page.wait_for("error");
    }
    page.send_message(Message::Text("hello".into()));
    assert_eq!(page.wait_for("error")["what"], "messages are binary");
    let sent = page.send_message(Message::Binary(vec![2; 1 << 20].into()));
    let closed = |page: &mut Page| {
        std::iter::from_fn(|| page.next_within(Duration::from_secs(20))).any(|e| matches!(e, Event::Closed))
    };
    assert!(!sent || closed(&mut page));
    let mut page = Page::open(server.url());
    for _ in 0..120 {
        page.send_message(Message::Binary(vec![9].into()));
    }
    assert!(closed(&mut page), "nobody is listened to for ever");
    Page::open(server.url()).wait_until("scene", |scene| scene["phase"] == "ready");
}

#[test]
fn two_pictures_are_on_their_way_and_the_newest_is_next() {
    let server = server(Some("demo:cornell"), 1);
    let mut page = Page::open(server.url());
    page.wait_until("scene", |scene| scene["phase"] == "ready");
    page.send(&small());
    page.picture_until(|p| p.is_final);
    page.confirms = false;
    let mut came = Vec::new();
    for input in 1..=6 {
        let camera =
            json!({"eye": [0.1 * f64::from(input), 1.0, 3.0], "target": [0.0, 0.7, 0.0], "fov": 40.0});
        page.send(&json!({"do": "camera", "camera": camera, "input": input}));
        while let Some(event) = page.next_within(Duration::from_millis(400)) {
            if let Event::Picture(picture) = event {
                came.push(picture);
            }
        }
    }
    assert_eq!(came.len(), 2, "{:?}", came.iter().map(|p| p.number).collect::<Vec<_>>());
    page.confirm(came[1].number);
    let next = page.picture_until(|_| true);
    assert_eq!(next.input, 6, "those in between are left out");
}

#[test]
fn one_steers_another_watches_and_takes_over() {
    let server = server(Some("demo:cornell"), 1);
    let mut first = Page::open(server.url());
    let mut second = Page::open(server.url());
    first.send(&small());
    second.wait_until("state", |state| state["viewers"] == 2);
    second.send(&json!({"do": "pause", "paused": true}));
    assert!(second.wait_for("error")["what"].as_str().is_some_and(|what| what.contains("steers")));
    second.send(&json!({"do": "steer"}));
    second.send(&json!({"do": "pause", "paused": true}));
    let id = second.id;
    first.wait_until("state", |state| state["view"]["paused"] == true && state["steering"] == id);
    drop(second);
    let id = first.id;
    first.wait_until("state", |state| state["viewers"] == 1 && state["steering"] == id);
    // Who comes back finds all as it was.
    drop(first);
    let mut again = Page::open(server.url());
    let id = again.id;
    let state = again.wait_until("state", |state| state["steering"] == id);
    assert_eq!(state["view"]["paused"], json!(true));
    again.picture_until(|_| true);
}

#[test]
fn a_closed_tab_stops_the_work() {
    let server = server(Some("demo:cornell"), 60_000);
    let mut page = Page::open(server.url());
    page.send(&small());
    page.picture_until(|p| p.spp > 0 && p.size == SMALL.map(|n| n as u16));
    drop(page);
    let rest = |server: &Server| {
        let before = server.rendered_samples();
        std::thread::sleep(Duration::from_millis(300));
        server.rendered_samples() == before
    };
    assert!((0..100).any(|_| rest(&server)), "it goes on");
    let before = server.rendered_samples();
    let mut page = Page::open(server.url());
    let spp = page.picture_until(|p| p.spp > 0).spp;
    page.picture_until(|p| p.spp > spp);
    assert!(server.rendered_samples() > before);
}

#[test]
fn folders_are_listed_and_files_opened_from_below_alone() {
    let outer = tempfile::tempdir().expect("a folder");
    let shared = outer.path().join("shared");
    std::fs::create_dir(&shared).expect("made");
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(shared.join("a.obj"), triangle).expect("written");
    std::fs::write(shared.join("broken.glb"), "no").expect("written");
    std::fs::write(outer.path().join("secret.obj"), triangle).expect("written");
    let server =
        Server::start(Viewer { folder: Some(shared), spp: 1, ..Viewer::default() }).expect("started");
    let mut page = Page::open(server.url());
    page.send(&json!({"do": "files", "folder": ""}));
    assert_eq!(page.wait_for("files")["listing"]["files"][0]["name"], "a.obj");
    page.send(&json!({"do": "files", "folder": ".."}));
    page.wait_for("error");
    for outside in ["../secret.obj", "/etc/passwd", "a.obj/../../secret.obj"] {
        page.send(&json!({"do": "open", "source": outside}));
        let failed = page.wait_until("scene", |scene| scene["phase"] == "failed");
        assert_eq!(failed["source"], *outside, "{failed}");
    }
    page.send(&json!({"do": "open", "source": "broken.glb"}));
    let failed =
        page.wait_until("scene", |scene| scene["phase"] == "failed" && scene["source"] == "broken.glb");
    assert!(failed["what"].as_str().is_some_and(|what| !what.is_empty()));
    page.send(&json!({"do": "open", "source": "a.obj"}));
    page.wait_until("scene", |scene| scene["phase"] == "ready" && scene["source"] == "a.obj");
    page.send(&json!({"do": "open", "source": "demo:cornell"}));
    page.wait_until("scene", |scene| scene["phase"] == "ready" && scene["source"] == "demo:cornell");
}

#[test]
fn what_does_not_fit_is_refused_before_it_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let elements = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 900000000\nproperty list uchar int vertex_indices\n";
    // Whoever reads on finds nothing.
    std::fs::write(folder.path().join("large.ply"), format!("ply\nformat ascii 1.0\n{elements}end_header\n"))
        .expect("written");
    let viewer =
        Viewer { folder: Some(folder.path().to_owned()), memory: Some(1 << 30), ..Viewer::default() };
    let server = Server::start(viewer).expect("started");
    let mut page = Page::open(server.url());
    page.send(&json!({"do": "open", "source": "large.ply"}));
    let failed = page.wait_until("scene", |scene| scene["phase"] == "failed");
    assert!(failed["hint"].as_str().is_some_and(|hint| hint.contains("--memory")), "{failed}");
}

#[test]
fn the_end_is_told() {
    let server = server(None, 1);
    let mut page = Page::open(server.url());
    let ending = std::thread::spawn(move || drop(server));
    page.wait_for("closed");
    assert!(matches!(page.next_within(Duration::from_secs(5)), Some(Event::Closed)));
    ending.join().expect("ended");
}
