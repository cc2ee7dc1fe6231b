//! The chain: motor constant, response, plant, PID, friction, pre-sliding, revised model, N-PID, verdict.

use quadrant_settings::AxisSettings;

use super::bootstrap::{low_bandwidth_settings_on, measuring_settings, zero_gain_settings};
use super::commissioned::{CommissionSettings, Commissioned};
use super::error::CommissionError;
use super::guard::Guard;
use super::linear_model::{HOME_MM, Linear, linear_model};
use super::models::{self, Measurements, Models};
use super::quiet_pid;
use super::rest::Knock;
use super::ringing::Ringing;
use super::velocity_mode;
use super::verify::{Verification, VerifyError, verify};
use crate::identify::frf::FrfError;
use crate::identify::motor_constant::{self, MotorConstantSettings};
use crate::identify::static_friction::{
    self, FrictionFit, FrictionFitError, FrictionMap, KnownViscous, StaticFrictionError,
    StaticFrictionSettings,
};
use crate::identify::virgin_curve::{self, GmsFit, VirginCurveError, VirginCurveSettings};
use crate::record::Recording;
use crate::test_axis::{ExperimentError, TestAxis, approach};

/// The steps, for progress: name and share of the whole.
const STEPS: [(&str, f64); 6] = [
    ("motor constant", 0.07),
    ("frequency response", 0.07),
    ("friction at constant velocity", 0.28),
    ("pre-sliding friction", 0.05),
    ("controller", 0.01),
    ("verdict", 0.52),
];

/// Watches a commissioning; a function of the step and the share of the whole sees how far it is.
pub trait Watch {
    /// Receives the step, and the share of the whole that is done, 0 to 1.
    fn progress(&mut self, step: &'static str, share: f64);

    /// Receives settings with the PID alone, finished but for trials, as soon as there is one, and again where a softer one takes its place.
    fn pid(&mut self, _settings: &AxisSettings) {}
}

impl<F: FnMut(&'static str, f64)> Watch for F {
    fn progress(&mut self, step: &'static str, share: f64) {
        self(step, share);
    }
}

/// Commissions an axis, unattended. Of `base` encoder, amplifier and limits count, not the law and the friction; the derivative's filter,
/// too, if the request has margins for the PID.
///
/// # Errors
/// The first step that fails, with the reason and a remedy; the axis is left at rest, its outputs off, but for an interruption: what
/// interrupts leaves the axis as it says.
pub fn commission(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    request: &CommissionSettings,
    watch: &mut dyn Watch,
) -> Result<Commissioned, CommissionError> {
    let mut guard = Guard::new(test_axis);
    match guarded(&mut guard, base, request, watch) {
        Ok(found) => Ok(Commissioned {
            ran: guard.runs,
            ..found
        }),
        Err(error) if error.is_interrupted() => Err(error),
        Err(error) => {
            let error = match guard.ringing() {
                Some(ringing) if !matches!(error, CommissionError::Rings { .. }) => {
                    CommissionError::rings(ringing, error)
                }
                _ => error,
            };
            Err(match guard.switch_off() {
                Ok(()) => error,
                Err(reason) => CommissionError::SwitchingOff {
                    source: Box::new(error),
                    reason,
                },
            })
        }
    }
}

fn guarded(
    test_axis: &mut Guard<'_>,
    base: &AxisSettings,
    request: &CommissionSettings,
    watch: &mut dyn Watch,
) -> Result<Commissioned, CommissionError> {
    let rate_hz = test_axis.info().rate_hz;
    let mut step = 0;

    test_axis.apply(&zero_gain_settings(base))?;
    let steps = MotorConstantSettings::default().fitted_to(test_axis.info().first_room_mm());
    let motor = motor_constant::measure(test_axis, &steps, &mut |share| {
        report(watch, step, share);
    })?;

    step += 1;
    test_axis.rest_off(true).map_err(FrfError::from)?;
    let found = linear_model(
        test_axis,
        base,
        request,
        &steps,
        motor.clone(),
        &mut |share| {
            report(watch, step, share);
        },
    );
    test_axis.rest_off(false).map_err(FrfError::from)?;
    let Linear {
        motor,
        response,
        plant,
        mut controller,
    } = match found {
        Ok(found) => found,
        Err(error) => return Err(velocity_mode::explain(test_axis, base, &motor, error)),
    };

    velocity_mode::refuse(&plant.plant, &response)?;
    step += 1;
    let mut settings = base.clone();
    settings.plant = Some(plant.plant);
    settings.friction = models::rough_friction(motor.directed_v, &plant.plant, rate_hz);
    let runs = request.friction.fitted_to(&test_axis.info());
    let knock = Knock {
        friction_v: 0.5 * (motor.directed_v[0] + motor.directed_v[1]),
        noise_mm: motor.noise_mm(),
    };
    let viscous = models::viscous(&plant);
    let (mut tried, mut stopped) = (false, 0);
    let (map, recordings, friction) = loop {
        controller.put_into(&mut settings);
        let measuring = measuring_settings(&settings);
        watch.pid(&AxisSettings {
            limits: base.limits,
            ..measuring.clone()
        });
        test_axis.apply(&measuring)?;
        let measured = friction(test_axis, runs, viscous, &mut |share| {
            report(watch, step, share);
        });
        let (map, recordings, found) = match measured {
            Err(CommissionError::Friction(StaticFrictionError::Experiment(error)))
                if stopped < models::MAX_SOFTENINGS
                    && !matches!(error, ExperimentError::Interrupted { .. })
                    && (error.strayed() || test_axis.ringing().is_some()) =>
            {
                stopped += 1;
                controller.soften();
                controller.note_stop(&error);
                continue;
            }
            measured => measured?,
        };
        let uneven = map.runs.iter().filter(|run| run.stick_slip).count();
        let is_even = found.is_ok() && (uneven as f64) < MAX_UNEVEN_SHARE * map.runs.len() as f64;
        if tried || is_even || !quiet_pid::soften(test_axis, &settings, &mut controller)? {
            break (map, recordings, found?);
        }
        tried = true;
    };

    step += 1;
    let process = models::process(&plant, &controller.filters);
    let quiet = low_bandwidth_settings_on(&settings, &plant.plant, &process, rate_hz);
    let moving = measuring_settings(&settings);
    let (recording, gms) = presliding(test_axis, &friction, &quiet, &moving, &mut |share| {
        report(watch, step, share);
    })?;

    step += 1;
    let measurements = Measurements {
        motor,
        response,
        map,
        runs: recordings,
        presliding: recording,
    };
    let models = Models {
        plant,
        controller,
        friction,
        gms,
    };
    let mut found = models.commissioned(measurements, base, request, rate_hz);

    if !request.trials {
        return Ok(found);
    }
    step += 1;
    let mut softenings = 0;
    let pid_hums = soften_at_rest(test_axis, &knock, &mut found, rate_hz)?;
    let mut verification = loop {
        match verify(test_axis, &found.settings, &mut |share| {
            report(watch, step, share)
        }) {
            Err(error) if error.asks_for_softer() && softenings < models::MAX_SOFTENINGS => {
                softenings += 1;
                found.soften(&error, rate_hz);
            }
            outcome => break outcome?,
        }
    };
    let rest = |axis: &mut dyn TestAxis, found: &Commissioned, verification: &Verification| {
        knock.ringing(axis, &verification.settings(&found.settings))
    };
    let seen = rest(test_axis, &found, &verification)?;
    // One that sticks and slips may not have done so in the last test.
    let is_linear = verification
        .settings(&found.settings)
        .feedback
        .nonlinear
        .is_none();
    found.hums = seen.map(|(hum, _)| hum).or(pid_hums.filter(|_| is_linear));
    if seen.is_some_and(|(_, is_loud)| is_loud) && verification.is_better_than_pid() {
        let chosen = std::mem::replace(&mut verification.chosen, 0);
        let law = &verification.laws[chosen].law;
        match rest(test_axis, &found, &verification)? {
            None => {
                found
                    .remarks
                    .push(format!("{law} hums at rest, and the PID alone does not."));
                found.hums = None;
            }
            // No law is quieter: the better one stays.
            Some(_) => verification.chosen = chosen,
        }
    }
    found.settings = verification.settings(&found.settings);
    found.verification = Some(verification);
    Ok(found)
}

/// Softens the PID until it does not hum at rest after a knock, if that takes little: errors grow faster than the crossover falls. Else it
/// stays as it is. What is left of its hum.
///
/// # Errors
/// Settings that the machine refuses, and an interruption.
fn soften_at_rest(
    test_axis: &mut dyn TestAxis,
    knock: &Knock,
    found: &mut Commissioned,
    rate_hz: f64,
) -> Result<Option<Ringing>, CommissionError> {
    let mut softer = found.clone();
    let mut first = None;
    for _ in 0..=MAX_SOFTENINGS_AT_REST {
        let pid = measuring_settings(&softer.settings);
        let seen = knock.ringing(test_axis, &pid)?;
        let hum = seen.map(|(hum, _)| hum);
        let Some((loud, true)) = seen else {
            *found = softer;
            return Ok(hum);
        };
        first = first.or(hum);
        softer.soften(&VerifyError::Hums(loud), rate_hz);
    }
    Ok(first)
}

/// Largest number of softer PIDs because of a hum at rest.
const MAX_SOFTENINGS_AT_REST: usize = 2;

/// Reports the share of a step as that of the whole.
fn report(watch: &mut dyn Watch, step: usize, share: f64) {
    let before: f64 = STEPS[..step].iter().map(|(_, part)| part).sum();
    watch.progress(STEPS[step].0, before + share * STEPS[step].1);
}

/// Share of uneven runs from which on the PID is checked for oscillation: of the simulated stage's axes 1/8 are uneven.
const MAX_UNEVEN_SHARE: f64 = 0.2;

/// Voltages at constant velocities, the recordings of the runs, and the model of them.
type Friction = (
    FrictionMap,
    Vec<Recording>,
    Result<FrictionFit, CommissionError>,
);

/// Friction at constant velocities, at faster ones as long as the axis sticks and slips at the slowest, or breaks away under vibration; and
/// its model.
fn friction(
    test_axis: &mut dyn TestAxis,
    mut runs: StaticFrictionSettings,
    viscous: Option<KnownViscous>,
    progress: &mut dyn FnMut(f64),
) -> Result<Friction, CommissionError> {
    loop {
        let (map, recordings) = static_friction::measure(test_axis, &runs, progress)?;
        let (slowest, fastest) = &mut runs.velocities_mm_s;
        match models::even_friction(&map, viscous) {
            Err(FrictionFitError::TooFewRuns { .. } | FrictionFitError::Sign { .. })
                if SLOWEST_VELOCITY_RAISE * *slowest < *fastest / SLOWEST_VELOCITY_RAISE =>
            {
                *slowest *= SLOWEST_VELOCITY_RAISE;
            }
            _ => {
                let found = models::friction(&map, viscous);
                return Ok((map, recordings, found));
            }
        }
    }
}

/// The hysteresis before sliding, and the elements from it. On an axis that breaks away under noise or vibration, a slow motion meets
/// less friction than it will in use: quicker sines are tried until one meets what sliding did, and the one that meets most counts.
/// The sines run under `quiet`, from the middle of the travel, to which the axis goes under `moving`.
fn presliding(
    test_axis: &mut dyn TestAxis,
    friction: &FrictionFit,
    quiet: &AxisSettings,
    moving: &AxisSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<(Recording, Result<GmsFit, VirginCurveError>), CommissionError> {
    let (coulomb_v, breakaway_v) = friction.mean_levels_v();
    let usual = VirginCurveSettings::outrunning(quiet.feedback.pid.kp_v_per_mm, breakaway_v);
    let mut sine = VirginCurveSettings {
        amplitude_mm: usual
            .amplitude_mm
            .min(SINE_SHARE * test_axis.info().travel_mm),
        ..usual
    };
    let measure = |test_axis: &mut dyn TestAxis,
                   sine: &VirginCurveSettings,
                   progress: &mut dyn FnMut(f64)| {
        test_axis.apply(moving)?;
        approach(test_axis, HOME_MM)?;
        test_axis.apply(quiet)?;
        let recording = virgin_curve::measure(test_axis, sine, progress)?;
        let gms = models::presliding(&recording, friction);
        Ok::<_, CommissionError>((recording, gms))
    };
    type Found = (Recording, Result<GmsFit, VirginCurveError>);
    let met = |(_, gms): &Found| {
        let sliding_v = breakaway_v.min(coulomb_v);
        gms.as_ref()
            .map_or(0.0, |found| found.curve.top_v() / sliding_v)
    };
    let will_do = |found: &Found| {
        let fits = |gms: &GmsFit| gms.prediction.relative_error < POOR_FIT;
        met(found) >= MIN_MET_SHARE && found.1.as_ref().is_ok_and(fits)
    };
    let mut best = measure(test_axis, &sine, progress)?;
    let most_mm = LARGEST_SINE_SHARE * test_axis.info().travel_mm;
    for _ in 0..MAX_FURTHER_SINES {
        if will_do(&best) {
            break;
        }
        let still_rises = matches!(best.1, Err(VirginCurveError::NoPlateau { .. }));
        if still_rises && sine.amplitude_mm < most_mm {
            sine.amplitude_mm = (FURTHER_AMPLITUDE_RATIO * sine.amplitude_mm).min(most_mm);
        } else {
            sine.frequency_hz *= FURTHER_VELOCITY_RATIO;
        }
        match measure(test_axis, &sine, &mut |_| {}) {
            Ok(found) if met(&found) > met(&best) => best = found,
            Ok(_) => {}
            // What was measured is kept.
            Err(CommissionError::Sine(error)) if error.strayed() => {}
            Err(error) => return Err(error),
        }
    }
    Ok(best)
}

/// Least friction that a slow sine meets over the least level of sliding: with less, the axis breaks away under vibration.
const MIN_MET_SHARE: f64 = 0.8;
/// Error of the elements' prediction from which on the fit is poor.
const POOR_FIT: f64 = 0.2;
/// Further sines that are tried.
const MAX_FURTHER_SINES: usize = 2;
/// Factor on the velocity of each further sine.
const FURTHER_VELOCITY_RATIO: f64 = 4.0;
/// Factor on the amplitude of each further sine, while the friction still rises.
const FURTHER_AMPLITUDE_RATIO: f64 = 2.5;
/// Largest amplitude of a further sine over the travel.
pub(super) const LARGEST_SINE_SHARE: f64 = 0.25;
/// Share of the travel that the slow sine takes at most at first.
const SINE_SHARE: f64 = 0.1;
/// Factor by which the slowest velocity is raised where the axis sticks and slips.
const SLOWEST_VELOCITY_RAISE: f64 = 3.0;
