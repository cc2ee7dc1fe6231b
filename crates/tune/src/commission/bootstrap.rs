//! A first controller for an axis of which hardly anything is known: slow and safe, so that it can be measured.

use std::f64::consts::TAU;

use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::filter::{FilterList, FilterSettings};
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_settings::AxisSettings;

use crate::design::{Form, Process};

/// Crossover frequency of the first controller, Hz: a dead time of 5 ms still leaves it a phase margin of 30 deg.
pub const CROSSOVER_HZ: f64 = 15.0;
/// Crossover frequency over the frequency from which the derivative acts.
const LEAD_RATIO: f64 = 3.0;
/// Frequency below which the integral acts, over the crossover frequency.
const INTEGRAL_CORNER_RATIO: f64 = 0.1;
/// Time constant of the derivative's filter over the inverse crossover frequency in rad/s.
const FILTER_RATIO: f64 = 0.03;
/// Tracking error allowed while the axis is measured, mm: the first controller is soft.
const FOLLOWING_ERROR_MM: f64 = 10.0;

/// Crossovers that the first controller tries, over the usual one: the lower ones leave a structural mode alone.
pub const BOOTSTRAP_SHARES: [f64; 4] = [1.0, 0.5, 0.25, MIN_BOOTSTRAP_SHARE];
/// Lowest of these shares.
pub const MIN_BOOTSTRAP_SHARE: f64 = 0.15;
/// Corner of the low-pass over the crossover, where that is below the usual one.
const LOW_PASS_RATIO: f64 = 4.0;
/// Damping ratio of this low-pass.
const LOW_PASS_DAMPING: f64 = 0.7;

/// [`bootstrap_settings`] at a share of the usual crossover. Below one, a low-pass is behind the PID, so that the loop's gain is
/// small at any mode from three times the crossover on.
pub fn soft_bootstrap_settings(
    base: &AxisSettings,
    gain_mm_per_v_s2: f64,
    rate_hz: f64,
    share: f64,
) -> AxisSettings {
    let mut settings = bootstrap_at(base, gain_mm_per_v_s2, rate_hz, share * CROSSOVER_HZ);
    settings.feedback.filters = (share < 1.0).then(|| {
        FilterList::from_iter([FilterSettings::low_pass(
            LOW_PASS_RATIO * share * CROSSOVER_HZ,
            LOW_PASS_DAMPING,
        )])
    });
    settings
}

/// The settings with which an axis is measured first: `base` with a controller that needs nothing but A,
/// `gain_mm_per_v_s2`, within a factor of two; no nonlinear gain, no feedforward, no model.
pub fn bootstrap_settings(
    base: &AxisSettings,
    gain_mm_per_v_s2: f64,
    rate_hz: f64,
) -> AxisSettings {
    bootstrap_at(base, gain_mm_per_v_s2, rate_hz, CROSSOVER_HZ)
}

fn bootstrap_at(
    base: &AxisSettings,
    gain_mm_per_v_s2: f64,
    rate_hz: f64,
    crossover_hz: f64,
) -> AxisSettings {
    let mut settings = measuring_settings(base);
    let crossover = TAU * crossover_hz;
    // |L| = A Kp sqrt(1 + lead^2) / w^2 = 1 on the double integrator that every axis is above its damping's corner.
    let kp_v_per_mm = crossover * crossover / (gain_mm_per_v_s2 * LEAD_RATIO.hypot(1.0));
    settings.plant = None;
    settings.feedback.pid = PidGains {
        kp_v_per_mm,
        ki_v_per_mm_s: INTEGRAL_CORNER_RATIO * crossover * kp_v_per_mm,
        kd_v_s_per_mm: LEAD_RATIO * kp_v_per_mm / crossover,
        derivative_filter_s: (FILTER_RATIO / crossover).max(1.0 / rate_hz),
    };
    settings
}

/// `settings` with a friction that is roughly known fed forward, so that a soft controller does not lag by it: in positive and in
/// negative direction, V. On a short travel
/// the lag would take a good part of the way.
pub fn with_rough_friction(
    mut settings: AxisSettings,
    gain_mm_per_v_s2: f64,
    friction_v: [f64; 2],
) -> AxisSettings {
    settings.friction.sliding = rough_sliding(friction_v);
    settings.feedforward.kind = FeedforwardKind::Static;
    settings.feedforward.gains = FeedforwardGains {
        level: ROUGH_SHARE,
        viscous: 0.0,
        presliding: 0.0,
        inertia_v_s2_per_mm: ROUGH_SHARE / gain_mm_per_v_s2,
    };
    settings
}

/// `settings`, of a PID, with no more voltage than `most_v`, V.
pub fn with_output_limit(mut settings: AxisSettings, most_v: f64) -> AxisSettings {
    let limit_v = settings.amplifier.output_limit_v.min(most_v);
    settings.amplifier.output_limit_v = limit_v;
    let integral_limit_v = &mut settings.feedback.integral_limit_v;
    *integral_limit_v = integral_limit_v.min(limit_v);
    // Its own voltage may exceed the limit, and it is not in force.
    settings.feedback.sliding_mode = None;
    settings
}

/// Sliding friction that is the same at every speed: in positive and in negative direction, V.
pub(super) fn rough_sliding(friction_v: [f64; 2]) -> PerDirection<StaticFriction> {
    let sliding = |friction_v: f64| StaticFriction {
        curve: StribeckCurve {
            coulomb_v: friction_v.max(1e-6),
            breakaway_v: friction_v.max(1e-6),
            stribeck_velocity_mm_s: 1.0,
            exponent: 1.0,
        },
        viscous_v_s_per_mm: 0.0,
    };
    PerDirection {
        positive: sliding(friction_v[0]),
        negative: sliding(friction_v[1]),
    }
}

/// Share of a roughly known friction and inertia that is fed forward.
const ROUGH_SHARE: f64 = 0.8;

/// `base` as an axis is measured with it: its PID alone, and room for the error that it makes.
pub fn measuring_settings(base: &AxisSettings) -> AxisSettings {
    let mut settings = base.clone();
    // The axis is watched while it is measured.
    settings.commissioned = true;
    settings.feedback.law = LawKind::Pid;
    settings.feedforward.kind = FeedforwardKind::None;
    settings.feedforward.learning = None;
    settings.limits.following_error_mm = FOLLOWING_ERROR_MM;
    settings.limits.following_error_max_mm = FOLLOWING_ERROR_MM;
    settings
}

/// `base` with a law that does nothing: for experiments in open loop on an axis of which not even the sign is known, before
/// and after which the loop is closed. Only friction holds it.
pub fn zero_gain_settings(base: &AxisSettings) -> AxisSettings {
    let mut settings = measuring_settings(base);
    settings.plant = None;
    settings.feedback.pid = PidGains {
        kp_v_per_mm: 0.0,
        ki_v_per_mm_s: 0.0,
        kd_v_s_per_mm: 0.0,
        ..base.feedback.pid
    };
    settings
}

/// `base` with a PID that is quiet enough for the smallest motions: of an axis that is held by friction, the noise of a
/// fast derivative makes the axis break away, and hides what is to be measured.
pub fn low_bandwidth_settings(
    base: &AxisSettings,
    plant: &PlantModel,
    rate_hz: f64,
) -> AxisSettings {
    low_bandwidth_settings_by(base, plant, rate_hz, 1.0)
}

/// As [`low_bandwidth_settings`], with as much less bandwidth as structural modes demand: `process` is the axis with them and
/// with the filters of `base`. Where none will do, the PID of `base` is kept.
pub fn low_bandwidth_settings_on(
    base: &AxisSettings,
    plant: &PlantModel,
    process: &Process,
    rate_hz: f64,
) -> AxisSettings {
    let form = Form::Sampled {
        sample_time_s: 1.0 / rate_hz,
        computation_delay_s: 0.0,
    };
    (0..MAX_CROSSOVER_REDUCTIONS)
        .map(|step| low_bandwidth_settings_by(base, plant, rate_hz, CROSSOVER_REDUCTION.powi(step)))
        .find(|settings| {
            matches!(process, Process::Model(_))
                || process
                    .margins(&settings.feedback.pid, form)
                    .is_ok_and(|margins| margins.sensitivity_peak < QUIET_PEAK)
        })
        .unwrap_or_else(|| AxisSettings {
            plant: None,
            ..measuring_settings(base)
        })
}

/// As [`low_bandwidth_settings`], at a share of the usual crossover.
fn low_bandwidth_settings_by(
    base: &AxisSettings,
    plant: &PlantModel,
    rate_hz: f64,
    share: f64,
) -> AxisSettings {
    let mut settings = measuring_settings(base);
    let crossover =
        share * (QUIET_PHASE_RAD / plant.delay_s.max(1.0 / rate_hz)).min(TAU * QUIET_CROSSOVER_HZ);
    let kp_v_per_mm = crossover * crossover.hypot(plant.damping_per_s)
        / (plant.gain_mm_per_v_s2 * QUIET_LEAD.hypot(1.0));
    settings.plant = None;
    settings.feedback.pid = PidGains {
        kp_v_per_mm,
        ki_v_per_mm_s: QUIET_INTEGRAL_PER_S * kp_v_per_mm,
        kd_v_s_per_mm: QUIET_LEAD * kp_v_per_mm / crossover,
        derivative_filter_s: (QUIET_FILTER / crossover).max(1.0 / rate_hz),
    };
    settings
}

/// Factor on the crossover of the low-bandwidth controller for each further try, while a mode exceeds the bound on `|S|`.
const CROSSOVER_REDUCTION: f64 = 0.85;
/// Largest number of these tries.
const MAX_CROSSOVER_REDUCTIONS: i32 = 12;
/// Largest `|S|` of the low-bandwidth controller.
const QUIET_PEAK: f64 = 1.8;
/// Phase that the dead time may turn at its crossover, rad.
const QUIET_PHASE_RAD: f64 = 0.27;
/// Highest crossover of it, Hz.
const QUIET_CROSSOVER_HZ: f64 = 60.0;
/// Crossover over the frequency from which its derivative acts.
const QUIET_LEAD: f64 = 1.4;
/// Integral over proportional gain, 1/s.
const QUIET_INTEGRAL_PER_S: f64 = 5.0;
/// Time constant of its filter over the inverse crossover in rad/s.
const QUIET_FILTER: f64 = 0.07;

#[cfg(test)]
mod tests {
    use quadrant_settings::presets::{X_PLANT, x_axis, y_axis, z_axis};
    use quadrant_sim::loop_shape::SampledLoop;
    use quadrant_sim::margins::margins;

    use super::*;

    #[test]
    fn the_first_controller_is_stable_whatever_the_axis_within_reason() {
        for damping_per_s in [0.0, 20.0, 145.0, 400.0] {
            for delay_s in [0.0, 0.5e-3, 1.2e-3, 3e-3, 5e-3] {
                for wrong in [0.5, 1.0, 2.0] {
                    let plant = PlantModel {
                        gain_mm_per_v_s2: X_PLANT.gain_mm_per_v_s2,
                        damping_per_s,
                        stiffness_per_s2: 0.0,
                        delay_s,
                    };
                    let settings =
                        bootstrap_settings(&x_axis(), wrong * plant.gain_mm_per_v_s2, 1e4);
                    let open_loop = SampledLoop::new(&plant, &settings.feedback.pid, 1e-4, 0.0);
                    for share in BOOTSTRAP_SHARES {
                        let gain = wrong * plant.gain_mm_per_v_s2;
                        let soft = soft_bootstrap_settings(&x_axis(), gain, 1e4, share);
                        let process = Process::Modelled {
                            plant,
                            modes: Vec::new(),
                            filters: soft.feedback.filters.unwrap_or_default().to_vec(),
                        };
                        let form = Form::Sampled {
                            sample_time_s: 1e-4,
                            computation_delay_s: 0.0,
                        };
                        let margins = process.margins(&soft.feedback.pid, form);
                        assert_ne!(
                            margins.err(),
                            Some(quadrant_sim::margins::MarginError::Unstable),
                            "{share}: B {damping_per_s}, Td {delay_s}, A wrong by {wrong}"
                        );
                    }
                    // Without a delay nothing above makes it unstable, which the margins report as an error too.
                    if delay_s > 0.0 {
                        let margins = margins(&open_loop);
                        assert!(
                            margins.is_ok(),
                            "B {damping_per_s}, Td {delay_s}, A wrong by {wrong}: {margins:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn the_quiet_controller_keeps_a_distance_from_instability() {
        for axis in [x_axis(), y_axis(), z_axis()] {
            let plant = axis.plant.unwrap();
            let quiet = low_bandwidth_settings(&axis, &plant, 1e4);
            let margins =
                margins(&SampledLoop::new(&plant, &quiet.feedback.pid, 1e-4, 0.0)).unwrap();
            assert!(margins.sensitivity_peak < 1.6, "{margins:?}");
            assert!(quiet.feedback.pid.kd_v_s_per_mm < axis.feedback.pid.kd_v_s_per_mm);
        }
    }
}
