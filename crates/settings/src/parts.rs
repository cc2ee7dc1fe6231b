//! The parts of an axis' settings that may be left out, and their values when they are made.

use heapless::Vec;

use super::axis::AxisSettings;
use super::homing::{HomeSwitch, HomingSettings};
use super::leaves::default;
use super::limits::TravelSettings;
use super::pulses::PulseSettings;
use super::serial_encoder::SerialSettings;
use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::control::cascade::CascadeGains;
use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::nctf::{CharacteristicPoint, NctfGains};
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::control::schedule::SchedulePoint;
use quadrant_law::control::sliding_mode::SlidingModeGains;
use quadrant_law::friction::Direction;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_law::learning::LearningSettings;

/// A part of an axis that may be left out.
pub struct Part {
    /// Its path below the axis.
    pub path: &'static str,
    /// True if an axis has it.
    pub is_present: fn(&AxisSettings) -> bool,
    /// Makes it with its default values. Those that must be given are not valid before they are.
    pub make: fn(&mut AxisSettings),
    /// Removes it.
    pub remove: fn(&mut AxisSettings),
}

macro_rules! part {
    ($path:literal, $($field:ident).+, $made:expr) => {
        Part {
            path: $path,
            is_present: |axis| axis.$($field).+.is_some(),
            make: |axis| axis.$($field).+ = Some($made),
            remove: |axis| axis.$($field).+ = None,
        }
    };
}

/// Every part that may be left out.
pub static PARTS: [Part; 18] = [
    part!(
        "/encoder/counts_per_index",
        encoder.counts_per_index,
        default!("encoder.counts_per_index") as u32
    ),
    part!(
        "/encoder/offset_mm",
        encoder.offset_mm,
        default!("encoder.offset_mm")
    ),
    part!("/encoder/serial", encoder.serial, SerialSettings::default()),
    part!(
        "/feedback/nonlinear",
        feedback.nonlinear,
        NonlinearGain {
            rate_per_mm: default!("feedback.nonlinear.rate_per_mm"),
            range_mm: default!("feedback.nonlinear.range_mm"),
        }
    ),
    part!(
        "/feedback/schedule",
        feedback.schedule,
        Vec::from_iter([SchedulePoint {
            speed_mm_s: default!("feedback.schedule.speed_mm_s"),
            proportional: default!("feedback.schedule.proportional"),
            integral: default!("feedback.schedule.integral"),
            derivative: default!("feedback.schedule.derivative"),
        }])
    ),
    part!(
        "/feedback/cascade",
        feedback.cascade,
        CascadeGains {
            position_gain_per_s: default!("feedback.cascade.position_gain_per_s"),
            velocity_gain_v_s_per_mm: default!("feedback.cascade.velocity_gain_v_s_per_mm"),
            velocity_integral_per_s: default!("feedback.cascade.velocity_integral_per_s"),
            velocity_feedforward: default!("feedback.cascade.velocity_feedforward"),
            velocity_limit_mm_s: default!("feedback.cascade.velocity_limit_mm_s"),
        }
    ),
    part!(
        "/feedback/sliding_mode",
        feedback.sliding_mode,
        SlidingModeGains {
            slope_per_s: default!("feedback.sliding_mode.slope_per_s"),
            switching_v: default!("feedback.sliding_mode.switching_v"),
            boundary_mm_s: default!("feedback.sliding_mode.boundary_mm_s"),
            integral_per_s: default!("feedback.sliding_mode.integral_per_s"),
        }
    ),
    part!(
        "/feedback/nctf",
        feedback.nctf,
        NctfGains {
            characteristic: Vec::from_iter([CharacteristicPoint {
                error_mm: default!("feedback.nctf.characteristic.error_mm"),
                velocity_mm_s: default!("feedback.nctf.characteristic.velocity_mm_s"),
            }]),
            gain_v_s_per_mm: default!("feedback.nctf.gain_v_s_per_mm"),
            integral_per_s: default!("feedback.nctf.integral_per_s"),
        }
    ),
    part!(
        "/feedback/filters",
        feedback.filters,
        Vec::from_iter([FilterSettings {
            frequency_hz: default!("feedback.filters.frequency_hz"),
            damping: default!("feedback.filters.damping"),
            centre_gain: default!("feedback.filters.centre_gain"),
            high_frequency_gain: default!("feedback.filters.high_frequency_gain"),
        }])
    ),
    part!(
        "/friction/dahl",
        friction.dahl,
        DahlParameters {
            stiffness_v_per_mm: default!("friction.dahl.stiffness_v_per_mm"),
            exponent: default!("friction.dahl.exponent"),
        }
    ),
    part!(
        "/friction/lugre",
        friction.lugre,
        LugreParameters {
            stiffness_v_per_mm: default!("friction.lugre.stiffness_v_per_mm"),
            damping_v_s_per_mm: default!("friction.lugre.damping_v_s_per_mm"),
        }
    ),
    part!(
        "/feedforward/learning",
        feedforward.learning,
        LearningSettings::default()
    ),
    part!(
        "/feedforward/cancelling",
        feedforward.cancelling,
        CancellingSettings::default()
    ),
    part!(
        "/limits/travel_mm",
        limits.travel_mm,
        TravelSettings {
            negative: default!("limits.travel_mm.negative"),
            positive: default!("limits.travel_mm.positive"),
        }
    ),
    part!(
        "/limits/unhomed_mm_s",
        limits.unhomed_mm_s,
        default!("limits.unhomed_mm_s")
    ),
    part!(
        "/homing",
        homing,
        HomingSettings {
            direction: Direction::Negative,
            switch: HomeSwitch::Home,
            search_mm_s: default!("homing.search_mm_s"),
            latch_mm_s: default!("homing.latch_mm_s"),
            debounce_s: default!("homing.debounce_s"),
            index: false,
            mark_mm: default!("homing.mark_mm"),
            park_mm: default!("homing.park_mm"),
            travel_mm: default!("homing.travel_mm"),
        }
    ),
    part!("/pulses", pulses, PulseSettings::default()),
    part!(
        "/plant",
        plant,
        PlantModel {
            gain_mm_per_v_s2: default!("plant.gain_mm_per_v_s2"),
            damping_per_s: default!("plant.damping_per_s"),
            stiffness_per_s2: default!("plant.stiffness_per_s2"),
            delay_s: default!("plant.delay_s"),
        }
    ),
];

/// The part with exactly this path below an axis.
pub fn part_below_axis(path: &str) -> Option<&'static Part> {
    PARTS.iter().find(|part| part.path == path)
}

/// The part that may be left out in which a leaf below an axis is, or which it is.
pub fn part_of(below: &str) -> Option<&'static Part> {
    PARTS.iter().find(|part| {
        below
            .strip_prefix(part.path)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    })
}
