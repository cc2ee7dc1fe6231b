//! The simulated stage: three axes that share nothing but the clock.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::noise_shaper::{NoiseShaper, NoiseShaperState};
use quadrant_law::safety::Switches;
use quadrant_law::stage::Outputs;
use quadrant_law::units::DacCode;

use super::{MarkParameters, Marks, SUBSTEPS, SimulatedAxis, StageParameters};
use crate::law_machine::TickInput;

/// The simulated stage in motion.
#[derive(Clone, Debug)]
pub struct SimulatedStage {
    axes: [SimulatedAxis; 3],
    marks: [Marks; 3],
    /// Noise shaper that makes 12-bit words of codes, with its state for each axis; `None` for 16-bit converters.
    converters: Option<(NoiseShaper, [NoiseShaperState; 3])>,
}

impl SimulatedStage {
    /// A stage at rest at the origin, sampled at `rate_hz`; the same seed gives the same noise.
    pub fn new(truth: &StageParameters, rate_hz: f64, seed: u64) -> Self {
        let axis = |index: usize| {
            SimulatedAxis::new(
                truth.axes[index].clone(),
                rate_hz,
                seed.wrapping_mul(3).wrapping_add(index as u64),
            )
        };
        Self {
            axes: [axis(0), axis(1), axis(2)],
            marks: [Marks::new(MarkParameters::default()); 3],
            converters: None,
        }
    }

    /// The same stage at rest at the origin, sampled at another rate.
    #[must_use]
    pub fn sampled_at(self, truth: &StageParameters, rate_hz: f64, seed: u64) -> Self {
        Self {
            marks: self.marks.map(Marks::restarted),
            converters: self.converters,
            ..Self::new(truth, rate_hz, seed)
        }
    }

    /// The same stage behind 12-bit converters, which get their words from `shaper`.
    #[must_use]
    pub fn behind_12_bits(mut self, shaper: NoiseShaper) -> Self {
        self.converters = Some((shaper, Default::default()));
        self
    }

    pub fn axes(&self) -> &[SimulatedAxis; 3] {
        &self.axes
    }

    /// The axes, to load them.
    pub fn axes_mut(&mut self) -> &mut [SimulatedAxis; 3] {
        &mut self.axes
    }

    /// Reads the encoders' counters.
    pub fn read_counters(&mut self) -> [u32; 3] {
        self.axes.each_mut().map(SimulatedAxis::read_counter)
    }

    /// Puts switches and index pulses elsewhere. The axes must stand where they started.
    pub fn set_marks(&mut self, truths: [MarkParameters; 3]) {
        self.marks = truths.map(Marks::new);
    }

    /// Returns the board's inputs: counters with their index pulses, and switches; with a request that comes at the
    /// same time.
    pub fn read_inputs(&mut self, request: Option<Command>) -> TickInput {
        let mut inputs = TickInput::of_counts(self.read_counters(), request);
        let mut switches = Switches::NONE;
        for (index, axis) in self.axes.iter().enumerate() {
            let counter = inputs.readings[index].count;
            let (reading, pressed) = self.marks[index].read(counter, axis.position_mm());
            inputs.readings[index] = reading;
            switches = switches.with_axis(AxisName::ALL[index], pressed);
        }
        inputs.switches = switches;
        inputs
    }

    pub fn step(&mut self, outputs: &Outputs) {
        let mut codes = outputs.codes;
        if let Some((shaper, states)) = &mut self.converters {
            for (code, state) in codes.iter_mut().zip(states) {
                *code = DacCode(shaper.step(state, *code) << 4);
            }
        }
        let [x, y, z] = &mut self.axes;
        let mut periods = [
            x.begin(codes[0], outputs.enabled),
            y.begin(codes[1], outputs.enabled),
            z.begin(codes[2], outputs.enabled),
        ];
        // A step of an axis waits for its own results, a division and a sum of many terms: the processor fills that time with
        // the other axes.
        let [of_x, of_y, of_z] = &mut periods;
        for step in 0..SUBSTEPS {
            x.substep(of_x, step);
            y.substep(of_y, step);
            z.substep(of_z, step);
        }
        x.end(of_x);
        y.end(of_y);
        z.end(of_z);
    }
}
