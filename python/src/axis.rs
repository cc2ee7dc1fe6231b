//! One axis of the law, tick by tick.

use numpy::{AllowTypeChange, IntoPyArray, PyArrayLike1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadrant_law::axes::AxisName;
use quadrant_law::axis::telemetry::{AxisTelemetry, LimitedBy};
use quadrant_law::axis::{Axis as LawAxis, AxisState};
use quadrant_law::encoder::EncoderReading;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::reference::{MotionScale, ReferenceSample};
use quadrant_law::safety::FaultCode;
use quadrant_law::units::Position;

use crate::arrays::same_length;
use crate::errors;
use crate::references::given;
use crate::settings::{Settings, axis_name};

/// One axis of the control law, tick by tick, as the firmware runs it: every word is equal, bit for bit.
///
/// Parameters
/// ----------
/// settings : Settings
///     Settings that the firmware would accept.
/// axis : {"x", "y", "z"}
///     The axis.
///
/// Raises
/// ------
/// ValueError
///     Settings that are refused: field, value, limits, remedy.
///
/// Notes
/// -----
/// Position 0 is where the encoder was read first. The reference of a tick is where the axis is to be `preview_ticks` later: the
/// feedforward works on it at once, the feedback `preview_ticks` later.
#[pyclass(module = "quadrant", name = "Axis", subclass)]
#[derive(Debug)]
pub(crate) struct Axis {
    name: AxisName,
    law: LawAxis<f32, FIRMWARE_ELEMENTS>,
    state: AxisState<f32, FIRMWARE_ELEMENTS>,
    scale: MotionScale,
    preview_ticks: usize,
    full_scale_v: f64,
    ticks: u32,
    /// The last two positions of the reference, mm.
    last_mm: Option<[f64; 2]>,
}

/// Ticks between two looks for signals.
const LOOK_TICKS: usize = 100_000;

#[pymethods]
impl Axis {
    #[new]
    #[pyo3(signature = (settings, axis="x"))]
    fn new(settings: &Settings, axis: &str) -> PyResult<Self> {
        let name = axis_name(axis)?;
        settings.validate_for_law()?;
        let stage = &settings.file.stage;
        let own = &stage.axes[name as usize];
        Ok(Self {
            name,
            law: stage.build_axis(name),
            state: AxisState::default(),
            scale: stage.motion_scale(name as usize),
            preview_ticks: (own.feedforward.preview_s * stage.rate_hz).round() as usize,
            full_scale_v: own.amplifier.full_scale_v,
            ticks: 0,
            last_mm: None,
        })
    }

    /// One control period: the reference and the counter of the encoder in, the converter's word out.
    ///
    /// Parameters
    /// ----------
    /// reference : float
    ///     Position to be at after the preview, mm.
    /// counts : int
    ///     Counter of the encoder; of any width up to the settings' `counter_bits`, it may wrap.
    /// velocity, acceleration : float, optional
    ///     Derivatives of the reference, mm/s and mm/s²; differences of the last references where they are left out.
    ///
    /// Returns
    /// -------
    /// int
    ///     The converter's word, -32768 to 32767.
    ///
    /// Raises
    /// ------
    /// quadrant.Fault
    ///     What the law's monitors found. The caller switches the amplifier off.
    #[pyo3(signature = (reference, counts, velocity=None, acceleration=None))]
    fn step(
        &mut self,
        reference: f64,
        counts: i64,
        velocity: Option<f64>,
        acceleration: Option<f64>,
    ) -> PyResult<i16> {
        for (name, value) in [
            ("reference", Some(reference)),
            ("velocity", velocity),
            ("acceleration", acceleration),
        ] {
            if value.is_some_and(|value| !(value as f32).is_finite()) {
                return Err(PyValueError::new_err(format!(
                    "{name} = {} is not a finite number of single precision",
                    value.unwrap_or_default()
                )));
            }
        }
        let [last, before] = self.last_mm.unwrap_or([reference; 2]);
        let rate_hz = self.scale.rate_hz;
        let difference = (reference - last) * rate_hz;
        let second = (reference - 2.0 * last + before) * rate_hz * rate_hz;
        self.last_mm = Some([reference, last]);
        let ahead = ReferenceSample {
            position: Position::from_mm(reference, self.scale.resolution_mm),
            velocity: velocity.unwrap_or(difference) as f32,
            acceleration: acceleration.unwrap_or(second) as f32,
        };
        self.tick(&ahead, counts).map_err(|code| self.fault(code))
    }

    /// Control periods of arrays; the signals by name.
    fn run_arrays<'py>(
        &mut self,
        py: Python<'py>,
        reference: &Bound<'py, PyAny>,
        counts: PyArrayLike1<'py, i64, AllowTypeChange>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let given = given(reference, self.scale)?;
        let counts = counts.as_array().to_vec();
        let samples = given.reference.samples();
        same_length(("reference", samples.len()), &[("counts", counts.len())])?;
        let origin = given.first_mm.map_or_else(
            || self.state.reference(),
            |mm| Position::from_mm(mm, self.scale.resolution_mm),
        );
        let mut rows = Rows::default();
        let ticks = samples.chunks(LOOK_TICKS).zip(counts.chunks(LOOK_TICKS));
        for (samples, counts) in ticks {
            py.detach(|| {
                for (sample, counts) in samples.iter().zip(counts) {
                    let ahead = ReferenceSample {
                        position: sample.position + origin,
                        ..*sample
                    };
                    self.tick(&ahead, *counts)?;
                    rows.push(self.state.telemetry(), self.scale.resolution_mm);
                }
                Ok(())
            })
            .map_err(|code| self.fault(code))?;
            py.check_signals()?;
        }
        rows.into_dict(py)
    }

    /// Holds where the encoder stands, and forgets what went before: call it when the outputs are switched on.
    fn hold_here(&mut self) {
        self.law.hold_here(&mut self.state);
        self.last_mm = None;
    }

    /// Forgets everything.
    fn reset(&mut self) {
        self.state = AxisState::default();
        (self.ticks, self.last_mm) = (0, None);
    }

    /// Every term of the last tick, V, and the error, mm: a dictionary.
    #[getter]
    fn terms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let seen = self.state.telemetry();
        let terms = PyDict::new(py);
        for (name, term) in [
            ("error_mm", seen.error),
            ("proportional_v", seen.feedback.proportional),
            ("integral_v", seen.feedback.integral),
            ("derivative_v", seen.feedback.derivative),
            ("feedforward_v", seen.feedforward.friction()),
            ("inertia_v", seen.feedforward.inertia),
            ("output_v", seen.output),
        ] {
            terms.set_item(name, term)?;
        }
        terms.set_item("word", seen.code.0)?;
        terms.set_item("limited", seen.limited_by != LimitedBy::Nothing)?;
        Ok(terms)
    }

    /// Measured position, mm.
    #[getter]
    fn position_mm(&self) -> f64 {
        let seen = self.state.telemetry();
        seen.measured.position().to_mm(self.scale.resolution_mm)
    }

    /// Ticks by which the feedforward looks ahead.
    #[getter]
    fn preview_ticks(&self) -> usize {
        self.preview_ticks
    }

    /// Control rate, Hz.
    #[getter]
    fn rate_hz(&self) -> f64 {
        self.scale.rate_hz
    }

    /// Length of a count of the encoder, mm.
    #[getter]
    fn resolution_mm(&self) -> f64 {
        self.scale.resolution_mm
    }

    /// Output of a word, V.
    #[getter]
    fn volts_per_word(&self) -> f64 {
        self.full_scale_v / quadrant_law::units::DacCode::FULL_SCALE
    }

    fn __repr__(&self) -> String {
        format!(
            "Axis({:?}, {} Hz, {} mm a count, tick {})",
            self.name.as_str(),
            self.scale.rate_hz,
            self.scale.resolution_mm,
            self.ticks
        )
    }
}

impl Axis {
    fn tick(&mut self, ahead: &ReferenceSample<f32>, counts: i64) -> Result<i16, FaultCode> {
        self.ticks = self.ticks.wrapping_add(1);
        let reading = EncoderReading::of(counts as u32);
        let word = self.law.follow(&mut self.state, ahead, &reading)?;
        Ok(word.0)
    }

    fn fault(&self, code: FaultCode) -> PyErr {
        errors::fault_of(code, Some(self.name), Some(self.ticks.wrapping_sub(1)))
    }
}

/// Signals of the ticks of a run.
#[derive(Default)]
struct Rows {
    word: Vec<i16>,
    volts: Vec<f32>,
    reference_mm: Vec<f64>,
    counts: Vec<i32>,
    terms: [Vec<f32>; 5],
    limited: Vec<bool>,
}

impl Rows {
    fn push(&mut self, seen: &AxisTelemetry<f32>, resolution_mm: f64) {
        self.word.push(seen.code.0);
        self.volts.push(seen.output);
        self.reference_mm.push(seen.reference.to_mm(resolution_mm));
        self.counts.push(seen.measured.0 as i32);
        let terms = [
            seen.feedback.proportional,
            seen.feedback.integral,
            seen.feedback.derivative,
            seen.feedforward.friction(),
            seen.feedforward.inertia,
        ];
        for (signal, term) in self.terms.iter_mut().zip(terms) {
            signal.push(term);
        }
        self.limited.push(seen.limited_by != LimitedBy::Nothing);
    }

    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let [proportional, integral, derivative, friction, inertia] = self.terms;
        let rows = PyDict::new(py);
        rows.set_item("word", self.word.into_pyarray(py))?;
        rows.set_item("reference_mm", self.reference_mm.into_pyarray(py))?;
        rows.set_item("counts", self.counts.into_pyarray(py))?;
        for (name, signal) in [
            ("output_v", self.volts),
            ("proportional_v", proportional),
            ("integral_v", integral),
            ("derivative_v", derivative),
            ("feedforward_v", friction),
            ("inertia_v", inertia),
        ] {
            rows.set_item(name, signal.into_pyarray(py))?;
        }
        rows.set_item("limited", self.limited.into_pyarray(py))?;
        Ok(rows)
    }
}
