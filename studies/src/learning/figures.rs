//! The study's figures: the scale settling after a step of friction, and a slot with and without.

use quadrant_pages::parts::{lines, series};
use quadrant_report::{Figure, Series, Style, decimate};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::cutting::Milling;

use super::run::{Phase, SINE, Trace, cycle_s, nominal, run, slot, under_pid};
use crate::competitor::Feedforward;

/// Cycles before the step of friction.
const BEFORE: f64 = 0.75;
/// Cycles after it.
const AFTER: f64 = 2.25;
/// Friction after the step, over that before.
const STEPPED: f64 = 1.5;

/// Cycles of the slot.
const SLOT: f64 = 3.25;
/// Start of what is shown before the end of the slot, and its length, s: a reversal.
const SHOWN_S: (f64, f64) = (10.3, 1.2);

/// Points of a curve: as many as a page's width shows.
const POINTS: usize = 600;

fn curve(name: &str, values: &[f64], period_s: f64, style: usize) -> Series {
    let time: Vec<f64> = (0..values.len()).map(|k| k as f64 * period_s).collect();
    let kept = decimate(&time, values, POINTS);
    let rounded = |value: f64| (1e4 * value).round() / 1e4;
    series(
        name,
        kept.iter().map(|&k| rounded(time[k])).collect(),
        kept.iter().map(|&k| rounded(values[k])).collect(),
        Style::nth(style),
    )
}

/// The figures, each run with its phases under the axis' PID.
///
/// # Errors
/// Settings that are refused, or a fault.
pub(super) fn figures(
    stage: &StageSettings,
    axis: &AxisSettings,
    seed: u64,
) -> anyhow::Result<[Figure; 3]> {
    let period_s = 1.0 / stage.rate_hz;
    let traces = |feedforward: Feedforward, phases: &[Phase]| -> anyhow::Result<Trace> {
        let axis = under_pid(axis, feedforward);
        let mut whole = Trace::default();
        for part in run(stage, &axis, phases, seed)? {
            whole.error_um.extend(part.error_um);
            whole.scale.extend(part.scale);
        }
        Ok(whole)
    };
    let step = [
        Phase::sine(SINE, BEFORE, nominal()),
        Phase::sine(SINE, AFTER, nominal().with_friction(STEPPED)),
    ];
    let learning = traces(Feedforward::Learning, &step)?;
    let fixed = traces(Feedforward::Fixed, &step)?;
    let stepped_s = BEFORE * cycle_s(SINE);
    let scale: Vec<f64> = learning.scale.iter().copied().map(f64::from).collect();
    let true_scale: Vec<f64> = (0..scale.len())
        .map(|k| {
            if (k as f64 * period_s) < stepped_s {
                1.0
            } else {
                STEPPED
            }
        })
        .collect();
    let slot = [Phase::sine(SINE, SLOT, nominal()).loaded(slot(Milling::slot()))];
    let last = |feedforward: Feedforward| -> anyhow::Result<Vec<f64>> {
        let trace = traces(feedforward, &slot)?;
        let samples = |seconds: f64| (seconds * stage.rate_hz) as usize;
        let first = trace.error_um.len().saturating_sub(samples(SHOWN_S.0));
        let shown = trace.error_um[first..].iter().take(samples(SHOWN_S.1));
        Ok(shown.copied().collect())
    };
    Ok([
        lines(
            "settling-scale",
            "Simulated. The scale after a step of all friction to 1.5 times, a sine of 30 mm at 10 mm/s",
            ("time (s)", "scale"),
            vec![
                curve("friction", &true_scale, period_s, 0),
                curve("scale learnt", &scale, period_s, 1),
            ],
        ),
        lines(
            "settling-error",
            "Simulated. The error meanwhile",
            ("time (s)", "error (um)"),
            vec![
                curve("fixed", &fixed.error_um, period_s, 0),
                curve("learning", &learning.error_um, period_s, 1),
            ],
        ),
        lines(
            "slot",
            "Simulated. A reversal of the same sine while a slot is milled, teeth at 100 Hz",
            ("time (s)", "error (um)"),
            vec![
                curve("fixed", &last(Feedforward::Fixed)?, period_s, 0),
                curve("without", &last(Feedforward::Without)?, period_s, 2),
                curve("learning", &last(Feedforward::Learning)?, period_s, 1),
            ],
        ),
    ])
}
