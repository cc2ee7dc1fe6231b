//! `commission`: the connected axis from unknown to settings that it runs on.

use anyhow::Context;
use clap::Args;
use quadrant::link::message::Body;
use quadrant::safety::AxisName;
use quadrant_sim::console::rig::{ConnectedAxis, room_mm};
use quadrant_sim::console::{Client, settings};
use quadrant_sim::settings_file::SettingsFile;
use serde_json::json;

use super::command::axis_parser;
use super::drive::Answer;
use crate::cli::commission::Request;
use crate::cli::output::Output;

/// Options of `commission`.
#[derive(Clone, Debug, Args)]
pub(super) struct Options {
    /// The axis: x, y or z. It must stand where it can move by the travel either way.
    #[arg(long, value_parser = axis_parser())]
    axis: AxisName,
    /// How far the axis may go from where it stands, either way, mm; without it, as far as its soft limits, once it is homed.
    #[arg(long, value_name = "MM", value_parser = travel)]
    travel: Option<f64>,
    /// Let the settings that were found act on the machine. Without it the machine keeps those that it had.
    #[arg(long)]
    apply: bool,
    /// Keep them in the machine's flash too.
    #[arg(long, requires = "apply")]
    store: bool,
    #[command(flatten)]
    request: Request,
    #[command(flatten)]
    output: Output,
}

/// Reads a travel.
pub(super) fn travel(text: &str) -> Result<f64, String> {
    const MOST_MM: f64 = 1e4;
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if value > 0.0 && value <= MOST_MM {
        Ok(value)
    } else {
        Err(format!("it must be above 0 and at most {MOST_MM} mm"))
    }
}

/// The travel that is given, else that to the soft limits.
pub(super) fn travel_mm(
    client: &mut Client,
    axis: AxisName,
    given: Option<f64>,
) -> anyhow::Result<f64> {
    match given {
        Some(travel_mm) => Ok(travel_mm),
        None => room_mm(client, axis)?.with_context(|| {
            format!(
                "{axis} is not homed, or has no travel: home it and move it to the middle of its travel, or say with \
                 --travel how far it may go from where it stands"
            )
        }),
    }
}

pub(super) fn run(client: &mut Client, options: &Options) -> anyhow::Result<Answer> {
    let Options { axis, output, .. } = options;
    let travel_mm = travel_mm(client, *axis, options.travel)?;
    let mut test_axis = ConnectedAxis::new(client, *axis, travel_mm)?;
    let before = test_axis.stage().clone();
    let base = &before.axes[*axis as usize];
    let outcome = options.request.run(&mut test_axis, base, output.seed);
    // Whatever came of it, the outputs go off, and the machine has the settings that it had.
    client.order(Body::Disable)?;
    settings::load(client, &before).context("the machine did not take its old settings back")?;
    let found = outcome?;

    let mut file = SettingsFile::new(before);
    let board = client.identity().board.clone();
    let who = format!("the {axis} axis of {} ({board})", client.endpoint());
    let mut text = found.text();
    for line in found.keep(output, &mut file, *axis, &who)? {
        text.push_str(&line);
        text.push('\n');
    }
    if options.apply {
        settings::load(client, &file.stage).context("the settings that were found")?;
        text.push_str("The settings act; the outputs are off.\n");
    }
    if options.store {
        let origin = format!("quadrant {} commission {axis}", env!("CARGO_PKG_VERSION"));
        settings::store(client, &origin)?;
        text.push_str("They are kept for the next start.\n");
    }
    let verdict: Vec<_> = found
        .found
        .verdicts
        .iter()
        .map(|verdict| json!({ "law": verdict.law, "rms_um": 1e3 * verdict.score.rms_mm }))
        .collect();
    let data = json!({
        "settings": output.file("settings.toml")?,
        "verdict": verdict,
        "applied": options.apply,
        "stored": options.store,
    });
    Ok(Answer::new(text.trim_end(), data))
}
