//! [`TriangleLight::sample`] for many triangles and points at once, lane by lane with the same bits.

use super::{Spherical, TriangleLight, TrianglePoint};
use vastlight_math::Vec2;
use vastlight_math::lanes::{LANES, Lanes, Lanes2, Lanes3};

/// Triangles by lane.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct TriangleLanes {
    a: Lanes3,
    edge_b: Lanes3,
    edge_c: Lanes3,
    normal: Lanes3,
}

impl TriangleLanes {
    pub(in super::super) const ZERO: Self =
        Self { a: Lanes3::ZERO, edge_b: Lanes3::ZERO, edge_c: Lanes3::ZERO, normal: Lanes3::ZERO };

    /// Puts a triangle into a lane.
    #[inline(always)]
    pub(in super::super) fn set(&mut self, lane: usize, triangle: &TriangleLight) {
        self.a.set(lane, triangle.a);
        self.edge_b.set(lane, triangle.edge_b);
        self.edge_c.set(lane, triangle.edge_c);
        self.normal.set(lane, triangle.normal);
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> TriangleLight {
        let (a, edge_b) = (self.a.get(lane), self.edge_b.get(lane));
        TriangleLight { a, edge_b, edge_c: self.edge_c.get(lane), normal: self.normal.get(lane) }
    }

    /// Points of the triangles as seen from `from`.
    #[inline(always)]
    pub(in super::super) fn sample(&self, from: &Lanes3, u: &Lanes2) -> PointLanes {
        // In small steps, which the compiler can turn into vectors.
        let (mut spherical, mut towards) = (SphericalLanes::ZERO, Lanes3::ZERO);
        for lane in 0..LANES {
            spherical.set(lane, &self.get(lane).spherical(from.get(lane)));
        }
        for lane in 0..LANES {
            towards.set(lane, spherical.get(lane).sample(u.get(lane)));
        }
        let (mut points, mut by_area) = (PointLanes::NONE, PointLanes::NONE);
        for lane in 0..LANES {
            by_area.set(lane, &self.get(lane).point_by_area(from.get(lane), u.get(lane)));
        }
        for lane in 0..LANES {
            let own = spherical.get(lane);
            let point = self.get(lane).point_towards(from.get(lane), &own, towards.get(lane));
            points.set(lane, &if own.is_usable() { point } else { by_area.get(lane) });
        }
        points
    }
}

/// Spherical triangles by lane.
#[derive(Clone, Copy, Debug)]
struct SphericalLanes {
    a: Lanes3,
    b: Lanes3,
    c: Lanes3,
    solid_angle: Lanes,
}

impl SphericalLanes {
    const ZERO: Self = Self { a: Lanes3::ZERO, b: Lanes3::ZERO, c: Lanes3::ZERO, solid_angle: [0.0; LANES] };

    #[inline(always)]
    fn set(&mut self, lane: usize, spherical: &Spherical) {
        self.a.set(lane, spherical.a);
        self.b.set(lane, spherical.b);
        self.c.set(lane, spherical.c);
        self.solid_angle[lane] = spherical.solid_angle;
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Spherical {
        let (a, b, c) = (self.a.get(lane), self.b.get(lane), self.c.get(lane));
        Spherical { a, b, c, solid_angle: self.solid_angle[lane] }
    }
}

/// Points on triangles by lane, but for their barycentric weights.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct PointLanes {
    wi: Lanes3,
    distance: Lanes,
    pdf: Lanes,
}

impl PointLanes {
    const NONE: Self = Self { wi: Lanes3::ZERO, distance: [0.0; LANES], pdf: [0.0; LANES] };

    #[inline(always)]
    fn set(&mut self, lane: usize, point: &TrianglePoint) {
        self.wi.set(lane, point.wi);
        (self.distance[lane], self.pdf[lane]) = (point.distance, point.pdf);
    }

    /// The point of a lane, without barycentric weights; its density is 0 where there is none.
    #[inline(always)]
    pub(in super::super) fn get(&self, lane: usize) -> TrianglePoint {
        let (wi, distance, pdf) = (self.wi.get(lane), self.distance[lane], self.pdf[lane]);
        TrianglePoint { wi, distance, barycentric: Vec2::ZERO, pdf }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::{Rng, Vec3};

    #[test]
    fn lanes_have_the_bits_of_single_points() {
        let mut rng = Rng::new(5);
        let mut point = |scale: f32| Vec3::new(rng.next_1d(), rng.next_1d(), rng.next_1d()) * scale;
        // Near, far, at a corner, without area, without place.
        for (size, away) in [(1.0, 1.0), (1e-3, 1.0), (10.0, 0.01), (1.0, 0.0), (0.0, 1.0), (1.0, f32::NAN)] {
            let (mut triangles, mut from, mut u) = (TriangleLanes::ZERO, Lanes3::ZERO, Lanes2::ZERO);
            for lane in 0..LANES {
                let corners = [point(size), point(size), point(size)];
                triangles.set(lane, &TriangleLight::new(corners, 1.0));
                from.set(lane, corners[0] + point(1.0) * away);
                u.set(lane, point(1.0).truncate());
            }
            let points = triangles.sample(&from, &u);
            for lane in 0..LANES {
                let bits = |p: TrianglePoint| [p.wi.x, p.wi.y, p.wi.z, p.distance, p.pdf].map(f32::to_bits);
                let alone = |u: Vec2| triangles.get(lane).sample(from.get(lane), u).map(bits);
                let found = Some(points.get(lane)).filter(|point| point.pdf > 0.0).map(bits);
                assert_eq!(found, alone(u.get(lane)));
                assert!(found.is_none() || found != alone(u.get(lane) * 0.5), "negative control");
            }
        }
    }
}
