//! Friction models over arrays of positions, and their fits to hysteresis and to runs at constant velocity.

use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::gms::{GmsElement, GmsParameters, MAX_ELEMENTS};
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_law::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_law::friction::{Direction, PerDirection};
use quadrant_sim::plant::{AxisParameters, FrictionParameters, Presliding, StageParameters};
use quadrant_tune::identify::single_state::{fit_dahl, fit_lugre};
use quadrant_tune::identify::static_friction::{Exponent, FrictionMap, FrictionRun, fit_map};
use quadrant_tune::identify::virgin_curve::{Knots, identify};

use crate::arrays::{self, Numbers, finite, same_length};
use crate::errors;
use crate::interrupt::left_behind;
use crate::records::recording;

/// A Stribeck curve with viscous friction: coulomb, breakaway, Stribeck velocity, exponent, viscous.
pub(crate) type Side = (f64, f64, f64, f64, f64);

/// A side as the law has it.
///
/// # Errors
/// A level or a velocity that is not above zero, or an exponent that is none.
fn side(
    name: &str,
    (coulomb, breakaway, velocity, exponent, viscous): Side,
) -> PyResult<StaticFriction> {
    for (field, value) in [
        ("coulomb", coulomb),
        ("breakaway", breakaway),
        ("stribeck_velocity", velocity),
        ("exponent", exponent),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(PyValueError::new_err(format!(
                "{name}.{field} = {value}: it must be above zero"
            )));
        }
    }
    if !(viscous.is_finite() && viscous >= 0.0) {
        return Err(PyValueError::new_err(format!(
            "{name}.viscous = {viscous}: it must be zero or more"
        )));
    }
    Ok(StaticFriction {
        curve: StribeckCurve {
            coulomb_v: coulomb,
            breakaway_v: breakaway,
            stribeck_velocity_mm_s: velocity,
            exponent,
        },
        viscous_v_s_per_mm: viscous,
    })
}

/// Both sides.
pub(crate) fn sides(positive: Side, negative: Side) -> PyResult<PerDirection<StaticFriction>> {
    Ok(PerDirection {
        positive: side("positive", positive)?,
        negative: side("negative", negative)?,
    })
}

/// GMS parameters of stiffnesses and weights.
///
/// # Errors
/// Too many elements, or weights that do not sum to one.
pub(crate) fn gms(elements: &[(f64, f64)], attraction: f64) -> PyResult<GmsParameters> {
    let count = elements.len();
    let sum: f64 = elements.iter().map(|(_, weight)| weight).sum();
    if !(1..=MAX_ELEMENTS).contains(&count) {
        return Err(PyValueError::new_err(format!(
            "elements: {count} of them; there may be 1 to {MAX_ELEMENTS}"
        )));
    }
    if !elements
        .iter()
        .all(|&(stiffness, weight)| stiffness > 0.0 && stiffness.is_finite() && weight >= 0.0)
        || (sum - 1.0).abs() > 1e-6
    {
        return Err(PyValueError::new_err(format!(
            "elements: stiffnesses must be above zero, and weights zero or more with the sum 1; their sum is {sum}"
        )));
    }
    if !(attraction.is_finite() && attraction > 0.0) {
        return Err(PyValueError::new_err(format!(
            "attraction = {attraction}: it must be above zero"
        )));
    }
    let elements = elements
        .iter()
        .map(|&(stiffness_v_per_mm, weight)| GmsElement {
            stiffness_v_per_mm,
            weight,
        });
    Ok(GmsParameters {
        elements: elements.collect(),
        attraction_v_s: attraction,
    })
}

/// Static friction over velocities, by the formula.
#[pyfunction]
pub(crate) fn friction_static<'py>(
    py: Python<'py>,
    positive: Side,
    negative: Side,
    velocity: Numbers<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let sides = sides(positive, negative)?;
    let velocity = finite("v", &velocity)?;
    let force = |v: &f64| sides.of(Direction::of(*v)).friction_v(*v);
    Ok(velocity
        .iter()
        .map(force)
        .collect::<Vec<f64>>()
        .into_pyarray(py))
}

/// The force of a model with memory that is moved along positions, a sample each `step_s`, from a slack start. `kind` and `numbers`:
/// `"gms"`; `"smoothed"` and a width; `"dahl"` with stiffness and exponent; `"lugre"` with stiffness and damping.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "a function of the extension, wrapped by methods"
)]
pub(crate) fn friction_force<'py>(
    py: Python<'py>,
    kind: &str,
    numbers: Vec<f64>,
    positive: Side,
    negative: Side,
    elements: Vec<(f64, f64)>,
    attraction: f64,
    velocity: Numbers<'py>,
    position: Numbers<'py>,
    step_s: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let friction = sides(positive, negative)?;
    arrays::positive("sample_time_s", step_s)?;
    let number = |index: usize, name: &str, (least, most): (f64, f64)| -> PyResult<f64> {
        match numbers.get(index) {
            Some(&number) if (least..=most).contains(&number) => Ok(number),
            found => Err(PyValueError::new_err(format!(
                "{name} = {}: it is {least} to {most}",
                found.copied().unwrap_or(f64::NAN)
            ))),
        }
    };
    let stiffness = || number(0, "stiffness", (f64::MIN_POSITIVE, f64::MAX));
    let model = match kind {
        "gms" => FrictionParameters::Gms,
        "smoothed" => FrictionParameters::Smoothed(SmoothedGmsParameters {
            width: number(0, "width", (1e-3, 1.0))?,
        }),
        "dahl" => FrictionParameters::Dahl(DahlParameters {
            stiffness_v_per_mm: stiffness()?,
            exponent: number(1, "exponent", (1.0, 3.0))?,
        }),
        "lugre" => FrictionParameters::Lugre(LugreParameters {
            stiffness_v_per_mm: stiffness()?,
            damping_v_s_per_mm: number(1, "damping", (0.0, f64::MAX))?,
        }),
        other => return Err(PyValueError::new_err(format!("no friction model {other}"))),
    };
    let [plain, ..] = StageParameters::ideal().axes;
    let axis = AxisParameters {
        friction,
        gms: gms(&elements, attraction)?,
        model,
        ..plain
    };
    let (velocity, position) = (finite("v", &velocity)?, finite("x", &position)?);
    same_length(("v", velocity.len()), &[("x", position.len())])?;
    let force = left_behind(py, move |_| {
        let mut presliding = Presliding::new(&axis, step_s);
        let mut last = position.first().copied().unwrap_or(0.0);
        let samples = velocity.iter().zip(&position);
        samples
            .map(|(&v, &x)| {
                let force = presliding.step(x - last, v.abs(), step_s);
                last = x;
                let side = axis.friction.of(Direction::of(v));
                force + side.viscous_v_s_per_mm * v
            })
            .collect::<Vec<f64>>()
    })?;
    Ok(force.into_pyarray(py))
}

/// The virgin curve of GMS elements on a constant level.
#[pyfunction]
pub(crate) fn virgin_curve<'py>(
    py: Python<'py>,
    elements: Vec<(f64, f64)>,
    attraction: f64,
    level: f64,
    displacement: Numbers<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let gms = gms(&elements, attraction)?;
    let displacement = finite("displacement", &displacement)?;
    let force = |mm: &f64| gms.virgin_curve_v(*mm, level);
    Ok(displacement
        .iter()
        .map(force)
        .collect::<Vec<f64>>()
        .into_pyarray(py))
}

/// A side as a tuple.
pub(crate) fn side_of(friction: &StaticFriction) -> Side {
    let curve = friction.curve;
    (
        curve.coulomb_v,
        curve.breakaway_v,
        curve.stribeck_velocity_mm_s,
        curve.exponent,
        friction.viscous_v_s_per_mm,
    )
}

/// Stiffnesses and weights.
pub(crate) fn elements_of(gms: &GmsParameters) -> Vec<(f64, f64)> {
    let elements = gms.elements.iter();
    elements
        .map(|element| (element.stiffness_v_per_mm, element.weight))
        .collect()
}

/// A GMS model of the hysteresis of a slow motion to and fro.
#[pyfunction]
#[pyo3(signature = (position, force, sample_time_s, elements, sliding))]
pub(crate) fn fit_hysteresis<'py>(
    py: Python<'py>,
    position: Numbers<'py>,
    force: Numbers<'py>,
    sample_time_s: f64,
    elements: usize,
    sliding: Option<(Side, Side)>,
) -> PyResult<Bound<'py, PyDict>> {
    let recording = recording(&position, &force, sample_time_s)?;
    let known = sliding.map(|(positive, negative)| sides(positive, negative));
    let known = known.transpose()?;
    // Friction takes energy out of every motion.
    let steps = recording.position_mm.windows(2);
    let work: f64 = steps
        .zip(recording.voltage_v.windows(2))
        .map(|(mm, force)| (mm[1] - mm[0]) * (force[0] + force[1]))
        .sum();
    if work <= 0.0 && recording.len() > 1 {
        return Err(PyValueError::new_err(
            "the force does no work against friction: is it zero, or are the signs of position and force not alike?",
        ));
    }
    let fitted = left_behind(py, move |_| {
        identify(&recording, known.as_ref(), &Knots::Automatic(elements))
    })?;
    let fitted = fitted.map_err(errors::of)?;
    let found = PyDict::new(py);
    found.set_item("elements", elements_of(&fitted.gms))?;
    found.set_item("attraction", fitted.gms.attraction_v_s)?;
    found.set_item("attraction_determined", fitted.attraction_determined)?;
    found.set_item("knots_mm", &fitted.knots_mm)?;
    found.set_item("names", fitted.fit.names)?;
    found.set_item("values", fitted.fit.values)?;
    found.set_item("standard_errors", fitted.fit.standard_errors)?;
    found.set_item("relative_error", fitted.prediction.relative_error)?;
    found.set_item("level", fitted.curve.top_v())?;
    let points = fitted.curve.points.iter();
    let (mm, volts): (Vec<f64>, Vec<f64>) = points
        .map(|point| (point.displacement_mm, point.force_v))
        .unzip();
    found.set_item("curve_mm", mm.into_pyarray(py))?;
    found.set_item("curve_force", volts.into_pyarray(py))?;
    Ok(found)
}

/// Static friction of runs at constant velocity.
#[pyfunction]
#[pyo3(signature = (velocity, force, deviation, exponent))]
pub(crate) fn fit_runs<'py>(
    py: Python<'py>,
    velocity: Numbers<'py>,
    force: Numbers<'py>,
    deviation: Numbers<'py>,
    exponent: Option<f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let (velocity, force, deviation) = (
        finite("v", &velocity)?,
        finite("force", &force)?,
        finite("deviation", &deviation)?,
    );
    same_length(
        ("v", velocity.len()),
        &[("force", force.len()), ("deviation", deviation.len())],
    )?;
    if let Some(place) = deviation.iter().position(|value| *value <= 0.0) {
        return Err(PyValueError::new_err(format!(
            "deviation[{place}] = {}: it must be above zero",
            deviation[place]
        )));
    }
    if let Some(exponent) = exponent {
        arrays::positive("exponent", exponent)?;
    }
    let mut runs: Vec<FrictionRun> = velocity
        .iter()
        .zip(&force)
        .zip(&deviation)
        .map(|((&velocity_mm_s, &voltage_v), &deviation_v)| FrictionRun {
            velocity_mm_s,
            voltage_v,
            deviation_v,
            stick_slip: false,
        })
        .collect();
    runs.sort_by(|a, b| a.velocity_mm_s.total_cmp(&b.velocity_mm_s));
    let exponent = exponent.map_or(Exponent::Free, Exponent::Fixed);
    let fitted = fit_map(&FrictionMap { runs }, exponent, None).map_err(errors::of)?;
    let found = PyDict::new(py);
    found.set_item("offset", fitted.offset_v)?;
    for (name, direction) in [
        ("positive", &fitted.directions.positive),
        ("negative", &fitted.directions.negative),
    ] {
        let part = PyDict::new(py);
        part.set_item("side", side_of(&direction.model))?;
        part.set_item("names", &direction.fit.names)?;
        part.set_item("values", &direction.fit.values)?;
        part.set_item("standard_errors", &direction.fit.standard_errors)?;
        found.set_item(name, part)?;
    }
    Ok(found)
}

/// A model with one state: stiffness, exponent or damping, relative error.
type SingleState = (f64, f64, f64);

/// Dahl's and the LuGre model that come nearest to a GMS model: stiffness, exponent or damping, and the relative error of each.
#[pyfunction]
pub(crate) fn fit_single_state(
    elements: Vec<(f64, f64)>,
    attraction: f64,
    breakaway: f64,
    coulomb: f64,
    damping: f64,
) -> PyResult<(SingleState, SingleState)> {
    let gms = gms(&elements, attraction)?;
    let dahl = fit_dahl(&gms, breakaway, coulomb).map_err(errors::of)?;
    let lugre = fit_lugre(&gms, breakaway, damping).map_err(errors::of)?;
    Ok((
        (
            dahl.parameters.stiffness_v_per_mm,
            dahl.parameters.exponent,
            dahl.relative_error,
        ),
        (
            lugre.parameters.stiffness_v_per_mm,
            lugre.parameters.damping_v_s_per_mm,
            lugre.relative_error,
        ),
    ))
}
