//! The simulated stage: three axes that share nothing but the clock.

use quadrant::stage::Outputs;

use super::{SimulatedAxis, StageTruth};

/// The simulated stage in motion.
#[derive(Clone, Debug)]
pub struct SimulatedStage {
    axes: [SimulatedAxis; 3],
}

impl SimulatedStage {
    /// A stage at rest at the origin, sampled at `rate_hz`; the same seed gives the same noise.
    pub fn new(truth: &StageTruth, rate_hz: f64, seed: u64) -> Self {
        let axis = |index: usize| {
            SimulatedAxis::new(
                truth.axes[index].clone(),
                rate_hz,
                seed.wrapping_mul(3).wrapping_add(index as u64),
            )
        };
        Self {
            axes: [axis(0), axis(1), axis(2)],
        }
    }

    /// The axes.
    pub fn axes(&self) -> &[SimulatedAxis; 3] {
        &self.axes
    }

    /// The axes, to load them.
    pub fn axes_mut(&mut self) -> &mut [SimulatedAxis; 3] {
        &mut self.axes
    }

    /// What the encoders' counters show.
    pub fn read_counters(&mut self) -> [u32; 3] {
        self.axes.each_mut().map(SimulatedAxis::read_counter)
    }

    /// One control period.
    pub fn step(&mut self, outputs: &Outputs) {
        for (axis, code) in self.axes.iter_mut().zip(outputs.codes) {
            axis.step(code, outputs.enabled);
        }
    }
}
