//! `scope`: channels in the terminal while they are sampled.

use std::io::{IsTerminal, stdout};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, bail};
use quadrant_cli::terminal;
use quadrant_host::client::samples::{Samples, TelemetryRecorder, least_decimation};
use quadrant_host::client::{columns, plot, settings};
use quadrant_link::message::Channel;
use quadrant_report::{Figure, Lines, Plot, Series, Style, stacked_svg};
use quadrant_written::{fixed, whole};
use serde_json::json;

use super::answer::{Answer, seconds};
use super::command::ScopeOptions;
use super::session::Session;

/// Time from one picture to the next.
const PICTURE: Duration = Duration::from_millis(100);
/// Most characters of a line and lines of a channel.
const MOST_SIZE: usize = 1000;
/// Fewest characters of a line.
const LEAST_WIDTH: usize = 20;
/// Lines of a channel, unless asked for otherwise.
const HEIGHT: usize = 6;

pub(super) fn run(session: &mut Session, options: &ScopeOptions) -> anyhow::Result<Answer> {
    let duration = seconds("--seconds", options.seconds)?;
    let window = seconds("--window", options.window)?;
    let [width, height] = match options.size.as_deref() {
        None => [
            terminal::output_width().clamp(LEAST_WIDTH, MOST_SIZE),
            HEIGHT,
        ],
        Some(&[width, height]) => [width, height],
        Some(_) => bail!("--size: give width and height"),
    };
    if !(LEAST_WIDTH..=MOST_SIZE).contains(&width) || !(1..=MOST_SIZE).contains(&height) {
        bail!(
            "--size {width} {height}: give {LEAST_WIDTH} to {MOST_SIZE} characters and 1 to {MOST_SIZE} lines"
        );
    }
    let live = stdout().is_terminal() && !session.printer.json;
    let client = &mut session.client;
    let resolutions_mm = settings::resolutions_mm(client)?;
    let every = least_decimation(options.channels.len(), client.identity().rate_hz);
    let mut recording = TelemetryRecorder::start(client, &options.channels, every)?;
    let due = client.now() + duration;
    while client.now() < due {
        let left = due.saturating_sub(client.now());
        recording.gather(client, left.min(PICTURE))?;
        if live {
            let picture = draw(
                recording.samples(),
                window,
                [width, height],
                &resolutions_mm,
            );
            terminal::clear();
            terminal::print(format_args!("{picture}"));
        }
    }
    let samples = recording.finish(client)?;
    if samples.is_empty() {
        bail!("no sample came");
    }
    let picture = draw(&samples, window, [width, height], &resolutions_mm);
    let mut files = Vec::new();
    if let Some(path) = &options.csv {
        files.extend(columns::write(&samples, path, &resolutions_mm)?);
    }
    if let Some(path) = &options.svg {
        let image = stacked_svg(&figures(&samples, &resolutions_mm))?;
        write(path, image.as_bytes())?;
        files.push(path.clone());
    }
    let data = json!({
        "files": files,
        "samples": samples.len(),
        "lost": samples.lost(),
        "sample_time_s": samples.sample_time_s,
    });
    // The last picture of a live scope is on the screen already.
    Ok(Answer::new(
        if live { String::new() } else { picture },
        data,
    ))
}

fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    whole::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// The end of the samples, as much as `window` shows, one channel below the other.
fn draw(
    samples: &Samples,
    window: Duration,
    [width, height]: [usize; 2],
    resolutions_mm: &[f64; 3],
) -> String {
    let shown = ((window.as_secs_f64() / samples.sample_time_s) as usize).max(2);
    let first = samples.len().saturating_sub(shown);
    let mut text = String::new();
    for (index, &channel) in samples.channels.iter().enumerate() {
        let values = columns::values_mm(samples, index, resolutions_mm);
        let part = &values[first.min(values.len())..];
        text.push_str(&heading(channel, part));
        for line in plot::curve(part, width, height) {
            text.push_str(line.trim_end());
            text.push('\n');
        }
    }
    let time_s = samples.time_s();
    if let (Some(from), Some(to)) = (time_s.get(first), time_s.last()) {
        text.push_str(&format!(
            "{from:.3} s to {to:.3} s, one sample every {:.4} ms, {} lost\n",
            1e3 * samples.sample_time_s,
            samples.lost()
        ));
    }
    text
}

/// A channel's name, and what its values come to.
fn heading(channel: Channel, values: &[f64]) -> String {
    let count = values.len().max(1) as f64;
    let rms = (values.iter().map(|value| value * value).sum::<f64>() / count).sqrt();
    let last = values.last().copied().unwrap_or(f64::NAN);
    format!(
        "{channel}, {unit}: now {last}, RMS {rms:.5}\n",
        unit = channel.physical_unit(),
        last = fixed(last, 5)
    )
}

/// A figure for each unit, in the order of the channels.
fn figures(samples: &Samples, resolutions_mm: &[f64; 3]) -> Vec<Figure> {
    let time_s = samples.time_s();
    let mut units: Vec<(&str, Vec<Series>)> = Vec::new();
    for (index, &channel) in samples.channels.iter().enumerate() {
        let series = Series {
            name: channel.to_string(),
            x: time_s.clone(),
            y: columns::values_mm(samples, index, resolutions_mm),
            style: Style::nth(index),
        };
        let unit = channel.physical_unit();
        match units.iter_mut().find(|(known, _)| *known == unit) {
            Some((_, of_unit)) => of_unit.push(series),
            None => units.push((unit, vec![series])),
        }
    }
    units
        .into_iter()
        .map(|(unit, series)| Figure {
            id: "scope".to_owned(),
            caption: "Sampled by telemetry.".to_owned(),
            plot: Plot::Lines(Lines {
                x_label: "Time, s".to_owned(),
                y_label: unit.to_owned(),
                series,
                ..Lines::default()
            }),
        })
        .collect()
}
