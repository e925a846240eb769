//! Streets of the city with cars that drive along them and stop at lights. A function of time: of all the instances only
//! cars and the lights' lamps move.

mod drive;
mod roads;
#[cfg(test)]
mod tests;

use super::chance::Chance;
use super::palette::{lacquer, srgb};
use super::record::Recorded;
use super::shape::{Assembly, turn};
use super::{DemoSize, GenerateOptions, builder::Builder, city, lathe, solids};
use crate::{Camera, Environment, Material, Motion, MotionRecord, Pose, SceneDesc, SceneError, Sky};
use roads::{Crossing, KERB, Lane};
use serde::{Deserialize, Serialize};
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;
use vastlight_math::{Affine3, Vec3};

/// Seconds.
const DURATION: f32 = 12.0;
/// Cars that move; fewer where the city has not so many.
const CARS: usize = 84;
/// Crossings whose lights stand there.
const LIT: [Crossing; 2] = [Crossing { x: 0, z: 0 }, Crossing { x: 0, z: -1 }];
/// Where the camera stands.
const EYE: Vec3 = Vec3::new(33.6, 7.6, 88.0);

/// The scene.
pub(super) fn traffic(options: &GenerateOptions) -> SceneDesc {
    // A city that is made in memory cannot fail.
    let mut b = Builder { desc: city::city(&of_the_city(options)).collect().unwrap_or_default() };
    clear_the_way(&mut b.desc);
    let lanes = Lane::all();
    let cars = drivers(&b.desc);
    let lamps = lights(&mut b);
    let keys = drive::keys(&lanes, cars.len(), &Chance::new(options.seed, 0x7472_6166));
    let lane_of = drive::shares(&lanes, cars.len()).into_iter().zip(0..);
    let lane_of = lane_of.flat_map(|(count, lane)| std::iter::repeat_n(lane, count)).collect();
    b.desc.environment = Some(Environment::Sky(Sky {
        sun_azimuth: 2.93,
        sun_elevation: 0.72,
        turbidity: 3.2,
        ground_albedo: Vec3::splat(0.22),
        strength: 1.3,
        sun_disc: true,
    }));
    b.desc.cameras.clear();
    b.desc.cameras.push(Camera::look_at("crossing", EYE, Vec3::new(29.0, 2.6, 30.0), 46_f32.to_radians()));
    b.desc.motion = Some(Arc::new(Traffic { lanes, cars, lane_of, keys, lamps }));
    b.desc
}

/// How large the scene will be, nearly: a few lamps are not counted.
pub(super) fn size(options: &GenerateOptions) -> DemoSize {
    city::size(&of_the_city(options))
}

fn of_the_city(options: &GenerateOptions) -> GenerateOptions {
    GenerateOptions { triangles: Some(options.triangles.unwrap_or(3_000_000)), time: 0.0, ..*options }
}

/// Takes away the bollards that stand on streets where cars drive.
fn clear_the_way(desc: &mut SceneDesc) {
    let (meshes, instances) = (&desc.meshes, &mut desc.instances);
    instances.retain(|instance| {
        let at = instance.world_from_object.translation;
        let wide = instance.world_from_object.matrix3.x_axis.length();
        meshes[instance.mesh as usize].name != "pavement" || wide > 1.0 || !roads::is_across(at)
    });
}

/// The instances that become moving cars: those on lanes, then parked ones far from the camera.
fn drivers(desc: &SceneDesc) -> Vec<u32> {
    let at = |i: u32| desc.instances[i as usize].world_from_object.translation;
    let is_car = |i: &u32| desc.meshes[desc.instances[*i as usize].mesh as usize].name == "car";
    let all = (0..desc.instances.len() as u32).filter(is_car);
    let (mut cars, mut parked): (Vec<u32>, Vec<u32>) = all.partition(|&i| roads::is_on_a_lane(at(i)));
    parked.sort_by(|&a, &b| (at(b) - EYE).length_squared().total_cmp(&(at(a) - EYE).length_squared()));
    cars.extend(parked.iter().take(CARS.saturating_sub(cars.len())));
    // Colours come mesh by mesh: mix them.
    let key = |i: &u32| super::chance::mix(u64::from(*i));
    cars.sort_by_key(key);
    cars
}

/// A lamp that is on or off: pushed out of its housing or drawn in.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Lamp {
    instance: u32,
    /// The lamp's place when it is on; +z is the way out.
    place: Affine3,
    crossing: Crossing,
    axis: usize,
    green: bool,
}

impl Lamp {
    fn at(&self, time: f32) -> Affine3 {
        let on = self.crossing.is_green(self.axis, time) == self.green;
        self.place * Affine3::from_translation(Vec3::Z * if on { 0.0 } else { -0.13 })
    }
}

/// How far a signal hangs over the street, metres.
const ARM: f32 = 5.2;

/// Signals with a red and a green lamp, on the far side of some crossings, for all four directions.
fn lights(b: &mut Builder) -> Vec<Lamp> {
    let metal = b.material(lacquer("signal housing", srgb(0x23262a), 0.5));
    let red = b.material(Material::emitter("red lamp", Vec3::new(9.0, 0.35, 0.15), true));
    let green = b.material(Material::emitter("green lamp", Vec3::new(0.3, 6.5, 2.6), true));
    let mut post = Assembly::default();
    post.add(metal, &lathe::cylinder(0.09, 5.7, 8));
    post.add(metal, &solids::beveled_box(Vec3::new(ARM, 0.1, 0.1), 0.02).at(-0.5 * ARM, 5.6, 0.0));
    post.add(metal, &solids::beveled_box(Vec3::new(0.56, 1.3, 0.3), 0.03).at(-ARM, 5.2, 0.0));
    let post = b.mesh("signal post", post);
    let [red, green] = [("red lamp", red), ("green lamp", green)].map(|(name, material)| {
        let mut lamp = Assembly::default();
        lamp.add(material, &solids::ellipsoid(Vec3::new(0.2, 0.2, 0.07), 5, 10));
        b.mesh(name, lamp)
    });
    let mut lamps = Vec::new();
    for crossing in LIT {
        for corner in 0..4 {
            // Faces those who come on the right lane.
            let angle = FRAC_PI_2 * corner as f32;
            let stand = Affine3::from_translation(crossing.center()) * turn(angle);
            let place = stand * Affine3::from_translation(Vec3::new(KERB + 0.7, 0.15, -KERB - 1.2));
            b.place(post, place);
            for (mesh, height, is_green) in [(red, 5.5, false), (green, 4.9, true)] {
                let instance = b.desc.instances.len() as u32;
                let place = place * Affine3::from_translation(Vec3::new(-ARM, height, 0.15));
                b.place(mesh, place);
                let axis = usize::from(corner % 2 == 0);
                lamps.push(Lamp { instance, place, crossing, axis, green: is_green });
            }
        }
    }
    lamps
}

/// What moves in the streets.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Traffic {
    #[serde(skip, default = "Lane::all")]
    lanes: Vec<Lane>,
    /// Instances, and the lane of each.
    cars: Vec<u32>,
    lane_of: Vec<usize>,
    /// How far cars are along their lanes.
    keys: Vec<Vec<f32>>,
    lamps: Vec<Lamp>,
}

impl Motion for Traffic {
    fn duration(&self) -> f32 {
        DURATION
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let time = time.clamp(0.0, DURATION);
        let along = drive::between_keys(&self.keys, time);
        let cars = self.cars.iter().zip(&self.lane_of).zip(along);
        let mut instances: Vec<_> =
            cars.map(|((&car, &lane), along)| (car, self.lanes[lane].place(along))).collect();
        instances.extend(self.lamps.iter().map(|lamp| (lamp.instance, lamp.at(time))));
        Ok(Pose { instances, ..Pose::default() })
    }

    fn record(&self) -> Option<MotionRecord> {
        MotionRecord::new(Self::KIND, self)
    }
}

impl Recorded for Traffic {
    const KIND: &'static str = "demo:traffic";

    fn is_sound(&self, _desc: &SceneDesc) -> bool {
        self.lane_of.iter().all(|&lane| lane < self.lanes.len())
    }
}
