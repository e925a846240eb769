//! Live pictures are those of `render`, however they come about.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use vastlight::film::{Aov, Picture};
use vastlight::math::Vec3;
use vastlight::transport::photon::PhotonSettings;
use vastlight::transport::{Integrator, RenderSettings, Tile};
use vastlight::{
    CameraChoice, Control, LivePicture, LoadOptions, Overrides, PackControl, RenderRequest, Session, open,
    pack_input, pack_within, render,
};

fn session(source: &str) -> Session {
    let options = LoadOptions::default();
    Session::new(open(source, &options).expect("opened"), source, &options)
}

fn request(session: &Session, spp: u32) -> RenderRequest {
    let camera = CameraChoice::default().resolve(&session.open().scene).expect("a camera");
    let settings = RenderSettings { max_depth: 5, ..RenderSettings::new(camera, 60, 48) };
    RenderRequest { aovs: vec![Aov::Normal, Aov::Object], ..RenderRequest::new(settings, spp) }
}

fn rendered(source: &str, options: &LoadOptions, request: &RenderRequest) -> Picture {
    let cancel = AtomicBool::new(false);
    let control = Control::new(&cancel, &|_| {});
    render(&open(source, options).expect("opened"), request, &control).expect("rendered").develop()
}

/// A picture that is stopped after every few tiles, while another is made in between.
fn in_pieces(session: &mut Session, request: &RenderRequest) -> LivePicture {
    let pictures = session.live(request, |live| {
        let mut picture = live.begin(request.clone()).expect("begun");
        let mut pieces = 0;
        for spp in [1, request.spp] {
            loop {
                let tiles = AtomicU32::new(0);
                let stop = || tiles.fetch_add(1, Ordering::Relaxed) > 2;
                if live.advance(&mut picture, spp, &stop).expect("advanced") {
                    break;
                }
                pieces += 1;
                let small =
                    RenderSettings { width: 20, height: 10, caustics: None, ..request.settings.clone() };
                let mut other = live.begin(RenderRequest::new(small, 1)).expect("begun");
                assert!(live.advance(&mut other, 1, &|| false).expect("advanced"));
            }
        }
        assert!(pieces > 1, "{pieces}");
        picture
    });
    pictures.expect("live")
}

#[test]
fn a_picture_in_pieces_is_the_picture_in_one() {
    let mut session = session("demo:cornell");
    let request = request(&session, 5);
    let expected = rendered("demo:cornell", &LoadOptions::default(), &request);
    assert_eq!(in_pieces(&mut session, &request).develop(), expected);
    let other = RenderRequest { spp: 4, ..request };
    assert_ne!(in_pieces(&mut session, &other).develop(), expected, "fewer samples are another picture");
}

#[test]
fn photons_belong_to_their_sample() {
    let mut session = session("demo:caustic-sphere");
    let mut request = request(&session, 3);
    request.settings.caustics = Some(PhotonSettings { photons: Some(20_000), ..PhotonSettings::default() });
    let expected = rendered("demo:caustic-sphere", &LoadOptions::default(), &request);
    assert_eq!(in_pieces(&mut session, &request).develop(), expected);
}

/// Parts that go ahead of the rest leave no trace, with photons neither.
#[test]
fn a_picture_that_was_limited_is_the_picture_in_one() {
    let mut session = session("demo:caustic-sphere");
    let mut request = request(&session, 4);
    for photons in [None, Some(20_000)] {
        request.settings.caustics =
            photons.map(|photons| PhotonSettings { photons: Some(photons), ..PhotonSettings::default() });
        let expected = rendered("demo:caustic-sphere", &LoadOptions::default(), &request);
        let picture = session.live(&request, |live| {
            let mut picture = live.begin(request.clone()).expect("begun");
            let mut to = |picture: &mut LivePicture, spp: u32, region: Option<[[u32; 2]; 2]>| {
                picture.limit(region.map(|[min, max]| Tile { min, max }));
                assert!(live.advance(picture, spp, &|| false).expect("advanced"));
                assert!(picture.is_even() && picture.spp() >= spp);
            };
            to(&mut picture, 1, None);
            let samples = picture.cost().samples;
            to(&mut picture, 3, Some([[20, 20], [30, 30]]));
            assert!(picture.cost().samples - samples < samples, "of few tiles");
            to(&mut picture, 4, Some([[0, 0], [60, 10]]));
            picture.limit(None);
            assert!(!picture.is_even() && picture.spp() == 1);
            // Outside of the picture is nothing that could be limited to.
            to(&mut picture, 4, Some([[90, 90], [95, 95]]));
            picture.develop()
        });
        assert_eq!(picture.expect("live"), expected);
    }
}

#[test]
fn stores_are_live_too() {
    let (_folder, source) = stored("demo:statue");
    let options = LoadOptions::default();
    let mut session = session(&source);
    let request = request(&session, 2);
    assert_eq!(in_pieces(&mut session, &request).develop(), rendered(&source, &options, &request));
    let counts = session.live(&request, |live| (live.paging(), live.residency())).expect("live");
    assert!(counts.0.is_some_and(|paging| paging.geometry.reads > 0), "caches stay from one to the next");
    assert!(counts.1.is_some_and(|residency| residency.resident_bytes > 0));
}

/// A triangle whose emission is beyond the largest number in single precision.
const BRIGHT: &str = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}],
    "extensionsUsed": ["KHR_materials_emissive_strength"],
    "materials": [{"emissiveFactor": [1, 1, 1], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 1e39}}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-5, -5, 0], "max": [5, 5, 0]}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}],
    "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AACgwAAAoMAAAAAAAACgQAAAoMAAAAAAAAAAAAAAoEAAAAAA"}]}"#;

#[test]
fn samples_are_counted_where_they_are_taken_and_where_they_were_not_finite() {
    let counts = |session: &mut Session| {
        let request = self::request(session, 2);
        let counted = session.live(&request, |live| {
            let mut picture = live.begin(request.clone()).expect("begun");
            let tiles = AtomicU32::new(0);
            let stop = || tiles.fetch_add(1, Ordering::Relaxed) > 0;
            live.advance(&mut picture, 1, &stop).expect("advanced");
            let uneven = picture.samples();
            live.advance(&mut picture, 2, &|| false).expect("advanced");
            (uneven, picture.samples(), picture.cost().non_finite)
        });
        counted.expect("live")
    };
    let (uneven, [taken, given], lost) = counts(&mut session("demo:cornell"));
    assert!(uneven[0].contains(&0) && uneven[0].contains(&1) && uneven[0] == uneven[1]);
    assert_eq!((taken.len(), lost), (60 * 48, 0));
    assert!(taken.iter().chain(&given).all(|&n| n == 2));
    // A lamp beyond all numbers.
    let folder = tempfile::tempdir().expect("a folder");
    let bright = folder.path().join("bright.gltf");
    std::fs::write(&bright, BRIGHT).expect("written");
    let (_, [taken, given], lost) = counts(&mut session(&bright.display().to_string()));
    assert!(given.iter().all(|&n| n == 2) && lost > 0, "{lost}");
    assert!(taken.contains(&0) && taken.contains(&2), "a triangle, and what is beside it");
    let missing: u32 = taken.iter().zip(&given).map(|(taken, given)| given - taken).sum();
    assert_eq!(u64::from(missing), lost);
}

#[test]
fn steps_are_whole_numbers_and_of_scenes_in_memory() {
    let mut session = session("demo:cornell");
    let mut request = request(&session, 1);
    request.settings.integrator = Integrator::Steps;
    let picture = in_pieces(&mut session, &RenderRequest { spp: 3, ..request.clone() }).develop();
    assert_eq!(
        picture,
        rendered("demo:cornell", &LoadOptions::default(), &RenderRequest { spp: 3, ..request.clone() })
    );
    let once = rendered("demo:cornell", &LoadOptions::default(), &request);
    let steps = once.plane("R").expect("numbers");
    assert!(steps.iter().all(|x| x.fract() == 0.0 && *x < 1000.0));
    assert!(steps.iter().any(|x| *x >= 3.0) && steps.iter().any(|x| x != &steps[0]));
    let (_folder, source) = stored("demo:cornell");
    let mut session = self::session(&source);
    let refused = session.live(&request, |live| live.begin(request.clone()).map(|_| ())).expect("live");
    assert!(refused.is_err_and(|e| e.what.contains("in memory")));
}

/// A store of a scene in a folder of its own.
fn stored(scene: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.vls");
    let input = pack_input(&[scene.to_owned()], &LoadOptions::default(), None).expect("an input");
    let control = PackControl { memory: None, cancel: &AtomicBool::new(false), progress: &|_| {} };
    pack_within(input, &path, &vastlight::store::PackConfig::default(), control).expect("packed");
    let source = path.display().to_string();
    (folder, source)
}

#[test]
fn revised_scenes_are_those_opened_with_overrides() {
    let mut session = session("demo:still-life");
    let request = request(&session, 2);
    let names: Vec<String> = session.open().scene.materials().iter().map(|m| m.name.clone()).collect();
    let text = |roughness: f32| {
        format!("[materials.\"{}\"]\nroughness = {roughness}\nbase_color = [0.9, 0.1, 0.1]\n", names[0])
    };
    let overrides = |text: &str| Overrides::parse(text, "edits").expect("parsed");
    session.revise(&overrides(&text(0.9))).expect("revised");
    session.revise(&overrides(&text(0.1))).expect("revised again: from the scene as it was opened");
    let picture = in_pieces(&mut session, &request).develop();
    let options = LoadOptions { overrides: vec![overrides(&text(0.1))], ..LoadOptions::default() };
    assert_eq!(picture, rendered("demo:still-life", &options, &request));
    let plain = rendered("demo:still-life", &LoadOptions::default(), &request);
    assert_ne!(picture, plain);
    let error = session.revise(&overrides("[materials.nothing]\nroughness = 1\n"));
    assert!(error.is_err_and(|e| e.hint.contains(&names[0])));
    session.revise(&Overrides::default()).expect("as it was");
    assert_eq!(in_pieces(&mut session, &request).develop(), plain);
}

#[test]
fn what_moves_keeps_its_changed_looks() {
    for source in ["demo:bodies", "demo:walker"] {
        let mut session = session(source);
        let name = session.open().scene.materials()[0].name.clone();
        let text = format!("[materials.\"{name}\"]\nbase_color = [0.0, 0.9, 0.1]\n");
        let overrides = Overrides::parse(&text, "edits").expect("parsed");
        session.revise(&overrides).expect("revised");
        assert!(session.movement().is_some());
        session.pose(0.5).expect("posed");
        let request = request(&session, 1);
        let options = LoadOptions { overrides: vec![overrides], time: Some(0.5), ..LoadOptions::default() };
        let picture = in_pieces(&mut session, &request).develop();
        assert_eq!(picture, rendered(source, &options, &request), "{source}");
    }
}

#[test]
fn what_is_picked_is_what_is_there() {
    let mut session = session("demo:cornell");
    let request = request(&session, 1);
    let seen = session
        .live(&request, |live| {
            let integrator = Integrator::Path;
            let settings = RenderSettings { integrator, ..request.settings.clone() };
            let picked = live.pick(&settings, [30, 41]).expect("picked").expect("the floor");
            let above = RenderSettings {
                camera: vastlight::scene::Camera::look_at("up", Vec3::splat(1e4), Vec3::splat(2e4), 0.5),
                ..settings
            };
            assert_eq!(live.pick(&above, [3, 3]).expect("picked"), None);
            (picked, live.scene().clone())
        })
        .expect("live");
    let (picked, scene) = seen;
    let mesh = &scene.meshes()[picked.mesh as usize];
    let triangle = mesh.triangles[picked.primitive.expect("a triangle") as usize];
    let map = scene.instances().map(picked.instance as usize);
    let [a, b, c] = triangle.map(|i| map.transform_point3(mesh.positions[i as usize]));
    let normal = (b - a).cross(c - a).normalize();
    assert!((picked.position - a).dot(normal).abs() < 1e-4, "{picked:?}");
    assert!(picked.bounds.min.cmple(picked.position + 1e-3).all());
    assert!(picked.bounds.max.cmpge(picked.position - 1e-3).all());
    assert_eq!(picked.material, mesh.material_of(picked.primitive.expect("a triangle")));
}
