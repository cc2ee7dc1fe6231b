//! Reasons why a commissioning ends early.

use quadrant_settings::SettingsError;

use super::ringing::Ringing;
use super::verify::VerifyError;
use crate::design::DesignError;
use crate::identify::frf::FrfError;
use crate::identify::motion::MotionFitError;
use crate::identify::motor_constant::MotorConstantError;
use crate::identify::plant::PlantError;
use crate::identify::revise::ReviseError;
use crate::identify::static_friction::{FrictionFitError, StaticFrictionError};
use crate::identify::virgin_curve::VirginCurveError;
use crate::test_axis::{ExperimentError, MachineError};

/// Reason why a commissioning ends early.
#[derive(Debug, thiserror::Error)]
pub enum CommissionError {
    /// Settings that the firmware refuses.
    #[error("settings refused: {0}")]
    Settings(#[from] SettingsError),
    /// The machine refused settings, or the connection failed.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// The open-loop test failed.
    #[error("motor constant: {0}")]
    Motor(#[from] MotorConstantError),
    /// The response was not measured.
    #[error("frequency response: {0}")]
    Response(#[from] FrfError),
    /// The linear model was not found.
    #[error("linear model: {0}")]
    Plant(#[from] PlantError),
    /// The amplifier has a velocity loop of its own.
    #[error(
        "the amplifier is in velocity mode: a volt commands {velocity_mm_s_per_v:.1} mm/s, with a lag of some {lag_ms:.0} ms, and its own loop \
         takes up the friction, so that none is left to measure and to feed forward: switch the amplifier to torque (current) mode, and \
         commission again; or keep your present loop, and feed {:.4} V s/mm of velocity forward", 1.0 / velocity_mm_s_per_v
    )]
    VelocityMode {
        /// Velocity for a volt, mm/(V s).
        velocity_mm_s_per_v: f64,
        /// Time constant with which the velocity follows, ms; rough.
        lag_ms: f64,
    },
    /// The PID was not found.
    #[error("PID: {0}")]
    Pid(#[from] DesignError),
    /// The runs at constant velocity.
    #[error("friction at constant velocity: {0}")]
    Friction(#[from] StaticFrictionError),
    /// Their model was not found.
    #[error("friction model: {0}")]
    FrictionFit(#[from] FrictionFitError),
    /// A run of the slow sine.
    #[error("pre-sliding friction: {0}")]
    Sine(#[from] ExperimentError),
    /// The GMS model was not found.
    #[error("pre-sliding friction: {0}")]
    Presliding(#[from] VirginCurveError),
    /// The response at rest.
    #[error("linear model with friction: {0}")]
    Revise(#[from] ReviseError),
    /// The ordinary motion gave no model.
    #[error("ordinary motion: {0}")]
    Motion(#[from] MotionFitError),
    /// The axis oscillated.
    #[error(
        "the axis oscillated at {frequency_hz:.0} Hz ({amplitude_um:.0} um) when it was stopped, under controllers of any bandwidth that \
         the step allows: what resonates there is to be stiffened or damped, or the encoder to be read at the motor ({source})"
    )]
    Rings {
        frequency_hz: f64,
        amplitude_um: f64,
        /// What stopped it.
        source: Box<CommissionError>,
    },
    /// The outputs could not be switched off after another error, or a fault was found as they were.
    #[error("{source}; then, {reason}")]
    SwitchingOff {
        /// The other error.
        source: Box<CommissionError>,
        /// The reason or the fault.
        reason: ExperimentError,
    },
    /// The sine could not be run.
    #[error("verdict: {0}")]
    Verify(#[from] VerifyError),
}

impl CommissionError {
    /// True if a person ended it: no further attempt is made, and nothing that was seen of the axis is the reason.
    pub(super) fn is_interrupted(&self) -> bool {
        matches!(self.experiment(), Some(ExperimentError::Interrupted { .. }))
    }

    /// The experiment that ended early; none of another reason.
    fn experiment(&self) -> Option<&ExperimentError> {
        match self {
            Self::Sine(error)
            | Self::Motor(MotorConstantError::Experiment(error))
            | Self::Response(FrfError::Experiment(error))
            | Self::Friction(StaticFrictionError::Experiment(error))
            | Self::Revise(ReviseError::Experiment(error))
            | Self::Verify(VerifyError::TestAxis(error)) => Some(error),
            Self::Rings { source, .. } | Self::SwitchingOff { source, .. } => source.experiment(),
            _ => None,
        }
    }

    /// A step that failed because the axis oscillated.
    pub(super) fn rings(ringing: Ringing, error: Self) -> Self {
        Self::Rings {
            frequency_hz: ringing.frequency_hz,
            amplitude_um: 1e3 * ringing.amplitude_mm,
            source: Box::new(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interruption_is_found_below_every_step() {
        let experiment = || ExperimentError::Interrupted {
            experiment: "moving".to_owned(),
            done: "the axes have stopped".to_owned(),
        };
        let response = CommissionError::Response(FrfError::from(experiment()));
        for error in [
            CommissionError::Sine(experiment()),
            CommissionError::Motor(MotorConstantError::from(experiment())),
            CommissionError::Friction(StaticFrictionError::from(experiment())),
            CommissionError::Revise(ReviseError::from(experiment())),
            CommissionError::Verify(VerifyError::from(experiment())),
            response,
        ] {
            assert!(error.is_interrupted(), "{error}");
            assert!(
                error.to_string().contains("interrupted in moving"),
                "{error}"
            );
        }
        let other = ExperimentError::Impossible {
            experiment: "moving".to_owned(),
            reason: "interrupted".to_owned(),
        };
        assert!(!CommissionError::Sine(other).is_interrupted());
    }
}
