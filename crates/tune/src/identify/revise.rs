//! The linear model revised for explicit friction (thesis, Table 3.4, Figs 3.14-3.21).
//!
//! An axis' frequency response already contains its friction. Once friction is explicit, the linear model fitted to
//! that response counts it twice: A, B and C are revised until *linear model and friction together* show the measured
//! response. With friction the response depends on the excitation, so the candidate is excited exactly as the axis was: the
//! same injected voltage, the same feedback, the same estimator.

use std::fmt;

use heapless::Vec as ShortVec;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::friction::FrictionSettings;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::gms::{GmsElement, GmsParameters};
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_settings::{AxisSettings, SettingsError, StageSettings};
use quadrant_sim::plant::{AxisParameters, Drive, FrictionParameters, Imperfections};
use rayon::prelude::*;

use super::fit::{Fit, FitError, Loss, Parameter, fit_with_step};
use super::response::FrequencyResponse;
use crate::record::Recording;
use crate::test_axis::{Experiment, ExperimentError, MachineError, SimulatedTestAxis, TestAxis};

/// Friction models beside the linear model, as in the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExplicitFriction {
    /// None: the linear model alone.
    None,
    /// The static model: Stribeck curve and viscous friction.
    Static,
    /// GMS at the breakaway level, without viscous friction.
    Gms,
    /// GMS on the Stribeck curve, and viscous friction.
    Both,
}

impl ExplicitFriction {
    /// Those that a revision is made for.
    pub const ALL: [Self; 3] = [Self::Static, Self::Gms, Self::Both];
}

impl fmt::Display for ExplicitFriction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::None => "no friction",
            Self::Static => "static",
            Self::Gms => "GMS",
            Self::Both => "static + GMS",
        })
    }
}

/// The measurement that a model must reproduce.
pub struct Measurement<'a> {
    /// The experiment: its drive and injection are repeated on every candidate.
    pub experiment: &'a Experiment,
    /// The settings in force during the experiment.
    pub settings: &'a AxisSettings,
    pub recording: &'a Recording,
    /// Rate of the control law, Hz.
    pub rate_hz: f64,
    /// The estimator that made, and makes, a response of a recording.
    pub estimate: &'a (dyn Fn(&Recording) -> Option<FrequencyResponse> + Sync),
    /// Lowest coherence of a line that counts.
    pub least_coherence: f64,
}

/// A linear model revised for one kind of explicit friction.
#[derive(Clone, Debug)]
pub struct Revision {
    pub friction: ExplicitFriction,
    pub plant: PlantModel,
    /// A, B, C as fitted; standard errors are those of the lines' scatter about the model.
    pub fit: Fit,
    /// Misfit of the original model with this friction, and of the revised one.
    pub misfit: (Misfit, Misfit),
    /// Response of the original model with this friction, and of the revised one.
    pub responses: (FrequencyResponse, FrequencyResponse),
}

/// Distance of a response from the measured one: RMS over the lines that count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    pub gain_db: f64,
    pub phase_deg: f64,
}

/// Reasons for which a model is not revised.
#[derive(Debug, thiserror::Error)]
pub enum ReviseError {
    /// The recording gives no response.
    #[error("the recording gives no frequency response; it needs an injected excitation")]
    NoResponse,
    /// The recording was not made at the control rate, at which the candidates run.
    #[error(
        "the recording has {recorded_hz:.1} samples a second and the settings a control rate of {rate_hz} Hz: record every tick"
    )]
    Rate { recorded_hz: f64, rate_hz: f64 },
    /// Too little of the response can be trusted.
    #[error(
        "only {lines} lines have a coherence of {least_coherence} or more; a revision takes {LEAST_LINES}: raise the excitation"
    )]
    Incoherent { lines: usize, least_coherence: f64 },
    /// The model cannot be run as the axis was.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// The settings are refused.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The machine refused settings, or the connection failed.
    #[error(transparent)]
    Machine(#[from] MachineError),
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Fewest lines that determine A, B and C.
const LEAST_LINES: usize = 10;
/// Step of the difference quotients: the candidate's encoder and converter are quantised.
const STEP: f64 = 5e-3;
/// Displacement over which the static model's friction turns round, in encoder counts: far below what is measured,
/// far enough above zero for the integration.
const STATIC_TURN_COUNTS: f64 = 0.1;
/// A rate at which friction follows the Stribeck curve at once, V/s.
const AT_ONCE_V_S: f64 = 1e5;

/// The simulated axis of a linear model with explicit friction: what a candidate is run on.
pub fn candidate(
    plant: &PlantModel,
    friction: &FrictionSettings,
    kind: ExplicitFriction,
    settings: &AxisSettings,
) -> AxisParameters {
    let single = |turn_mm: f64, level_v: f64| GmsParameters {
        elements: ShortVec::from_iter([GmsElement {
            stiffness_v_per_mm: level_v / turn_mm,
            weight: 1.0,
        }]),
        attraction_v_s: AT_ONCE_V_S,
    };
    let breakaway_v = friction.sliding.positive.curve.breakaway_v;
    let turn_mm = STATIC_TURN_COUNTS * settings.encoder.resolution_mm;
    let flat = |model: StaticFriction, level_v: f64| StaticFriction {
        curve: StribeckCurve {
            coulomb_v: level_v,
            breakaway_v: level_v,
            ..model.curve
        },
        viscous_v_s_per_mm: 0.0,
    };
    let (sliding, gms) = match kind {
        ExplicitFriction::None => {
            // A level too small to be felt: the friction model has no zero.
            let nothing = friction.sliding.map(|model| flat(*model, 1e-9));
            (nothing, single(1.0, 1e-9))
        }
        ExplicitFriction::Static => (friction.sliding, single(turn_mm, breakaway_v)),
        ExplicitFriction::Gms => (
            friction
                .sliding
                .map(|model| flat(*model, model.curve.breakaway_v)),
            friction.gms.clone(),
        ),
        ExplicitFriction::Both => (friction.sliding, friction.gms.clone()),
    };
    AxisParameters {
        gain_mm_per_v_s2: plant.gain_mm_per_v_s2,
        damping_per_s: plant.damping_per_s,
        stiffness_per_s2: plant.stiffness_per_s2,
        delay_s: plant.delay_s,
        friction: PerDirection {
            positive: sliding.positive,
            negative: sliding.negative,
        },
        gms,
        model: FrictionParameters::Gms,
        resolution_mm: settings.encoder.resolution_mm,
        full_scale_v: settings.amplifier.full_scale_v,
        imperfections: Imperfections::default(),
        drive: Drive::BallScrew,
        velocity_drive: None,
    }
}

/// The response that a linear model with explicit friction shows when it is excited as the axis was.
///
/// # Errors
/// A run that is stopped, or a recording without a response.
pub fn simulated_response(
    measurement: &Measurement<'_>,
    truth: AxisParameters,
) -> Result<FrequencyResponse, ReviseError> {
    // The candidate is without noise: the seed does not matter.
    let stage = StageSettings {
        rate_hz: measurement.rate_hz,
        ..StageSettings::simulated()
    };
    let mut test_axis = SimulatedTestAxis::under(&stage, 0, truth, 0);
    test_axis.apply(measurement.settings)?;
    let recording = test_axis.perform(measurement.experiment, &mut |_| {})?;
    (measurement.estimate)(&recording).ok_or(ReviseError::NoResponse)
}

/// Revises A, B and C for each kind of explicit friction, in parallel; Td stays. `original` was fitted to the measured
/// response; `friction` was identified. A kind with which the search does not converge is left out, unless it does with none.
///
/// # Errors
/// A measurement without a usable response, a candidate that cannot be run as the axis was, or a search that fails.
pub fn revise(
    measurement: &Measurement<'_>,
    original: &PlantModel,
    friction: &FrictionSettings,
) -> Result<Vec<Revision>, ReviseError> {
    let measured = (measurement.estimate)(measurement.recording).ok_or(ReviseError::NoResponse)?;
    let lines: Vec<usize> = (0..measured.points.len())
        .filter(|&index| measured.points[index].coherence >= measurement.least_coherence)
        .collect();
    if lines.len() < LEAST_LINES {
        return Err(ReviseError::Incoherent {
            lines: lines.len(),
            least_coherence: measurement.least_coherence,
        });
    }
    let revised: Vec<Result<Revision, ReviseError>> = ExplicitFriction::ALL
        .into_par_iter()
        .map(|kind| revise_for(kind, measurement, &measured, &lines, original, friction))
        .collect();
    let converges = revised.iter().any(Result::is_ok);
    revised
        .into_iter()
        .filter(|revision| !(converges && matches!(revision, Err(ReviseError::Fit(_)))))
        .collect()
}

fn revise_for(
    kind: ExplicitFriction,
    measurement: &Measurement<'_>,
    measured: &FrequencyResponse,
    lines: &[usize],
    original: &PlantModel,
    friction: &FrictionSettings,
) -> Result<Revision, ReviseError> {
    let respond = |plant: &PlantModel| {
        let truth = candidate(plant, friction, kind, measurement.settings);
        simulated_response(measurement, truth)
    };
    let with = |values: &[f64]| PlantModel {
        gain_mm_per_v_s2: values[0],
        damping_per_s: values[1],
        stiffness_per_s2: values[2],
        delay_s: original.delay_s,
    };
    let before = respond(original)?;
    let gain = original.gain_mm_per_v_s2;
    let most_damping = 3.0 * original.damping_per_s.max(10.0);
    let most_stiffness = 3.0 * original.stiffness_per_s2.max(1000.0);
    let parameters = [
        Parameter {
            name: "A",
            start: gain,
            bounds: (0.3 * gain, 3.0 * gain),
        },
        Parameter {
            name: "B",
            start: 0.5 * original.damping_per_s.max(1.0),
            bounds: (0.0, most_damping),
        },
        Parameter {
            name: "C",
            start: 0.1 * original.stiffness_per_s2.max(10.0),
            bounds: (0.0, most_stiffness),
        },
    ];
    let found = fit_with_step(&parameters, Loss::Huber, STEP, |values| {
        respond(&with(values)).map_or_else(
            |_| vec![f64::NAN; 2 * lines.len()],
            |response| residuals(measured, &response, lines),
        )
    })?;
    let plant = with(&found.values);
    let after = respond(&plant)?;
    Ok(Revision {
        friction: kind,
        plant,
        fit: found,
        misfit: (
            misfit(measured, &before, lines),
            misfit(measured, &after, lines),
        ),
        responses: (before, after),
    })
}

/// Relative distance of the responses, in and across the measured one's direction, line by line; each line weighs as
/// its coherence lets it.
fn residuals(
    measured: &FrequencyResponse,
    response: &FrequencyResponse,
    lines: &[usize],
) -> Vec<f64> {
    lines
        .iter()
        .flat_map(|&index| {
            let point = &measured.points[index];
            let ratio = (response.points[index].response / point.response).ln();
            let weight = point.coherence;
            [weight * ratio.re, weight * ratio.im]
        })
        .collect()
}

/// RMS distance of the responses.
pub fn misfit(
    measured: &FrequencyResponse,
    response: &FrequencyResponse,
    lines: &[usize],
) -> Misfit {
    let squares = lines.iter().fold((0.0, 0.0), |(gain, phase), &index| {
        let ratio = response.points[index].response / measured.points[index].response;
        (
            gain + (20.0 * ratio.norm().log10()).powi(2),
            phase + ratio.arg().to_degrees().powi(2),
        )
    });
    let count = lines.len() as f64;
    Misfit {
        gain_db: (squares.0 / count).sqrt(),
        phase_deg: (squares.1 / count).sqrt(),
    }
}
