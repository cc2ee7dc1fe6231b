//! Faults of machine and files, and that the output is zero in the period in which it is found.

use std::fs;
use std::time::{Duration, Instant};

use quadrant_law::safety::FaultCode;
use quadrant_linuxcnc::fault::{NO_NUMBER, NOT_ENABLED, OTHER_PERIOD, OTHER_SCALE};
use quadrant_sim::settings_file::defaults_at;

use crate::component::{Component, PERIOD_NS, Parameters, RATE_HZ, settings};

/// A component that follows its command.
fn following(parameters: &Parameters) -> Component {
    let mut component = Component::start(parameters);
    component.run(20, false);
    component.run(2_000, true);
    assert!(component.pins.driven && !component.pins.joints[0].faulted);
    assert!(component.outputs()[0] != 0.0);
    component
}

/// Checks that all outputs are zero, with this fault on every joint.
fn assert_off(component: &Component, fault: i32) {
    assert_eq!(component.outputs(), [0.0; 3]);
    assert!(!component.pins.driven);
    for joint in &component.pins.joints {
        assert!(joint.faulted);
        assert_eq!(joint.fault, fault);
    }
}

#[test]
fn an_encoder_that_stops_counting_switches_all_joints_off_in_the_tick_that_finds_it() {
    let mut component = following(&Parameters::default());
    component.stage.axes[0].freeze = true;
    let mut ticks = 0;
    while component.pins.driven {
        component.step(true);
        ticks += 1;
        assert!(ticks < 400, "a tenth of a second");
    }
    assert_eq!(component.outputs(), [0.0; 3]);
    assert!(
        component
            .pins
            .joints
            .iter()
            .all(|joint| joint.faulted && joint.fault > 0)
    );
}

#[test]
fn a_tick_that_is_late_switches_off_where_a_limit_is_set_and_nowhere_else() {
    let mut component = following(&Parameters {
        late: 3,
        ..Parameters::default()
    });
    component.pins.now_ns += PERIOD_NS;
    component.step(true);
    assert!(component.pins.driven, "two periods");
    component.pins.now_ns += 3 * PERIOD_NS;
    component.step(true);
    assert_off(&component, FaultCode::DeadlineMissed.number().into());
    let mut without = following(&Parameters::default());
    without.pins.now_ns += 100 * PERIOD_NS;
    without.step(true);
    assert!(without.pins.driven);
}

#[test]
fn a_thread_of_another_period_and_a_command_that_is_no_number_drive_nothing() {
    let mut component = following(&Parameters::default());
    component.pins.period_ns = 1_000_000;
    component.step(true);
    assert_off(&component, OTHER_PERIOD);
    let mut component = following(&Parameters::default());
    component.origin_mm = f64::NAN;
    component.step(true);
    assert_off(&component, NO_NUMBER);
}

#[test]
fn the_emergency_stop_and_an_amplifiers_fault_switch_off_in_their_tick() {
    let mut component = following(&Parameters::default());
    component.pins.estop = true;
    component.step(true);
    assert_off(&component, FaultCode::EmergencyStop.number().into());
    let mut component = following(&Parameters::default());
    component.pins.joints[1].amp_fault = true;
    component.step(true);
    assert_off(&component, FaultCode::AmplifierFault.number().into());
}

#[test]
fn enable_that_falls_switches_off_in_its_tick_and_a_fault_ends_when_it_rises_again() {
    let mut component = following(&Parameters::default());
    component.step(false);
    assert_eq!(component.outputs(), [0.0; 3]);
    assert!(!component.pins.joints[0].faulted);
    // The axes coast to rest.
    component.run(2_000, false);
    component.pins.estop = true;
    component.step(true);
    component.run(100, true);
    component.pins.estop = false;
    component.run(100, true);
    assert!(!component.pins.driven && component.pins.joints[0].faulted);
    component.run(2_000, false);
    component.run(10, true);
    assert!(
        !component.pins.joints[0].faulted,
        "{}",
        component.pins.joints[0].fault
    );
}

#[test]
fn settings_that_are_missing_or_damaged_drive_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.store");
    let mut component = Component::start(&Parameters {
        store: Some(missing.clone()),
        bare: true,
        ..Parameters::default()
    });
    component.run(20, false);
    component.run(200, true);
    assert_off(&component, NOT_ENABLED);
    assert!(missing.exists(), "made for later");
    let damaged = folder.path().join("damaged.store");
    let mut bytes = fs::read(&missing).unwrap();
    for (index, byte) in bytes.iter_mut().enumerate().take(600) {
        *byte = (index % 251) as u8;
    }
    fs::write(&damaged, bytes).unwrap();
    let mut component = Component::start(&Parameters {
        store: Some(damaged),
        ..Parameters::default()
    });
    component.run(20, false);
    component.run(200, true);
    assert_off(&component, FaultCode::SettingsInvalid.number().into());
    let short = folder.path().join("short.store");
    fs::write(&short, "too short").unwrap();
    let refused = Component::try_start(&Parameters {
        store: Some(short),
        ..Parameters::default()
    });
    assert!(refused.is_none(), "loadrt fails");
}

#[test]
fn a_component_that_is_unloaded_while_it_drives_ends_at_once() {
    let component = following(&Parameters::default());
    let begun = Instant::now();
    drop(component);
    assert!(begun.elapsed() < Duration::from_secs(1));
    // Another one starts in its place.
    following(&Parameters::default());
}

#[test]
fn an_index_that_resets_the_position_moves_nothing() {
    let mut plain = following(&Parameters::default());
    let mut reset = following(&Parameters::default());
    reset.origin_mm = -3.217;
    for _ in 0..500 {
        plain.step(true);
        reset.step(true);
        for (one, other) in plain.outputs().into_iter().zip(reset.outputs()) {
            assert!((one - other).abs() < 2e-3, "{one} {other}");
        }
    }
}

#[test]
fn a_joint_without_a_law_is_not_enabled_beside_joints_that_have_one() {
    let mut settings = settings();
    settings.axes[2] = defaults_at(RATE_HZ).axes[2].clone();
    let mut component = Component::start(&Parameters {
        settings: Some(settings),
        ..Parameters::default()
    });
    component.run(20, false);
    component.run(2_000, true);
    assert_off(&component, NOT_ENABLED);
}

#[test]
fn an_emergency_stop_that_is_pressed_when_the_machine_is_switched_on_is_named() {
    let mut component = Component::start(&Parameters::default());
    component.run(20, false);
    component.pins.estop = true;
    component.run(2_000, true);
    assert_off(&component, FaultCode::EmergencyStop.number().into());
}

#[test]
fn a_velocity_that_no_machine_has_switches_off() {
    let mut component = following(&Parameters::default());
    let position = [component.stage.axes[0].position_fb; 3];
    component.step_along(true, position, [1e20; 3]);
    assert_off(&component, NO_NUMBER);
}

#[test]
fn a_position_that_does_not_move_as_the_count_does_switches_off() {
    for scale in [0.8, 1.2] {
        let mut component = Component::start(&Parameters::default());
        component.scale = scale;
        component.run(20, false);
        component.run(8_000, true);
        assert_off(&component, OTHER_SCALE);
    }
}
