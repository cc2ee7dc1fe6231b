//! The stage at work: one axis can be exchanged for another between two ticks, and says how near its limit it comes.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::safety::FaultCode;
use quadrant_law::scalar::{Quantity, Scalar};
use quadrant_law::stage::{Inputs, Outputs, Stage, StageRef, StageState};
use quadrant_settings::{PlanSettings, StageSettings};

use crate::safety_faults::{OF_OTHERS, follow, moving, push, sines, standing};
use quadrant_test_support::{Rig, with_x, without_plant};

#[test]
fn an_axis_built_alone_is_the_stages() {
    let settings = StageSettings::simulated();
    let stage: Stage<f32, 4> = settings.build().expect("valid");
    for axis in AxisName::ALL {
        let alone = settings.build_axis::<f32, 4>(axis);
        assert_eq!(alone, *stage.axis(axis));
    }
    assert_eq!(*stage.as_ref().operation, settings.operation());
}

#[test]
fn one_axis_is_exchanged_without_a_jump_and_without_the_others() {
    let settings = StageSettings::simulated();
    let stage: Stage<f32, 4> = without_plant(&settings);
    let weak = with_x(|axis| axis.feedback.pid.kp_v_per_mm *= 0.4);
    let weak = without_plant(&weak);
    let weak = weak.axis(AxisName::X);
    let plan = PlanSettings::default().build(&settings).expect("valid");
    let mut state = StageState::default();
    let mut other = StageState::default();
    let enable = Inputs {
        command: Some(Command::Enable),
        ..Inputs::default()
    };
    let moved = Inputs::of_counts([100; 3]);
    for inputs in [enable, moved, moved, moved] {
        stage.tick(&plan, &mut state, &inputs);
        stage.tick(&plan, &mut other, &inputs);
    }
    let volts = |state: &StageState<f32, 4>, axis: usize| {
        state.axes()[axis]
            .telemetry()
            .output
            .to_f32(Quantity::Voltage)
    };
    let before = volts(&state, 0);
    let pieces = StageRef {
        axes: [weak, stage.axis(AxisName::Y), stage.axis(AxisName::Z)].into(),
        ..stage.as_ref()
    };
    let changed = Inputs {
        settings_changed: [true, false, false].into(),
        ..moved
    };
    pieces.tick(&plan, &mut state, &changed);
    stage.tick(&plan, &mut other, &moved);
    assert!((volts(&state, 0) - before).abs() < 1e-3, "x continues");
    assert!(state.axes()[0].telemetry().bumpless_offset.abs() > 0.01);
    for axis in [1, 2] {
        assert_eq!(state.axes()[axis], other.axes()[axis]);
    }
}

#[test]
fn without_faults_nothing_is_found() {
    let mut rig = moving(&StageSettings::simulated());
    for _ in 0..20_000 {
        follow(&mut rig);
        assert!(rig.tick().enabled);
    }
    // 0.1 mm of the limit at the speed of the time, 1 mm at rest.
    let mark = rig.state.axes()[0].following().high_mark();
    assert!((0.095..0.105).contains(&mark), "{mark}");
}

#[test]
fn the_high_mark_outlasts_the_fault_and_ends_with_enabling() {
    let mut rig = standing(&StageSettings::simulated());
    let mark = |rig: &Rig<f32>| rig.state.axes()[1].following().high_mark();
    assert!((mark(&rig) - 0.1).abs() < 1e-3, "{}", mark(&rig));
    while rig.state.safety().is_enabled() {
        push(&mut rig, AxisName::Y, 10);
        rig.tick();
    }
    assert!((1.0..1.01).contains(&mark(&rig)), "{}", mark(&rig));
    rig.command(Command::ResetFault);
    assert!(mark(&rig) > 1.0);
    rig.stand();
    rig.command(Command::Enable);
    assert_eq!(mark(&rig), 0.0);
}

#[test]
fn a_fault_of_the_last_run_is_latched_at_the_start() {
    for code in &OF_OTHERS[5..] {
        let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &sines());
        rig.state = StageState::with_fault(*code);
        for command in [Command::Enable, Command::Run, Command::Disable] {
            assert_eq!(rig.command(command), Outputs::default());
            let fault = rig.state.safety().fault().expect("latched");
            assert_eq!((fault.code, fault.axis, fault.tick), (*code, None, 0));
        }
        assert_eq!(rig.command(Command::ResetFault), Outputs::default());
        if *code == FaultCode::SettingsInvalid {
            assert!(rig.state.safety().fault().is_some(), "a reset alone");
            rig.state.accept_settings();
            rig.command(Command::ResetFault);
        }
        assert!(rig.command(Command::Enable).enabled, "{code:?}");
    }
}
