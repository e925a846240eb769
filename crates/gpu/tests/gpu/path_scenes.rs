//! Scenes for the path tracer on a device: demos, and two of quads with everything that demos have not.

use std::f32::consts::PI;
use vastlight_math::{Affine3, Quat, Vec2, Vec3, Vec4};
use vastlight_scene::generate::{self, GenerateOptions};
use vastlight_scene::{
    AlphaMode, Camera, Channel, ColorInput, Encoding, Environment, Filter, Image, Instance, Light, LightKind,
    Material, Mesh, NormalMap, ScalarInput, Scene, SceneDesc, Texels, Texture, TextureTransform, Wrap,
};

/// A demo of at most this many triangles, where its size can be chosen.
pub(crate) fn demo(name: &str, triangles: Option<u64>) -> Scene {
    let options = GenerateOptions { triangles, ..GenerateOptions::default() };
    Scene::new(generate::by_name(name, &options).expect("a demo")).expect("a scene")
}

/// A quad of 2 x 2 in the plane z = 0 that looks along z.
fn quad() -> Mesh {
    let corner = |i: usize| [Vec2::new(-1.0, -1.0), Vec2::new(1.0, -1.0), Vec2::ONE, Vec2::new(-1.0, 1.0)][i];
    Mesh {
        positions: (0..4).map(|i| corner(i).extend(0.0)).collect(),
        uvs: vec![(0..4).map(|i| (corner(i) + 1.0) * 0.5).collect()],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// The same bent, with normals and colours of its own.
fn sail() -> Mesh {
    let mut mesh = quad();
    mesh.normals = mesh.positions.iter().map(|p| Vec3::new(p.x * 0.4, p.y * 0.2, 1.0).normalize()).collect();
    mesh.colors =
        mesh.positions.iter().map(|p| Vec4::new(0.6 + p.x * 0.4, 0.9, 0.6 - p.y * 0.4, 1.0)).collect();
    mesh
}

/// Numbers that look like noise, four a texel.
fn texels(count: usize) -> Vec<u8> {
    (0..4 * count).map(|i| ((i * 97 + i * i * 31) >> 3) as u8).collect()
}

fn images() -> Vec<Image> {
    let bytes = texels(64 * 32);
    let image = |texels, channels| Image { name: String::new(), width: 64, height: 32, channels, texels };
    let words = bytes[..64 * 32 * 2].iter().map(|&b| u16::from(b) << 8 | 0x7f).collect();
    let floats = bytes[..64 * 32].iter().map(|&b| f32::from(b) / 300.0).collect();
    let bent = bytes.chunks_exact(4).flat_map(|b| [b[0] / 2 + 64, b[1] / 2 + 64, 255]).collect();
    vec![
        image(Texels::U8(bytes.clone()), 4),
        image(Texels::U16(words), 2),
        image(Texels::F32(floats), 1),
        image(Texels::U8(bent), 3),
    ]
}

fn textures() -> Vec<Texture> {
    let texture = |image, encoding| Texture::new(image, encoding);
    vec![
        texture(0, Encoding::Srgb),
        Texture { wrap: [Wrap::Mirror, Wrap::Clamp], ..texture(1, Encoding::Srgb) },
        Texture { filter: Filter::Nearest, ..texture(2, Encoding::Linear) },
        texture(3, Encoding::Linear),
    ]
}

/// A scene of quads: mesh, material, place.
struct Build {
    desc: SceneDesc,
}

impl Build {
    fn new(environment: Vec3) -> Self {
        let mut camera = Camera::look_at("c", Vec3::new(0.3, 1.2, 4.5), Vec3::new(0.0, 0.6, 0.0), 0.8);
        camera.aspect = Some(16.0 / 9.0);
        let desc = SceneDesc {
            meshes: vec![quad(), sail()],
            names: vec![String::new()],
            images: images(),
            textures: textures(),
            cameras: vec![camera],
            environment: Some(Environment::Constant(environment)),
            ..SceneDesc::default()
        };
        Self { desc }
    }

    /// Puts a mesh with a material in a place; every material has copies of the meshes.
    fn put(&mut self, mesh: usize, material: Material, world_from_object: Affine3) {
        let number = self.desc.materials.len() as u32;
        let parts = vec![vastlight_scene::Part { first_triangle: 0, material: number }];
        let mesh = Mesh { parts, ..self.desc.meshes[mesh].clone() };
        self.desc.materials.push(material);
        self.desc.meshes.push(mesh);
        let mesh = self.desc.meshes.len() as u32 - 1;
        self.desc.instances.push(Instance { world_from_object, mesh, name: 0 });
    }

    fn floor(&mut self, material: Material) {
        let flat = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
        self.put(0, material, Affine3::from_scale_rotation_translation(Vec3::splat(4.0), flat, Vec3::ZERO));
    }

    fn finish(self) -> Scene {
        Scene::new(self.desc).expect("a scene")
    }
}

fn stand(x: f32, z: f32, turn: f32, size: Vec3) -> Affine3 {
    Affine3::from_scale_rotation_translation(size, Quat::from_rotation_y(turn), Vec3::new(x, 0.8, z))
}

fn colored(texture: u32) -> ColorInput {
    ColorInput { factor: Vec3::new(0.9, 0.8, 0.7), texture: Some(texture) }
}

/// Surfaces that rays may pass, under lights that shine through them.
pub(crate) fn veils() -> Scene {
    let mut build = Build::new(Vec3::new(0.2, 0.25, 0.3));
    build.floor(Material { base_color: colored(0), ..Material::diffuse("floor", Vec3::ONE) });
    let alpha = |texture, mode| Material {
        alpha: ScalarInput { factor: 1.0, texture: Some((texture, Channel::A)) },
        alpha_mode: mode,
        double_sided: true,
        ..Material::diffuse("veil", Vec3::new(0.2, 0.7, 0.3))
    };
    let size = Vec3::splat(0.7);
    build.put(0, alpha(0, AlphaMode::Mask(0.5)), stand(-1.4, 0.0, 0.3, size));
    build.put(0, alpha(1, AlphaMode::Blend), stand(0.0, -0.5, -0.2, size));
    let tint = ColorInput::new(Vec3::new(0.9, 0.5, 0.2));
    let pane = Material { thickness: 0.0, base_color: tint, ..Material::glass("pane", 1.5, 0.0) };
    build.put(0, pane, stand(1.4, 0.2, -0.5, size));
    let glowing = Material {
        emission: colored(0),
        alpha: ScalarInput { factor: 0.7, texture: Some((1, Channel::A)) },
        alpha_mode: AlphaMode::Blend,
        ..Material::emitter("lamp", Vec3::splat(6.0), true)
    };
    build.put(0, glowing, stand(0.6, -2.0, 0.0, Vec3::splat(0.4)));
    build.desc.lights = vec![
        light(LightKind::Point, Vec3::new(1.0, 3.0, 1.0), Vec3::splat(20.0)),
        light(LightKind::Directional, Vec3::new(0.0, 5.0, 1.0), Vec3::new(1.5, 1.3, 1.0)),
    ];
    build.finish()
}

/// Hills of so many quads a side between -1 and 1, with normals and texture coordinates.
fn hills(side: u32) -> Mesh {
    let at = |i: u32| (i as f32 / side as f32).mul_add(2.0, -1.0);
    let (place, across) = (|x: u32, y: u32| y * (side + 1) + x, side + 1);
    let height =
        |x: f32, y: f32| (9.0 * x).sin() * (7.0 * y).cos() * 0.08 + (40.0 * x + 31.0 * y).sin() * 0.01;
    let vertices = || (0..across * across).map(|i| (at(i % across), at(i / across)));
    let cell = |i: u32| {
        let (x, y) = (i % side, i / side);
        let (a, b, c, d) = (place(x, y), place(x + 1, y), place(x, y + 1), place(x + 1, y + 1));
        [[a, b, d], [a, d, c]]
    };
    Mesh {
        positions: vertices().map(|(x, y)| Vec3::new(x, y, height(x, y))).collect(),
        normals: vertices()
            .map(|(x, y)| Vec3::new((9.0 * x).cos() * -0.5, (7.0 * y).sin() * 0.4, 1.0).normalize())
            .collect(),
        uvs: vec![vertices().map(|(x, y)| Vec2::new(2.0 * x, 2.0 * y)).collect()],
        triangles: (0..side * side).flat_map(cell).collect(),
        ..Mesh::default()
    }
}

/// What has pages of all kinds, many of each: textured hills, a tattered veil of small triangles, a pane of them, and a lamp whose
/// light comes by a texture.
pub(crate) fn large() -> Scene {
    let mut build = Build::new(Vec3::new(0.2, 0.25, 0.3));
    build.desc.meshes = vec![hills(140), hills(60)];
    let edge = 256;
    let wide = Image { width: edge, height: edge, ..images()[0].clone() };
    let texels = Texels::U8(texels((edge * edge) as usize));
    build.desc.images.push(Image { texels, ..wide });
    build.desc.textures.push(Texture::new(4, Encoding::Srgb));
    build.desc.textures.push(Texture { wrap: [Wrap::Mirror; 2], ..Texture::new(4, Encoding::Linear) });
    let rough = ScalarInput { factor: 0.7, texture: Some((5, Channel::G)) };
    build.floor(Material { base_color: colored(4), roughness: rough, ..Material::new("hills") });
    let tattered = Material {
        alpha: ScalarInput { factor: 1.0, texture: Some((0, Channel::A)) },
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::diffuse("tattered", Vec3::new(0.2, 0.7, 0.3))
    };
    build.put(1, tattered, stand(-0.9, 0.2, 0.3, Vec3::splat(0.7)));
    let tint = ColorInput::new(Vec3::new(0.9, 0.5, 0.2));
    let pane = Material { thickness: 0.0, base_color: tint, ..Material::glass("pane", 1.5, 0.0) };
    build.put(1, pane, stand(0.9, 0.4, -0.4, Vec3::splat(0.7)));
    let lamp = Material { emission: colored(0), ..Material::emitter("lamp", Vec3::splat(6.0), true) };
    build.put(1, lamp, stand(0.3, -1.6, 0.1, Vec3::splat(0.3)));
    build.desc.lights = vec![light(LightKind::Point, Vec3::new(1.0, 3.0, 1.0), Vec3::splat(20.0))];
    build.finish()
}

/// Every input of a material by texture, vertex colours and normals, and mirrored and stretched places.
pub(crate) fn materials() -> Scene {
    let mut build = Build::new(Vec3::splat(0.5));
    let scalar = |factor, texture, channel| ScalarInput { factor, texture: Some((texture, channel)) };
    let map = |scale| Some(NormalMap { texture: 3, scale });
    build.floor(Material {
        base_color: colored(0),
        roughness: scalar(0.8, 0, Channel::G),
        normal_map: map(0.5),
        ..Material::new("floor")
    });
    let lacquer = Material {
        metallic: scalar(1.0, 0, Channel::B),
        roughness: scalar(0.6, 1, Channel::R),
        clearcoat: scalar(1.0, 2, Channel::R),
        clearcoat_roughness: ScalarInput::new(0.1),
        clearcoat_normal_map: map(0.3),
        normal_map: map(1.0),
        ..Material::new("lacquer")
    };
    let brushed = Material {
        anisotropy: 0.8,
        anisotropy_rotation: 0.6,
        anisotropy_texture: Some(3),
        iridescence: ScalarInput::new(1.0),
        iridescence_thickness: [200.0, 500.0],
        iridescence_thickness_texture: Some(0),
        ..Material::metal("brushed", Vec3::new(0.9, 0.7, 0.4), 0.3)
    };
    let cloth = Material {
        sheen_color: colored(0),
        sheen_roughness: scalar(0.9, 0, Channel::A),
        specular: scalar(1.0, 0, Channel::R),
        specular_color: colored(1),
        ..Material::diffuse("cloth", Vec3::new(0.3, 0.1, 0.4))
    };
    let frosted = Material {
        dispersion: 0.5,
        transmission: scalar(1.0, 2, Channel::R),
        attenuation_color: Vec3::new(0.4, 0.8, 0.6),
        attenuation_distance: 0.5,
        ..Material::glass("frosted", 1.5, 0.3)
    };
    let sign = Material { unlit: true, base_color: colored(0), ..Material::new("sign") };
    build.put(1, lacquer, stand(-1.5, 0.3, 0.5, Vec3::new(0.6, 0.8, 1.0)));
    build.put(0, brushed, stand(-0.4, 0.0, 0.2, Vec3::new(-0.5, 0.7, 1.0)));
    build.put(1, cloth, stand(0.7, -0.3, -0.3, Vec3::new(0.5, 0.7, -1.0)));
    build.put(0, frosted, stand(1.6, 0.2, -0.6, Vec3::splat(0.6)));
    build.put(1, sign, stand(0.2, -1.5, 0.0, Vec3::splat(0.5)));
    build.desc.lights = vec![
        light(LightKind::Spot { inner: 0.3, outer: 0.9 }, Vec3::new(0.0, 4.0, 3.0), Vec3::splat(60.0)),
        light(LightKind::Point, Vec3::new(-2.0, 2.0, 2.0), Vec3::new(10.0, 8.0, 6.0)),
    ];
    build.finish()
}

/// Unlit quads side by side, each with a texture that is read in a way of its own, and named after it. The colours of a
/// picture are those that lookups give, a few texels a pixel at most.
pub(crate) fn lookups() -> Scene {
    let image = |texels, channels| Image { name: String::new(), width: 5, height: 3, channels, texels };
    let bytes = texels(15);
    let wide = |count: usize| (0..count).map(|i| (i * 40_503 + i * i * 977) as u16).collect();
    let mut build = Build::new(Vec3::ZERO);
    build.desc.images = vec![
        image(Texels::U8(bytes.clone()), 4),
        image(Texels::U8(bytes[..45].to_vec()), 3),
        image(Texels::U16(wide(15)), 1),
        image(Texels::U16(wide(45)), 3),
        image(Texels::F32(bytes[..30].iter().map(|&b| f32::from(b) / 300.0).collect()), 2),
    ];
    // From before the image to behind it.
    let beyond = TextureTransform {
        offset: Vec2::new(-1.2, -0.9),
        scale: Vec2::new(3.1, 2.7),
        ..TextureTransform::IDENTITY
    };
    let turned = TextureTransform { rotation: 0.7, scale: Vec2::new(2.0, 0.6), ..beyond };
    let read = |image, encoding| Texture { transform: beyond, ..Texture::new(image, encoding) };
    let plain = || read(0, Encoding::Srgb);
    let ways = [
        ("repeated", plain()),
        ("mirrored", Texture { wrap: [Wrap::Mirror; 2], ..plain() }),
        ("clamped", Texture { wrap: [Wrap::Clamp, Wrap::Repeat], ..plain() }),
        ("nearest", Texture { filter: Filter::Nearest, ..plain() }),
        ("turned", Texture { transform: turned, ..plain() }),
        ("second coordinates", Texture { uv_set: 1, ..plain() }),
        ("bytes", read(1, Encoding::Linear)),
        ("words", read(2, Encoding::Linear)),
        ("encoded words", read(3, Encoding::Srgb)),
        ("floats", read(4, Encoding::Linear)),
    ];
    let mut mesh = quad();
    mesh.uvs.push(mesh.uvs[0].iter().map(|uv| Vec2::new(1.0 - uv.y, 0.3 * uv.x)).collect());
    build.desc.meshes.push(mesh);
    build.desc.textures.clear();
    for (i, (name, texture)) in ways.into_iter().enumerate() {
        build.desc.textures.push(texture);
        let base_color = colored(i as u32);
        let at = Vec3::new((i % 5) as f32 - 2.0, (i / 5) as f32, 0.0);
        let place = Affine3::from_scale_rotation_translation(Vec3::splat(0.45), Quat::IDENTITY, at);
        build.put(2, Material { unlit: true, base_color, ..Material::new(name) }, place);
    }
    build.finish()
}

/// A closed block of the cube from -1 to 1.
fn block() -> Mesh {
    let corner = |i: u32| Vec3::new(i as f32 % 2.0, (i / 2) as f32 % 2.0, (i / 4) as f32) * 2.0 - 1.0;
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: sides.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Mesh::default()
    }
}

/// A block of clear glass with colour in it, before a background that is the same everywhere; in the block a light and
/// something that it shines on.
pub(crate) fn amber() -> Scene {
    let mut build = Build::new(Vec3::ONE);
    build.desc.meshes.push(block());
    let amber = Material {
        attenuation_color: Vec3::new(0.8, 0.5, 0.2),
        attenuation_distance: 0.7,
        ..Material::glass("amber", 1.5, 0.0)
    };
    let inside = Material { double_sided: true, ..Material::diffuse("inside", Vec3::splat(0.8)) };
    let turned = Quat::from_rotation_y(0.4);
    let at = Vec3::new(0.0, 0.6, 0.0);
    let size = Vec3::new(1.6, 0.8, 0.5);
    build.put(2, amber, Affine3::from_scale_rotation_translation(size, turned, at));
    build.put(0, inside, Affine3::from_scale_rotation_translation(Vec3::splat(0.3), turned, at));
    build.desc.lights = vec![light(LightKind::Point, Vec3::new(0.1, 0.7, 0.35), Vec3::splat(0.5))];
    build.finish()
}

/// A ball of radius 1 with smooth normals.
fn ball() -> Mesh {
    let (rows, columns) = (12_u32, 24_u32);
    let at = |row: u32, column: u32| {
        let (down, around) = (row as f32 / rows as f32 * PI, column as f32 / columns as f32 * 2.0 * PI);
        Vec3::new(down.sin() * around.sin(), down.cos(), down.sin() * around.cos())
    };
    let place = |row: u32, column: u32| row * columns + column % columns;
    let cell = |i: u32| {
        let (row, column) = (i / columns, i % columns);
        let corner = |dr: u32, dc: u32| place(row + dr, column + dc);
        [[corner(0, 0), corner(1, 0), corner(1, 1)], [corner(0, 0), corner(1, 1), corner(0, 1)]]
    };
    let positions: Vec<Vec3> = (0..(rows + 1) * columns).map(|i| at(i / columns, i % columns)).collect();
    Mesh {
        normals: positions.clone(),
        positions,
        triangles: (0..rows * columns).flat_map(cell).collect(),
        ..Mesh::default()
    }
}

/// A glass ball with colour in it, light shut in by total reflection, mirrors that see each other, something half there and a
/// pane, under lights without surface.
pub(crate) fn mirrors() -> Scene {
    let mut build = Build::new(Vec3::new(0.3, 0.4, 0.6));
    build.desc.meshes.push(ball());
    build.floor(Material { base_color: colored(0), ..Material::diffuse("floor", Vec3::ONE) });
    let amber = Material {
        attenuation_color: Vec3::new(0.9, 0.6, 0.3),
        attenuation_distance: 0.8,
        ..Material::glass("amber", 1.6, 0.0)
    };
    build.put(2, amber, stand(0.0, 0.6, 0.4, Vec3::splat(0.7)));
    // From within, most ways end in total reflection.
    build.put(2, Material::glass("heavy", 2.4, 0.05), stand(1.3, 0.9, 0.4, Vec3::new(0.4, 0.5, 0.3)));
    let mirror = |tint| Material { double_sided: true, ..Material::metal("mirror", tint, 0.02) };
    build.put(0, mirror(Vec3::new(0.9, 0.8, 0.7)), stand(-1.5, -0.4, 0.7, Vec3::new(0.7, 0.8, 1.0)));
    build.put(0, mirror(Vec3::splat(0.9)), stand(1.5, -0.6, -0.7, Vec3::new(0.7, 0.8, 1.0)));
    build.put(1, Material::metal("brass", Vec3::new(0.9, 0.7, 0.3), 0.25), stand(0.0, -1.6, 0.1, Vec3::ONE));
    let half = Material {
        alpha: ScalarInput { factor: 1.0, texture: Some((0, Channel::A)) },
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::diffuse("half", Vec3::new(0.7, 0.2, 0.2))
    };
    build.put(0, half, stand(-0.8, 1.1, 0.2, Vec3::splat(0.3)));
    let pane = Material { thickness: 0.0, ..Material::glass("pane", 1.5, 0.0) };
    build.put(0, pane, stand(0.6, 1.7, -0.3, Vec3::splat(0.3)));
    build.desc.lights = vec![
        light(LightKind::Point, Vec3::new(-1.0, 3.0, 2.0), Vec3::new(20.0, 18.0, 15.0)),
        light(LightKind::Point, Vec3::new(2.0, 2.0, 1.5), Vec3::splat(8.0)),
    ];
    build.finish()
}

/// Blocks of heavy glass one behind the other before a coloured background, none of which absorbs: a ray of the camera becomes
/// hundreds.
pub(crate) fn plates(count: usize) -> Scene {
    let mut build = Build::new(Vec3::new(0.9, 0.7, 0.5));
    build.desc.meshes.push(block());
    for i in 0..count {
        let at = Vec3::new(0.0, 0.6, 1.5 - 0.4 * i as f32);
        let place = Affine3::from_scale_rotation_translation(Vec3::new(3.0, 2.0, 0.1), Quat::IDENTITY, at);
        build.put(2, Material::glass("plate", 2.4, 0.0), place);
    }
    build.desc.lights = vec![light(LightKind::Point, Vec3::new(1.0, 3.0, 4.0), Vec3::splat(8.0))];
    build.finish()
}

/// A light at a place, towards the origin.
fn light(kind: LightKind, from: Vec3, intensity: Vec3) -> Light {
    let turn = Quat::from_rotation_arc(Vec3::NEG_Z, -from.normalize());
    let world_from_light = Affine3::from_rotation_translation(turn, from);
    Light { name: String::new(), kind, world_from_light, intensity, range: f32::INFINITY, profile: None }
}
