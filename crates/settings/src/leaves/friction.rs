//! The leaves of friction and its feedforward.

use strum::VariantNames;

use super::row::{Exchange, LeafInfo, UNSET, at, list, name, number, period_s, point, times};
use quadrant_law::axis::MAX_PREVIEW_TICKS;
use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::cancelling::{HARMONICS, MOST_RPM};
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant_law::learning::LearningSettings;

/// The softest spring of a block of the GMS model, V/mm.
pub const LEAST_STIFFNESS_V_PER_MM: f64 = 1e-6;

#[rustfmt::skip]
pub(super) const LEAVES: &[LeafInfo] = &[
    number("friction.sliding.positive.curve.coulomb_v", "V", at(1e-6), at(10.0), 1e-6,
        "Fc, the level at high velocity, towards larger positions."),
    number("friction.sliding.positive.curve.breakaway_v", "V",
        times(0.1, "Fc", |axis, _| axis.friction.sliding.positive.curve.coulomb_v), at(10.0), 1e-6,
        "Fs, the level at breakaway; below Fc where the level rises with the velocity."),
    number("friction.sliding.positive.curve.stribeck_velocity_mm_s", "mm/s", at(1e-3), at(1e2), 1.0,
        "Vs, the velocity scale of the change from Fs to Fc."),
    number("friction.sliding.positive.curve.exponent", "", at(0.3), at(4.0), 1.0,
        "delta, the shape of the change; 1 is exponential, 2 Gaussian."),
    number("friction.sliding.positive.viscous_v_s_per_mm", "V s/mm", at(0.0), at(1.0), 0.0,
        "sigma, viscous friction."),
    number("friction.sliding.negative.curve.coulomb_v", "V", at(1e-6), at(10.0), 1e-6,
        "Fc, the level at high velocity, towards smaller positions."),
    number("friction.sliding.negative.curve.breakaway_v", "V",
        times(0.1, "Fc", |axis, _| axis.friction.sliding.negative.curve.coulomb_v), at(10.0), 1e-6,
        "Fs, the level at breakaway; below Fc where the level rises with the velocity."),
    number("friction.sliding.negative.curve.stribeck_velocity_mm_s", "mm/s", at(1e-3), at(1e2), 1.0,
        "Vs, the velocity scale of the change from Fs to Fc."),
    number("friction.sliding.negative.curve.exponent", "", at(0.3), at(4.0), 1.0,
        "delta, the shape of the change; 1 is exponential, 2 Gaussian."),
    number("friction.sliding.negative.viscous_v_s_per_mm", "V s/mm", at(0.0), at(1.0), 0.0,
        "sigma, viscous friction."),
    list("friction.gms.elements", FIRMWARE_ELEMENTS,
        "The blocks of the GMS model; their weights sum to 1."),
    point("friction.gms.elements.stiffness_v_per_mm", "V/mm", at(LEAST_STIFFNESS_V_PER_MM), at(1e5), LEAST_STIFFNESS_V_PER_MM,
        |a, i| Some(a.friction.gms.elements.get(i)?.stiffness_v_per_mm),
        "k, the spring of the block; with a plant, the sum is held to what the control rate resolves."),
    point("friction.gms.elements.weight", "", at(0.0), at(1.0), 1.0,
        |a, i| Some(a.friction.gms.elements.get(i)?.weight),
        "alpha, its share of the load."),
    number("friction.gms.attraction_v_s", "V/s", at(0.0), at(1e6), 0.0,
        "C, the rate at which sliding friction follows the Stribeck effect; at most the lowest level per control period."),
    number("friction.smoothed_gms.width", "", at(1e-3), at(1.0), SmoothedGmsParameters::DEFAULT.width,
        "Width of the smoothed GMS' transition over each block's breakaway level."),
    number("friction.dahl.stiffness_v_per_mm", "V/mm", at(1e-6), at(1e5), UNSET,
        "sigma0 of Dahl's model, the stiffness at zero force."),
    number("friction.dahl.exponent", "", at(1.0), at(3.0), 1.0,
        "delta of Dahl's model, decay of the stiffness: 1 (in proportion to the distance from the level) to 3 (softer)."),
    number("friction.lugre.stiffness_v_per_mm", "V/mm", at(1e-6), at(1e5), UNSET,
        "sigma0 of the LuGre model, the stiffness of the bristles."),
    number("friction.lugre.damping_v_s_per_mm", "V s/mm", at(0.0), at(1.0), 0.0,
        "sigma1 of the LuGre model, the damping of their bending."),
    name("feedforward.kind", FeedforwardKind::VARIANTS,
        "Friction models that act."),
    number("feedforward.gains.level", "", at(0.0), at(2.0), 1.0,
        "Coulomb gain, share of s(v) sgn(v); 1 is the identified value."),
    number("feedforward.gains.viscous", "", at(0.0), at(2.0), 1.0,
        "Share of sigma v."),
    number("feedforward.gains.presliding", "", at(0.0), at(2.0), 1.0,
        "Share of the pre-sliding model's force, whichever model acts."),
    number("feedforward.gains.inertia_v_s2_per_mm", "V s²/mm", at(0.0), at(1.0), 0.0,
        "Inertia gain: 1 / A for the whole of it, 0 for none."),
    number("feedforward.range", "", at(0.01), at(100.0), 1.0,
        "Displacement over which friction is fed forward before it slides, over that of the friction settings: springs are softer by it."),
    number("feedforward.preview_s", "s",
        at(0.0), times(MAX_PREVIEW_TICKS as f64, "the control period", period_s), 0.0,
        "Look-ahead of the feedforward over the feedback's reference: the plant's delay."),
    number("feedforward.from_mm_s", "mm/s", at(0.0), at(1000.0), 0.0,
        "Largest velocity of motions to and fro on which no friction is fed forward; from twice that on, all of it is. 0: on all motions."),
    number("feedforward.from_mm", "mm", at(0.0), at(100.0), 0.0,
        "Longest stroke of motions to and fro on which no friction is fed forward; from twice that on, all of it is. 0: on all motions."),
    number("feedforward.learning.memory_s", "s", at(1.0), at(100.0), LearningSettings::DEFAULT.memory_s,
        "Time constant with which learning of the friction's scale forgets; left out with its part, nothing is learnt."),
    number("feedforward.learning.vibration_mm_s", "mm/s", at(0.1), at(1000.0), LearningSettings::DEFAULT.vibration_mm_s,
        "Amplitude of the axis' vibration between 40 and 150 Hz, as a velocity, that halves the feedforward of all friction but the viscous."),
    number("feedforward.cancelling.spindle_rpm", "rpm", at(0.0), at(MOST_RPM), CancellingSettings::DEFAULT.spindle_rpm,
        "Speed of the spindle until the link sets another; 0 if it stands. Left out with its part, no vibration is cancelled."),
    number("feedforward.cancelling.ramp_rpm_s", "rpm/s", at(1.0), at(1e6), CancellingSettings::DEFAULT.ramp_rpm_s,
        "Largest rate at which cancelling follows a change of the spindle's speed."),
    number("feedforward.cancelling.teeth", "", at(1.0), at(64.0), CancellingSettings::DEFAULT.teeth as f64,
        "Teeth of the cutter."),
    number("feedforward.cancelling.harmonics", "", at(1.0), at(HARMONICS as f64), CancellingSettings::DEFAULT.harmonics as f64,
        "Frequencies that are cancelled: 1 is that of the teeth, 2 adds the spindle's, 3 twice the teeth's; of a single tooth once, twice and three times."),
    number("feedforward.cancelling.rate_per_s", "1/s", at(0.1), at(20.0), CancellingSettings::DEFAULT.rate_per_s,
        "Rate at which the vibration's part of the error falls."),
    LeafInfo {
        exchange: Exchange::Disabled,
        ..number("feedforward.cancelling.limit_v", "V", at(0.0), at(10.0), CancellingSettings::DEFAULT.limit_v,
            "Largest voltage that cancelling adds.")
    },
];
