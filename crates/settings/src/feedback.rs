//! The settings of the feedback law, the law that is built of them, and the linear loops that its stability is judged by.

use heapless::Vec;
use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};

use quadrant_law::control::cascade::{Cascade, CascadeGains};
use quadrant_law::control::feedback::{Feedback, LawKind};
use quadrant_law::control::filter::{FilterList, Filters};
use quadrant_law::control::nctf::{CharacteristicPoint, Nctf, NctfGains};
use quadrant_law::control::npid::{NonlinearGain, NonlinearGainTable, NonlinearPid};
use quadrant_law::control::pid::Pid;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::schedule::{GainSchedule, MAX_POINTS, SchedulePoint, ScheduledPid};
use quadrant_law::control::sliding_mode::{SlidingMode, SlidingModeGains};
use quadrant_law::control::surface::SurfaceGains;
use quadrant_law::scalar::Scalar;

/// The feedback law, and the parameters of every law that the axis has some for: the law can be changed without losing
/// them, but only to one that has its own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct FeedbackSettings {
    /// Law in force.
    #[tree(with = miniconf::leaf)]
    pub law: LawKind,
    /// Limit of the integral of any law, V, either sign.
    pub integral_limit_v: f64,
    /// Time constant with which the offset of a bumpless change of settings fades, s.
    pub transfer_s: f64,
    /// The gains of PD, PID, N-PID and of the scheduled PID; the derivative's filter is every law's.
    pub pid: PidGains,
    /// The nonlinear gain that makes the PID an N-PID.
    pub nonlinear: Option<NonlinearGain>,
    /// The schedule of the scheduled PID: shares of the PID's gains over the reference's speed.
    pub schedule: Option<GainSchedule>,
    /// P/PI cascade.
    pub cascade: Option<CascadeGains>,
    /// Sliding mode with boundary layer.
    pub sliding_mode: Option<SlidingModeGains>,
    /// Nominal characteristic trajectory following.
    pub nctf: Option<NctfGains>,
    /// Notches and low-passes behind the law, of any law.
    pub filters: Option<FilterList>,
}

/// Output of sliding mode before anybody has chosen it, V: several times the friction of the axes this was written for.
const SWITCHING_V: f64 = 1.0;

/// Widest boundary layer of the settings, mm/s.
const WIDEST_MM_S: f64 = 1e3;
/// Largest error on a trajectory of the settings, mm.
const LARGEST_MM: f64 = 30.0;

/// Of the schedule before anybody has chosen it: the integral's share at rest, and the speed from which it is one, mm/s.
const INTEGRAL_AT_REST: (f64, f64) = (4.0, 5.0);

impl FeedbackSettings {
    /// Every law such that at small errors it is the PID given: N-PID if there is a nonlinear gain, else PID, acts. The
    /// schedule integrates faster at rest. Cascade, sliding mode and NCTF are left out when the PID's zeros are complex.
    pub fn all_laws(
        pid: PidGains,
        nonlinear: Option<NonlinearGain>,
        max_velocity_mm_s: f64,
    ) -> Self {
        let surface = SurfaceGains::from_pid(&pid);
        let switching_v =
            |surface: &SurfaceGains| SWITCHING_V.min(WIDEST_MM_S * surface.gain_v_s_per_mm);
        // The trajectory of a slow loop ends at the largest error that it may have.
        let trajectory_mm_s =
            |surface: &SurfaceGains| max_velocity_mm_s.min(LARGEST_MM * surface.slope_per_s);
        let (at_rest, speed_mm_s) = INTEGRAL_AT_REST;
        let point = |speed_mm_s, integral| SchedulePoint {
            speed_mm_s,
            proportional: 1.0,
            integral,
            derivative: 1.0,
        };
        Self {
            law: if nonlinear.is_some() {
                LawKind::NPid
            } else {
                LawKind::Pid
            },
            pid,
            nonlinear,
            schedule: Some(Vec::from_iter([
                point(0.0, at_rest),
                point(speed_mm_s, 1.0),
            ])),
            cascade: surface.map(|surface| CascadeGains {
                position_gain_per_s: surface.slope_per_s,
                velocity_gain_v_s_per_mm: surface.gain_v_s_per_mm,
                velocity_integral_per_s: surface.integral_per_s,
                velocity_feedforward: 1.0,
                velocity_limit_mm_s: max_velocity_mm_s,
            }),
            sliding_mode: surface.map(|surface| SlidingModeGains {
                slope_per_s: surface.slope_per_s,
                switching_v: switching_v(&surface),
                // Not beyond the widest by rounding.
                boundary_mm_s: (switching_v(&surface) / surface.gain_v_s_per_mm).min(WIDEST_MM_S),
                integral_per_s: surface.integral_per_s,
            }),
            // A straight line up to the largest velocity, until a trajectory is measured.
            nctf: surface.map(|surface| NctfGains {
                characteristic: Vec::from_iter([CharacteristicPoint {
                    error_mm: trajectory_mm_s(&surface) / surface.slope_per_s,
                    velocity_mm_s: trajectory_mm_s(&surface),
                }]),
                gain_v_s_per_mm: surface.gain_v_s_per_mm,
                integral_per_s: surface.integral_per_s,
            }),
            ..Self::default()
        }
    }

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

    /// The filters ready for the tick, for a control period. Settings time only.
    pub fn build_filters<S: Scalar>(&self, period_s: f64) -> Filters<S> {
        self.filters
            .as_ref()
            .map_or(Filters::NONE, |filters| Filters::build(filters, period_s))
    }

    /// The law ready for the tick, for a control period. Settings are validated before they come here: a law without its
    /// parameters would be a PID. Settings time only.
    pub fn build<S: Scalar>(&self, period_s: f64) -> Feedback<S> {
        let (filter_s, limit_v) = (self.pid.derivative_filter_s, self.integral_limit_v);
        let pid = || Pid::build(&self.pid, limit_v, period_s);
        let law = match self.law {
            LawKind::Pid => None,
            LawKind::Pd => Some(Feedback::Pid(Pid::build(&self.pid, 0.0, period_s))),
            LawKind::NPid => self.nonlinear.as_ref().map(|gain| {
                Feedback::NPid(NonlinearPid {
                    pid: pid(),
                    gain: NonlinearGainTable::build(gain),
                })
            }),
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
