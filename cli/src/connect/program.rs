//! Plans and part programs.

use std::f64::consts::TAU;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, bail};
use indicatif::ProgressBar;
use quadrant::app::Translated;
use quadrant_cli::warn;
use quadrant_gcode::{Limits, Program, Trajectory};
use quadrant_host::client::set_points::{references_mm, set_points, stream};
use quadrant_host::client::{Client, settings, settle};
use quadrant_law::reference::{Sense, circle};
use quadrant_link::message::Body;
use quadrant_settings::PlanSettings;
use serde_json::json;

use super::answer::Answer;
use super::command::{CircleOptions, StreamOptions};

pub(super) fn plan(client: &mut Client, file: &Path) -> anyhow::Result<Answer> {
    let text =
        std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    let plan: PlanSettings =
        toml::from_str(&text).with_context(|| format!("{} is no plan", file.display()))?;
    client.order(Body::SetPlan(Translated::translated(plan)))?;
    Ok(Answer::new("`run` starts it", json!(plan)))
}

pub(super) fn circle_plan(client: &mut Client, options: &CircleOptions) -> anyhow::Result<Answer> {
    for (name, value, most) in [
        ("--radius-mm", options.radius_mm, 1e4),
        ("--feed-mm-min", options.feed_mm_min, 1e6),
        ("--turns", options.turns, 1e6),
        ("--lead-s", options.lead_s, 60.0),
    ] {
        if !(value > 0.0 && value <= most) {
            bail!("{name} {value}: it must be above 0 and at most {most}");
        }
    }
    let sense = if options.clockwise {
        Sense::Clockwise
    } else {
        Sense::CounterClockwise
    };
    let feed_mm_s = options.feed_mm_min / 60.0;
    let rate_hz = client.identity().rate_hz;
    let closed = Closed::new(options, feed_mm_s, rate_hz);
    let motions = circle(
        options.plane.plane(),
        sense,
        options.radius_mm,
        closed.feed_mm_s,
        0.0,
        closed.turns,
        closed.lead_s,
    );
    client.order(Body::SetPlan(Translated::translated(PlanSettings {
        motions,
    })))?;
    let duration_s = closed.duration_s;
    let text = format!(
        "a circle of {} mm in {} at {feed_mm_s:.3} mm/s: {duration_s:.3} s, {} from where the axes stand and back; `run` starts it",
        options.radius_mm,
        options.plane.name(),
        match closed.around {
            1.0 => "once around".to_owned(),
            around => format!("{around} times around"),
        }
    );
    Ok(Answer::new(text, json!({ "duration_s": duration_s })))
}

/// A circle that ends where it began: lead-in and lead-out are parts of its last turn.
struct Closed {
    /// A little below what was asked for, so that it closes with a whole control tick.
    feed_mm_s: f64,
    /// Turns at full feed: those that were asked for, and what closes the circle.
    turns: f64,
    /// Turns in all.
    around: f64,
    lead_s: f64,
    duration_s: f64,
}

impl Closed {
    fn new(options: &CircleOptions, feed_mm_s: f64, rate_hz: f64) -> Self {
        let turn_mm = TAU * options.radius_mm;
        let lead_ticks = (options.lead_s * rate_hz).round().max(1.0);
        let lead_s = lead_ticks / rate_hz;
        // Lead-in and lead-out turn half as far as full feed would.
        let least = options.turns + lead_s * feed_mm_s / turn_mm;
        let around = (least - SLACK).ceil();
        let ticks = (around * turn_mm / feed_mm_s * rate_hz).ceil();
        Self {
            feed_mm_s: around * turn_mm * rate_hz / ticks,
            turns: around * (ticks - lead_ticks) / ticks,
            around,
            lead_s,
            duration_s: (ticks + lead_ticks) / rate_hz,
        }
    }
}

/// Share of a turn that a circle may lack of what was asked for, rather than turn once more.
const SLACK: f64 = 1e-6;

pub(super) fn stream_program(
    client: &mut Client,
    options: &StreamOptions,
) -> anyhow::Result<Answer> {
    let program =
        Program::read(&options.file).with_context(|| options.file.display().to_string())?;
    for note in program.notes() {
        warn!("note: {note}");
    }
    let stage = settings::in_force(client)?;
    let status = settle::rest(client, Duration::from_secs(60))?;
    let origin_mm = references_mm(&status);
    let mut limits = Limits {
        corner_deviation_mm: options.corner_deviation_mm,
        ..Limits::of(&stage)
    };
    // What the machine refuses itself is refused here with the program's line.
    for (axis, travel) in limits.travel_mm.iter_mut().enumerate() {
        if let Some(settings) = stage.axes[axis].limits.travel_mm {
            *travel = (
                settings.negative - origin_mm[axis],
                settings.positive - origin_mm[axis],
            );
        }
    }
    let trajectory =
        Trajectory::plan(&program, &limits).with_context(|| options.file.display().to_string())?;
    let points = set_points(&trajectory, stage.rate_hz, options.period_ticks, origin_mm);
    let bar = ProgressBar::new(points.len() as u64);
    let began = client.now();
    stream(client, &points, options.period_ticks, &mut |_, sent| {
        bar.set_position(sent as u64);
        Ok(())
    })?;
    let rest = Duration::from_secs_f64(trajectory.duration_s() + 10.0);
    settle::rest(client, rest)?;
    bar.finish_and_clear();
    let took_s = client.now().saturating_sub(began).as_secs_f64();
    let text = format!(
        "{} moves, {:.3} mm in {:.3} s: {} set points, one every {} ticks",
        trajectory.moves().len(),
        trajectory.length_mm(),
        trajectory.duration_s(),
        points.len(),
        options.period_ticks
    );
    let data = json!({
        "moves": trajectory.moves().len(),
        "length_mm": trajectory.length_mm(),
        "duration_s": trajectory.duration_s(),
        "set_points": points.len(),
        "took_s": took_s,
    });
    Ok(Answer::new(text, data))
}
