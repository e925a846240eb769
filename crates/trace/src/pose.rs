//! A tracer follows its scene through time: what moves is updated, the rest is never touched.
//!
//! Hits do not depend on how structures came to be, so a posed tracer gives the hits of one that is built anew.

use crate::follow::{Building, FollowReport, MovingMesh};
use crate::implicit::Implicits;
use crate::instance::{MeshSpace, ascending};
use crate::mesh::MeshTree;
use crate::tracer::{milliseconds, open_keys, view};
use crate::{Layout, TopLevel, TraceError, Tracer};
use std::time::Instant;
use vastlight_accel::wide::traverse::stack_entries;
use vastlight_accel::wide::{InstanceBvh, Still};
use vastlight_accel::{BuildConfig, Clusters};
use vastlight_math::Aabb;
use vastlight_scene::{Change, Pose, Scene, SceneError};

/// Why a scene cannot be posed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// The pose does not fit the scene, and nothing was changed.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A structure could not be built.
    #[error(transparent)]
    Trace(#[from] TraceError),
}

/// What following a pose took.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseReport {
    /// From the pose to rays, in milliseconds.
    pub ms: f64,
    /// Of these, putting vertices and places into the scene.
    pub scene_ms: f64,
    /// The structures of meshes.
    pub meshes: Vec<FollowReport>,
    /// Of these, what is above the meshes.
    pub top_ms: f64,
    /// What changed.
    pub change: Change,
}

/// The instances that move, and what stands still beside them.
#[derive(Debug)]
pub(crate) struct Movers {
    /// Ascending.
    instances: Vec<u32>,
    still: Still,
}

impl Tracer {
    /// Poses the scene that this tracer was built for, and follows it.
    ///
    /// # Errors
    /// The pose does not fit the scene, and both are as before; or a structure cannot be built, and the tracer is of no more use.
    pub fn pose(&mut self, scene: &mut Scene, pose: Pose) -> Result<PoseReport, PoseError> {
        self.follow(scene, |scene| scene.pose(pose))
    }

    /// Opens a shutter over poses of the scene, and follows it: see [`Scene::open_shutter`]. Rays then see what moves at their
    /// [`Ray::time`](vastlight_math::Ray::time), until the scene is posed again.
    ///
    /// # Errors
    /// Those of [`Tracer::pose`]; after any of them tracer and scene are of no more use.
    pub fn open_shutter(&mut self, scene: &mut Scene, poses: Vec<Pose>) -> Result<PoseReport, PoseError> {
        self.follow(scene, |scene| scene.open_shutter(poses))
    }

    /// Lets `place` bring the scene to another moment, and follows it.
    fn follow(
        &mut self,
        scene: &mut Scene,
        place: impl FnOnce(&mut Scene) -> Result<Change, SceneError>,
    ) -> Result<PoseReport, PoseError> {
        let start = Instant::now();
        self.places.let_go();
        let posed = place(scene);
        let change = match posed {
            Ok(change) => change,
            Err(error) => {
                self.places.follow(scene, &[], &[]);
                return Err(error.into());
            }
        };
        let scene_ms = milliseconds(start.elapsed());
        let mut report = PoseReport { scene_ms, ..PoseReport::default() };
        if self.follows() {
            let concerned = self.places.concerned(&change);
            report.meshes = self.follow_meshes(scene, &concerned)?;
            report.top_ms = self.follow_instances(scene, &concerned)?;
        } else if self.over_pages {
            self.place_again(scene)?;
            report.top_ms = milliseconds(start.elapsed()) - scene_ms;
        } else {
            *self = Self::new(scene, &self.config)?;
            report.top_ms = milliseconds(start.elapsed()) - scene_ms;
        }
        Ok(PoseReport { ms: milliseconds(start.elapsed()), change, ..report })
    }

    /// Says how long tracing takes from one pose to the next, in milliseconds: where it takes long, structures are updated with
    /// more care.
    pub fn expect_tracing(&mut self, ms: f64) {
        self.trace_ms = ms;
    }

    /// The clusters over which the tree of a mesh that moved is built, see [`TracerConfig::clusters`](crate::TracerConfig::clusters).
    #[must_use]
    pub fn clusters(&self, mesh: u32) -> Option<&Clusters> {
        match self.meshes.get(mesh as usize) {
            Some(MeshTree::Moving(moving)) => moving.clusters(),
            _ => None,
        }
    }

    /// Whether the structures can be updated; others are built anew.
    fn follows(&self) -> bool {
        let is_wide = self.over_pages || self.config.layout == Layout::Wide;
        self.kd.is_none() && is_wide && self.config.top == TopLevel::Tree
    }

    /// Builds a grid over pages anew.
    fn place_again(&mut self, scene: &Scene) -> Result<(), TraceError> {
        let (config, meshes) = (self.config.clone(), std::mem::take(&mut self.meshes));
        let top = (self.report.accel, config.top);
        let placed = Self::place(scene, top, meshes, |_| 1.0, &self.build_config())?;
        *self = placed;
        self.bundles &= !config.single_rays;
        (self.config, self.over_pages) = (config, true);
        Ok(())
    }

    /// Updates the structures of meshes with other vertices.
    fn follow_meshes(&mut self, scene: &Scene, change: &Change) -> Result<Vec<FollowReport>, TraceError> {
        let method = self.config.update;
        let (config, trace_ms) = (self.build_config(), self.trace_ms);
        let accel = if self.config.rebuild.is_empty() { self.report.accel } else { &self.config.rebuild };
        let mut reports = Vec::new();
        let mut building =
            Building { accel, config, clusters: self.config.clusters, scratch: &mut self.scratch };
        for &mesh in &change.meshes {
            if scene.instances().of_mesh(mesh).is_empty() {
                continue;
            }
            let view = view(scene.meshes().get(mesh as usize));
            let tree = &mut self.meshes[mesh as usize];
            reports.push(match tree {
                MeshTree::Moving(moving) => moving.follow(&view, method, trace_ms, &mut building)?,
                _ => {
                    // Its memory is there for the next one.
                    *tree = MeshTree::default();
                    let (moving, report) = MovingMesh::new(&view, method, &mut building)?;
                    *tree = MeshTree::Moving(Box::new(moving));
                    report
                }
            });
        }
        self.vertices_move = open_keys(scene, &mut self.meshes)?;
        Ok(reports)
    }

    /// Places what moved, and builds the tree over it; says how long it took.
    fn follow_instances(&mut self, scene: &Scene, change: &Change) -> Result<f64, TraceError> {
        let start = Instant::now();
        let spaces: Vec<(u32, MeshSpace)> =
            change.meshes.iter().map(|&mesh| (mesh, self.meshes[mesh as usize].space())).collect();
        self.places.follow(scene, &change.instances, &spaces);
        let of_meshes = change.meshes.iter().flat_map(|&mesh| scene.instances().of_mesh(mesh));
        let movers = ascending(change.instances.iter().copied().chain(of_meshes));
        let config = self.build_config();
        let (accel, places) = (self.report.accel, &self.places);
        if self.movers.as_ref().is_none_or(|known| known.instances != movers) {
            let rests = |i: u32| match movers.binary_search(&i) {
                Ok(_) => Aabb::EMPTY,
                Err(_) => places.bounds(i),
            };
            self.top = InstanceBvh::build(accel, places.len(), rests, |_| 1.0, &config)
                .map_err(TraceError::Build)?;
            let still = self.top.still(|i| places.bounds(i));
            self.movers = Some(Movers { instances: movers, still });
        }
        if let Some(Movers { instances, still }) = &self.movers {
            let movers = (accel, &instances[..]);
            self.top.put_beside(still, movers, |i| places.bounds(i), &config).map_err(TraceError::Build)?;
        }
        let deepest = self.meshes.iter().map(MeshTree::levels).max().unwrap_or(0);
        self.stack_entries = stack_entries(self.top.levels + deepest);
        if self.implicits.is_some() {
            self.implicits = Implicits::new(scene);
        }
        Ok(milliseconds(start.elapsed()))
    }

    fn build_config(&self) -> BuildConfig {
        let level = self.level();
        let (split_budget, optimize) = (self.config.split_budget, self.config.optimize);
        BuildConfig { level, split_budget, optimize, ..BuildConfig::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TracerConfig, UpdateMethod};
    use vastlight_accel::wide::ChildRef;
    use vastlight_math::{Affine3, Vec3};
    use vastlight_scene::{Instance, Mesh, MeshPose, SceneDesc};

    const TRIANGLES: u32 = 4096;

    /// Triangles in a row, each at its place.
    fn row(place: impl Fn(u32) -> f32) -> Vec<Vec3> {
        let corners = |i: u32| [Vec3::ZERO, Vec3::Y, Vec3::Z].map(|p| p * 0.1 + Vec3::X * place(i));
        (0..TRIANGLES).flat_map(corners).collect()
    }

    fn levels(tree: &MeshTree, child: ChildRef) -> usize {
        if child == ChildRef::NONE || child.is_leaf() {
            return 0;
        }
        let below = tree.nodes()[child.index()].children.into_iter().map(|child| levels(tree, child));
        1 + below.max().unwrap_or(0)
    }

    #[test]
    fn rays_have_room_in_trees_that_grew_deep() {
        for update in UpdateMethod::ALL {
            let mesh = Mesh {
                positions: row(|i| i as f32),
                triangles: (0..TRIANGLES).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
                ..Mesh::default()
            };
            let instances = vec![Instance { world_from_object: Affine3::IDENTITY, mesh: 0, name: 0 }];
            let desc = SceneDesc { meshes: vec![mesh], instances, ..SceneDesc::default() };
            let mut scene = Scene::new(desc).expect("valid");
            let config = TracerConfig { update, accel: "morton".into(), ..TracerConfig::default() };
            let mut tracer = Tracer::new(&scene, &config).expect("built");
            let before = tracer.stack_entries;
            // Each half as far away as the one before: a tree of Morton codes is as deep as codes are long.
            for base in [1.0, 0.97, 0.5] {
                let positions = row(|i| 1e6 * f32::powi(base, i as i32));
                let mesh = MeshPose { positions, ..MeshPose::default() };
                let pose = Pose { meshes: vec![mesh], ..Pose::default() };
                tracer.pose(&mut scene, pose).expect("fits");
                let tree = &tracer.meshes[0];
                let deep = tracer.top.levels + tree.root().map_or(0, |root| levels(tree, root));
                assert!(tracer.stack_entries >= stack_entries(deep), "{update:?} {base}: {deep} levels");
            }
            let grows = update == UpdateMethod::Rebuild;
            assert!(!grows || tracer.stack_entries > before, "the tree of the last moment is deeper");
        }
    }
}
