//! The linear model of an axis of which hardly more is known than what the open-loop test showed: its response under first controllers,
//! until one of them holds it.

use quadrant_law::safety::FaultCode;
use quadrant_settings::AxisSettings;

use super::bootstrap::{
    BOOTSTRAP_SHARES, CROSSOVER_HZ, soft_bootstrap_settings, with_output_limit,
    with_rough_friction, zero_gain_settings,
};
use super::commissioned::CommissionSettings;
use super::error::CommissionError;
use super::guard::Guard;
use super::models::{self, Controller};
use super::ringing::Ringing;
use crate::identify::excitation::Excitation;
use crate::identify::frf::{self, FrfError, FrfMeasurement, FrfSettings};
use crate::identify::motor_constant::{self, MotorConstant, MotorConstantSettings};
use crate::identify::plant::PlantFit;
use crate::test_axis::{AxisInfo, TestAxis, approach};

/// A linear model, and what it was made from.
pub(super) struct Linear {
    /// The open-loop test from which the first controller was made.
    pub motor: MotorConstant,
    pub response: FrfMeasurement,
    pub plant: PlantFit,
    pub controller: Controller,
}

/// Position from which the experiments begin, mm: the middle of the travel.
pub(super) const HOME_MM: f64 = 0.0;
/// Travel either way below which the lag of the first controller counts, and the axis is slow enough to stick and slip under it, mm.
const SHORT_TRAVEL_MM: f64 = 60.0;
/// Factors on the acceleration per volt of the open-loop test that are tried where its levels are quicker than a mode: a motor with the
/// encoder moves alone, and a table with the encoder hardly follows.
const GAIN_CORRECTIONS: [f64; 3] = [0.4, 3.0, 9.0];

/// Measures the response and finds the linear model, under controllers for the acceleration per volt that the open-loop test showed, then
/// for what a gentle one shows, then for others.
///
/// # Errors
/// The first reason for which none was found.
pub(super) fn linear_model(
    test_axis: &mut Guard<'_>,
    base: &AxisSettings,
    request: &CommissionSettings,
    steps: &MotorConstantSettings,
    motor: MotorConstant,
    progress: &mut dyn FnMut(f64),
) -> Result<Linear, CommissionError> {
    let mut model = |test_axis: &mut Guard<'_>,
                     motor: &MotorConstant,
                     misjudged: f64|
     -> Result<Linear, CommissionError> {
        test_axis.slowed_by(by_friction(motor.gain_mm_per_v_s2, motor));
        if middle_first(&test_axis.info()).is_some() {
            to_the_middle(test_axis, base, motor, misjudged)?;
        }
        let found =
            under_first_controllers(test_axis, base, request, motor, misjudged, &mut *progress)?;
        let gain = found.plant.plant.gain_mm_per_v_s2;
        let least = if found.plant.is_determined() {
            gain
        } else {
            gain.min(motor.gain_mm_per_v_s2)
        };
        test_axis.slowed_by(by_friction(least, motor));
        Ok(found)
    };
    let first: CommissionError = match model(test_axis, &motor, 1.0) {
        Ok(found) => return Ok(found),
        Err(error) if error.is_interrupted() => return Err(error),
        Err(error) => error,
    };
    // Of an axis that rings, the gentle test may measure the mass better, and so make a better first controller.
    test_axis.apply(&zero_gain_settings(base))?;
    let gentle = motor_constant::measure_gently(test_axis, steps, &mut |_| {});
    let as_shown = gentle.is_ok().then_some(1.0);
    let motor = gentle.unwrap_or(motor);
    for misjudged in as_shown.into_iter().chain(GAIN_CORRECTIONS) {
        match model(test_axis, &motor, misjudged) {
            Ok(found) => return Ok(found),
            Err(error) if error.is_interrupted() => return Err(error),
            Err(_) => {}
        }
    }
    Err(first)
}

/// Deceleration by friction alone, mm/s^2, of an axis that a volt accelerates by so much.
fn by_friction(gain_mm_per_v_s2: f64, motor: &MotorConstant) -> f64 {
    let [ahead_v, back_v] = motor.directed_v;
    gain_mm_per_v_s2 * ahead_v.min(back_v)
}

/// The place to which an axis moves first that stands near an end, mm; none if it stands near enough to the middle.
pub(super) fn middle_first(info: &AxisInfo) -> Option<f64> {
    (info.start_mm.abs() > MIDDLE_SHARE * info.travel_mm).then_some(HOME_MM)
}

/// Distance from the middle, over the travel, within which an axis counts as in the middle.
const MIDDLE_SHARE: f64 = 0.1;

/// A first controller at a share of the usual crossover, for a gain in mm/(V s^2) that may be wrong: what its voltage cannot do, the axis
/// cannot, should it run away.
fn first_controller(
    base: &AxisSettings,
    motor: &MotorConstant,
    gain: f64,
    rate_hz: f64,
    share: f64,
) -> AxisSettings {
    let mut settings = soft_bootstrap_settings(base, gain, rate_hz, share);
    settings.limits.overspeed_ratio = FIRST_OVERSPEED_RATIO;
    let [ahead_v, back_v] = motor.directed_v;
    let excitation_v = FrfSettings::default().excitation.rms_v;
    let most_v = MAX_FRICTION_RATIO * ahead_v.max(back_v).max(excitation_v);
    with_output_limit(settings, most_v)
}

/// Speed at which an axis is stopped under a first controller, over its limit: the least, for one that swings is the harder to calm the
/// faster it became.
const FIRST_OVERSPEED_RATIO: f64 = 1.05;

/// Largest voltage of a first controller over friction, or over the excitation where that is more: on random axes those that held took 0.9 to 4.
const MAX_FRICTION_RATIO: f64 = 6.0;

/// Moves the axis to the middle of its travel under the first controller, or a softer one where that oscillates. `misjudged`: factor
/// on the acceleration per volt that the open-loop test showed.
fn to_the_middle(
    test_axis: &mut Guard<'_>,
    base: &AxisSettings,
    motor: &MotorConstant,
    misjudged: f64,
) -> Result<(), CommissionError> {
    let rate_hz = test_axis.info().rate_hz;
    let gain = misjudged * motor.gain_mm_per_v_s2;
    let mut outcome = Ok(());
    for share in BOOTSTRAP_SHARES {
        let settings = first_controller(base, motor, gain, rate_hz, share);
        test_axis.apply(&with_rough_friction(settings, gain, motor.directed_v))?;
        outcome = approach(test_axis, HOME_MM);
        if outcome.is_ok() {
            break;
        }
    }
    Ok(outcome?)
}

/// The response of the sliding axis under a first controller, the linear model, and the controller that is designed on it. A mode
/// that the first controller excites spoils them: they are repeated with softer ones, as soft as the frequency demands that was seen.
/// `misjudged`: factor on the acceleration per volt that the open-loop test showed; where it is not 1, friction is fed forward from the
/// first of them on, and not just from where the axis lags by it. Where no response determines a model, the first model that describes one is taken.
fn under_first_controllers(
    test_axis: &mut Guard<'_>,
    base: &AxisSettings,
    request: &CommissionSettings,
    motor: &MotorConstant,
    misjudged: f64,
    progress: &mut dyn FnMut(f64),
) -> Result<Linear, CommissionError> {
    let rate_hz = test_axis.info().rate_hz;
    let gain = misjudged * motor.gain_mm_per_v_s2;
    let is_short = test_axis.info().travel_mm < SHORT_TRAVEL_MM;
    let feeds_at = |share: f64| share < 1.0 || is_short || misjudged != 1.0;
    let linear = |response: &FrfMeasurement, determined| -> Result<Linear, CommissionError> {
        let wishes = (base, request);
        let (plant, controller) = models::designed(response, determined, wishes, motor, rate_hz)?;
        Ok(Linear {
            motor: motor.clone(),
            response: response.clone(),
            plant,
            controller,
        })
    };
    let mut described = None;
    let mut attempt = |test_axis: &mut Guard<'_>,
                       share: f64,
                       trim: f64,
                       progress: &mut dyn FnMut(f64)|
     -> Result<Linear, CommissionError> {
        let mut settings = first_controller(base, motor, gain, rate_hz, share);
        if feeds_at(share) {
            let friction_v = motor.directed_v.map(|volts| trim * volts);
            settings = with_rough_friction(settings, gain, friction_v);
        }
        test_axis.apply(&settings)?;
        let response = sliding_response(test_axis, gain, progress)?;
        let found = linear(&response, true);
        if found.is_err() && described.is_none() {
            described = linear(&response, false).ok().map(|found| (found, settings));
        }
        found
    };
    let first = match attempt(test_axis, 1.0, 1.0, progress) {
        Ok(found) => return Ok(found),
        Err(error) if error.is_interrupted() => return Err(error),
        Err(error) => error,
    };
    let mut seen = rings(test_axis, &first);
    let (mut share, mut trim, mut trims) = (1.0, 1.0, 0);
    let mut next = next_share(share, &first, seen, is_short);
    let mut trimmed = trimmed(test_axis, &first, seen);
    for _ in 1..MAX_CONTROLLERS {
        // The friction that is fed forward is known by its order only: first that, then the controller.
        if let Some(factor) = trimmed
            && trims < FRICTION_TRIMS
            && feeds_at(share)
        {
            trim *= factor;
            trims += 1;
        } else if let Some(next) = next {
            (share, trims) = (next, 0);
        } else {
            break;
        }
        match attempt(test_axis, share, trim, progress) {
            Ok(found) => return Ok(found),
            Err(error) if error.is_interrupted() => return Err(error),
            Err(error) => {
                let now = rings(test_axis, &error);
                next = next_share(share, &error, now, is_short);
                trimmed = self::trimmed(test_axis, &error, now);
                seen = now.or(seen);
            }
        }
    }
    if let Some((found, settings)) = described {
        test_axis.apply(&settings)?;
        approach(test_axis, HOME_MM)?;
        return Ok(found);
    }
    Err(match seen {
        Some(seen) => CommissionError::rings(seen, first),
        None => first,
    })
}

/// The oscillation behind a failed attempt, if it was one.
fn rings(test_axis: &Guard<'_>, error: &CommissionError) -> Option<Ringing> {
    let slowed = matches!(
        error,
        CommissionError::Response(FrfError::NotSliding { .. })
    );
    // A limit cycle stops nothing.
    let at_end = || slowed.then(|| test_axis.ringing_at_end()).flatten();
    test_axis.ringing().or_else(at_end)
}

/// Factor on the friction that is fed forward, after the tracking error stopped an axis that lagged by more friction, or ran
/// ahead by less, or one jumped; none after another failure.
fn trimmed(test_axis: &Guard<'_>, error: &CommissionError, rings: Option<Ringing>) -> Option<f64> {
    let stopped = test_axis.interrupted()?;
    if rings.is_some() {
        return None;
    }
    if matches!(error, CommissionError::Response(FrfError::Experiment(error)) if error.ran_off()) {
        return Some(FRICTION_REDUCTION);
    }
    if !is_stuck(error) {
        return None;
    }
    let (first, last) = (stopped.reference_mm.first()?, stopped.reference_mm.last()?);
    let behind_mm = (last - stopped.position_mm.last()?) * (last - first).signum();
    Some(if behind_mm > 0.0 {
        FRICTION_RAISE
    } else {
        FRICTION_REDUCTION
    })
}

/// Share of the usual crossover that is tried after one that failed; none if there is none left. `is_short`: the travel is below
/// [`SHORT_TRAVEL_MM`].
fn next_share(
    share: f64,
    error: &CommissionError,
    rings: Option<Ringing>,
    is_short: bool,
) -> Option<f64> {
    let slowed = matches!(
        error,
        CommissionError::Response(FrfError::NotSliding { .. })
    );
    let held = is_stuck(error) || is_short;
    if rings.is_none() && (share >= 1.0 && held || share > 1.0 && slowed) {
        // The axis is held by more than so soft a controller overcomes.
        return Some(CROSSOVER_RAISE * share).filter(|share| *share <= MAX_CROSSOVER_SHARE);
    }
    // A mode is left alone by a loop that is slow enough.
    let keeps_away = |share: f64| {
        rings.is_none_or(|seen| share * CROSSOVER_HZ * MIN_OSCILLATION_RATIO <= seen.frequency_hz)
    };
    let softer: Vec<f64> = BOOTSTRAP_SHARES
        .into_iter()
        .filter(|next| *next < share.min(1.0))
        .collect();
    let suitable = softer.iter().copied().find(|next| keeps_away(*next));
    suitable.or(softer.last().copied())
}

/// True if the tracking error stopped the axis.
fn is_stuck(error: &CommissionError) -> bool {
    matches!(error, CommissionError::Response(FrfError::Experiment(error))
        if error.fault() == Some(FaultCode::FollowingError))
}

/// Largest number of first controllers that are tried.
const MAX_CONTROLLERS: usize = 10;
/// Changes of the friction that is fed forward, for each controller.
const FRICTION_TRIMS: usize = 1;
/// Factor on that friction where the axis stays behind.
const FRICTION_RAISE: f64 = 1.2;
/// Factor on that friction where the axis runs ahead.
const FRICTION_REDUCTION: f64 = 0.6;
/// Factor on the crossover of a controller that does not move the axis.
const CROSSOVER_RAISE: f64 = 1.7;
/// Largest crossover over the usual one.
const MAX_CROSSOVER_SHARE: f64 = 8.5;
/// Least frequency of an oscillation over the crossover of a loop that does not excite it.
const MIN_OSCILLATION_RATIO: f64 = 6.0;

/// Parameters of the response that suit an axis, without its gain.
pub(super) fn response_settings(info: &AxisInfo) -> FrfSettings {
    FrfSettings::default().fitted_to(info)
}

/// Acceleration per volt on which the usual excitation slides, mm/(V s^2): of the simulated stage's x axis.
const USUAL_GAIN_MM_PER_V_S2: f64 = 69_390.0;
/// Times that the excitation is halved before the response is given up.
const MAX_HALVINGS: usize = 6;

/// The response of the sliding axis, with less excitation as long as it slows the axis too much, or drives it too far.
fn sliding_response(
    test_axis: &mut dyn TestAxis,
    gain_mm_per_v_s2: f64,
    progress: &mut dyn FnMut(f64),
) -> Result<FrfMeasurement, CommissionError> {
    let usual = FrfSettings::default();
    let info = test_axis.info();
    let mut settings = response_settings(&info);
    // As large a share of the velocity as on the simulated stage.
    let slower = settings.bias_velocity_mm_s / usual.bias_velocity_mm_s;
    let lighter = gain_mm_per_v_s2 / USUAL_GAIN_MM_PER_V_S2;
    settings.excitation.rms_v *= (slower / lighter).min(1.0);
    let start_mm = settings.start_mm(info.travel_mm);
    for _ in 0..MAX_HALVINGS {
        // A pass that was given up ended somewhere on its way.
        approach(test_axis, start_mm).map_err(FrfError::from)?;
        match frf::measure(test_axis, &settings, progress) {
            Err(error) if asks_for_less(&error) => {
                settings.excitation = Excitation {
                    rms_v: 0.5 * settings.excitation.rms_v,
                    ..settings.excitation
                };
            }
            outcome => return Ok(outcome?),
        }
    }
    approach(test_axis, start_mm).map_err(FrfError::from)?;
    Ok(frf::measure(test_axis, &settings, progress)?)
}

/// True if the response may be measured with less excitation.
fn asks_for_less(error: &FrfError) -> bool {
    match error {
        FrfError::NotSliding { .. } => true,
        FrfError::Experiment(error) => error.ran_off(),
        FrfError::Setting(_) | FrfError::NoLine(_) | FrfError::Travel { .. } => false,
    }
}
