//! The stage's own leaves, and those of an axis' edges and plant.

use super::{Bound, LeafInfo, Range, at, leaves};
use crate::settings::{LossReaction, StageSettings};
use strum::VariantNames;

fn full_scale_v(settings: &StageSettings, axis: usize) -> f64 {
    settings.axes[axis].amplifier.full_scale_v
}

fn most_index_tolerance(settings: &StageSettings, axis: usize) -> f64 {
    let spacing = settings.axes[axis].encoder.counts_per_index;
    spacing.map_or(1e9, |counts| f64::from(counts / 4))
}

pub(super) const LEAVES: &[LeafInfo] = leaves! {
    "/rate_hz" "Hz" Range::Number(at(1e3), at(1e5));
    "Control rate. Changes with a restart."
    "/streaming/link_lost" "" Range::Name(LossReaction::VARIANTS);
    "What the axes do when the host that streams set points falls silent: brake, switch off and latch a fault; or brake and hold."
    "/streaming/underrun" "" Range::Name(LossReaction::VARIANTS);
    "The same when the next set point is late."

    "/axes/*/encoder/resolution_mm" "mm" Range::Number(at(1e-6), at(1.0));
    "Length of one count of the encoder. Changes with a restart, as all of the encoder."
    "/axes/*/encoder/counter_bits" "bit" Range::Number(at(8.0), at(32.0));
    "Width of the hardware counter."
    "/axes/*/encoder/reversed" "" Range::Flag;
    "The counter runs backwards when the axis moves to larger positions."

    "/axes/*/encoder/counts_per_index" "counts" Range::Number(at(16.0), at(1e9));
    "Counts between neighbouring index pulses; left out: the encoder has no index, or its spacing is not known."
    "/axes/*/encoder/index_tolerance_counts" "counts" Range::Number(
        at(0.0),
        Bound::Of("a quarter of the index spacing", most_index_tolerance)
    );
    "By how many counts an index pulse may be off."

    "/axes/*/amplifier/full_scale_v" "V" Range::Number(at(0.1), at(20.0));
    "Voltage of the converter's largest code."
    "/axes/*/amplifier/output_limit_v" "V" Range::Number(
        Bound::Of("full scale / 1000", |s, axis| 1e-3 * full_scale_v(s, axis)),
        Bound::Of("full scale", full_scale_v)
    );
    "Largest output."
    "/axes/*/amplifier/offset_v" "V" Range::Number(
        Bound::Of("-full scale / 10", |s, axis| -0.1 * full_scale_v(s, axis)),
        Bound::Of("full scale / 10", |s, axis| 0.1 * full_scale_v(s, axis))
    );
    "Voltage at which the motor gives no force; it is added to every output."
    "/axes/*/amplifier/reversed" "" Range::Flag;
    "A positive voltage moves the axis to smaller positions."

    "/axes/*/plant/gain_mm_per_v_s2" "mm/(V s²)" Range::Number(at(1e-3), at(1e9));
    "A, acceleration per volt at the amplifier's input. With a plant the feedback law is held to stability."
    "/axes/*/plant/damping_per_s" "1/s" Range::Number(at(0.0), at(1e6));
    "B, damping over mass."
    "/axes/*/plant/stiffness_per_s2" "1/s²" Range::Number(at(0.0), at(1e9));
    "C, stiffness over mass; zero is a stage without a spring to ground."
    "/axes/*/plant/delay_s" "s" Range::Number(at(0.0), at(0.1));
    "Td, dead time of amplifier, drive and encoder, without the controller's own."
};
