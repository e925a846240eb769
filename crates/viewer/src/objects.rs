//! Objects that were put elsewhere: where the view has instances, by their numbers.

use serde::Serialize;
use std::collections::BTreeMap;
use vastlight::math::{Affine3, Vec3, Vec4};

/// World from object: three rows of a matrix, whose fourth is 0, 0, 0, 1.
pub(crate) type Rows = [[f32; 4]; 3];

/// Most instances that are elsewhere.
const MOST: usize = 1000;

/// Instances that are not where the scene has them.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub(crate) struct Places(BTreeMap<u32, Rows>);

impl Places {
    /// Puts an instance somewhere, or back.
    pub(crate) fn put(&mut self, instance: u32, place: Option<Rows>) {
        match place {
            None => drop(self.0.remove(&instance)),
            Some(rows) if self.takes(instance) => drop(self.0.insert(instance, rows)),
            Some(_) => {}
        }
    }

    /// Whether an instance may be put somewhere: there is room for it.
    pub(crate) fn takes(&self, instance: u32) -> bool {
        self.0.len() < MOST || self.0.contains_key(&instance)
    }

    pub(crate) fn of(&self, instance: u32) -> Option<Rows> {
        self.0.get(&instance).copied()
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, Rows)> {
        self.0.iter().map(|(&instance, &rows)| (instance, rows))
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }
}

/// The rows of a map.
pub(crate) fn rows(map: &Affine3) -> Rows {
    let columns = [map.x_axis, map.y_axis, map.z_axis, map.translation];
    [0, 1, 2].map(|row| columns.map(|column| column[row]))
}

/// The map of rows.
pub(crate) fn map(rows: &Rows) -> Affine3 {
    let [x, y, z] = rows.map(Vec4::from_array);
    let column = |i: usize| Vec3::new(x[i], y[i], z[i]);
    Affine3::from_cols(column(0), column(1), column(2), column(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_those_of_the_matrix() {
        let given = [[1.0, 2.0, 3.0, 10.0], [4.0, 5.0, 6.0, 20.0], [7.0, 8.0, 10.0, 30.0]];
        assert_eq!(map(&given).transform_point3(Vec3::X), Vec3::new(11.0, 24.0, 37.0));
        assert_eq!(rows(&map(&given)), given);
    }

    #[test]
    fn places_are_few_and_taken_back() {
        let place = rows(&Affine3::IDENTITY);
        let mut places = Places::default();
        (0..=MOST as u32).for_each(|instance| places.put(instance, Some(place)));
        assert_eq!(places.len(), MOST);
        assert!(places.takes(7) && !places.takes(MOST as u32));
        places.put(3, None);
        assert_eq!((places.of(3), places.of(4)), (None, Some(place)));
    }
}
