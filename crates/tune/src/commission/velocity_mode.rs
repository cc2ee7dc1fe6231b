//! Recognition of an amplifier in velocity mode.
//!
//! Behind an amplifier's own velocity loop an axis is an integrator with a lag: `x'' = A u - B x'`, in which 1/B is the lag and A/B the
//! velocity for a volt. A motor under a force obeys the same equation with friction added: at a constant velocity v its voltage exceeds
//! v B/A by the friction. A velocity loop takes friction up by its integral, and nothing exceeds v B/A.

use quadrant_law::control::plant_model::PlantModel;

use super::error::CommissionError;
use crate::identify::frf::FrfMeasurement;
use crate::record::Recording;

/// Share of friction in the voltage at constant velocity below which the amplifier is in velocity mode: the campaign's random axes have
/// 0.5 or more, and simulated velocity loops less than 0.07.
const LEAST_FRICTION_SHARE: f64 = 0.15;
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
