//! End of an experiment on a connected axis: put out in full, or stopped.

use quadrant_law::axes::AxisName;
use quadrant_law::safety::{Fault, FaultCode};
use quadrant_link::message::{InjectStatus, LinkError};
use quadrant_tune::test_axis::ExperimentError;

use crate::client::error::ClientError;

/// An injection that was put out: the tick of its first value, and all values, V.
pub(super) struct Injected {
    pub(super) first_tick: u32,
    pub(super) values_v: Vec<f64>,
}

/// Reason why an experiment ended early.
pub(super) enum Stop {
    Client(Box<ClientError>),
    /// The machine keeps its outputs off.
    NotEnabled(Box<ClientError>),
    /// The motion has not ended within a time, s.
    TimedOut(f64),
    Lost(u64),
    /// The injection was broken off.
    Broken(InjectStatus),
    /// The recording does not hold the experiment.
    Short,
}

impl From<ClientError> for Stop {
    fn from(error: ClientError) -> Self {
        Self::Client(Box::new(error))
    }
}

impl Stop {
    /// A failure before the outputs were on: a machine that refuses them, or moves without them, has a reason that a person is to see to.
    pub(super) fn not_enabled(error: ClientError) -> Self {
        match error {
            ClientError::Refused {
                source: LinkError::Busy(_),
                ..
            } => error.into(),
            ClientError::Refused { .. } | ClientError::TimedOut { .. } => {
                Self::NotEnabled(Box::new(error))
            }
            other => other.into(),
        }
    }

    /// The end of an experiment of this name on `axis`.
    pub(super) fn into_error(self, name: &str, axis: AxisName) -> ExperimentError {
        let name = name.to_owned();
        let interrupted = |done: String| ExperimentError::Interrupted {
            experiment: name.clone(),
            done,
        };
        let reason = match self {
            Self::TimedOut(time_limit_s) => {
                return ExperimentError::TimedOut {
                    experiment: name,
                    time_limit_s,
                    reason: "the motion has not ended",
                };
            }
            Self::NotEnabled(error) => return interrupted(error.to_string()),
            Self::Client(error) => match *error {
                ClientError::Fault {
                    axis: Some(other), ..
                } if other != axis => return interrupted(error.to_string()),
                ClientError::Fault {
                    code, axis, tick, ..
                } if FaultCode::from_number(code).is_some() => {
                    let code = FaultCode::from_number(code).unwrap_or(FaultCode::FollowingError);
                    let fault = Fault { code, axis, tick };
                    return ExperimentError::Fault {
                        experiment: name,
                        fault,
                    };
                }
                ClientError::Interrupted { done } => return interrupted(done.to_owned()),
                other => other.to_string(),
            },
            Self::Lost(lost) => format!(
                "{lost} samples were lost on the line; use a faster one, or a coarser sampling"
            ),
            Self::Broken(status) => format!(
                "the injected voltage ended after {} of {} values: somebody stopped the axes, or the machine held them; look \
                 at `log`",
                status.done, status.next_sequence
            ),
            Self::Short => {
                "the recording does not hold it; the line lost its beginning or its end".to_owned()
            }
        };
        ExperimentError::Impossible {
            experiment: name,
            reason,
        }
    }
}
