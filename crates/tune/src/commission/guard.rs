//! An axis whose travel is guarded while it is commissioned, and the account of what it did.
//!
//! Nothing is known of the axis at first, and any loop may turn out unstable. What keeps it from the ends of its travel does
//! not depend on any model: a motion that does not fit is not begun; the law's own limit of the following error ends
//! one that strays from its plan, and its limit of the velocity one that is too fast to come to rest within the
//! travel that is left. Both are set from the travel, for every experiment, and are not those of the result.

use quadrant_settings::AxisSettings;

use super::ringing::{Ringing, ringing};
use crate::record::Recording;
use crate::test_axis::{
    AxisInfo, Drive, Experiment, ExperimentError, MachineError, TestAxis, span_mm, usable_mm,
};

/// Share of the travel that the tracking error may take at most.
pub(super) const FOLLOWING_SHARE: f64 = 0.17;
/// Share of the travel in which the axis comes to rest when its outputs go off.
const COASTING_SHARE: f64 = 0.05;
/// Largest share of the distance to the nearer end for each of tracking error and coasting.
const MAX_ROOM_SHARE: f64 = 0.45;
/// Share of the travel that the tracking error may take in any case: an axis at its end must be able to come back.
const LEAST_SHARE: f64 = 0.02;
/// Share of the deceleration by friction that the guard relies on.
const COUNTED_FRICTION: f64 = 0.7;
/// Lowest limit of the velocity, mm/s.
const LEAST_LIMIT_MM_S: f64 = 15.0;

/// What an experiment did to the axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Name of the experiment.
    pub name: String,
    /// Smallest and largest position, mm.
    pub span_mm: (f64, f64),
    /// Largest velocity of the plan, mm/s; none in open loop.
    pub planned_mm_s: Option<f64>,
    /// Largest voltage, V.
    pub most_v: f64,
    /// Time that it took, s.
    pub lasted_s: f64,
    /// False if it was stopped.
    pub ended: bool,
}

/// An axis under guard.
pub struct Guard<'a> {
    axis: &'a mut dyn TestAxis,
    /// Deceleration by friction alone, mm/s^2, once it is known.
    slowing_mm_s2: Option<f64>,
    /// Position after the last experiment, mm.
    at_mm: Option<f64>,
    /// Position in which the axis was seen last, mm.
    seen_mm: f64,
    /// Everything that was run.
    pub runs: Vec<Run>,
    rings: Option<Ringing>,
    /// The end of the last experiment.
    last: Recording,
    /// The outputs are off between experiments.
    rests_off: bool,
}

impl<'a> Guard<'a> {
    /// Guards an axis of which nothing is known.
    pub fn new(axis: &'a mut dyn TestAxis) -> Self {
        Self {
            seen_mm: axis.info().start_mm,
            at_mm: Some(axis.info().start_mm),
            axis,
            slowing_mm_s2: None,
            runs: Vec::new(),
            rings: None,
            last: Recording::default(),
            rests_off: false,
        }
    }

    /// Has the outputs off between experiments from now on, or no more. Until a controller is known to hold the axis, friction does: a loop that
    /// is not stable has no time to make it swing.
    ///
    /// # Errors
    /// Outputs that may still be on.
    pub fn rest_off(&mut self, rests_off: bool) -> Result<(), ExperimentError> {
        self.rests_off = rests_off;
        if rests_off {
            self.switch_off()?;
        }
        Ok(())
    }

    /// Takes the deceleration by friction into account, mm/s^2.
    pub fn slowed_by(&mut self, slowing_mm_s2: f64) {
        self.slowing_mm_s2 = Some(COUNTED_FRICTION * slowing_mm_s2);
    }

    /// Time for which the axis was used, s.
    pub fn used_s(&self) -> f64 {
        self.runs.iter().map(|run| run.lasted_s).sum()
    }

    /// The oscillation of the last experiment, if that was stopped.
    pub fn ringing(&self) -> Option<Ringing> {
        self.rings
    }

    /// The oscillation at the end of the last experiment, that had ended by itself.
    pub fn ringing_at_end(&self) -> Option<Ringing> {
        ringing(&self.last)
    }

    /// Largest velocity from which the axis comes to rest within the share of its travel that is left for it, mm/s.
    fn fastest_mm_s(&self, settings: &AxisSettings) -> f64 {
        let travel_mm = self.axis.info().travel_mm;
        let most = settings.limits.max_velocity_mm_s;
        let Some(slowing) = self.slowing_mm_s2 else {
            return most;
        };
        let coasting_mm = (COASTING_SHARE * travel_mm).min(MAX_ROOM_SHARE * self.room_mm());
        let stopped_from = (2.0 * slowing * coasting_mm).sqrt();
        let tripped_at = stopped_from / settings.limits.overspeed_ratio;
        tripped_at.max(LEAST_LIMIT_MM_S).min(most)
    }

    /// Way to the nearer end from where the axis was seen last, mm.
    fn room_mm(&self) -> f64 {
        (self.axis.info().travel_mm - self.seen_mm.abs()).max(0.0)
    }

    /// Limits of an experiment, from the travel.
    fn limited(&self, settings: &AxisSettings) -> AxisSettings {
        let mut settings = settings.clone();
        let share_mm = FOLLOWING_SHARE * self.axis.info().travel_mm;
        let least_mm = LEAST_SHARE * self.axis.info().travel_mm;
        let most_mm = share_mm.min((MAX_ROOM_SHARE * self.room_mm()).max(least_mm));
        let limits = &mut settings.limits;
        limits.following_error_mm = limits.following_error_mm.min(most_mm);
        limits.following_error_max_mm = limits.following_error_max_mm.min(most_mm);
        let fastest_mm_s = self.fastest_mm_s(&settings);
        let limits = &mut settings.limits;
        limits.max_velocity_mm_s = fastest_mm_s;
        limits.unhomed_mm_s = limits.unhomed_mm_s.map(|most| most.min(fastest_mm_s));
        settings
    }

    /// Checks that a planned motion stays within what of the travel is used.
    fn check_fits(&self, experiment: &Experiment) -> Result<(), ExperimentError> {
        let Drive::ClosedLoop(motion) = &experiment.drive else {
            return Ok(());
        };
        let Some(span) = span_mm(motion) else {
            return Ok(());
        };
        let Some(at_mm) = self.at_mm else {
            if span.is_empty() {
                return Ok(());
            }
            return Err(ExperimentError::Impossible {
                experiment: experiment.name.clone(),
                reason: "the axis was stopped and coasted on: where it stands is to be read first"
                    .to_owned(),
            });
        };
        // Towards the middle is always allowed.
        let travel_mm = self.axis.info().travel_mm;
        let slack_mm = MAX_START_OFFSET * travel_mm;
        let usable_mm = usable_mm(travel_mm) + slack_mm;
        let (low_mm, high_mm) = (at_mm + span.start, at_mm + span.end);
        let leaves = |end_mm: f64| end_mm.abs() > usable_mm.max(at_mm.abs() + slack_mm);
        if leaves(low_mm) || leaves(high_mm) {
            return Err(ExperimentError::Impossible {
                experiment: experiment.name.clone(),
                reason: format!(
                    "it would go from {low_mm:.2} to {high_mm:.2} mm, and {usable_mm:.2} mm either way are used: the axis needs \
                     more travel"
                ),
            });
        }
        Ok(())
    }

    fn note(&mut self, experiment: &Experiment, recording: &Recording, ended: bool) {
        let fold = |from: f64, pick: fn(f64, f64) -> f64| {
            recording.position_mm.iter().copied().fold(from, pick)
        };
        let planned_mm_s = match &experiment.drive {
            Drive::OpenLoop => None,
            Drive::ClosedLoop(motion) => Some(motion.peaks().0),
        };
        let most = |most: f64, volts: &f64| most.max(volts.abs());
        self.at_mm = recording.position_mm.last().copied().or(self.at_mm);
        self.seen_mm = self.at_mm.unwrap_or(self.seen_mm);
        self.runs.push(Run {
            name: experiment.name.clone(),
            span_mm: (
                fold(f64::INFINITY, f64::min),
                fold(f64::NEG_INFINITY, f64::max),
            ),
            planned_mm_s,
            most_v: recording.voltage_v.iter().fold(0.0, most),
            lasted_s: recording.len() as f64 * recording.sample_time_s,
            ended,
        });
    }
}

/// Time at the end of an experiment that is kept, s.
const KEPT_S: f64 = 0.5;
/// Largest distance between the planned and the real start of an experiment, over the travel.
const MAX_START_OFFSET: f64 = 0.06;

impl TestAxis for Guard<'_> {
    fn info(&self) -> AxisInfo {
        self.axis.info()
    }

    fn settings(&self) -> &AxisSettings {
        self.axis.settings()
    }

    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
        self.axis.apply(&self.limited(settings))
    }

    fn switch_off(&mut self) -> Result<(), ExperimentError> {
        self.axis.switch_off()
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        self.check_fits(experiment)?;
        self.rings = None;
        let outcome = self.axis.perform(experiment, progress);
        let stopped = self.axis.interrupted().cloned();
        match (&outcome, stopped) {
            (Ok(recording), _) => {
                let latest = (KEPT_S / recording.sample_time_s) as usize;
                let begin = recording.len().saturating_sub(latest);
                self.last = recording.slice(begin..recording.len());
                self.note(experiment, recording, true);
            }
            (Err(_), Some(recording)) => {
                self.rings = ringing(&recording);
                self.note(experiment, &recording, false);
                // It coasted on: nobody knows where it is.
                self.at_mm = None;
            }
            (Err(_), None) => self.at_mm = None,
        }
        if self.rests_off && !matches!(outcome, Err(ExperimentError::Interrupted { .. })) {
            let off = self.switch_off();
            return outcome.and_then(|recording| off.map(|()| recording));
        }
        outcome
    }

    fn interrupted(&self) -> Option<&Recording> {
        self.axis.interrupted()
    }
}

#[cfg(test)]
mod tests {
    use quadrant_law::reference::{MotionSettings, PointToPointSettings};
    use quadrant_settings::StageSettings;
    use quadrant_sim::plant::{
        AxisParameters, Backlash, Drive as DriveTrain, EncoderSide, StageParameters,
    };

    use super::*;
    use crate::test_axis::SimulatedTestAxis;

    const TRAVEL_MM: f64 = 10.0;

    fn x() -> AxisParameters {
        StageParameters::real().axes[0].clone()
    }

    fn measured(base: &AxisSettings) -> AxisSettings {
        crate::commission::bootstrap::measuring_settings(base)
    }

    fn to(distance_mm: f64) -> Experiment {
        Experiment {
            name: format!("{distance_mm} mm"),
            drive: Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm,
                max_velocity_mm_s: 10.0,
                max_acceleration_mm_s2: 300.0,
                max_jerk_mm_s3: 5e3,
            })),
            injection_v: Vec::new(),
            decimation: 10,
            time_limit_s: 10.0,
        }
    }

    #[test]
    fn a_motion_that_does_not_fit_the_travel_is_not_begun_and_one_back_is() {
        let mut axis = SimulatedTestAxis::new(0, x(), 1).with_travel_mm(TRAVEL_MM);
        let mut guard = Guard::new(&mut axis);
        let settings = measured(guard.settings());
        guard.apply(&settings).unwrap();
        guard.perform(&to(6.0), &mut |_| {}).unwrap();
        let refused = guard.perform(&to(3.0), &mut |_| {}).unwrap_err();
        assert!(refused.to_string().contains("more travel"), "{refused}");
        assert_eq!(guard.runs.len(), 1);
        guard.perform(&to(-12.0), &mut |_| {}).unwrap();
    }

    #[test]
    fn an_experiment_before_which_the_outputs_were_off_knows_nothing_of_the_last_one() {
        let first_v = |rests_off: bool| {
            let mut axis = SimulatedTestAxis::new(0, x(), 1).with_travel_mm(TRAVEL_MM);
            let mut guard = Guard::new(&mut axis);
            let settings = measured(guard.settings());
            guard.apply(&settings).unwrap();
            guard.rest_off(rests_off).unwrap();
            guard.perform(&to(3.0), &mut |_| {}).unwrap();
            let rest = Experiment {
                drive: Drive::ClosedLoop(MotionSettings::Hold),
                injection_v: vec![0.0; 100],
                ..to(0.0)
            };
            guard.perform(&rest, &mut |_| {}).unwrap().voltage_v[0].abs()
        };
        let (held_v, begun_v) = (first_v(false), first_v(true));
        assert!(begun_v < 0.2 * held_v, "{begun_v} V of {held_v} V");
    }

    #[test]
    fn a_loop_that_runs_away_is_stopped_within_the_travel_and_its_frequency_is_known() {
        for frequency_hz in [35.0, 60.0, 90.0] {
            let mut parameters = x();
            let gain = parameters.gain_mm_per_v_s2;
            let spring = Backlash::resonating(frequency_hz, 0.02, 0.5, gain, EncoderSide::Load);
            parameters.drive = DriveTrain::RackAndPinion(spring);
            let mut axis = SimulatedTestAxis::new(0, parameters, 1).with_travel_mm(TRAVEL_MM);
            let base = StageSettings::simulated().axes[0].clone();
            let mut guard = Guard::new(&mut axis);
            guard.slowed_by(8000.0);
            // The law of the rigid axis.
            guard.apply(&measured(&base)).unwrap();
            let outcome = guard.perform(&to(6.0), &mut |_| {});
            let rings = guard.ringing();
            assert!(
                outcome.is_err(),
                "{frequency_hz} Hz allows the rigid axis' PID"
            );
            let seen_hz = rings.unwrap().frequency_hz;
            let ratio = seen_hz / frequency_hz;
            assert!((0.7..1.5).contains(&ratio), "{frequency_hz}: {seen_hz}");
            assert!(axis.farthest_mm() < TRAVEL_MM, "{}", axis.farthest_mm());
        }
    }

    #[test]
    fn the_limits_follow_the_travel_and_a_long_one_leaves_those_that_are_set() {
        let base = measured(&StageSettings::simulated().axes[0]);
        let limits = |travel_mm: f64| {
            let mut axis = SimulatedTestAxis::new(0, x(), 1).with_travel_mm(travel_mm);
            let mut guard = Guard::new(&mut axis);
            guard.slowed_by(8000.0);
            guard.apply(&base).unwrap();
            guard.settings().limits
        };
        assert_eq!(limits(200.0), base.limits);
        let short = limits(5.0);
        assert!(short.following_error_mm < 1.0, "{short:?}");
        assert!(short.max_velocity_mm_s < 60.0, "{short:?}");
    }
}
