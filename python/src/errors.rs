//! Errors of the crates as exceptions.

use std::error::Error;
use std::fmt::Display;
use std::io;
use std::path::Path;

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

/// The words of an error and of its sources.
pub(crate) fn words(error: &(dyn Error + 'static)) -> String {
    let mut words = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let text = cause.to_string();
        if !words.contains(&text) {
            words = format!("{words}: {text}");
        }
        source = cause.source();
    }
    words
}

/// A `ValueError` in the words of an error and its sources; an `OSError` where a file cannot be read or written.
pub(crate) fn of(error: impl Error + 'static) -> PyErr {
    let text = words(&error);
    let mut source: Option<&(dyn Error + 'static)> = Some(&error);
    while let Some(cause) = source {
        if let Some(TomlFileError::Io { path, source }) = cause.downcast_ref() {
            return file(path, source);
        }
        if let Some(reason) = cause.downcast_ref::<io::Error>() {
            return os_error(reason, text);
        }
        source = cause.source();
    }
    PyValueError::new_err(text)
}

/// The `OSError` of a file, of the subclass that its reason has, such as `FileNotFoundError`.
pub(crate) fn file(path: &Path, reason: &io::Error) -> PyErr {
    os_error(reason, format!("{}: {reason}", path.display()))
}

fn os_error(reason: &io::Error, text: String) -> PyErr {
    match reason.raw_os_error() {
        Some(number) => PyOSError::new_err((number, text)),
        None => PyOSError::new_err(text),
    }
}

/// An exception of the package by its class.
pub(crate) fn named(class: &'static str, text: String) -> PyErr {
    Python::attach(|py| {
        let made = || py.import(MODULE)?.getattr(class)?.call1((text,));
        made().map_or_else(|error| error, PyErr::from_value)
    })
}

/// A `quadrant.Fault`.
pub(crate) fn fault(fault: Fault) -> PyErr {
    fault_of(fault.code, fault.axis, Some(fault.tick))
}

/// A `quadrant.Fault` of its parts.
pub(crate) fn fault_of(code: FaultCode, axis: Option<AxisName>, tick: Option<u32>) -> PyErr {
    fault_in_words(
        (code.number(), code.name()),
        axis,
        tick,
        (code.cause(), code.remedy()),
    )
}

/// A `quadrant.Fault` in the words of a machine.
pub(crate) fn fault_in_words(
    (code, name): (u8, &str),
    axis: Option<AxisName>,
    tick: Option<u32>,
    (cause, remedy): (&str, &str),
) -> PyErr {
    Python::attach(|py| {
        let made = || {
            let arguments = (code, name, axis.map(AxisName::as_str), tick, cause, remedy);
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
