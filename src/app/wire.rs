//! Conversions between the link's messages and the types of law and settings.

use quadrant_link::message::{self as wire, text};

use quadrant_law::axes::AxisName;
use quadrant_law::axis::telemetry::LimitedBy;
use quadrant_law::learning::LearningStatus;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use quadrant_law::safety::SafetyState;
use quadrant_law::safety::oscillation::OscillationKind;
use quadrant_law::supervisor;
use quadrant_settings::{self as settings, PlanSettings};

/// A type of the link made of the law's or of the settings', or the other way. All of them are other crates', so this cannot be
/// `From`.
pub trait Translated<T> {
    /// The same in this type.
    fn translated(value: T) -> Self;
}

// The link's bound holds every value of the settings.
const _: () = assert!(settings::MAX_VALUE_BYTES == wire::MAX_VALUE_BYTES);

impl Translated<AxisName> for wire::AxisName {
    fn translated(axis: AxisName) -> Self {
        match axis {
            AxisName::X => Self::X,
            AxisName::Y => Self::Y,
            AxisName::Z => Self::Z,
        }
    }
}

impl Translated<wire::AxisName> for AxisName {
    fn translated(axis: wire::AxisName) -> Self {
        match axis {
            wire::AxisName::X => Self::X,
            wire::AxisName::Y => Self::Y,
            wire::AxisName::Z => Self::Z,
        }
    }
}

impl Translated<LimitedBy> for wire::LimitedBy {
    fn translated(limit: LimitedBy) -> Self {
        match limit {
            LimitedBy::Nothing => Self::Nothing,
            LimitedBy::OutputLimit => Self::OutputLimit,
        }
    }
}

/// The state of an axis that learns; none for one that does not.
pub(super) const fn learning_state(status: LearningStatus) -> Option<wire::LearningState> {
    Some(match status {
        LearningStatus::Off => return None,
        LearningStatus::Learning => wire::LearningState::Learning,
        LearningStatus::AtRest => wire::LearningState::AtRest,
        LearningStatus::OtherMotion => wire::LearningState::OtherMotion,
        LearningStatus::Saturated => wire::LearningState::Saturated,
        LearningStatus::Settling => wire::LearningState::Settling,
        LearningStatus::Fading => wire::LearningState::Fading,
    })
}

impl Translated<SafetyState> for wire::MachineState {
    #[inline(always)]
    fn translated(state: SafetyState) -> Self {
        match state {
            SafetyState::Start => Self::Start,
            SafetyState::Disabled => Self::Disabled,
            SafetyState::Enabled => Self::Enabled,
            SafetyState::Stopping(_) => Self::Stopping,
            SafetyState::Faulted(_) => Self::Fault,
        }
    }
}

impl Translated<OscillationKind> for wire::OscillationKind {
    fn translated(kind: OscillationKind) -> Self {
        match kind {
            OscillationKind::Hum => Self::Hum,
            OscillationKind::Added => Self::Added,
            OscillationKind::AddedForGood => Self::AddedForGood,
        }
    }
}

impl Translated<MotionMode> for wire::AxisMode {
    fn translated(mode: MotionMode) -> Self {
        match mode {
            MotionMode::Hold => Self::Hold,
            MotionMode::Plan => Self::Plan,
            MotionMode::Jog => Self::Jog,
            MotionMode::Home => Self::Home,
            MotionMode::Stream => Self::Stream,
            MotionMode::Stopping => Self::Stopping,
            MotionMode::OpenLoop => Self::OpenLoop,
        }
    }
}

impl Translated<supervisor::Event> for wire::Event {
    fn translated(event: supervisor::Event) -> Self {
        use supervisor::Event;
        match event {
            Event::Enabled => Self::Enabled,
            Event::Disabled => Self::Disabled,
            Event::Faulted(fault) => Self::Fault {
                code: fault.code.number(),
                axis: fault.axis.map(Translated::translated),
            },
            Event::Stopping(fault) => Self::Stopping {
                code: fault.code.number(),
                axis: fault.axis.map(Translated::translated),
            },
            Event::Held(fault) => Self::Held {
                code: fault.code.number(),
                axis: fault.axis.map(Translated::translated),
            },
            Event::MotionStarted => Self::MotionStarted,
            Event::MotionFinished => Self::MotionFinished,
            Event::MovedWhileOff(axis) => Self::MovedWhileOff(Translated::translated(axis)),
            Event::FrictionChanged(change) => Self::FrictionChanged {
                axis: Translated::translated(change.axis),
                percent: change.percent,
                needs_maintenance: change.needs_maintenance,
            },
            Event::Oscillated(found) => Self::Oscillated {
                axis: Translated::translated(found.axis),
                kind: Translated::translated(found.kind),
                decihertz: found.decihertz,
                micrometres: found.micrometres,
            },
            Event::Refused(_, reason) => Self::Refused(text(format_args!("{reason}"))),
        }
    }
}

impl Translated<wire::Plan> for PlanSettings {
    fn translated(plan: wire::Plan) -> Self {
        Self {
            motions: plan.motions.map(Translated::translated),
        }
    }
}

impl Translated<PlanSettings> for wire::Plan {
    fn translated(plan: PlanSettings) -> Self {
        Self {
            motions: plan.motions.map(Translated::translated),
        }
    }
}

impl Translated<wire::Motion> for MotionSettings {
    fn translated(motion: wire::Motion) -> Self {
        match motion {
            wire::Motion::Hold => Self::Hold,
            wire::Motion::Harmonic(wire::Harmonic {
                amplitude_mm,
                frequency_hz,
                phase_rad,
                cycles,
                lead_s,
            }) => Self::Harmonic(HarmonicSettings {
                amplitude_mm,
                frequency_hz,
                phase_rad,
                cycles,
                lead_s,
            }),
            wire::Motion::PointToPoint(wire::PointToPoint {
                distance_mm,
                max_velocity_mm_s,
                max_acceleration_mm_s2,
                max_jerk_mm_s3,
            }) => Self::PointToPoint(PointToPointSettings {
                distance_mm,
                max_velocity_mm_s,
                max_acceleration_mm_s2,
                max_jerk_mm_s3,
            }),
        }
    }
}

impl Translated<MotionSettings> for wire::Motion {
    fn translated(motion: MotionSettings) -> Self {
        match motion {
            MotionSettings::Hold => Self::Hold,
            MotionSettings::Harmonic(HarmonicSettings {
                amplitude_mm,
                frequency_hz,
                phase_rad,
                cycles,
                lead_s,
            }) => Self::Harmonic(wire::Harmonic {
                amplitude_mm,
                frequency_hz,
                phase_rad,
                cycles,
                lead_s,
            }),
            MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm,
                max_velocity_mm_s,
                max_acceleration_mm_s2,
                max_jerk_mm_s3,
            }) => Self::PointToPoint(wire::PointToPoint {
                distance_mm,
                max_velocity_mm_s,
                max_acceleration_mm_s2,
                max_jerk_mm_s3,
            }),
        }
    }
}
