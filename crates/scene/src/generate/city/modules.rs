//! The meshes that a city is put together from.

use super::textures;
use crate::generate::builder::Builder;
use crate::generate::chance::Chance;
use crate::generate::palette::{lacquer, srgb, stone};
use crate::generate::shape::{Assembly, Shape};
use crate::generate::tree::{Growth, tree};
use crate::generate::{extrude::extrude, lathe, solids, tube};
use crate::{ColorInput, Encoding, Material};
use vastlight_math::{Affine3, Vec2, Vec3};

/// Width and height of a facade module, and how far the building's core stands back.
pub(super) const WIDTH: f32 = 3.2;
pub(super) const STOREY: f32 = 3.4;
pub(super) const DEPTH: f32 = 0.4;

/// Facade modules of one colour.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facade {
    pub(super) window: u32,
    pub(super) balcony: u32,
    pub(super) shop: u32,
    pub(super) cornice: u32,
}

/// Everything that is placed.
#[derive(Clone, Debug)]
pub(super) struct Kit {
    pub(super) facades: Vec<Facade>,
    pub(super) trees: Vec<u32>,
    pub(super) cars: Vec<u32>,
    pub(super) lamp: u32,
    pub(super) tank: u32,
    /// Unit boxes.
    pub(super) asphalt: u32,
    pub(super) pavement: u32,
    pub(super) roof: u32,
    pub(super) stripe: u32,
}

impl Kit {
    pub(super) fn new(b: &mut Builder, seed: u64) -> Self {
        let glass =
            b.material(Material { ior: 1.9, ..stone("window glass", Vec3::new(0.012, 0.017, 0.02), 0.02) });
        let metal = b.material(lacquer("dark metal", srgb(0x2f3436), 0.4));
        let colors = [0xc9b79a, 0xb5694c, 0xd8d2c4, 0x8d8f8c, 0xa98a64, 0x7b4a3c];
        let facades =
            colors.iter().zip(0..).map(|(&hex, i)| facade(b, hex, glass, metal, seed as u32 ^ i)).collect();
        let leaves = b.material(stone("leaves", Vec3::ONE, 0.5));
        let bark = b.material(stone("bark", srgb(0x5a4a3c), 0.9));
        let trees = (0..3).map(|i| street_tree(b, [bark, leaves], seed, i)).collect();
        let rubber = b.material(stone("tyre", srgb(0x18181a), 0.7));
        let paints = [0xb8bcc0, 0x1e2226, 0x8f1d1a, 0x24466e, 0xe2e0da];
        let cars = paints.iter().map(|&hex| car(b, hex, glass, rubber)).collect();
        let bulb = b.material(stone("lamp glass", srgb(0xf4efe2), 0.3));
        let lamp = lamp(b, metal, bulb);
        let unit = |b: &mut Builder, name: &str, hex: u32, roughness: f32| {
            let material = b.material(stone(name, srgb(hex), roughness));
            let mut cube = Assembly::default();
            cube.add(material, &solids::cuboid(Vec3::ONE));
            b.mesh(name, cube)
        };
        Self {
            facades,
            trees,
            cars,
            lamp,
            tank: water_tank(b, bark, metal),
            asphalt: unit(b, "asphalt", 0x3c3d40, 0.75),
            pavement: unit(b, "pavement", 0x9a968e, 0.8),
            roof: unit(b, "roof", 0x5d5a56, 0.9),
            stripe: unit(b, "road marking", 0xd9d6cc, 0.7),
        }
    }
}

fn span(x: [f32; 2], y: [f32; 2], z: [f32; 2]) -> Shape {
    let (low, high) = (Vec3::new(x[0], y[0], z[0]), Vec3::new(x[1], y[1], z[1]));
    let center = (low + high) * 0.5;
    solids::cuboid(high - low).at(center.x, center.y, center.z)
}

/// The modules stand on y = 0 around x = 0; z = 0 is the wall's face, +z the street.
fn facade(b: &mut Builder, hex: u32, glass: u32, metal: u32, seed: u32) -> Facade {
    let brick = textures::slabs("facade", 256, srgb(hex), srgb(hex) * 0.75, 8, 16, seed);
    let brick = b.texture(brick, Encoding::Srgb, Vec2::new(3.2, 2.4));
    let wall = b.material(Material {
        base_color: ColorInput { factor: Vec3::ONE, texture: Some(brick) },
        ..stone("facade", Vec3::ONE, 0.8)
    });
    let trim = b.material(stone("trim", srgb(hex).lerp(Vec3::splat(0.75), 0.55), 0.6));
    let window = |b: &mut Builder, name: &str, balcony: bool| {
        let mut module = Assembly::default();
        module.add(wall, &opening(0.85, 0.7, 2.75));
        module.add(trim, &surround(0.85, 0.7, 2.75));
        module.add(metal, &sash(0.85, 0.7, 2.75));
        module.add(glass, &span([-0.85, 0.85], [0.7, 2.75], [-0.3, -0.28]));
        if balcony {
            module.add(trim, &span([-1.3, 1.3], [-0.08, 0.08], [0.0, 0.95]));
            module.add(metal, &railing());
        }
        b.mesh(name, module)
    };
    let mut shop = Assembly::default();
    shop.add(wall, &opening(1.3, 0.3, 2.9));
    shop.add(metal, &sash(1.3, 0.3, 2.9));
    shop.add(glass, &span([-1.3, 1.3], [0.3, 2.9], [-0.3, -0.28]));
    shop.add(trim, &span([-1.6, 1.6], [3.0, 3.4], [0.0, 0.14]));
    // The outline lies in (z, y).
    let awning = [[0.0, 2.95], [0.0, 2.9], [1.0, 2.45], [1.0, 2.5]].map(Vec2::from_array);
    let awning = extrude(&awning, 2.7).turned(-std::f32::consts::FRAC_PI_2);
    let cloth = b.material(stone("awning", srgb([0x7c2d26, 0x2d5a4a, 0x37507a][seed as usize % 3]), 0.9));
    shop.add(cloth, &awning);
    let mut cornice = Assembly::default();
    for (low, high, reach) in [(0.0, 0.25, 0.12), (0.25, 0.45, 0.34), (0.45, 1.0, 0.05)] {
        cornice.add(trim, &span([-1.6, 1.6], [low, high], [-DEPTH, reach]));
    }
    Facade {
        window: window(b, "window", false),
        balcony: window(b, "balcony", true),
        shop: b.mesh("shop", shop),
        cornice: b.mesh("cornice", cornice),
    }
}

/// The wall around an opening of half width `x` between two heights.
fn opening(x: f32, low: f32, high: f32) -> Shape {
    let (edge, back) = (WIDTH * 0.5, [-DEPTH, 0.0]);
    let mut wall = span([-edge, -x], [0.0, STOREY], back);
    wall.merge(&span([x, edge], [0.0, STOREY], back));
    wall.merge(&span([-x, x], [0.0, low], back));
    wall.merge(&span([-x, x], [high, STOREY], back));
    wall
}

fn surround(x: f32, low: f32, high: f32) -> Shape {
    let mut trim = span([-x - 0.18, x + 0.18], [low - 0.1, low], [-0.1, 0.12]);
    trim.merge(&span([-x - 0.2, x + 0.2], [high, high + 0.24], [0.0, 0.06]));
    trim
}

fn sash(x: f32, low: f32, high: f32) -> Shape {
    let z = [-0.3, -0.22];
    let middle = low + (high - low) * 0.68;
    let mut sash = span([-x, x], [low, low + 0.07], z);
    for piece in [
        span([-x, x], [high - 0.07, high], z),
        span([-x, -x + 0.07], [low, high], z),
        span([x - 0.07, x], [low, high], z),
        span([-0.03, 0.03], [low, high], z),
        span([-x, x], [middle, middle + 0.05], z),
    ] {
        sash.merge(&piece);
    }
    sash
}

fn railing() -> Shape {
    let mut rail = span([-1.28, 1.28], [0.98, 1.03], [0.88, 0.93]);
    for x in [-1.26, 1.26] {
        rail.merge(&span([x - 0.02, x + 0.02], [0.98, 1.03], [0.0, 0.9]));
    }
    for i in 0..13 {
        let x = -1.26 + 2.52 * i as f32 / 12.0;
        rail.merge(&span([x - 0.012, x + 0.012], [0.08, 0.98], [0.895, 0.92]));
    }
    rail
}

fn street_tree(b: &mut Builder, materials: [u32; 2], seed: u64, kind: u64) -> u32 {
    let growth = Growth { height: 7.0, forks: 4, leaves: 12, leaf: 0.55, sides: 5 };
    let [wood, leaves] = tree(&growth, &mut Chance::new(seed, 700 + kind));
    let mut assembly = Assembly::default();
    assembly.add(materials[0], &wood).add(materials[1], &leaves);
    b.mesh("tree", assembly)
}

/// A saloon along x: lower body, cabin of glass under a roof, four wheels.
fn car(b: &mut Builder, hex: u32, glass: u32, rubber: u32) -> u32 {
    let paint = b.material(lacquer("car paint", srgb(hex), 0.35));
    let body = [[-2.2, 0.32], [2.2, 0.32], [2.25, 0.6], [2.1, 0.78], [1.0, 0.92], [-1.9, 0.95], [-2.2, 0.85]]
        .map(Vec2::from_array);
    let cabin = [[-1.75, 0.93], [0.95, 0.9], [0.2, 1.4], [-1.2, 1.42]].map(Vec2::from_array);
    let mut car = Assembly::default();
    car.add(paint, &extrude(&body, 1.76));
    car.add(glass, &extrude(&cabin, 1.52));
    car.add(paint, &solids::beveled_box(Vec3::new(1.5, 0.06, 1.46), 0.02).at(-0.5, 1.42, 0.0));
    let upright = Affine3::from_cols(Vec3::X, Vec3::Z, Vec3::NEG_Y, Vec3::ZERO);
    let wheel = lathe::cylinder(0.32, 0.22, 16).transformed(&upright);
    for x in [-1.35, 1.4] {
        for z in [-0.68, 0.9] {
            car.add(rubber, &wheel.clone().at(x, 0.32, z));
        }
    }
    b.mesh("car", car)
}

fn lamp(b: &mut Builder, metal: u32, bulb: u32) -> u32 {
    let corners = [Vec3::ZERO, Vec3::new(0.0, 6.0, 0.0), Vec3::new(0.0, 6.6, 1.5)];
    let mut lamp = Assembly::default();
    lamp.add(metal, &tube::tube(&tube::rounded_path(&corners, 0.5, 4), 0.06, 8));
    lamp.add(metal, &lathe::cylinder(0.12, 0.7, 8));
    lamp.add(bulb, &solids::cuboid(Vec3::new(0.22, 0.1, 0.6)).at(0.0, 6.56, 1.6));
    b.mesh("street lamp", lamp)
}

/// A wooden tank on legs, as on old roofs.
fn water_tank(b: &mut Builder, wood: u32, metal: u32) -> u32 {
    let mut tank = Assembly::default();
    let profile = [[0.0, 2.0], [1.5, 2.0], [1.45, 4.6], [0.0, 5.6]].map(Vec2::from_array);
    tank.add(wood, &lathe::lathe(&profile, 20));
    for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        tank.add(metal, &span([x - 0.07, x + 0.07], [0.0, 2.05], [z - 0.07, z + 0.07]));
    }
    b.mesh("water tank", tank)
}
