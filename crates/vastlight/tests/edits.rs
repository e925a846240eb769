//! Scenes changed by hand: what is traced and seen is that of a scene which was so from the start.

mod common;

use common::{differing, packed, request, square};
use std::sync::atomic::AtomicBool;
use vastlight::film::Picture;
use vastlight::math::{Affine3, Mat3, Ray, Vec3};
use vastlight::scene::{
    Camera, Instance, Light, LightKind, Material, Mesh, Part, Projection, Scene, SceneDesc,
};
use vastlight::store::PackConfig;
use vastlight::{
    Addition, Control, ErrorClass, LoadOptions, Overrides, RayArray, RayHits, Session, Table, open,
    open_store,
};

/// A wavy square with normals.
fn wavy(height: f32) -> Mesh {
    let mut mesh = square("wave", 0, 8, |x, y| Vec3::new(x, height * (3.0 * x).sin() * y, -y));
    mesh.normals = vec![Vec3::Y; mesh.positions.len()];
    mesh
}

fn aside(x: f32) -> Affine3 {
    Affine3::from_translation(Vec3::X * x)
}

fn session_of(desc: SceneDesc) -> Session {
    Session::new(Scene::new(desc).expect("valid").into(), "", &LoadOptions::default())
}

fn wave(mesh: Mesh, world_from_object: Affine3) -> Addition {
    Addition::Mesh { mesh: Box::new(mesh), material: None, world_from_object }
}

/// Rays straight down on a grid.
fn traced(session: &mut Session) -> RayHits {
    let ray = |i: usize| {
        let at = |i: usize| (i as f32 + 0.37) / 16.0 - 3.0;
        Ray::new(Vec3::new(at(i % 96), 5.0, at(i / 96)), Vec3::NEG_Y * 2.0)
    };
    let array = RayArray { count: 96 * 96, ray, memory: None, cancel: &AtomicBool::new(false) };
    let hits = session.trace(&array).expect("traced");
    let occluded = session.occluded(&array).expect("traced");
    assert!(occluded.iter().zip(&hits.t).all(|(occluded, t)| *occluded == t.is_finite()));
    hits
}

fn picture(session: &mut Session) -> Picture {
    let request = request(&session.open().scene);
    session.render(&request, &Control::new(&AtomicBool::new(false), &|_| {})).expect("renders").develop()
}

#[test]
fn hits_say_what_is_there() {
    let mut session = session_of(SceneDesc::default());
    assert!(traced(&mut session).t.iter().all(|t| t.is_infinite()));
    let mirrored =
        Affine3 { matrix3: Mat3::from_diagonal(Vec3::new(-1.0, 1.0, 1.0)), translation: Vec3::ZERO };
    session.add(vec![wave(wavy(0.0), mirrored)]).expect("added");
    let hits = traced(&mut session);
    let found = hits.t.iter().filter(|t| t.is_finite()).count();
    assert_eq!(found, 32 * 32, "a square of 2 among rays a sixteenth apart");
    for row in (0..hits.t.len()).filter(|&row| hits.t[row].is_finite()) {
        assert_eq!((hits.t[row], hits.instance[row], hits.normal[row]), (2.5, 0, [0.0, 1.0, 0.0]));
        assert!((0..128).contains(&hits.prim[row]) && hits.uv[row].iter().all(|w| (0.0..=1.0).contains(w)));
    }
    let miss = hits.t.iter().position(|t| t.is_infinite()).expect("some miss");
    assert_eq!(
        (hits.prim[miss], hits.instance[miss], hits.uv[miss], hits.normal[miss]),
        (-1, -1, [0.0; 2], [0.0; 3])
    );
}

#[test]
fn edits_in_any_order_come_to_the_same_scene() {
    let mut edited = session_of(SceneDesc::default());
    edited.add(vec![wave(wavy(0.1), aside(-0.5))]).expect("added");
    traced(&mut edited);
    edited.place(0, aside(0.75)).expect("placed");
    let fine = wavy(0.6).positions;
    edited.deform(0, fine, Some(wavy(0.6).normals)).expect("deformed");
    edited.add(vec![wave(wavy(0.2), aside(-1.0)), wave(wavy(0.0), aside(3.0))]).expect("added");
    edited.remove(&[2]).expect("removed");
    let fresh = SceneDesc {
        meshes: vec![wavy(0.6), wavy(0.2)],
        instances: vec![
            Instance { world_from_object: aside(0.75), mesh: 0, name: 0 },
            Instance { world_from_object: aside(-1.0), mesh: 1, name: 0 },
        ],
        names: vec!["wave".into()],
        materials: vec![Material::new("neutral")],
        ..SceneDesc::default()
    };
    let mut fresh = session_of(fresh);
    assert_eq!(traced(&mut edited), traced(&mut fresh));
    assert_eq!(edited.open().scene.bounds(), fresh.open().scene.bounds());
    assert_eq!(edited.open().scene.cameras(), fresh.open().scene.cameras(), "it frames what is there");
    assert_eq!(differing(&picture(&mut edited), &picture(&mut fresh)), 0);
}

#[test]
fn looks_outlive_edits() {
    let options = LoadOptions::default();
    let source = "demo:cornell";
    let mut edited = Session::new(open(source, &options).expect("opens"), source, &options);
    let red = Overrides::parse("[materials.\"*\"]\nbase_color = [0.6, 0.1, 0.1]", "test").expect("parsed");
    edited.revise(&red).expect("revised");
    edited.add(vec![wave(wavy(0.1), aside(0.0))]).expect("added");
    let scene = &edited.open().scene;
    assert!(scene.materials().iter().all(|m| m.base_color.factor == Vec3::new(0.6, 0.1, 0.1)));
    edited.revise(&Overrides::default()).expect("revised");
    assert!(edited.open().scene.materials().iter().any(|m| m.base_color.factor.y > 0.3));
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    let mut session = session_of(SceneDesc::default());
    session.add(vec![wave(wavy(0.1), aside(0.0))]).expect("added");
    let before = traced(&mut session);
    let mut broken = wavy(0.0);
    broken.triangles.push([0, 1, 999]);
    let flat = Affine3::from_scale(Vec3::new(1.0, 0.0, 1.0));
    let unknown = Addition::Mesh {
        mesh: Box::new(wavy(0.0)),
        material: Some("Gold".into()),
        world_from_object: aside(0.0),
    };
    let mut endless = wavy(0.0);
    endless.positions[3] = Vec3::NAN;
    for wrong in [wave(broken, aside(0.0)), wave(wavy(0.0), flat), unknown, wave(endless, aside(0.0))] {
        assert_eq!(session.add(vec![wrong]).expect_err("refused").class, ErrorClass::Scene);
    }
    assert!(session.place(0, flat).is_err() && session.place(7, aside(0.0)).is_err());
    assert!(
        session.deform(0, vec![Vec3::ZERO; 3], None).is_err() && session.deform(4, Vec::new(), None).is_err()
    );
    assert!(session.remove(&[5]).is_err());
    assert_eq!(traced(&mut session), before);
}

#[test]
fn rays_through_a_store_hit_what_they_hit_in_memory() {
    let name = "demo:still-life";
    let options = LoadOptions::default();
    let mut resident = Session::new(open(name, &options).expect("opens"), name, &options);
    let (bytes, _) = packed(name, &options, &PackConfig { page_bytes: 1 << 12, ..PackConfig::default() });
    let source = std::sync::Arc::new(vastlight::paging::MemorySource::new("a store", bytes));
    let mut stored = Session::new(open_store(source, &options).expect("opens"), "a.vls", &options);
    let (a, b) = (traced(&mut resident), traced(&mut stored));
    assert!(a.t.iter().any(|t| t.is_finite()));
    assert_eq!((&a.t, &a.prim, &a.uv), (&b.t, &b.prim, &b.uv));
    assert_eq!((&a.instance, &a.normal), (&b.instance, &b.normal));
    assert!(stored.add(vec![wave(wavy(0.1), aside(0.0))]).is_err());
}

#[test]
fn pictures_and_rays_of_a_store_share_its_pages() {
    let (name, options) = ("demo:still-life", LoadOptions::default());
    let (bytes, _) = packed(name, &options, &PackConfig { page_bytes: 1 << 12, ..PackConfig::default() });
    let source = std::sync::Arc::new(vastlight::paging::MemorySource::new("a store", bytes));
    let mut session = Session::new(open_store(source, &options).expect("opens"), "a.vls", &options);
    let request = request(&session.open().scene);
    let cancel = AtomicBool::new(false);
    let misses = |session: &mut Session| {
        let rendered = session.render(&request, &Control::new(&cancel, &|_| {})).expect("renders");
        rendered.stats.paging.expect("of a store").geometry.misses
    };
    assert!(misses(&mut session) > 0);
    traced(&mut session);
    assert_eq!(misses(&mut session), 0);
}

#[test]
fn a_mesh_whose_vertices_are_split_keeps_its_count() {
    let mut mesh = wavy(0.2);
    mesh.uvs = vec![mesh.positions.iter().map(|p| p.truncate().abs()).collect()];
    mesh.parts = vec![Part { first_triangle: 0, material: 0 }];
    let mut bent = Material::new("brushed");
    bent.anisotropy = 0.8;
    let instances = vec![Instance { world_from_object: aside(0.0), mesh: 0, name: 0 }];
    let desc = SceneDesc { meshes: vec![mesh], instances, materials: vec![bent], ..SceneDesc::default() };
    let mut session = session_of(desc);
    let count = session.open().scene.posed_vertices(0).len();
    for step in 1..4 {
        let lifted = |p: &Vec3| *p + Vec3::Y * step as f32 * 0.1;
        let positions: Vec<Vec3> = session.open().scene.posed_vertices(0).iter().map(lifted).collect();
        session.deform(0, positions, None).expect("fits");
        assert_eq!(session.open().scene.posed_vertices(0).len(), count);
    }
}

/// A map of two texels.
fn map(folder: &std::path::Path) -> std::path::PathBuf {
    let path = folder.join("sky.hdr");
    let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".to_vec();
    bytes.extend([128, 64, 32, 129, 32, 64, 128, 129]);
    std::fs::write(&path, bytes).expect("written");
    path
}

fn surrounded(path: &std::path::Path, strength: f32) -> Overrides {
    let text = format!("[environment]\nmap = '{}'\nstrength = {strength}", path.display());
    Overrides::parse(&text, "test").expect("parsed")
}

#[test]
fn looks_outlive_their_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = map(folder.path());
    let mut session = session_of(SceneDesc::default());
    session.revise(&surrounded(&path, 2.0)).expect("revised");
    let before = session.open().scene.environment().clone();
    let images = session.open().scene.images().to_vec();
    std::fs::remove_file(&path).expect("removed");
    session.add(vec![wave(wavy(0.1), aside(0.0))]).expect("added");
    assert_eq!((session.open().scene.environment(), session.open().scene.images()), (&before, &images[..]));
    assert!(session.revise(&surrounded(&folder.path().join("none.hdr"), 1.0)).is_err());
    assert_eq!((session.open().scene.environment(), session.open().scene.images()), (&before, &images[..]));
    // Half written by somebody else.
    std::fs::write(&path, "#?RADIANCE\n").expect("written");
    session.add(vec![wave(wavy(0.2), aside(1.0))]).expect("added");
    assert_eq!((session.open().scene.environment(), session.open().scene.images()), (&before, &images[..]));
    assert!(session.revise(&surrounded(&path, 3.0)).is_err(), "it cannot be read");
    assert_eq!((session.open().scene.environment(), session.open().scene.images()), (&before, &images[..]));
    std::fs::remove_file(&path).expect("removed");
    session.revise(&surrounded(&path, 2.0)).expect("it is known");
    assert_eq!((session.open().scene.environment(), session.open().scene.images()), (&before, &images[..]));
    session.revise(&Overrides::default()).expect("revised");
    assert!(session.open().scene.images().is_empty());
    assert!(session.revise(&surrounded(&path, 2.0)).is_err(), "it is gone");
    map(folder.path());
    session.revise(&surrounded(&path, 1.0)).expect("there again");
    assert_eq!(session.open().scene.images(), &images[..]);
    std::fs::write(&path, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n\x10\x10\x10\x81")
        .expect("written");
    session.revise(&surrounded(&path, 1.0)).expect("revised");
    assert_eq!(session.open().scene.images()[0].width, 1, "a file that changed is read again");
}

#[test]
fn a_moment_that_cannot_be_had_changes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = map(folder.path());
    let (source, options) = ("demo:metaballs", LoadOptions::default());
    let mut session = Session::new(open(source, &options).expect("opens"), source, &options);
    session.pose(0.25).expect("posed");
    session.revise(&surrounded(&path, 2.0)).expect("revised");
    let before = (traced(&mut session), session.open().scene.environment().clone());
    std::fs::remove_file(&path).expect("removed");
    assert!(session.pose(0.75).is_err());
    assert_eq!((traced(&mut session), session.open().scene.environment().clone()), before);
    map(folder.path());
    session.pose(0.75).expect("posed");
    assert_eq!(session.open().scene.environment(), &before.1, "it has its looks still");
    assert_ne!(traced(&mut session), before.0);
}

#[test]
fn what_waits_is_put_in_together() {
    let mut session = session_of(SceneDesc::default());
    let gold = || Addition::Material(Box::new(Material::new("gold")));
    let golden = |mesh: Mesh| Addition::Mesh {
        mesh: Box::new(mesh),
        material: Some("gold".into()),
        world_from_object: aside(0.0),
    };
    let mut broken = wavy(0.0);
    broken.triangles.push([0, 1, 999]);
    assert!(session.put(vec![gold(), golden(broken)]).is_err());
    assert!(!session.has(Table::Materials, "gold"), "all or none");
    session.put(vec![gold(), golden(wavy(0.1))]).expect("fits");
    session.put(vec![golden(wavy(0.2))]).expect("fits");
    assert!(session.has(Table::Materials, "gold") && session.open().scene.meshes().is_empty());
    session.settle().expect("settled");
    let gold = session.open().scene.materials().iter().position(|m| m.name == "gold").expect("there");
    let scene = &session.open().scene;
    assert!(scene.meshes().iter().all(|mesh| mesh.parts[0].material as usize == gold));
    assert_eq!(scene.meshes().len(), 2);
    session.deform(0, wavy(0.3).positions, None).expect("fits");
    assert!(session.moving_triangles() > 0);
    session.remove(&[1]).expect("removed");
    assert_eq!(session.moving_triangles(), 0, "all is built anew");
}

#[test]
fn numbers_that_mean_nothing_are_refused() {
    let light = |kind, intensity| {
        let (name, world_from_light) = ("lamp".to_owned(), aside(0.0));
        Addition::Light(Light {
            name,
            kind,
            world_from_light,
            intensity,
            range: f32::INFINITY,
            profile: None,
        })
    };
    let camera = |vertical_fov, lens_radius, focus_distance| {
        let projection = Projection::Perspective { vertical_fov, lens_radius, focus_distance };
        Addition::Camera(Camera { name: "c".into(), world_from_camera: aside(0.0), projection, aspect: None })
    };
    let mut session = session_of(SceneDesc::default());
    for wrong in [
        light(LightKind::Point, Vec3::new(f32::NAN, 0.0, 0.0)),
        light(LightKind::Point, Vec3::NEG_X),
        light(LightKind::Spot { inner: 2.0, outer: -1.0 }, Vec3::ONE),
        light(LightKind::Spot { inner: 0.0, outer: f32::NAN }, Vec3::ONE),
        camera(f32::NAN, 0.0, 1.0),
        camera(9.0, 0.0, 1.0),
        camera(1.0, -1.0, 1.0),
        camera(1.0, 0.0, 0.0),
    ] {
        assert!(session.add(vec![wrong.clone()]).is_err(), "{wrong:?}");
    }
    session
        .add(vec![light(LightKind::Spot { inner: 0.1, outer: 3.0 }, Vec3::ONE), camera(1.0, 0.1, 2.0)])
        .expect("right");
    session.add(vec![wave(wavy(0.1), aside(0.0))]).expect("added");
    let normals = vec![Vec3::NAN; wavy(0.1).positions.len()];
    assert!(session.deform(0, wavy(0.1).positions, Some(normals)).is_err());
}
