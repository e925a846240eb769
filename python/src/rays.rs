//! Arrays of rays.

use crate::arrays::{array2, each, rows};
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

/// Asks something of the rays in arrays.
fn ask<T: Send>(
    scene: &Scene,
    (origins, directions, tmin, tmax): &Arrays<'_>,
    answer: impl FnOnce(&mut Session, &Watch, usize, &(dyn Fn(usize) -> Ray + Sync)) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let py = origins.py();
    let (origins, directions) =
        (rows::<f32, 3>(origins, "origins")?, rows::<f32, 3>(directions, "directions")?);
    let count = origins.len();
    if directions.len() != count {
        let what = format!("there are {} directions for {count} origins", directions.len());
        return Err(usage(py, what, "directions", "give one for each"));
    }
    let (tmin, tmax) = (each(tmin, count, "tmin")?, each(tmax, count, "tmax")?);
    let ray = |i: usize| {
        let t_max = tmax(i);
        Ray {
            origin: Vec3::from_array(origins[i]),
            t_min: tmin(i),
            direction: Vec3::from_array(directions[i]),
            // NaN stays.
            t_max: if t_max > FAR { FAR } else { t_max },
            time: 0.0,
        }
    };
    if count <= FEW {
        return scene.with(py, |state| answer(&mut state.session, &Watch::default(), count, &ray));
    }
    scene.work(py, None, None, |state, watch| answer(&mut state.session, watch, count, &ray))
}

#[pymethods]
impl Scene {
    /// Closest hits.
    fn trace<'py>(&self, py: Python<'py>, arrays: Arrays<'py>) -> PyResult<Columns<'py>> {
        let memory = self.memory();
        let hits = ask(self, &arrays, |session, watch, count, ray| {
            session.trace(&RayArray { count, ray, memory, cancel: watch.cancel() })
        })?;
        let (uv, normal) = (array2(py, hits.uv)?, array2(py, hits.normal)?);
        Ok((hits.t.into_pyarray(py), hits.prim.into_pyarray(py), hits.instance.into_pyarray(py), uv, normal))
    }

    /// Whether anything is hit.
    fn occluded<'py>(&self, py: Python<'py>, arrays: Arrays<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let memory = self.memory();
        let flags = ask(self, &arrays, |session, watch, count, ray| {
            session.occluded(&RayArray { count, ray, memory, cancel: watch.cancel() })
        })?;
        Ok(flags.into_pyarray(py))
    }
}
