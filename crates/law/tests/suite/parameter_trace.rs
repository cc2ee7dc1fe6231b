//! The trace of a run, which shows if a parameter counts: outputs bit by bit, and the plan that all runs follow.

use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::SafetyState;
use quadrant_law::scalar::{Quantity, Scalar};
use quadrant_settings::PlanSettings;

use quadrant_test_support::Rig;

/// Outputs of every tick, in volts as bits and in codes, and the state at the end.
pub(crate) type Trace = (Vec<([u64; 3], [i16; 3])>, SafetyState);

/// The plan's peak acceleration is just within the default limit.
pub(crate) fn plan() -> PlanSettings {
    let sine = HarmonicSettings::with_velocity(0.5, 31.4, 2.0, 0.2);
    PlanSettings {
        motions: [MotionSettings::Harmonic(sine); 3],
    }
}

/// Runs one tick; gives its outputs.
pub(crate) fn tick_of<S: Scalar>(rig: &mut Rig<S>) -> ([u64; 3], [i16; 3]) {
    let outputs = rig.tick();
    let volts = |index: usize| {
        let volts = rig.state.axes()[index].telemetry().output;
        volts.to_f64(Quantity::Voltage).to_bits()
    };
    (
        core::array::from_fn(volts),
        outputs.codes.map(|code| code.0).into_array(),
    )
}
