//! What a commissioning will do to an axis, said before anything moves.

use super::chain::LARGEST_SINE_SHARE;
use super::commissioned::CommissionSettings;
use super::guard::FOLLOWING_SHARE;
use super::linear_model::{middle_first, response_settings};
use super::verify;
use crate::identify::motor_constant::MotorConstantSettings;
use crate::identify::virgin_curve::VirginCurveSettings;
use crate::machine::{AxisInfo, approach_mm_s, open_loop_mm, usable_mm};
use crate::report::{Cell, Column, Table};

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
    let (_, lasts_s) = friction.extent();
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
            lasts_s: verify::lasts_s(&sines),
        });
    }
    planned
}

/// The plan for a person, with what keeps the axis within its travel and how accurate the result can be.
pub fn plan_table(info: &AxisInfo, planned: &[Planned]) -> Table {
    let total_s: f64 = planned.iter().map(|step| step.lasts_s).sum();
    let stray_mm = FOLLOWING_SHARE * info.travel_mm;
    let beside = if info.start_mm == 0.0 {
        String::new()
    } else {
        format!(
            " of the middle of its travel, {:.1} mm beside which it stands",
            info.start_mm.abs()
        )
    };
    Table {
        id: "plan".to_owned(),
        caption: format!(
            "What the {} axis will do: about {:.0} min of axis time, within {:.1} mm either way{beside}. An experiment ends when \
             the axis is {:.1} mm beside its plan, or too fast to stop in time; it is then repeated more gently, which adds to the \
             time. Positions are known to a count of {} um: errors of two counts are the least that the encoder resolves",
            info.name,
            total_s / 60.0,
            info.travel_mm,
            stray_mm.min(10.0),
            1e3 * info.resolution_mm,
        ),
        columns: vec![
            Column::new("Step"),
            Column::new("within, mm"),
            Column::new("up to, mm/s"),
            Column::new("Voltage"),
            Column::new("Time, s"),
        ],
        rows: planned
            .iter()
            .map(|step| {
                vec![
                    Cell::text(step.step),
                    Cell::number(step.within_mm, 1),
                    step.fastest_mm_s
                        .map_or(Cell::Missing, |fastest| Cell::number(fastest, 1)),
                    Cell::text(&step.volts),
                    Cell::number(step.lasts_s, 0),
                ]
            })
            .collect(),
    }
}
