//! Recordings, captures and events of the connected machine.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use quadrant_host::client::samples::{
    Samples, TelemetryRecorder, arm, capture_state, disarm, least_decimation, read_capture,
};
use quadrant_host::client::{Client, ClientError, columns, settings};
use quadrant_link::message::{CaptureStatus, Channel, Edge, Event, Level, Notice, Trigger};
use serde_json::{Value, json};

use super::answer::{Answer, name, seconds};
use super::command::{ArmOptions, CaptureCommand, CrossedEdge, RecordOptions, TriggerEvent};
use super::machine::fault_name;
use super::session::Session;

/// Time from one look at what has come to the next.
const LOOK: Duration = Duration::from_millis(50);
/// Time recorded after the axes have come to rest, and for the last block to come.
const TAIL: Duration = Duration::from_millis(100);
/// Longest recording without a duration, s.
const MOST: Duration = Duration::from_secs(3600);

/// Lists the channels whose name begins like this.
pub(super) fn channels(prefix: &str) -> Answer {
    let found: Vec<(String, &str)> = Channel::all()
        .map(|channel| (channel.to_string(), channel.unit()))
        .filter(|(name, _)| name.starts_with(prefix))
        .collect();
    let lines: Vec<String> = found
        .iter()
        .map(|(name, unit)| format!("{name:<22} {unit}").trim_end().to_owned())
        .collect();
    let data = found
        .iter()
        .map(|(name, unit)| json!({ "channel": name, "unit": unit }))
        .collect();
    Answer::new(lines.join("\n"), data)
}

/// Records channels, and writes them; `then` is run once sampling has begun, and says if it succeeded.
pub(super) fn record(
    session: &mut Session,
    options: &RecordOptions,
    then: impl FnOnce(&mut Session) -> bool,
) -> anyhow::Result<Answer> {
    let due = match options.seconds {
        Some(time_s) => Some(seconds("--seconds", time_s)?),
        None => None,
    };
    let client = &mut session.client;
    let resolutions_mm = settings::resolutions_mm(client)?;
    let rate_hz = client.identity().rate_hz;
    let every = options
        .every
        .unwrap_or_else(|| least_decimation(options.channels.len(), rate_hz));
    let mut recording = TelemetryRecorder::start(client, &options.channels, every)?;
    let began = client.now();
    let ran = then(session);
    if !ran && !session.client.is_interrupted() {
        recording.finish(&mut session.client)?;
        bail!("record: nothing was written");
    }
    let client = &mut session.client;
    let ended = if ran {
        until_rest(&mut recording, client, due.map(|due| (began, due)))
    } else {
        recording.gather(client, TAIL)
    };
    // What has come is kept, whatever ended it.
    let ended = ended.and(recording.stop(client));
    let mut samples = recording.into_samples();
    if let Some(due) = due {
        samples.truncate((due.as_secs_f64() / samples.sample_time_s).round() as usize);
    }
    let files = write(&samples, &options.out, &resolutions_mm, options.allow_gaps);
    match (ended, files) {
        (Ok(()), files) => Ok(written(&samples, &files?)),
        (Err(error), Ok(files)) => {
            let until_then = written(&samples, &files).text;
            Err(anyhow::Error::new(error).context(format!("{until_then}, until then")))
        }
        (Err(error), Err(unwritten)) => Err(anyhow::Error::new(error).context(unwritten)),
    }
}

/// Takes the samples that come until the axes rest, or for a time.
///
/// # Errors
/// An interruption, or a connection that is broken.
fn until_rest(
    recording: &mut TelemetryRecorder,
    client: &mut Client,
    due: Option<(Duration, Duration)>,
) -> Result<(), ClientError> {
    loop {
        let left = due.map_or(MOST, |(began, lasts)| {
            lasts.saturating_sub(client.now().saturating_sub(began))
        });
        if left.is_zero() {
            break;
        }
        recording.gather(client, left.min(LOOK))?;
        if due.is_none() && !client.status()?.running {
            break;
        }
    }
    recording.gather(client, TAIL)
}

fn write(
    samples: &Samples,
    out: &Path,
    resolutions_mm: &[f64; 3],
    allow_gaps: bool,
) -> anyhow::Result<Vec<PathBuf>> {
    if samples.is_empty() {
        bail!("no sample came; nothing was written");
    }
    if samples.lost() > 0 && !allow_gaps {
        bail!(
            "{} of {} samples were lost, so nothing was written; select fewer channels, sample less often (--every), or take \
             them with gaps (--allow-gaps); for the full rate there is `capture`",
            samples.lost(),
            samples.lost() + samples.len() as u64
        );
    }
    Ok(columns::write(samples, out, resolutions_mm)?)
}

fn written(samples: &Samples, files: &[PathBuf]) -> Answer {
    let names: Vec<String> = files
        .iter()
        .map(|file| file.display().to_string())
        .collect();
    let text = format!(
        "{}: {} samples of {} channels, one every {:.4} ms{}",
        names.join(", "),
        samples.len(),
        samples.channels.len(),
        1e3 * samples.sample_time_s,
        match samples.lost() {
            0 => String::new(),
            lost => format!("; {lost} samples are missing"),
        }
    );
    let data = json!({
        "files": files,
        "samples": samples.len(),
        "lost": samples.lost(),
        "sample_time_s": samples.sample_time_s,
        "first_tick": samples.first_tick,
    });
    Answer::new(text, data)
}

pub(super) fn capture(client: &mut Client, command: &CaptureCommand) -> anyhow::Result<Answer> {
    match command {
        CaptureCommand::Arm(options) => {
            let status = arm(
                client,
                &options.channels,
                options.every,
                options.pre_trigger,
                trigger(options),
            )?;
            Ok(state(&status))
        }
        CaptureCommand::State => Ok(state(&capture_state(client)?)),
        CaptureCommand::Stop => Ok(state(&disarm(client)?)),
        CaptureCommand::Read { out, timeout } => {
            let timeout = seconds("--timeout", *timeout)?;
            let (samples, record) = read_capture(client, timeout)?;
            let resolutions_mm = settings::resolutions_mm(client)?;
            let files = write(&samples, out, &resolutions_mm, false).context("capture")?;
            let mut answer = written(&samples, &files);
            answer.text.push_str(&format!(
                "; frozen by {} at tick {}, {:.4} ms from the first",
                name(&record.cause),
                record.trigger_tick,
                1e3 * samples.sample_time_s * f64::from(record.trigger_sample)
            ));
            answer.data["record"] = json!(record);
            Ok(answer)
        }
    }
}

fn trigger(options: &ArmOptions) -> Trigger {
    if let (Some(channel), Some(level)) = (options.channel, options.level) {
        let edge = match options.edge {
            CrossedEdge::Rising => Edge::Rising,
            CrossedEdge::Falling => Edge::Falling,
            CrossedEdge::Either => Edge::Either,
        };
        return Trigger::Level(Level {
            channel,
            edge,
            level,
        });
    }
    match options.on {
        TriggerEvent::Now => Trigger::Now,
        TriggerEvent::Command => Trigger::Command,
        TriggerEvent::Motion => Trigger::MotionStart,
        TriggerEvent::Fault => Trigger::Fault,
    }
}

fn state(status: &CaptureStatus) -> Answer {
    let channels: Vec<String> = status.channels.iter().map(ToString::to_string).collect();
    let mut text = format!("capture {}: {}", status.number, name(&status.phase));
    if !channels.is_empty() {
        text.push_str(&format!(
            ", {} every {} ticks",
            channels.join(","),
            status.decimation
        ));
    }
    if let Some(record) = &status.record {
        text.push_str(&format!(
            "; {} samples, frozen by {} at tick {}",
            record.samples,
            name(&record.cause),
            record.trigger_tick
        ));
    }
    let mut data = json!(status);
    data["channels"] = json!(channels);
    Answer::new(text, data)
}

pub(super) fn events(session: &mut Session, time_s: f64) -> anyhow::Result<Answer> {
    let due = session.client.now() + seconds("events", time_s)?;
    let rate_hz = session.client.identity().rate_hz;
    let mut shown = 0;
    // What has come, and at least what is on its way.
    session.client.wait(Duration::from_millis(5))?;
    loop {
        for notice in session.client.take_notices() {
            if let Some((text, data)) = line(&notice, rate_hz) {
                session.printer.result("events", &text, &data);
                shown += 1;
            }
        }
        let left = due.saturating_sub(session.client.now());
        if left.is_zero() {
            return Ok(Answer::new("", json!({ "events": shown })));
        }
        session.client.wait(left.min(LOOK))?;
    }
}

/// A notice as a line.
pub(super) fn line(notice: &Notice, rate_hz: f64) -> Option<(String, Value)> {
    match notice {
        Notice::Event {
            sequence,
            tick,
            event,
        } => Some((
            format!("{:>12.4} s  {}", f64::from(*tick) / rate_hz, said(event)),
            json!({ "sequence": sequence, "tick": tick, "event": event }),
        )),
        Notice::Log(text) => Some((text.as_str().to_owned(), json!({ "log": text }))),
        Notice::Telemetry(_) => None,
    }
}

/// An event in words, a fault by its name.
fn said(event: &Event) -> String {
    let (code, more) = match event {
        Event::Fault { code, .. } => (code, "; `fault` says more"),
        Event::Stopping { code, .. } | Event::Held { code, .. } => (code, ""),
        _ => return event.to_string(),
    };
    let number = format!("fault {code}");
    let named = format!("{number}{}", fault_name(*code));
    format!("{}{more}", event.to_string().replacen(&number, &named, 1))
}

#[cfg(test)]
mod tests {
    use quadrant_host::machine::SimulatedLink;
    use quadrant_sim::stage_setup::StageSetup;

    use super::*;
    use crate::connect::printer::Printer;

    /// The samples and the answer of a recording of half a minute during which `then` runs.
    fn recorded(then: impl FnOnce(&mut Session) -> bool) -> (usize, anyhow::Result<Answer>) {
        let folder = tempfile::tempdir().unwrap();
        let link = SimulatedLink::start(&StageSetup::commissioned(), 1, None).unwrap();
        let client = Client::open(link).unwrap();
        let mut session = Session::new(client, Printer { json: false });
        let channels = ["x.reference", "x.position", "x.error", "x.output"];
        let options = RecordOptions {
            channels: channels.map(|name| name.parse().unwrap()).to_vec(),
            seconds: Some(30.0),
            every: None,
            out: folder.path().join("run.csv"),
            allow_gaps: false,
            then: Vec::new(),
        };
        let answer = record(&mut session, &options, then);
        let text = std::fs::read_to_string(&options.out).unwrap();
        (text.lines().count(), answer)
    }

    #[test]
    fn a_recording_that_is_interrupted_is_written_up_to_there() {
        let then = |session: &mut Session| {
            session.client.wait(Duration::from_secs(2)).unwrap();
            session.client.interrupt().request();
            true
        };
        let (rows, answer) = recorded(then);
        let said = quadrant_cli::explained(&answer.err().unwrap());
        assert!(
            said.contains("run.csv") && said.contains("interrupted"),
            "{said}"
        );
        // The command after it may be what is interrupted.
        let (same, answer) = recorded(|session| {
            then(session);
            session.client.wait(Duration::from_secs(1)).is_ok()
        });
        assert!(answer.is_ok());
        let (all, _) = recorded(|_| true);
        assert!(rows > 100 && same < all / 5, "{rows} {same} {all}");
    }
}
