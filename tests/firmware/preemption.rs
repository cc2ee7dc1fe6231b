//! The tasks' agreements in every interleaving of them: nothing is decided on a state that has passed.

use quadrant::app::link_timeout_ticks;
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::safety::{FaultCode, SafetyState};
use quadrant_link::frame::{self, FRAME_BYTES};
use quadrant_link::message::{
    AxisName, Body, Harmonic, LinkError, Motion, Plan, PointToPoint, Provenance, Reply, Request,
    SettingsRequest,
};
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_fault_bench::flash::Flash;
use quadrant_fault_bench::tasks::Tasks;
use quadrant_test_support::Noise;

/// The host counts as lost after so long.
pub(crate) const LINK_TIMEOUT_TICKS: u32 = link_timeout_ticks(10_000);

/// Settings that are soon checked: without a plant there is no bound to search.
pub(crate) fn settings() -> StageSettings {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        axis.plant = None;
        axis.feedback.law = LawKind::Pid;
    }
    settings
}

fn store() -> Body {
    Body::Settings(SettingsRequest::Store(Provenance::new()))
}

pub(crate) fn plan(unit_mm: f64) -> Body {
    let motion = |axis: f64| {
        Motion::PointToPoint(PointToPoint {
            distance_mm: axis * unit_mm,
            max_velocity_mm_s: 20.0,
            max_acceleration_mm_s2: 500.0,
            max_jerk_mm_s3: 1e4,
        })
    };
    Body::SetPlan(Plan {
        motions: [motion(1.0), motion(2.0), motion(3.0)],
    })
}

pub(crate) fn endless() -> Body {
    let mut motions = [Motion::Hold; 3];
    motions[1] = Motion::Harmonic(Harmonic {
        amplitude_mm: 1.0,
        frequency_hz: 2.0,
        phase_rad: 0.0,
        cycles: None,
        lead_s: 0.2,
    });
    Body::SetPlan(Plan { motions })
}

fn enabled() -> Tasks {
    let mut tasks = Tasks::new(&settings(), 1);
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(20);
    assert!(tasks.upper.borrow().outputs.enabled);
    tasks
}

pub(crate) fn safety(tasks: &Tasks) -> SafetyState {
    tasks.upper.borrow().state().safety()
}

/// A frame of any payload, with a right CRC.
fn framed(payload: &[u8]) -> Vec<u8> {
    let body = [payload, &crc32fast::hash(payload).to_le_bytes()].concat();
    let mut encoded = [0; FRAME_BYTES];
    let length = cobs::encode(&body, &mut encoded);
    [&encoded[..length], &[frame::DELIMITER]].concat()
}

pub(crate) fn refused(answer: Option<&Result<Reply, LinkError>>) -> bool {
    matches!(answer, Some(Err(LinkError::Refused(_))))
}

#[test]
fn enable_and_store_in_one_burst_write_nothing_while_the_outputs_are_on() {
    let mut tasks = Tasks::new(&settings(), 1);
    let first = tasks.send(&[Body::Enable, store()]);
    tasks.run(3000);
    assert_eq!(tasks.answers.get(&first), Some(&Ok(Reply::Done)));
    assert!(refused(tasks.answers.get(&(first + 1))));
    let first = tasks.send(&[Body::Disable, store(), Body::Enable]);
    tasks.run(8000);
    for id in first..first + 3 {
        assert_eq!(tasks.answers.get(&id), Some(&Ok(Reply::Done)), "{id}");
    }
    let upper = tasks.upper.borrow();
    assert!(upper.outputs.enabled);
    assert_eq!((upper.driven_while_busy, upper.guarded), (0, 0));
}

/// A leaf that safety depends on, as a request sets it.
fn slower() -> Body {
    let mut settings = settings();
    settings.axes[0].limits.max_velocity_mm_s = 100.0;
    set("/axes/0/limits/max_velocity_mm_s", &settings)
}

/// Sets a leaf as it is in some settings.
pub(crate) fn set(path: &str, settings: &StageSettings) -> Body {
    let mut bytes = [0; quadrant_settings::MAX_VALUE_BYTES];
    let (kind, length) = settings.get_bytes(path, &mut bytes).expect("a leaf");
    Body::Settings(SettingsRequest::Set {
        path: path.try_into().expect("fits"),
        value: quadrant_link::message::Value {
            kind,
            bytes: heapless::Vec::from_slice(&bytes[..length]).expect("fits"),
        },
    })
}

#[test]
fn enable_waits_for_the_settings_that_were_applied_before_it() {
    let apply = || Body::Settings(SettingsRequest::Apply);
    let mut tasks = Tasks::new(&settings(), 1);
    let first = tasks.send(&[slower(), apply(), Body::Enable]);
    tasks.run(300);
    assert_eq!(tasks.answers.get(&(first + 2)), Some(&Ok(Reply::Done)));
    assert!(tasks.upper.borrow().outputs.enabled);
    let jog = Body::Jog {
        axis: AxisName::X,
        velocity_mm_s: 150.0,
    };
    assert!(tasks.ask(jog).is_err(), "the new limit is in force");

    // A request to disable is acted on while it waits.
    let mut tasks = Tasks::new(&settings(), 1);
    let first = tasks.send(&[slower(), apply(), Body::Enable, Body::Disable]);
    tasks.run(300);
    assert!(refused(tasks.answers.get(&(first + 2))));
    assert!(!tasks.upper.borrow().outputs.enabled);
}

#[test]
fn the_link_stays_open_when_the_operator_enables_before_the_settings_are_built() {
    let mut changed = settings();
    changed.axes[1].limits.max_velocity_mm_s = 100.0;
    let mut tasks = Tasks::new(&settings(), 1);
    let first = tasks.send(&[
        slower(),
        set("/axes/1/limits/max_velocity_mm_s", &changed),
        Body::Settings(SettingsRequest::Apply),
    ]);
    tasks.upper.borrow_mut().operate(Command::Enable);
    tasks.run(40);
    assert!(matches!(
        tasks.answers.get(&(first + 2)),
        Some(Ok(Reply::Applied(_)))
    ));
    assert!(tasks.upper.borrow().outputs.enabled);
    assert_eq!(tasks.ask(Body::Enable), Ok(Reply::Done));
    tasks.ask(Body::Status).expect("answers");
    // The settings come when the outputs are off.
    tasks.ask(Body::Disable).expect("disables");
    assert_eq!(tasks.ask(Body::Enable), Ok(Reply::Done));
    tasks.run(40);
    assert!(tasks.upper.borrow().outputs.enabled);
    let upper = tasks.upper.borrow();
    assert_eq!((upper.driven_while_busy, upper.guarded), (0, 0));
}

#[test]
fn settings_that_may_change_while_driven_act_and_leave_the_outputs_on() {
    let mut tasks = enabled();
    let mut changed = settings();
    changed.axes[0].feedback.pid.kp_v_per_mm *= 0.5;
    let path = "/axes/0/feedback/pid/kp_v_per_mm";
    tasks.ask(set(path, &changed)).expect("a draft");
    tasks
        .ask(Body::Settings(SettingsRequest::Apply))
        .expect("applies");
    tasks.run(300);
    assert!(tasks.upper.borrow().outputs.enabled);
    tasks.ask(slower()).expect("a draft");
    let refusal = tasks.ask(Body::Settings(SettingsRequest::Apply));
    assert!(refusal.is_err(), "{refusal:?}");
    assert!(tasks.upper.borrow().outputs.enabled);
}

/// The x axis under a jog of 5 mm/s, and the words it has put out.
fn jogging(tasks: &mut Tasks, ticks: u32) -> Vec<i16> {
    tasks
        .ask(Body::Jog {
            axis: AxisName::X,
            velocity_mm_s: 5.0,
        })
        .expect("jogs");
    tasks.run(1000);
    x_words(tasks, ticks)
}

fn x_words(tasks: &mut Tasks, ticks: u32) -> Vec<i16> {
    (0..ticks)
        .map(|_| {
            tasks.step();
            tasks.upper.borrow().outputs.codes[0].0
        })
        .collect()
}

#[test]
fn settings_that_change_while_driven_make_no_step_in_the_output() {
    let mut tasks = enabled();
    let before = *jogging(&mut tasks, 1).last().expect("one");
    let mut changed = settings();
    changed.axes[0].friction.sliding.positive.viscous_v_s_per_mm += 0.02;
    let path = "/axes/0/friction/sliding/positive/viscous_v_s_per_mm";
    tasks.send(&[
        set(path, &changed),
        Body::Settings(SettingsRequest::Apply),
        Body::Status,
    ]);
    let mut words = vec![before];
    words.extend(x_words(&mut tasks, 4000));
    assert!(
        tasks.upper.borrow().state().is_running(),
        "the host is missed"
    );
    let after = *words.last().expect("some");
    let step = words
        .windows(2)
        .map(|pair| pair[0].abs_diff(pair[1]))
        .max()
        .expect("some");
    let whole = before.abs_diff(after);
    assert!(whole > 100, "{before} to {after}");
    assert!(step < whole / 20, "a step of {step} on the way of {whole}");
}

#[test]
fn gains_for_an_axis_that_was_not_commissioned_switch_the_outputs_off() {
    let mut with_two = settings();
    let z = &mut with_two.axes[2];
    *z = StageSettings::default().axes[2].clone();
    let mut tasks = Tasks::new(&with_two, 1);
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(40);
    assert!(tasks.upper.borrow().outputs.enabled);
    let mut changed = with_two.clone();
    changed.axes[2].feedback.pid.kp_v_per_mm = 1.0;
    tasks
        .ask(set("/axes/2/feedback/pid/kp_v_per_mm", &changed))
        .expect("a draft");
    tasks
        .ask(Body::Settings(SettingsRequest::Apply))
        .expect("applies");
    tasks.run(300);
    assert!(!tasks.upper.borrow().outputs.enabled);
    assert!(refused(Some(&tasks.ask(Body::Enable))));
}

/// The other sign of the x amplifier, taken by the server while the outputs are off.
fn turned_round() -> [Body; 2] {
    let mut changed = settings();
    changed.axes[0].amplifier.reversed = !changed.axes[0].amplifier.reversed;
    [
        set("/axes/0/amplifier/reversed", &changed),
        Body::Settings(SettingsRequest::Apply),
    ]
}

#[test]
fn settings_that_safety_depends_on_wait_for_the_outputs_to_be_off_whoever_enabled_them() {
    let mut tasks = enabled();
    let sign = |tasks: &mut Tasks| jogging(tasks, 1)[0].signum();
    let usual = sign(&mut tasks);
    tasks.ask(Body::Disable).expect("disables");
    tasks.run(3000);
    // The operator enables in the tick before the server, which saw them off, passes the settings on.
    tasks.send(&turned_round());
    tasks.upper.borrow_mut().operate(Command::Enable);
    tasks.run(100);
    let upper = tasks.upper.borrow().outputs.enabled;
    assert!(upper, "the operator has enabled");
    assert_eq!(sign(&mut tasks), usual);
    tasks.ask(Body::Disable).expect("disables");
    tasks.run(3000);
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(40);
    assert_eq!(sign(&mut tasks), -usual);
}

#[test]
fn nothing_enables_between_the_axes_of_one_change() {
    let mut changed = settings();
    for axis in &mut changed.axes {
        axis.limits.max_velocity_mm_s = 100.0;
    }
    let mut withheld = 0;
    for polls in 1..8 {
        let mut tasks = Tasks::new(&settings(), 1);
        for axis in ["x", "y"] {
            let index = usize::from(axis == "y");
            let path = format!("/axes/{index}/limits/max_velocity_mm_s");
            tasks.ask(set(&path, &changed)).expect("a draft");
        }
        tasks.send(&[Body::Settings(SettingsRequest::Apply)]);
        tasks.run(10 * polls);
        // The server is held up with some axes passed on and others not.
        tasks.held_up = 50;
        tasks.run(10);
        tasks.upper.borrow_mut().operate(Command::Enable);
        tasks.run(100);
        let is_enabled = tasks.upper.borrow().outputs.enabled;
        withheld += u32::from(!is_enabled);
        if !is_enabled {
            tasks.run(1000);
            tasks.upper.borrow_mut().operate(Command::Enable);
            tasks.run(100);
            assert!(tasks.upper.borrow().outputs.enabled, "after {polls} polls");
        }
    }
    assert!((1..6).contains(&withheld), "{withheld} of 7");
}

/// True if a jog that the host has asked for begins after commands of the operator's in every tick, which let it wait.
fn jogs_after(command: Command) -> bool {
    let mut tasks = enabled();
    tasks.upper.borrow_mut().inputs.command = Some(command);
    tasks.send(&[Body::Jog {
        axis: AxisName::X,
        velocity_mm_s: 5.0,
    }]);
    tasks.run(40);
    tasks.upper.borrow_mut().inputs.command = None;
    tasks.run(20);
    let upper = tasks.upper.borrow();
    upper.state().is_running()
}

#[test]
fn an_order_that_waits_is_dropped_when_a_stop_overtakes_it_and_by_nothing_else() {
    assert!(!jogs_after(Command::Stop));
    assert!(jogs_after(Command::Enable));
}

#[test]
fn enable_and_reboot_in_one_burst_do_not_restart_a_driven_machine() {
    let mut tasks = Tasks::new(&settings(), 1);
    let first = tasks.send(&[Body::Enable, Body::Reboot]);
    tasks.run(500);
    assert!(refused(tasks.answers.get(&(first + 1))));
    assert_eq!(tasks.restarts, 0);
    tasks.ask(Body::Disable).expect("disables");
    tasks.ask(Body::Reboot).expect("restarts");
    // Until the restart nothing enables.
    tasks.upper.borrow_mut().operate(Command::Enable);
    tasks.run(100);
    assert!(tasks.restarts > 0 && !tasks.upper.borrow().outputs.enabled);
}

/// Bursts of requests, and an operator who presses, in random interleavings.
#[test]
fn no_interleaving_writes_flash_with_the_outputs_on_or_tears_a_plan() {
    let campaigns = std::env::var("QUADRANT_INTERLEAVINGS").map_or(60, |count| {
        count.parse().expect("QUADRANT_INTERLEAVINGS: a number")
    });
    let (mut stores, mut runs, mut enabled) = (0, 0, 0);
    for seed in 0..campaigns {
        let mut noise = Noise::new(seed);
        let mut tasks = Tasks::new(&settings(), seed);
        for _ in 0..12 {
            let burst: Vec<Body> = (0..1 + noise.bits() % 5)
                .map(|_| match noise.bits() % 11 {
                    0..=2 => Body::Enable,
                    3 => Body::Disable,
                    4 | 5 => store(),
                    6 => plan(0.02),
                    7 => plan(-0.03),
                    8 | 9 => Body::Run,
                    _ => Body::Stop,
                })
                .collect();
            let first = tasks.send(&burst);
            for _ in 0..20 {
                if noise.bits().is_multiple_of(6) {
                    let pressed = [Command::Enable, Command::Disable, Command::Run];
                    tasks
                        .upper
                        .borrow_mut()
                        .operate(pressed[noise.bits() as usize % 3]);
                }
                tasks.run(1 + (noise.bits() % 60) as u32);
                enabled += u32::from(tasks.upper.borrow().outputs.enabled);
            }
            for (body, id) in burst.iter().zip(first..) {
                let done = matches!(tasks.answers.get(&id), Some(Ok(_)));
                stores += u32::from(done && *body == store());
                runs += u32::from(done && *body == Body::Run);
            }
        }
        let upper = tasks.upper.borrow();
        assert_eq!(
            (upper.driven_while_busy, upper.guarded, upper.torn),
            (0, 0, 0),
            "seed {seed}: ticks driven while flash was busy, saved by the enable line alone, plans torn"
        );
    }
    println!("{campaigns} interleavings: {stores} stores, {runs} runs, enabled at {enabled} looks");
    assert!(stores > campaigns as u32 / 2 && runs > campaigns as u32 / 4 && enabled > 100);
}

#[test]
fn a_plan_is_exchanged_whole_or_refused() {
    let mut tasks = enabled();
    let first = tasks.send(&[plan(0.02), plan(-0.03), Body::Run, plan(0.02)]);
    tasks.run(3000);
    for id in first..first + 3 {
        assert_eq!(tasks.answers.get(&id), Some(&Ok(Reply::Done)), "{id}");
    }
    assert!(refused(tasks.answers.get(&(first + 3))));
    let upper = tasks.upper.borrow();
    assert_eq!(upper.torn, 0);
    let counts = upper.snapshot().axes.map(|axis| axis.measured.0);
    assert_eq!(counts, [-60, -120, -180]);
}

/// The worst delay from the last byte of `Stop` or `Disable` at the board to the tick that acts on it, in any state of the
/// server: one run of the supervising task, and the next tick.
const WORST_DELAY_TICKS: u32 = 11;

#[test]
fn stop_and_disable_wait_for_no_other_request() {
    for (body, phase) in [Body::Stop, Body::Disable]
        .into_iter()
        .flat_map(|body| (0..10).map(move |phase| (body.clone(), phase)))
    {
        let mut tasks = enabled();
        tasks.ask(endless()).expect("takes the plan");
        tasks.ask(Body::Run).expect("runs");
        tasks.run(2000);
        // The server builds, and stays there.
        tasks.send(&[Body::Settings(SettingsRequest::Apply)]);
        for _ in 0..phase {
            tasks.upper.borrow_mut().tick();
        }
        tasks.send(std::slice::from_ref(&body));
        let acted = |tasks: &Tasks| {
            let upper = tasks.upper.borrow();
            !upper.outputs.enabled
                || upper.snapshot().view.modes[1] == quadrant_law::motion::MotionMode::Stopping
        };
        let mut ticks = 0;
        while !acted(&tasks) {
            tasks.upper.borrow_mut().tick();
            ticks += 1;
            assert!(ticks <= WORST_DELAY_TICKS, "{body:?} at phase {phase}");
        }
        assert_eq!(
            tasks.upper.borrow().outputs.enabled,
            body == Body::Stop,
            "{body:?}"
        );
    }
}

#[test]
fn what_was_asked_before_a_stop_does_not_start_after_it() {
    for body in [Body::Stop, Body::Disable] {
        let mut tasks = enabled();
        tasks.ask(plan(0.02)).expect("takes the plan");
        tasks.held_up = 30;
        let first = tasks.send(&[Body::Run, Body::Enable, body.clone()]);
        let before = tasks
            .upper
            .borrow()
            .snapshot()
            .axes
            .map(|axis| axis.measured.0);
        tasks.run(2000);
        assert!(refused(tasks.answers.get(&first)), "{body:?}");
        assert_eq!(tasks.answers.get(&(first + 2)), Some(&Ok(Reply::Done)));
        let after = tasks
            .upper
            .borrow()
            .snapshot()
            .axes
            .map(|axis| axis.measured.0);
        assert_eq!(before, after);
        // And it is over then.
        tasks.ask(Body::Enable).expect("enables");
        tasks.run(30);
        tasks.ask(Body::Run).expect("runs");
    }
}

#[test]
fn a_motion_without_an_end_stops_with_its_host_even_if_the_server_has_died() {
    for server_lives in [true, false] {
        let mut tasks = enabled();
        tasks.ask(endless()).expect("takes the plan");
        tasks.ask(Body::Run).expect("runs");
        let received = tasks.tick();
        if !server_lives {
            tasks.held_up = u32::MAX;
        }
        // Requests of another version, damaged ones and noise prove nothing.
        let mut buffer = [0; FRAME_BYTES];
        let request = Request {
            id: 77,
            body: Body::Status,
        };
        let mut damaged = frame::encode(&request, &mut buffer).expect("fits").to_vec();
        damaged[2] ^= 4;
        let other_version = framed(&[9, 77, 1]);
        let no_request = framed(&[1, 77, 200]);
        let mut stopped = None;
        while stopped.is_none() && tasks.tick() - received < 3 * LINK_TIMEOUT_TICKS {
            for bytes in [&damaged, &other_version, &no_request, &vec![3, 0]] {
                tasks.upper.borrow_mut().receive(bytes);
            }
            tasks.run(100);
            if let SafetyState::Stopping(fault) = safety(&tasks) {
                stopped = Some(fault);
            }
        }
        let fault = stopped.expect("stops");
        assert_eq!(fault.code, FaultCode::LinkLost);
        let silent = fault.tick - received;
        assert!(
            (LINK_TIMEOUT_TICKS - 20..=LINK_TIMEOUT_TICKS + 20).contains(&silent),
            "{silent} ticks"
        );
        tasks.run(3000);
        assert!(!tasks.upper.borrow().outputs.enabled);
    }
}

#[test]
fn a_host_that_asks_keeps_its_motion() {
    let mut tasks = enabled();
    tasks.ask(endless()).expect("takes the plan");
    tasks.ask(Body::Run).expect("runs");
    for _ in 0..10 {
        tasks.run(LINK_TIMEOUT_TICKS / 2);
        tasks.ask(Body::Status).expect("answers");
    }
    assert!(tasks.upper.borrow().state().is_running());
}

#[test]
fn a_motion_of_the_operator_needs_no_host() {
    let mut tasks = enabled();
    tasks.ask(endless()).expect("takes the plan");
    tasks.upper.borrow_mut().operate(Command::Run);
    tasks.run(3 * LINK_TIMEOUT_TICKS);
    assert!(tasks.upper.borrow().state().is_running());
}

#[test]
fn a_jog_that_the_server_gave_and_forgot_stops_too() {
    let mut tasks = enabled();
    let jog = Body::Jog {
        axis: AxisName::Z,
        velocity_mm_s: 2.0,
    };
    tasks.ask(jog).expect("jogs");
    tasks.held_up = u32::MAX;
    tasks.run(LINK_TIMEOUT_TICKS + 1000);
    assert!(matches!(
        safety(&tasks),
        SafetyState::Stopping(_) | SafetyState::Faulted(_)
    ));
}

#[test]
fn invalid_settings_outlast_a_reset_until_others_are_stored() {
    let mut older = settings();
    // The default encoder, so that they take effect without a restart.
    for axis in &mut older.axes {
        axis.encoder = StageSettings::default().axes[0].encoder;
        axis.homing = None;
    }
    let mut tasks = Tasks::with_flash(&StageSettings::default(), 1, Flash::default(), Some(&older));
    assert!(matches!(
        tasks.ask(Body::ResetFault),
        Err(LinkError::Refused(_))
    ));
    // The law decides, for every station.
    tasks.upper.borrow_mut().inputs.command = Some(Command::ResetFault);
    tasks.run(20);
    tasks.upper.borrow_mut().inputs.command = None;
    let code = safety(&tasks).fault().expect("latched").code;
    assert_eq!(code, FaultCode::SettingsInvalid);
    // The older set is there to be looked at, and not in force.
    assert!(!tasks.upper.borrow().snapshot().view.commissioned);
    tasks
        .ask(Body::Settings(SettingsRequest::Apply))
        .expect("applies");
    tasks.run(200);
    assert!(tasks.upper.borrow().snapshot().view.commissioned);
    assert!(refused(Some(&tasks.ask(Body::ResetFault))));
    tasks.ask(store()).expect("stores");
    tasks.ask(Body::ResetFault).expect("resets");
    tasks.run(20);
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(20);
    assert!(tasks.upper.borrow().outputs.enabled);
}

#[test]
fn a_crash_does_not_hide_invalid_settings() {
    let mut state = quadrant_law::stage::StageState::<f32>::with_fault(FaultCode::Panic);
    state.start_faulted(FaultCode::SettingsInvalid);
    assert_eq!(
        state.safety().fault().expect("latched").code,
        FaultCode::Panic
    );
    let stage: quadrant_law::stage::Stage<f32> = settings().build().expect("valid");
    let plan = PlanSettings::default()
        .build(&settings())
        .expect("no motion");
    let view = stage.as_ref().view(&plan, &state);
    assert!(view.settings_invalid);
    assert_eq!(
        quadrant_law::admission::refusal(view, Command::ResetFault),
        Some(quadrant_law::admission::Refusal::SettingsInvalid)
    );
}

#[test]
fn an_enabling_that_the_operator_asked_for_first_does_not_act_after_a_hosts_disable() {
    for (body, waiting) in [Body::Disable, Body::Stop]
        .into_iter()
        .flat_map(|body| (1..4).map(move |waiting| (body.clone(), waiting)))
    {
        let mut tasks = Tasks::new(&settings(), 1);
        tasks.run(20);
        for _ in 0..waiting {
            tasks.upper.borrow_mut().operate(Command::Enable);
        }
        tasks.send(std::slice::from_ref(&body));
        tasks.run(200);
        let enabled = tasks.upper.borrow().outputs.enabled;
        assert!(!enabled, "{body:?} after {waiting} requests");
        // And it is over then.
        tasks.upper.borrow_mut().operate(Command::Enable);
        tasks.run(40);
        assert!(tasks.upper.borrow().outputs.enabled, "{body:?}");
    }
}

#[test]
fn a_button_that_is_let_go_disables_whatever_the_host_asks_for_beside_it() {
    let mut tasks = enabled();
    tasks.upper.borrow_mut().operate(Command::Run);
    tasks.upper.borrow_mut().operate(Command::Disable);
    tasks.send(&[Body::Stop]);
    tasks.run(40);
    assert!(!tasks.upper.borrow().outputs.enabled);
}

#[test]
fn what_a_host_asked_for_first_does_not_act_after_the_operators_disable() {
    let mut tasks = Tasks::new(&settings(), 1);
    tasks.held_up = 30;
    let first = tasks.send(&[Body::Enable]);
    tasks.run(50);
    tasks.upper.borrow_mut().operate(Command::Disable);
    tasks.run(1000);
    assert!(refused(tasks.answers.get(&first)));
    assert!(!tasks.upper.borrow().outputs.enabled);
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(40);
    assert!(tasks.upper.borrow().outputs.enabled);
}

/// Requests that fill the queue of bytes to the server, which does not read.
fn fill_the_bytes(tasks: &mut Tasks) {
    tasks.held_up = u32::MAX;
    for _ in 0..40 {
        tasks.send(&vec![Body::Status; 8]);
        tasks.run(20);
    }
}

#[test]
fn a_stop_and_a_living_host_are_found_behind_a_full_queue_of_bytes() {
    for body in [Body::Stop, Body::Disable] {
        let mut tasks = enabled();
        tasks.ask(endless()).expect("takes the plan");
        tasks.ask(Body::Run).expect("runs");
        tasks.run(2000);
        fill_the_bytes(&mut tasks);
        // As long as it asks, whether it is answered or not, the host is there.
        for _ in 0..30 {
            tasks.send(&[Body::Status]);
            tasks.run(LINK_TIMEOUT_TICKS / 10);
        }
        assert!(tasks.upper.borrow().state().is_running());
        tasks.send(std::slice::from_ref(&body));
        tasks.run(2 * WORST_DELAY_TICKS);
        let upper = tasks.upper.borrow();
        let acted = match body {
            Body::Stop => {
                upper.snapshot().view.modes[1] == quadrant_law::motion::MotionMode::Stopping
            }
            _ => !upper.outputs.enabled,
        };
        assert!(acted, "{body:?}");
    }
}

#[test]
fn of_a_stop_and_a_disabling_in_one_run_the_disabling_acts() {
    for burst in [[Body::Stop, Body::Disable], [Body::Disable, Body::Stop]] {
        let mut tasks = enabled();
        tasks.held_up = u32::MAX;
        tasks.send(&burst);
        tasks.run(2 * WORST_DELAY_TICKS);
        assert!(!tasks.upper.borrow().outputs.enabled, "{burst:?}");
    }
}
