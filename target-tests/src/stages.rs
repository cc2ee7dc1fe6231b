//! Stages of the control tick, and the functions that belong to each.

/// The stages, each by the beginning of the path of its functions. Of an instruction's inlined frames, the outermost
/// one found here decides: friction evaluated for the feedforward is feedforward.
const STAGES: [(&str, &str); 11] = [
    ("quadrant_firmware::board::", "inputs and outputs"),
    ("quadrant_law::encoder::", "encoders"),
    ("quadrant_law::reference::", "reference"),
    ("quadrant_law::control::", "feedback"),
    ("quadrant_law::feedforward::", "feedforward"),
    ("quadrant_law::friction::", "friction"),
    ("quadrant_law::safety::", "safety"),
    ("quadrant::app::telemetry::", "telemetry"),
    ("quadrant_law::units::", "units"),
    ("heapless::", "queues"),
    ("quadrant_firmware::app::__rtic_internal_", "spawning"),
];

/// Functions that hold the stages together, innermost first; they count only where no stage does.
const FRAMES: [(&str, &str); 4] = [
    ("quadrant_law::axis::", "axis"),
    ("quadrant_law::stage::", "stage"),
    ("quadrant_firmware::", "interrupt"),
    ("rtic::", "interrupt"),
];

/// Stage of functions that no table has.
pub(crate) const OTHER: &str = "other";

/// The stage of an instruction, from the functions it was inlined into, outermost first.
pub(crate) fn of<'a>(functions: impl Iterator<Item = &'a str> + Clone) -> Option<&'static str> {
    let stage = functions.clone().find_map(|function| {
        STAGES
            .iter()
            .find(|(prefix, _)| path(function).starts_with(prefix))
    });
    let frame = || {
        FRAMES.iter().find(|(prefix, _)| {
            functions
                .clone()
                .any(|function| path(function).starts_with(prefix))
        })
    };
    stage.or_else(frame).map(|(_, name)| *name)
}

/// `<quadrant_law::axis::Axis<f32>>::tick` belongs to `quadrant_law::axis`; references to a type, too.
fn path(function: &str) -> &str {
    function.trim_start_matches(['<', '&', '[', '('])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outermost_stage_decides() {
        let frames = [
            "CONTROL_TICK",
            "<quadrant_law::axis::Axis<f32>>::tick",
            "quadrant_law::feedforward::f",
            "quadrant_law::friction::g",
        ];
        assert_eq!(of(frames.into_iter()), Some("feedforward"));
        assert_eq!(of(frames[..2].iter().copied()), Some("axis"));
        let frames = [
            "quadrant_firmware::app::control",
            "quadrant_law::axis::Axis::drive",
        ];
        assert_eq!(of(frames.into_iter()), Some("axis"));
        assert_eq!(of(["core::ptr::read"].into_iter()), None);
    }
}
