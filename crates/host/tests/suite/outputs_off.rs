//! Outputs that are off between experiments, and when they do not come on again.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use quadrant::app::Translated;
use quadrant_host::client::Client;
use quadrant_host::client::test_axis::ConnectedAxis;
use quadrant_host::machine::{SimulatedLink, Transport};
use quadrant_law::axes::AxisName;
use quadrant_law::reference::{MotionSettings, PointToPointSettings};
use quadrant_law::safety::{FaultCode, Switches};
use quadrant_link::message::{Body, MachineState};
use quadrant_settings::LossReaction;
use quadrant_sim::stage_setup::StageSetup;
use quadrant_tune::commission::bootstrap::measuring_settings;
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::{Drive, Experiment, ExperimentError, TestAxis, Travel};

fn open(setup: &StageSetup) -> Client {
    Client::open(SimulatedLink::start(setup, 1, None).unwrap()).unwrap()
}

fn x(client: &mut Client) -> ConnectedAxis<'_> {
    ConnectedAxis::new(client, AxisName::X, Travel::either_way(400.0)).unwrap()
}

fn hold() -> Experiment {
    Experiment {
        name: "holding".to_owned(),
        drive: Drive::ClosedLoop(MotionSettings::Hold),
        injection_v: vec![0.0; 1_000],
        decimation: 1,
        time_limit_s: 30.0,
    }
}

fn perform(axis: &mut ConnectedAxis<'_>) -> Result<Recording, ExperimentError> {
    axis.perform(&hold(), &mut |_| {})
}

/// A link to a machine whose emergency stop is pressed as long as it is to be.
struct WithButton<T> {
    link: T,
    pressed: Arc<AtomicBool>,
}

impl<T: Transport> Transport for WithButton<T> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let switches = match self.pressed.load(Ordering::Relaxed) {
            true => Switches::EMERGENCY_STOP,
            false => Switches::NONE,
        };
        self.link.simulated_io().unwrap().press(switches);
        self.link.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        self.link.receive(buffer, timeout)
    }

    fn now(&self) -> Duration {
        self.link.now()
    }

    fn endpoint(&self) -> String {
        self.link.endpoint()
    }

    fn remedy(&self) -> &'static str {
        self.link.remedy()
    }
}

#[test]
fn after_an_emergency_stop_between_experiments_no_other_one_moves_the_axis() {
    let pressed = Arc::new(AtomicBool::new(false));
    let button = WithButton {
        link: SimulatedLink::start(&StageSetup::commissioned(), 1, None).unwrap(),
        pressed: pressed.clone(),
    };
    let mut client = Client::open(button).unwrap();
    let mut axis = x(&mut client);
    perform(&mut axis).unwrap();
    axis.switch_off().unwrap();
    pressed.store(true, Ordering::Relaxed);
    let refused = perform(&mut axis).unwrap_err();
    let is_interrupted = matches!(refused, ExperimentError::Interrupted { .. });
    assert!(is_interrupted, "{refused}");
    assert!(refused.to_string().contains("emergency stop"), "{refused}");
    pressed.store(false, Ordering::Relaxed);
    let after = perform(&mut axis).unwrap_err();
    assert_eq!(after.to_string(), refused.to_string());
    assert_eq!(client.status().unwrap().state, MachineState::Disabled);
}

#[test]
fn an_axis_that_swings_evenly_ends_its_experiment_and_no_more() {
    let mut client = open(&StageSetup::commissioned());
    let mut axis = x(&mut client);
    let stable = measuring_settings(axis.settings());
    // A loop that is not damped: once pushed it swings by 0.3 mm either way, for more the output is too small.
    let mut swings = stable.clone();
    swings.plant = None;
    swings.feedback.pid.kp_v_per_mm *= 10.0;
    swings.feedback.pid.ki_v_per_mm_s = 0.0;
    swings.feedback.pid.kd_v_s_per_mm = 0.0;
    swings.amplifier.output_limit_v = 0.6;
    swings.limits.following_error_mm = 0.4;
    swings.limits.following_error_max_mm = 0.4;
    axis.apply(&swings).unwrap();
    let mut pushed = hold();
    pushed.injection_v = vec![0.5; 100];
    pushed.injection_v.extend(vec![0.0; 30_000]);
    let swung = axis.perform(&pushed, &mut |_| {}).unwrap_err();
    assert_eq!(swung.fault(), Some(FaultCode::Oscillation), "{swung}");
    axis.apply(&stable).unwrap();
    perform(&mut axis).unwrap();
}

#[test]
fn a_fault_of_another_axis_stays_latched_and_ends_the_experiments() {
    let mut setup = StageSetup::commissioned();
    // A loop that is not stable.
    let z = &mut setup.settings.axes[2];
    *z = measuring_settings(z);
    z.plant = None;
    z.feedback.pid.kp_v_per_mm *= 10.0;
    z.feedback.pid.kd_v_s_per_mm = 0.0;
    z.limits.following_error_mm = 0.01;
    let mut client = open(&setup);
    let mut axis = x(&mut client);
    let ended = perform(&mut axis).unwrap_err();
    assert!(ended.to_string().contains("of z"), "{ended}");
    let is_interrupted = matches!(ended, ExperimentError::Interrupted { .. });
    assert!(is_interrupted, "{ended}");
    let again = perform(&mut axis).unwrap_err();
    assert_eq!(again.to_string(), ended.to_string());
    assert_eq!(client.status().unwrap().state, MachineState::Fault);
}

#[test]
fn outputs_go_off_after_a_fault_that_only_held_the_axes_and_that_nobody_has_seen() {
    let mut setup = StageSetup::commissioned();
    setup.settings.streaming.link_lost = LossReaction::Hold;
    let mut client = open(&setup);
    client.order(Body::Enable).unwrap();
    client.wait(Duration::from_millis(20)).unwrap();
    let axis = Translated::translated(AxisName::X);
    let velocity_mm_s = 5.0;
    client
        .order(Body::Jog {
            axis,
            velocity_mm_s,
        })
        .unwrap();
    let due = client.now() + Duration::from_secs(1);
    while client.now() < due {
        let left = due - client.now();
        client.notice(left).unwrap();
    }
    let mut axis = x(&mut client);
    let said = axis.switch_off().unwrap_err();
    assert_eq!(said.fault(), Some(FaultCode::LinkLost), "{said}");
    let after = perform(&mut axis).unwrap_err();
    let is_interrupted = matches!(after, ExperimentError::Interrupted { .. });
    assert!(
        is_interrupted && after.to_string().contains("fault 16"),
        "{after}"
    );
    assert_eq!(client.status().unwrap().state, MachineState::Disabled);
}

#[test]
fn an_axis_that_coasts_is_waited_for_before_its_outputs_come_on_again() {
    let mut setup = StageSetup::commissioned();
    let truth = &mut setup.truth.axes[0];
    for way in [&mut truth.friction.positive, &mut truth.friction.negative] {
        way.curve.coulomb_v *= 0.1;
        way.curve.breakaway_v *= 0.1;
        way.viscous_v_s_per_mm *= 0.03;
    }
    truth.damping_per_s = 0.5;
    truth.imperfections.ripple_v = 0.0;
    truth.imperfections.offset_v = 0.0;
    let mut client = open(&setup);
    let mut axis = x(&mut client);
    let mut settings = measuring_settings(axis.settings());
    settings.plant = None;
    settings.limits.following_error_mm = 0.2;
    settings.limits.following_error_max_mm = 0.2;
    axis.apply(&settings).unwrap();
    let mut pushed = Experiment {
        drive: Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm: 200.0,
            max_velocity_mm_s: 150.0,
            max_acceleration_mm_s2: 500.0,
            max_jerk_mm_s3: 5e3,
        })),
        injection_v: vec![0.0; 8_000],
        ..hold()
    };
    pushed.injection_v.extend(vec![1.5; 300]);
    let stopped = axis.perform(&pushed, &mut |_| {}).unwrap_err();
    assert!(stopped.fault().is_some(), "{stopped}");
    axis.switch_off().unwrap();
    perform(&mut axis).unwrap();
}
