//! The stage's own leaves, and those of an axis' edges and plant.

use strum::VariantNames;

use super::row::{Exchange, LeafInfo, UNSET, at, exchanged, flag, name, number, of_stage, times};
use crate::axis::AxisSettings;
use crate::operation::{EmergencyReaction, LossReaction};
use crate::serial_encoder::{CheckBit, SerialProtocol};
use quadrant_law::safety::{EnabledBy, HostNeeded};

pub(super) fn full_scale_v(axis: &AxisSettings, _: f64) -> f64 {
    axis.amplifier.full_scale_v
}

/// Without an index, the tolerance is not used.
fn most_index_tolerance(axis: &AxisSettings, _: f64) -> f64 {
    axis.encoder
        .counts_per_index
        .map_or(f64::INFINITY, |counts| f64::from(counts / 4))
}

/// A frame and the encoder's rest fit into a control period at half of this clock, which the board may take, down to its slowest.
fn least_clock_hz(axis: &AxisSettings, period_s: f64) -> f64 {
    let encoder = &axis.encoder;
    let serial = encoder.serial.unwrap_or_default();
    let bits = 8 * serial.frame_bytes(encoder.counter_bits);
    (2.0 * bits as f64 / (FRAME_SHARE * period_s)).max(SLOWEST_SPI_HZ)
}

/// Slowest clock that every board has, Hz: an SPI's of 48 MHz through its largest divider.
const SLOWEST_SPI_HZ: f64 = 187_500.0;

/// Share of the control period in which a frame is shifted.
const FRAME_SHARE: f64 = 0.7;

#[rustfmt::skip]
pub(super) const OF_STAGE: &[LeafInfo] = &[
    RATE,
    OPERATION[0],
    OPERATION[1],
    OPERATION[2],
    BRAKE[0],
    BRAKE[1],
    STREAMING[0],
    STREAMING[1],
];

#[rustfmt::skip]
const RATE: LeafInfo = LeafInfo {
    exchange: Exchange::Restart,
    ..of_stage(number("rate_hz", "Hz", at(1e3), at(1e5), 10e3,
        "Control rate. Changes with a restart."))
};

#[rustfmt::skip]
const OPERATION: [LeafInfo; 3] = exchanged(Exchange::Disabled, [
    of_stage(name("operation.enabled_by", EnabledBy::VARIANTS,
        "Who may enable: any, host, or operator (the button is an enabling device: axes move only while it is held). \
         Everybody may stop and disable.")),
    of_stage(name("operation.host_needed", HostNeeded::VARIANTS,
        "Motions of a host that end when it falls silent: every-motion, or endless-motion (jogs, plans without an end, \
         streams).")),
    of_stage(name("operation.emergency_stop", EmergencyReaction::VARIANTS,
        "Reaction to the emergency stop: off (category 0) or stop (category 1: brake, then off; the hardware must cut the \
         power later).")),
]);

#[rustfmt::skip]
const BRAKE: [LeafInfo; 2] = exchanged(Exchange::Disabled, [
    of_stage(number("brake.release_s", "s", at(0.0), at(2.0), 0.0,
        "Time from the current of the holding brake to a brake that does not hold; no motion starts before.")),
    of_stage(number("brake.apply_s", "s", at(0.0), at(2.0), 0.0,
        "Time from the end of the brake's current to a brake that holds; until then the law holds the axes.")),
]);

#[rustfmt::skip]
const STREAMING: [LeafInfo; 2] = exchanged(Exchange::Disabled, [
    of_stage(name("streaming.link_lost", LossReaction::VARIANTS,
        "Reaction when the host of a motion falls silent: stop (brake, switch off, latch a fault) or hold (brake and hold).")),
    of_stage(name("streaming.underrun", LossReaction::VARIANTS,
        "Reaction when the next set point is late: stop or hold.")),
]);

#[rustfmt::skip]
pub(super) const ENCODER: &[LeafInfo] = &exchanged(Exchange::Restart, [
    number("encoder.resolution_mm", "mm", at(1e-6), at(1.0), 5e-4,
        "Length of one count of the encoder. Changes with a restart, as all of the encoder."),
    number("encoder.counter_bits", "bit", at(8.0), at(32.0), 32.0,
        "Width of the hardware counter, or of a serial encoder's position."),
    flag("encoder.reversed",
        "True if the counter runs backwards when the axis moves to larger positions."),
    number("encoder.counts_per_index", "counts", at(16.0), at(1e9), UNSET,
        "Counts between neighbouring index pulses; left out: the encoder has no index, or its spacing is not known."),
    number("encoder.index_tolerance_counts", "counts",
        at(0.0), times(1.0, "a quarter of the index spacing", most_index_tolerance), 4.0,
        "Distance, either way, by which an index pulse may miss its place."),
    number("encoder.offset_mm", "mm", at(-1e5), at(1e5), 0.0,
        "Position that a serial encoder shows where the axis is at zero: it is homed from the start. Left out: it is homed by switch."),
    name("encoder.serial.protocol", SerialProtocol::VARIANTS,
        "Protocol of a serial encoder in the place of A, B and index; left out with its part, there is none."),
    number("encoder.serial.clock_hz", "Hz",
        times(1.0, "what shifts a frame twice in 70 % of the control period, and 187 500", least_clock_hz), at(1e7), 3e6,
        "Largest clock of the serial encoder and its cable; the board takes the next below that it has."),
    flag("encoder.serial.gray",
        "True if the position of SSI comes in Gray code."),
    name("encoder.serial.check_bit", CheckBit::VARIANTS,
        "Bit behind the position of SSI: none, a parity of position and bit, or the encoder's error (active high)."),
]);

#[rustfmt::skip]
pub(super) const AMPLIFIER_AND_PLANT: &[LeafInfo] = &exchanged(Exchange::Disabled, [
    number("amplifier.full_scale_v", "V", at(0.1), at(20.0), 10.0,
        "Voltage of the converter's largest code."),
    number("amplifier.output_limit_v", "V",
        times(1e-3, "full scale", full_scale_v), times(1.0, "full scale", full_scale_v), 10.0,
        "Largest output."),
    number("amplifier.offset_v", "V",
        times(-0.1, "full scale", full_scale_v), times(0.1, "full scale", full_scale_v), 0.0,
        "Voltage at which the motor gives no force; it is added to every output."),
    flag("amplifier.reversed",
        "True if a positive voltage moves the axis to smaller positions."),
    number("amplifier.continuous_v", "V", at(1e-3), at(20.0), 20.0,
        "Output that the motor withstands indefinitely; from the output limit on, the load is not watched."),
    number("amplifier.overload_s", "s", at(0.01), at(1e3), 2.0,
        "Time for which the motor withstands the output limit, after rest (I²t)."),
    flag("amplifier.feedforward_alone",
        "True if the output is the feedforward alone, to be added to the force of another drive that closes the loop."),
    flag("commissioned",
        "True if the axis was commissioned, by the tool or by a person; outputs are enabled only if one was, and every other \
         has no gains, feedforward or offset."),
    number("plant.gain_mm_per_v_s2", "mm/(V s²)", at(1e-3), at(1e9), UNSET,
        "A, acceleration per volt at the amplifier's input. With a plant the feedback law is held to stability."),
    number("plant.damping_per_s", "1/s", at(0.0), at(1e6), 0.0,
        "B, damping over mass."),
    number("plant.stiffness_per_s2", "1/s²", at(0.0), at(1e9), 0.0,
        "C, stiffness over mass; zero is a stage without a spring to ground."),
    number("plant.delay_s", "s", at(0.0), at(0.1), 0.0,
        "Td, dead time of amplifier, drive and encoder, without the controller's own."),
]);
