//! Conversions between the link's messages and the types of law and settings.

use quadrant_link::message::{self as wire, text};

use super::supervisor;
use crate::law::axes::AxisName;
use crate::law::learning::LearningStatus;
use crate::law::motion::MotionMode;
use crate::law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use crate::law::safety::SafetyState;
use crate::law::safety::oscillation::OscillationKind;
use crate::law::telemetry::LimitedBy;
use crate::settings::{self, PlanSettings};

// The link's bound holds every value of the settings.
const _: () = assert!(settings::MAX_VALUE_BYTES == wire::MAX_VALUE_BYTES);

impl From<AxisName> for wire::AxisName {
    fn from(axis: AxisName) -> Self {
        match axis {
            AxisName::X => Self::X,
            AxisName::Y => Self::Y,
            AxisName::Z => Self::Z,
        }
    }
}

impl From<wire::AxisName> for AxisName {
    fn from(axis: wire::AxisName) -> Self {
        match axis {
            wire::AxisName::X => Self::X,
            wire::AxisName::Y => Self::Y,
            wire::AxisName::Z => Self::Z,
        }
    }
}

impl From<LimitedBy> for wire::LimitedBy {
    fn from(limit: LimitedBy) -> Self {
        match limit {
            LimitedBy::Nothing => Self::Nothing,
            LimitedBy::OutputLimit => Self::OutputLimit,
        }
    }
}

impl LearningStatus {
    /// The state of an axis that learns; none for one that does not.
    pub(super) const fn on_the_link(self) -> Option<wire::LearningState> {
        Some(match self {
            Self::Off => return None,
            Self::Learning => wire::LearningState::Learning,
            Self::AtRest => wire::LearningState::AtRest,
            Self::OtherMotion => wire::LearningState::OtherMotion,
            Self::Saturated => wire::LearningState::Saturated,
            Self::Settling => wire::LearningState::Settling,
            Self::Fading => wire::LearningState::Fading,
        })
    }
}

impl From<SafetyState> for wire::MachineState {
    #[inline(always)]
    fn from(state: SafetyState) -> Self {
        match state {
            SafetyState::Start => Self::Start,
            SafetyState::Disabled => Self::Disabled,
            SafetyState::Enabled => Self::Enabled,
            SafetyState::Stopping(_) => Self::Stopping,
            SafetyState::Faulted(_) => Self::Fault,
        }
    }
}

impl From<OscillationKind> for wire::OscillationKind {
    fn from(kind: OscillationKind) -> Self {
        match kind {
            OscillationKind::Hum => Self::Hum,
            OscillationKind::Added => Self::Added,
            OscillationKind::AddedForGood => Self::AddedForGood,
        }
    }
}

impl From<MotionMode> for wire::AxisMode {
    fn from(mode: MotionMode) -> Self {
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

impl From<supervisor::Event> for wire::Event {
    fn from(event: supervisor::Event) -> Self {
        use supervisor::Event;
        match event {
            Event::Enabled => Self::Enabled,
            Event::Disabled => Self::Disabled,
            Event::Faulted(fault) => Self::Fault {
                code: fault.code.number(),
                axis: fault.axis.map(Into::into),
            },
            Event::Stopping(fault) => Self::Stopping {
                code: fault.code.number(),
                axis: fault.axis.map(Into::into),
            },
            Event::Held(fault) => Self::Held {
                code: fault.code.number(),
                axis: fault.axis.map(Into::into),
            },
            Event::MotionStarted => Self::MotionStarted,
            Event::MotionFinished => Self::MotionFinished,
            Event::MovedWhileOff(axis) => Self::MovedWhileOff(axis.into()),
            Event::FrictionChanged(change) => Self::FrictionChanged {
                axis: change.axis.into(),
                percent: change.percent,
                needs_maintenance: change.needs_maintenance,
            },
            Event::Oscillated(found) => Self::Oscillated {
                axis: found.axis.into(),
                kind: found.kind.into(),
                decihertz: found.decihertz,
                micrometres: found.micrometres,
            },
            Event::Refused(_, reason) => Self::Refused(text(format_args!("{reason}"))),
        }
    }
}

impl From<wire::Plan> for PlanSettings {
    fn from(plan: wire::Plan) -> Self {
        Self {
            motions: plan.motions.map(Into::into),
        }
    }
}

impl From<PlanSettings> for wire::Plan {
    fn from(plan: PlanSettings) -> Self {
        Self {
            motions: plan.motions.map(Into::into),
        }
    }
}

impl From<wire::Motion> for MotionSettings {
    fn from(motion: wire::Motion) -> Self {
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

impl From<MotionSettings> for wire::Motion {
    fn from(motion: MotionSettings) -> Self {
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
