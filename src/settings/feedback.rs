//! What becomes of the feedback's settings: the law that acts, and the linear loops it is judged by.

use heapless::Vec;

use super::FeedbackSettings;
use crate::control::cascade::Cascade;
use crate::control::feedback::{Feedback, LawKind};
use crate::control::nctf::Nctf;
use crate::control::npid::NonlinearGainTable;
use crate::control::pid::Pid;
use crate::control::popov::PidGains;
use crate::control::schedule::{MAX_POINTS, ScheduledPid};
use crate::control::sliding_mode::SlidingMode;
use crate::scalar::Scalar;

impl FeedbackSettings {
    /// The PIDs that the law is at small errors: one, or one for each point of the schedule. None of a law that has no
    /// parameters.
    pub fn linear_gains(&self) -> Vec<PidGains, MAX_POINTS> {
        let filter_s = self.pid.derivative_filter_s;
        let one = |gains| Vec::from_iter([gains]);
        let surface = match self.law {
            LawKind::Pid | LawKind::NPid => return one(self.pid),
            LawKind::Pd => {
                return one(PidGains {
                    ki_v_per_mm_s: 0.0,
                    ..self.pid
                });
            }
            LawKind::Scheduled => {
                let points = self.schedule.iter().flatten();
                return points.map(|point| point.gains(&self.pid)).collect();
            }
            LawKind::Cascade => self.cascade.as_ref().map(|gains| gains.surface()),
            LawKind::SlidingMode => self.sliding_mode.as_ref().map(|gains| gains.surface()),
            LawKind::Nctf => self.nctf.as_ref().map(|gains| gains.surface()),
        };
        surface
            .map(|gains| gains.to_pid(filter_s))
            .into_iter()
            .collect()
    }

    /// The law ready for the tick, for a control period. Settings are validated before they come here: a law without its
    /// parameters would be a PID. Settings time only.
    pub fn build<S: Scalar>(&self, period_s: f64) -> Feedback<S> {
        let (filter_s, limit_v) = (self.pid.derivative_filter_s, self.integral_limit_v);
        let pid = || Pid::build(&self.pid, limit_v, period_s);
        let law = match self.law {
            LawKind::Pid => None,
            LawKind::Pd => Some(Feedback::Pid(Pid::build(&self.pid, 0.0, period_s))),
            LawKind::NPid => self
                .nonlinear
                .as_ref()
                .map(|gain| Feedback::NPid(NonlinearGainTable::build(gain), pid())),
            LawKind::Scheduled => self.schedule.as_ref().map(|schedule| {
                Feedback::Scheduled(ScheduledPid::build(&self.pid, schedule, limit_v, period_s))
            }),
            LawKind::Cascade => self
                .cascade
                .as_ref()
                .map(|gains| Feedback::Cascade(Cascade::build(gains, filter_s, limit_v, period_s))),
            LawKind::SlidingMode => self.sliding_mode.as_ref().map(|gains| {
                Feedback::SlidingMode(SlidingMode::build(gains, filter_s, limit_v, period_s))
            }),
            LawKind::Nctf => self
                .nctf
                .as_ref()
                .map(|gains| Feedback::Nctf(Nctf::build(gains, filter_s, limit_v, period_s))),
        };
        law.unwrap_or_else(|| Feedback::Pid(pid()))
    }
}
