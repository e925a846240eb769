//! A scene that comes mesh by mesh, so that no more than a few meshes are in memory at a time.

use crate::scene::sorted_numbers;
use crate::{Diagnostic, Instance, Mesh, Motion, SceneDesc, SceneError, Texels, renumbered};
use rayon::Yield;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;
use vastlight_math::Affine3;

/// A placement of a piece's mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PieceInstance {
    /// Object space to world space.
    pub world_from_object: Affine3,
    /// Index into the names of [`SceneStream::desc`].
    pub name: u32,
}

/// A mesh with all its placements. Generators make meshes of at most [`Piece::MAX_TRIANGLES`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Piece {
    /// The mesh; its materials are indices into the materials of [`SceneStream::desc`].
    pub mesh: Mesh,
    /// Where it stands.
    pub instances: Vec<PieceInstance>,
    /// What was found while it was made.
    pub diagnostics: Vec<Diagnostic>,
}

impl Piece {
    /// Triangles of the largest mesh that a generator makes where it can choose.
    pub const MAX_TRIANGLES: usize = 1 << 20;

    /// A mesh that stands where it is.
    #[must_use]
    pub fn placed(mesh: Mesh, name: u32) -> Self {
        let instances = vec![PieceInstance { world_from_object: Affine3::IDENTITY, name }];
        Self { mesh, instances, ..Self::default() }
    }
}

/// Pieces in an order that does not depend on the number of threads.
pub type Pieces = Box<dyn Iterator<Item = Result<Piece, SceneError>> + Send>;

/// Gives the rows of an image one after the other: each call adds one to what it is given.
pub type NextRow = Box<dyn FnMut(&mut Texels) -> Result<(), SceneError> + Send>;

/// An image whose texels come row by row.
pub struct ImageRows {
    /// Index into the images of [`SceneStream::desc`], where it has all but texels.
    pub image: u32,
    /// Bytes that are in memory while rows come.
    pub working_bytes: u64,
    /// Starts with the first row.
    pub open: Box<dyn Fn() -> Result<NextRow, SceneError> + Send>,
}

impl fmt::Debug for ImageRows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ImageRows").field("image", &self.image).finish_non_exhaustive()
    }
}

impl ImageRows {
    /// Puts all rows into the image.
    ///
    /// # Errors
    /// A row cannot be had.
    pub fn fill(&self, desc: &mut SceneDesc) -> Result<(), SceneError> {
        let Some(image) = desc.images.get_mut(self.image as usize) else { return Ok(()) };
        let mut next = (self.open)()?;
        (0..image.height).try_for_each(|_| next(&mut image.texels))
    }
}

/// A scene whose meshes come one after the other. After an error nothing more of use comes.
pub struct SceneStream {
    /// Everything but meshes and instances; what moves counts instances in the order in which they come.
    pub desc: SceneDesc,
    /// Meshes with their placements.
    pub pieces: Pieces,
    /// Triangles of all pieces, each mesh counted once, within 1 %; `None` where nobody knows beforehand.
    pub triangles: Option<u64>,
    /// Images that have no texels in the description.
    pub rows: Vec<ImageRows>,
}

impl fmt::Debug for SceneStream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut f = f.debug_struct("SceneStream");
        f.field("desc", &self.desc).field("triangles", &self.triangles).finish_non_exhaustive()
    }
}

impl SceneStream {
    /// The whole scene. Instances stand in the order of their meshes.
    ///
    /// # Errors
    /// The first error of the pieces.
    pub fn collect(self) -> Result<SceneDesc, SceneError> {
        let mut desc = self.desc;
        self.rows.iter().try_for_each(|rows| rows.fill(&mut desc))?;
        for piece in self.pieces {
            let Piece { mesh, instances, diagnostics } = piece?;
            diagnostics.into_iter().for_each(|item| desc.diagnostics.push(item));
            desc.push_placed(mesh, &instances);
        }
        Ok(desc)
    }
}

impl SceneDesc {
    /// Adds a mesh with all its placements.
    pub fn push_placed(&mut self, mesh: Mesh, instances: &[PieceInstance]) {
        let number = self.meshes.len() as u32;
        self.meshes.push(mesh);
        self.instances.extend(instances.iter().map(|i| Instance {
            world_from_object: i.world_from_object,
            mesh: number,
            name: i.name,
        }));
    }
}

/// A scene in memory, mesh by mesh; instances are sorted by mesh. Instances of meshes that do not exist are an error
/// after the last piece.
impl From<SceneDesc> for SceneStream {
    fn from(mut desc: SceneDesc) -> Self {
        if let Some(motion) = desc.motion.take() {
            desc.motion = Some(motion_of_sorted(motion, &desc.instances));
        }
        let meshes = std::mem::take(&mut desc.meshes);
        let mut instances = std::mem::take(&mut desc.instances);
        if !instances.is_sorted_by_key(|i| i.mesh) {
            instances.sort_by_key(|i| i.mesh);
        }
        let triangles = meshes.iter().map(|m| m.triangles.len() as u64).sum();
        let stray = instances.last().map(|i| i.mesh).filter(|&mesh| mesh as usize >= meshes.len());
        let stray =
            stray.map(|mesh| Err(SceneError::new(format!("mesh {mesh} does not exist"), "instances", "")));
        let mut first = 0;
        let pieces = meshes.into_iter().enumerate().map(move |(number, mesh)| {
            let count = instances[first..].partition_point(|i| i.mesh as usize <= number);
            let placed = instances[first..first + count].iter();
            first += count;
            let place = |i: &Instance| PieceInstance { world_from_object: i.world_from_object, name: i.name };
            Ok(Piece { mesh, instances: placed.map(place).collect(), ..Piece::default() })
        });
        Self { desc, pieces: Box::new(pieces.chain(stray)), triangles: Some(triangles), rows: Vec::new() }
    }
}

/// The movement of instances that are about to be sorted by mesh.
fn motion_of_sorted(motion: Arc<dyn Motion>, instances: &[Instance]) -> Arc<dyn Motion> {
    let numbers = sorted_numbers(instances);
    if numbers.is_empty() {
        return motion;
    }
    let pair = |old: u32| Some([old, *numbers.get(old as usize)?]);
    let pairs = match motion.pose(0.0) {
        Ok(pose) => pose.instances.iter().filter_map(|&(old, _)| pair(old)).collect(),
        // Which of them move is not known.
        Err(_) => (0..numbers.len() as u32).filter_map(pair).collect(),
    };
    renumbered(motion, pairs)
}

/// Makes pieces from `jobs` on rayon's threads, at most `ahead` of them before they are asked for; their order is
/// that of the jobs. Nothing starts before the first piece is asked for.
pub fn read_ahead<J: Send + 'static>(
    jobs: impl Iterator<Item = J> + Send + 'static,
    ahead: usize,
    make: impl Fn(J) -> Result<Piece, SceneError> + Send + Sync + 'static,
) -> Pieces {
    Box::new(ReadAhead { jobs, ahead: ahead.max(1), make: Arc::new(make), under_way: VecDeque::new() })
}

struct ReadAhead<I, F> {
    jobs: I,
    ahead: usize,
    make: Arc<F>,
    under_way: VecDeque<Receiver<Result<Piece, SceneError>>>,
}

impl<J, I, F> Iterator for ReadAhead<I, F>
where
    J: Send + 'static,
    I: Iterator<Item = J>,
    F: Fn(J) -> Result<Piece, SceneError> + Send + Sync + 'static,
{
    type Item = Result<Piece, SceneError>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.under_way.len() < self.ahead {
            let Some(job) = self.jobs.next() else { break };
            let (sender, receiver) = sync_channel(1);
            let make = Arc::clone(&self.make);
            rayon::spawn_fifo(move || {
                // Nobody listens any more once the stream is dropped.
                let _ = sender.send(make(job));
            });
            self.under_way.push_back(receiver);
        }
        self.under_way.pop_front().map(|receiver| wait(&receiver))
    }

    /// Pieces that are passed over are not made.
    fn nth(&mut self, n: usize) -> Option<Self::Item> {
        let begun = n.min(self.under_way.len());
        self.under_way.drain(..begun);
        if let Some(last) = (n - begun).checked_sub(1) {
            self.jobs.nth(last)?;
        }
        self.next()
    }
}

/// Waits for a piece. Whoever waits on one of rayon's own threads works meanwhile, so that a pool of one thread does
/// not wait for itself.
fn wait(receiver: &Receiver<Result<Piece, SceneError>>) -> Result<Piece, SceneError> {
    loop {
        let patience = match rayon::yield_now() {
            Some(Yield::Executed) => Duration::ZERO,
            Some(Yield::Idle) => Duration::from_millis(1),
            None => Duration::from_secs(3600),
        };
        match receiver.recv_timeout(patience) {
            Ok(piece) => return piece,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                return Err(SceneError::new("a piece of the scene could not be made", "stream", ""));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use vastlight_math::Vec3;

    fn triangle(name: usize) -> Mesh {
        Mesh {
            name: name.to_string(),
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y * name as f32],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    fn numbered(count: usize, ahead: usize) -> Pieces {
        read_ahead(0..count, ahead, |i| Ok(Piece::placed(triangle(i), 0)))
    }

    #[test]
    fn pieces_come_in_order_whatever_runs_ahead() {
        let names = |pieces: Pieces| pieces.map(|p| p.expect("made").mesh.name).collect::<Vec<_>>();
        let expected: Vec<String> = (0..100).map(|i| i.to_string()).collect();
        for ahead in [0, 1, 3, 1000] {
            assert_eq!(names(numbered(100, ahead)), expected);
        }
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            assert_eq!(pool.install(|| names(numbered(100, 4))), expected);
        }
    }

    #[test]
    fn no_more_is_made_ahead_than_was_agreed() {
        static STARTED: AtomicUsize = AtomicUsize::new(0);
        let mut pieces = read_ahead(0..1000_usize, 5, |i| {
            STARTED.fetch_add(1, Ordering::SeqCst);
            if i == 7 { Err(SceneError::new("no", "", "")) } else { Ok(Piece::placed(triangle(i), 0)) }
        });
        assert_eq!(STARTED.load(Ordering::SeqCst), 0);
        for asked in 1..=20 {
            assert_eq!(pieces.next().expect("a piece").is_err(), asked == 8);
            assert!(STARTED.load(Ordering::SeqCst) <= asked + 4);
        }
    }

    #[test]
    fn pieces_that_are_passed_over_are_not_made() {
        static MADE: AtomicUsize = AtomicUsize::new(0);
        let mut pieces = read_ahead(0..1000_usize, 5, |i| {
            MADE.fetch_add(1, Ordering::SeqCst);
            Ok(Piece::placed(triangle(i), 0))
        });
        let mut name = |n| pieces.nth(n).map(|piece| piece.expect("made").mesh.name);
        assert_eq!(name(500), Some("500".into()));
        assert!(MADE.load(Ordering::SeqCst) <= 5);
        assert_eq!(
            (name(0), name(2), name(90)),
            (Some("501".into()), Some("504".into()), Some("595".into()))
        );
        assert_eq!((name(1000), name(0)), (None, None));
    }

    #[test]
    fn a_scene_survives_being_taken_apart() {
        let instance = |mesh, x| Instance {
            world_from_object: Affine3::from_translation(Vec3::X * x),
            mesh,
            name: mesh + 10,
        };
        let mut desc = SceneDesc {
            meshes: (0..4).map(triangle).collect(),
            instances: vec![instance(2, 0.0), instance(0, 1.0), instance(2, 2.0), instance(3, 3.0)],
            ..SceneDesc::default()
        };
        let stream = SceneStream::from(desc.clone());
        assert_eq!(stream.triangles, Some(4));
        let back = stream.collect().expect("whole");
        assert_eq!(back.meshes, desc.meshes);
        desc.instances.sort_by_key(|i| i.mesh);
        assert_eq!(back.instances, desc.instances);
        desc.instances.push(instance(4, 0.0));
        assert!(SceneStream::from(desc).collect().expect_err("a stray").what.contains("mesh 4"));
    }
}
