//! Axes that follow another control's pulses: the reversals of a circle and of a slow motion, beside the plan itself; and the
//! ways to find the motion behind a staircase.

use std::f64::consts::TAU;

use clap::Args;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::reference::{
    HarmonicSettings, MotionScale, MotionSettings, Plane, PulseScale, Sense, circle,
};
use quadrant_pages::parts::{UM_PER_MM, columns};
use quadrant_report::{Block, Cell, Section, Table};
use quadrant_settings::StageSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::metrics::{largest, reversals};
use quadrant_sim::plant::StageParameters;
use quadrant_sim::pulse_train::{PulseControl, PulseInput, ReversalPath, followed};
use rayon::prelude::*;

use crate::study::{Advance, Study, results};

/// `quadrant-studies step-direction`.
#[derive(Clone, Debug, Args)]
pub struct StepDirection {}

/// Length of a step, mm, and the delay that is proposed for it, s.
const STEPS: [(f64, f64); 3] = [(1e-3, 6.3e-3), (5e-3, 12.7e-3), (1e-2, 23.9e-3)];
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;
/// Radius of the circle, mm, and its feed, mm/s.
const CIRCLE: (f64, f64) = (10.0, 25.0);
/// Amplitude of the slow motion, mm, and its largest velocity, mm/s.
const SLOW: (f64, f64) = (1.0, 2.0);

impl Study for StepDirection {
    const NAME: &'static str = "step-direction";
    const TITLE: &'static str = "Axes that follow another control's pulses";
    const SUBTITLE: &'static str = "step and direction beside the plan itself";

    fn run(&self, seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
        let estimators = estimators(seed);
        advance(0.1);
        let settings = identified_settings()?.stage;
        let rows = Path::ALL
            .into_par_iter()
            .map(|path| {
                let rows = path.rows(&settings, seed);
                advance(0.45);
                rows
            })
            .collect::<anyhow::Result<Vec<_>>>()?;
        Ok(results(vec![
            Block::Table(paths_table(rows.into_iter().flatten().collect())),
            Block::Table(estimators),
        ]))
    }
}

/// A path with reversals.
#[derive(Clone, Copy, Debug)]
enum Path {
    /// A circle of x and y.
    Circle,
    /// x to and fro.
    Slow,
}

impl Path {
    const ALL: [Self; 2] = [Self::Circle, Self::Slow];

    fn name(self) -> String {
        match self {
            Self::Circle => format!("circle of {} mm at {} mm/s", CIRCLE.0, CIRCLE.1),
            Self::Slow => format!("sine of {} mm at {} mm/s", SLOW.0, SLOW.1),
        }
    }

    /// Axes that move.
    const fn axes(self) -> usize {
        match self {
            Self::Circle => 2,
            Self::Slow => 1,
        }
    }

    /// The motions, and the time after which they repeat, s.
    fn motions(self) -> ([MotionSettings; 3], f64) {
        match self {
            Self::Circle => {
                let (radius_mm, feed_mm_s) = CIRCLE;
                let sense = Sense::CounterClockwise;
                let motions = circle(
                    Plane::Xy,
                    sense,
                    radius_mm,
                    feed_mm_s,
                    TAU / 8.0,
                    2.25,
                    LEAD_S,
                );
                (motions, TAU * radius_mm / feed_mm_s)
            }
            Self::Slow => {
                let (amplitude_mm, velocity_mm_s) = SLOW;
                let sine =
                    HarmonicSettings::with_velocity(amplitude_mm, velocity_mm_s, 2.25, LEAD_S);
                let mut motions = [MotionSettings::Hold; 3];
                motions[0] = MotionSettings::Harmonic(sine);
                (motions, TAU * amplitude_mm / velocity_mm_s)
            }
        }
    }

    /// The plan itself, and each control with each step: spikes, their ratio to the plan's, largest errors with friction fed forward
    /// and without.
    fn rows(self, settings: &StageSettings, seed: u64) -> anyhow::Result<Vec<Vec<Cell>>> {
        let (motions, cycle_s) = self.motions();
        let path = ReversalPath::new(settings, &motions, cycle_s);
        let truth = StageParameters::real();
        let lead_ticks = (LEAD_S * settings.rate_hz) as usize;
        let mut without = settings.clone();
        for axis in &mut without.axes {
            axis.feedforward.kind = FeedforwardKind::None;
        }
        let axes = self.axes() as f64;
        let score = |settings, input: Option<&PulseInput>| -> anyhow::Result<(f64, f64)> {
            let scores = path.scores(settings, &truth, input, (lead_ticks, seed))?;
            let scores = &scores[..self.axes()];
            Ok((
                scores.iter().map(|score| score.glitch_mm).sum::<f64>() / axes,
                scores
                    .iter()
                    .map(|score| score.largest_mm)
                    .fold(0.0, f64::max),
            ))
        };
        let plan_mm = score(settings, None)?.0;
        let inputs = PulseControl::ALL.into_iter().flat_map(|control| {
            STEPS.map(|(step_mm, delay_s)| {
                Some(PulseInput {
                    control,
                    step_mm,
                    delay_s,
                })
            })
        });
        let row = |input: Option<PulseInput>| {
            let (spike_mm, largest_mm) = score(settings, input.as_ref())?;
            let (_, bare_mm) = score(&without, input.as_ref())?;
            let (name, step, delay) = match input {
                None => ("the plan itself", Cell::Missing, Cell::Missing),
                Some(input) => (
                    input.control.name,
                    Cell::number(input.step_mm * UM_PER_MM, 0),
                    Cell::number(input.delay_s * 1e3, 1),
                ),
            };
            let um = |value_mm: f64| Cell::number(value_mm * UM_PER_MM, 2);
            Ok(vec![
                Cell::text(self.name()),
                Cell::text(name),
                step,
                delay,
                um(spike_mm),
                Cell::number(spike_mm / plan_mm, 2),
                um(largest_mm),
                um(bare_mm),
            ])
        };
        std::iter::once(None).chain(inputs).map(row).collect()
    }
}

fn paths_table(rows: Vec<Vec<Cell>>) -> Table {
    Table {
        id: "step-direction".to_owned(),
        caption: "Quadrant spike and largest error by the plan and by pulses, at 10 kHz; the last column without friction fed forward"
            .to_owned(),
        columns: columns(&[
            ("Path", ""),
            ("Reference", ""),
            ("step", "um"),
            ("delay", "ms"),
            ("spike", "um"),
            ("to the plan's", ""),
            ("largest error", "um"),
            ("without", "um"),
        ]),
        rows,
    }
}

/// A way from a staircase to the motion behind it.
#[derive(Clone, Copy, Debug)]
enum Estimator {
    /// The law's: two moving averages.
    Averages,
    /// A parabola through the last ticks, by least squares, at its middle.
    Parabola,
    /// An observer of position, velocity and acceleration with three equal poles; its time constant is the delay.
    Observer,
}

/// Control rate at which the estimators are compared, Hz.
const RATE_HZ: f64 = 10e3;

impl Estimator {
    const ALL: [Self; 3] = [Self::Averages, Self::Parabola, Self::Observer];

    const fn name(self) -> &'static str {
        match self {
            Self::Averages => "two moving averages",
            Self::Parabola => "parabola by least squares",
            Self::Observer => "observer",
        }
    }

    /// Positions, mm, of counts, and the ticks by which they are late.
    fn positions_mm(self, counts: &[u32], step_mm: f64, delay_ticks: usize) -> (Vec<f64>, usize) {
        let staircase: Vec<f64> = counts
            .iter()
            .map(|count| f64::from(*count as i32) * step_mm)
            .collect();
        match self {
            Self::Averages => {
                let pulses = PulseScale {
                    step_mm,
                    counter_bits: 32,
                    delay_ticks: delay_ticks as u32,
                    wait_ticks: 0,
                    preview_ticks: 0,
                    max_velocity_mm_s: 250.0,
                    max_acceleration_mm_s2: 2000.0,
                };
                let scale = MotionScale::new(5e-4, RATE_HZ);
                let given = followed(counts, &pulses, scale).unwrap_or_default();
                let places = given.samples().iter().map(|sample| sample.position);
                (places.map(|place| place.to_mm(5e-4)).collect(), delay_ticks)
            }
            Self::Parabola => (parabola(&staircase, delay_ticks), delay_ticks),
            // With velocity and acceleration it is late for no parabola.
            Self::Observer => (observer(&staircase, delay_ticks as f64), 0),
        }
    }
}

/// The middle of the parabola through `2 half + 1` samples, from the first such on; before it, the first sample.
fn parabola(samples: &[f64], half: usize) -> Vec<f64> {
    let offsets = || (-(half as i64)..=half as i64).map(|k| (k * k) as f64);
    let (count, squares) = ((2 * half + 1) as f64, offsets().sum::<f64>());
    let fourths: f64 = offsets().map(|square| square * square).sum();
    let determinant = count * fourths - squares * squares;
    let weights: Vec<f64> = offsets()
        .map(|square| (fourths - squares * square) / determinant)
        .collect();
    let fitted = samples.windows(weights.len()).map(|window| {
        let terms = window.iter().zip(&weights);
        terms.map(|(sample, weight)| sample * weight).sum()
    });
    std::iter::repeat_n(samples[0], 2 * half)
        .chain(fitted)
        .collect()
}

/// An observer of third order with three poles of this time constant, ticks.
fn observer(samples: &[f64], time_ticks: f64) -> Vec<f64> {
    let pole = (-1.0 / time_ticks).exp();
    let lost = 1.0 - pole;
    let gains = [
        1.0 - pole * pole * pole,
        1.5 * lost * lost * (1.0 + pole),
        lost * lost * lost,
    ];
    let (mut position, mut velocity, mut acceleration) = (samples[0], 0.0, 0.0);
    samples
        .iter()
        .map(|sample| {
            position += velocity + 0.5 * acceleration;
            velocity += acceleration;
            let error = sample - position;
            position += gains[0] * error;
            velocity += gains[1] * error;
            acceleration += gains[2] * error;
            position
        })
        .collect()
}

/// The estimators on x of the circle, whose pulses have a control's jitter.
fn estimators(seed: u64) -> Table {
    let (radius_mm, feed_mm_s) = CIRCLE;
    let turn = (TAU * radius_mm / feed_mm_s * RATE_HZ) as usize;
    // From rest at a reversal, and so that reversals come at all places of a step.
    let path_mm: Vec<f64> = (0..5 * turn)
        .map(|tick| {
            let angle = TAU * tick as f64 / turn as f64;
            radius_mm * (1.0 - angle.cos()) + 1e-3 * (tick as f64 / turn as f64)
        })
        .collect();
    let half = turn / 50;
    let mut rows = Vec::new();
    for (step_mm, delay_s) in STEPS {
        let delay_ticks = (delay_s * RATE_HZ).round() as usize;
        let counts = PulseControl::GRBL.counts(&path_mm, step_mm, RATE_HZ, seed);
        for estimator in Estimator::ALL {
            let (found_mm, late) = estimator.positions_mm(&counts, step_mm, delay_ticks);
            let turns = reversals(&path_mm[turn / 4..]);
            let errors = turns.iter().filter_map(|at| {
                let at = turn / 4 + at;
                let window = found_mm.get(at + late - half..at + late + half)?;
                let path = &path_mm[at - half..at + half];
                let errors: Vec<f64> = window.iter().zip(path).map(|(a, b)| a - b).collect();
                let mean = errors.iter().sum::<f64>() / errors.len() as f64;
                let about: Vec<f64> = errors.iter().map(|error| error - mean).collect();
                Some(largest(&about))
            });
            let errors: Vec<f64> = errors.collect();
            let false_turns =
                reversals(&found_mm[turn / 4..]).len() - errors.len().min(turns.len());
            rows.push(vec![
                Cell::number(step_mm * UM_PER_MM, 0),
                Cell::number(delay_s * 1e3, 1),
                Cell::text(estimator.name()),
                Cell::number(
                    UM_PER_MM * errors.iter().sum::<f64>() / errors.len() as f64,
                    2,
                ),
                Cell::number(false_turns as f64, 0),
            ]);
        }
    }
    Table {
        id: "estimators".to_owned(),
        caption: "Ways to the motion behind a staircase, on x of the circle, pulses of grbl: largest error about its mean near a reversal, and \
                  turns of the sense of motion that the path does not have"
            .to_owned(),
        columns: columns(&[
            ("step", "um"),
            ("delay", "ms"),
            ("Estimator", ""),
            ("error", "um"),
            ("false turns", ""),
        ]),
        rows,
    }
}
