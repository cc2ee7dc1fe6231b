//! Sending a voltage that the machine adds to an axis' output, ahead of the tick that takes it.

use std::time::Duration;

use quadrant_law::units::DacCode;
use quadrant_link::message::AxisName;
use quadrant_link::message::MachineState;
use quadrant_link::message::{Body, INJECT_VALUES, InjectRequest, InjectStatus, Reply, Voltages};
use quadrant_settings::AxisSettings;
use quadrant_tune::test_axis::{Drive, Experiment};

use super::stop::{Injected, Stop};
use crate::client::error::ClientError;
use crate::client::samples::TelemetryRecorder;
use crate::client::session::Client;

/// Time from one look at a braking machine to the next.
const LOOK: Duration = Duration::from_millis(50);
/// Pause before a full queue is asked again.
const PAUSE: Duration = Duration::from_millis(2);
/// Looks after which an injection that all values were sent of must have ended, and a stop.
const LOOKS: u32 = 200;

/// A voltage on its way.
pub(super) struct Injection {
    open: InjectRequest,
    words: Vec<i16>,
    volts_per_word: f64,
}

impl Injection {
    /// The voltage of an experiment on an axis that may go `room_mm` either way.
    pub(super) fn new(
        experiment: &Experiment,
        settings: &AxisSettings,
        axis: AxisName,
        room_mm: f64,
        moves: bool,
    ) -> Self {
        let volts_per_word = settings.amplifier.full_scale_v / DacCode::FULL_SCALE;
        let words: Vec<i16> = experiment
            .injection_v
            .iter()
            .map(|volts| DacCode::saturating((volts / volts_per_word).round() as i32).0)
            .collect();
        let most = words.iter().map(|word| word.unsigned_abs()).max();
        let open = InjectRequest::Open {
            axis,
            open_loop: experiment.drive == Drive::OpenLoop,
            with_plan: moves,
            limit_v: f64::from(most.unwrap_or(0).max(1)) * volts_per_word,
            travel_mm: room_mm,
            max_velocity_mm_s: settings.limits.max_velocity_mm_s,
        };
        Self {
            open,
            words,
            volts_per_word,
        }
    }

    /// Sends all values as fast as the machine has room for them, and keeps what it reports meanwhile.
    pub(super) fn send(
        &mut self,
        client: &mut Client,
        telemetry: &mut TelemetryRecorder,
    ) -> Result<(), Stop> {
        let mut status = ask(client, self.open.clone())?;
        while (status.next_sequence as usize) < self.words.len() {
            let sent = status.next_sequence as usize;
            let end = self.words.len().min(sent + INJECT_VALUES);
            let room = usize::from(status.free) >= INJECT_VALUES;
            let request = InjectRequest::Values {
                sequence: status.next_sequence,
                // None only ask how much room there is.
                values: Voltages::new(
                    self.words[sent..if room { end } else { sent }]
                        .iter()
                        .copied(),
                ),
                last: end == self.words.len(),
            };
            status = ask(client, request)?;
            if status.ended {
                return Err(broken(client, status)?);
            }
            telemetry.gather(client, if room { Duration::ZERO } else { PAUSE })?;
        }
        Ok(())
    }

    /// Waits for the end of the injection and returns its values.
    pub(super) fn finish(self, client: &mut Client) -> Result<Injected, Stop> {
        for _ in 0..LOOKS {
            let status = ask(
                client,
                InjectRequest::Values {
                    sequence: self.words.len() as u32,
                    values: Voltages::default(),
                    last: false,
                },
            )?;
            if !status.ended {
                client.wait(PAUSE)?;
                continue;
            }
            return match status.first_tick {
                Some(first_tick) if status.done as usize == self.words.len() => Ok(Injected {
                    first_tick,
                    values_v: self
                        .words
                        .iter()
                        .map(|&word| f64::from(word) * self.volts_per_word)
                        .collect(),
                }),
                _ => Err(broken(client, status)?),
            };
        }
        Err(Stop::TimedOut(f64::from(LOOKS) * PAUSE.as_secs_f64()))
    }
}

/// Returns the reason of an early end: the fault, once the axes have braked for it, if it was one.
fn broken(client: &mut Client, injection: InjectStatus) -> Result<Stop, ClientError> {
    for _ in 0..LOOKS {
        let status = client.status()?;
        client.refuse_fault("the experiment", &status)?;
        if status.state != MachineState::Stopping {
            break;
        }
        client.wait(LOOK)?;
    }
    Ok(Stop::Broken(injection))
}

fn ask(client: &mut Client, request: InjectRequest) -> Result<InjectStatus, ClientError> {
    match client.request(Body::Inject(request)) {
        Ok(Reply::Inject(status)) => Ok(status),
        Ok(other) => Err(client.unexpected("inject", &other)),
        Err(error) => {
            // An injection that was refused because of a fault: the fault says more.
            let status = client.status()?;
            client.refuse_fault("inject", &status)?;
            Err(error)
        }
    }
}
