//! The side elevations: arches below, two storeys of slender columns above, with galleries behind.

use super::{
    BAY, BAYS, FAR, FIRST, GALLERY, HALF_WIDTH, NEAR, SECOND, SPRING, bay_place, materials::Finishes,
};
use crate::generate::builder::Builder;
use crate::generate::shape::{Assembly, Shape, turn};
use crate::generate::{extrude::extrude, lathe, solids, tube};
use std::f32::consts::{FRAC_PI_2, PI};
use vastlight_math::{Vec2, Vec3, real::sin_cos};

/// Height at which the arches spring from the columns.
const IMPOST: f32 = 3.5;
/// Radius of the arches.
const ARCH: f32 = 2.5;
/// Thickness of the arcade wall.
const WALL: f32 = 0.84;

/// Both elevations.
pub(super) fn arcades(b: &mut Builder, finishes: &Finishes) {
    let bay = b.mesh("arcade bay", bay_assembly(finishes));
    let rail = b.mesh("balustrade", balustrade(finishes));
    let great = great_column(finishes, b);
    let mut order = |name, radius, height| {
        let mut column = Assembly::default();
        column.add(finishes.carved, &slender_column(radius, height));
        b.mesh(name, column)
    };
    let middle = order("gallery column", 0.22, SECOND - 0.9 - FIRST);
    let upper = order("upper column", 0.17, SPRING - 1.0 - SECOND);
    for side in [-1.0, 1.0] {
        for i in 0..BAYS {
            let place = bay_place(side, i);
            b.place(bay, place);
            for floor in [FIRST, SECOND] {
                b.place(rail, place * vastlight_math::Affine3::from_translation(Vec3::new(0.0, floor, 0.22)));
            }
            for half in [-0.5, 0.0] {
                let at = |y: f32| place.transform_point3(Vec3::new(BAY * half, y, 0.0));
                b.place_at(middle, at(FIRST));
                b.place_at(upper, at(SECOND));
            }
        }
        for line in 0..=BAYS {
            b.place_at(great, Vec3::new(side * HALF_WIDTH, 0.0, NEAR - BAY * line as f32));
        }
        mouldings(b, finishes, side);
    }
}

/// What repeats with every bay.
fn bay_assembly(finishes: &Finishes) -> Assembly {
    let mut bay = Assembly::default();
    bay.add(finishes.limestone, &arch_wall());
    bay.add(finishes.carved, &archivolt());
    let keystone = [[-0.16, 5.92], [0.16, 5.92], [0.24, 6.5], [-0.24, 6.5]].map(Vec2::from_array);
    bay.add(finishes.carved, &extrude(&keystone, WALL + 0.24));
    for (floor, ceiling) in [(FIRST, FIRST - 0.5), (SECOND, SECOND - 0.4)] {
        let slab = Vec3::new(BAY, floor - ceiling, GALLERY + 0.2);
        bay.add(
            finishes.plaster,
            &solids::cuboid(slab).at(0.0, (floor + ceiling) * 0.5, -GALLERY * 0.5 - 0.1),
        );
    }
    for top in [SECOND, SPRING] {
        let beam = solids::beveled_box(Vec3::new(BAY + 0.02, 0.6, 0.6), 0.03).at(0.0, top - 0.7, 0.0);
        bay.add(finishes.limestone, &beam);
    }
    for (floor, height) in [(0.0, 3.4), (FIRST, 2.7), (SECOND, 2.4)] {
        bay.add(finishes.wood, &door(height).at(0.0, floor, -GALLERY + 0.03));
        bay.add(finishes.carved, &door_frame(height).at(0.0, floor, -GALLERY + 0.06));
    }
    bay
}

/// The wall above the columns with its round arch.
fn arch_wall() -> Shape {
    let mut outline = vec![Vec2::new(-BAY * 0.5, FIRST - 0.5), Vec2::new(-BAY * 0.5, IMPOST)];
    outline.extend(arc(ARCH, PI, 0.0, 28));
    outline.extend([Vec2::new(BAY * 0.5, IMPOST), Vec2::new(BAY * 0.5, FIRST - 0.5)]);
    extrude(&outline, WALL)
}

/// The moulded ring around the arch, standing out from the wall.
fn archivolt() -> Shape {
    let mut rings = Shape::default();
    for (inner, outer, depth) in
        [(ARCH - 0.02, ARCH + 0.13, WALL + 0.06), (ARCH + 0.13, ARCH + 0.3, WALL + 0.14)]
    {
        let mut ring = arc(inner, PI, 0.0, 28);
        ring.extend(arc(outer, 0.0, PI, 28));
        rings.merge(&extrude(&ring, depth));
    }
    rings
}

/// Points of a circle around the arch's centre.
fn arc(radius: f32, from: f32, to: f32, pieces: u32) -> Vec<Vec2> {
    (0..=pieces)
        .map(|i| {
            let (s, c) = sin_cos(from + (to - from) * i as f32 / pieces as f32);
            Vec2::new(radius * c, IMPOST + radius * s)
        })
        .collect()
}

/// A panelled double door.
fn door(height: f32) -> Shape {
    let mut door = Shape::default();
    for side in [-0.5, 0.5] {
        door.merge(&solids::beveled_box(Vec3::new(0.98, height, 0.06), 0.01).at(side, height * 0.5, 0.0));
        for (low, high) in [(0.25, 0.45 * height), (0.45 * height + 0.2, height - 0.25)] {
            let size = Vec3::new(0.66, high - low, 0.06);
            door.merge(&solids::beveled_box(size, 0.025).at(side, (low + high) * 0.5, 0.03));
        }
    }
    door
}

fn door_frame(height: f32) -> Shape {
    let mut frame = solids::beveled_box(Vec3::new(2.9, 0.35, 0.3), 0.04).at(0.0, height + 0.17, 0.0);
    for side in [-1.2, 1.2] {
        frame.merge(&solids::beveled_box(Vec3::new(0.36, height, 0.2), 0.03).at(side, height * 0.5, 0.0));
    }
    frame
}

/// A bay's railing: bronze bars under a wooden handrail, on the gallery's edge.
fn balustrade(finishes: &Finishes) -> Assembly {
    let mut bars = Shape::default();
    let count = 44;
    for i in 0..count {
        let x = BAY * ((i as f32 + 0.5) / count as f32 - 0.5);
        bars.merge(&tube::rod(Vec3::new(x, 0.06, 0.0), Vec3::new(x, 1.0, 0.0), 0.011, 6));
    }
    bars.merge(&solids::cuboid(Vec3::new(BAY, 0.03, 0.05)).at(0.0, 0.08, 0.0));
    bars.merge(&solids::cuboid(Vec3::new(BAY, 0.02, 0.05)).at(0.0, 0.99, 0.0));
    for x in [-BAY * 0.5, 0.0] {
        bars.merge(&solids::beveled_box(Vec3::new(0.05, 1.0, 0.05), 0.005).at(x, 0.5, 0.0));
    }
    let mut rail = Assembly::default();
    rail.add(finishes.bronze, &bars);
    rail.add(finishes.wood, &solids::beveled_box(Vec3::new(BAY, 0.06, 0.11), 0.02).at(0.0, 1.03, 0.0));
    rail
}

/// The columns that carry the arches.
fn great_column(finishes: &Finishes, b: &mut Builder) -> u32 {
    let radius = 0.4;
    let profile = shaft_profile(radius, IMPOST - 0.32, 0.2);
    let mut column = Assembly::default();
    column.add(finishes.carved, &lathe::lathe(&profile, 40));
    column.add(finishes.granite, &solids::beveled_box(Vec3::new(1.12, 0.2, 1.12), 0.02).at(0.0, 0.1, 0.0));
    column.add(
        finishes.carved,
        &solids::beveled_box(Vec3::new(1.02, 0.32, 1.02), 0.04).at(0.0, IMPOST - 0.16, 0.0),
    );
    b.mesh("great column", column)
}

fn slender_column(radius: f32, height: f32) -> Shape {
    let mut column = lathe::lathe(&shaft_profile(radius, height - 0.1, 0.08), 24);
    let block = Vec3::new(radius * 2.7, 0.1, radius * 2.7);
    column.merge(&solids::beveled_box(block, 0.015).at(0.0, height - 0.05, 0.0));
    column.merge(&solids::beveled_box(block, 0.015).at(0.0, 0.05, 0.0));
    column
}

/// A column from `base` to `top`: torus, shaft with entasis, necking ring and bell.
fn shaft_profile(radius: f32, top: f32, base: f32) -> Vec<Vec2> {
    let r = radius;
    let mut profile = vec![Vec2::new(0.0, base)];
    let bulge = |profile: &mut Vec<Vec2>, at: f32, reach: f32, half: f32| {
        for i in 0..=8 {
            let (s, c) = sin_cos(PI * (i as f32 / 8.0 - 0.5));
            profile.push(Vec2::new(reach - half + half * c, at + half * s));
        }
    };
    bulge(&mut profile, base + 0.22 * r, r * 1.3, 0.22 * r);
    profile.push(Vec2::new(r * 1.1, base + 0.46 * r));
    let (low, high) = (base + 0.62 * r, top - 1.1 * r);
    for i in 0..=12 {
        let t = i as f32 / 12.0;
        profile.push(Vec2::new(r * (1.0 - 0.14 * t * t), low + (high - low) * t));
    }
    bulge(&mut profile, high + 0.1 * r, r * 1.0, 0.1 * r);
    for i in 0..=8 {
        let t = i as f32 / 8.0;
        let flare = r * (0.86 + 0.42 * t * t);
        profile.push(Vec2::new(flare, high + 0.24 * r + (top - high - 0.24 * r) * t));
    }
    profile.push(Vec2::new(0.0, top));
    profile
}

/// Cornices that run along the whole elevation.
fn mouldings(b: &mut Builder, finishes: &Finishes, side: f32) {
    let mut cornices = Shape::default();
    for (top, height, reach) in [(FIRST, 0.5, 0.4), (SECOND, 0.4, 0.3), (SPRING + 0.05, 0.45, 0.45)] {
        cornices.merge(&cornice(top, height, reach));
    }
    let place =
        vastlight_math::Affine3::from_translation(Vec3::new(side * HALF_WIDTH, 0.0, (NEAR + FAR) * 0.5))
            * turn(-side * FRAC_PI_2);
    b.object("cornice", finishes.carved, &cornices.transformed(&place));
}

/// A moulding along x whose profile steps and swells out towards +z.
fn cornice(top: f32, height: f32, reach: f32) -> Shape {
    let face = WALL * 0.5;
    let mut profile =
        vec![Vec2::new(-0.3, top), Vec2::new(-0.3, top - height), Vec2::new(face, top - height)];
    for i in 0..=8 {
        let t = i as f32 / 8.0;
        let (s, _) = sin_cos((t - 0.5) * PI);
        profile
            .push(Vec2::new(face + 0.04 + (reach - 0.1) * (0.5 + 0.5 * s), top - height * (0.92 - 0.5 * t)));
    }
    profile.extend([
        Vec2::new(face + reach, top - height * 0.34),
        Vec2::new(face + reach, top - height * 0.08),
        Vec2::new(face + reach - 0.03, top),
    ]);
    // The polygon lies in (z, y).
    extrude(&profile, NEAR - FAR).turned(-FRAC_PI_2)
}
