//! A connected axis that experiments are run on.

use std::time::Duration;

use quadrant::link::message::Body;
use quadrant::reference::MotionSettings;
use quadrant::safety::AxisName;
use quadrant::settings::{AxisSettings, PlanSettings, SettingsError, StageSettings};
use quadrant::telemetry::{AxisSignal, Channel, MachineState};

use super::client::Client;
use super::columns::values_mm;
use super::error::ClientError;
use super::samples::{Recording as Telemetry, Samples, least_decimation};
use super::settings;
use super::settle;
use crate::rig::{Drive, Experiment, Recording, Rig, RigAxis, RigError};

/// Time from one look at the telemetry to the next.
const LOOK: Duration = Duration::from_millis(50);
/// Time recorded after the motion, so that the last block has come.
const TAIL: Duration = Duration::from_millis(30);
/// Time for whatever moves to come to rest before an experiment.
const BEFORE: Duration = Duration::from_secs(60);
/// Travel that the machine's own soft limits do not cover, mm.
const TRAVEL_MM: f64 = 200.0;

/// An axis of a connected machine.
///
/// Motions run in closed loop, under the machine's own limits and faults, and are recorded by telemetry: as often as the
/// line carries three channels, so that a voltage is the mean over those samples of its period that were sent. The link
/// cannot add a voltage to the law's output: experiments that need that are refused.
pub struct ConnectedRig<'a> {
    client: &'a mut Client,
    axis: AxisName,
    stage: StageSettings,
    /// What the machine said to the settings that are to be in force.
    refused: Option<String>,
}

impl<'a> ConnectedRig<'a> {
    /// An axis of the machine, whose settings are read.
    ///
    /// # Errors
    /// A connection that is broken, or a machine of another release.
    pub fn new(client: &'a mut Client, axis: AxisName) -> Result<Self, ClientError> {
        let stage = settings::dump(client)?;
        Ok(Self {
            client,
            axis,
            stage,
            refused: None,
        })
    }

    /// The axis' settings, as they are in force.
    pub fn settings(&self) -> &AxisSettings {
        &self.stage.axes[self.axis as usize]
    }

    fn run(
        &mut self,
        experiment: &Experiment,
        motion: MotionSettings,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, Stop> {
        let status = settle::rest(self.client, BEFORE)?;
        if status.state != MachineState::Enabled {
            self.client.order(Body::Enable)?;
        }
        let mut motions = [MotionSettings::Hold; 3];
        motions[self.axis as usize] = motion;
        self.client.order(Body::SetPlan(PlanSettings { motions }))?;
        let channels = [AxisSignal::Position, AxisSignal::Error, AxisSignal::Output]
            .map(|signal| Channel::Axis(self.axis, signal));
        let rate_hz = self.client.identity().rate_hz;
        let every = least_decimation(channels.len(), rate_hz);
        let began = self.client.now();
        let mut telemetry = Telemetry::start(self.client, &channels, every)?;
        let moves = motion != MotionSettings::Hold;
        if moves {
            self.client.order(Body::Run)?;
        }
        let least = Duration::from_secs_f64(experiment.injection_v.len() as f64 / rate_hz);
        loop {
            telemetry.gather(self.client, LOOK)?;
            let elapsed = self.client.now().saturating_sub(began);
            progress((elapsed.as_secs_f64() / experiment.time_limit_s).min(1.0));
            let status = self.client.status()?;
            self.client.refuse_fault("the experiment", &status)?;
            if elapsed >= least && !status.running {
                break;
            }
            if elapsed.as_secs_f64() > experiment.time_limit_s {
                self.client.order(Body::Stop)?;
                return Err(Stop::TimedOut);
            }
        }
        telemetry.gather(self.client, TAIL)?;
        let samples = telemetry.finish(self.client)?;
        progress(1.0);
        if samples.lost() > 0 {
            return Err(Stop::Lost(samples.lost()));
        }
        let mut resolutions_mm = [0.0; 3];
        resolutions_mm[self.axis as usize] = self.settings().encoder.resolution_mm;
        Ok(recording(&samples, &resolutions_mm, experiment.decimation))
    }
}

/// What ended an experiment.
enum Stop {
    Client(Box<ClientError>),
    TimedOut,
    Lost(u64),
}

impl From<ClientError> for Stop {
    fn from(error: ClientError) -> Self {
        Self::Client(Box::new(error))
    }
}

/// Position, error and output as a recording with about `decimation` control periods in a sample, a multiple of what the
/// telemetry's samples are apart.
fn recording(samples: &Samples, resolutions_mm: &[f64; 3], decimation: usize) -> Recording {
    let group = (decimation / usize::from(samples.decimation.max(1))).max(1);
    let [position, error, voltage] =
        [0, 1, 2].map(|channel| values_mm(samples, channel, resolutions_mm));
    let mut recording = Recording {
        sample_time_s: samples.sample_time_s * group as f64,
        ..Recording::default()
    };
    let groups = position
        .chunks_exact(group)
        .zip(error.chunks_exact(group))
        .zip(voltage.chunks_exact(group));
    for ((position, error), voltage) in groups {
        recording.position_mm.push(position[0]);
        recording.reference_mm.push(position[0] + error[0]);
        let sum: f64 = voltage.iter().sum();
        recording.voltage_v.push(sum / group as f64);
        recording.injection_v.push(0.0);
    }
    recording
}

impl Rig for ConnectedRig<'_> {
    fn axis(&self) -> RigAxis {
        let settings = self.settings();
        RigAxis {
            name: self.axis.as_str(),
            rate_hz: self.client.identity().rate_hz,
            resolution_mm: settings.encoder.resolution_mm,
            full_scale_v: settings.amplifier.full_scale_v,
            travel_mm: TRAVEL_MM,
            max_velocity_mm_s: settings.limits.max_velocity_mm_s,
        }
    }

    /// Checks the settings here and loads them into the machine. What the machine says against them is told by the next
    /// experiment, which is not run.
    fn apply(&mut self, settings: &AxisSettings) -> Result<(), SettingsError> {
        let mut stage = self.stage.clone();
        stage.axes[self.axis as usize] = settings.clone();
        stage.validate(quadrant::friction::gms::FIRMWARE_ELEMENTS)?;
        match settings::load(self.client, &stage) {
            Ok(_) => {
                self.stage = stage;
                self.refused = None;
            }
            Err(error) => self.refused = Some(error.to_string()),
        }
        Ok(())
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, RigError> {
        let impossible = |reason: String| RigError::Impossible {
            experiment: experiment.name.clone(),
            reason,
        };
        if let Some(refused) = &self.refused {
            return Err(impossible(format!(
                "its settings did not take effect: {refused}"
            )));
        }
        let injects = experiment.injection_v.iter().any(|volts| *volts != 0.0);
        let motion = match experiment.drive {
            Drive::ClosedLoop(motion) if !injects => motion,
            _ => {
                return Err(impossible(
                    "the link has no message that adds a voltage to the amplifier's input; identify from motions in closed \
                     loop (`static-friction`, `virgin-curve`, `motion`), or from a recording of another system (--record)"
                        .to_owned(),
                ));
            }
        };
        self.run(experiment, motion, progress)
            .map_err(|stop| match stop {
                Stop::Client(error) => impossible(error.to_string()),
                Stop::TimedOut => RigError::TimedOut {
                    experiment: experiment.name.clone(),
                    time_limit_s: experiment.time_limit_s,
                    reason: "the motion has not ended",
                },
                Stop::Lost(lost) => impossible(format!(
                    "{lost} samples were lost on the line; use a faster one, or a coarser sampling"
                )),
            })
    }
}
