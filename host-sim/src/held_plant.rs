//! The linear axis driven through a zero-order hold: exact from sample to sample.

use std::collections::VecDeque;

use nalgebra::{Matrix2, Matrix3, Vector2};
use num_complex::Complex64;
use quadrant_law::control::plant_model::PlantModel;

/// A linear axis behind a converter that holds each voltage for a period, with any delay, whole periods or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldPlant {
    /// Position and velocity, from one sample to the next.
    transition: Matrix2<f64>,
    /// Contribution of the output written `whole_periods` ago.
    recent_input: Vector2<f64>,
    /// Contribution of the output written one period before that.
    older_input: Vector2<f64>,
    whole_periods: f64,
}

impl HeldPlant {
    /// The axis at a period of `sample_time_s` s, each voltage written `computation_delay_s` s after the position was
    /// read.
    pub fn new(plant: &PlantModel, sample_time_s: f64, computation_delay_s: f64) -> Self {
        let periods = (plant.delay_s + computation_delay_s) / sample_time_s;
        // A delay meant as a whole number of periods must not lose one to rounding.
        let nearest = periods.round();
        let whole_periods = if (periods - nearest).abs() < 1e-9 {
            nearest
        } else {
            periods.floor()
        };
        let older_share_s = (periods - whole_periods).max(0.0) * sample_time_s;
        let (_, older_start) = step(plant, older_share_s);
        let (rest, recent_input) = step(plant, sample_time_s - older_share_s);
        let (transition, _) = step(plant, sample_time_s);
        Self {
            transition,
            recent_input,
            older_input: rest * older_start,
            whole_periods,
        }
    }

    /// Position over voltage at a point of the z plane, mm/V.
    pub fn response(&self, z: Complex64) -> Complex64 {
        let delayed = z.powi(-(self.whole_periods as i32));
        let drive =
            |row: usize| (z.inv() * self.older_input[row] + self.recent_input[row]) * delayed;
        // The first row of (z I - transition)^-1, times the input.
        let phi = &self.transition;
        let determinant = (z - phi[(0, 0)]) * (z - phi[(1, 1)]) - phi[(0, 1)] * phi[(1, 0)];
        ((z - phi[(1, 1)]) * drive(0) + drive(1) * phi[(0, 1)]) / determinant
    }
}

/// A [`HeldPlant`] in motion.
#[derive(Clone, Debug)]
pub struct HeldPlantRun {
    plant: HeldPlant,
    /// Position, mm, and velocity, mm/s.
    state: Vector2<f64>,
    /// Voltages on their way, the oldest first.
    outputs: VecDeque<f64>,
}

impl HeldPlantRun {
    /// An axis at rest at `position_mm`.
    pub fn at_rest(plant: HeldPlant, position_mm: f64) -> Self {
        Self {
            state: Vector2::new(position_mm, 0.0),
            outputs: VecDeque::from(vec![0.0; plant.whole_periods as usize + 1]),
            plant,
        }
    }

    /// Position of the axis, mm.
    pub fn position_mm(&self) -> f64 {
        self.state[0]
    }

    /// One period, at whose start a voltage is written.
    pub fn step(&mut self, voltage_v: f64) {
        self.outputs.push_back(voltage_v);
        let older = self.outputs.pop_front().unwrap_or(0.0);
        let recent = self.outputs.front().copied().unwrap_or(voltage_v);
        self.state = self.plant.transition * self.state
            + self.plant.older_input * older
            + self.plant.recent_input * recent;
    }
}

/// Position and velocity after `duration_s`: the transition from those before, and what a constant volt adds.
fn step(plant: &PlantModel, duration_s: f64) -> (Matrix2<f64>, Vector2<f64>) {
    let rates = Matrix3::new(
        0.0,
        1.0,
        0.0,
        -plant.stiffness_per_s2,
        -plant.damping_per_s,
        plant.gain_mm_per_v_s2,
        0.0,
        0.0,
        0.0,
    );
    let step = (rates * duration_s).exp();
    (
        step.fixed_view::<2, 2>(0, 0).into_owned(),
        step.fixed_view::<2, 1>(0, 2).into_owned(),
    )
}
