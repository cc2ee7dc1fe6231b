//! The default settings: those of a board that nobody has commissioned. No gain, no feedforward, moderate limits.

use heapless::Vec;

use super::axis::{AmplifierSettings, AxisSettings, EncoderSettings, FeedforwardSettings};
use super::feedback::FeedbackSettings;
use super::leaves::default;
use super::limits::LimitSettings;
use super::operation::{
    BrakeSettings, EmergencyReaction, LossReaction, OperationSettings, StreamingSettings,
};
use super::stage::StageSettings;
use quadrant_law::axes::AxisName;
use quadrant_law::axis::Commissioning;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::pid::PidGains;
use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant_law::friction::FrictionSettings;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::gms::{GmsElement, GmsParameters};
use quadrant_law::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_law::safety::{EnabledBy, HostNeeded};

impl StageSettings {
    /// Takes the [default](Self::default) settings over, in place.
    // Axis by axis: the firmware's stack has no room for a whole set.
    #[inline(never)]
    pub fn set_default(&mut self) {
        self.rate_hz = default!("rate_hz");
        self.operation = OperationSettings::default();
        self.brake = BrakeSettings::default();
        self.streaming = StreamingSettings::default();
        for axis in &mut self.axes {
            *axis = AxisSettings::default();
        }
    }

    /// Takes other settings over, in place.
    #[inline(never)]
    pub fn copy_from(&mut self, other: &Self) {
        let Self {
            rate_hz,
            operation,
            brake,
            streaming,
            axes,
        } = self;
        *rate_hz = other.rate_hz;
        *operation = other.operation;
        *brake = other.brake;
        *streaming = other.streaming;
        for (axis, other) in axes.iter_mut().zip(&other.axes) {
            axis.clone_from(other);
        }
    }

    /// True if an axis was commissioned, and no other has a law that could drive it: the control law enables the outputs
    /// only then.
    pub fn is_commissioned(&self) -> bool {
        let mut axes = self.axes.iter();
        axes.any(|axis| axis.commissioning() == Commissioning::Done)
            && self.uncommissioned().is_none()
    }

    /// The first axis that has a law and was not commissioned.
    pub fn uncommissioned(&self) -> Option<AxisName> {
        let mut axes = AxisName::ALL.into_iter();
        axes.find(|&axis| self.axis(axis).commissioning() == Commissioning::Missing)
    }
}

impl Default for StageSettings {
    /// A stage that nobody has commissioned, at 10 kHz.
    fn default() -> Self {
        Self {
            rate_hz: default!("rate_hz"),
            operation: OperationSettings::default(),
            brake: BrakeSettings::default(),
            streaming: StreamingSettings::default(),
            axes: core::array::from_fn(|_| AxisSettings::default()),
        }
    }
}

impl Default for OperationSettings {
    fn default() -> Self {
        Self {
            enabled_by: EnabledBy::default(),
            host_needed: HostNeeded::default(),
            emergency_stop: EmergencyReaction::Off,
        }
    }
}

impl Default for BrakeSettings {
    fn default() -> Self {
        Self {
            release_s: default!("brake.release_s"),
            apply_s: default!("brake.apply_s"),
        }
    }
}

impl Default for StreamingSettings {
    fn default() -> Self {
        Self {
            link_lost: LossReaction::Stop,
            underrun: LossReaction::Stop,
        }
    }
}

impl Default for AxisSettings {
    /// An axis that nobody has commissioned: no gain, no feedforward, no homing, no model.
    #[inline(never)]
    fn default() -> Self {
        Self {
            encoder: EncoderSettings::default(),
            amplifier: AmplifierSettings::default(),
            feedback: FeedbackSettings::default(),
            friction: friction(),
            feedforward: FeedforwardSettings::default(),
            limits: LimitSettings::default(),
            homing: None,
            pulses: None,
            plant: None,
            commissioned: false,
        }
    }
}

impl Default for EncoderSettings {
    fn default() -> Self {
        Self {
            resolution_mm: default!("encoder.resolution_mm"),
            counter_bits: default!("encoder.counter_bits") as u8,
            reversed: false,
            counts_per_index: None,
            index_tolerance_counts: default!("encoder.index_tolerance_counts") as u32,
            offset_mm: None,
            serial: None,
        }
    }
}

impl Default for AmplifierSettings {
    fn default() -> Self {
        Self {
            full_scale_v: default!("amplifier.full_scale_v"),
            output_limit_v: default!("amplifier.output_limit_v"),
            offset_v: default!("amplifier.offset_v"),
            continuous_v: default!("amplifier.continuous_v"),
            overload_s: default!("amplifier.overload_s"),
            reversed: false,
            feedforward_alone: false,
        }
    }
}

impl Default for FeedbackSettings {
    /// A PID whose gains are zero.
    fn default() -> Self {
        Self {
            law: LawKind::Pid,
            integral_limit_v: default!("feedback.integral_limit_v"),
            transfer_s: default!("feedback.transfer_s"),
            pid: PidGains {
                kp_v_per_mm: default!("feedback.pid.kp_v_per_mm"),
                ki_v_per_mm_s: default!("feedback.pid.ki_v_per_mm_s"),
                kd_v_s_per_mm: default!("feedback.pid.kd_v_s_per_mm"),
                derivative_filter_s: default!("feedback.pid.derivative_filter_s"),
            },
            nonlinear: None,
            schedule: None,
            cascade: None,
            sliding_mode: None,
            nctf: None,
            filters: None,
        }
    }
}

/// As little friction as there can be.
pub(super) fn friction() -> FrictionSettings {
    FrictionSettings {
        sliding: PerDirection {
            positive: StaticFriction {
                curve: StribeckCurve {
                    coulomb_v: default!("friction.sliding.positive.curve.coulomb_v"),
                    breakaway_v: default!("friction.sliding.positive.curve.breakaway_v"),
                    stribeck_velocity_mm_s: default!(
                        "friction.sliding.positive.curve.stribeck_velocity_mm_s"
                    ),
                    exponent: default!("friction.sliding.positive.curve.exponent"),
                },
                viscous_v_s_per_mm: default!("friction.sliding.positive.viscous_v_s_per_mm"),
            },
            negative: StaticFriction {
                curve: StribeckCurve {
                    coulomb_v: default!("friction.sliding.negative.curve.coulomb_v"),
                    breakaway_v: default!("friction.sliding.negative.curve.breakaway_v"),
                    stribeck_velocity_mm_s: default!(
                        "friction.sliding.negative.curve.stribeck_velocity_mm_s"
                    ),
                    exponent: default!("friction.sliding.negative.curve.exponent"),
                },
                viscous_v_s_per_mm: default!("friction.sliding.negative.viscous_v_s_per_mm"),
            },
        },
        gms: GmsParameters {
            elements: Vec::from_iter([GmsElement {
                stiffness_v_per_mm: default!("friction.gms.elements.stiffness_v_per_mm"),
                weight: default!("friction.gms.elements.weight"),
            }]),
            attraction_v_s: default!("friction.gms.attraction_v_s"),
        },
        smoothed_gms: SmoothedGmsParameters::default(),
        dahl: None,
        lugre: None,
    }
}

impl Default for FeedforwardSettings {
    /// No friction model and no inertia.
    fn default() -> Self {
        Self {
            kind: FeedforwardKind::None,
            gains: FeedforwardGains {
                level: default!("feedforward.gains.level"),
                viscous: default!("feedforward.gains.viscous"),
                presliding: default!("feedforward.gains.presliding"),
                inertia_v_s2_per_mm: default!("feedforward.gains.inertia_v_s2_per_mm"),
            },
            range: default!("feedforward.range"),
            preview_s: default!("feedforward.preview_s"),
            from_mm_s: default!("feedforward.from_mm_s"),
            from_mm: default!("feedforward.from_mm"),
            learning: None,
            cancelling: None,
        }
    }
}

impl Default for LimitSettings {
    fn default() -> Self {
        Self {
            max_velocity_mm_s: default!("limits.max_velocity_mm_s"),
            max_acceleration_mm_s2: default!("limits.max_acceleration_mm_s2"),
            max_jerk_mm_s3: default!("limits.max_jerk_mm_s3"),
            following_error_mm: default!("limits.following_error_mm"),
            following_error_lag_s: default!("limits.following_error_lag_s"),
            following_error_max_mm: default!("limits.following_error_max_mm"),
            overspeed_ratio: default!("limits.overspeed_ratio"),
            braking_mm_s2: default!("limits.braking_mm_s2"),
            braking_jerk_mm_s3: default!("limits.braking_jerk_mm_s3"),
            silent_s: default!("limits.silent_s"),
            silent_share: default!("limits.silent_share"),
            travel_mm: None,
            unhomed_mm_s: None,
        }
    }
}
