//! An axis of a connected machine, under experiments.

use std::time::Duration;

use quadrant::app::Translated;
use quadrant_law::axes::AxisName;
use quadrant_law::reference::MotionSettings;
use quadrant_law::safety::FaultCode;
use quadrant_link::message::{AxisSignal, Body, Channel, MachineState, SettingsRequest};
use quadrant_settings::{AxisSettings, PlanSettings, StageSettings};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::{
    AxisInfo, Drive, Experiment, ExperimentError, MachineError, TestAxis, Travel, open_loop_mm,
    room_mm,
};

use super::injection::Injection;
use super::recording::Shape;
use super::stop::{Injected, Stop};
use crate::client::error::ClientError;
use crate::client::samples::{TelemetryRecorder, least_decimation};
use crate::client::session::Client;
use crate::client::{settings, settle};

/// Time from one look at the telemetry to the next.
const LOOK: Duration = Duration::from_millis(50);
/// Least time recorded after the motion, so that the last block has come.
const TAIL: Duration = Duration::from_millis(30);
/// The same in control ticks: a block takes time to fill, and the server runs every few ticks.
const TAIL_TICKS: f64 = 300.0;
/// Time for a moving axis to come to rest before an experiment.
const BEFORE: Duration = Duration::from_secs(60);
/// Faults that end an experiment, and no more.
const ENDS_EXPERIMENTS: [FaultCode; 4] = [
    FaultCode::FollowingError,
    FaultCode::Overspeed,
    FaultCode::InjectionBounds,
    FaultCode::Oscillation,
];
/// Time in which axes come to rest without their outputs.
const COASTING: Duration = Duration::from_secs(5);
/// Reason of an end that nobody asked this session for.
const SWITCHED_OFF: ClientError = ClientError::Interrupted {
    done: "the outputs went off, and not by this program: an operator, another host, or LinuxCNC's machine on",
};
/// Time in which the outputs come on.
const ENABLING: Duration = Duration::from_millis(100);

/// Counts by which an axis that stands seems to move from one look to the next, and way that is as little, mm: noise, or creeping.
const STILL_COUNTS: f64 = 2.5;
const STILL_MM: f64 = 0.02;
/// The same of another axis, mm: the law refuses to switch on while one is faster, and an input without an encoder may count a little.
const OTHERS_STILL_MM: f64 = 0.25;

/// An axis of a connected machine.
///
/// Experiments run under the machine's own limits and faults, and are recorded by telemetry: as often as they ask for, if
/// the line carries three channels so often, else as often as it does; a sample's voltage is the mean over all of its
/// control periods in any case. Positions are counted from the middle of the travel.
pub struct ConnectedAxis<'a> {
    client: &'a mut Client,
    axis: AxisName,
    stage: StageSettings,
    travel: Travel,
    /// The machine's position of the middle of the travel, mm.
    origin_mm: f64,
    /// The outputs may be off: they were not enabled yet, or this has switched them off, or a fault that is reset.
    may_be_off: bool,
    /// The recording of the last experiment, if that was stopped.
    interrupted: Option<Recording>,
    /// The error after which nothing is ordered any more: a person has to see to the machine first.
    ended: Option<String>,
}

impl<'a> ConnectedAxis<'a> {
    /// An axis of the machine, whose settings in force are read. Experiments keep it within `travel` of where it stands.
    ///
    /// # Errors
    /// A draft that is edited, a motion that is under way, a connection that is broken, or a machine of another release.
    pub fn new(
        client: &'a mut Client,
        axis: AxisName,
        travel: Travel,
    ) -> Result<Self, ClientError> {
        settings::refuse_edited(client)?;
        let stage = settings::in_force(client)?;
        let status = client.status()?;
        if !status.is_at_rest() {
            return Err(ClientError::Moving);
        }
        let origin_mm = status.axes[axis as usize].position_mm - travel.start_mm();
        Ok(Self {
            client,
            axis,
            stage,
            travel,
            origin_mm,
            may_be_off: !status.state.drives(),
            interrupted: None,
            ended: None,
        })
    }

    fn run(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, Stop> {
        let here = self.enabled()?;
        let motion = match experiment.drive {
            Drive::ClosedLoop(motion) => Some(motion),
            Drive::OpenLoop => None,
        };
        let moves = motion.is_some_and(|motion| motion != MotionSettings::Hold);
        let mut motions = [MotionSettings::Hold; 3];
        motions[self.axis as usize] = motion.unwrap_or(MotionSettings::Hold);
        self.client
            .order(Body::SetPlan(Translated::translated(PlanSettings {
                motions,
            })))?;
        let channels = [
            AxisSignal::Reference,
            AxisSignal::Position,
            AxisSignal::CodeSum,
        ]
        .map(|signal| Channel::Axis(Translated::translated(self.axis), signal));
        let rate_hz = self.client.identity().rate_hz;
        let requested = u16::try_from(experiment.decimation).unwrap_or(u16::MAX);
        let least = requested.max(least_decimation(channels.len(), rate_hz));
        let every = if experiment.injection_v.is_empty() {
            least
        } else {
            dividing(least, rate_hz)
        };
        let injects = motion.is_none() || experiment.injection_v.iter().any(|volts| *volts != 0.0);

        let mut telemetry = TelemetryRecorder::start(self.client, &channels, every)?;
        let followed = self.follow(experiment, &mut telemetry, here, [injects, moves], progress);
        let samples = telemetry.finish(self.client);
        let lasts = experiment.injection_v.len();
        let injected = match followed {
            Ok(injected) => injected,
            Err(stop) => {
                let shape = Shape {
                    settings: self.settings(),
                    origin_mm: self.origin_mm,
                    lasts: 0,
                    moves: false,
                    injected: None,
                };
                self.interrupted = samples.ok().and_then(|samples| shape.recording(&samples));
                // The injection may end before the outputs are seen to be off.
                if matches!(stop, Stop::Broken(_))
                    && self.client.status()?.state == MachineState::Disabled
                {
                    return Err(SWITCHED_OFF.into());
                }
                return Err(stop);
            }
        };
        let samples = samples?;
        progress(1.0);
        if samples.lost() > 0 {
            return Err(Stop::Lost(samples.lost()));
        }
        let shape = Shape {
            settings: self.settings(),
            origin_mm: self.origin_mm,
            lasts,
            moves,
            injected: injected.as_ref(),
        };
        shape.recording(&samples).ok_or(Stop::Short)
    }

    /// Runs an experiment on the enabled axis, which stands at `here_mm`, and waits for its end.
    fn follow(
        &mut self,
        experiment: &Experiment,
        telemetry: &mut TelemetryRecorder,
        here_mm: f64,
        [injects, moves]: [bool; 2],
        progress: &mut dyn FnMut(f64),
    ) -> Result<Option<Injected>, Stop> {
        let began = self.client.now();
        let rate_hz = self.client.identity().rate_hz;
        let mut injection = None;
        if injects {
            let room_mm = match experiment.drive {
                Drive::OpenLoop => {
                    let (low_mm, high_mm) = open_loop_mm(self.travel.half_mm(), here_mm);
                    (here_mm - low_mm).min(high_mm - here_mm)
                }
                Drive::ClosedLoop(motion) => room_mm(self.travel.half_mm(), here_mm, &motion),
            };
            let mut plan = Injection::new(
                experiment,
                self.settings(),
                Translated::translated(self.axis),
                room_mm,
                moves,
            );
            plan.send(self.client, telemetry)?;
            injection = Some(plan);
        } else if moves {
            self.client.order(Body::Run)?;
        }
        let lasts = experiment.injection_v.len();
        let least = Duration::from_secs_f64(lasts as f64 / rate_hz);
        loop {
            telemetry.gather(self.client, LOOK)?;
            let elapsed = self.client.now().saturating_sub(began);
            progress((elapsed.as_secs_f64() / experiment.time_limit_s).min(1.0));
            let status = self.client.status()?;
            self.client.refuse_fault("the experiment", &status)?;
            if status.state == MachineState::Disabled {
                return Err(SWITCHED_OFF.into());
            }
            // Axes that brake for a fault have it latched when they stand.
            let ends = !status.running && status.state != MachineState::Stopping;
            if elapsed >= least && ends {
                break;
            }
            if elapsed.as_secs_f64() > experiment.time_limit_s {
                self.client.order(Body::Stop)?;
                return Err(Stop::TimedOut(experiment.time_limit_s));
            }
        }
        let tail = TAIL.max(Duration::from_secs_f64(TAIL_TICKS / rate_hz));
        telemetry.gather(self.client, tail)?;
        match injection {
            Some(injection) => Ok(Some(injection.finish(self.client)?)),
            None => Ok(None),
        }
    }

    /// True if other experiments may follow one that ended early. A fault that this axis' limits are for is reset, once all axes have
    /// come to rest.
    fn goes_on_after(&mut self, error: &ExperimentError) -> bool {
        match error {
            ExperimentError::Interrupted { .. } => false,
            ExperimentError::Fault { fault, .. } => {
                let is_own = ENDS_EXPERIMENTS.contains(&fault.code);
                if is_own {
                    // Where it cannot be reset, the next experiment says so.
                    let _ = self.standstill();
                    let _ = self.client.order(Body::ResetFault);
                    self.may_be_off = true;
                }
                is_own
            }
            _ => true,
        }
    }

    /// Waits until no axis moves, with the outputs off.
    fn standstill(&mut self) -> Result<(), ClientError> {
        let due = self.client.now() + COASTING;
        let mut before = self.client.status()?.axes;
        loop {
            self.client.wait(LOOK)?;
            let axes = self.client.status()?.axes;
            let own_mm = STILL_MM.max(STILL_COUNTS * self.settings().encoder.resolution_mm);
            let moves = AxisName::ALL.into_iter().any(|axis| {
                let still_mm = if axis == self.axis {
                    own_mm
                } else {
                    OTHERS_STILL_MM
                };
                let place = axis as usize;
                (axes[place].position_mm - before[place].position_mm).abs() > still_mm
            });
            if !moves {
                return Ok(());
            }
            if self.client.now() >= due {
                return Err(ClientError::TimedOut {
                    what: "wait for standstill",
                    waited_s: COASTING.as_secs_f64(),
                    remedy: "an axis moves though the outputs are off: see to its brake",
                });
            }
            before = axes;
        }
    }

    /// Waits for rest and switches the outputs off, if settings are to change on which safety depends.
    fn disabled_for(&mut self, stage: &StageSettings) -> Result<(), settings::ExchangeError> {
        match stage.safety_change(&self.stage) {
            Some(_) => self.disable().map_err(Into::into),
            None => Ok(()),
        }
    }

    /// Waits for the end of the motion, switches the outputs off, and waits for standstill. Where that fails, no other experiment follows.
    fn disable(&mut self) -> Result<(), ClientError> {
        let off = self.switched_off();
        if let Err(error) = &off {
            self.ended.get_or_insert_with(|| error.to_string());
        }
        off
    }

    /// Switches the outputs off, if this session has them on. What ended the motion otherwise is said once they are off.
    fn switched_off(&mut self) -> Result<(), ClientError> {
        if self.may_be_off {
            return Ok(());
        }
        let rested = settle::rest(self.client, BEFORE);
        if matches!(rested, Err(ClientError::Fault { .. })) {
            // The axes may brake still.
            let _ = settle::rest(self.client, BEFORE);
        }
        if !self.client.status()?.state.drives() {
            return Ok(());
        }
        self.client.order(Body::Disable)?;
        self.may_be_off = true;
        // They stay on until a brake holds.
        let patience = Duration::from_secs_f64(self.stage.brake.apply_s) + COASTING;
        let due = self.client.now() + patience;
        while self.client.status()?.state.drives() {
            if self.client.now() >= due {
                return Err(ClientError::TimedOut {
                    what: "disable",
                    waited_s: patience.as_secs_f64(),
                    remedy: "the outputs are still on; press the emergency stop",
                });
            }
        }
        self.standstill()?;
        rested.map(|_| ())
    }

    /// Waits for rest, with the outputs on; says where the axis is. Outputs that somebody else has switched off stay off.
    fn enabled(&mut self) -> Result<f64, Stop> {
        let mut status = settle::rest(self.client, BEFORE)?;
        if status.state == MachineState::Disabled && !self.may_be_off {
            return Err(SWITCHED_OFF.into());
        }
        if status.state != MachineState::Enabled {
            self.standstill().map_err(Stop::not_enabled)?;
            self.client.order(Body::Enable).map_err(Stop::not_enabled)?;
            let due = self.client.now() + ENABLING;
            while status.state != MachineState::Enabled && self.client.now() < due {
                status = self.client.status()?;
            }
            self.client
                .wait(Duration::from_secs_f64(self.stage.brake.release_s))?;
            status = self.client.status()?;
        }
        self.may_be_off = false;
        Ok(status.axes[self.axis as usize].position_mm - self.origin_mm)
    }
}

impl TestAxis for ConnectedAxis<'_> {
    fn info(&self) -> AxisInfo {
        let settings = self.settings();
        AxisInfo {
            name: self.axis.as_str(),
            rate_hz: self.client.identity().rate_hz,
            resolution_mm: settings.encoder.resolution_mm,
            full_scale_v: settings.amplifier.full_scale_v,
            travel_mm: self.travel.half_mm(),
            start_mm: self.travel.start_mm(),
            max_velocity_mm_s: settings.limits.max_velocity_mm_s,
            max_acceleration_mm_s2: settings.limits.max_acceleration_mm_s2,
        }
    }

    fn settings(&self) -> &AxisSettings {
        &self.stage.axes[self.axis as usize]
    }

    /// Checks the settings here and loads them into the machine.
    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
        let mut stage = self.stage.clone();
        stage.axes[self.axis as usize] = settings.clone();
        stage.validate(quadrant_law::friction::gms::FIRMWARE_ELEMENTS)?;
        let loaded = self
            .disabled_for(&stage)
            .and_then(|()| settings::load(self.client, &stage))
            .map_err(|error| MachineError::Connection(Box::new(error)))?;
        if loaded.applied.restart_needed {
            let revert = Body::Settings(SettingsRequest::Revert);
            let reverted = self.client.order(revert);
            let error = reverted.err().unwrap_or(ClientError::NeedsRestart);
            return Err(MachineError::Connection(Box::new(error)));
        }
        self.stage = stage;
        Ok(())
    }

    fn switch_off(&mut self) -> Result<(), ExperimentError> {
        self.disable()
            .map_err(|error| Stop::from(error).into_error("switching the outputs off", self.axis))
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        self.interrupted = None;
        if let Some(done) = &self.ended {
            return Err(ExperimentError::Interrupted {
                experiment: experiment.name.clone(),
                done: done.clone(),
            });
        }
        self.run(experiment, progress).map_err(|stop| {
            let error = stop.into_error(&experiment.name, self.axis);
            if !self.goes_on_after(&error) {
                self.ended = Some(match &error {
                    ExperimentError::Interrupted { done, .. } => done.clone(),
                    other => other.to_string(),
                });
            }
            error
        })
    }

    fn interrupted(&self) -> Option<&Recording> {
        self.interrupted.as_ref()
    }
}

/// Part of a second of which the samples of an injection make a whole number: the usual period of an excitation, s.
const WHOLE_S: f64 = 0.25;

/// The fewest control ticks between samples, `least` or up to twice as many, of which a whole number make [`WHOLE_S`]; `least` where there
/// are none.
fn dividing(least: u16, rate_hz: f64) -> u16 {
    let whole = (WHOLE_S * rate_hz).round() as u32;
    (least..=least.saturating_mul(2))
        .find(|every| whole.is_multiple_of(u32::from(*every)))
        .unwrap_or(least)
}

#[cfg(test)]
mod tests {
    use super::dividing;

    #[test]
    fn samples_of_an_injection_make_a_whole_period_of_the_usual_excitation() {
        for (least, rate_hz, every) in [
            (1, 2e3, 1),
            (2, 1e4, 2),
            (3, 2e4, 4),
            (3, 1e4, 4),
            (7, 4e4, 8),
            // No number from 3 to 6 divides it.
            (3, 4.0 * 2503.0, 3),
        ] {
            assert_eq!(dividing(least, rate_hz), every, "{least} at {rate_hz} Hz");
        }
    }
}
