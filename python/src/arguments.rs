//! Arguments that come in a dictionary.

use crate::errors::usage;
use pyo3::conversion::FromPyObjectOwned;
use pyo3::prelude::*;

/// A structure whose fields are items of a dictionary, by their names; what does not fit is an error that names the argument.
macro_rules! arguments {
    ($(#[$about:meta])* $sight:vis struct $name:ident { $($(#[$of:meta])* $seen:vis $field:ident: $kind:ty,)* }) => {
        $(#[$about])*
        $sight struct $name {
            $($(#[$of])* $seen $field: $kind,)*
        }

        impl<'a, 'py> pyo3::FromPyObject<'a, 'py> for $name {
            type Error = pyo3::PyErr;

            fn extract(items: pyo3::Borrowed<'a, 'py, pyo3::PyAny>) -> pyo3::PyResult<Self> {
                Ok(Self { $($field: crate::arguments::argument(&items, stringify!($field))?,)* })
            }
        }
    };
}

pub(crate) use arguments;

/// An item by its name.
pub(crate) fn argument<'py, T: FromPyObjectOwned<'py>>(items: &Bound<'py, PyAny>, name: &str) -> PyResult<T> {
    let py = items.py();
    items.get_item(name)?.extract().map_err(|error: <T as FromPyObject<'_, 'py>>::Error| {
        let error: PyErr = error.into();
        usage(py, error.value(py).to_string(), name, "")
    })
}
