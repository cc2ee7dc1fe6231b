//! The simulated stage.

use std::path::{Path, PathBuf};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use quadrant_law::axes::AxisName;
use quadrant_law::units::DacCode;
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_sim::stage_file::{DataSheet, FIELDS, StageFile};
use quadrant_sim::stage_setup::StageSetup;
use toml::{Table, Value};

use crate::settings::{Settings, axis_name};
use crate::{errors, json};

/// A simulated stage of three axes, whose parameters the law does not know.
///
/// Parameters
/// ----------
/// x, y, z : dict, optional
///     Numbers of an axis, by the names of `Stage.fields()`, and `friction` (`"coulomb"`, `"static"`, `"gms"`, `"smoothed-gms"`,
///     `"lugre"` or `"dahl"`), `encoder` (`"table"` or `"motor"`) and `travel_mm` (a pair).
/// **fields
///     The same for all three axes; those of an axis go first.
///
/// Raises
/// ------
/// ValueError
///     A number outside its range, or numbers that do not go together: name, value, limits, remedy.
///
/// Notes
/// -----
/// Without arguments it is the simulated stage of the project. What is left out of an axis is that stage's x axis.
/// `docs/own-stage.md` has the table of numbers.
#[pyclass(module = "quadrant", name = "Stage", frozen)]
#[derive(Debug)]
pub(crate) struct Stage {
    /// Text that it was made of; empty for the built-in one.
    text: String,
    pub(crate) setup: StageSetup,
    /// Data sheets of its axes, where it has them.
    pub(crate) known: [Option<DataSheet>; 3],
}

impl Stage {
    pub(crate) fn truth(&self) -> &StageParameters {
        &self.setup.truth
    }

    fn built_in() -> Self {
        Self {
            text: String::new(),
            setup: StageSetup::simulated(),
            known: [None; 3],
        }
    }

    fn parsed(text: String, name: &Path) -> PyResult<Self> {
        if text.trim().is_empty() {
            return Ok(Self::built_in());
        }
        let file = StageFile::parse(&text, name).map_err(errors::of)?;
        Ok(Self {
            text,
            setup: StageSetup::of(&file),
            known: file.known,
        })
    }
}

#[pymethods]
impl Stage {
    /// All axes by `fields`, and those named by their own.
    #[new]
    #[pyo3(signature = (*, x=None, y=None, z=None, **fields))]
    fn new(
        x: Option<&Bound<'_, PyDict>>,
        y: Option<&Bound<'_, PyDict>>,
        z: Option<&Bound<'_, PyDict>>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let object = |dict: Option<&Bound<'_, PyDict>>| -> PyResult<Table> {
            let Some(dict) = dict else {
                return Ok(Table::new());
            };
            match json::toml_of(dict.as_any())? {
                Value::Table(fields) => Ok(fields),
                _ => Err(PyValueError::new_err("the keys of an axis are names")),
            }
        };
        let all = object(fields)?;
        let mut axes = Table::new();
        for (axis, own) in AxisName::ALL.into_iter().zip([x, y, z]) {
            if own.is_none() && all.is_empty() {
                continue;
            }
            let mut axis_fields = all.clone();
            axis_fields.extend(object(own)?);
            axes.insert(axis.as_str().to_owned(), Value::Table(axis_fields));
        }
        let text = toml::to_string(&axes).map_err(errors::value)?;
        Self::parsed(text, Path::new("Stage"))
    }

    /// Reads a stage file, TOML with a table for each axis.
    #[classmethod]
    fn read(_class: &Bound<'_, PyType>, path: PathBuf) -> PyResult<Self> {
        let text = std::fs::read_to_string(&path).map_err(|reason| errors::file(&path, &reason))?;
        Self::parsed(text, &path)
    }

    /// Returns the stage of the text of a stage file.
    #[classmethod]
    fn parse(_class: &Bound<'_, PyType>, text: String) -> PyResult<Self> {
        Self::parsed(text, Path::new("the text"))
    }

    /// Returns the settings of its firmware before anybody has commissioned it: encoder, converter and what data sheets say.
    fn settings(&self) -> Settings {
        Settings::of(self.setup.settings.clone())
    }

    /// Returns the parameters of an axis as the simulation has them: acceleration per volt, damping, friction in V at the amplifier's input.
    fn truth_of<'py>(&self, py: Python<'py>, axis: &str) -> PyResult<Bound<'py, PyDict>> {
        let truth = &self.truth().axes[axis_name(axis)? as usize];
        let found = PyDict::new(py);
        for (name, value) in [
            ("gain_mm_per_v_s2", truth.gain_mm_per_v_s2),
            ("damping_per_s", truth.damping_per_s),
            ("stiffness_per_s2", truth.stiffness_per_s2),
            ("delay_s", truth.delay_s),
            ("resolution_mm", truth.resolution_mm),
            ("full_scale_v", truth.full_scale_v),
            ("encoder_noise_mm", truth.imperfections.encoder_noise_mm),
            ("offset_v", truth.imperfections.offset_v),
            ("gravity_v", truth.imperfections.gravity_v),
            ("ripple_v", truth.imperfections.ripple_v),
            ("lead_mm", truth.imperfections.lead_mm),
            ("attraction_v_s", truth.gms.attraction_v_s),
        ] {
            found.set_item(name, value)?;
        }
        for (sense, friction) in [
            ("positive", truth.friction.positive),
            ("negative", truth.friction.negative),
        ] {
            let part = PyDict::new(py);
            part.set_item("coulomb_v", friction.curve.coulomb_v)?;
            part.set_item("breakaway_v", friction.curve.breakaway_v)?;
            part.set_item(
                "stribeck_velocity_mm_s",
                friction.curve.stribeck_velocity_mm_s,
            )?;
            part.set_item("exponent", friction.curve.exponent)?;
            part.set_item("viscous_v_s_per_mm", friction.viscous_v_s_per_mm)?;
            found.set_item(sense, part)?;
        }
        let elements = truth.gms.elements.iter();
        let elements: Vec<(f64, f64)> = elements
            .map(|element| (element.stiffness_v_per_mm, element.weight))
            .collect();
        found.set_item("elements", elements)?;
        Ok(found)
    }

    /// Returns one of its axes at rest, to be stepped by hand at `rate_hz` (100 to 100 000); `seed` decides the encoder's noise.
    #[pyo3(signature = (axis="x", rate_hz=10_000.0, seed=1))]
    fn axis(&self, axis: &str, rate_hz: f64, seed: u64) -> PyResult<SimulatedAxis> {
        if !(100.0..=100_000.0).contains(&rate_hz) {
            return Err(PyValueError::new_err(format!(
                "rate_hz = {rate_hz} is outside 100 to 100000"
            )));
        }
        let index = axis_name(axis)? as usize;
        let truth = &self.truth().axes[index];
        let noise = seed.wrapping_mul(3).wrapping_add(index as u64);
        Ok(SimulatedAxis::of(truth, rate_hz, noise))
    }

    /// The text of its stage file; empty for the simulated stage of the project.
    fn text(&self) -> &str {
        &self.text
    }

    /// Returns the numbers that an axis has: name, smallest and largest value, default, meaning.
    #[staticmethod]
    fn fields() -> Vec<(&'static str, f64, f64, f64, &'static str)> {
        let fields = FIELDS.iter();
        fields
            .map(|field| {
                let (least, most) = field.range;
                (field.name, least, most, field.default, field.help)
            })
            .collect()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.setup == other.setup
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((
            py.get_type::<Self>().getattr("parse")?,
            (self.text.clone(),),
        ))
    }

    fn __repr__(&self) -> String {
        if self.text.is_empty() {
            return "Stage()".to_owned();
        }
        format!("Stage.parse({:?})", self.text)
    }
}

/// An axis of a simulated stage in motion: `step(word)` moves it by a control period.
#[pyclass(module = "quadrant", name = "SimulatedAxis")]
#[derive(Debug)]
pub(crate) struct SimulatedAxis {
    axis: quadrant_sim::plant::SimulatedAxis,
    rate_hz: f64,
    resolution_mm: f64,
}

impl SimulatedAxis {
    fn of(truth: &AxisParameters, rate_hz: f64, seed: u64) -> Self {
        Self {
            axis: quadrant_sim::plant::SimulatedAxis::new(truth.clone(), rate_hz, seed),
            rate_hz,
            resolution_mm: truth.resolution_mm,
        }
    }
}

#[pymethods]
impl SimulatedAxis {
    /// Reads the encoder's counter, counts; it wraps at 32 bits, from 2147483647 to -2147483648.
    fn read(&mut self) -> i32 {
        self.axis.read_counter().cast_signed()
    }

    /// One control period with the converter at a word, or with the amplifier off. Returns the encoder's counter after it.
    #[pyo3(signature = (word, enabled=true))]
    fn step(&mut self, word: i32, enabled: bool) -> i32 {
        self.axis.step(DacCode::saturating(word), enabled);
        self.read()
    }

    /// True position, mm.
    #[getter]
    fn position_mm(&self) -> f64 {
        self.axis.position_mm()
    }

    /// True velocity, mm/s.
    #[getter]
    fn velocity_mm_s(&self) -> f64 {
        self.axis.velocity_mm_s()
    }

    /// True friction, V at the amplifier's input.
    #[getter]
    fn friction_v(&self) -> f64 {
        self.axis.friction_v()
    }

    /// Sets an external load, V at the amplifier's input.
    fn set_load_v(&mut self, volts: f64) -> PyResult<()> {
        if !volts.is_finite() {
            return Err(PyValueError::new_err(format!(
                "volts = {volts} is not a finite number"
            )));
        }
        self.axis.set_load_v(volts);
        Ok(())
    }

    /// Control rate, Hz.
    #[getter]
    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Length of a count of the encoder, mm.
    #[getter]
    fn resolution_mm(&self) -> f64 {
        self.resolution_mm
    }

    fn __repr__(&self) -> String {
        format!(
            "SimulatedAxis({:.6} mm, {:.4} mm/s)",
            self.axis.position_mm(),
            self.axis.velocity_mm_s()
        )
    }
}
