//! The leaves of the feedback laws.

use strum::VariantNames;

use super::{Bound, LeafInfo, Range, at, leaves};
use crate::law::control::feedback::LawKind;
use crate::law::control::{nctf, schedule};
use crate::settings::StageSettings;

fn output_limit_v(settings: &StageSettings, axis: usize) -> f64 {
    settings.axes[axis].amplifier.output_limit_v
}

fn steepest_rate_per_mm(settings: &StageSettings, axis: usize) -> f64 {
    let nonlinear = settings.axes[axis].feedback.nonlinear;
    nonlinear.map_or(f64::NAN, |gain| 3.4 / gain.range_mm)
}

pub(super) const LEAVES: &[LeafInfo] = leaves! {
    "/axes/*/feedback/law" "" Range::Name(LawKind::VARIANTS);
    "The law that acts; it needs its parameters."
    "/axes/*/feedback/integral_limit_v" "V" Range::Number(at(1e-6), Bound::Of("output limit", output_limit_v));
    "The integral of any law stays within plus and minus this."
    "/axes/*/feedback/transfer_s" "s" Range::Number(at(1e-3), at(10.0));
    "Time constant with which the offset of a bumpless change of settings fades."

    "/axes/*/feedback/pid/kp_v_per_mm" "V/mm" Range::Number(at(0.0), at(1e4));
    "Kp, of PD, PID, N-PID and the scheduled PID."
    "/axes/*/feedback/pid/ki_v_per_mm_s" "V/(mm s)" Range::Number(at(0.0), at(1e6));
    "Ki."
    "/axes/*/feedback/pid/kd_v_s_per_mm" "V s/mm" Range::Number(at(0.0), at(1e2));
    "Kd."
    "/axes/*/feedback/pid/derivative_filter_s" "s" Range::Number(
        Bound::Of("half a control period", |s, _| 0.5 * (1.0 / s.rate_hz)),
        at(1.0)
    );
    "Time constant of the derivative's filter, of every law."

    "/axes/*/feedback/nonlinear/rate_per_mm" "1/mm" Range::Number(
        at(0.0),
        Bound::Of("3.4 / range, and the Popov bound on the plant", steepest_rate_per_mm)
    );
    "ko, how fast the nonlinear gain cosh(ko e) of the N-PID grows with the error."
    "/axes/*/feedback/nonlinear/range_mm" "mm" Range::Number(at(1e-3), at(10.0));
    "emax, the error from which the gain stays at its largest."

    "/axes/*/feedback/schedule" "" Range::List(schedule::MAX_POINTS);
    "The schedule of the scheduled PID: shares of the PID's gains over the reference's speed, straight lines between."
    "/axes/*/feedback/schedule/*/speed_mm_s" "mm/s" Range::Number(at(0.0), at(1e3));
    "Speed of the reference; zero for the first point, rising from point to point."
    "/axes/*/feedback/schedule/*/proportional" "" Range::Number(at(0.0), at(30.0));
    "Share of Kp."
    "/axes/*/feedback/schedule/*/integral" "" Range::Number(at(0.0), at(30.0));
    "Share of Ki."
    "/axes/*/feedback/schedule/*/derivative" "" Range::Number(at(0.0), at(30.0));
    "Share of Kd."

    "/axes/*/feedback/cascade/position_gain_per_s" "1/s" Range::Number(at(1e-3), at(1e4));
    "Kv, gain of the position loop."
    "/axes/*/feedback/cascade/velocity_gain_v_s_per_mm" "V s/mm" Range::Number(at(1e-9), at(1e2));
    "G, gain of the velocity loop."
    "/axes/*/feedback/cascade/velocity_integral_per_s" "1/s" Range::Number(at(0.0), at(1e4));
    "r, reciprocal of the velocity loop's reset time; 0 for a P/P cascade."
    "/axes/*/feedback/cascade/velocity_feedforward" "" Range::Number(at(0.0), at(1.0));
    "g, share of the reference's velocity that is fed forward to the velocity loop."
    "/axes/*/feedback/cascade/velocity_limit_mm_s" "mm/s" Range::Number(at(1e-3), at(1e3));
    "Largest velocity that the position loop asks for."

    "/axes/*/feedback/sliding_mode/slope_per_s" "1/s" Range::Number(at(1e-3), at(1e4));
    "lambda, slope of the sliding line: on it the error falls as exp(-lambda t)."
    "/axes/*/feedback/sliding_mode/switching_v" "V" Range::Number(at(1e-6), Bound::Of("output limit", output_limit_v));
    "K, the switching output."
    "/axes/*/feedback/sliding_mode/boundary_mm_s" "mm/s" Range::Number(at(1e-3), at(1e3));
    "phi, half the thickness of the boundary layer."
    "/axes/*/feedback/sliding_mode/integral_per_s" "1/s" Range::Number(at(0.0), at(1e4));
    "r, the integral's share."

    "/axes/*/feedback/nctf/characteristic" "" Range::List(nctf::MAX_POINTS);
    "The nominal characteristic trajectory, from the origin on and constant beyond the last point."
    "/axes/*/feedback/nctf/characteristic/*/error_mm" "mm" Range::Number(at(1e-6), at(30.0));
    "Distance from where the axis will stop; rising from point to point."
    "/axes/*/feedback/nctf/characteristic/*/velocity_mm_s" "mm/s" Range::Number(at(1e-3), at(1e3));
    "The speed it has there; never falling from point to point."
    "/axes/*/feedback/nctf/gain_v_s_per_mm" "V s/mm" Range::Number(at(1e-9), at(1e2));
    "G, gain on the distance from the trajectory."
    "/axes/*/feedback/nctf/integral_per_s" "1/s" Range::Number(at(0.0), at(1e4));
    "r, the integral's share."
};
