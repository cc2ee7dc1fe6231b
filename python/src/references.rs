//! References: motions of the firmware, and positions in arrays.

use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use quadrant_law::reference::{
    HarmonicSettings, MotionScale, MotionSettings, PointToPointSettings,
};
use quadrant_sim::given_run::GivenReference;

use crate::arrays::{Numbers, finite, positive, same_length};
use crate::errors;
use crate::interrupt::left_behind;
use crate::settings::{Settings, axis_name};

/// Longest motion, s.
const MOST_S: f64 = 3600.0;

/// A motion as the firmware makes it, to the last bit: `Motion.sine(...)` or `Motion.move_by(...)`. It begins where the axis stands.
#[pyclass(module = "quadrant", name = "Motion", frozen)]
#[derive(Debug)]
pub(crate) struct Motion {
    settings: MotionSettings,
}

#[pymethods]
impl Motion {
    /// Returns a sine about where the axis stands, with a lead-in and a lead-out of `lead_s` each.
    ///
    /// Parameters
    /// ----------
    /// amplitude_mm : float
    ///     Half the travel, mm.
    /// velocity_mm_s : float
    ///     Largest velocity, mm/s.
    /// cycles : float
    ///     Cycles at full speed.
    /// lead_s : float
    ///     Duration of the lead-in, s.
    /// phase_rad : float
    ///     Phase at which the full-speed cycles begin, rad.
    #[staticmethod]
    #[pyo3(signature = (amplitude_mm, velocity_mm_s, cycles=2.25, lead_s=0.5, phase_rad=0.0))]
    fn sine(
        amplitude_mm: f64,
        velocity_mm_s: f64,
        cycles: f64,
        lead_s: f64,
        phase_rad: f64,
    ) -> PyResult<Self> {
        if !phase_rad.is_finite() {
            return Err(PyValueError::new_err(format!(
                "phase_rad = {phase_rad}: it must be a finite number"
            )));
        }
        let sine = HarmonicSettings::with_velocity(
            positive("amplitude_mm", amplitude_mm)?,
            positive("velocity_mm_s", velocity_mm_s)?,
            positive("cycles", cycles)?,
            positive("lead_s", lead_s)?,
        );
        let settings = MotionSettings::Harmonic(HarmonicSettings { phase_rad, ..sine });
        Ok(Self { settings })
    }

    /// Returns a jerk-limited move by `distance_mm`, within a velocity (mm/s), an acceleration (mm/s²) and a jerk (mm/s³).
    #[staticmethod]
    #[pyo3(signature = (distance_mm, velocity_mm_s=100.0, acceleration_mm_s2=1000.0, jerk_mm_s3=20_000.0))]
    fn move_by(
        distance_mm: f64,
        velocity_mm_s: f64,
        acceleration_mm_s2: f64,
        jerk_mm_s3: f64,
    ) -> PyResult<Self> {
        if !distance_mm.is_finite() {
            return Err(PyValueError::new_err(format!(
                "distance_mm = {distance_mm}: it must be a finite number"
            )));
        }
        let settings = MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm,
            max_velocity_mm_s: positive("velocity_mm_s", velocity_mm_s)?,
            max_acceleration_mm_s2: positive("acceleration_mm_s2", acceleration_mm_s2)?,
            max_jerk_mm_s3: positive("jerk_mm_s3", jerk_mm_s3)?,
        });
        Ok(Self { settings })
    }

    /// Returns positions (mm), velocities (mm/s) and accelerations (mm/s²) at the control rate of an axis, each of shape (n,).
    #[expect(clippy::type_complexity, reason = "a tuple of Python")]
    fn samples<'py>(
        &self,
        py: Python<'py>,
        settings: &Settings,
        axis: &str,
    ) -> PyResult<(
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<f64>>,
        Bound<'py, PyArray1<f64>>,
    )> {
        let scale = settings.file.stage.motion_scale(axis_name(axis)? as usize);
        let given = self.given(py, scale)?;
        let samples = given.samples().iter();
        let mm: Vec<f64> = samples
            .map(|sample| sample.position.to_mm(scale.resolution_mm))
            .collect();
        let velocity: Vec<f64> = given
            .samples()
            .iter()
            .map(|sample| sample.velocity.into())
            .collect();
        let acceleration: Vec<f64> = given
            .samples()
            .iter()
            .map(|sample| sample.acceleration.into())
            .collect();
        Ok((
            mm.into_pyarray(py),
            velocity.into_pyarray(py),
            acceleration.into_pyarray(py),
        ))
    }

    /// Returns the motion of a text that pickling made.
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Self> {
        let settings = serde_json::from_str(text).map_err(errors::value)?;
        Ok(Self { settings })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let text = serde_json::to_string(&self.settings).map_err(errors::value)?;
        Ok((py.get_type::<Self>().getattr("parse")?, (text,)))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.settings == other.settings
    }

    fn __repr__(&self) -> String {
        match &self.settings {
            MotionSettings::Harmonic(sine) => format!(
                "Motion.sine({} mm, {:.4} Hz, {} cycles, {} s lead)",
                sine.amplitude_mm,
                sine.frequency_hz,
                sine.cycles.unwrap_or(f64::INFINITY),
                sine.lead_s
            ),
            MotionSettings::PointToPoint(way) => format!(
                "Motion.move_by({} mm, {} mm/s, {} mm/s², {} mm/s³)",
                way.distance_mm,
                way.max_velocity_mm_s,
                way.max_acceleration_mm_s2,
                way.max_jerk_mm_s3
            ),
            MotionSettings::Hold => "Motion.hold()".to_owned(),
        }
    }
}

impl Motion {
    pub(crate) fn settings(&self) -> &MotionSettings {
        &self.settings
    }

    /// Its samples at a control rate.
    ///
    /// # Errors
    /// `ValueError` for a motion that takes too long.
    fn given(&self, py: Python<'_>, scale: MotionScale) -> PyResult<GivenReference> {
        let settings = self.settings;
        let most = (MOST_S * scale.rate_hz) as usize;
        let given = left_behind(py, move |_| {
            GivenReference::of_motion(&settings, scale, most)
        })?;
        if given.samples().len() == most {
            return Err(PyValueError::new_err(format!(
                "the motion takes more than {MOST_S} s: raise its velocity, or shorten it"
            )));
        }
        Ok(given)
    }
}

/// A reference, and the position that it is counted from, mm; none for a motion, which begins where the axis stands.
pub(crate) struct Given {
    pub(crate) reference: GivenReference,
    pub(crate) first_mm: Option<f64>,
}

/// The reference that an object of Python is: a `Motion`, positions in mm, or a tuple of positions, velocities and accelerations.
///
/// # Errors
/// `TypeError` for another object, `ValueError` for values that are not finite, too few, or not equally many.
pub(crate) fn given(object: &Bound<'_, PyAny>, scale: MotionScale) -> PyResult<Given> {
    if let Ok(motion) = object.cast::<Motion>() {
        return Ok(Given {
            reference: motion.get().given(object.py(), scale)?,
            first_mm: None,
        });
    }
    let (positions, derivatives) = if let Ok(tuple) = object.cast::<PyTuple>()
        && tuple.len() == 3
        && tuple.get_item(0)?.hasattr("__len__")?
    {
        let part = |index: usize, name: &str| -> PyResult<Vec<f64>> {
            finite(name, &numbers(&tuple.get_item(index)?)?)
        };
        let positions = part(0, "position_mm")?;
        let velocities = part(1, "velocity_mm_s")?;
        let accelerations = part(2, "acceleration_mm_s2")?;
        same_length(
            ("position_mm", positions.len()),
            &[
                ("velocity_mm_s", velocities.len()),
                ("acceleration_mm_s2", accelerations.len()),
            ],
        )?;
        (positions, Some((velocities, accelerations)))
    } else {
        (finite("reference", &numbers(object)?)?, None)
    };
    let Some(first_mm) = positions.first().copied() else {
        return Err(PyValueError::new_err("the reference has no samples"));
    };
    let reference = match derivatives {
        Some((velocities, accelerations)) => {
            let pairs = velocities.into_iter().zip(accelerations);
            GivenReference::with(&positions, pairs, scale)
        }
        None => GivenReference::through(&positions, scale),
    };
    Ok(Given {
        reference,
        first_mm: Some(first_mm),
    })
}

/// The numbers that a reference is made of.
fn numbers<'py>(object: &Bound<'py, PyAny>) -> PyResult<Numbers<'py>> {
    object.extract().map_err(|_| {
        PyTypeError::new_err(
            "a reference is a quadrant.Motion, an array of positions in mm, shape (n,), or a tuple of positions, velocities in mm/s and \
             accelerations in mm/s², each of shape (n,)",
        )
    })
}
