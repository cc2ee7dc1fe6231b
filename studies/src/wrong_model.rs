//! "A well-tuned PID is as good": what feedforward is worth behind the best PID when its model is wrong.
//!
//! The model is made wrong on purpose, in three ways: its force too small or too large; its pre-sliding range too short or too
//! long; and every parameter off by a given share, up or down at random.

use clap::Args;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_pages::parts::{UM_PER_MM, columns};
use quadrant_report::{Block, Cell, Column, Section, Table};
use quadrant_settings::AxisSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::metrics::Score;
use quadrant_sim::plant::StageParameters;
use quadrant_sim::run::RunError;
use quadrant_sim::sine_test::{SineTest, run_sine_tests};
use quadrant_tune::design::set_best_pid;
use rand::{RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::study::{Advance, Study, results};

/// `quadrant-studies wrong-model`, on the x axis.
#[derive(Clone, Debug, Args)]
pub struct WrongModel {}

/// Amplitude, mm, and velocities, mm/s, of the sines.
const AMPLITUDE_MM: f64 = 15.0;
const VELOCITIES_MM_S: [f64; 3] = [5.0, 10.0, 15.0];
/// Factors on the feedforward's force.
const FORCE_FACTORS: [f64; 10] = [0.25, 0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 1.5, 1.75, 2.0];
/// Factors on the pre-sliding range.
const RANGE_FACTORS: [f64; 7] = [0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 1.5];
/// Shares by which every parameter is off.
const SHARES: [f64; 3] = [0.1, 0.3, 0.5];
/// Draws of the signs at each share.
const DRAWS: usize = 8;

/// Error of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrong {
    /// There is no feedforward.
    NoFeedforward,
    /// Its force is off by this factor.
    Force(f64),
    /// Its pre-sliding range is off by this factor.
    Range(f64),
    /// Every parameter is off by this share, in the signs of this draw.
    Everything { share: f64, draw: usize },
}

/// All that is run.
fn cases() -> Vec<Wrong> {
    let everything = |share| (0..DRAWS).map(move |draw| Wrong::Everything { share, draw });
    std::iter::once(Wrong::NoFeedforward)
        .chain(FORCE_FACTORS.map(Wrong::Force))
        .chain(RANGE_FACTORS.map(Wrong::Range))
        .chain(SHARES.into_iter().flat_map(everything))
        .collect()
}

/// The settings with their feedforward's model made wrong.
pub fn with_wrong_model(settings: &AxisSettings, wrong: Wrong, seed: u64) -> AxisSettings {
    let mut axis = settings.clone();
    axis.feedforward.kind = FeedforwardKind::Combined;
    match wrong {
        Wrong::NoFeedforward => axis.feedforward.kind = FeedforwardKind::None,
        Wrong::Force(factor) => {
            axis.feedforward.gains.presliding *= factor;
            axis.feedforward.gains.viscous *= factor;
        }
        Wrong::Range(factor) => {
            for element in &mut axis.friction.gms.elements {
                element.stiffness_v_per_mm /= factor;
            }
        }
        Wrong::Everything { share, draw } => {
            let mut signs =
                Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(1000) + draw as u64);
            let mut factor = || {
                if signs.next_u64() >> 63 == 1 {
                    1.0 + share
                } else {
                    1.0 - share
                }
            };
            let mut directed = |model: &StaticFriction| {
                let mut model = *model;
                let curve = &mut model.curve;
                curve.coulomb_v *= factor();
                // The level at breakaway is never below that of sliding.
                curve.breakaway_v = (curve.breakaway_v * factor()).max(curve.coulomb_v);
                curve.stribeck_velocity_mm_s *= factor();
                model.viscous_v_s_per_mm *= factor();
                model
            };
            axis.friction.sliding = axis.friction.sliding.map(&mut directed);
            axis.friction.gms.attraction_v_s *= factor();
            let elements = &mut axis.friction.gms.elements;
            for element in elements.iter_mut() {
                element.stiffness_v_per_mm *= factor();
                element.weight *= factor();
            }
            let sum: f64 = elements.iter().map(|element| element.weight).sum();
            for element in elements {
                element.weight /= sum;
            }
            axis.feedforward.gains.inertia_v_s2_per_mm *= factor();
            axis.feedforward.preview_s *= factor();
        }
    }
    axis
}

impl Study for WrongModel {
    const NAME: &'static str = "wrong-model";
    const TITLE: &'static str = "Feedforward whose model is wrong";
    const SUBTITLE: &'static str = "x axis of the simulated stage under the best PID";

    fn run(&self, seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
        let stage = identified_settings()?.stage;
        let mut settings = stage.axes[0].clone();
        set_best_pid(&mut settings, stage.rate_hz)?;
        let truth = &StageParameters::real().axes[0];
        let sines = VELOCITIES_MM_S.map(|velocity_mm_s| SineTest {
            amplitude_mm: AMPLITUDE_MM,
            velocity_mm_s,
        });
        let cases = cases();
        let share = 1.0 / cases.len() as f64;
        let outcomes = cases
            .into_par_iter()
            .map(|wrong| {
                let axis = with_wrong_model(&settings, wrong, seed);
                let axes = [axis.clone(), axis.clone(), axis];
                let outcomes = run_sine_tests(axes, truth, sines, stage.rate_hz, seed)?;
                advance(share);
                Ok((wrong, outcomes))
            })
            .collect::<Result<Outcomes, RunError>>()?;
        let tables = [everything_table, force_table, range_table];
        let tables = tables.map(|table| Block::Table(table(&outcomes)));
        Ok(results(tables.into()))
    }
}

type Outcomes = Vec<(Wrong, [Score; 3])>;

/// A measure, in mm.
type Measure = (&'static str, fn(&Score) -> f64);

const MEASURES: [Measure; 2] = [
    ("largest error", |score| score.largest_mm),
    ("RMS error", |score| score.rms_mm),
];

/// A measure in the cases that fit, mean over the sines, um.
fn errors_um(outcomes: &Outcomes, read: Measure, fits: impl Fn(Wrong) -> bool) -> Vec<f64> {
    let mean = |sines: &[Score; 3]| sines.iter().map(read.1).sum::<f64>() / 3.0;
    outcomes
        .iter()
        .filter(|(wrong, _)| fits(*wrong))
        .map(|(_, sines)| UM_PER_MM * mean(sines))
        .collect()
}

fn table(id: &str, what: &str, heads: Vec<Column>, errors: impl Fn(Measure) -> Vec<f64>) -> Table {
    let row = |measure: Measure| {
        std::iter::once(Cell::text(measure.0))
            .chain(errors(measure).into_iter().map(|um| Cell::number(um, 2)))
            .collect()
    };
    Table {
        id: format!("wrong-model-{id}"),
        caption: format!(
            "The best PID with combined feedforward {what}. Sines of {AMPLITUDE_MM} mm at 5, 10 and 15 mm/s, mean of the three; simulated, \
             identified model"
        ),
        columns: std::iter::once(Column::new("Measure"))
            .chain(heads)
            .collect(),
        rows: MEASURES.map(row).into(),
    }
}

/// Every parameter off by a share: mean and worst over the draws.
fn everything_table(outcomes: &Outcomes) -> Table {
    let mut heads = columns(&[("No feedforward", "um"), ("as identified", "um")]);
    for share in SHARES {
        let percent = 100.0 * share;
        heads.push(Column::with_unit(format!("off by {percent:.0} %"), "um"));
        heads.push(Column::with_unit(format!("worst of {percent:.0} %"), "um"));
    }
    table(
        "everything",
        "whose every parameter (levels, Stribeck velocity, viscous friction, stiffnesses, weights, attraction, inertia, preview) is off by a \
         share, up or down at random: mean and worst of eight draws",
        heads,
        |measure| {
            let mut row = errors_um(outcomes, measure, |it| it == Wrong::NoFeedforward);
            row.extend(errors_um(outcomes, measure, |it| it == Wrong::Force(1.0)));
            for share in SHARES {
                let fits =
                    |wrong| matches!(wrong, Wrong::Everything { share: of, .. } if of == share);
                let drawn = errors_um(outcomes, measure, fits);
                row.push(drawn.iter().sum::<f64>() / drawn.len() as f64);
                row.push(drawn.into_iter().fold(0.0, f64::max));
            }
            row
        },
    )
}

fn heads(factors: &[f64]) -> Vec<Column> {
    let head = |factor: &f64| Column::with_unit(format!("x {factor}"), "um");
    factors.iter().map(head).collect()
}

fn force_table(outcomes: &Outcomes) -> Table {
    let what = "whose force is that of the identified friction times a factor";
    table("force", what, heads(&FORCE_FACTORS), |measure| {
        errors_um(outcomes, measure, |wrong| matches!(wrong, Wrong::Force(_)))
    })
}

fn range_table(outcomes: &Outcomes) -> Table {
    let what = "whose pre-sliding range is that of the identified friction times a factor";
    table("range", what, heads(&RANGE_FACTORS), |measure| {
        errors_um(outcomes, measure, |wrong| matches!(wrong, Wrong::Range(_)))
    })
}
