//! Settings of a stage.

use std::path::{Path, PathBuf};

use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use quadrant_law::axes::AxisName;
use quadrant_settings::StageSettings;
use quadrant_settings::tree::{TreeError, expand};
use quadrant_sim::setting_value::{meant, short};
use quadrant_sim::settings_file::SettingsFile;
use serde_json::Value;

use crate::{errors, json};

/// Room for every value as JSON.
const JSON_BYTES: usize = 2048;

/// Settings of a stage: everything that its control law is made of, in SI units and millimetres.
///
/// `settings["x/feedback/pid/kp_v_per_mm"]` reads a setting and `settings[...] = value` writes it; `"present"` and `None` make and
/// remove a part that may be left out. What is written is checked as a whole when it is used, or by `validate`.
///
/// Parameters
/// ----------
/// values : dict, optional
///     As `from_dict`; without it the defaults, of axes that nobody has commissioned.
///
/// Raises
/// ------
/// ValueError
///     A value that the firmware would refuse: field, value, limits, remedy.
/// KeyError
///     A setting that there is not, and the most similar one.
#[pyclass(module = "quadrant", name = "Settings")]
#[derive(Debug)]
pub(crate) struct Settings {
    pub(crate) file: SettingsFile,
}

impl Settings {
    pub(crate) fn of(stage: StageSettings) -> Self {
        Self {
            file: SettingsFile::new(stage),
        }
    }
}

/// The axis of a name.
///
/// # Errors
/// `ValueError` for another name.
pub(crate) fn axis_name(name: &str) -> PyResult<AxisName> {
    AxisName::ALL
        .into_iter()
        .find(|axis| axis.as_str() == name)
        .ok_or_else(|| {
            PyValueError::new_err(format!("axis = {name:?}: it is \"x\", \"y\" or \"z\""))
        })
}

/// The name that a text has in messages instead of a path.
fn named(what: &str) -> &Path {
    Path::new(what)
}

fn path_error(path: &str, error: TreeError) -> PyErr {
    match error {
        TreeError::Value => PyValueError::new_err(format!(
            "{path}: the value is not what this setting holds; settings[{path:?}] shows its form"
        )),
        TreeError::Absent => PyKeyError::new_err(format!(
            "{path} is in a part that is left out: set the part to \"present\" first"
        )),
        TreeError::NotALeaf => PyKeyError::new_err(format!(
            "{path} holds several settings: settings.paths({path:?}) lists them"
        )),
        TreeError::NotFound | TreeError::NoRoom => PyKeyError::new_err(match meant(path) {
            Some(other) => format!("there is no setting {path}; did you mean {other}?"),
            None => format!("there is no setting {path}; settings.paths() lists them"),
        }),
    }
}

#[pymethods]
impl Settings {
    #[new]
    #[pyo3(signature = (values=None))]
    fn new(values: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        match values {
            Some(values) => Self::from_dict_inner(values),
            None => Ok(Self::of(StageSettings::default())),
        }
    }

    /// Returns the settings that are chosen for the simulated stage: N-PID with combined feedforward at 10 kHz.
    #[classmethod]
    fn simulated(_class: &Bound<'_, PyType>) -> Self {
        Self::of(StageSettings::simulated())
    }

    /// Reads and checks a settings file, as `quadrant commission` leaves it. `OSError` and `ValueError` name file, line and setting.
    #[classmethod]
    fn read(_class: &Bound<'_, PyType>, path: PathBuf) -> PyResult<Self> {
        let file = SettingsFile::read(&path).map_err(errors::of)?;
        Ok(Self { file })
    }

    /// Checks the text of a settings file.
    #[classmethod]
    fn parse(_class: &Bound<'_, PyType>, text: &str) -> PyResult<Self> {
        let file = SettingsFile::parse(text, named("the text")).map_err(errors::of)?;
        Ok(Self { file })
    }

    /// Returns the settings of a dictionary of the form of `to_dict`; what it leaves out is the default.
    #[classmethod]
    fn from_dict(_class: &Bound<'_, PyType>, values: &Bound<'_, PyDict>) -> PyResult<Self> {
        Self::from_dict_inner(values)
    }

    /// Returns all settings as a dictionary of dictionaries; parts that are left out are not in it.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        // As TOML, which has no parts that are left out.
        let table = toml::Table::try_from(&self.file.stage).map_err(errors::value)?;
        let json = serde_json::to_string(&table).map_err(errors::value)?;
        json::load(py, &json)
    }

    /// Returns the text of a settings file, with the settings that differ from the defaults alone.
    fn text(&self) -> PyResult<String> {
        self.file
            .sparse_text(named("the settings"))
            .map_err(errors::of)
    }

    /// Writes a settings file, which the command line and the firmware read.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        let text = self.file.sparse_text(&path).map_err(errors::of)?;
        std::fs::write(&path, text).map_err(|reason| errors::file(&path, &reason))
    }

    /// Raises `ValueError` if the firmware would refuse them.
    fn validate(&self) -> PyResult<()> {
        self.file.check(named("the settings")).map_err(errors::of)
    }

    /// Returns the paths of all settings below a prefix.
    #[pyo3(signature = (prefix=""))]
    fn paths(&self, prefix: &str) -> PyResult<Vec<String>> {
        let below = if prefix.is_empty() {
            Some(quadrant_settings::tree::Path::new())
        } else {
            expand(prefix)
        };
        let mut found = Vec::new();
        let below = below.ok_or_else(|| path_error(prefix, TreeError::NotFound))?;
        self.file
            .stage
            .list(&below, &mut |path| found.push(short(path)))
            .map_err(|error| path_error(prefix, error))?;
        Ok(found)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Bound<'py, PyAny>> {
        let full = expand(path).ok_or_else(|| path_error(path, TreeError::NotFound))?;
        let mut bytes = [0; JSON_BYTES];
        let length = self
            .file
            .stage
            .get_json(&full, &mut bytes)
            .map_err(|error| path_error(path, error))?;
        json::load(py, &String::from_utf8_lossy(&bytes[..length]))
    }

    fn __setitem__(&mut self, path: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let full = expand(path).ok_or_else(|| path_error(path, TreeError::NotFound))?;
        let not_finite =
            || PyValueError::new_err(format!("{path} = {value}: it must be a finite number"));
        let json = json::dump(value).map_err(|error| {
            if error.is_instance_of::<PyValueError>(value.py()) {
                not_finite()
            } else {
                error
            }
        })?;
        let mut stage = self.file.stage.clone();
        stage
            .set_json(&full, json.as_bytes())
            .map_err(|error| path_error(path, error))?;
        // JSON has no form of NaN and infinity, and `null` is read as the former; TOML has both.
        let text = toml::to_string(&stage).map_err(errors::value)?;
        if ["= nan", "= inf"].iter().any(|none| text.contains(none)) {
            return Err(not_finite());
        }
        self.file.stage = stage;
        Ok(())
    }

    /// True if there is a setting of this path.
    fn __contains__(&self, path: &str) -> bool {
        let mut bytes = [0; JSON_BYTES];
        expand(path).is_some_and(|full| self.file.stage.get_json(&full, &mut bytes).is_ok())
    }

    /// The paths of all settings.
    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.paths("")?.into_pyobject(py)?.try_iter()?.into_any())
    }

    fn __len__(&self) -> PyResult<usize> {
        Ok(self.paths("")?.len())
    }

    /// Returns the paths of all settings, as a dictionary does.
    fn keys(&self) -> PyResult<Vec<String>> {
        self.paths("")
    }

    /// Returns a setting, or `default` if there is none of this path.
    #[pyo3(signature = (path, default=None))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        path: &str,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        if self.__contains__(path) {
            self.__getitem__(py, path)
        } else {
            Ok(default.unwrap_or_else(|| py.None().into_bound(py)))
        }
    }

    /// Control rate, Hz.
    #[getter]
    fn rate_hz(&self) -> f64 {
        self.file.stage.rate_hz
    }

    /// Returns settings that can be changed without changing these.
    fn copy(&self) -> Self {
        Self {
            file: self.file.clone(),
        }
    }

    fn __copy__(&self) -> Self {
        self.copy()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.copy()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.file.stage == other.file.stage
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let parse = py.get_type::<Self>().getattr("parse")?;
        let text = self.file.text(named("the settings")).map_err(errors::of)?;
        Ok((parse, (text,)))
    }

    fn __repr__(&self) -> String {
        let stage = &self.file.stage;
        let axes = AxisName::ALL.map(|name| {
            let axis = &stage.axes[name as usize];
            let kind = serde_json::to_value(axis.feedforward.kind);
            let law = serde_json::to_value(axis.feedback.law);
            let word = |value: Result<Value, _>| match value {
                Ok(Value::String(word)) => word,
                _ => String::new(),
            };
            let state = if axis.commissioned {
                format!("{} + {}", word(law), word(kind))
            } else {
                "not commissioned".to_owned()
            };
            format!("{name}: {state}")
        });
        format!("Settings({} Hz; {})", stage.rate_hz, axes.join("; "))
    }
}

impl Settings {
    fn from_dict_inner(values: &Bound<'_, PyDict>) -> PyResult<Self> {
        let mut table = toml::Table::new();
        table.insert("stage".to_owned(), json::toml_of(values.as_any())?);
        let text = toml::to_string(&table).map_err(errors::value)?;
        let file = SettingsFile::parse(&text, named("the dictionary")).map_err(errors::of)?;
        Ok(Self { file })
    }
}

impl Settings {
    /// Refuses settings that the firmware would refuse.
    ///
    /// # Errors
    /// `ValueError`: field, value, limits, remedy.
    pub(crate) fn validate_for_law(&self) -> PyResult<()> {
        self.file
            .stage
            .validate(quadrant_law::friction::gms::FIRMWARE_ELEMENTS)
            .map_err(errors::value)
    }
}
