//! Compliance of the axis at rest to a sinusoidal load: by the loop's linear model, and of the simulated axis.

use std::f64::consts::TAU;

use num_complex::Complex64;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_settings::response::LinearResponse;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::loop_shape::{OpenLoop, SampledLoop};
use quadrant_sim::plant::load::Load;
use quadrant_sim::plant::{AxisParameters, Imperfections};
use rayon::prelude::*;

use crate::robustness::RobustnessError;
use crate::robustness::trial::{Task, Trial};

/// Amplitude of the load, V: twice what the axis breaks away with, so that it slides.
pub const LOAD_V: f64 = 0.3;
/// The frequencies, Hz.
pub const FREQUENCIES_HZ: [f64; 12] = [
    1.0, 2.0, 5.0, 10.0, 20.0, 35.0, 50.0, 70.0, 100.0, 140.0, 200.0, 300.0,
];
/// Cycles that a load lasts at least; the second half is scored.
const CYCLES: f64 = 8.0;
/// Time that a load lasts at least, s.
const LEAST_S: f64 = 1.0;

/// Largest error over the load's amplitude.
#[derive(Clone, Debug, PartialEq)]
pub struct Compliance {
    pub name: String,
    /// One value a frequency, mm/V; nothing where a fault switched the stage off.
    pub mm_per_v: Vec<Option<f64>>,
}

/// The response from a load, in V at the amplifier's input but not delayed as that is, to the error, mm/V: `P / (1 + L)`
/// with the axis' linear model P without its delay, and the sampled loop L of its PID.
pub fn linear_compliance(
    plant: &PlantModel,
    settings: &AxisSettings,
    rate_hz: f64,
    frequency_hz: f64,
) -> Complex64 {
    let omega = TAU * frequency_hz;
    let prompt = PlantModel {
        delay_s: 0.0,
        ..*plant
    };
    let open_loop = SampledLoop::new(plant, &settings.feedback.pid, 1.0 / rate_hz, 0.0);
    prompt.response(omega) / (open_loop.response(omega) + 1.0)
}

/// The axis without imperfections and with all but no friction: what its linear model describes.
pub fn frictionless(truth: &AxisParameters) -> AxisParameters {
    let mut truth = truth.clone();
    truth.imperfections = Imperfections::default();
    truth.friction = truth.friction.map(|model| StaticFriction {
        curve: StribeckCurve {
            coulomb_v: 1e-9,
            breakaway_v: 1e-9,
            ..model.curve
        },
        ..*model
    });
    truth
}

/// The PID of the settings alone.
pub fn pid_alone(settings: &StageSettings) -> StageSettings {
    let mut settings = settings.clone();
    for axis in &mut settings.axes {
        axis.feedback.law = LawKind::Pid;
        axis.feedforward.kind = FeedforwardKind::None;
    }
    settings
}

/// Returns the compliance of a law's axis under [`LOAD_V`] at every one of [`FREQUENCIES_HZ`]; the axis under test is
/// the first of the stage.
///
/// # Errors
/// Settings that are refused.
pub fn simulated_compliance(
    name: &str,
    stage: &StageSettings,
    truth: &AxisParameters,
    seed: u64,
) -> Result<Compliance, RobustnessError> {
    let mm_per_v = FREQUENCIES_HZ
        .into_par_iter()
        .map(|frequency_hz| {
            let load = Load::Sine {
                amplitude_v: LOAD_V,
                frequency_hz,
            };
            let trial = Trial {
                stage,
                truth,
                load: &load,
                task: Task::Hold {
                    seconds: (CYCLES / frequency_hz).max(LEAST_S),
                    scored_from: 0.5,
                },
                seed,
            };
            let ended = trial
                .run()
                .map_err(|stopped| stopped.named(name, &format!("load at {frequency_hz} Hz")))?;
            Ok(ended.score.ok().map(|score| score.largest_mm / LOAD_V))
        })
        .collect::<Result<_, RobustnessError>>()?;
    Ok(Compliance {
        name: name.to_owned(),
        mm_per_v,
    })
}
