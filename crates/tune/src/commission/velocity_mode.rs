//! Recognition of an amplifier in velocity mode.
//!
//! Behind an amplifier's own velocity loop an axis is an integrator with a lag: `x'' = A u - B x'`, in which 1/B is the lag and A/B the
//! velocity for a volt. A motor under a force obeys the same equation with friction added: at a constant velocity v its voltage exceeds
//! v B/A by the friction. A velocity loop takes friction up by its integral, and nothing exceeds v B/A. Where no response can be
//! measured, two constant voltages in open loop show it: twice the voltage gives twice the velocity.

use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::AxisSettings;

use super::bootstrap::zero_gain_settings;
use super::error::CommissionError;
use super::guard::Guard;
use crate::identify::frf::FrfMeasurement;
use crate::identify::motor_constant::MotorConstant;
use crate::record::Recording;
use crate::test_axis::{Drive, Experiment, TestAxis};

/// Share of friction in the voltage at constant velocity below which the amplifier is in velocity mode: the campaign's random axes have
/// 0.5 or more, and simulated velocity loops 0.15 or less.
const LEAST_FRICTION_SHARE: f64 = 0.3;
/// Least damping of a velocity loop, 1/s: a lag of 20 ms.
const LEAST_DAMPING_PER_S: f64 = 50.0;

/// Refuses an axis behind a velocity loop, of which the response was measured at constant velocity.
///
/// # Errors
/// An amplifier in velocity mode.
pub(super) fn refuse(plant: &PlantModel, response: &FrfMeasurement) -> Result<(), CommissionError> {
    let velocity_mm_s_per_v = velocity_per_volt(&response.recordings);
    let modelled_mm_s_per_v = plant.gain_mm_per_v_s2 / plant.damping_per_s;
    let friction_share = 1.0 - velocity_mm_s_per_v / modelled_mm_s_per_v;
    if plant.damping_per_s > LEAST_DAMPING_PER_S && friction_share < LEAST_FRICTION_SHARE {
        return Err(CommissionError::VelocityMode {
            velocity_mm_s_per_v,
            lag_ms: 1e3 / plant.damping_per_s,
        });
    }
    Ok(())
}

/// The error of an axis on which no linear model was found: that of an amplifier in velocity mode where open loop shows one, else `error`.
pub(super) fn explain(
    test_axis: &mut Guard<'_>,
    base: &AxisSettings,
    motor: &MotorConstant,
    error: CommissionError,
) -> CommissionError {
    let stands_mm = test_axis
        .interrupted()
        .and_then(|stopped| stopped.position_mm.last().copied());
    if error.is_interrupted() || test_axis.apply(&zero_gain_settings(base)).is_err() {
        return error;
    }
    let level_v = motor
        .level_v
        .min(MOST_SHARE * base.amplifier.output_limit_v);
    let inwards_v = -level_v * stands_mm.unwrap_or_default().signum();
    let shown = test_axis.perform(&holds(inwards_v, test_axis.info().rate_hz), &mut |_| {});
    // A force gathers too much speed, and is stopped.
    let shown = shown.ok().and_then(|recording| Holds::of(&recording));
    shown
        .and_then(|holds| holds.velocity_mode())
        .unwrap_or(error)
}

/// Largest lower voltage over the output limit.
const MOST_SHARE: f64 = 0.25;
/// Time of a hold, and at rest after it, s: the velocity follows for five times a lag of 20 ms, and is measured in the last quarter.
const HOLD_S: f64 = 0.15;
const REST_S: f64 = 0.1;
/// Ratio of the velocities at twice the voltage below which friction takes next to none of it: 2.1 where it takes a twelfth of the
/// lower.
const MOST_RATIO: f64 = 2.1;
const LEAST_RATIO: f64 = 1.9;

/// Voltages held in open loop: one, back, its double, and back.
fn holds(level_v: f64, rate_hz: f64) -> Experiment {
    let samples = |time_s: f64| (time_s * rate_hz) as usize;
    let held = [1.0, -1.0, 2.0, -2.0].into_iter().flat_map(|factor| {
        std::iter::repeat_n(factor * level_v, samples(HOLD_S))
            .chain(std::iter::repeat_n(0.0, samples(REST_S)))
    });
    Experiment {
        name: format!("{:.3} V and its double", level_v.abs()),
        drive: Drive::OpenLoop,
        injection_v: held.collect(),
        decimation: 1,
        time_limit_s: 10.0,
    }
}

/// Velocities that were reached at a voltage and at its double, as differences of the directions: an offset drops out.
struct Holds {
    level_v: f64,
    velocity_mm_s: f64,
    doubled_mm_s: f64,
    /// Time by which the way is behind the velocity, s: of the difference of both, in which the way that friction costs drops out.
    lag_s: f64,
}

impl Holds {
    fn of(recording: &Recording) -> Option<Self> {
        let dt_s = recording.sample_time_s;
        let [hold, whole] = [HOLD_S, HOLD_S + REST_S].map(|time_s| (time_s / dt_s) as usize);
        let position_mm = &recording.position_mm;
        // Velocity in the last quarter, and way, of each hold.
        let of = |index: usize| {
            let first = index * whole;
            let (late, last) = (first + hold * 3 / 4, first + hold - 1);
            let way_mm = position_mm.get(last)? - position_mm[first];
            let time_s = (last - late) as f64 * dt_s;
            Some(((position_mm[last] - position_mm[late]) / time_s, way_mm))
        };
        let both = |ahead: usize| {
            let (ahead, back) = (of(ahead)?, of(ahead + 1)?);
            Some((0.5 * (ahead.0 - back.0), 0.5 * (ahead.1 - back.1)))
        };
        let (velocity_mm_s, way_mm) = both(0)?;
        let (doubled_mm_s, doubled_way_mm) = both(2)?;
        Some(Self {
            level_v: *recording.voltage_v.get(hold / 2)?,
            velocity_mm_s,
            doubled_mm_s,
            lag_s: HOLD_S - (doubled_way_mm - way_mm) / (doubled_mm_s - velocity_mm_s),
        })
    }

    /// The error of a velocity loop, if these velocities are those of one.
    fn velocity_mode(&self) -> Option<CommissionError> {
        let ratio = self.doubled_mm_s / self.velocity_mm_s;
        let follows = self.lag_s * LEAST_DAMPING_PER_S < 1.0;
        (follows && (LEAST_RATIO..MOST_RATIO).contains(&ratio)).then(|| {
            CommissionError::VelocityMode {
                velocity_mm_s_per_v: 0.5 * self.doubled_mm_s / self.level_v,
                lag_ms: 1e3 * self.lag_s,
            }
        })
    }
}

/// Velocity over voltage at constant velocity, mm/(V s); not a number without passes both ways.
fn velocity_per_volt(passes: &[Recording]) -> f64 {
    // The difference of the directions: an offset, and what hangs, drop out.
    let (ahead, back) = (mean(passes, 1.0), mean(passes, -1.0));
    (ahead.0 - back.0) / (ahead.1 - back.1)
}

/// Mean velocity, mm/s, and voltage of the passes in a direction, 1 or -1.
fn mean(passes: &[Recording], direction: f64) -> (f64, f64) {
    let (mut velocity, mut volts, mut count) = (0.0, 0.0, 0.0);
    for (v, u) in passes.iter().filter_map(steady) {
        if direction * v > 0.0 {
            velocity += v;
            volts += u;
            count += 1.0;
        }
    }
    (velocity / count, volts / count)
}

/// Velocity, mm/s, and mean voltage of the middle half of a pass.
fn steady(pass: &Recording) -> Option<(f64, f64)> {
    let (first, last) = (pass.len() / 4, 3 * pass.len() / 4);
    let volts = pass.voltage_v.get(first..last).filter(|v| !v.is_empty())?;
    let count = volts.len() as f64;
    let way_mm = pass.position_mm[last] - pass.position_mm[first];
    let velocity_mm_s = way_mm / (count * pass.sample_time_s);
    Some((velocity_mm_s, volts.iter().sum::<f64>() / count))
}
