//! The chain: motor constant, response, plant, PID, friction, pre-sliding, revised model, N-PID, verdict.

use quadrant::control::popov::sector_bound;
use quadrant::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant::friction::PerDirection;
use quadrant::friction::gms::FIRMWARE_ELEMENTS;
use quadrant::friction::stribeck::StaticFriction;
use quadrant::settings::{AxisSettings, FeedbackSettings};

use super::bootstrap::{
    bootstrap_settings, low_bandwidth_settings, measuring_settings, zero_gain_settings,
};
use super::error::CommissionError;
use super::verify::{Trial, Verdict, verify};
use crate::design::npid::{NonlinearRule, Range, choose_nonlinear};
use crate::design::{Form, MarginError, Margins, PidRequest, Process, Target, design_pid};
use crate::identify::excitation::Excitation;
use crate::identify::frf::{self, FrfError, FrfMeasurement, FrfSettings};
use crate::identify::motor_constant::{self, MotorConstant, MotorConstantSettings};
use crate::identify::plant::{PlantFit, PlantFitSettings, Stiffness, fit_plant};
use crate::identify::single_state::with_all_models;
use crate::identify::static_friction::{
    self, Exponent, FrictionFit, FrictionMap, StaticFrictionSettings, fit_map,
};
use crate::identify::virgin_curve::{self, GmsFit, Knots, VirginCurveError, VirginCurveSettings};
use crate::machine::{TestAxis, approach};
use crate::record::Recording;

/// What a commissioning is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommissionSettings {
    /// What the PID is designed for, on the continuous loop.
    pub target: Target,
    /// Share of the Popov bound that the nonlinear gain may take, 0 to 1.
    pub sector_share: f64,
    /// The runs that the friction is taken from.
    pub friction: StaticFrictionSettings,
    /// The sine on which the result is judged.
    pub trial: Trial,
}

impl Default for CommissionSettings {
    /// The thesis' margins, and three quarters of the Popov bound.
    fn default() -> Self {
        Self {
            target: Target::Margins {
                gain_margin_db: 9.9,
                phase_margin_deg: 54.2,
                crossover_hz: None,
            },
            sector_share: 0.75,
            friction: StaticFrictionSettings {
                velocities_mm_s: (0.1, 40.0),
                ..StaticFrictionSettings::default()
            },
            trial: Trial::default(),
        }
    }
}

/// Everything a commissioning found, in the order in which it did.
#[derive(Clone, Debug)]
pub struct Commissioned {
    /// The motor constant, from the open-loop test.
    pub motor: MotorConstant,
    /// The response of the sliding axis.
    pub response: FrfMeasurement,
    /// The linear model.
    pub plant: PlantFit,
    /// Margins of the PID with sampling at the control rate.
    pub margins: Result<Margins, MarginError>,
    /// The friction-velocity map, its model, and the recordings of the runs.
    pub friction: (FrictionMap, FrictionFit, Vec<Recording>),
    /// Pre-sliding friction, and its recording.
    pub presliding: (GmsFit, Recording),
    /// The Popov bound of the nonlinear gain.
    pub sector_bound: f64,
    /// The finished settings.
    pub settings: AxisSettings,
    /// What they achieve on the axis.
    pub verdicts: Vec<Verdict>,
}

/// The steps, for progress: name and share of the whole.
const STEPS: [(&str, f64); 6] = [
    ("motor constant", 0.01),
    ("frequency response", 0.06),
    ("friction at constant velocity", 0.63),
    ("pre-sliding friction", 0.15),
    ("controller", 0.01),
    ("verdict", 0.14),
];

/// Where the experiments begin, mm: where the axis stood when it was switched on, in the middle of its travel.
const HOME_MM: f64 = 0.0;
/// How often the excitation is halved before the response is given up.
const HALVINGS: usize = 6;
/// Elements that find their own knots.
const FEW_ELEMENTS: usize = 4;
/// Share of the largest force at which the pre-sliding range ends, the last knot over that range, and the exponent with which
/// knots are denser near zero.
const RISEN: f64 = 0.95;
const SPREAD: f64 = 1.7;
const DENSITY: f64 = 1.6;
/// Largest relative error of the predicted hysteresis.
const MOST_HYSTERESIS_ERROR: f64 = 0.10;

/// Commissions the test_axis's axis, unattended. `base` says what the axis is: encoder, amplifier, limits, derivative filter; its gains
/// and its friction are not looked at. `progress` is told the step and the share of the whole.
///
/// # Errors
/// The first step that fails, with the reason and a remedy; the axis is left at rest, its outputs off.
pub fn commission(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    request: &CommissionSettings,
    progress: &mut dyn FnMut(&'static str, f64),
) -> Result<Commissioned, CommissionError> {
    let rate_hz = test_axis.info().rate_hz;
    let mut step = 0;
    let mut report = |step: usize, share: f64| {
        let before: f64 = STEPS[..step].iter().map(|(_, part)| part).sum();
        progress(STEPS[step].0, before + share * STEPS[step].1);
    };

    test_axis.apply(&zero_gain_settings(base))?;
    let motor =
        motor_constant::measure(test_axis, &MotorConstantSettings::default(), &mut |share| {
            report(step, share);
        })?;

    step += 1;
    test_axis.apply(&bootstrap_settings(base, motor.gain_mm_per_v_s2, rate_hz))?;
    approach(test_axis, HOME_MM)?;
    let response = sliding_response(test_axis, &mut |share| report(step, share))?;
    let plant = fit_plant(
        &response.estimate.response,
        &PlantFitSettings {
            stiffness: Stiffness::Zero,
            ..PlantFitSettings::default()
        },
    )?;
    let process = Process::Model(plant.plant);
    let design = PidRequest {
        target: request.target,
        form: Form::Continuous,
        derivative_filter_s: base.feedback.pid.derivative_filter_s,
        ki_v_per_mm_s: None,
    };
    let pid = design_pid(&process, &design)?.gains;

    step += 1;
    let mut settings = base.clone();
    settings.plant = Some(plant.plant);
    settings.feedback.pid = pid;
    test_axis.apply(&measuring_settings(&settings))?;
    approach(test_axis, HOME_MM)?;
    let (map, recordings) = static_friction::measure(test_axis, &request.friction, &mut |share| {
        report(step, share);
    })?;
    let friction = fit_map(&map, Exponent::Fixed(1.0))?;

    step += 1;
    let quiet = low_bandwidth_settings(&settings, &plant.plant, rate_hz);
    test_axis.apply(&quiet)?;
    let (_, breakaway_v) = friction.mean_levels_v();
    let sine = VirginCurveSettings::outrunning(quiet.feedback.pid.kp_v_per_mm, breakaway_v);
    let recording = virgin_curve::measure(test_axis, &sine, &mut |share| report(step, share))?;
    let sliding = friction.models();
    let gms = identify_elements(&recording, &sliding)?;
    if gms.prediction.relative_error > MOST_HYSTERESIS_ERROR {
        return Err(CommissionError::Hysteresis {
            percent: 100.0 * gms.prediction.relative_error,
        });
    }

    step += 1;
    let bound = sector_bound(&plant.plant, &pid, 1.0 / rate_hz);
    let nonlinear = choose_nonlinear(
        &pid,
        bound,
        &NonlinearRule {
            sector_share: request.sector_share,
            range: Range::Breakaway(breakaway_v),
        },
    );
    settings.feedback = FeedbackSettings {
        integral_limit_v: base.feedback.integral_limit_v,
        transfer_s: base.feedback.transfer_s,
        ..FeedbackSettings::all_laws(pid, nonlinear, base.limits.max_velocity_mm_s)
    };
    settings.friction = with_all_models(sliding, gms.gms.clone());
    settings.feedforward.kind = FeedforwardKind::Combined;
    settings.feedforward.gains = FeedforwardGains {
        level: 1.0,
        viscous: 1.0,
        gms: 1.0,
        inertia_v_s2_per_mm: 1.0 / plant.plant.gain_mm_per_v_s2,
    };
    settings.feedforward.preview_s = plant.plant.delay_s;
    let margins = process.margins(
        &pid,
        Form::Sampled {
            sample_time_s: 1.0 / rate_hz,
            computation_delay_s: 0.0,
        },
    );

    step += 1;
    let verdicts = verify(test_axis, &settings, request.trial, &mut |share| {
        report(step, share)
    })?;
    Ok(Commissioned {
        motor,
        response,
        plant,
        margins,
        friction: (map, friction, recordings),
        presliding: (gms, recording),
        sector_bound: bound,
        settings,
        verdicts,
    })
}

/// The GMS model on as many elements as the firmware has room for, if that predicts the record better than few do.
///
/// Few elements find their own knots. For many the record is too noisy: knots wander off beyond it, and the search may not
/// end. Theirs are spread over the pre-sliding range, denser near zero, where the curve bends most; only shares are searched.
fn identify_elements(
    recording: &Recording,
    sliding: &PerDirection<StaticFriction>,
) -> Result<GmsFit, VirginCurveError> {
    let identify = |knots| virgin_curve::identify(recording, Some(sliding), &knots);
    let few = identify(Knots::Automatic(FEW_ELEMENTS))?;
    let top_v = few
        .curve
        .points
        .iter()
        .map(|point| point.force_v)
        .fold(0.0, f64::max);
    let rising = few
        .curve
        .points
        .iter()
        .find(|point| point.force_v >= RISEN * top_v);
    let range_mm = rising.map_or(0.0, |point| point.displacement_mm);
    let knot = |index: usize| {
        let place = index as f64 / FIRMWARE_ELEMENTS as f64;
        SPREAD * range_mm * place.powf(DENSITY)
    };
    let many = identify(Knots::At((1..=FIRMWARE_ELEMENTS).map(knot).collect()));
    Ok(match many {
        Ok(many) if many.prediction.relative_error < few.prediction.relative_error => many,
        _ => few,
    })
}

/// The response of the sliding axis, with less excitation as long as it slows the axis too much.
fn sliding_response(
    test_axis: &mut dyn TestAxis,
    progress: &mut dyn FnMut(f64),
) -> Result<FrfMeasurement, CommissionError> {
    let mut settings = FrfSettings::default();
    for _ in 0..HALVINGS {
        match frf::measure(test_axis, &settings, progress) {
            Err(FrfError::NotSliding { .. }) => {
                settings.excitation = Excitation {
                    rms_v: 0.5 * settings.excitation.rms_v,
                    ..settings.excitation
                };
            }
            outcome => return Ok(outcome?),
        }
    }
    Ok(frf::measure(test_axis, &settings, progress)?)
}
