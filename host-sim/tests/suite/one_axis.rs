//! x alone, without y and z: the same as with them, to the bit.

use quadrant_law::command::Command;
use quadrant_law::friction::gms::MAX_ELEMENTS;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::{FaultCode, SafetyState};
use quadrant_settings::Job;
use quadrant_settings::{PlanSettings, StageSettings};
use quadrant_sim::law_machine::{LawMachine, Operator, TickInput};
use quadrant_sim::plant::{SimulatedAxis, StageParameters};

/// Enables and starts the plan, and what follows.
fn plan_then(rest: &[(u32, Command)]) -> Operator {
    let started = [(100, Command::Enable), (200, Command::Run)];
    Operator::follows(started.into_iter().chain(rest.iter().copied()))
}

/// Runs x for four seconds with y and z and without them, checks that every tick is the same, and returns how it ends. `disturb`
/// changes the inputs and the axis before a tick.
fn compared(
    motion: MotionSettings,
    mut operator: Operator,
    disturb: impl Fn(u32, &mut TickInput, &mut SimulatedAxis),
) -> SafetyState {
    let job = Job {
        stage: StageSettings::simulated(),
        plan: PlanSettings {
            motions: [motion, MotionSettings::Hold, MotionSettings::Hold],
        },
    };
    let machine = || LawMachine::<f32, MAX_ELEMENTS>::new(&job).unwrap();
    let (mut whole, mut alone) = (machine(), machine().with_x_alone());
    let truth = StageParameters::real().axes[0].clone();
    let mut plant = SimulatedAxis::new(truth, job.stage.rate_hz, 7);
    for tick in 0..40_000 {
        let counts = [plant.read_counter(), 0, 0];
        let mut input = TickInput::of_counts(counts, operator.request(tick));
        disturb(tick, &mut input, &mut plant);
        let (of_whole, of_alone) = (whole.tick(&input), alone.tick(&input));
        assert_eq!(of_whole.codes[0], of_alone.codes[0], "tick {tick}");
        assert_eq!(of_whole.enabled, of_alone.enabled, "tick {tick}");
        let (expected, found) = (whole.state(), alone.state());
        assert_eq!(expected.axes()[0], found.axes()[0], "tick {tick}");
        assert_eq!(expected.safety(), found.safety(), "tick {tick}");
        assert_eq!(expected.is_running(), found.is_running(), "tick {tick}");
        plant.step(of_alone.codes[0], of_alone.enabled);
    }
    assert_eq!(whole.events(), alone.events());
    alone.state().safety()
}

fn sine() -> MotionSettings {
    MotionSettings::Harmonic(HarmonicSettings::with_velocity(5.0, 20.0, 1.5, 0.5))
}

#[test]
fn a_motion_and_a_rest_are_the_same() {
    for motion in [sine(), MotionSettings::Hold] {
        let ends = compared(motion, plan_then(&[]), |_, _, _| {});
        assert_eq!(ends, SafetyState::Enabled);
    }
}

#[test]
fn stopped_disabled_and_enabled_again_it_is_the_same() {
    let script = [
        (8_000, Command::Stop),
        (20_000, Command::Disable),
        (25_000, Command::Enable),
        (26_000, Command::Run),
    ];
    let ends = compared(sine(), plan_then(&script), |_, _, _| {});
    assert_eq!(ends, SafetyState::Enabled);
}

#[test]
fn a_controlled_stop_ends_in_the_same_fault() {
    let ends = compared(sine(), plan_then(&[]), |tick, input, _| {
        input.link_lost = tick == 9_000;
    });
    assert!(matches!(ends, SafetyState::Faulted(fault) if fault.code == FaultCode::LinkLost));
}

#[test]
fn an_axis_that_is_pushed_off_its_reference_ends_in_the_same_fault() {
    let ends = compared(sine(), plan_then(&[]), |tick, _, plant| {
        plant.set_load_v(if tick < 9_000 { 0.0 } else { 9.0 });
    });
    assert!(matches!(ends, SafetyState::Faulted(_)), "{ends:?}");
}
