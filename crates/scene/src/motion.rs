//! What moves in a scene, as a function of time.

use crate::{Camera, Mesh, SceneDesc, SceneError, is_usable};
use std::collections::BTreeSet;
use std::fmt::Debug;
use std::sync::Arc;
use vastlight_math::{Affine3, Vec3, Vec4};

/// Whatever moves a scene: tracks of a file, a sequence of files, a formula. Each moment follows from its time alone, so that frames
/// can be made in any order, and by many machines.
pub trait Motion: Debug + Send + Sync {
    /// Seconds from the first moment, which is 0, to the last. Before and after these the ends hold, unless the movement
    /// goes on for ever.
    fn duration(&self) -> f32;

    /// Everything that ever moves, as it is at a time in seconds: the same meshes, instances, cameras and lights for every time.
    ///
    /// # Errors
    /// If the moment cannot be had, of a movement that is read from files.
    fn pose(&self, time: f32) -> Result<Pose, SceneError>;

    /// What a store keeps of the movement; none of one that is read from files as it goes on.
    fn record(&self) -> Option<MotionRecord> {
        None
    }
}

/// A movement as a store keeps it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MotionRecord {
    /// Who reads it.
    pub kind: String,
    /// What that one wrote.
    pub bytes: Vec<u8>,
    /// Of instances that have other numbers in the scene than in the movement: that in the movement, ascending, and that in the
    /// scene.
    pub numbers: Vec<[u32; 2]>,
}

impl MotionRecord {
    /// A record for the reader `kind`, of what it reads.
    #[must_use]
    pub fn new(kind: &str, movement: &impl serde::Serialize) -> Option<Self> {
        let bytes = postcard::to_stdvec(movement).ok()?;
        Some(Self { kind: kind.into(), bytes, numbers: Vec::new() })
    }

    /// What [`MotionRecord::new`] was given.
    ///
    /// # Errors
    /// The bytes are no such thing.
    pub fn read<T: serde::de::DeserializeOwned>(&self) -> Result<T, SceneError> {
        postcard::from_bytes(&self.bytes).map_err(|error| Self::damaged(&error.to_string()))
    }

    /// An error for a record that cannot be what was written.
    #[must_use]
    pub fn damaged(what: &str) -> SceneError {
        SceneError::new(format!("the movement is damaged: {what}"), "motion", "pack the scene again")
    }
}

/// A movement of a scene whose instances got other numbers.
#[derive(Debug)]
struct Renumbered {
    motion: Arc<dyn Motion>,
    /// As in a record.
    numbers: Vec<[u32; 2]>,
}

/// The movement where those of its instances that move have other numbers: see [`MotionRecord::numbers`].
#[must_use]
pub fn renumbered(motion: Arc<dyn Motion>, mut numbers: Vec<[u32; 2]>) -> Arc<dyn Motion> {
    numbers.retain(|[old, new]| old != new);
    numbers.sort_unstable();
    if numbers.is_empty() { motion } else { Arc::new(Renumbered { motion, numbers }) }
}

impl Renumbered {
    fn number(&self, old: u32) -> u32 {
        let found = self.numbers.binary_search_by_key(&old, |pair| pair[0]);
        found.map_or(old, |at| self.numbers[at][1])
    }
}

impl Motion for Renumbered {
    fn duration(&self) -> f32 {
        self.motion.duration()
    }

    fn pose(&self, time: f32) -> Result<Pose, SceneError> {
        let mut pose = self.motion.pose(time)?;
        pose.instances.iter_mut().for_each(|(instance, _)| *instance = self.number(*instance));
        Ok(pose)
    }

    fn record(&self) -> Option<MotionRecord> {
        let mut record = self.motion.record()?;
        // Those that were changed before, and those that only this changes.
        let before: BTreeSet<u32> = record.numbers.iter().map(|pair| pair[1]).collect();
        record.numbers.iter_mut().for_each(|pair| pair[1] = self.number(pair[1]));
        record.numbers.extend(self.numbers.iter().filter(|pair| !before.contains(&pair[0])));
        record.numbers.sort_unstable();
        Some(record)
    }
}

/// How what moves is at a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// Vertices of meshes whose triangles stay.
    pub meshes: Vec<MeshPose>,
    /// Places of instances, by index into [`SceneDesc::instances`]. One whose matrix is singular is not to be seen.
    pub instances: Vec<(u32, Affine3)>,
    /// Cameras, by index into [`SceneDesc::cameras`].
    pub cameras: Vec<(u32, Camera)>,
    /// Places of lights, by index into [`SceneDesc::lights`].
    pub lights: Vec<(u32, Affine3)>,
}

/// A mesh's vertices at a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshPose {
    /// Index into [`SceneDesc::meshes`].
    pub mesh: u32,
    /// As many as the mesh has vertices, finite.
    pub positions: Vec<Vec3>,
    /// As many, or none where the mesh has none.
    pub normals: Vec<Vec3>,
    /// As many, or none: then they are derived where a material needs them.
    pub tangents: Vec<Vec4>,
}

impl MeshPose {
    /// Refuses what does not fit a mesh of so many vertices, with normals or without.
    fn check(&self, vertices: usize, has_normals: bool) -> Result<(), String> {
        let normals = if has_normals { vertices } else { 0 };
        let tangents = [0, vertices].contains(&self.tangents.len());
        if self.positions.len() != vertices || self.normals.len() != normals || !tangents {
            let [p, n, t] = [self.positions.len(), self.normals.len(), self.tangents.len()];
            return Err(format!(
                "a moment has {p} positions, {n} normals and {t} tangents for a mesh of {vertices} vertices and {normals} normals"
            ));
        }
        match self.positions.iter().position(|&p| !is_usable(p)) {
            Some(vertex) => Err(format!("vertex {vertex} is not finite or beyond 1e15 at a moment")),
            None => Ok(()),
        }
    }
}

impl SceneDesc {
    /// The scene at a moment of its [`motion`](SceneDesc::motion), which must have one.
    ///
    /// # Errors
    /// Nothing moves, the moment cannot be had, or it does not fit the scene.
    pub fn at(mut self, time: f32) -> Result<Self, SceneError> {
        let Some(motion) = &self.motion else {
            return Err(SceneError::new("nothing moves in this scene", "scene", "leave the time out"));
        };
        let pose = motion.pose(time)?;
        self.apply(pose)?;
        Ok(self)
    }

    /// Gives what moves the places and the vertices of a moment.
    ///
    /// # Errors
    /// It does not fit the scene; then nothing is changed.
    pub fn apply(&mut self, pose: Pose) -> Result<(), SceneError> {
        self.check_pose(&pose, self.instances.len(), |mesh| &self.meshes[mesh])?;
        for (instance, map) in &pose.instances {
            self.instances[*instance as usize].world_from_object = *map;
        }
        self.apply_but_instances(pose);
        Ok(())
    }

    /// Puts everything of a checked pose in its place, but for instances.
    pub(crate) fn apply_but_instances(&mut self, pose: Pose) {
        for MeshPose { mesh, positions, normals, tangents } in pose.meshes {
            let mesh = &mut self.meshes[mesh as usize];
            (mesh.positions, mesh.normals, mesh.tangents) = (positions, normals, tangents);
        }
        for (camera, posed) in pose.cameras {
            self.cameras[camera as usize] = posed;
        }
        for (light, map) in pose.lights {
            self.lights[light as usize].world_from_light = map;
        }
    }

    /// Refuses a pose that does not fit, in a scene of so many instances whose meshes at rest are given by number.
    pub(crate) fn check_pose<'m>(
        &self,
        pose: &Pose,
        instances: usize,
        at_rest: impl Fn(usize) -> &'m Mesh,
    ) -> Result<(), SceneError> {
        let outside = |what: &str, index: u32, count: usize| {
            let what = format!("a moment moves {what} {index}, of which there are {count}");
            Err(SceneError::new(what, "motion", ""))
        };
        for posed in &pose.meshes {
            if posed.mesh as usize >= self.meshes.len() {
                return outside("mesh", posed.mesh, self.meshes.len());
            }
            let mesh = at_rest(posed.mesh as usize);
            posed
                .check(mesh.positions.len(), !mesh.normals.is_empty())
                .map_err(|what| SceneError::new(what, format!("mesh \"{}\"", mesh.name), ""))?;
        }
        let indices = |count: usize| move |index: &u32| *index as usize >= count;
        if let Some(index) = pose.instances.iter().map(|i| i.0).find(indices(instances)) {
            return outside("instance", index, instances);
        }
        if let Some(index) = pose.cameras.iter().map(|c| c.0).find(indices(self.cameras.len())) {
            return outside("camera", index, self.cameras.len());
        }
        match pose.lights.iter().map(|l| l.0).find(indices(self.lights.len())) {
            Some(index) => outside("light", index, self.lights.len()),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Encoding, Image, Instance, Material, NormalMap, Scene, Texels, Texture};
    use std::sync::Arc;

    /// A triangle that grows and goes along x.
    #[derive(Debug)]
    struct Growing;

    fn triangle(time: f32) -> Vec<Vec3> {
        vec![Vec3::ZERO, Vec3::X * (1.0 + time), Vec3::Y]
    }

    impl Motion for Growing {
        fn duration(&self) -> f32 {
            2.0
        }

        fn pose(&self, time: f32) -> Result<Pose, SceneError> {
            let mesh = MeshPose { positions: triangle(time), ..MeshPose::default() };
            let instances = vec![(0, Affine3::from_translation(Vec3::X * time))];
            Ok(Pose { meshes: vec![mesh], instances, ..Pose::default() })
        }
    }

    fn growing() -> SceneDesc {
        let mesh = Mesh { positions: triangle(0.0), triangles: vec![[0, 1, 2]], ..Mesh::default() };
        SceneDesc {
            meshes: vec![mesh],
            instances: vec![Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 }],
            motion: Some(Arc::new(Growing)),
            ..SceneDesc::default()
        }
    }

    #[test]
    fn a_scene_is_had_at_any_moment() {
        let desc = growing().at(1.5).expect("a moment");
        assert_eq!(desc.meshes[0].positions, triangle(1.5));
        assert_eq!(desc.instances[0].world_from_object.translation, Vec3::new(1.5, 0.0, 0.0));
        let still = SceneDesc { motion: None, ..growing() };
        assert!(still.at(1.0).expect_err("still").to_string().contains("nothing moves"));
    }

    #[test]
    fn poses_that_do_not_fit_are_refused_and_change_nothing() {
        let fine = || MeshPose { positions: triangle(1.0), ..MeshPose::default() };
        let of_mesh = |mesh: MeshPose| Pose { meshes: vec![mesh], ..Pose::default() };
        let moved = (0, Affine3::from_translation(Vec3::Y));
        let camera = (0, Camera::framing(&vastlight_math::Aabb::EMPTY));
        let wrong = [
            of_mesh(MeshPose { mesh: 1, ..fine() }),
            of_mesh(MeshPose { positions: vec![Vec3::ZERO; 4], ..fine() }),
            of_mesh(MeshPose { positions: vec![Vec3::ZERO, Vec3::NAN, Vec3::X], ..fine() }),
            of_mesh(MeshPose { normals: vec![Vec3::Z; 3], ..fine() }),
            of_mesh(MeshPose { tangents: vec![Vec4::X], ..fine() }),
            Pose { instances: vec![moved, (1, Affine3::IDENTITY)], ..Pose::default() },
            Pose { instances: vec![moved], cameras: vec![camera], ..Pose::default() },
            Pose { instances: vec![moved], lights: vec![(0, Affine3::IDENTITY)], ..Pose::default() },
        ];
        for pose in wrong {
            let mut desc = growing();
            let error = desc.apply(pose.clone()).expect_err("does not fit");
            assert!(!error.to_string().is_empty(), "{pose:?}");
            assert_eq!(desc.meshes, growing().meshes);
            assert_eq!(desc.instances, growing().instances);
        }
        growing().apply(of_mesh(fine())).expect("fits");
    }

    fn flat_image() -> Image {
        let texels = Texels::U8(vec![128, 128, 255]);
        Image { name: "flat".into(), width: 1, height: 1, channels: 3, texels }
    }

    /// A scene of several meshes and instances out of order, of which some become singular, with tangents that are derived.
    fn mixed() -> SceneDesc {
        let mut desc = growing();
        let mut normal_map = Material::new("bumpy");
        normal_map.normal_map = Some(NormalMap { texture: 0, scale: 1.0 });
        desc.materials = vec![Material::new("plain"), normal_map];
        desc.images = vec![flat_image()];
        desc.textures = vec![Texture::new(0, Encoding::Linear)];
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(vastlight_math::Vec2::from);
        desc.meshes.push(Mesh {
            name: "mirrored".into(),
            positions: corners.map(|c| c.extend(0.3 * c.x)).to_vec(),
            normals: vec![Vec3::Z; 4],
            // The second triangle's coordinates are the first one's, mirrored.
            uvs: vec![vec![corners[0], corners[1], corners[2], corners[0]]],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
            parts: vec![crate::Part { first_triangle: 0, material: 1 }],
            ..Mesh::default()
        });
        let place = |mesh, x: f32| Instance {
            world_from_object: Affine3::from_translation(Vec3::X * x),
            mesh,
            name: 0,
        };
        desc.instances = vec![place(1, 5.0), place(0, 1.0), place(1, -3.0), place(0, 2.0)];
        // At rest a triangle is broken, and whole at all moments.
        desc.meshes[0].positions[1] = Vec3::NAN;
        desc.motion = Some(Arc::new(Mixed));
        desc
    }

    #[derive(Debug)]
    struct Mixed;

    impl Motion for Mixed {
        fn duration(&self) -> f32 {
            1.0
        }

        fn pose(&self, time: f32) -> Result<Pose, SceneError> {
            let bent =
                mixed().meshes[1].positions.iter().map(|p| *p + Vec3::Z * (time * p.x * p.y)).collect();
            let normals = vec![Vec3::new(0.0, time, 1.0).normalize(); 4];
            let mesh = MeshPose { mesh: 1, positions: bent, normals, tangents: Vec::new() };
            let grown = Affine3::from_scale(Vec3::splat(1.0 - time));
            let mut pose = Growing.pose(time)?;
            pose.meshes.insert(0, mesh);
            pose.instances = vec![(2, grown)];
            Ok(pose)
        }
    }

    /// Three of five instances, which numbers say.
    #[derive(Debug)]
    struct Numbered([u32; 3]);

    impl Motion for Numbered {
        fn duration(&self) -> f32 {
            1.0
        }

        fn pose(&self, _: f32) -> Result<Pose, SceneError> {
            let instances = self.0.map(|number| (number, Affine3::IDENTITY)).to_vec();
            Ok(Pose { instances, ..Pose::default() })
        }

        fn record(&self) -> Option<MotionRecord> {
            MotionRecord::new("numbered", &self.0)
        }
    }

    #[test]
    fn numbers_that_change_twice_come_back_from_a_record() {
        let start: Arc<dyn Motion> = Arc::new(Numbered([0, 1, 4]));
        // One is changed twice, one at first, one at last, where another has been before.
        let once = renumbered(Arc::clone(&start), vec![[1, 2], [0, 3], [4, 4]]);
        let twice = renumbered(once, vec![[3, 1], [4, 3]]);
        let numbers = |motion: &Arc<dyn Motion>| -> Vec<u32> {
            motion.pose(0.0).expect("a moment").instances.iter().map(|i| i.0).collect()
        };
        assert_eq!(numbers(&twice), [1, 2, 3]);
        let record = twice.record().expect("kept");
        assert_eq!(record.numbers, [[0, 1], [1, 2], [4, 3]]);
        let read = Arc::new(Numbered(record.read().expect("sound")));
        assert_eq!(numbers(&renumbered(read, record.numbers)), numbers(&twice));
    }

    #[test]
    fn a_posed_scene_is_that_of_the_moment_whatever_came_before() {
        let mut scene = Scene::new(mixed()).expect("valid");
        assert!(scene.meshes()[1].positions.len() > 4, "the seam is split");
        // At 1, an instance is singular.
        for time in [0.5, 1.0, 0.25, 0.0, 1.0] {
            let change = scene.pose(Mixed.pose(time).expect("a moment")).expect("fits");
            let fresh = Scene::new(mixed().at(time).expect("a moment")).expect("valid");
            assert_eq!(scene.meshes(), fresh.meshes());
            assert_eq!(scene.instances(), fresh.instances());
            assert_eq!((scene.bounds(), scene.extents()), (fresh.bounds(), fresh.extents()));
            assert_eq!(change.meshes, [0, 1]);
            assert_eq!(change.instances, [3], "the third in the table is the last by mesh");
        }
        let error = scene.pose(Pose { instances: vec![(4, Affine3::IDENTITY)], ..Pose::default() });
        assert!(error.expect_err("outside").to_string().contains("instance 4"));
    }
}
