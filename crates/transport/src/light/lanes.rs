//! Lights for many points at once: lane by lane what [`Lights::weights`] and [`Lights::draw`] say, with the same bits.
//!
//! What most scenes need most often is computed for all lanes together: how much each light matters, points on plain
//! triangles, directions to an even sky. Each point makes its own choices, and everything else, by itself.

use super::surfaces::PlainTriangle;
use super::tree::EstimateLanes;
use super::triangle::TriangleLanes;
use super::{LightSample, Lights, ONE_MINUS_EPSILON, Odds, Weights};
use vastlight_math::lanes::{LANES, Lanes, Lanes2, Lanes3};
use vastlight_math::{Frame, Vec3, warp};

/// The arguments of [`Lights::sample`], by lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightQueries {
    /// Lanes that want an answer.
    pub(crate) wanted: [bool; LANES],
    pub(crate) from: Lanes3,
    pub(crate) normal: Lanes3,
    pub(crate) pick: Lanes,
    pub(crate) u: Lanes2,
    /// Times in an open shutter.
    pub(crate) time: Lanes,
}

/// The answers, by lane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightAnswers {
    /// Zero where nothing was wanted, or no light can reach the point.
    pub(crate) odds: [Odds; LANES],
    pub(crate) samples: [Option<LightSample>; LANES],
}

/// [`Weights`] by lane.
struct WeightLanes {
    estimate: EstimateLanes,
    local: Lanes,
    background: Lanes,
    sun: Lanes,
    sum: Lanes,
    scale: Lanes,
}

/// Lanes that chose the same kind of light, close together.
#[derive(Clone, Copy)]
struct Chosen {
    count: usize,
    lanes: [u8; LANES],
}

impl Chosen {
    const NONE: Self = Self { count: 0, lanes: [0; LANES] };

    fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Adds a lane; gives its place.
    #[inline(always)]
    fn push(&mut self, lane: usize) -> usize {
        let place = self.count % LANES;
        self.lanes[place] = lane as u8;
        self.count += 1;
        place
    }

    /// Places and lanes.
    #[inline(always)]
    fn iter(&self) -> impl Iterator<Item = (usize, usize)> {
        self.lanes.iter().take(self.count).map(|&lane| usize::from(lane) % LANES).enumerate()
    }
}

/// Points that chose a triangle that shines alike everywhere.
struct OnTriangles {
    chosen: Chosen,
    shapes: TriangleLanes,
    from: Lanes3,
    u: Lanes2,
    radiance: [Vec3; LANES],
    /// Of the choice within the local lights, and of the local lights.
    probability: [[f32; 2]; LANES],
}

impl OnTriangles {
    const NONE: Self = Self {
        chosen: Chosen::NONE,
        shapes: TriangleLanes::ZERO,
        from: Lanes3::ZERO,
        u: Lanes2::ZERO,
        radiance: [Vec3::ZERO; LANES],
        probability: [[0.0; 2]; LANES],
    };

    #[inline(always)]
    fn push(&mut self, q: &LightQueries, lane: usize, triangle: &PlainTriangle<'_>, probability: [f32; 2]) {
        let place = self.chosen.push(lane);
        self.shapes.set(place, triangle.shape);
        self.from.set(place, q.from.get(lane));
        self.u.set(place, q.u.get(lane));
        self.radiance[place] = triangle.radiance;
        self.probability[place] = probability;
    }

    #[inline(always)]
    fn answer(&self, answers: &mut LightAnswers) {
        if self.chosen.is_empty() {
            return;
        }
        let points = self.shapes.sample(&self.from, &self.u);
        for (place, lane) in self.chosen.iter() {
            let (point, [within, local]) = (points.get(place), self.probability[place]);
            answers.samples[lane] = (point.pdf > 0.0).then_some(LightSample {
                wi: point.wi,
                distance: point.distance,
                radiance: self.radiance[place],
                pdf: point.pdf * within * local,
                delta: false,
            });
        }
    }
}

/// Points that chose an even sky.
struct UnderSky {
    chosen: Chosen,
    normal: Lanes3,
    u: Lanes2,
}

impl UnderSky {
    const NONE: Self = Self { chosen: Chosen::NONE, normal: Lanes3::ZERO, u: Lanes2::ZERO };

    #[inline(always)]
    fn push(&mut self, q: &LightQueries, lane: usize) {
        let place = self.chosen.push(lane);
        self.normal.set(place, q.normal.get(lane));
        self.u.set(place, q.u.get(lane));
    }

    #[inline(always)]
    fn answer(&self, lights: &Lights<'_>, answers: &mut LightAnswers) {
        if self.chosen.is_empty() {
            return;
        }
        let mut wi = Lanes3::ZERO;
        for place in 0..LANES {
            let frame = Frame::from_z(self.normal.get(place));
            wi.set(place, frame.to_outer(warp::cosine_hemisphere(self.u.get(place))));
        }
        for (place, lane) in self.chosen.iter() {
            let odds = answers.odds[lane];
            answers.samples[lane] = lights.distant_sample(odds, self.normal.get(place), wi.get(place));
        }
    }
}

impl Lights<'_> {
    /// Answers all lanes that want it.
    #[inline(always)]
    pub(crate) fn draw_lanes(&self, q: &LightQueries) -> LightAnswers {
        let mut answers = LightAnswers { odds: [Odds::default(); LANES], samples: [None; LANES] };
        if !q.wanted.contains(&true) {
            return answers;
        }
        let weights = self.weights_of_lanes(&q.from, &q.normal);
        let (mut triangles, mut sky) = (OnTriangles::NONE, UnderSky::NONE);
        for lane in 0..LANES {
            if !q.wanted[lane] || weights.sum[lane] <= 0.0 || weights.sum[lane].is_nan() {
                continue;
            }
            let own = weights.get(lane);
            answers.odds[lane] = own.odds;
            let Odds { local, background, .. } = own.odds;
            if q.pick[lane] < local {
                answers.samples[lane] = self.draw_local(&own, q, lane, &mut triangles);
            } else if q.pick[lane] - local < background
                && self.distant.is_even()
                && q.normal.get(lane) != Vec3::ZERO
            {
                sky.push(q, lane);
            } else {
                let (from, normal) = (q.from.get(lane), q.normal.get(lane));
                answers.samples[lane] =
                    self.draw(&own, from, normal, q.pick[lane], (q.u.get(lane), q.time[lane]));
            }
        }
        triangles.answer(&mut answers);
        sky.answer(self, &mut answers);
        answers
    }

    /// Chooses a local light; plain triangles are left to `triangles`.
    #[inline(always)]
    fn draw_local(
        &self,
        weights: &Weights,
        q: &LightQueries,
        lane: usize,
        triangles: &mut OnTriangles,
    ) -> Option<LightSample> {
        let (from, normal, local) = (q.from.get(lane), q.normal.get(lane), weights.odds.local);
        let pick = (q.pick[lane] / local).min(ONE_MINUS_EPSILON);
        let choice = self.local.choose(&weights.estimate, from, normal, pick)?;
        let Some(plain) = self.local.plain_triangle(&choice) else {
            let at = (q.u.get(lane), q.time[lane]);
            let sample = self.local.sample_chosen(&choice, from, normal, at)?;
            return Some(LightSample { pdf: sample.pdf * local, ..sample });
        };
        if plain.shines_at(from) {
            triangles.push(q, lane, &plain, [choice.probability, local]);
        }
        None
    }

    /// [`Lights::weights`] of every lane.
    #[inline(always)]
    fn weights_of_lanes(&self, from: &Lanes3, normal: &Lanes3) -> WeightLanes {
        let estimate = self.local.estimate_lanes(from, normal);
        let [mut local, mut background, mut sun, mut directional, mut sum, mut scale] = [[0.0; LANES]; 6];
        for lane in 0..LANES {
            sun[lane] = self.distant.sun_estimate(normal.get(lane)).sqrt();
            directional[lane] = self.distant.directional_estimate(normal.get(lane));
        }
        for lane in 0..LANES {
            let background_weight = self.distant.background_estimate(normal.get(lane)).sqrt();
            let (odds, all, one_over_all) =
                Odds::of(estimate.total[lane].sqrt(), background_weight, sun[lane], directional[lane]);
            (local[lane], background[lane], sun[lane]) = (odds.local, odds.background, odds.sun);
            (sum[lane], scale[lane]) = (all, one_over_all);
        }
        WeightLanes { estimate, local, background, sun, sum, scale }
    }
}

impl WeightLanes {
    /// Those of a lane.
    #[inline(always)]
    fn get(&self, lane: usize) -> Weights {
        let odds = Odds { local: self.local[lane], background: self.background[lane], sun: self.sun[lane] };
        Weights { odds, estimate: self.estimate.get(lane), scale: self.scale[lane] }
    }
}
