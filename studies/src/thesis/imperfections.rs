//! The cost of each imperfection: each is switched off by itself, and the comparison of the
//! PID with N-PID and combined feedforward is run again. The plant is not tuned; only what is asked about is changed.

use anyhow::Context as _;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_pages::compare::comparison::{Comparison, Request};
use quadrant_pages::compare::sine::Sines;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_sim::plant::Imperfections;
use quadrant_sim::run::RunError;
use quadrant_tune::commission::bootstrap::low_bandwidth_settings;
use quadrant_tune::identify::virgin_curve::{self, Knots, VirginCurveSettings};
use quadrant_tune::test_axis::{SimulatedTestAxis, TestAxis, approach};
use rayon::prelude::*;

use crate::study::Advance;

/// Elements of the GMS models that are identified: up to the firmware's room. From nine on the search for the
/// parameters takes minutes or ends without an answer: the record does not determine so many.
const ELEMENTS: [usize; 3] = [4, 6, FIRMWARE_ELEMENTS];
/// Ratio of the encoder's resolution to that of the finer one.
const FINER_ENCODER: f64 = 10.0;

/// A run with the identified model on a plant that lacks one imperfection, or whose law knows one thing better.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    AsItIs,
    NoNoise,
    /// No offset of converter and amplifier.
    NoOffset,
    /// No force that repeats with the screw.
    NoRipple,
    /// An encoder of a tenth of the count.
    FinerEncoder,
    /// Such an encoder, and no noise.
    QuietEncoder,
    /// A GMS model of so many elements, identified from a new record of the slow sine.
    Elements(usize),
    /// The GMS model of the truth, the sliding friction as identified.
    TrueElements,
    /// The whole friction of the truth.
    TrueFriction,
    /// A preview longer by so many control periods; the law rounds it to whole ones.
    Preview(i8),
    /// None of noise, offset and ripple.
    NoImperfections,
    /// None of them, and the whole friction of the truth.
    NothingUnknown,
}

impl Change {
    /// All, in the order of the table.
    pub const ALL: [Self; 15] = [
        Self::AsItIs,
        Self::NoNoise,
        Self::FinerEncoder,
        Self::QuietEncoder,
        Self::NoOffset,
        Self::NoRipple,
        Self::Elements(ELEMENTS[0]),
        Self::Elements(ELEMENTS[1]),
        Self::Elements(ELEMENTS[2]),
        Self::TrueElements,
        Self::TrueFriction,
        Self::Preview(-1),
        Self::Preview(1),
        Self::NoImperfections,
        Self::NothingUnknown,
    ];

    /// Its name in a table.
    pub fn name(self) -> String {
        match self {
            Self::AsItIs => "as it is".to_owned(),
            Self::NoNoise => "no encoder noise".to_owned(),
            Self::NoOffset => "no amplifier offset".to_owned(),
            Self::NoRipple => "no screw ripple".to_owned(),
            Self::FinerEncoder => "encoder counts of a tenth".to_owned(),
            Self::QuietEncoder => "no noise, counts of a tenth".to_owned(),
            Self::Elements(count) => format!("{count} GMS elements, identified again"),
            Self::TrueElements => "true GMS elements".to_owned(),
            Self::TrueFriction => "true friction".to_owned(),
            Self::Preview(periods) => format!("preview {periods:+} control period"),
            Self::NoImperfections => "no noise, offset, ripple".to_owned(),
            Self::NothingUnknown => "no noise, offset, ripple; true friction".to_owned(),
        }
    }

    /// True if it changes one thing alone.
    pub const fn is_single(self) -> bool {
        !matches!(
            self,
            Self::AsItIs | Self::QuietEncoder | Self::NoImperfections | Self::NothingUnknown
        )
    }

    /// `setup`, changed.
    ///
    /// # Errors
    /// A new identification that fails.
    pub fn apply(self, setup: &RunConfiguration, seed: u64) -> anyhow::Result<RunConfiguration> {
        let mut changed = setup.clone();
        match self {
            Self::AsItIs => {}
            Self::NoNoise => each(&mut changed, |all| all.encoder_noise_mm = 0.0),
            Self::NoOffset => each(&mut changed, |all| all.offset_v = 0.0),
            Self::NoRipple => each(&mut changed, |all| all.ripple_v = 0.0),
            Self::FinerEncoder => refine_encoder(&mut changed),
            Self::QuietEncoder => {
                each(&mut changed, |all| all.encoder_noise_mm = 0.0);
                refine_encoder(&mut changed);
            }
            Self::Elements(count) => {
                identify_elements(&mut changed, count, seed).context("GMS elements")?;
            }
            Self::TrueElements => {
                for (axis, truth) in changed.stage.axes.iter_mut().zip(&changed.truth.axes) {
                    axis.friction.gms = truth.gms.clone();
                }
            }
            Self::TrueFriction => changed.know_friction(),
            Self::Preview(periods) => {
                let further_s = f64::from(periods) / changed.stage.rate_hz;
                for axis in &mut changed.stage.axes {
                    axis.feedforward.preview_s += further_s;
                }
            }
            Self::NoImperfections => each(&mut changed, |all| *all = Imperfections::default()),
            Self::NothingUnknown => {
                each(&mut changed, |all| *all = Imperfections::default());
                changed.know_friction();
            }
        }
        Ok(changed)
    }
}

/// Changes the imperfections of all axes.
fn each(setup: &mut RunConfiguration, change: impl Fn(&mut Imperfections)) {
    for axis in &mut setup.truth.axes {
        change(&mut axis.imperfections);
    }
}

/// Gives stage and law encoders of smaller counts.
fn refine_encoder(setup: &mut RunConfiguration) {
    for (axis, truth) in setup.stage.axes.iter_mut().zip(&mut setup.truth.axes) {
        axis.encoder.resolution_mm /= FINER_ENCODER;
        truth.resolution_mm /= FINER_ENCODER;
    }
}

/// Measures the slow sine on the x axis as a commissioning does, and identifies `count` elements from it.
fn identify_elements(setup: &mut RunConfiguration, count: usize, seed: u64) -> anyhow::Result<()> {
    let rate_hz = setup.stage.rate_hz;
    let x = &mut setup.stage.axes[0];
    let plant = x.plant.context(
        "the settings hold no model of the x axis: commission it with `quadrant commission --axis x`",
    )?;
    let sliding = &x.friction.sliding;
    let breakaway_v =
        0.5 * (sliding.positive.curve.breakaway_v + sliding.negative.curve.breakaway_v);
    let mut rig = SimulatedTestAxis::new(0, setup.truth.axes[0].clone(), seed);
    let quiet = low_bandwidth_settings(x, &plant, rate_hz);
    rig.apply(&quiet)?;
    approach(&mut rig, 0.0)?;
    let sine = VirginCurveSettings::outrunning(quiet.feedback.pid.kp_v_per_mm, breakaway_v);
    let recording = virgin_curve::measure(&mut rig, &sine, &mut |_| {})?;
    let found = virgin_curve::identify(&recording, Some(sliding), &Knots::Automatic(count))?;
    x.friction.gms = found.gms;
    Ok(())
}

/// The outcome of a change.
#[derive(Debug)]
pub struct Finding {
    pub change: Change,
    /// Results of PID and of the best configuration, or the reason that the change could not be identified.
    pub outcome: anyhow::Result<Comparison>,
}

/// Runs PID and the best configuration on every changed plant, with `seeds` seeds from `seed` on. `advance` receives
/// the share of the whole that was done since its last call.
///
/// # Errors
/// The first run that fails. An identification that does is reported in its finding: it is an answer, too.
pub fn study(
    setup: &RunConfiguration,
    changes: &[Change],
    seed: u64,
    seeds: u64,
    advance: Advance<'_>,
) -> Result<Vec<Finding>, RunError> {
    // The identifications run on one core each, so all at once; the runs of a comparison fill the cores by themselves.
    let changed: Vec<anyhow::Result<RunConfiguration>> = changes
        .par_iter()
        .map(|change| change.apply(setup, seed))
        .collect();
    let share = 1.0 / changes.len() as f64;
    changes
        .iter()
        .zip(changed)
        .map(|(&change, changed)| {
            let outcome = match changed {
                Ok(setup) => Ok(Request {
                    setups: &[setup],
                    configurations: &Configuration::EXTREMES,
                    sines: vec![Sines::default()],
                    seed,
                    seeds,
                }
                .run(&|done| advance(share * done))?),
                Err(error) => Err(error),
            };
            Ok(Finding { change, outcome })
        })
        .collect()
}
