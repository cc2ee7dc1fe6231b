//! The leaves of friction and its feedforward.

use strum::VariantNames;

use super::{Bound, LeafInfo, Range, at, leaves};
use crate::law::axis::MAX_PREVIEW_TICKS;
use crate::law::feedforward::FeedforwardKind;
use crate::law::friction::gms::FIRMWARE_ELEMENTS;

pub(super) const LEAVES: &[LeafInfo] = leaves! {
    "/axes/*/friction/sliding/positive/curve/coulomb_v" "V" Range::Number(at(1e-6), at(10.0));
    "Fc, the level at high velocity, towards larger positions."
    "/axes/*/friction/sliding/positive/curve/breakaway_v" "V" Range::Number(
        Bound::Of("Fc", |s, axis| s.axes[axis].friction.sliding.positive.curve.coulomb_v),
        at(10.0)
    );
    "Fs, the level at breakaway."
    "/axes/*/friction/sliding/positive/curve/stribeck_velocity_mm_s" "mm/s" Range::Number(at(1e-3), at(1e2));
    "Vs, the velocity scale of the drop from Fs to Fc."
    "/axes/*/friction/sliding/positive/curve/exponent" "" Range::Number(at(0.3), at(4.0));
    "delta, the shape of the drop; 1 is exponential, 2 Gaussian."
    "/axes/*/friction/sliding/positive/viscous_v_s_per_mm" "V s/mm" Range::Number(at(0.0), at(1.0));
    "sigma, viscous friction."
    "/axes/*/friction/sliding/negative/curve/coulomb_v" "V" Range::Number(at(1e-6), at(10.0));
    "Fc, the level at high velocity, towards smaller positions."
    "/axes/*/friction/sliding/negative/curve/breakaway_v" "V" Range::Number(
        Bound::Of("Fc", |s, axis| s.axes[axis].friction.sliding.negative.curve.coulomb_v),
        at(10.0)
    );
    "Fs, the level at breakaway."
    "/axes/*/friction/sliding/negative/curve/stribeck_velocity_mm_s" "mm/s" Range::Number(at(1e-3), at(1e2));
    "Vs, the velocity scale of the drop from Fs to Fc."
    "/axes/*/friction/sliding/negative/curve/exponent" "" Range::Number(at(0.3), at(4.0));
    "delta, the shape of the drop; 1 is exponential, 2 Gaussian."
    "/axes/*/friction/sliding/negative/viscous_v_s_per_mm" "V s/mm" Range::Number(at(0.0), at(1.0));
    "sigma, viscous friction."

    "/axes/*/friction/gms/elements" "" Range::List(FIRMWARE_ELEMENTS);
    "The blocks of the GMS model; their weights sum to 1."
    "/axes/*/friction/gms/elements/*/stiffness_v_per_mm" "V/mm" Range::Number(at(1e-6), at(1e5));
    "k, the spring of the block; with a plant, the sum is held to what the control rate resolves."
    "/axes/*/friction/gms/elements/*/weight" "" Range::Number(at(0.0), at(1.0));
    "alpha, its share of the load."
    "/axes/*/friction/gms/attraction_v_s" "V/s" Range::Number(at(0.0), at(1e6));
    "C, the rate at which sliding friction follows the Stribeck effect; at most Fc per control period."
    "/axes/*/friction/smoothed_gms/width" "" Range::Number(at(1e-3), at(1.0));
    "Width of the smoothed GMS' transition over each block's breakaway level."
    "/axes/*/friction/dahl/stiffness_v_per_mm" "V/mm" Range::Number(at(1e-6), at(1e5));
    "sigma0 of Dahl's model, the stiffness at zero force."
    "/axes/*/friction/dahl/exponent" "" Range::Number(at(1.0), at(3.0));
    "delta of Dahl's model, how the stiffness fades: 1 (in proportion to the distance from the level) to 3 (softer)."
    "/axes/*/friction/lugre/stiffness_v_per_mm" "V/mm" Range::Number(at(1e-6), at(1e5));
    "sigma0 of the LuGre model, the stiffness of the bristles."
    "/axes/*/friction/lugre/damping_v_s_per_mm" "V s/mm" Range::Number(at(0.0), at(1.0));
    "sigma1 of the LuGre model, the damping of their bending."

    "/axes/*/feedforward/kind" "" Range::Name(FeedforwardKind::VARIANTS);
    "Which friction models act."
    "/axes/*/feedforward/gains/level" "" Range::Number(at(0.0), at(2.0));
    "Share of s(v) sgn(v); 1 is what was identified."
    "/axes/*/feedforward/gains/viscous" "" Range::Number(at(0.0), at(2.0));
    "Share of sigma v."
    "/axes/*/feedforward/gains/gms" "" Range::Number(at(0.0), at(2.0));
    "Share of the pre-sliding model's force, whichever model acts."
    "/axes/*/feedforward/gains/inertia_v_s2_per_mm" "V s²/mm" Range::Number(at(0.0), at(1.0));
    "Inertia: 1 / A for the whole of it, 0 for none."
    "/axes/*/feedforward/preview_s" "s" Range::Number(
        at(0.0),
        Bound::Of("31 control periods", |s, _| MAX_PREVIEW_TICKS as f64 * (1.0 / s.rate_hz))
    );
    "How far ahead of the feedback's reference the feedforward looks: the plant's delay."
};
