//! State of the live view, and the keys that act on it and on the machine.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::ensure;
use quadrant_host::client::samples::{
    Samples, TelemetryRecorder, arm, least_decimation, read_capture,
};
use quadrant_host::client::settings::{self, whole_path};
use quadrant_host::client::{Client, ClientError, columns};
use quadrant_link::message::{
    AxisName, Body, CapturePhase, Channel, FaultReport, Inputs, Learning, Notice, Status, Trigger,
};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use crate::connect::command::WatchOptions;
use crate::connect::observe;

/// Samples across a chart at most: some to each dot of a wide terminal.
const MOST_SAMPLES: f64 = 4000.0;
/// Factor by which a gain is nudged.
const NUDGE: f64 = 1.05;
/// Samples that the cursor goes at a time, as a share of the window: slowly, and fast.
const STEPS: (f64, f64) = (0.005, 0.1);
/// Least and largest time across a chart, s.
const WINDOW_S: (f64, f64) = (0.1, 60.0);
/// Factor by which this time changes.
const ZOOM: f64 = 2.0;
/// Share of a capture before its trigger, %.
const BEFORE_TRIGGER: u8 = 30;
/// Time in which a frozen capture is read.
const READING: Duration = Duration::from_secs(5);
/// The gains that are nudged unless others are named.
const GAINS: [&str; 3] = ["kp_v_per_mm", "ki_v_per_mm_s", "kd_v_s_per_mm"];

/// Going on, or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Going {
    On,
    Leave,
}

/// A setting that is nudged.
#[derive(Clone, Debug)]
pub(super) struct Gain {
    /// Its path in the console's short form.
    pub(super) path: String,
    pub(super) value: f64,
    /// The value when the watching began.
    pub(super) original: f64,
}

/// The live view.
pub(super) struct Watch {
    pub(super) machine: String,
    pub(super) rate_hz: f64,
    pub(super) channels: Vec<Channel>,
    pub(super) resolutions_mm: [f64; 3],
    telemetry: TelemetryRecorder,
    pub(super) window_s: f64,
    /// The picture that stands still, if it does.
    frozen: Option<Samples>,
    /// Place of the cursor in a frozen picture, from the left, as a share of the window.
    pub(super) cursor: f64,
    pub(super) status: Status,
    pub(super) inputs: Inputs,
    pub(super) learning: Learning,
    pub(super) fault: Option<FaultReport>,
    pub(super) gains: Vec<Gain>,
    /// Number of the gain that is nudged.
    pub(super) chosen: usize,
    /// A capture was armed here, and is to be read.
    pub(super) capturing: bool,
    pub(super) message: String,
    pub(super) help: bool,
    /// The person knows that the outputs are on.
    warned: bool,
    /// The key that was pressed once, and that is to be pressed again for what it starts.
    asked: Option<char>,
    csv: PathBuf,
    written: Vec<PathBuf>,
}

impl Watch {
    /// Begins to watch.
    ///
    /// # Errors
    /// A window out of its bounds, a refused selection, a gain that is no number, or a connection that is broken.
    pub(super) fn start(client: &mut Client, options: &WatchOptions) -> anyhow::Result<Self> {
        ensure!(
            (WINDOW_S.0..=WINDOW_S.1).contains(&options.window),
            "--window {} s is outside {} to {}",
            options.window,
            WINDOW_S.0,
            WINDOW_S.1
        );
        let identity = client.identity().clone();
        let every = (options.window * identity.rate_hz / MOST_SAMPLES).ceil() as u16;
        let every = every.max(least_decimation(options.channels.len(), identity.rate_hz));
        let (status, inputs, fault) = (client.status()?, client.inputs()?, client.fault()?);
        let learning = client.learning()?;
        let gains = gains(client, options)?;
        let resolutions_mm = settings::resolutions_mm(client)?;
        let _ = client.take_notices();
        Ok(Self {
            machine: format!("{}: {}", client.endpoint(), identity.board),
            rate_hz: identity.rate_hz,
            channels: options.channels.clone(),
            resolutions_mm,
            telemetry: TelemetryRecorder::start(client, &options.channels, every)?,
            window_s: options.window,
            frozen: None,
            cursor: 1.0,
            status,
            inputs,
            learning,
            fault,
            gains,
            chosen: 0,
            capturing: false,
            message: "? shows the keys".to_owned(),
            help: false,
            warned: false,
            asked: None,
            csv: options.csv.clone(),
            written: Vec::new(),
        })
    }

    /// Takes what the machine reports within `time`.
    ///
    /// # Errors
    /// A connection that is broken.
    pub(super) fn look(&mut self, client: &mut Client, time: Duration) -> anyhow::Result<()> {
        self.telemetry.gather(client, time)?;
        self.telemetry.keep_last(self.room());
        self.status = client.status()?;
        self.inputs = client.inputs()?;
        self.learning = client.learning()?;
        let reported = self.fault.as_ref().map(|fault| fault.code);
        if self.status.fault != reported {
            self.fault = client.fault()?;
        }
        let rate_hz = self.rate_hz;
        for notice in client.take_notices() {
            if !matches!(notice, Notice::Telemetry(_))
                && let Some((line, _)) = observe::line(&notice, rate_hz)
            {
                line.trim().clone_into(&mut self.message);
            }
        }
        if self.capturing && self.status.capture == CapturePhase::Frozen {
            self.capturing = false;
            let (samples, record) = read_capture(client, READING)?;
            self.write(&samples)?;
            self.message = format!("captured by {:?}: {}", record.cause, self.csv.display());
        }
        Ok(())
    }

    /// Samples that the widest window shows.
    fn room(&self) -> usize {
        (WINDOW_S.1 / self.telemetry.samples().sample_time_s) as usize
    }

    /// The samples that are shown, and the first of them.
    pub(super) fn shown(&self) -> (&Samples, usize) {
        let samples = self.frozen.as_ref().unwrap_or(self.telemetry.samples());
        let shown = (self.window_s / samples.sample_time_s) as usize;
        (samples, samples.len().saturating_sub(shown.max(2)))
    }

    pub(super) fn is_frozen(&self) -> bool {
        self.frozen.is_some()
    }

    /// Does what a key asks for. What the machine refuses becomes the message.
    ///
    /// # Errors
    /// A connection that is broken, or a file that cannot be written.
    pub(super) fn press(&mut self, client: &mut Client, key: KeyEvent) -> anyhow::Result<Going> {
        let fast = key.modifiers.contains(KeyModifiers::SHIFT);
        let step = if fast { STEPS.1 } else { STEPS.0 };
        if !matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) {
            self.warned = false;
        }
        let asked = self.asked.take();
        match key.code {
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => {
                // The first stops, a second disables.
                let rests = self.status.is_at_rest();
                self.order(client, if rests { Body::Disable } else { Body::Stop })?;
            }
            KeyCode::Char('?' | 'h') => self.help = !self.help,
            KeyCode::Char('q') | KeyCode::Esc => return Ok(self.leave()),
            KeyCode::Char(' ') => self.freeze(),
            KeyCode::Left => self.cursor = (self.cursor - step).max(0.0),
            KeyCode::Right => self.cursor = (self.cursor + step).min(1.0),
            KeyCode::Char('[') => self.window_s = (self.window_s / ZOOM).max(WINDOW_S.0),
            KeyCode::Char(']') => self.window_s = (self.window_s * ZOOM).min(WINDOW_S.1),
            KeyCode::Up => self.chosen = self.chosen.saturating_sub(1),
            KeyCode::Down => {
                self.chosen = (self.chosen + 1).min(self.gains.len().saturating_sub(1));
            }
            KeyCode::Char('+' | '=') => self.nudge(client, |gain| gain.value * NUDGE)?,
            KeyCode::Char('-') => self.nudge(client, |gain| gain.value / NUDGE)?,
            KeyCode::Char('u') => self.nudge(client, |gain| gain.original)?,
            KeyCode::Char('s') => self.order(client, Body::Stop)?,
            KeyCode::Char('d') => self.order(client, Body::Disable)?,
            KeyCode::Char(key @ ('e' | 'g')) if asked != Some(key) => self.ask(key),
            KeyCode::Char('e') => self.order(client, Body::Enable)?,
            KeyCode::Char('r') => self.order(client, Body::ResetFault)?,
            KeyCode::Char('g') => self.order(client, Body::Run)?,
            KeyCode::Char('c') => self.arm(client, Trigger::MotionStart)?,
            KeyCode::Char('f') => self.arm(client, Trigger::Fault)?,
            KeyCode::Char('w') => {
                let (samples, first) = self.shown();
                let shown = samples.from(first);
                self.write(&shown)?;
                self.message = format!("written: {}", self.csv.display());
            }
            _ => {}
        }
        Ok(Going::On)
    }

    /// Leaves the outputs on only if that was asked for twice.
    fn leave(&mut self) -> Going {
        if !self.status.state.drives() || self.warned {
            return Going::Leave;
        }
        self.warned = true;
        "the outputs are on: d switches them off, q once more leaves them on"
            .clone_into(&mut self.message);
        Going::On
    }

    /// Asks for a key once more before anything is enabled or moves.
    fn ask(&mut self, key: char) {
        self.asked = Some(key);
        self.message = match key {
            'e' => "e once more switches the outputs on",
            _ => "g once more starts the plan: the axes move",
        }
        .to_owned();
    }

    fn freeze(&mut self) {
        self.cursor = 1.0;
        self.frozen = match self.frozen {
            Some(_) => None,
            None => Some(self.telemetry.samples().clone()),
        };
    }

    fn order(&mut self, client: &mut Client, body: Body) -> anyhow::Result<()> {
        client.resume();
        let name = body.name();
        let outcome = client.order(body);
        self.say(outcome.map(|()| name.to_owned()))
    }

    /// Changes the chosen gain at once.
    fn nudge(&mut self, client: &mut Client, to: impl FnOnce(&Gain) -> f64) -> anyhow::Result<()> {
        let Some(gain) = self.gains.get_mut(self.chosen) else {
            return Ok(());
        };
        let value = to(gain);
        client.resume();
        let outcome = settings::set(client, &whole_path(&gain.path), &format!("{value:e}"))
            .and_then(|()| settings::apply(client));
        let path = gain.path.clone();
        match outcome {
            Ok(_) => gain.value = value,
            // The draft goes back to the settings in force.
            Err(_) => {
                let revert = quadrant_link::message::SettingsRequest::Revert;
                client.order(Body::Settings(revert))?;
            }
        }
        self.say(outcome.map(|_| format!("{path} = {value:.6}")))
    }

    fn arm(&mut self, client: &mut Client, trigger: Trigger) -> anyhow::Result<()> {
        let outcome = arm(client, &self.channels, 1, BEFORE_TRIGGER, trigger);
        self.capturing = outcome.is_ok();
        self.say(outcome.map(|_| "capture armed".to_owned()))
    }

    /// Reports an outcome; only a connection that is broken ends the watching.
    fn say(&mut self, outcome: Result<String, ClientError>) -> anyhow::Result<()> {
        match outcome {
            Ok(done) => self.message = done,
            Err(error @ (ClientError::Connection { .. } | ClientError::Silent { .. })) => {
                return Err(error.into());
            }
            Err(error) => self.message = error.to_string(),
        }
        Ok(())
    }

    fn write(&mut self, samples: &Samples) -> anyhow::Result<()> {
        for path in columns::write(samples, &self.csv, &self.resolutions_mm)? {
            if !self.written.contains(&path) {
                self.written.push(path);
            }
        }
        Ok(())
    }

    /// Ends the watching; gives the files that were written.
    ///
    /// # Errors
    /// A connection that is broken.
    pub(super) fn finish(self, client: &mut Client) -> Result<Vec<PathBuf>, ClientError> {
        self.telemetry.finish(client)?;
        Ok(self.written)
    }
}

/// The gains that are nudged, as they are.
fn gains(client: &mut Client, options: &WatchOptions) -> anyhow::Result<Vec<Gain>> {
    let mut paths = options.gain.clone();
    if paths.is_empty() {
        for axis in AxisName::ALL {
            let is_shown =
                |channel: &Channel| matches!(channel, Channel::Axis(of, _) if *of == axis);
            if options.channels.iter().any(is_shown) {
                paths.extend(GAINS.map(|gain| format!("{axis}/feedback/pid/{gain}")));
            }
        }
    }
    paths
        .into_iter()
        .map(|path| {
            let value = settings::get(client, &whole_path(&path))?;
            let value = value
                .as_f64()
                .ok_or_else(|| anyhow::anyhow!("--gain {path} is {value}, and no number"))?;
            Ok(Gain {
                path,
                value,
                original: value,
            })
        })
        .collect()
}
