//! Arrays of numpy.

use numpy::{AllowTypeChange, PyArrayLike1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Anything that numpy makes a one-dimensional array of floats of.
pub(crate) type Numbers<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;

/// Its values, all of them finite.
///
/// # Errors
/// `ValueError`, with the place of the first value that is not finite.
pub(crate) fn finite(name: &str, values: &Numbers<'_>) -> PyResult<Vec<f64>> {
    let values = values.as_array().to_vec();
    if let Some(place) = values.iter().position(|value| !value.is_finite()) {
        return Err(PyValueError::new_err(format!(
            "{name}[{place}] = {} is not a finite number",
            values[place]
        )));
    }
    Ok(values)
}

/// Refuses arrays of other lengths than the first.
///
/// # Errors
/// `ValueError`, with both lengths.
pub(crate) fn same_length(first: (&str, usize), others: &[(&str, usize)]) -> PyResult<()> {
    for (name, length) in others {
        if *length != first.1 {
            return Err(PyValueError::new_err(format!(
                "{name} has {length} samples and {} has {}: they must have as many",
                first.0, first.1
            )));
        }
    }
    Ok(())
}
