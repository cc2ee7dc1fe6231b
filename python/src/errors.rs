//! Errors of the crates as exceptions.

use std::error::Error;
use std::fmt::Display;

use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use quadrant_law::axes::AxisName;
use quadrant_law::safety::{Fault, FaultCode};
use quadrant_sim::run::RunError;
use quadrant_sim::toml_file::TomlFileError;

/// Module of the exceptions that are classes of Python.
const MODULE: &str = "quadrant._errors";

/// A `ValueError` in the words of an error, without its sources.
pub(crate) fn value(error: impl Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A `ValueError` in the words of an error and its sources; an `OSError` where a file cannot be read or written.
pub(crate) fn of(error: impl Error + 'static) -> PyErr {
    let mut words = error.to_string();
    let mut is_io = false;
    let mut source: Option<&(dyn Error + 'static)> = Some(&error);
    while let Some(cause) = source {
        is_io |= cause.is::<std::io::Error>();
        if matches!(cause.downcast_ref(), Some(TomlFileError::Io { .. })) {
            is_io = true;
        }
        let text = cause.to_string();
        if !words.contains(&text) {
            words = format!("{words}: {text}");
        }
        source = cause.source();
    }
    if is_io {
        PyOSError::new_err(words)
    } else {
        PyValueError::new_err(words)
    }
}

/// A `quadrant.Fault`.
pub(crate) fn fault(fault: Fault) -> PyErr {
    fault_of(fault.code, fault.axis, Some(fault.tick))
}

/// A `quadrant.Fault` of its parts.
pub(crate) fn fault_of(code: FaultCode, axis: Option<AxisName>, tick: Option<u32>) -> PyErr {
    Python::attach(|py| {
        let made = || {
            let arguments = (
                code.number(),
                code.name(),
                axis.map(AxisName::as_str),
                tick,
                code.cause(),
                code.remedy(),
            );
            py.import(MODULE)?.getattr("Fault")?.call1(arguments)
        };
        made().map_or_else(|error| error, PyErr::from_value)
    })
}

/// The exception of a run that ended early.
pub(crate) fn run(error: RunError) -> PyErr {
    match error {
        RunError::Fault(found) => fault(found),
        other => value(other),
    }
}
