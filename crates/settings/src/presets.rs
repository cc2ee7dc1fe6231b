//! The simulated XYZ stage as a control engineer would set it up: N-PID with combined feedforward at 10 kHz. Every number is
//! chosen, none measured; see `docs/parameters.md` for the reasons.
//!
//! Tests, examples and simulations start from these settings. A board does not know them: its own default holds no law.

use heapless::Vec;

use super::axis::{AmplifierSettings, AxisSettings, EncoderSettings, FeedforwardSettings};
use super::defaults::friction;
use super::feedback::FeedbackSettings;
use super::homing::{HomeSwitch, HomingSettings};
use super::limits::{LimitSettings, TravelSettings};
use super::stage::StageSettings;
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::FrictionSettings;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::gms::{GmsElement, GmsParameters};
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_law::friction::{Direction, PerDirection};

/// Linear model of the x axis, chosen so that the thesis' printed margins come out.
pub const X_PLANT: PlantModel = PlantModel {
    gain_mm_per_v_s2: 69_390.0,
    damping_per_s: 144.8,
    stiffness_per_s2: 166.6,
    delay_s: 1.20e-3,
};

/// PID gains of the x axis, designed on that model.
pub const X_GAINS: PidGains = PidGains {
    kp_v_per_mm: 1.118,
    ki_v_per_mm_s: 0.74,
    kd_v_s_per_mm: 0.005_537,
    derivative_filter_s: 52e-6,
};

/// Linear model of the y axis, which carries x and is heavier.
pub const Y_PLANT: PlantModel = PlantModel {
    gain_mm_per_v_s2: 61_200.0,
    damping_per_s: 151.0,
    stiffness_per_s2: 148.0,
    delay_s: 1.20e-3,
};

/// PID gains of the y axis, designed on that model.
pub const Y_GAINS: PidGains = PidGains {
    kp_v_per_mm: 1.310,
    ki_v_per_mm_s: 1.1,
    kd_v_s_per_mm: 0.006_275,
    derivative_filter_s: 52e-6,
};

/// Linear model of the z axis, vertical and counterbalanced.
pub const Z_PLANT: PlantModel = PlantModel {
    gain_mm_per_v_s2: 48_500.0,
    damping_per_s: 172.0,
    stiffness_per_s2: 205.0,
    delay_s: 1.30e-3,
};

/// PID gains of the z axis, designed on that model.
pub const Z_GAINS: PidGains = PidGains {
    kp_v_per_mm: 1.669,
    ki_v_per_mm_s: 1.3,
    kd_v_s_per_mm: 0.007_301,
    derivative_filter_s: 52e-6,
};

/// Parameters that differ from axis to axis.
struct Parameters {
    plant: PlantModel,
    pid: PidGains,
    nonlinear: NonlinearGain,
    coulomb_v: f64,
    breakaway_v: f64,
    stribeck_velocity_mm_s: f64,
    presliding_mm: f64,
    dahl: DahlParameters,
    lugre_stiffness_v_per_mm: f64,
}

/// Largest velocity of every axis, mm/s.
const MAX_VELOCITY_MM_S: f64 = 250.0;

/// Break points of the virgin curve as shares of the pre-sliding range, and the weights that break there.
const VIRGIN_CURVE: [(f64, f64); 4] = [(0.07, 0.30), (0.20, 0.30), (0.47, 0.25), (1.0, 0.15)];

#[inline(never)]
fn axis(parameters: &Parameters) -> AxisSettings {
    let elements: Vec<GmsElement, _> = VIRGIN_CURVE
        .iter()
        .map(|&(place, weight)| GmsElement {
            stiffness_v_per_mm: weight * parameters.breakaway_v
                / (place * parameters.presliding_mm),
            weight,
        })
        .collect();
    // sigma and B / A: a run at constant velocity cannot separate them.
    let viscous_v_s_per_mm = parameters.plant.damping_per_s / parameters.plant.gain_mm_per_v_s2;
    AxisSettings {
        encoder: EncoderSettings {
            // The screw's lead, 10 mm.
            counts_per_index: Some(20_000),
            ..EncoderSettings::default()
        },
        amplifier: AmplifierSettings::default(),
        feedback: FeedbackSettings::all_laws(
            parameters.pid,
            Some(parameters.nonlinear),
            MAX_VELOCITY_MM_S,
        ),
        friction: FrictionSettings {
            sliding: PerDirection::both(StaticFriction {
                curve: StribeckCurve {
                    coulomb_v: parameters.coulomb_v,
                    breakaway_v: parameters.breakaway_v,
                    stribeck_velocity_mm_s: parameters.stribeck_velocity_mm_s,
                    exponent: 1.0,
                },
                viscous_v_s_per_mm,
            }),
            gms: GmsParameters {
                elements,
                attraction_v_s: 5.0,
            },
            dahl: Some(parameters.dahl),
            lugre: Some(LugreParameters {
                stiffness_v_per_mm: parameters.lugre_stiffness_v_per_mm,
                // As much damping before sliding as in it.
                damping_v_s_per_mm: viscous_v_s_per_mm,
            }),
            ..friction()
        },
        feedforward: FeedforwardSettings {
            kind: FeedforwardKind::Combined,
            preview_s: parameters.plant.delay_s,
            from_mm_s: 0.0,
            from_mm: 0.0,
            learning: None,
            cancelling: None,
            ..FeedforwardSettings::default()
        },
        limits: LimitSettings {
            max_velocity_mm_s: MAX_VELOCITY_MM_S,
            max_acceleration_mm_s2: 2000.0,
            following_error_lag_s: 2e-3,
            following_error_max_mm: 1.4,
            travel_mm: Some(TravelSettings {
                negative: -200.0,
                positive: 200.0,
            }),
            ..LimitSettings::default()
        },
        homing: Some(HomingSettings {
            direction: Direction::Negative,
            switch: HomeSwitch::Home,
            search_mm_s: 20.0,
            latch_mm_s: 2.0,
            debounce_s: 5e-4,
            index: true,
            mark_mm: -36.0,
            park_mm: 0.0,
            travel_mm: 410.0,
        }),
        pulses: None,
        plant: Some(parameters.plant),
        commissioned: true,
    }
}

/// The x axis: the model and the gains of `thesis.md`'s chosen parameters.
pub fn x_axis() -> AxisSettings {
    axis(&Parameters {
        plant: X_PLANT,
        pid: X_GAINS,
        nonlinear: NonlinearGain {
            rate_per_mm: 15.0,
            range_mm: 0.1,
        },
        coulomb_v: 0.120,
        breakaway_v: 0.150,
        stribeck_velocity_mm_s: 1.0,
        presliding_mm: 0.030,
        dahl: DahlParameters {
            stiffness_v_per_mm: 18.31,
            exponent: 1.0,
        },
        lugre_stiffness_v_per_mm: 18.03,
    })
}

/// The y axis: carries x, so it is heavier.
pub fn y_axis() -> AxisSettings {
    axis(&Parameters {
        plant: Y_PLANT,
        pid: Y_GAINS,
        nonlinear: NonlinearGain {
            rate_per_mm: 15.0,
            range_mm: 0.1,
        },
        coulomb_v: 0.140,
        breakaway_v: 0.170,
        stribeck_velocity_mm_s: 1.2,
        presliding_mm: 0.034,
        dahl: DahlParameters {
            stiffness_v_per_mm: 18.33,
            exponent: 1.0,
        },
        lugre_stiffness_v_per_mm: 18.03,
    })
}

/// The z axis: vertical and counterbalanced, with the largest friction.
pub fn z_axis() -> AxisSettings {
    axis(&Parameters {
        plant: Z_PLANT,
        pid: Z_GAINS,
        nonlinear: NonlinearGain {
            rate_per_mm: 15.0,
            range_mm: 0.1,
        },
        coulomb_v: 0.160,
        breakaway_v: 0.200,
        stribeck_velocity_mm_s: 0.9,
        presliding_mm: 0.026,
        dahl: DahlParameters {
            stiffness_v_per_mm: 28.17,
            exponent: 1.0,
        },
        lugre_stiffness_v_per_mm: 27.74,
    })
}

impl StageSettings {
    /// The [simulated stage](self).
    pub fn simulated() -> Self {
        Self {
            axes: [x_axis(), y_axis(), z_axis()],
            ..Self::default()
        }
    }
}
