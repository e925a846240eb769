//! Scenes with all kinds of lights, and points around them.

use std::f32::consts::PI;
use std::sync::Arc;
use vastlight_math::{Affine3, Quat, Rng, Vec2, Vec3, warp};
use vastlight_scene::{
    Encoding, Environment, Filter, IesProfile, Image, Instance, Light, LightKind, Material, Mesh, Part,
    SceneDesc, Sky, Texels, Texture,
};

/// A description with materials by number and nothing else, in the dark.
pub(crate) fn dark(materials: Vec<Material>) -> SceneDesc {
    SceneDesc { materials, environment: Some(Environment::Constant(Vec3::ZERO)), ..SceneDesc::default() }
}

/// Adds a mesh of one material at some places.
fn add_mesh(desc: &mut SceneDesc, corners: &[[Vec3; 3]], material: u32, maps: &[Affine3]) {
    let positions: Vec<Vec3> = corners.iter().flatten().copied().collect();
    let triangles = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let uvs = vec![positions.iter().map(|p| Vec2::new(p.x, p.y)).collect()];
    let parts = vec![Part { first_triangle: 0, material }];
    let mesh = desc.meshes.len() as u32;
    desc.instances.extend(maps.iter().map(|&world_from_object| Instance {
        world_from_object,
        mesh,
        name: 0,
    }));
    desc.meshes.push(Mesh { positions, triangles, uvs, parts, ..Mesh::default() });
}

/// A square of side 2 at z = 0 whose front is +z.
fn square() -> [[Vec3; 3]; 2] {
    let p = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    [[p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0)], [p(-1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0)]]
}

fn at(x: f32, y: f32, z: f32) -> Affine3 {
    Affine3::from_translation(Vec3::new(x, y, z))
}

/// One square that shines down.
pub(crate) fn one_area() -> SceneDesc {
    let mut desc = dark(vec![Material::emitter("lamp", Vec3::new(2.0, 4.0, 8.0), false)]);
    add_mesh(&mut desc, &square(), 0, &[at(0.0, 1.0, 0.0) * Affine3::from_rotation_x(PI / 2.0)]);
    desc
}

/// Triangles all over, most small, some long and thin; an unlit floor; a third shines on both sides.
pub(crate) fn many_triangles() -> SceneDesc {
    let mut desc = dark(vec![
        Material::emitter("one-sided", Vec3::new(3.0, 2.0, 1.0), false),
        Material::emitter("two-sided", Vec3::splat(1.5), true),
        Material::diffuse("dark", Vec3::splat(0.5)),
    ]);
    let mut rng = Rng::new(5);
    let mut triangles: Vec<[Vec3; 3]> = (0..210)
        .map(|i| {
            let mut around = || warp::uniform_sphere(rng.next_2d()) * rng.next_1d();
            let (center, size) = (around() * 4.0, [0.3, 0.02, 1.5][i % 3]);
            [center, center + around() * size, center + around() * 0.3]
        })
        .collect();
    let floor = triangles.split_off(200);
    add_mesh(&mut desc, &triangles, 0, &[Affine3::IDENTITY]);
    let parts = [(0, 0), (60, 1), (130, 2), (140, 0)];
    desc.meshes[0].parts =
        parts.iter().map(|&(first_triangle, material)| Part { first_triangle, material }).collect();
    add_mesh(&mut desc, &floor, 2, &[Affine3::IDENTITY]);
    desc.environment = Some(Environment::Constant(Vec3::new(0.2, 0.3, 0.4)));
    desc
}

/// Two colours of the texture of lamps, left and right.
pub(crate) const HALVES: [Vec3; 2] = [Vec3::new(0.5, 3.0, 1.0), Vec3::new(2.0, 0.0, 0.25)];

/// Adds a material that shines in two halves.
fn add_halves(desc: &mut SceneDesc, two_sided: bool) -> u32 {
    let mut lamp = Material::emitter("halves", Vec3::ONE, two_sided);
    lamp.emission.texture = Some(desc.textures.len() as u32);
    let texels = Texels::F32(HALVES.iter().flat_map(|c| c.to_array()).collect());
    let image = desc.images.len() as u32;
    desc.images.push(Image { name: "halves".into(), width: 2, height: 1, channels: 3, texels });
    desc.textures.push(Texture { filter: Filter::Nearest, ..Texture::new(image, Encoding::Linear) });
    desc.materials.push(lamp);
    desc.materials.len() as u32 - 1
}

/// A grid of small squares, so that a mesh has more triangles than a list.
fn sheet() -> Vec<[Vec3; 3]> {
    let cells = (0..9).map(|i| Vec3::new((i % 3) as f32, (i / 3) as f32, 0.1 * (i % 2) as f32));
    cells.flat_map(|cell| square().map(|t| t.map(|p| (p * 0.45 + cell) * 0.3))).collect()
}

/// Textured lamps, one-sided and two-sided, many times; one of them mirrored, one stretched.
pub(crate) fn lamps() -> SceneDesc {
    let mut desc = dark(vec![Material::emitter("plain", Vec3::new(1.0, 2.0, 3.0), true)]);
    let one_sided = add_halves(&mut desc, false);
    let two_sided = add_halves(&mut desc, true);
    let mut rng = Rng::new(8);
    let mut maps: Vec<Affine3> = (0..7)
        .map(|i| {
            let turn = Quat::from_axis_angle(warp::uniform_sphere(rng.next_2d()), 6.0 * rng.next_1d());
            let place = warp::uniform_sphere(rng.next_2d()) * (1.0 + 2.0 * rng.next_1d());
            Affine3::from_scale_rotation_translation(Vec3::splat(0.5 + 0.2 * i as f32), turn, place)
        })
        .collect();
    maps[2] *= Affine3::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    maps[3] *= Affine3::from_scale(Vec3::new(2.0, 0.5, 1.0));
    add_mesh(&mut desc, &sheet(), one_sided, &maps);
    let corners = sheet();
    add_mesh(
        &mut desc,
        &corners[..3],
        two_sided,
        &maps[1..4].iter().map(|m| at(0.5, 1.5, 0.0) * *m).collect::<Vec<_>>(),
    );
    add_mesh(&mut desc, &corners, 0, &[at(-2.0, 0.0, 0.0), at(-2.0, 1.0, 1.0) * maps[0]]);
    let of_lamp = [(0, 0), (6, two_sided), (12, one_sided)];
    desc.meshes[2].parts =
        of_lamp.iter().map(|&(first_triangle, material)| Part { first_triangle, material }).collect();
    desc
}

/// A light without surface.
fn light(kind: LightKind, world_from_light: Affine3, range: f32, profile: Option<Arc<IesProfile>>) -> Light {
    let intensity = Vec3::new(3.0, 2.0, 1.0);
    Light { name: String::new(), kind, world_from_light, intensity, range, profile }
}

/// Point and spot lights, with ranges and with profiles of every shape.
pub(crate) fn punctual() -> SceneDesc {
    let profile = |vertical: &[f32], horizontal: &[f32]| {
        let count = vertical.len() * horizontal.len();
        let candela = (0..count).map(|i| ((i * 7 + 3) % 11) as f32 / 11.0).collect();
        let (vertical, horizontal) = (vertical.to_vec(), horizontal.to_vec());
        Some(Arc::new(IesProfile { vertical, horizontal, candela, peak_candela: 1.0 }))
    };
    let round = profile(&[0.0, 20.0, 45.0, 90.0], &[0.0]);
    let quarters = profile(&[0.0, 60.0, 120.0, 180.0], &[0.0, 90.0, 180.0, 270.0]);
    let upper = profile(&[90.0, 135.0, 180.0], &[10.0, 100.0, 350.0]);
    let spot = |inner, outer| LightKind::Spot { inner, outer };
    let turned = |angle: f32| Affine3::from_rotation_x(angle) * Affine3::from_rotation_y(0.4 * angle);
    let mut desc = dark(Vec::new());
    desc.lights = vec![
        light(LightKind::Point, at(0.0, 2.0, 0.0), f32::INFINITY, None),
        light(LightKind::Point, at(1.0, 2.0, 0.0), 3.0, None),
        light(LightKind::Point, at(-1.0, 0.0, 2.0) * turned(0.7), f32::INFINITY, round.clone()),
        light(LightKind::Point, at(-2.0, 0.0, 1.0) * turned(-1.1), f32::INFINITY, quarters.clone()),
        light(LightKind::Point, at(2.0, -1.0, 1.0) * turned(2.1), 20.0, upper),
        light(spot(0.3, 0.7), at(0.0, 3.0, 1.0) * turned(-1.5), f32::INFINITY, None),
        light(spot(0.5, 0.5), at(2.0, 3.0, 1.0) * turned(-1.2), 50.0, None),
        light(spot(0.9, 1.5), at(2.0, -3.0, -1.0) * turned(1.2), f32::INFINITY, round),
        light(spot(0.0, 3.1), at(-2.0, -3.0, -1.0), f32::INFINITY, quarters),
    ];
    desc
}

/// Directional lights, and an even sky.
pub(crate) fn directional() -> SceneDesc {
    let mut desc = many_triangles();
    for angle in [0.3, -1.2, 2.5] {
        desc.lights.push(light(LightKind::Directional, Affine3::from_rotation_x(angle), f32::INFINITY, None));
    }
    desc.lights.push(light(LightKind::Point, at(0.0, 2.0, 0.0), f32::INFINITY, None));
    desc
}

/// A latitude-longitude map with a sun, black parts and a dim ground.
pub(crate) fn image(width: u32, height: u32, rotation: f32) -> SceneDesc {
    let mut desc = dark(Vec::new());
    let texel = |x: u32, y: u32| match (x, y) {
        (20, 5) => Vec3::new(300.0, 250.0, 200.0),
        (x, y) if x % 7 == 2 || y == 3 => Vec3::ZERO,
        (x, 6) => Vec3::splat([f32::NAN, f32::INFINITY, -1.0, 2.0][x as usize % 4]),
        (_, y) if y > 8 => Vec3::splat(0.1),
        (x, y) => Vec3::new(0.2, 0.4, 0.5 + (x * y % 5) as f32 * 0.2),
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let texels = pixels.flat_map(|(x, y)| texel(x, y).extend(1.0).to_array()).collect();
    let texels = Texels::F32(texels);
    desc.images.push(Image { name: "map".into(), width, height, channels: 4, texels });
    desc.environment = Some(Environment::Map { image: 0, rotation, strength: 2.0 });
    desc
}

/// The procedural sky with a sun, above a lamp.
pub(crate) fn sky(sun_elevation: f32) -> SceneDesc {
    let sky = Sky { sun_azimuth: 2.2, sun_elevation, ..Sky::default() };
    SceneDesc { environment: Some(Environment::Sky(sky)), ..one_area() }
}
