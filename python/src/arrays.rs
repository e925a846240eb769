//! NumPy arrays in and out.

use crate::errors::usage;
use numpy::{
    Element, IntoPyArray, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use vastlight::math::{Affine3, Mat3, Vec3};

/// The rows of a contiguous array of `N` columns.
pub(crate) fn rows<'a, T: Element, const N: usize>(
    array: &'a PyReadonlyArray2<'_, T>,
    name: &str,
) -> PyResult<&'a [[T; N]]> {
    let shape = array.shape();
    if shape[1] != N {
        let what = format!("the shape is ({}, {}), not (N, {N})", shape[0], shape[1]);
        return Err(usage(array.py(), what, name, ""));
    }
    Ok(array.as_slice()?.as_chunks().0)
}

/// One number for all, or one for each of some rows.
#[derive(Clone, Copy)]
pub(crate) enum Each<'a> {
    One(f32),
    Rows(&'a [f32]),
}

impl<'a> Each<'a> {
    /// The numbers of `count` rows.
    pub(crate) fn new(array: &'a PyReadonlyArray1<'_, f32>, count: usize, name: &str) -> PyResult<Self> {
        match array.as_slice()? {
            [one] => Ok(Self::One(*one)),
            numbers if numbers.len() == count => Ok(Self::Rows(numbers)),
            numbers => {
                let what = format!("there are {} numbers for {count} rays", numbers.len());
                Err(usage(array.py(), what, name, "give one, or one for each"))
            }
        }
    }

    /// That of a row.
    #[inline]
    pub(crate) fn of(self, row: usize) -> f32 {
        match self {
            Self::One(one) => one,
            Self::Rows(numbers) => numbers[row],
        }
    }
}

/// Points of an array.
pub(crate) fn points(array: &PyReadonlyArray2<'_, f32>, name: &str) -> PyResult<Vec<Vec3>> {
    Ok(rows::<f32, 3>(array, name)?.iter().copied().map(Vec3::from_array).collect())
}

/// An array with a row for each entry.
pub(crate) fn array2<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let count = rows.len();
    rows.into_flattened().into_pyarray(py).reshape([count, N])
}

/// The map of a 4 x 4 matrix, row-major for column vectors.
pub(crate) fn map_of(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Affine3> {
    let rows = rows::<f64, 4>(array, "transform")?;
    let [x, y, z, [0.0, 0.0, 0.0, 1.0]] = rows else {
        let hint = "give a 4 x 4 matrix for column vectors, whose last row is 0 0 0 1";
        return Err(usage(array.py(), "this is no affine map", "transform", hint));
    };
    let column = |i: usize| Vec3::new(x[i] as f32, y[i] as f32, z[i] as f32);
    Ok(Affine3 { matrix3: Mat3::from_cols(column(0), column(1), column(2)), translation: column(3) })
}

/// The 4 x 4 matrix of a map.
pub(crate) fn matrix_of<'py>(py: Python<'py>, map: &Affine3) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let Affine3 { matrix3, translation } = map;
    let columns =
        [matrix3.x_axis, matrix3.y_axis, matrix3.z_axis, *translation].map(|c| c.to_array().map(f64::from));
    let row = |i: usize| columns.map(|column| column[i]);
    array2(py, vec![row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
}
