//! Fixtures that the tests of several packages share.
#![forbid(unsafe_code)]
// For tests alone.
#![allow(missing_docs)]

pub mod traffic;

use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};
pub use quadrant_fault_bench::noise::Noise;
use quadrant_law::axes::PerAxis;
use quadrant_law::axis::AxisState;
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::{Inputs, Outputs, Plan, Stage, StageState};
use quadrant_settings::tree::TreeError;
use quadrant_settings::{PlanSettings, StageSettings};

/// A property test of `cases` cases that is the same on every run.
pub fn repeatable(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(0x5155_4144),
        ..Config::default()
    }
}

/// Every `f32` there is, the special ones more often than chance would have it.
pub fn any_f32() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => any::<u32>().prop_map(f32::from_bits),
        2 => -40.0f32..40.0,
        1 => prop::sample::select(vec![
            f32::NAN,
            -f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            f32::MIN,
            f32::MIN_POSITIVE,
            f32::from_bits(1),
            0.0,
            -0.0,
        ]),
    ]
}

/// The default stage with one change to its x axis.
pub fn with_x(change: impl FnOnce(&mut quadrant_settings::AxisSettings)) -> StageSettings {
    let mut settings = StageSettings::simulated();
    change(&mut settings.axes[0]);
    settings
}

/// The same, the other axes with x's preview, so that x waits for none.
pub fn x_alone(change: impl FnOnce(&mut quadrant_settings::AxisSettings)) -> StageSettings {
    let mut settings = with_x(change);
    let [x, y, z] = &mut settings.axes;
    for axis in [y, z] {
        axis.feedforward.preview_s = x.feedforward.preview_s;
    }
    settings
}

/// The value at a path as JSON.
#[allow(clippy::missing_errors_doc)]
pub fn get(settings: &StageSettings, path: &str) -> Result<String, TreeError> {
    let mut buffer = [0; 1024];
    let length = settings.get_json(path, &mut buffer)?;
    Ok(String::from_utf8(buffer[..length].to_vec()).expect("JSON is text"))
}

/// All paths below a prefix.
pub fn paths(settings: &StageSettings, prefix: &str) -> Vec<String> {
    let mut paths = vec![];
    settings
        .list(prefix, &mut |path| paths.push(path.to_owned()))
        .expect("a prefix there is");
    paths
}

/// Returns true if a leaf is a whole number.
pub fn is_whole(path: &str) -> bool {
    [
        "counter_bits",
        "counts_per_index",
        "index_tolerance_counts",
        "teeth",
        "harmonics",
        "gear_numerator",
        "gear_denominator",
    ]
    .iter()
    .any(|name| path.ends_with(name))
}

/// A sine on x alone.
pub fn sine_on_x(amplitude_mm: f64, velocity_mm_s: f64) -> PlanSettings {
    let mut plan = PlanSettings::default();
    plan.motions[0] = MotionSettings::Harmonic(HarmonicSettings {
        cycles: None,
        ..HarmonicSettings::with_velocity(amplitude_mm, velocity_mm_s, 1.0, 0.1)
    });
    plan
}

/// A stage with its memory and the inputs of its next tick.
pub struct Rig<S: Scalar> {
    pub stage: Stage<S, 4>,
    pub plan: Plan<S>,
    pub state: StageState<S, 4>,
    pub inputs: Inputs,
}

/// The stage of settings whose plant is only a bound of other settings: the tests put the encoders where no axis could
/// be, and the plant would show it.
pub fn without_plant<S: Scalar>(settings: &StageSettings) -> Stage<S, 4> {
    settings.validate(4).expect("valid settings");
    let mut settings = settings.clone();
    for axis in &mut settings.axes {
        axis.plant = None;
    }
    settings.build().expect("valid settings")
}

impl<S: Scalar> Rig<S> {
    /// Encoders that the test puts somewhere: nothing compares them with the plant.
    pub fn new(settings: &StageSettings, plan: &PlanSettings) -> Self {
        Self {
            stage: without_plant(settings),
            ..Self::with_plant(settings, plan)
        }
    }

    /// Encoders of axes that move as the outputs make them.
    pub fn with_plant(settings: &StageSettings, plan: &PlanSettings) -> Self {
        Self {
            stage: settings.build().expect("valid settings"),
            plan: plan.build(settings).expect("valid plan"),
            state: StageState::default(),
            inputs: Inputs::default(),
        }
    }

    /// One tick; commands and flags act once, counts and switches stay.
    pub fn tick(&mut self) -> Outputs {
        let inputs = self.inputs;
        self.inputs = Inputs {
            readings: inputs
                .readings
                .map(|reading| EncoderReading::of(reading.count)),
            switches: inputs.switches,
            ..Inputs::default()
        };
        self.stage.tick(&self.plan, &mut self.state, &inputs)
    }

    pub fn command(&mut self, command: Command) -> Outputs {
        self.inputs.command = Some(command);
        self.tick()
    }

    /// Reads the encoders once, enables, and starts the plan.
    pub fn start(&mut self) {
        self.tick();
        self.command(Command::Enable);
        self.command(Command::Run);
    }

    /// Lets the axes stand for so long that they may be enabled.
    pub fn stand(&mut self) {
        for _ in 0..100 {
            self.tick();
        }
    }

    /// A stage on a sine of x whose limits allow any error.
    pub fn that_allows_any_error(mut settings: StageSettings) -> Self {
        for axis in &mut settings.axes {
            axis.limits.following_error_mm = 20.0;
            axis.limits.following_error_max_mm = 20.0;
        }
        let mut rig = Self::with_plant(&settings, &sine_on_x(5.0, 20.0));
        rig.start();
        rig
    }

    /// Shows x counts that grow by `step` a tick, and what is seen of it after each; then what a fault has ended begins again.
    pub fn show_counts<E>(
        &mut self,
        step: i32,
        ticks: u16,
        mut look: impl FnMut(&AxisState<S, 4>) -> Result<(), E>,
    ) -> Result<(), E> {
        for _ in 0..ticks {
            let count = &mut self.inputs.readings[0].count;
            *count = count.wrapping_add_signed(step);
            self.tick();
            look(&self.state.axes()[0])?;
        }
        self.command(Command::ResetFault);
        self.command(Command::Enable);
        self.command(Command::Run);
        Ok(())
    }

    /// Goes over to other settings at the next tick.
    pub fn exchange(&mut self, settings: &StageSettings) {
        self.stage = without_plant(settings);
        self.inputs.settings_changed = PerAxis::splat(true);
    }
}
