//! Arrays of rays.

use crate::arrays::{Each, array2, rows};
use crate::errors::usage;
use crate::scene::Scene;
use crate::work::Watch;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use vastlight::math::{FAR, Ray, Vec3};
use vastlight::{Error, RayArray, Session};

/// Rays that are traced before anybody could stop it.
const FEW: usize = 1 << 14;

/// Origins and directions (N, 3), and the bounds of t (1 or N).
pub(crate) type Arrays<'py> = (
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray1<'py, f32>,
    PyReadonlyArray1<'py, f32>,
);

/// Columns t, prim, instance, uv and normal.
pub(crate) type Columns<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
);

/// Rays where they stand in arrays.
struct Rays<'a> {
    origins: &'a [[f32; 3]],
    directions: &'a [[f32; 3]],
    tmin: Each<'a>,
    tmax: Each<'a>,
}

impl<'a> Rays<'a> {
    fn new((origins, directions, tmin, tmax): &'a Arrays<'_>) -> PyResult<Self> {
        let py = origins.py();
        let (origins, directions) =
            (rows::<f32, 3>(origins, "origins")?, rows::<f32, 3>(directions, "directions")?);
        let count = origins.len();
        if directions.len() != count {
            let what = format!("there are {} directions for {count} origins", directions.len());
            return Err(usage(py, what, "directions", "give one for each"));
        }
        let (tmin, tmax) = (Each::new(tmin, count, "tmin")?, Each::new(tmax, count, "tmax")?);
        Ok(Self { origins, directions, tmin, tmax })
    }

    fn len(&self) -> usize {
        self.origins.len()
    }

    #[inline]
    fn ray(&self, i: usize) -> Ray {
        let t_max = self.tmax.of(i);
        Ray {
            origin: Vec3::from_array(self.origins[i]),
            t_min: self.tmin.of(i),
            direction: Vec3::from_array(self.directions[i]),
            // NaN stays.
            t_max: if t_max > FAR { FAR } else { t_max },
            time: 0.0,
        }
    }
}

/// Asks something of the rays in arrays.
fn ask<T: Send>(
    (py, scene): (Python<'_>, &Scene),
    arrays: &Arrays<'_>,
    answer: impl FnOnce(&mut Session, &Watch, &Rays<'_>) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let rays = Rays::new(arrays)?;
    if rays.len() <= FEW {
        return scene.with(py, |state| answer(&mut state.session, &Watch::default(), &rays));
    }
    scene.work(py, None, None, |state, watch| answer(&mut state.session, watch, &rays))
}

#[pymethods]
impl Scene {
    /// Closest hits.
    fn trace<'py>(&self, py: Python<'py>, arrays: Arrays<'py>) -> PyResult<Columns<'py>> {
        let memory = self.memory();
        let hits = ask((py, self), &arrays, |session, watch, rays| {
            let ray = |i| rays.ray(i);
            session.trace(&RayArray { count: rays.len(), ray, memory, cancel: watch.cancel() })
        })?;
        let (uv, normal) = (array2(py, hits.uv)?, array2(py, hits.normal)?);
        Ok((hits.t.into_pyarray(py), hits.prim.into_pyarray(py), hits.instance.into_pyarray(py), uv, normal))
    }

    /// Whether anything is hit.
    fn occluded<'py>(&self, py: Python<'py>, arrays: Arrays<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let memory = self.memory();
        let flags = ask((py, self), &arrays, |session, watch, rays| {
            let ray = |i| rays.ray(i);
            session.occluded(&RayArray { count: rays.len(), ray, memory, cancel: watch.cancel() })
        })?;
        Ok(flags.into_pyarray(py))
    }
}
