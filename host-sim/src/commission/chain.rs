//! The chain: motor constant, response, plant, PID, friction, pre-sliding, revised model, N-PID, verdict.

use quadrant::safety::FaultCode;
use quadrant::settings::AxisSettings;

use super::bootstrap::{
    BOOTSTRAP_SHARES, CROSSOVER_HZ, low_bandwidth_settings_on, measuring_settings,
    soft_bootstrap_settings, with_rough_friction, zero_gain_settings,
};
use super::commissioned::{CommissionSettings, Commissioned};
use super::error::CommissionError;
use super::guard::Guard;
use super::models::{self, Controller, Measurements, Models};
use super::ringing::Ringing;
use super::verify::verify;
use crate::identify::excitation::Excitation;
use crate::identify::frf::{self, FrfError, FrfMeasurement, FrfSettings};
use crate::identify::motor_constant::{self, MotorConstant, MotorConstantSettings};
use crate::identify::plant::PlantFit;
use crate::identify::static_friction::{
    self, FrictionFit, FrictionFitError, FrictionMap, StaticFrictionError, StaticFrictionSettings,
};
use crate::identify::virgin_curve::{self, GmsFit, VirginCurveError, VirginCurveSettings};
use crate::machine::{AxisInfo, TestAxis, approach};
use crate::record::Recording;

/// The steps, for progress: name and share of the whole.
const STEPS: [(&str, f64); 6] = [
    ("motor constant", 0.01),
    ("frequency response", 0.06),
    ("friction at constant velocity", 0.63),
    ("pre-sliding friction", 0.15),
    ("controller", 0.01),
    ("verdict", 0.14),
];

/// Position from which the experiments begin, mm: the middle of the travel.
const HOME_MM: f64 = 0.0;
/// Acceleration per volt on which the usual excitation slides, mm/(V s^2): of the simulated stage's x axis.
const USUAL_GAIN_MM_PER_V_S2: f64 = 69_390.0;
/// Travel either way below which the lag of the first controller counts, and the axis is slow enough to stick and slip under it, mm.
const SHORT_TRAVEL_MM: f64 = 60.0;
/// Times that the excitation is halved before the response is given up.
const HALVINGS: usize = 6;
/// Commissions an axis, unattended. Of `base` encoder, amplifier, limits and derivative filter count, not the gains and the
/// friction. `progress` is told the step and the share of the whole.
///
/// # Errors
/// The first step that fails, with the reason and a remedy; the axis is left at rest, its outputs off.
pub fn commission(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    request: &CommissionSettings,
    progress: &mut dyn FnMut(&'static str, f64),
) -> Result<Commissioned, CommissionError> {
    let mut guard = Guard::new(test_axis);
    match guarded(&mut guard, base, request, progress) {
        Ok(found) => Ok(Commissioned {
            ran: guard.runs,
            ..found
        }),
        Err(error) => Err(match guard.ringing() {
            Some(ringing) if !matches!(error, CommissionError::Rings { .. }) => {
                CommissionError::rings(ringing, error)
            }
            _ => error,
        }),
    }
}

fn guarded(
    test_axis: &mut Guard<'_>,
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
    let steps = MotorConstantSettings::default().fitted_to(test_axis.info().first_room_mm());
    let motor = motor_constant::measure(test_axis, &steps, &mut |share| {
        report(step, share);
    })?;

    step += 1;
    let by_friction = |gain_mm_per_v_s2: f64, motor: &MotorConstant| {
        let [ahead_v, back_v] = motor.directed_v;
        gain_mm_per_v_s2 * ahead_v.min(back_v)
    };
    let mut model = |test_axis: &mut Guard<'_>, motor: &MotorConstant, misjudged: f64| {
        test_axis.slowed_by(by_friction(motor.gain_mm_per_v_s2, motor));
        let design = |plant: &PlantFit| models::controller(plant, base, request, motor, rate_hz);
        let guess = MotorConstant {
            gain_mm_per_v_s2: misjudged * motor.gain_mm_per_v_s2,
            ..motor.clone()
        };
        if middle_first(&test_axis.info()).is_some() {
            to_the_middle(test_axis, base, &guess)?;
        }
        let feeds_friction = misjudged != 1.0;
        linear_model(
            test_axis,
            base,
            &guess,
            feeds_friction,
            &design,
            &mut |share| {
                report(step, share);
            },
        )
    };
    let (motor, (response, plant, controller)) = match model(test_axis, &motor, 1.0) {
        Ok(found) => (motor, found),
        Err(first) => {
            // Of an axis that rings, the gentle test may tell the mass better, and so make a better first controller.
            let gentle = motor_constant::measure_gently(test_axis, &steps, &mut |_| {});
            let as_shown = gentle.is_ok().then_some(1.0);
            let motor = gentle.unwrap_or(motor);
            let found = as_shown
                .into_iter()
                .chain(MISJUDGED)
                .find_map(|misjudged| model(test_axis, &motor, misjudged).ok());
            (motor, found.ok_or(first)?)
        }
    };
    test_axis.slowed_by(by_friction(plant.plant.gain_mm_per_v_s2, &motor));

    step += 1;
    let mut settings = base.clone();
    settings.plant = Some(plant.plant);
    controller.put_into(&mut settings);
    settings.friction = models::rough_friction(motor.directed_v, &plant.plant, rate_hz);
    test_axis.apply(&measuring_settings(&settings))?;
    let runs = request.friction.fitted_to(&test_axis.info());
    let (map, recordings, friction) = friction(test_axis, runs, &mut |share| {
        report(step, share);
    })?;

    step += 1;
    let process = models::process(&plant, &controller.filters);
    let quiet = low_bandwidth_settings_on(&settings, &plant.plant, &process, rate_hz);
    let moving = runs.two_sided.then(|| measuring_settings(&settings));
    let (recording, gms) = presliding(test_axis, &friction, &quiet, moving, &mut |share| {
        report(step, share);
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
    let verification = loop {
        match verify(test_axis, &found.settings, &mut |share| report(step, share)) {
            Err(error) if error.asks_for_softer() && softenings < SOFTENINGS => {
                softenings += 1;
                found.soften(&error, rate_hz);
            }
            outcome => break outcome?,
        }
    };
    found.settings = verification.settings(&found.settings);
    found.verification = Some(verification);
    Ok(found)
}

/// Acceleration per volt over what the levels show, where they are quicker than a mode: to the encoder at the motor it moves
/// alone, and one on a table hardly follows.
const MISJUDGED: [f64; 3] = [0.4, 3.0, 9.0];
/// Softer PIDs that are tried where the one that is designed oscillates on the axis, or does not hold it.
const SOFTENINGS: usize = 4;

/// The place to which an axis moves first that stands near an end, mm; none if it stands near enough to the middle.
pub(super) fn middle_first(info: &AxisInfo) -> Option<f64> {
    (info.start_mm.abs() > NEAR_MIDDLE * info.travel_mm).then_some(HOME_MM)
}

/// Share of the travel within which an axis counts as in the middle.
const NEAR_MIDDLE: f64 = 0.1;

/// Moves the axis to the middle of its travel under the first controller, or a softer one where that oscillates.
fn to_the_middle(
    test_axis: &mut Guard<'_>,
    base: &AxisSettings,
    motor: &MotorConstant,
) -> Result<(), CommissionError> {
    let rate_hz = test_axis.info().rate_hz;
    let gain = motor.gain_mm_per_v_s2;
    let mut outcome = Ok(());
    for share in BOOTSTRAP_SHARES {
        let settings = soft_bootstrap_settings(base, gain, rate_hz, share);
        test_axis.apply(&with_rough_friction(settings, gain, motor.directed_v))?;
        outcome = approach(test_axis, HOME_MM);
        if outcome.is_ok() {
            break;
        }
    }
    Ok(outcome?)
}

/// The response of the sliding axis under a first controller, the linear model, and the controller that `design` makes on it. A mode
/// that the first controller excites spoils them: they are repeated with softer ones, as soft as the frequency demands that was seen.
/// `feeds_friction`: friction is fed forward from the first of them on, and not just from where the axis lags by it.
fn linear_model(
    test_axis: &mut Guard<'_>,
    base: &AxisSettings,
    motor: &MotorConstant,
    feeds_friction: bool,
    design: &dyn Fn(&PlantFit) -> Result<Controller, CommissionError>,
    progress: &mut dyn FnMut(f64),
) -> Result<(FrfMeasurement, PlantFit, Controller), CommissionError> {
    let rate_hz = test_axis.info().rate_hz;
    let gain = motor.gain_mm_per_v_s2;
    let is_short = test_axis.info().travel_mm < SHORT_TRAVEL_MM;
    let feeds_at = |share: f64| share < 1.0 || is_short || feeds_friction;
    let attempt = |test_axis: &mut Guard<'_>,
                   share: f64,
                   trim: f64,
                   progress: &mut dyn FnMut(f64)|
     -> Result<(FrfMeasurement, PlantFit, Controller), CommissionError> {
        let mut settings = soft_bootstrap_settings(base, gain, rate_hz, share);
        if feeds_at(share) {
            let friction_v = motor.directed_v.map(|volts| trim * volts);
            settings = with_rough_friction(settings, gain, friction_v);
        }
        test_axis.apply(&settings)?;
        let response = sliding_response(test_axis, gain, progress)?;
        let plant = models::plant(&response)?;
        let controller = design(&plant)?;
        Ok((response, plant, controller))
    };
    let first = match attempt(test_axis, 1.0, 1.0, progress) {
        Ok(found) => return Ok(found),
        Err(error) => error,
    };
    let mut seen = rings(test_axis, &first);
    let (mut share, mut trim, mut trims) = (1.0, 1.0, 0);
    let mut next = next_share(share, &first, seen, is_short);
    let mut trimmed = trimmed(test_axis, &first, seen);
    for _ in 1..ATTEMPTS {
        // The friction that is fed forward is known by its order only: first that, then the controller.
        if let Some(factor) = trimmed
            && trims < TRIMS
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
            Err(error) => {
                let now = rings(test_axis, &error);
                next = next_share(share, &error, now, is_short);
                trimmed = self::trimmed(test_axis, &error, now);
                seen = now.or(seen);
            }
        }
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
/// ahead by less, or one leapt; none after another failure.
fn trimmed(test_axis: &Guard<'_>, error: &CommissionError, rings: Option<Ringing>) -> Option<f64> {
    let stopped = test_axis.interrupted()?;
    if rings.is_some() {
        return None;
    }
    if matches!(error, CommissionError::Response(FrfError::Experiment(error)) if error.ran_off()) {
        return Some(LESS);
    }
    if !is_stuck(error) {
        return None;
    }
    let (first, last) = (stopped.reference_mm.first()?, stopped.reference_mm.last()?);
    let behind_mm = (last - stopped.position_mm.last()?) * (last - first).signum();
    Some(if behind_mm > 0.0 { MORE } else { LESS })
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
        return Some(STIFFER * share).filter(|share| *share <= STIFFEST);
    }
    // A mode is left alone by a loop that is slow enough.
    let bears =
        |share: f64| rings.is_none_or(|seen| share * CROSSOVER_HZ * FAR_BELOW <= seen.frequency_hz);
    let softer: Vec<f64> = BOOTSTRAP_SHARES
        .into_iter()
        .filter(|next| *next < share.min(1.0))
        .collect();
    let bearing = softer.iter().copied().find(|next| bears(*next));
    bearing.or(softer.last().copied())
}

/// True if the tracking error stopped the axis.
fn is_stuck(error: &CommissionError) -> bool {
    matches!(error, CommissionError::Response(FrfError::Experiment(error))
        if error.fault() == Some(FaultCode::FollowingError))
}

/// First controllers that are tried.
const ATTEMPTS: usize = 10;
/// Trims of the friction that is fed forward, for each controller, and their factors.
const TRIMS: usize = 1;
const MORE: f64 = 1.2;
const LESS: f64 = 0.6;
/// Factor on the crossover of one that does not move the axis, and the largest share of the usual crossover.
const STIFFER: f64 = 1.7;
const STIFFEST: f64 = 8.5;
/// Parameters of the response that suit an axis, without its gain.
pub(super) fn response_settings(info: &AxisInfo) -> FrfSettings {
    let mut settings = FrfSettings::default().fitted_to(info.travel_mm);
    let most_mm_s = BIAS_SHARE * info.max_velocity_mm_s;
    settings.bias_velocity_mm_s = settings.bias_velocity_mm_s.min(most_mm_s);
    settings
}

/// Frequency of an oscillation over the crossover of a loop that bears it.
const FAR_BELOW: f64 = 6.0;
/// Share of the largest velocity that the bias of the response takes at most: the excitation comes on top.
const BIAS_SHARE: f64 = 0.4;

/// Friction at constant velocities, at faster ones as long as the axis sticks and slips at the slowest, or is shaken loose there.
fn friction(
    test_axis: &mut dyn TestAxis,
    mut runs: StaticFrictionSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<(FrictionMap, Vec<Recording>, FrictionFit), CommissionError> {
    loop {
        let start_mm = runs.start_mm(test_axis.info().travel_mm);
        approach(test_axis, start_mm).map_err(StaticFrictionError::from)?;
        let (map, recordings) = static_friction::measure(test_axis, &runs, progress)?;
        let (slowest, fastest) = &mut runs.velocities_mm_s;
        match models::even_friction(&map) {
            Err(FrictionFitError::TooFewRuns { .. } | FrictionFitError::Sign { .. })
                if FASTER * *slowest < *fastest / FASTER =>
            {
                *slowest *= FASTER;
            }
            _ => {
                let found = models::friction(&map)?;
                return Ok((map, recordings, found));
            }
        }
    }
}

/// The hysteresis before sliding, and the elements from it. Of an axis that noise or a vibration shakes loose a slow motion meets
/// less friction than it will in use: quicker sines are tried until one meets what sliding did, and the one that meets most counts.
/// The sines run under `quiet`, from the middle of the travel, to which the axis goes under `moving`; from where it stands without.
fn presliding(
    test_axis: &mut dyn TestAxis,
    friction: &FrictionFit,
    quiet: &AxisSettings,
    moving: Option<AxisSettings>,
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
        if let Some(moving) = &moving {
            test_axis.apply(moving)?;
            approach(test_axis, HOME_MM)?;
        }
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
        met(found) >= MET && found.1.as_ref().is_ok_and(fits)
    };
    let mut best = measure(test_axis, &sine, progress)?;
    let most_mm = LARGEST_SINE_SHARE * test_axis.info().travel_mm;
    for _ in 0..REPETITIONS {
        if will_do(&best) {
            break;
        }
        let still_rises = matches!(best.1, Err(VirginCurveError::NoPlateau { .. }));
        if still_rises && sine.amplitude_mm < most_mm {
            sine.amplitude_mm = (LARGER * sine.amplitude_mm).min(most_mm);
        } else {
            sine.frequency_hz *= QUICKER;
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

/// Share of the least level of sliding that a slow sine meets, or less where the axis is shaken loose; error of the elements'
/// prediction from which on it counts as such, too; and further sines: their number, each quicker by a factor, or larger by one while
/// the friction still rises, up to a share of the travel.
const MET: f64 = 0.8;
const POOR_FIT: f64 = 0.2;
const REPETITIONS: usize = 2;
const QUICKER: f64 = 4.0;
const LARGER: f64 = 2.5;
pub(super) const LARGEST_SINE_SHARE: f64 = 0.25;
/// Share of the travel that the slow sine takes at most at first.
const SINE_SHARE: f64 = 0.1;
/// Factor by which the slowest velocity is raised where the axis sticks and slips.
const FASTER: f64 = 3.0;

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
    for _ in 0..HALVINGS {
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
        FrfError::Setting(_) | FrfError::Travel { .. } => false,
    }
}
