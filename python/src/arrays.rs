//! Arrays of numpy.

use num_complex::Complex64;
use numpy::{AllowTypeChange, PyArrayLike1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Anything that numpy makes a one-dimensional array of floats of.
pub(crate) type Numbers<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;
/// An array of complex numbers.
pub(crate) type ComplexNumbers<'py> = PyReadonlyArray1<'py, Complex64>;

/// Its values, all of them finite.
///
/// # Errors
/// `ValueError`, with the place of the first value that is not finite.
pub(crate) fn finite(name: &str, values: &Numbers<'_>) -> PyResult<Vec<f64>> {
    let values = values.as_array().to_vec();
    if let Some(place) = values.iter().position(|value| !value.is_finite()) {
        return Err(not_finite(name, place, &values[place].to_string()));
    }
    Ok(values)
}

/// The same of complex numbers.
///
/// # Errors
/// As [`finite`].
pub(crate) fn finite_complex(name: &str, values: &ComplexNumbers<'_>) -> PyResult<Vec<Complex64>> {
    let values = values.as_array().to_vec();
    if let Some(place) = values.iter().position(|value| !value.is_finite()) {
        return Err(not_finite(name, place, &values[place].to_string()));
    }
    Ok(values)
}

fn not_finite(name: &str, place: usize, value: &str) -> PyErr {
    PyValueError::new_err(format!("{name}[{place}] = {value} is not a finite number"))
}

/// Refuses a number that is not above zero.
///
/// # Errors
/// `ValueError`, with name and value.
pub(crate) fn positive(name: &str, value: f64) -> PyResult<f64> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(PyValueError::new_err(format!(
            "{name} = {value}: it must be a finite number above zero"
        )))
    }
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
