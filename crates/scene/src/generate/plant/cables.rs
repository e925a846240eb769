//! Cable trays; their cables take a process unit's last triangles.

use super::Finishes;
use super::pile::{Pile, vary};
use super::unit::Plan;
use crate::generate::chance::Chance;
use crate::generate::{solids, tube};
use vastlight_math::{Affine3, Vec3};

const SIDES: u32 = 8;
const PIECES: u32 = 40;
/// Triangles of a cable.
const EACH: usize = (2 * SIDES * PIECES + 2 * (SIDES - 2)) as usize;
/// Cables side by side in a tray, and layers of them.
const ABREAST: u32 = 14;
const LAYERS: u32 = 3;

/// Trays full of cables until fewer than a cable's triangles are left.
pub(super) fn cables(pile: &mut Pile, f: &Finishes, plan: &Plan, triangles: usize, chance: &Chance) {
    for number in 0.. {
        let mut chance = chance.part(number);
        let floor = plan.floors.get(chance.below(plan.floors.len() as u32) as usize);
        let level = floor.map_or(0.3, |floor| floor - 0.9) + chance.range(-0.1, 0.1);
        let along_x = chance.happens(0.5);
        let (half, across) = if along_x { (plan.half.x, plan.half.y) } else { (plan.half.y, plan.half.x) };
        // Along the edge, where no vessel stands.
        let side = if chance.happens(0.5) { 1.0 } else { -1.0 };
        let middle = side * (across - chance.range(0.2, 0.6));
        let frame = if along_x {
            Affine3::IDENTITY
        } else {
            crate::generate::shape::turn(std::f32::consts::FRAC_PI_2)
        };
        let place = frame * Affine3::from_translation(Vec3::new(0.0, level, middle));
        if triangles.saturating_sub(pile.triangles()) > 20 * EACH {
            tray(pile, f, &place, half, &mut chance);
        }
        for i in 0..ABREAST * LAYERS {
            if pile.triangles() + EACH > triangles {
                return;
            }
            cable(pile, f, &place, half, i, &mut chance);
        }
    }
}

/// Two side rails and rungs along x.
fn tray(pile: &mut Pile, f: &Finishes, place: &Affine3, half: f32, chance: &mut Chance) {
    for side in [-0.26, 0.26] {
        let size = Vec3::new(2.0 * half, vary(0.1, chance), vary(0.006, chance));
        pile.add(f.galvanised, &solids::cuboid(size).at(0.0, 0.03, side).transformed(place));
    }
    for i in 0..(half / 0.15) as u32 {
        let size = Vec3::new(vary(0.03, chance), vary(0.012, chance), 0.52);
        pile.add(
            f.galvanised,
            &solids::cuboid(size).at(0.3 * i as f32 - half + 0.15, -0.012, 0.0).transformed(place),
        );
    }
}

/// The `number`-th cable of a tray: it wanders a little.
fn cable(pile: &mut Pile, f: &Finishes, place: &Affine3, half: f32, number: u32, chance: &mut Chance) {
    let (column, layer) = (number % ABREAST, number / ABREAST);
    let radius = chance.range(0.008, 0.015);
    let (z, y) = (0.034 * (column as f32 - 0.5 * (ABREAST - 1) as f32), 0.012 + 0.026 * layer as f32);
    let (mut aside, mut up) = (0.0, 0.0);
    let path: Vec<Vec3> = (0..=PIECES)
        .map(|i| {
            aside = aside * 0.85 + chance.range(-0.007, 0.007);
            up = up * 0.8 + chance.range(-0.003, 0.004);
            Vec3::new(half * (2.0 * i as f32 / PIECES as f32 - 1.0), y + up, z + aside)
        })
        .collect();
    let material = if number.is_multiple_of(11) { f.pipes[3] } else { f.rubber };
    pile.add(material, &tube::tube(&path, radius, SIDES).transformed(place));
}
