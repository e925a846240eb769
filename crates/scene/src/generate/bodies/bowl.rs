//! The bowl: a shell of a sphere, open above, that stands on the floor.

use super::super::lathe;
use super::super::shape::Shape;
use vastlight_math::{Vec2, Vec3};

/// Measures in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bowl {
    /// Radius of the inner face, whose lowest point is at `lift` above the floor.
    pub(super) radius: f32,
    pub(super) lift: f32,
    pub(super) thickness: f32,
    /// Height of the rim above the floor.
    pub(super) rim: f32,
}

/// What a ball touches: a normal towards it, and how deep it is in.
pub(super) type Touch = Option<(Vec3, f32)>;

impl Bowl {
    fn center(&self) -> Vec3 {
        Vec3::Y * (self.lift + self.radius)
    }

    /// Where a ball touches the bowl and the floor.
    pub(super) fn touched(&self, p: Vec3, radius: f32) -> [Touch; 2] {
        let floor = (p.y < radius).then_some((Vec3::Y, radius - p.y));
        [floor, self.shell(p, radius)]
    }

    fn shell(&self, p: Vec3, radius: f32) -> Touch {
        let from_center = p - self.center();
        let distance = from_center.length();
        if p.y >= self.rim {
            return self.on_the_rim(p, radius);
        }
        let outward = from_center / distance.max(1e-6);
        let middle = self.radius + 0.5 * self.thickness;
        let (normal, depth) = if distance < middle {
            (-outward, distance + radius - self.radius)
        } else {
            (outward, self.radius + self.thickness + radius - distance)
        };
        (depth > 0.0).then_some((normal, depth))
    }

    /// Above the rim a ball touches its round edge alone.
    fn on_the_rim(&self, p: Vec3, radius: f32) -> Touch {
        let flat = p.with_y(0.0);
        let wide = flat.length();
        let edge = 0.5 * (self.wide(self.radius) + self.wide(self.radius + self.thickness));
        let nearest = flat / wide.max(1e-6) * edge + Vec3::Y * self.rim;
        let apart = p - nearest;
        let distance = apart.length();
        let depth = radius + 0.5 * self.thickness - distance;
        (depth > 0.0 && distance > 0.0).then(|| (apart / distance, depth))
    }

    /// How far from the axis a sphere around the bowl's centre is at the height of the rim.
    fn wide(&self, radius: f32) -> f32 {
        let down = self.center().y - self.rim;
        (radius * radius - down * down).max(0.0).sqrt()
    }

    /// The bowl on a foot, closed.
    pub(super) fn surface(&self, sectors: u32) -> Shape {
        const PIECES: u32 = 40;
        let arc = |radius: f32, i: u32| {
            // Even steps along the chord are near enough to even steps along the arc.
            let x = self.wide(radius) * i as f32 / PIECES as f32;
            Vec2::new(x, self.center().y - (radius * radius - x * x).max(0.0).sqrt())
        };
        let outer = self.radius + self.thickness;
        let foot = 8;
        let wide = arc(outer, foot).x;
        let mut profile = vec![Vec2::ZERO, Vec2::new(wide, 0.0), Vec2::new(wide + 0.03, 0.02)];
        profile.extend((foot + 1..=PIECES).map(|i| arc(outer, i)));
        let (last, first) = (arc(outer, PIECES), arc(self.radius, PIECES));
        let top = (last + first) * 0.5 + Vec2::Y * (0.4 * self.thickness);
        profile.push(top);
        profile.extend((0..=PIECES).rev().map(|i| arc(self.radius, i)));
        lathe::lathe(&profile, sectors)
    }
}

#[cfg(test)]
mod tests {
    use super::super::BOWL;
    use super::*;

    #[test]
    fn balls_touch_both_faces_the_rim_and_the_floor() {
        let middle = BOWL.center();
        let slanted = Vec3::new(0.6, -0.8, 0.0);
        let on = |from_middle: f32| middle + slanted * from_middle;
        let edge = 0.5 * (BOWL.wide(BOWL.radius) + BOWL.wide(BOWL.radius + BOWL.thickness));
        let outside = BOWL.radius + BOWL.thickness;
        // A ball of radius 0.1, a hundredth inside of what it touches; then a thousandth away.
        for (at, away, which) in [
            (on(BOWL.radius - 0.09), -slanted, 1),
            (on(outside + 0.09), slanted, 1),
            (Vec3::new(0.0, BOWL.rim + 0.5 * BOWL.thickness + 0.09, edge), Vec3::Y, 1),
            (Vec3::new(3.0, 0.09, 0.0), Vec3::Y, 0),
        ] {
            let (normal, depth) = BOWL.touched(at, 0.1)[which].expect("a touch");
            assert!((normal - away).length() < 1e-4 && (depth - 0.01).abs() < 1e-4, "{at}: {normal} {depth}");
            assert_eq!(BOWL.touched(at + away * 0.011, 0.1)[which], None, "{at}");
        }
    }
}
