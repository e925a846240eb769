//! Placements of meshes as a scene keeps them: a matrix for each, all else in tables that many share.

use crate::{Instance, PieceInstance, SceneError, can_be_placed};
use rayon::prelude::*;
use std::ops::Range;
use vastlight_math::Affine3;

/// Instances that share a row of the table that finds their meshes.
const BLOCK: usize = 64;

/// Placements of meshes, numbered in the order of the meshes: 48 bytes each, and four more where instances of a mesh have
/// names of their own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instances {
    maps: Vec<Affine3>,
    /// By mesh, its first instance.
    starts: Vec<u32>,
    /// By block of instances, the mesh of the first one.
    blocks: Vec<u32>,
    names: InstanceNames,
}

/// Which names instances have, as indices into [`crate::SceneDesc::names`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum InstanceNames {
    /// By mesh: all its instances have the same.
    OfMesh(Vec<u32>),
    /// By instance.
    Own(Vec<u32>),
}

impl Default for InstanceNames {
    fn default() -> Self {
        Self::OfMesh(Vec::new())
    }
}

impl Instances {
    /// In scenes with at most so many instances what is derived from their matrices is kept; in larger ones it is derived
    /// whenever it is needed, with the same bits.
    pub const AT_HAND: usize = 1 << 18;
    /// Most instances: they are numbered with 31 bits.
    pub const MOST: usize = (1 << 31) - 1;

    /// Instances of `meshes` meshes, in any order; those of a mesh keep theirs.
    ///
    /// # Errors
    /// An instance of a mesh that does not exist, or too many instances.
    pub fn new(mut instances: Vec<Instance>, meshes: usize) -> Result<Self, SceneError> {
        if let Some(i) = instances.iter().position(|i| i.mesh as usize >= meshes) {
            let what = format!("mesh {} does not exist", instances[i].mesh);
            return Err(SceneError::new(what, format!("instance {i}"), ""));
        }
        if !instances.is_sorted_by_key(|i| i.mesh) {
            instances.sort_by_key(|i| i.mesh);
        }
        let mut all = Self::default();
        all.maps.reserve_exact(instances.len());
        let mut runs = instances.chunk_by(|a, b| a.mesh == b.mesh).peekable();
        for mesh in 0..meshes as u32 {
            let run = runs.next_if(|run| run[0].mesh == mesh).unwrap_or_default();
            all.push_mesh(run.iter().map(|i| (i.world_from_object, i.name)));
        }
        all.checked()
    }

    /// Instances as a store has them: matrices, by mesh its first instance, and names.
    ///
    /// # Errors
    /// Tables that do not fit each other.
    pub fn from_tables(
        maps: Vec<Affine3>,
        starts: Vec<u32>,
        names: InstanceNames,
    ) -> Result<Self, SceneError> {
        let error = |what: &str| Err(SceneError::new(what, "instances", ""));
        let inside = starts.iter().all(|&start| start as usize <= maps.len());
        let complete = starts.first().map_or(maps.is_empty(), |&first| first == 0);
        if !inside || !complete || !starts.is_sorted() {
            return error("meshes have instances that do not exist");
        }
        let (found, wanted) = match &names {
            InstanceNames::OfMesh(names) => (names.len(), starts.len()),
            InstanceNames::Own(names) => (names.len(), maps.len()),
        };
        if found != wanted {
            return error("there are not as many names as there should be");
        }
        let mut all = Self { maps, starts, blocks: Vec::new(), names };
        all.find_blocks();
        all.checked()
    }

    fn checked(self) -> Result<Self, SceneError> {
        if self.len() <= Self::MOST {
            return Ok(self);
        }
        let what = format!("{} are too many (at most {})", self.len(), Self::MOST);
        Err(SceneError::new(what, "instances", ""))
    }

    /// Adds the placements of the next mesh.
    pub fn add_mesh(&mut self, placements: &[PieceInstance]) {
        self.push_mesh(placements.iter().map(|i| (i.world_from_object, i.name)));
    }

    fn push_mesh(&mut self, placements: impl Iterator<Item = (Affine3, u32)>) {
        self.maps.reserve(placements.size_hint().0);
        let (mesh, first) = (self.starts.len() as u32, self.maps.len());
        self.starts.push(first as u32);
        if let InstanceNames::OfMesh(names) = &mut self.names {
            names.push(0);
        }
        for (map, name) in placements {
            if self.maps.len().is_multiple_of(BLOCK) {
                self.blocks.push(mesh);
            }
            self.push_name(name, self.maps.len() == first);
            self.maps.push(map);
        }
    }

    fn push_name(&mut self, name: u32, is_first: bool) {
        if let InstanceNames::OfMesh(names) = &mut self.names {
            match names.last_mut() {
                Some(of_mesh) if is_first => *of_mesh = name,
                Some(of_mesh) if *of_mesh == name => {}
                _ => self.names = InstanceNames::Own((0..self.len()).map(|i| self.name(i)).collect()),
            }
        }
        if let InstanceNames::Own(names) = &mut self.names {
            names.push(name);
        }
    }

    fn find_blocks(&mut self) {
        let (starts, count) = (&self.starts, self.maps.len());
        let mesh = |i: usize| (starts.partition_point(|&start| start as usize <= i) - 1) as u32;
        self.blocks = (0..count).step_by(BLOCK).map(mesh).collect();
    }

    /// Puts an instance in another place.
    pub(crate) fn put(&mut self, number: u32, map: Affine3) {
        self.maps[number as usize] = map;
    }

    /// Leaves out those whose matrix cannot be used; says how many.
    pub(crate) fn drop_singular(&mut self) -> usize {
        if self.maps.par_iter().all(can_be_placed) {
            return 0;
        }
        let mut sound = Self::default();
        for mesh in 0..self.starts.len() as u32 {
            let of_mesh = self.of_mesh(mesh).map(|i| i as usize);
            let kept = of_mesh.filter(|&i| can_be_placed(&self.maps[i]));
            sound.push_mesh(kept.map(|i| (self.maps[i], self.name(i))));
        }
        let dropped = self.len() - sound.len();
        *self = sound;
        dropped
    }

    /// How many there are.
    #[inline]
    #[must_use]
    pub fn len(&self) -> usize {
        self.maps.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.maps.is_empty()
    }

    /// Object space to world space, of all instances.
    #[must_use]
    pub fn maps(&self) -> &[Affine3] {
        &self.maps
    }

    /// Object space to world space.
    ///
    /// # Panics
    /// If there is no such instance.
    #[inline(always)]
    #[must_use]
    pub fn map(&self, instance: usize) -> &Affine3 {
        &self.maps[instance]
    }

    /// The number of the instance's mesh.
    ///
    /// # Panics
    /// If there is no such instance.
    #[inline(always)]
    #[must_use]
    pub fn mesh(&self, instance: usize) -> u32 {
        let block = instance / BLOCK;
        let first = self.blocks[block];
        let last = self.blocks.get(block + 1).copied().unwrap_or(self.starts.len() as u32 - 1);
        if first == last { first } else { self.mesh_between(first, last, instance) }
    }

    fn mesh_between(&self, first: u32, last: u32, instance: usize) -> u32 {
        let starts = &self.starts[first as usize + 1..=last as usize];
        first + starts.partition_point(|&start| start as usize <= instance) as u32
    }

    /// The number of the instance's name.
    ///
    /// # Panics
    /// If there is no such instance.
    #[must_use]
    pub fn name(&self, instance: usize) -> u32 {
        match &self.names {
            InstanceNames::OfMesh(names) => names[self.mesh(instance) as usize],
            InstanceNames::Own(names) => names[instance],
        }
    }

    /// An instance; none if it does not exist.
    #[must_use]
    pub fn get(&self, instance: usize) -> Option<Instance> {
        let world_from_object = *self.maps.get(instance)?;
        Some(Instance { world_from_object, mesh: self.mesh(instance), name: self.name(instance) })
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = Instance> + '_ {
        (0..self.len()).filter_map(|i| self.get(i))
    }

    /// Numbers of the instances of a mesh.
    #[must_use]
    pub fn of_mesh(&self, mesh: u32) -> Range<u32> {
        let start = |mesh: usize| self.starts.get(mesh).copied().unwrap_or(self.len() as u32);
        start(mesh as usize)..start(mesh as usize + 1)
    }

    /// By mesh, the number of its first instance.
    #[must_use]
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Which names they have.
    #[must_use]
    pub fn names(&self) -> &InstanceNames {
        &self.names
    }

    /// Memory, in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let (InstanceNames::OfMesh(names) | InstanceNames::Own(names)) = &self.names;
        size_of_val(&self.maps[..]) + 4 * (self.starts.len() + self.blocks.len() + names.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vastlight_math::Vec3;

    fn instance(number: usize, mesh: u32, name: u32) -> Instance {
        Instance { world_from_object: Affine3::from_translation(Vec3::X * number as f32), mesh, name }
    }

    /// Instances of meshes of which some have none, some many.
    fn many(name: impl Fn(usize, u32) -> u32) -> (Vec<Instance>, usize) {
        let counts = [0, 3, 0, 0, 200, 1, 1, 1, 64, 0, 130, 0];
        let meshes = counts.iter().enumerate().flat_map(|(mesh, &n)| vec![mesh as u32; n]);
        let all = meshes.enumerate().map(|(i, mesh)| instance(i, mesh, name(i, mesh))).collect();
        (all, counts.len())
    }

    #[test]
    fn instances_come_back_whatever_their_names() {
        let names: [&dyn Fn(usize, u32) -> u32; 3] =
            [&|_, mesh| mesh * 7, &|i, _| i as u32, &|i, mesh| mesh + u32::from(i == 200)];
        for (kind, name) in names.into_iter().enumerate() {
            let (given, meshes) = many(name);
            let instances = Instances::new(given.clone(), meshes).expect("valid");
            assert_eq!(instances.iter().collect::<Vec<_>>(), given);
            assert_eq!(matches!(instances.names(), InstanceNames::OfMesh(_)), kind == 0);
            let read = Instances::from_tables(
                instances.maps().to_vec(),
                instances.starts().to_vec(),
                instances.names().clone(),
            );
            assert_eq!(read.expect("valid"), instances);
            for mesh in 0..meshes as u32 {
                let expected = given.iter().filter(|i| i.mesh == mesh).count();
                assert_eq!(instances.of_mesh(mesh).len(), expected);
            }
            let bytes = instances.bytes() as f64 / given.len() as f64;
            assert!(bytes < if kind == 0 { 48.4 } else { 52.4 }, "{bytes}");
        }
    }

    #[test]
    fn they_are_sorted_by_mesh_and_singular_ones_left_out() {
        let (mut given, meshes) = many(|i, _| i as u32);
        given.reverse();
        let mut sorted = given.clone();
        sorted.sort_by_key(|i| i.mesh);
        let mut instances = Instances::new(given, meshes).expect("valid");
        assert_eq!(instances.iter().collect::<Vec<_>>(), sorted);
        assert_eq!(instances.drop_singular(), 0);
        for i in [0, 77, 399] {
            sorted[i].world_from_object = Affine3::from_scale(Vec3::new(1.0, 0.0, f32::NAN));
        }
        let mut instances = Instances::new(sorted.clone(), meshes).expect("valid");
        assert_eq!(instances.drop_singular(), 3);
        sorted.retain(|i| can_be_placed(&i.world_from_object));
        assert_eq!(instances.iter().collect::<Vec<_>>(), sorted);
    }

    #[test]
    fn tables_that_do_not_fit_are_refused() {
        let maps = vec![Affine3::IDENTITY; 10];
        let of_mesh = |n: usize| InstanceNames::OfMesh(vec![0; n]);
        let from = |starts: &[u32], names| Instances::from_tables(maps.clone(), starts.to_vec(), names);
        assert!(from(&[0, 4], of_mesh(2)).is_ok());
        assert!(from(&[0, 4], InstanceNames::Own(vec![0; 10])).is_ok());
        for (starts, names) in [
            (&[0, 4][..], of_mesh(3)),
            (&[0, 4], InstanceNames::Own(vec![0; 2])),
            (&[1, 4], of_mesh(2)),
            (&[0, 11], of_mesh(2)),
            (&[0, 4, 3], of_mesh(3)),
            (&[], of_mesh(0)),
        ] {
            assert!(from(starts, names).is_err(), "{starts:?}");
        }
        assert!(Instances::new(vec![instance(0, 3, 0)], 3).is_err());
        assert!(Instances::default().iter().next().is_none());
    }
}
