//! The leaves of an axis' limits and of its homing.

use strum::VariantNames;

use super::row::{
    Exchange, LeafInfo, UNSET, at, at_most, exchanged, flag, name, number, period_s, times,
};
use crate::axis::AxisSettings;
use crate::homing::HomeSwitch;
use quadrant_law::friction::Direction;
use quadrant_law::units::FASTEST_MM_S;

/// The longest travel of an axis and of a motion, mm.
pub(crate) const LONGEST_TRAVEL_MM: f64 = 1e4;
/// The largest acceleration that an axis may be allowed, mm/s^2.
pub(crate) const MOST_ACCELERATION_MM_S2: f64 = 3e4;
/// The largest jerk that an axis may be allowed, mm/s^3.
pub(crate) const MOST_JERK_MM_S3: f64 = 1e9;
/// The fastest reference, in counts per tick: what the formats of the moves' velocity and of the displacement hold.
const MOST_COUNTS_PER_TICK: f64 = 4096.0;
/// The largest acceleration of a reference, in counts per tick squared: what the format of the moves' holds.
const MOST_COUNTS_PER_TICK_SQUARED: f64 = 256.0;
/// The largest limit of the tracking error, in counts: half of where the error saturates.
const MOST_ERROR_COUNTS: f64 = 8_388_608.0;

fn resolution_mm(axis: &AxisSettings, _: f64) -> f64 {
    axis.encoder.resolution_mm
}

/// The encoder may move twice as far in a tick, within half of its counter's range, or its direction is lost.
fn fastest_mm_s(axis: &AxisSettings, period_s: f64) -> f64 {
    let half_range = libm::scalbn(0.5, axis.encoder.counter_bits.into());
    (0.5 * half_range).min(MOST_COUNTS_PER_TICK) * axis.encoder.resolution_mm / period_s
}

fn most_acceleration_mm_s2(axis: &AxisSettings, period_s: f64) -> f64 {
    MOST_COUNTS_PER_TICK_SQUARED * axis.encoder.resolution_mm / (period_s * period_s)
}

/// The longest that braking from the largest velocity, or building it up, may take, s.
const LONGEST_BRAKING_S: f64 = 1.0;

fn least_braking_mm_s2(axis: &AxisSettings, _: f64) -> f64 {
    let limits = &axis.limits;
    limits
        .max_acceleration_mm_s2
        .max(limits.max_velocity_mm_s / LONGEST_BRAKING_S)
}

fn least_braking_jerk_mm_s3(axis: &AxisSettings, _: f64) -> f64 {
    (axis.limits.braking_mm_s2 / LONGEST_BRAKING_S).max(1.0)
}

fn most_error_mm(axis: &AxisSettings, _: f64) -> f64 {
    MOST_ERROR_COUNTS * axis.encoder.resolution_mm
}

fn least_positive_mm(axis: &AxisSettings, _: f64) -> f64 {
    let negative = axis.limits.travel_mm.as_ref().map(|travel| travel.negative);
    negative.unwrap_or(f64::NEG_INFINITY) + axis.encoder.resolution_mm
}

fn search_mm_s(axis: &AxisSettings, _: f64) -> f64 {
    let homing = axis.homing.as_ref();
    homing.map_or(f64::INFINITY, |homing| homing.search_mm_s)
}

#[rustfmt::skip]
pub(super) const LEAVES: &[LeafInfo] = &exchanged(Exchange::Disabled, [
    number("limits.max_velocity_mm_s", "mm/s",
        at(1e-3), at_most(FASTEST_MM_S, "what the encoder's counter can follow", fastest_mm_s), 50.0,
        "Largest velocity of any reference; at twice this the encoder counts as faulty."),
    number("limits.max_acceleration_mm_s2", "mm/s²",
        at(1e-3), at_most(MOST_ACCELERATION_MM_S2, "256 counts per tick²", most_acceleration_mm_s2), 500.0,
        "Largest acceleration of any reference."),
    number("limits.max_jerk_mm_s3", "mm/s³", at(1.0), at(MOST_JERK_MM_S3), 1e5,
        "Jerk of jogs, moves and homing."),
    number("limits.following_error_mm", "mm",
        times(1.0, "one count", resolution_mm), at_most(20.0, "2²³ counts", most_error_mm), 1.0,
        "Largest tracking error while the reference stands; beyond it the stage is switched off."),
    number("limits.following_error_lag_s", "s", at(0.0), at(1.0), 0.0,
        "Growth of the largest tracking error with the speed of the reference, mm per mm/s."),
    number("limits.following_error_max_mm", "mm",
        times(1.0, "that at rest", |axis, _| axis.limits.following_error_mm), at_most(20.0, "2²³ counts", most_error_mm), 20.0,
        "Upper bound of the largest tracking error, at any speed."),
    number("limits.overspeed_ratio", "", at(1.05), at(2.0), 1.2,
        "Measured speed that is a fault, as a multiple of the largest velocity."),
    number("limits.braking_mm_s2", "mm/s²",
        times(1.0, "the largest acceleration, and what ends the largest velocity in a second", least_braking_mm_s2),
        at_most(MOST_ACCELERATION_MM_S2, "256 counts per tick²", most_acceleration_mm_s2), 4000.0,
        "Deceleration of a stop after a fault."),
    number("limits.braking_jerk_mm_s3", "mm/s³",
        times(1.0, "what builds the braking up in a second", least_braking_jerk_mm_s3), at(MOST_JERK_MM_S3), 1e6,
        "Jerk of that stop."),
    number("limits.silent_s", "s", times(1.0, "the control period", period_s), at(10.0), 0.1,
        "Longest time without encoder motion while the output is above the share below; then the encoder counts as faulty."),
    number("limits.silent_share", "", at(0.01), at(1.0), 0.9,
        "Output, as a share of the output limit, above which the encoder must show motion."),
    number("limits.travel_mm.negative", "mm", at(-LONGEST_TRAVEL_MM), at(LONGEST_TRAVEL_MM), 0.0,
        "The smallest position of a homed axis."),
    number("limits.travel_mm.positive", "mm",
        times(1.0, "the smallest and one count", least_positive_mm), at(LONGEST_TRAVEL_MM), UNSET,
        "The largest position of a homed axis."),
    number("limits.unhomed_mm_s", "mm/s",
        at(1e-3), times(1.0, "the largest velocity", |axis, _| axis.limits.max_velocity_mm_s), 10.0,
        "Largest velocity until the axis is homed; nothing but jogs and homing starts until then. Left out: it moves as a homed one."),
    name("homing.direction", Direction::VARIANTS,
        "End of the travel towards which the switch is searched."),
    name("homing.switch", HomeSwitch::VARIANTS,
        "Switch that is searched: the home switch, or the limit switch at that end."),
    number("homing.search_mm_s", "mm/s", at(1e-3), at(FASTEST_MM_S), 10.0,
        "Velocity of the search and of the move after it; held to the axis' largest."),
    number("homing.latch_mm_s", "mm/s", at(1e-3), times(1.0, "that of the search", search_mm_s), 1.0,
        "Creep velocity: off the switch, over its edge and to the index pulse."),
    number("homing.debounce_s", "s", at(0.0), at(0.1), 5e-4,
        "Longest bounce of the switch; its reading is delayed by as much."),
    flag("homing.index",
        "True if the reference mark is the first index pulse after the switch, false if it is the switch's edge. Needs the encoder's index spacing."),
    number("homing.mark_mm", "mm", at(-LONGEST_TRAVEL_MM), at(LONGEST_TRAVEL_MM), 0.0,
        "Position of the reference mark, rounded to a whole count."),
    number("homing.park_mm", "mm", at(-LONGEST_TRAVEL_MM), at(LONGEST_TRAVEL_MM), 0.0,
        "Position to which the axis moves in the end; held to the travel."),
    number("homing.travel_mm", "mm", times(1.0, "one count", resolution_mm), at(2.0 * LONGEST_TRAVEL_MM), UNSET,
        "Longest way to the switch, and off it, before homing fails."),
]);
