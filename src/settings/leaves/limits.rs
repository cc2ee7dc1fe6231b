//! The leaves of what an axis may do, and of how it is homed.

use strum::VariantNames;

use super::{Bound, LeafInfo, Range, at, leaves};
use crate::law::friction::Direction;
use crate::settings::{HomeSwitch, StageSettings};

fn resolution_mm(settings: &StageSettings, axis: usize) -> f64 {
    settings.axes[axis].encoder.resolution_mm
}

/// Half of what half the encoder's counter holds, or 4096 counts, a tick.
fn fastest_mm_s(settings: &StageSettings, axis: usize) -> f64 {
    let quarter = libm::scalbn(0.25, settings.axes[axis].encoder.counter_bits.into());
    let fastest = quarter.min(4096.0) * resolution_mm(settings, axis) * settings.rate_hz;
    fastest.min(1e3)
}

fn most_acceleration_mm_s2(settings: &StageSettings, axis: usize) -> f64 {
    let most = 256.0 * resolution_mm(settings, axis) * settings.rate_hz * settings.rate_hz;
    most.min(3e4)
}

fn most_following_error_mm(settings: &StageSettings, axis: usize) -> f64 {
    (8_388_608.0 * resolution_mm(settings, axis)).min(20.0)
}

fn least_positive_mm(settings: &StageSettings, axis: usize) -> f64 {
    let travel = settings.axes[axis].limits.travel_mm;
    travel.map_or(-1e4, |travel| travel.negative) + resolution_mm(settings, axis)
}

fn search_mm_s(settings: &StageSettings, axis: usize) -> f64 {
    let homing = settings.axes[axis].homing.as_ref();
    homing.map_or(1e3, |homing| homing.search_mm_s)
}

pub(super) const LEAVES: &[LeafInfo] = leaves! {
    "/axes/*/limits/max_velocity_mm_s" "mm/s" Range::Number(
        at(1e-3),
        Bound::Of("1000, and what the encoder's counter can follow", fastest_mm_s)
    );
    "Largest velocity of any reference; at twice this the encoder counts as faulty."
    "/axes/*/limits/max_acceleration_mm_s2" "mm/s²" Range::Number(
        at(1e-3),
        Bound::Of("30 000, and 256 counts per tick²", most_acceleration_mm_s2)
    );
    "Largest acceleration of any reference."
    "/axes/*/limits/max_jerk_mm_s3" "mm/s³" Range::Number(at(1.0), at(1e9));
    "Jerk of jogs, moves and homing."
    "/axes/*/limits/following_error_mm" "mm" Range::Number(
        Bound::Of("one count", resolution_mm),
        Bound::Of("20, and 2²³ counts", most_following_error_mm)
    );
    "Largest tracking error while the reference stands; beyond it the stage is switched off."

    "/axes/*/limits/following_error_lag_s" "s" Range::Number(at(0.0), at(1.0));
    "What the largest tracking error grows by with the reference's speed, mm per mm/s."
    "/axes/*/limits/following_error_max_mm" "mm" Range::Number(
        Bound::Of("that at rest", |s, axis| s.axes[axis].limits.following_error_mm),
        Bound::Of("20, and 2²³ counts", most_following_error_mm)
    );
    "The most that it grows to."
    "/axes/*/limits/overspeed_ratio" "" Range::Number(at(1.05), at(2.0));
    "Measured speed that is a fault, as a multiple of the largest velocity."
    "/axes/*/limits/braking_mm_s2" "mm/s²" Range::Number(
        at(1e-3),
        Bound::Of("30 000, and 256 counts per tick²", most_acceleration_mm_s2)
    );
    "Deceleration of a stop after a fault; above the largest acceleration."
    "/axes/*/limits/braking_jerk_mm_s3" "mm/s³" Range::Number(at(1.0), at(1e9));
    "Jerk of that stop."
    "/axes/*/limits/silent_s" "s" Range::Number(
        Bound::Of("one control period", |s, _| 1.0 / s.rate_hz),
        at(10.0)
    );
    "How long the encoder may show no motion while the output is high."
    "/axes/*/limits/silent_share" "" Range::Number(at(0.01), at(1.0));
    "From which output on that is, as a share of the output limit."
    "/axes/*/limits/travel_mm/negative" "mm" Range::Number(at(-1e4), at(1e4));
    "The smallest position of a homed axis."
    "/axes/*/limits/travel_mm/positive" "mm" Range::Number(
        Bound::Of("the smallest and one count", least_positive_mm),
        at(1e4)
    );
    "The largest position of a homed axis."

    "/axes/*/homing/direction" "" Range::Name(Direction::VARIANTS);
    "Towards which end the switch is searched."
    "/axes/*/homing/switch" "" Range::Name(HomeSwitch::VARIANTS);
    "Which switch that is."
    "/axes/*/homing/search_mm_s" "mm/s" Range::Number(at(1e-3), at(1e3));
    "Velocity of the search and of the move to the parking position; held to the axis' largest."
    "/axes/*/homing/latch_mm_s" "mm/s" Range::Number(
        at(1e-3),
        Bound::Of("that of the search", search_mm_s)
    );
    "Velocity away from the switch, over its edge and to the index pulse."
    "/axes/*/homing/debounce_s" "s" Range::Number(at(0.0), at(0.1));
    "For how long the switch may bounce; it also delays what it says."
    "/axes/*/homing/index" "" Range::Flag;
    "The mark is the first index pulse after the switch; else the switch's edge is. Needs the encoder's index spacing."
    "/axes/*/homing/mark_mm" "mm" Range::Number(at(-1e4), at(1e4));
    "Position of the mark, rounded to a whole count."
    "/axes/*/homing/park_mm" "mm" Range::Number(at(-1e4), at(1e4));
    "Where the axis goes in the end; held to the travel."
    "/axes/*/homing/travel_mm" "mm" Range::Number(
        Bound::Of("one count", resolution_mm),
        at(2e4)
    );
    "How far the axis goes for the switch, and off it, before homing fails."
};
