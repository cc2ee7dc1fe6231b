//! The law of three axes as the firmware has it, without what the firmware does around it.

use quadrant_law::control::feedback::Feedback;
use quadrant_law::control::terms::{FeedbackInput, FeedbackState};
use quadrant_law::feedforward::{Feedforward, FeedforwardState, ReferenceStep};
use quadrant_law::scalar::Scalar;

use crate::c::Input;
use crate::parameters::ELEMENTS;

/// The law of an axis, its parts in the order of the firmware's axis: tables last.
#[repr(C)]
pub(crate) struct Law {
    /// Limit of the output, V.
    pub(crate) limit: f32,
    pub(crate) feedback: Feedback<f32>,
    pub(crate) feedforward: Feedforward<f32, ELEMENTS>,
}

/// Its memory.
#[derive(Default)]
pub(crate) struct State {
    feedback: FeedbackState<f32>,
    feedforward: FeedforwardState<f32, ELEMENTS>,
}

/// Steps the whole law; outputs in V.
#[inline(never)]
pub(crate) fn rust_law(
    laws: &[Law; 3],
    states: &mut [State; 3],
    inputs: &[Input; 3],
    outputs: &mut [f32; 3],
) {
    let axes = laws.iter().zip(states).zip(inputs).zip(outputs);
    for (((law, state), input), output) in axes {
        let step = ReferenceStep {
            displacement: input.displacement,
            velocity: input.velocity,
            acceleration: input.acceleration,
        };
        let base = law.feedforward.step(&mut state.feedforward, step).total();
        let rest = feed_back(law, state, input, base);
        *output = (rest + base).within(law.limit);
    }
}

/// Steps the feedback alone; outputs in V.
#[inline(never)]
pub(crate) fn rust_pid(
    laws: &[Law; 3],
    states: &mut [State; 3],
    inputs: &[Input; 3],
    outputs: &mut [f32; 3],
) {
    let axes = laws.iter().zip(states).zip(inputs).zip(outputs);
    for (((law, state), input), output) in axes {
        *output = feed_back(law, state, input, 0.0);
    }
}

/// The feedback's output, V, beside `base`, V.
#[inline(always)]
fn feed_back(law: &Law, state: &mut State, input: &Input, base: f32) -> f32 {
    let input = FeedbackInput {
        error: input.error,
        velocity: input.velocity,
    };
    law.feedback
        .step(&mut state.feedback, input, base, law.limit)
        .output
}
