//! Identification judged by the truth that was hidden from it: three axes, several noise levels, several seeds.
//!
//! Two pairs of parameters cannot be separated by motion, so each pair is judged as what it shows: the viscous friction and
//! the linear damping as the total damping `B + A sigma`, and a direction's friction levels with the amplifier's offset.

use clap::Args;
use quadrant_pages::parts::columns;
use quadrant_report::{Block, Cell, Section, Table};
use quadrant_settings::StageSettings;
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_tune::commission::{CommissionError, CommissionSettings, Commissioned, commission};
use quadrant_tune::test_axis::SimulatedTestAxis;
use rayon::prelude::*;

use crate::study::{Advance, Study, results};

/// `quadrant-studies identification`.
#[derive(Clone, Debug, Args)]
pub struct Identification {
    /// Commissionings of each axis at each noise level.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..))]
    seeds: u64,
}

impl Study for Identification {
    const NAME: &'static str = "identification";
    const TITLE: &'static str = "Identification judged by the truth";
    const SUBTITLE: &'static str =
        "Axes of the simulated stage, whose truth was hidden from identification";

    /// Commissions every axis at every noise level, each time with a seed of its own, in parallel, and judges the results.
    fn run(&self, _seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
        let levels = (0..3).flat_map(|axis| NOISE_LEVELS.map(|noise| (axis, noise)));
        // No two runs share their noise: what is judged is how often the truth lies within the stated deviations.
        let runs: Vec<(usize, f64, u64)> = levels
            .zip(0..)
            .flat_map(|((axis, noise), level)| {
                (1..=self.seeds).map(move |seed| (axis, noise, level * self.seeds + seed))
            })
            .collect();
        let share = 1.0 / runs.len() as f64;
        let judgements: Result<Vec<_>, CommissionError> = runs
            .into_par_iter()
            .map(|(axis, noise, seed)| {
                let judgement = judge(axis, noise, seed)?;
                advance(share);
                Ok(judgement)
            })
            .collect();
        Ok(results(vec![Block::Table(table(&judgements?))]))
    }
}

/// Encoder noise of the runs, over that of the simulated stage.
const NOISE_LEVELS: [f64; 3] = [0.5, 1.0, 2.0];

/// The parameters that are judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Judged {
    Gain,
    /// B + A sigma.
    TotalDamping,
    Delay,
    /// Fc of a direction, offset included.
    Coulomb,
    /// Fs of a direction, offset included.
    Breakaway,
    /// Vs of a direction.
    StribeckVelocity,
}

impl Judged {
    const ALL: [Self; 6] = [
        Self::Gain,
        Self::TotalDamping,
        Self::Delay,
        Self::Coulomb,
        Self::Breakaway,
        Self::StribeckVelocity,
    ];

    /// Its name in tables.
    const fn name(self) -> &'static str {
        match self {
            Self::Gain => "A",
            Self::TotalDamping => "B + A sigma",
            Self::Delay => "Td",
            Self::Coulomb => "Fc, each way",
            Self::Breakaway => "Fs, each way",
            Self::StribeckVelocity => "Vs, each way",
        }
    }
}

/// One estimate beside the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Estimate {
    judged: Judged,
    found: f64,
    /// One standard deviation, as stated.
    standard_error: f64,
    truth: f64,
}

impl Estimate {
    /// Its error, %.
    fn error_percent(&self) -> f64 {
        100.0 * (self.found / self.truth - 1.0)
    }

    /// True if the plant's parameter lies within two standard deviations.
    fn is_honest(&self) -> bool {
        (self.found - self.truth).abs() <= 2.0 * self.standard_error
    }
}

/// One commissioning, judged.
struct Judgement {
    estimates: Vec<Estimate>,
    /// RMS error of the predicted hysteresis over the breakaway level, %.
    hysteresis_percent: f64,
}

/// Commissions one axis and judges it.
fn judge(axis: usize, noise: f64, seed: u64) -> Result<Judgement, CommissionError> {
    let mut truth = StageParameters::real().axes[axis].clone();
    truth.imperfections.encoder_noise_mm *= noise;
    let base = StageSettings::simulated().axes[axis].clone();
    let mut rig = SimulatedTestAxis::new(axis, truth.clone(), seed);
    let found = commission(
        &mut rig,
        &base,
        &CommissionSettings::thesis(),
        &mut |_, _| {},
    )?;
    Ok(Judgement {
        estimates: estimates(&found, &truth),
        hysteresis_percent: 100.0 * found.presliding.0.clone()?.prediction.relative_error,
    })
}

fn estimates(found: &Commissioned, truth: &AxisParameters) -> Vec<Estimate> {
    let fit = &found.plant.fit;
    let viscous = truth.friction.positive.viscous_v_s_per_mm;
    let linear = [
        (Judged::Gain, truth.gain_mm_per_v_s2),
        (
            Judged::TotalDamping,
            truth.damping_per_s + truth.gain_mm_per_v_s2 * viscous,
        ),
        (Judged::Delay, truth.delay_s),
    ];
    let mut estimates: Vec<Estimate> = linear
        .into_iter()
        .enumerate()
        .map(|(index, (judged, truth))| Estimate {
            judged,
            found: fit.values[index],
            standard_error: fit.standard_errors[index],
            truth,
        })
        .collect();
    let (_, friction, _) = &found.friction;
    let directions = [
        (&friction.directions.positive, &truth.friction.positive, 1.0),
        (
            &friction.directions.negative,
            &truth.friction.negative,
            -1.0,
        ),
    ];
    for (direction, model, sign) in directions {
        let pushed_v = sign * truth.imperfections.offset_v;
        let curve = direction.model.curve;
        let errors = &direction.fit.standard_errors;
        estimates.extend([
            Estimate {
                judged: Judged::Coulomb,
                found: curve.coulomb_v,
                standard_error: errors[0],
                truth: model.curve.coulomb_v - pushed_v,
            },
            Estimate {
                judged: Judged::Breakaway,
                found: curve.breakaway_v,
                standard_error: direction.breakaway_error_v,
                truth: model.curve.breakaway_v - pushed_v,
            },
            Estimate {
                judged: Judged::StribeckVelocity,
                found: curve.stribeck_velocity_mm_s,
                standard_error: errors[2],
                truth: model.curve.stribeck_velocity_mm_s,
            },
        ]);
    }
    estimates
}

/// Largest and RMS value.
fn worst_and_rms(values: &[f64]) -> [Cell; 2] {
    let worst = values
        .iter()
        .fold(0.0, |worst: f64, value| worst.max(value.abs()));
    let square: f64 = values.iter().map(|value| value.powi(2)).sum();
    [worst, (square / values.len() as f64).sqrt()].map(|value| Cell::number(value, 4))
}

/// Errors and honesty by parameter, over all runs.
fn table(judgements: &[Judgement]) -> Table {
    let mut rows = Judged::ALL.map(|judged| row(judged, judgements)).to_vec();
    let hysteresis: Vec<f64> = judgements.iter().map(|it| it.hysteresis_percent).collect();
    let [worst, rms] = worst_and_rms(&hysteresis);
    rows.push(vec![
        Cell::text("hysteresis, of Fs"),
        Cell::number(hysteresis.len() as f64, 0),
        worst,
        rms,
        Cell::Missing,
        Cell::Missing,
    ]);
    Table {
        id: "identification".to_owned(),
        caption: "Identification of the simulated stage against the truth that was hidden from it: x, y and z axes, encoder noise of 0.5, 1 \
                  and 2 times the stage's"
            .to_owned(),
        columns: columns(&[
            ("Quantity", ""),
            ("Estimates", ""),
            ("Worst error", "%"),
            ("RMS error", "%"),
            ("Stated deviation, mean", "%"),
            ("Truth within 2 deviations", "%"),
        ]),
        rows,
    }
}

fn row(judged: Judged, judgements: &[Judgement]) -> Vec<Cell> {
    let estimates: Vec<&Estimate> = judgements
        .iter()
        .flat_map(|judgement| &judgement.estimates)
        .filter(|estimate| estimate.judged == judged)
        .collect();
    let count = estimates.len() as f64;
    let errors: Vec<f64> = estimates.iter().map(|it| it.error_percent()).collect();
    let [worst, rms] = worst_and_rms(&errors);
    let stated = estimates
        .iter()
        .map(|it| 100.0 * it.standard_error / it.truth.abs());
    let honest = estimates.iter().filter(|it| it.is_honest()).count();
    vec![
        Cell::text(judged.name()),
        Cell::number(count, 0),
        worst,
        rms,
        Cell::number(stated.sum::<f64>() / count, 4),
        Cell::number(100.0 * honest as f64 / count, 1),
    ]
}
