//! Settings to and from the machine.

use quadrant_law::axes::AxisName;
use quadrant_law::control::feedback::LawKind;
use quadrant_link::message::{self, AxisSet};
use quadrant_settings::StageSettings;
use quadrant_tune::test_axis::Travel;

use super::connected;
use crate::client::settings::{self, ExchangeError, whole_path};
use crate::machine::Machine;

#[test]
fn paths_may_be_written_short() {
    let whole = "/axes/1/limits/max_velocity_mm_s";
    for path in [
        whole,
        "axes/1/limits/max_velocity_mm_s",
        "/axes/y/limits/max_velocity_mm_s",
        "y/limits/max_velocity_mm_s",
        "1/limits/max_velocity_mm_s",
    ] {
        assert_eq!(whole_path(path), whole, "{path}");
    }
    assert_eq!(whole_path("rate_hz"), "/rate_hz");
    assert_eq!(whole_path("z"), "/axes/2");
    assert_eq!(whole_path(""), "/");
}

#[test]
fn what_is_dumped_is_what_the_machine_has() {
    let (mut client, bench) = connected();
    assert_eq!(
        settings::dump(&mut client).unwrap(),
        bench.borrow().in_force
    );
}

#[test]
fn settings_in_force_are_read_beside_a_draft_that_has_more_and_less() {
    let (mut client, bench) = connected();
    bench.borrow_mut().in_force.axes[1].plant = None;
    let acts = bench.borrow().in_force.clone();
    for (path, value) in [
        ("/axes/0/encoder/resolution_mm", "0.001"),
        ("/axes/0/feedback/nonlinear", "null"),
        ("/axes/2/feedback/pid/kp_v_per_mm", "0.5"),
    ] {
        settings::set(&mut client, path, value).unwrap();
    }
    assert_eq!(settings::in_force(&mut client).unwrap(), acts);
    assert_eq!(Machine::settings(&mut client).unwrap(), acts);
    assert_eq!(settings::resolutions_mm(&mut client).unwrap(), [0.0005; 3]);
    let draft = settings::dump(&mut client).unwrap();
    assert_eq!(draft.axes[0].encoder.resolution_mm, 0.001);
}

#[test]
fn a_test_of_an_axis_does_not_write_over_what_is_edited() {
    let (mut client, bench) = connected();
    settings::set(&mut client, "/axes/1/feedback/pid/kp_v_per_mm", "0.5").unwrap();
    let travel = Travel::either_way(10.0);
    let error = client.test_axis(AxisName::X, travel).err().unwrap();
    let text = error.to_string();
    for part in ["y/feedback/pid/kp_v_per_mm", "`apply`", "`revert`"] {
        assert!(text.contains(part), "{text}");
    }
    assert_eq!(bench.borrow().in_force, StageSettings::simulated());
    let draft = settings::dump(&mut client).unwrap();
    assert_eq!(draft.axes[1].feedback.pid.kp_v_per_mm, 0.5);
    settings::apply(&mut client).unwrap();
    assert!(client.test_axis(AxisName::X, travel).is_ok());
}

#[test]
fn loaded_settings_are_in_force_parts_and_lists_included() {
    let (mut client, bench) = connected();
    let mut requested = StageSettings::simulated();
    requested.axes[0].feedback.law = LawKind::Pid;
    requested.axes[0].feedback.nonlinear = None;
    requested.axes[1].plant = None;
    requested.axes[1].feedback.pid.kp_v_per_mm = 1.0 / 3.0;
    let loaded = settings::load(&mut client, &requested).unwrap();
    assert_eq!(bench.borrow().in_force, requested);
    let changed = [message::AxisName::X, message::AxisName::Y]
        .into_iter()
        .collect::<AxisSet>();
    assert_eq!(loaded.applied.changed, changed);
    assert_eq!(loaded.changed.len(), 4, "{:?}", loaded.changed);
    assert!(loaded.left.is_empty());
    // And back: the parts that were left out come again.
    let loaded = settings::load(&mut client, &StageSettings::simulated()).unwrap();
    assert_eq!(bench.borrow().in_force, StageSettings::simulated());
    assert!(
        loaded
            .changed
            .iter()
            .any(|path| path == "x/feedback/nonlinear")
    );
    // A second time there is nothing to do.
    let loaded = settings::load(&mut client, &StageSettings::simulated()).unwrap();
    assert!(loaded.changed.is_empty(), "{:?}", loaded.changed);
}

#[test]
fn what_the_machine_refuses_is_reverted() {
    let (mut client, bench) = connected();
    let mut bad = StageSettings::simulated();
    bad.axes[2].encoder.resolution_mm = 7.0;
    let error = settings::load(&mut client, &bad).unwrap_err();
    assert!(matches!(error, ExchangeError::Reverted(_)), "{error}");
    let text = error.to_string();
    assert!(text.contains("z/encoder/resolution_mm = 7"), "{text}");
    assert!(text.contains("nothing was changed"), "{text}");
    assert_eq!(bench.borrow().in_force, StageSettings::simulated());
    assert_eq!(
        settings::dump(&mut client).unwrap(),
        StageSettings::simulated()
    );
}

/// The machine checks them before it answers, in software where it knows no double precision.
#[test]
fn settings_have_time_to_be_checked() {
    let (mut client, bench) = connected();
    settings::set(&mut client, "/axes/0/feedback/pid/kp_v_per_mm", "0.5").unwrap();
    bench.borrow_mut().answer_after_ms = 4000;
    settings::apply(&mut client).unwrap();
    assert_eq!(
        bench.borrow().in_force.axes[0].feedback.pid.kp_v_per_mm,
        0.5
    );
}

#[test]
fn a_name_needs_no_quotes_and_a_number_none_either() {
    let (mut client, bench) = connected();
    settings::set(&mut client, "/axes/0/feedback/law", "pid").unwrap();
    settings::set(&mut client, "/axes/0/feedback/pid/kp_v_per_mm", "0.5").unwrap();
    settings::apply(&mut client).unwrap();
    let bench = bench.borrow();
    assert_eq!(bench.in_force.axes[0].feedback.law, LawKind::Pid);
    assert_eq!(bench.in_force.axes[0].feedback.pid.kp_v_per_mm, 0.5);
}

#[test]
fn a_path_that_there_is_not_is_named() {
    let (mut client, _) = connected();
    let error = settings::get(&mut client, "/axes/0/nonsense")
        .unwrap_err()
        .to_string();
    assert!(error.contains("/axes/0/nonsense"), "{error}");
    let long = "x".repeat(400);
    let error = settings::get(&mut client, &long).unwrap_err().to_string();
    assert!(error.contains("400 bytes long"), "{error}");
}

#[test]
fn provenance_is_kept_with_what_is_stored() {
    let (mut client, _) = connected();
    settings::store(&mut client, "quadrant commission --axis x").unwrap();
    assert_eq!(
        settings::provenance(&mut client).unwrap(),
        "quadrant commission --axis x"
    );
}
