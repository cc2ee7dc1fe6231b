//! The nominal closed loop beside the axis: the identified plant under the axis' own PID, from a voltage at the plant's input
//! to the position that it brings about.
//!
//! `v' = A u(t - Td) - B v - C y`, `u = w - PID(y)`: the exact step of the damped mass for a held input, the trapezoidal rule
//! for the position. The PID's derivative acts on the model's velocity, which needs no differences. A step takes several control
//! periods; what a longer hold delays more, the dead time is shorter by.

use crate::control::pid::PidGains;
use crate::control::plant_model::PlantModel;
use crate::scalar::{Quantity, Scalar};

/// Number of inputs that are remembered; a power of two.
const REMEMBERED_INPUTS: usize = 8;

/// Longest dead time of the plant that fits, control periods.
pub const MAX_DELAY_TICKS: usize = 28;

/// Largest position of the model, mm: within every number type.
const MOST_MM: f64 = 31.0;
/// Largest velocity of the model, mm/s: within every number type.
const MOST_MM_S: f64 = 2000.0;
/// Largest input of the model, V: within every number type.
const MOST_V: f64 = 31.0;

/// The loop ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ClosedLoop<S: Scalar> {
    proportional: S::Gain,
    integral: S::Gain,
    /// Kd, as far as the derivative's filter lets it through in a step, and what the filter keeps.
    derivative: S::Gain,
    filter: S,
    /// A, B and C over a step.
    push: S::Gain,
    keep: S,
    spring: S::Gain,
    half_step: S::Gain,
    /// Dead time: whole steps, and the rest.
    delay: usize,
    rest: S,
    most: (S, S, S),
}

/// The memory of the loop.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ClosedLoopState<S: Scalar> {
    position: S,
    velocity: S,
    derivative: S,
    integral: S::Sum,
    inputs: [S; REMEMBERED_INPUTS],
    place: usize,
}

impl<S: Scalar> ClosedLoop<S> {
    /// Makes the loop of a plant and its PID, for a control period and a step of the model. Settings time only.
    pub(super) fn build(plant: &PlantModel, gains: &PidGains, period_s: f64, step_s: f64) -> Self {
        let damping = plant.damping_per_s * step_s;
        // The velocity that a volt brings in a step.
        let push_s = if damping > 1e-9 {
            -libm::expm1(-damping) / plant.damping_per_s
        } else {
            step_s
        };
        let filter = libm::exp(-step_s / gains.derivative_filter_s);
        let delay_s = plant.delay_s - 0.5 * (step_s - period_s);
        let delay = (delay_s / step_s).clamp(0.0, (REMEMBERED_INPUTS - 2) as f64);
        Self {
            proportional: S::gain(gains.kp_v_per_mm, Quantity::Length, Quantity::Voltage),
            integral: S::gain(
                gains.ki_v_per_mm_s * step_s,
                Quantity::Length,
                Quantity::Voltage,
            ),
            derivative: S::gain(
                gains.kd_v_s_per_mm * (1.0 - filter),
                Quantity::Velocity,
                Quantity::Voltage,
            ),
            filter: S::quantise(filter, Quantity::Fraction),
            push: S::gain(
                plant.gain_mm_per_v_s2 * push_s,
                Quantity::Voltage,
                Quantity::Velocity,
            ),
            keep: S::quantise(libm::exp(-damping), Quantity::Fraction),
            spring: S::gain(
                plant.stiffness_per_s2 * step_s,
                Quantity::Length,
                Quantity::Velocity,
            ),
            half_step: S::gain(0.5 * step_s, Quantity::Velocity, Quantity::Length),
            delay: delay as usize,
            rest: S::quantise(delay - libm::floor(delay), Quantity::Fraction),
            most: (
                S::quantise(MOST_MM, Quantity::Length),
                S::quantise(MOST_MM_S, Quantity::Velocity),
                S::quantise(MOST_V, Quantity::Voltage),
            ),
        }
    }

    /// The integral of the PID, V.
    pub(super) fn integral(state: &ClosedLoopState<S>) -> S {
        S::total(state.integral)
    }

    /// Adds `voltage` to what the integral holds, V: the position does not change by it.
    pub(super) fn hold_against(state: &mut ClosedLoopState<S>, voltage: S) {
        state.integral = (S::total(state.integral) + voltage).into_sum();
    }

    /// One step with `voltage` added to the output of the PID, whose gains are `stiffening` times their values; returns the
    /// position of the plant at the beginning of the step, mm.
    #[inline(always)]
    pub(super) fn step(
        &self,
        state: &mut ClosedLoopState<S>,
        voltage: S,
        stiffening: impl FnOnce(S) -> S,
    ) -> S {
        let position = state.position;
        let (most_mm, most_mm_s, most_v) = self.most;
        let gain = stiffening(position);
        let stretched = position.times(gain, Quantity::Multiplier);
        state.integral = stretched.accumulate(state.integral, self.integral);
        state.derivative = state.derivative.times(self.filter, Quantity::Fraction)
            + state
                .velocity
                .times(gain, Quantity::Multiplier)
                .scale(self.derivative);
        let input = voltage
            - stretched.scale(self.proportional)
            - S::total(state.integral)
            - state.derivative;
        let place = state.place;
        state.inputs[place % REMEMBERED_INPUTS] = input.within(most_v);
        state.place = place.wrapping_add(1);
        let at = |steps: usize| state.inputs[place.wrapping_sub(steps) % REMEMBERED_INPUTS];
        let (late, later) = (at(self.delay), at(self.delay + 1));
        let arriving = late + (later - late).times(self.rest, Quantity::Fraction);
        let velocity = state.velocity.times(self.keep, Quantity::Fraction)
            + arriving.scale(self.push)
            - position.scale(self.spring);
        let velocity = velocity.within(most_mm_s);
        let moved = (state.velocity + velocity).scale(self.half_step);
        state.position = (position + moved).within(most_mm);
        state.velocity = velocity;
        position
    }
}
