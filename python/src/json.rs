//! Values between Python, JSON and TOML, by the module `json` of Python.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::errors;

/// JSON of an object of Python; scalars and arrays of numpy are numbers and lists.
///
/// # Errors
/// `TypeError` for an object that JSON has no form of, `ValueError` for a number that is not finite.
pub(crate) fn dump(object: &Bound<'_, PyAny>) -> PyResult<String> {
    let py = object.py();
    let options = PyDict::new(py);
    options.set_item("default", py.import("quadrant._values")?.getattr("plain")?)?;
    options.set_item("allow_nan", false)?;
    let json = py.import("json")?;
    json.getattr("dumps")?
        .call((object,), Some(&options))?
        .extract()
}

/// The object of Python that JSON says.
pub(crate) fn load<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyAny>> {
    let text = PyString::new(py, json);
    py.import("json")?.getattr("loads")?.call1((text,))
}

/// An object of Python as TOML has it; `None` is left out.
///
/// # Errors
/// As [`dump`], and a number that is none.
pub(crate) fn toml_of(object: &Bound<'_, PyAny>) -> PyResult<toml::Value> {
    let value: serde_json::Value = serde_json::from_str(&dump(object)?).map_err(errors::value)?;
    Ok(converted(value).unwrap_or_else(|| toml::Value::Table(toml::Table::new())))
}

fn converted(value: serde_json::Value) -> Option<toml::Value> {
    use serde_json::Value;
    Some(match value {
        Value::Null => return None,
        Value::Bool(flag) => flag.into(),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => whole.into(),
            None => number.as_f64()?.into(),
        },
        Value::String(text) => text.into(),
        Value::Array(items) => {
            toml::Value::Array(items.into_iter().filter_map(converted).collect())
        }
        Value::Object(fields) => fields
            .into_iter()
            .filter_map(|(key, value)| Some((key, converted(value)?)))
            .collect::<toml::Table>()
            .into(),
    })
}
