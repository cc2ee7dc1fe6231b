//! A voltage through the link, into an axis of the simulated machine, and back as a recording; and what becomes of a machine
//! whose host falls silent.

use std::time::Duration;

use quadrant::app::Translated;
use quadrant_host::client::test_axis::ConnectedAxis;
use quadrant_host::client::{Client, ClientError, settings};
use quadrant_host::machine::SimulatedLink;
use quadrant_law::axes::AxisName;
use quadrant_law::reference::{MotionSettings, PointToPointSettings};
use quadrant_law::safety::FaultCode;
use quadrant_law::units::DacCode;
use quadrant_link::message::MachineState;
use quadrant_link::message::{
    AxisMode, Body, InjectRequest, InjectStatus, Reply, Status, Voltages,
};
use quadrant_sim::plant::StageParameters;
use quadrant_sim::stage_setup::StageSetup;
use quadrant_tune::commission::CrossCheck;
use quadrant_tune::commission::bootstrap::{measuring_settings, zero_gain_settings};
use quadrant_tune::identify::motor_constant::{self, MotorConstantSettings};
use quadrant_tune::identify::revise::ExplicitFriction;
use quadrant_tune::test_axis::{
    Drive, Experiment, ExperimentError, SimulatedTestAxis, TestAxis, Travel,
};

fn client() -> Client {
    Client::open(SimulatedLink::start(&StageSetup::commissioned(), 1, None).unwrap()).unwrap()
}

fn enabled() -> Client {
    let mut client = client();
    client.order(Body::Enable).unwrap();
    client.wait(Duration::from_millis(20)).unwrap();
    client
}

/// Lets time pass without a word to the machine.
fn silence(client: &mut Client, time: Duration) {
    let due = client.now() + time;
    while client.now() < due {
        let left = due - client.now();
        client.notice(left).unwrap();
    }
}

fn inject(client: &mut Client, request: InjectRequest) -> Result<InjectStatus, ClientError> {
    match client.request(Body::Inject(request))? {
        Reply::Inject(status) => Ok(status),
        other => panic!("{other:?}"),
    }
}

fn open(open_loop: bool) -> InjectRequest {
    InjectRequest::Open {
        axis: Translated::translated(AxisName::X),
        open_loop,
        with_plan: false,
        limit_v: 0.5,
        travel_mm: 20.0,
        max_velocity_mm_s: 200.0,
    }
}

fn values(sequence: u32, words: &[i16], last: bool) -> InjectRequest {
    InjectRequest::Values {
        sequence,
        values: Voltages::new(words.iter().copied()),
        last,
    }
}

/// The status once the machine has carried out its command.
fn later(client: &mut Client) -> Status {
    client.wait(Duration::from_millis(400)).unwrap();
    client.status().unwrap()
}

fn fault(client: &mut Client) -> Option<FaultCode> {
    let report = client.fault().unwrap()?;
    FaultCode::from_number(report.code)
}

fn jog(velocity_mm_s: f64) -> Body {
    Body::Jog {
        axis: Translated::translated(AxisName::X),
        velocity_mm_s,
    }
}

#[test]
fn a_jog_goes_on_while_its_host_waits_and_stops_when_it_is_silent() {
    let mut client = enabled();
    client.order(jog(5.0)).unwrap();
    client.wait(Duration::from_secs(2)).unwrap();
    let status = client.status().unwrap();
    assert_eq!(status.axes[0].mode, AxisMode::Jog, "{status:?}");

    silence(&mut client, Duration::from_secs(1));
    assert_eq!(fault(&mut client), Some(FaultCode::LinkLost));
    let status = client.status().unwrap();
    assert_eq!(status.state, MachineState::Fault);
    let there_mm = status.axes[0].position_mm;
    // 2 s and the patience of half a second, at 5 mm/s.
    assert!((12.0..14.0).contains(&there_mm), "{there_mm}");
    silence(&mut client, Duration::from_secs(1));
    let after_mm = client.status().unwrap().axes[0].position_mm;
    assert!((after_mm - there_mm).abs() < 0.1, "{after_mm}");
}

/// Starts a move of 10 mm, which takes 2 s, and says nothing for 3 s; returns where the axis is then.
fn left_alone(client: &mut Client) -> Status {
    let motion = MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm: 10.0,
        max_velocity_mm_s: 5.0,
        max_acceleration_mm_s2: 500.0,
        max_jerk_mm_s3: 1e4,
    });
    let motions = [motion, MotionSettings::Hold, MotionSettings::Hold];
    let plan = quadrant_settings::PlanSettings { motions };
    client
        .order(Body::SetPlan(Translated::translated(plan)))
        .unwrap();
    client.order(Body::Run).unwrap();
    silence(client, Duration::from_secs(3));
    client.status().unwrap()
}

#[test]
fn a_move_needs_its_host_unless_the_settings_say_otherwise() {
    let mut client = enabled();
    let status = left_alone(&mut client);
    assert_eq!(status.state, MachineState::Fault);
    assert_eq!(fault(&mut client), Some(FaultCode::LinkLost));
    let stopped_mm = status.axes[0].position_mm;
    assert!((2.0..5.0).contains(&stopped_mm), "{stopped_mm}");

    let mut client = self::client();
    settings::set(&mut client, "/operation/host_needed", "\"endless-motion\"").unwrap();
    settings::apply(&mut client).unwrap();
    client.order(Body::Enable).unwrap();
    let status = left_alone(&mut client);
    assert_eq!(status.state, MachineState::Enabled);
    assert!((status.axes[0].position_mm - 10.0).abs() < 0.01);
}

#[test]
fn values_that_stop_coming_stop_the_axes() {
    for open_loop in [false, true] {
        let mut client = enabled();
        inject(&mut client, open(open_loop)).unwrap();
        let mut next = 0;
        for _ in 0..10 {
            next = inject(&mut client, values(next, &[800; 192], false))
                .unwrap()
                .next_sequence;
        }
        let status = later(&mut client);
        assert_eq!(fault(&mut client), Some(FaultCode::InjectionUnderrun));
        assert_eq!(status.state, MachineState::Fault);
        assert!(!status.running);
        let seen = inject(&mut client, values(next, &[], false)).unwrap();
        assert!(seen.ended && seen.done == next, "{seen:?}");
    }
}

#[test]
fn an_injection_that_is_closed_holds_where_the_axis_stands() {
    for open_loop in [false, true] {
        let mut client = enabled();
        inject(&mut client, open(open_loop)).unwrap();
        let mut next = 0;
        for _ in 0..12 {
            next = inject(&mut client, values(next, &[900; 192], false))
                .unwrap()
                .next_sequence;
        }
        let running = client.status().unwrap();
        assert!(running.running, "{running:?}");
        if open_loop {
            assert_eq!(running.axes[0].mode, AxisMode::OpenLoop);
        }
        inject(&mut client, InjectRequest::Close).unwrap();
        let status = later(&mut client);
        assert_eq!(status.state, MachineState::Enabled, "{status:?}");
        assert!(!status.running);
        assert_eq!(status.axes[0].mode, AxisMode::Hold);
        // The next one may begin.
        inject(&mut client, open(open_loop)).unwrap();
    }
}

#[test]
fn an_axis_that_moves_is_not_measured() {
    let mut client = enabled();
    client.order(jog(5.0)).unwrap();
    client.wait(Duration::from_millis(100)).unwrap();
    let Err(refused) = ConnectedAxis::new(&mut client, AxisName::X, Travel::either_way(5.0)) else {
        panic!("measured");
    };
    assert!(refused.to_string().contains("`stop`"), "{refused}");
    client.order(Body::Stop).unwrap();
    client.wait(Duration::from_secs(1)).unwrap();
    assert!(ConnectedAxis::new(&mut client, AxisName::X, Travel::either_way(5.0)).is_ok());
}

#[test]
fn what_cannot_be_injected_is_refused_in_words() {
    let refused = |client: &mut Client, request: InjectRequest| {
        inject(client, request).unwrap_err().to_string()
    };
    let mut client = client();
    client.wait(Duration::from_millis(20)).unwrap();
    let said = refused(&mut client, open(false));
    assert!(said.contains("outputs are off"), "{said}");
    let said = refused(&mut client, values(0, &[1], true));
    assert!(said.contains("no injection is open"), "{said}");

    let mut client = enabled();
    let both = InjectRequest::Open {
        axis: Translated::translated(AxisName::X),
        open_loop: true,
        with_plan: true,
        limit_v: 1.0,
        travel_mm: 1.0,
        max_velocity_mm_s: 10.0,
    };
    assert!(refused(&mut client, both).contains("with_plan"));
    let much = InjectRequest::Open {
        axis: Translated::translated(AxisName::X),
        open_loop: true,
        with_plan: false,
        limit_v: 100.0,
        travel_mm: 1.0,
        max_velocity_mm_s: 10.0,
    };
    assert!(refused(&mut client, much).contains("limit_v"));
    inject(&mut client, open(false)).unwrap();
    assert!(refused(&mut client, open(false)).contains("is open"));
    let said = refused(&mut client, values(5, &[1], false));
    assert!(said.contains("from 0 on are missing"), "{said}");
    // 0.5 V is 1638.
    let said = refused(&mut client, values(0, &[1, 1700], false));
    assert!(said.contains("1700 is beyond 1638"), "{said}");
    let move_away = Body::Move {
        axis: Translated::translated(AxisName::Y),
        target_mm: 1.0,
        velocity_mm_s: 1.0,
    };
    inject(&mut client, values(0, &[0; 192], false)).unwrap();
    // Known values are passed over.
    let status = inject(&mut client, values(100, &[0; 92], true)).unwrap();
    assert_eq!(status.next_sequence, 192);
    inject(&mut client, values(192, &[0; 192], false)).unwrap();
    for number in 2..6 {
        inject(&mut client, values(192 * number, &[0; 192], false)).unwrap();
    }
    client.wait(Duration::from_millis(10)).unwrap();
    let said = client.order(move_away).unwrap_err().to_string();
    assert!(said.contains("being injected"), "{said}");
}

/// A sawtooth of 50 mV.
fn sawtooth(count: usize) -> Vec<f64> {
    (0..count)
        .map(|index| 0.05 * ((index % 100) as f64 / 50.0 - 1.0))
        .collect()
}

#[test]
fn in_open_loop_the_recording_is_what_was_put_out() {
    let mut client = client();
    let mut test_axis =
        ConnectedAxis::new(&mut client, AxisName::X, Travel::either_way(20.0)).unwrap();
    let limp = zero_gain_settings(test_axis.settings());
    test_axis.apply(&limp).unwrap();
    let experiment = Experiment {
        name: "a sawtooth".to_owned(),
        drive: Drive::OpenLoop,
        injection_v: sawtooth(20_000),
        decimation: 1,
        time_limit_s: 30.0,
    };
    let recording = test_axis.perform(&experiment, &mut |_| {}).unwrap();
    assert_eq!(recording.len(), 10_000);
    assert!((recording.sample_time_s - 2e-4).abs() < 1e-12);
    // The recording may begin a tick after the injection.
    let step_v = DacCode(1).to_volts(10.0);
    let means = |offset: usize| -> f64 {
        let pairs = experiment.injection_v[offset..].chunks_exact(2);
        pairs
            .zip(&recording.injection_v)
            .map(|(pair, found)| (0.5 * (pair[0] + pair[1]) - found).abs())
            .fold(0.0, f64::max)
    };
    assert!(
        means(0).min(means(1)) <= step_v,
        "{} {}",
        means(0),
        means(1)
    );
    for (voltage, injection) in recording.voltage_v.iter().zip(&recording.injection_v) {
        assert!(
            (voltage - injection).abs() <= step_v,
            "{voltage} {injection}"
        );
    }
    assert_eq!(recording.reference_mm, recording.position_mm);
}

#[test]
fn in_closed_loop_injection_and_motion_begin_together() {
    let mut client = client();
    let mut test_axis =
        ConnectedAxis::new(&mut client, AxisName::X, Travel::either_way(200.0)).unwrap();
    let measuring = measuring_settings(test_axis.settings());
    test_axis.apply(&measuring).unwrap();
    let experiment = Experiment {
        name: "a move".to_owned(),
        drive: Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm: 10.0,
            max_velocity_mm_s: 20.0,
            max_acceleration_mm_s2: 500.0,
            max_jerk_mm_s3: 2e4,
        })),
        injection_v: sawtooth(4_000),
        decimation: 1,
        time_limit_s: 30.0,
    };
    let recording = test_axis.perform(&experiment, &mut |_| {}).unwrap();
    let moved = recording
        .reference_mm
        .iter()
        .position(|reference| (reference - recording.reference_mm[0]).abs() > 1e-5)
        .unwrap();
    // The jerk takes a while to show; the preview is a millisecond.
    assert!((10..60).contains(&moved), "{moved}");
    let last = recording.reference_mm.last().unwrap();
    assert!((last - 10.0).abs() < 0.01, "{last}");
    // 0.4 s of injection, then the rest of the move.
    assert_eq!(
        recording
            .injection_v
            .iter()
            .rposition(|volts| *volts != 0.0)
            .map(|index| index / 10),
        Some(199)
    );
    let feedback: f64 = recording
        .voltage_v
        .iter()
        .zip(&recording.injection_v)
        .map(|(voltage, injection)| (voltage - injection).abs())
        .fold(0.0, f64::max);
    assert!(feedback > 0.05, "the law acts: {feedback}");
}

#[test]
fn the_outputs_stay_on_after_an_experiment_until_they_are_switched_off_and_come_on_with_the_next() {
    let hold = Experiment {
        name: "holding".to_owned(),
        drive: Drive::ClosedLoop(MotionSettings::Hold),
        injection_v: vec![0.0; 1_000],
        decimation: 1,
        time_limit_s: 30.0,
    };
    let after = |switches: &[bool]| {
        let mut client = client();
        let travel = Travel::either_way(20.0);
        let mut axis = ConnectedAxis::new(&mut client, AxisName::X, travel).unwrap();
        for off in switches {
            axis.perform(&hold, &mut |_| {}).unwrap();
            if *off {
                axis.switch_off().unwrap();
            }
        }
        client.status().unwrap().state
    };
    assert_eq!(after(&[false]), MachineState::Enabled);
    assert_eq!(after(&[true]), MachineState::Disabled);
    assert_eq!(after(&[true, false]), MachineState::Enabled);
}

#[test]
fn an_axis_that_leaves_the_travel_is_a_fault_of_the_experiment() {
    let mut client = client();
    let mut test_axis =
        ConnectedAxis::new(&mut client, AxisName::X, Travel::either_way(2.0)).unwrap();
    let experiment = Experiment {
        name: "too much".to_owned(),
        drive: Drive::OpenLoop,
        injection_v: vec![0.3; 20_000],
        decimation: 1,
        time_limit_s: 30.0,
    };
    let error = test_axis.perform(&experiment, &mut |_| {}).unwrap_err();
    assert!(
        matches!(&error, ExperimentError::Fault { fault, .. } if fault.code == FaultCode::InjectionBounds),
        "{error}"
    );
    let position_mm = client.status().unwrap().axes[0].position_mm;
    // Four tenths of the way to the end, and what it coasts.
    assert!((0.8..2.0).contains(&position_mm), "{position_mm}");
}

#[test]
fn the_motor_constant_of_the_connected_axis_is_that_of_the_axis_itself() {
    let mut client = client();
    let mut test_axis =
        ConnectedAxis::new(&mut client, AxisName::X, Travel::either_way(20.0)).unwrap();
    let limp = zero_gain_settings(test_axis.settings());
    test_axis.apply(&limp).unwrap();
    let settings = MotorConstantSettings::default();
    let connected = motor_constant::measure(&mut test_axis, &settings, &mut |_| {}).unwrap();
    let [truth, ..] = StageParameters::real().axes;
    let mut direct = SimulatedTestAxis::new(0, truth, 1);
    let direct = motor_constant::measure(&mut direct, &settings, &mut |_| {}).unwrap();
    let ratio = connected.gain_mm_per_v_s2 / direct.gain_mm_per_v_s2;
    println!(
        "A {:.0} connected, {:.0} directly",
        connected.gain_mm_per_v_s2, direct.gain_mm_per_v_s2
    );
    assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
}

#[test]
fn the_cross_checks_of_an_axis_of_50_mm_s_are_made_within_its_limits() {
    let mut setup = StageSetup::commissioned();
    let axis = &mut setup.settings.axes[0];
    axis.limits.max_velocity_mm_s = 50.0;
    // The best PID.
    axis.feedback.pid.kp_v_per_mm = 1.3293;
    axis.feedback.pid.ki_v_per_mm_s = 146.34;
    axis.feedback.pid.kd_v_s_per_mm = 0.005_511;
    let settings = axis.clone();
    let mut client = Client::open(SimulatedLink::start(&setup, 1, None).unwrap()).unwrap();
    let travel = Travel::either_way(200.0);
    let mut axis = ConnectedAxis::new(&mut client, AxisName::X, travel).unwrap();
    let checked = CrossCheck::run(&mut axis, &settings, 7, &mut |_, _| {}).unwrap();
    let mut revisions = checked.revisions.iter();
    let revised = revisions.find(|revision| revision.friction == ExplicitFriction::Both);
    let ratio = revised.unwrap().plant.gain_mm_per_v_s2 / settings.plant.unwrap().gain_mm_per_v_s2;
    assert!((0.9..1.1).contains(&ratio), "A {ratio} times the settings'");
}

#[test]
fn a_machine_that_restarts_at_another_rate_runs_on_its_clock() {
    let mut client = client();
    let mut stage = settings::in_force(&mut client).unwrap();
    stage.rate_hz = 5e3;
    for axis in &mut stage.axes {
        axis.feedback.pid.derivative_filter_s = 1e-4;
    }
    settings::load(&mut client, &stage).unwrap();
    settings::store(&mut client, "a test").unwrap();
    client.order(Body::Reboot).unwrap();
    client.restarted().unwrap();
    assert_eq!(client.identity().rate_hz, 5e3);
    let (before, began) = (client.status().unwrap().tick, client.now());
    client.wait(Duration::from_secs(1)).unwrap();
    let ticks = client.status().unwrap().tick.wrapping_sub(before);
    let lasted_s = client.now().saturating_sub(began).as_secs_f64();
    let rate_hz = f64::from(ticks) / lasted_s;
    assert!((rate_hz / 5e3 - 1.0).abs() < 0.01, "{rate_hz}");
    let mut axis = ConnectedAxis::new(&mut client, AxisName::X, Travel::either_way(20.0)).unwrap();
    let experiment = Experiment {
        name: "a move".to_owned(),
        drive: Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm: 10.0,
            max_velocity_mm_s: 50.0,
            max_acceleration_mm_s2: 500.0,
            max_jerk_mm_s3: 5e3,
        })),
        injection_v: Vec::new(),
        decimation: 1,
        time_limit_s: 5.0,
    };
    let recording = axis.perform(&experiment, &mut |_| {}).unwrap();
    let errors = recording.reference_mm.iter().zip(&recording.position_mm);
    let most_mm = errors.map(|(r, p)| (r - p).abs()).fold(0.0, f64::max);
    assert!(most_mm < 0.02, "{most_mm}");
}

#[test]
fn settings_that_need_a_restart_are_refused_and_leave_the_machine_as_it_was() {
    let mut client = client();
    let mut axis = ConnectedAxis::new(&mut client, AxisName::X, Travel::either_way(20.0)).unwrap();
    let before = axis.settings().clone();
    let mut other = before.clone();
    other.encoder.resolution_mm *= 2.0;
    let refused = axis.apply(&other).unwrap_err().to_string();
    assert!(refused.contains("`store` and `reboot`"), "{refused}");
    assert_eq!(*axis.settings(), before);
    axis.apply(&before).unwrap();
    assert_eq!(settings::edited(&mut client).unwrap(), Vec::new());
}
