//! An axis on a sine, scored over its last whole cycles.

use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_settings::Job;
use quadrant_settings::{
    AxisSettings, BrakeSettings, OperationSettings, PlanSettings, StageSettings, StreamingSettings,
};

use crate::law_machine::LawMachine;
use crate::metrics::{Score, score};
use crate::plant::{AxisParameters, SimulatedStage, StageParameters};
use crate::run::{ELEMENTS, RunError, run};

/// A sine for an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SineTest {
    /// Amplitude, mm.
    pub amplitude_mm: f64,
    /// Largest velocity, mm/s.
    pub velocity_mm_s: f64,
}

/// Cycles at full speed.
const CYCLES: f64 = 2.25;
/// Whole cycles at the end that are scored.
const SCORED_CYCLES: usize = 2;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;

impl SineTest {
    /// The same with as many cycles a second and at most that amplitude, mm.
    #[must_use]
    pub fn within(self, most_mm: f64) -> Self {
        let amplitude_mm = self.amplitude_mm.min(most_mm);
        Self {
            amplitude_mm,
            velocity_mm_s: self.velocity_mm_s * amplitude_mm / self.amplitude_mm,
        }
    }

    fn cycle_s(self) -> f64 {
        std::f64::consts::TAU * self.amplitude_mm / self.velocity_mm_s
    }

    fn motion(self) -> MotionSettings {
        MotionSettings::Harmonic(HarmonicSettings::with_velocity(
            self.amplitude_mm,
            self.velocity_mm_s,
            CYCLES,
            LEAD_S,
        ))
    }
}

/// Runs three settings of one axis, each on its sine, side by side, for tracking error and glitch; f32, as on the target. `seed` decides the noise.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_sine_tests(
    settings: [AxisSettings; 3],
    truth: &AxisParameters,
    tests: [SineTest; 3],
    rate_hz: f64,
    seed: u64,
) -> Result<[Score; 3], RunError> {
    let resolution_mm = settings.each_ref().map(|axis| axis.encoder.resolution_mm);
    let job = Job {
        stage: StageSettings {
            rate_hz,
            operation: OperationSettings::default(),
            brake: BrakeSettings::default(),
            streaming: StreamingSettings::default(),
            axes: settings,
        },
        plan: PlanSettings {
            motions: tests.map(SineTest::motion),
        },
    };
    let slowest_s = tests.map(SineTest::cycle_s).into_iter().fold(0.0, f64::max);
    let longest_s = 2.0 + 2.0 * LEAD_S + CYCLES * slowest_s;
    let mut machine = LawMachine::<f32, ELEMENTS>::new(&job)?;
    let truth = StageParameters {
        axes: [truth.clone(), truth.clone(), truth.clone()],
    };
    let traces = run(
        &mut machine,
        &mut SimulatedStage::new(&truth, rate_hz, seed),
        resolution_mm,
        (longest_s * rate_hz) as usize,
    )?;
    let samples = |seconds: f64| (seconds * rate_hz).round() as usize;
    let mut of = tests.into_iter();
    Ok(traces.map(|trace| {
        let cycle_s = of.next().map_or(1.0, SineTest::cycle_s);
        let cycle = samples(cycle_s);
        let end = samples(LEAD_S) + samples(CYCLES * cycle_s);
        let scored = trace.slice(end - SCORED_CYCLES * cycle..end);
        score(&scored.reference_mm, &scored.error_mm, cycle)
    }))
}
