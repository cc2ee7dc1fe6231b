//! The component's voltages are the law's words.

use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::Motion;
use quadrant_law::safety::SafetyState;
use quadrant_law::stage::{Inputs, Plan, Stage, StageState};
use quadrant_linuxcnc::reference::{CommandPins, CommandReference, Preview};

use crate::component::{Component, Parameters, RATE_HZ, settings};

#[test]
fn the_voltages_are_the_laws_words_bit_for_bit() {
    let settings = settings();
    let stage: Stage<f32> = settings.build().unwrap();
    let mut state = StageState::default();
    let mut plan: Plan<f32> = PerAxis::from_fn(|_| Motion::Hold);
    let mut references = [0, 1, 2].map(|index| {
        let axis = &settings.axes[index];
        let longest = (1.3e-3 * RATE_HZ).round() - (axis.feedforward.preview_s * RATE_HZ).round();
        let resolution_mm = axis.encoder.resolution_mm;
        let mut reference = CommandReference::new(resolution_mm, RATE_HZ, Preview::Extrapolate);
        reference.preview(axis.feedforward.preview_s, longest as usize);
        reference
    });
    let mut component = Component::start(&Parameters::default());
    let (mut followed, mut first) = (0, None);
    for tick in 0..20_000 {
        component.step(tick > 10);
        let joints = component.pins.joints;
        let counts = joints.map(|joint| joint.rawcounts as u32);
        let mut inputs = Inputs::of_counts(counts);
        // Enabled once its inputs are good, then one axis a tick is let go.
        let modes = state.axes().by_ref().map(|axis| axis.mode());
        let resting = AxisName::ALL
            .into_iter()
            .find(|axis| modes[*axis] == MotionMode::Hold);
        inputs.command = match (tick > 10, state.safety()) {
            (true, SafetyState::Disabled) => Some(Command::Enable),
            (true, SafetyState::Enabled) => resting.map(Command::StartMove),
            _ => None,
        };
        for axis in AxisName::ALL {
            let (joint, reference) = (&joints[axis as usize], &mut references[axis as usize]);
            let follows = modes[axis] == MotionMode::Plan;
            let command = CommandPins {
                ahead_mm: joint.position_cmd - joint.position_fb,
                velocity_mm_s: joint.velocity_cmd,
            };
            // The law counts from its first reading on.
            let first = first.get_or_insert(counts)[axis as usize];
            let count = counts[axis as usize].wrapping_sub(first) as i32;
            let led = reference.step(command, count.into(), !follows);
            plan[axis] = Motion::Given(led.ahead);
            stage
                .as_ref()
                .place_reference(&mut state, axis, led.now.unwrap());
        }
        let outputs = stage.tick(&plan, &mut state, &inputs);
        for axis in AxisName::ALL {
            let law_v =
                f64::from(outputs.codes[axis].0) * (1.0 / f64::from((32767.0 / 10.0) as f32));
            assert_eq!(
                joints[axis as usize].output.to_bits(),
                law_v.to_bits(),
                "{axis} {tick}"
            );
        }
        followed += u32::from(modes.iter().all(|mode| *mode == MotionMode::Plan));
    }
    assert!(followed > 19_000, "{followed}");
}

#[test]
fn the_feedforward_alone_is_the_sum_of_its_terms_and_nears_the_friction() {
    let mut component = Component::start(&Parameters {
        feedforward_only: true,
        ..Parameters::default()
    });
    component.run(20, false);
    // Without a loop the axes stay where they are: only what is put out counts.
    component.run(60, true);
    let joint = component.pins.joints[1];
    let terms = joint.ff_level + joint.ff_viscous + joint.ff_presliding + joint.ff_inertia;
    assert!(!joint.faulted, "{}", joint.fault);
    assert!((joint.output - terms).abs() < 1e-6, "{joint:?}");
}
