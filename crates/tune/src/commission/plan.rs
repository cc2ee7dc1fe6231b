//! What a commissioning will do to an axis, said before anything moves.

use super::chain::LARGEST_SINE_SHARE;
use super::commissioned::CommissionSettings;
use super::guard::FOLLOWING_SHARE;
use super::linear_model::{middle_first, response_settings};
use super::verify;
use crate::identify::motor_constant::MotorConstantSettings;
use crate::identify::virgin_curve::VirginCurveSettings;
use crate::test_axis::{AxisInfo, approach_mm_s, open_loop_mm, usable_mm};

/// One step of a commissioning.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// Its name.
    pub step: &'static str,
    /// Largest distance from the middle of the travel, mm.
    pub within_mm: f64,
    /// Largest velocity of the plan, mm/s; none in open loop.
    pub fastest_mm_s: Option<f64>,
    /// Voltage that the step adds or puts out, in words.
    pub volts: String,
    /// Time, s, as far as it is known beforehand.
    pub lasts_s: f64,
}

/// Largest following error of an axis at any speed while nobody has set another, mm.
const MOST_STRAY_MM: f64 = 10.0;

/// Distance from its plan at which an experiment on an axis ends, mm, whatever its velocity.
pub fn stray_mm(info: &AxisInfo) -> f64 {
    (FOLLOWING_SHARE * info.travel_mm).min(MOST_STRAY_MM)
}

/// Tests of rising voltage until an ordinary axis slides.
const MOTOR_TESTS: f64 = 8.0;

/// The steps of a commissioning on an axis.
pub fn plan(info: &AxisInfo, request: &CommissionSettings) -> Vec<Planned> {
    let used_mm = usable_mm(info.travel_mm);
    let motor = MotorConstantSettings::default().fitted_to(info.first_room_mm());
    let (low_mm, high_mm) = open_loop_mm(info.travel_mm, info.start_mm);
    let mut planned = vec![Planned {
        step: "motor constant, in open loop",
        within_mm: low_mm.abs().max(high_mm.abs()),
        fastest_mm_s: None,
        volts: format!(
            "steps, from {:.2} V upwards until it slides",
            motor.first_level_v
        ),
        lasts_s: MOTOR_TESTS * motor.lasts_s(),
    }];
    if let Some(target_mm) = middle_first(info) {
        let distance_mm = (target_mm - info.start_mm).abs();
        let velocity_mm_s = approach_mm_s(info);
        planned.push(Planned {
            step: "to the middle of the travel",
            within_mm: info.start_mm.abs(),
            fastest_mm_s: Some(velocity_mm_s),
            volts: "the controller's".to_owned(),
            lasts_s: distance_mm / velocity_mm_s,
        });
    }
    let response = response_settings(info);
    let (_, _, lasts_s) = response
        .extent(info.travel_mm, info.rate_hz)
        .unwrap_or_default();
    planned.push(Planned {
        step: "frequency response",
        within_mm: used_mm,
        fastest_mm_s: Some(response.bias_velocity_mm_s),
        volts: format!(
            "{:.2} V RMS at most, {:.0} to {:.0} Hz",
            response.excitation.rms_v, response.excitation.band_hz.0, response.excitation.band_hz.1
        ),
        lasts_s,
    });
    let friction = request.friction.fitted_to(info);
    let lasts_s = friction.lasts_s(info);
    planned.push(Planned {
        step: "friction at constant velocities",
        within_mm: used_mm,
        fastest_mm_s: Some(friction.velocities_mm_s.1),
        volts: "the controller's".to_owned(),
        lasts_s,
    });
    planned.push(Planned {
        step: "pre-sliding friction",
        within_mm: LARGEST_SINE_SHARE * info.travel_mm,
        fastest_mm_s: None,
        volts: "the controller's".to_owned(),
        lasts_s: VirginCurveSettings::default().lasts_s(),
    });
    if request.trials {
        let sines = verify::sines(info);
        let widest_mm = sines.iter().map(|sine| sine.amplitude_mm);
        let fastest = sines.iter().map(|sine| sine.velocity_mm_s);
        planned.push(Planned {
            step: "trials",
            within_mm: widest_mm.fold(0.0, f64::max),
            fastest_mm_s: Some(fastest.fold(0.0, f64::max)),
            volts: "the laws'".to_owned(),
            lasts_s: verify::lasts_s(info),
        });
    }
    planned
}
