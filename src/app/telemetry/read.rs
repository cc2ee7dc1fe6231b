//! Reading a channel's word after a tick.

use crate::app::wire::Translated;
use quadrant_link::message::{AxisName, AxisSignal, Channel, MachineState, StageSignal};

use crate::app::glitch_monitor::GlitchReadings;
use quadrant_law::scalar::{Quantity, Scalar};
use quadrant_law::stage::StageState;

/// The readable state after a tick.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a, S: Scalar, const N: usize> {
    /// The stage as the tick left it.
    pub stage: &'a StageState<S, N>,
    /// The latest results of the glitch monitor.
    pub glitches: &'a GlitchReadings,
    /// Duration of the tick before, in cycles of the board's tick timer.
    pub elapsed_cycles: u32,
    /// True if the tick was given a command.
    pub commanded: bool,
}

impl<S: Scalar, const N: usize> Observation<'_, S, N> {
    /// The number of the tick that has just ended, as a fault of that tick has it.
    #[inline(always)]
    pub const fn tick(&self) -> u32 {
        self.stage.tick().wrapping_sub(1)
    }
}

/// Reads a channel's word as the link has it.
#[inline(always)]
pub fn read<S: Scalar, const N: usize>(channel: Channel, seen: &Observation<'_, S, N>) -> u32 {
    shown::<S>(channel, read_raw(channel, seen))
}

/// Makes a channel's word as the link has it of a [raw](read_raw) one.
pub(crate) fn shown<S: Scalar>(channel: Channel, raw: u32) -> u32 {
    match channel {
        Channel::Axis(_, signal) => {
            quantity(signal).map_or(raw, |quantity| S::word_to_f32(raw, quantity).to_bits())
        }
        Channel::Stage(_) => raw,
    }
}

/// The quantity of a signal that is raw in the law's number type.
const fn quantity(signal: AxisSignal) -> Option<Quantity> {
    match signal {
        AxisSignal::Error => Some(Quantity::Length),
        AxisSignal::Velocity => Some(Quantity::Velocity),
        AxisSignal::Proportional
        | AxisSignal::Integral
        | AxisSignal::Derivative
        | AxisSignal::Level
        | AxisSignal::Viscous
        | AxisSignal::Presliding
        | AxisSignal::Inertia
        | AxisSignal::BumplessOffset
        | AxisSignal::Output
        | AxisSignal::Injection => Some(Quantity::Voltage),
        AxisSignal::Reference
        | AxisSignal::Position
        | AxisSignal::Code
        | AxisSignal::LimitedBy
        | AxisSignal::CodeSum
        | AxisSignal::Glitch
        | AxisSignal::FrictionScale
        | AxisSignal::Learning
        | AxisSignal::VibrationGate
        | AxisSignal::ErrorSquares
        | AxisSignal::ErrorSquaresOff => None,
    }
}

/// Reads a channel's raw word: a number of the law in its own type, which takes one load. Who reads the recording
/// converts it.
#[inline(always)]
pub(crate) fn read_raw<S: Scalar, const N: usize>(
    channel: Channel,
    seen: &Observation<'_, S, N>,
) -> u32 {
    match channel {
        Channel::Stage(signal) => read_stage(signal, seen),
        // An arm for each axis, so that a signal's place is known in each.
        Channel::Axis(AxisName::X, signal) => read_axis(signal, seen, AxisName::X),
        Channel::Axis(AxisName::Y, signal) => read_axis(signal, seen, AxisName::Y),
        Channel::Axis(AxisName::Z, signal) => read_axis(signal, seen, AxisName::Z),
    }
}

#[inline(always)]
fn read_axis<S: Scalar, const N: usize>(
    signal: AxisSignal,
    seen: &Observation<'_, S, N>,
    name: AxisName,
) -> u32 {
    let [x, y, z] = &**seen.stage.axes();
    let axis = match name {
        AxisName::X => x,
        AxisName::Y => y,
        AxisName::Z => z,
    };
    let glitches = seen.glitches;
    let seen = axis.telemetry();
    match signal {
        AxisSignal::Reference => (seen.reference.0 >> 8) as u32,
        AxisSignal::Position => seen.measured.0 as u32,
        AxisSignal::Error => seen.error.to_word(),
        AxisSignal::Velocity => seen.velocity.to_word(),
        AxisSignal::Proportional => seen.feedback.proportional.to_word(),
        AxisSignal::Integral => seen.feedback.integral.to_word(),
        AxisSignal::Derivative => seen.feedback.derivative.to_word(),
        AxisSignal::Level => seen.feedforward.level.to_word(),
        AxisSignal::Viscous => seen.feedforward.viscous.to_word(),
        AxisSignal::Presliding => seen.feedforward.presliding.to_word(),
        AxisSignal::Inertia => seen.feedforward.inertia.to_word(),
        AxisSignal::BumplessOffset => seen.bumpless_offset.to_word(),
        AxisSignal::Output => seen.output.to_word(),
        AxisSignal::Code => i32::from(seen.code.0) as u32,
        AxisSignal::LimitedBy => seen.limited_by as u32,
        AxisSignal::Injection => axis.injected().to_word(),
        AxisSignal::CodeSum => seen.code_sum.wrapping_sub(seen.code.0.into()) as u32,
        AxisSignal::Glitch => {
            let [x, y, z] = glitches.heights_um;
            let height = match name {
                AxisName::X => x,
                AxisName::Y => y,
                AxisName::Z => z,
            };
            height.to_bits()
        }
        AxisSignal::FrictionScale => axis.learning().scale().to_bits(),
        AxisSignal::Learning => axis.learning().status() as u32,
        AxisSignal::VibrationGate => axis.learning().gate().to_bits(),
        AxisSignal::ErrorSquares => axis.learning().error_squares().to_bits(),
        AxisSignal::ErrorSquaresOff => axis.learning().error_squares_off().to_bits(),
    }
}

#[inline(always)]
fn read_stage<S: Scalar, const N: usize>(signal: StageSignal, seen: &Observation<'_, S, N>) -> u32 {
    match signal {
        StageSignal::State => MachineState::translated(seen.stage.safety()) as u32,
        StageSignal::Fault => match seen.stage.safety().fault() {
            Some(fault) => u32::from(fault.code.number()),
            None => 0,
        },
        StageSignal::Tick => seen.tick(),
        StageSignal::Elapsed => seen.elapsed_cycles,
        StageSignal::CircleDeviation => seen.glitches.circle.deviation_um.to_bits(),
        StageSignal::CircleAngle => seen.glitches.circle.angle_deg.to_bits(),
    }
}
