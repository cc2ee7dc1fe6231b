//! The rules of operation: enabling, motions that need their host, and the emergency stop.

use quadrant_law::command::Command;
use quadrant_law::safety::{EnabledBy, FaultCode, HostNeeded, SafetyState};
use quadrant_link::message::{AxisName as WireAxis, Body, InjectRequest, Voltages};
use quadrant_settings::StageSettings;

use crate::preemption::{LINK_TIMEOUT_TICKS, endless, plan, refused, safety, settings};
use quadrant_fault_bench::tasks::Tasks;

fn tasks(change: impl FnOnce(&mut StageSettings)) -> Tasks {
    let mut settings = settings();
    change(&mut settings);
    Tasks::new(&settings, 1)
}

fn is_enabled(tasks: &Tasks) -> bool {
    tasks.upper.borrow().outputs.enabled
}

/// A wish of the operator, and a while.
fn operate(tasks: &mut Tasks, command: Command) {
    tasks.upper.borrow_mut().operate(command);
    tasks.run(40);
}

#[test]
fn host_and_operator_both_enable_unless_the_settings_say_who() {
    for (enabled_by, host_may, operator_may) in [
        (EnabledBy::Any, true, true),
        (EnabledBy::Host, true, false),
        (EnabledBy::Operator, false, true),
    ] {
        let mut tasks = tasks(|settings| settings.operation.enabled_by = enabled_by);
        let answer = tasks.ask(Body::Enable);
        assert_eq!(refused(Some(&answer)), !host_may, "{answer:?}");
        tasks.run(40);
        assert_eq!(is_enabled(&tasks), host_may);
        tasks.ask(Body::Disable).expect("everybody may");
        tasks.run(40);
        operate(&mut tasks, Command::Enable);
        assert_eq!(is_enabled(&tasks), operator_may);
    }
}

#[test]
fn the_law_itself_enables_for_nobody_whom_the_settings_do_not_allow_to() {
    let mut tasks = tasks(|settings| settings.operation.enabled_by = EnabledBy::Host);
    // Past supervising task and server, which judge what was.
    tasks.upper.borrow_mut().inputs.command = Some(Command::Enable);
    tasks.run(20);
    assert!(!is_enabled(&tasks));
}

#[test]
fn a_button_that_is_an_enabling_device_ends_what_the_host_moves_when_it_is_let_go() {
    let mut tasks = tasks(|settings| settings.operation.enabled_by = EnabledBy::Operator);
    operate(&mut tasks, Command::Enable);
    let jog = Body::Jog {
        axis: WireAxis::Z,
        velocity_mm_s: 2.0,
    };
    tasks.ask(jog.clone()).expect("the button is held");
    tasks.run(500);
    assert!(tasks.upper.borrow().state().is_running());
    operate(&mut tasks, Command::Disable);
    assert!(!is_enabled(&tasks));
    assert!(refused(Some(&tasks.ask(Body::Enable))));
    assert!(refused(Some(&tasks.ask(jog))));
}

/// Runs a plan of some 0.9 s that a host has started, or the operator, and then nobody asks anything.
fn left_alone(host_needed: HostNeeded, by_host: bool) -> (SafetyState, i64) {
    let mut tasks = tasks(|settings| settings.operation.host_needed = host_needed);
    tasks.ask(Body::Enable).expect("enables");
    tasks.ask(plan(4.0)).expect("takes the plan");
    if by_host {
        tasks.ask(Body::Run).expect("runs");
    } else {
        operate(&mut tasks, Command::Run);
    }
    tasks.run(3 * LINK_TIMEOUT_TICKS);
    let measured = tasks.upper.borrow().snapshot().axes[2].measured.0;
    (safety(&tasks), measured)
}

/// The plan's end on the z axis, counts.
const PLAN_END: i64 = 24_000;

#[test]
fn a_motion_that_a_host_started_ends_with_it_even_if_it_would_end_by_itself() {
    let (safety, measured) = left_alone(HostNeeded::EveryMotion, true);
    let fault = safety.fault().expect("latched");
    assert_eq!(fault.code, FaultCode::LinkLost);
    assert!(measured < PLAN_END, "{measured}");
}

#[test]
fn a_motion_with_an_end_goes_on_alone_if_the_settings_or_the_operator_say_so() {
    for (needed, by_host) in [
        (HostNeeded::EndlessMotion, true),
        (HostNeeded::EveryMotion, false),
    ] {
        let (safety, measured) = left_alone(needed, by_host);
        assert!(safety.is_enabled(), "{safety:?}");
        assert_eq!(measured, PLAN_END);
    }
}

#[test]
fn a_motion_of_the_operator_needs_no_host_even_after_one_of_the_host() {
    let mut tasks = tasks(|_| {});
    tasks.ask(Body::Enable).expect("enables");
    tasks.ask(plan(4.0)).expect("takes the plan");
    tasks.ask(Body::Run).expect("runs");
    for _ in 0..15 {
        tasks.ask(Body::Status).expect("is there");
        tasks.run(1000);
    }
    assert!(!tasks.upper.borrow().state().is_running());
    operate(&mut tasks, Command::Run);
    assert!(tasks.upper.borrow().state().is_running());
    tasks.run(3 * LINK_TIMEOUT_TICKS);
    assert_eq!(safety(&tasks).fault(), None);
    let measured = tasks.upper.borrow().snapshot().axes[2].measured.0;
    assert!(measured >= 2 * PLAN_END, "{measured}");
}

#[test]
fn homing_needs_its_host_too() {
    let mut tasks = tasks(|_| {});
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(40);
    tasks
        .ask(Body::Home([WireAxis::Y].into_iter().collect()))
        .expect("starts");
    tasks.run(LINK_TIMEOUT_TICKS - 500);
    assert!(tasks.upper.borrow().state().is_running());
    tasks.run(3000);
    let code = safety(&tasks).fault().map(|fault| fault.code);
    assert_eq!(code, Some(FaultCode::LinkLost));
}

#[test]
fn homing_goes_on_alone_if_the_settings_say_so() {
    let mut tasks = tasks(|settings| settings.operation.host_needed = HostNeeded::EndlessMotion);
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(40);
    tasks
        .ask(Body::Home([WireAxis::Y].into_iter().collect()))
        .expect("starts");
    tasks.run(2 * LINK_TIMEOUT_TICKS);
    assert!(tasks.upper.borrow().state().is_running());
}

#[test]
fn a_host_is_lost_half_a_second_after_the_tick_of_its_last_request() {
    let mut tasks = tasks(|_| {});
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(40);
    let jog = Body::Jog {
        axis: WireAxis::Y,
        velocity_mm_s: 2.0,
    };
    tasks.ask(jog).expect("jogs");
    tasks.run(10);
    // Received by the run of the supervising task in tick `received` - 1, and counted by the next.
    let received = tasks.tick() + 10;
    tasks.send(&[Body::Status]);
    tasks.run(2 * LINK_TIMEOUT_TICKS);
    let fault = safety(&tasks).fault().expect("latched");
    assert_eq!(fault.code, FaultCode::LinkLost);
    assert_eq!(fault.tick - received, LINK_TIMEOUT_TICKS + 1);
}

/// An injection of a few values with the plan, and then nobody asks anything.
fn plan_of_an_injection(host_needed: HostNeeded, plan: Body) -> Tasks {
    let mut tasks = tasks(|settings| settings.operation.host_needed = host_needed);
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(40);
    tasks.ask(plan).expect("takes the plan");
    let open = InjectRequest::Open {
        axis: WireAxis::Z,
        open_loop: false,
        with_plan: true,
        limit_v: 2.0,
        travel_mm: 50.0,
        max_velocity_mm_s: 100.0,
    };
    let values = InjectRequest::Values {
        sequence: 0,
        values: Voltages::new([0; 100].into_iter()),
        last: true,
    };
    for request in [open, values] {
        tasks.ask(Body::Inject(request)).expect("takes it");
    }
    tasks.run(300);
    let upper = tasks.upper.borrow();
    assert!(upper.state().is_running() && !upper.state().is_injecting());
    drop(upper);
    tasks
}

#[test]
fn a_plan_that_an_injection_started_needs_its_host_as_one_that_was_run() {
    for (needed, plan, is_needed) in [
        (HostNeeded::EveryMotion, plan(8.0), true),
        (HostNeeded::EndlessMotion, endless(), true),
        (HostNeeded::EndlessMotion, plan(8.0), false),
    ] {
        let mut tasks = plan_of_an_injection(needed, plan);
        tasks.run(LINK_TIMEOUT_TICKS + 3000);
        let lost = safety(&tasks).fault().map(|fault| fault.code);
        let expected = is_needed.then_some(FaultCode::LinkLost);
        assert_eq!(lost, expected, "{needed:?}");
    }
}

#[test]
fn an_endless_motion_needs_its_host_whatever_the_settings_say() {
    let mut tasks = tasks(|settings| settings.operation.host_needed = HostNeeded::EndlessMotion);
    tasks.ask(Body::Enable).expect("enables");
    tasks.ask(endless()).expect("takes the plan");
    tasks.ask(Body::Run).expect("runs");
    tasks.run(3 * LINK_TIMEOUT_TICKS);
    let code = safety(&tasks).fault().map(|fault| fault.code);
    assert_eq!(code, Some(FaultCode::LinkLost));
}

#[test]
fn a_host_counts_as_lost_after_half_a_second_at_every_control_rate() {
    for rate_hz in [2.5e3, 1e4, 1.5e4] {
        let mut tasks = tasks(|settings| {
            settings.rate_hz = rate_hz;
            for axis in &mut settings.axes {
                axis.feedback.pid.derivative_filter_s = 1.0 / rate_hz;
            }
        });
        tasks.ask(Body::Enable).expect("enables");
        tasks
            .ask(Body::Jog {
                axis: WireAxis::Z,
                velocity_mm_s: 2.0,
            })
            .expect("jogs");
        let received = tasks.tick();
        while safety(&tasks).is_enabled() {
            tasks.run(1);
        }
        let fault = safety(&tasks).fault().expect("latched");
        assert_eq!(fault.code, FaultCode::LinkLost);
        let silent_s = f64::from(fault.tick - received) / rate_hz;
        assert!(
            (silent_s - 0.5).abs() < 0.02,
            "{silent_s} s at {rate_hz} Hz"
        );
    }
}
