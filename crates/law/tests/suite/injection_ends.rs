//! The ends of an injected voltage: their causes, their ticks, and the axes' reactions.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::safety::{AxisSwitches, FaultCode, SafetyState, Switches};
use quadrant_law::stage::Outputs;
use quadrant_settings::{InjectionSettings, PlanSettings, TravelSettings};

use crate::injection::{Bench, bench, request};
use quadrant_test_support::with_x;

#[test]
fn the_loop_is_closed_without_a_bump_from_a_moving_axis() {
    let mut bench = bench();
    // 0.4 V for 15 ms: up to some 170 mm/s.
    bench.begin(&request(true), &[1300; 150]);
    bench.steps(151);
    let fast = bench.velocity_mm_s;
    assert!(fast > 100.0, "{fast}");
    let mut before = 0.0;
    let mut most_mm: f64 = 0.0;
    for tick in 0..2_000 {
        let outputs = bench.step();
        let volts = outputs.codes[0].to_volts(10.0);
        if tick == 0 {
            // What braking takes, and no more.
            assert!(volts.abs() < 1.0, "{volts}");
            before = volts;
        }
        assert!((volts - before).abs() < 1.0, "{volts} after {before}");
        before = volts;
        most_mm = most_mm.max(f64::from(bench.rig.state.axes()[0].telemetry().error_mm()).abs());
    }
    assert!(bench.rig.state.safety().is_enabled(), "{:?}", bench.fault());
    assert_eq!(bench.mode(), MotionMode::Hold);
    assert!(bench.velocity_mm_s.abs() < 1.0, "{}", bench.velocity_mm_s);
    assert!(most_mm < 0.2, "{most_mm}");
}

#[test]
fn a_missing_value_ends_it_and_stops_the_axes() {
    for open_loop in [false, true] {
        let mut bench = bench();
        bench.begin(&request(open_loop), &[300; 50]);
        bench.words.push(0);
        // All but the last: the next one never comes.
        for _ in 0..50 {
            bench.step();
        }
        bench.sent = usize::MAX;
        assert_eq!(bench.fault(), None);
        bench.step();
        assert_eq!(bench.fault(), Some(FaultCode::InjectionUnderrun));
        assert_eq!(bench.rig.state.axes()[0].injected(), 0.0);
        assert!(bench.outputs.enabled, "it brakes under control");
        bench.steps(2_000);
        assert!(matches!(bench.rig.state.safety(), SafetyState::Faulted(_)));
        assert_eq!(bench.outputs, Outputs::default());
    }
}

#[test]
fn leaving_the_given_travel_or_velocity_ends_it() {
    let near = InjectionSettings {
        travel_mm: 0.5,
        ..request(true)
    };
    let slow = InjectionSettings {
        max_velocity_mm_s: 20.0,
        ..request(true)
    };
    for (request, far_mm, fast_mm_s) in [(near, 0.5, 200.0), (slow, 50.0, 20.0)] {
        for sign in [1, -1] {
            let mut bench = bench();
            bench.begin(&request, &[sign * 400; 1_000]);
            while bench.fault().is_none() {
                bench.step();
            }
            assert_eq!(bench.fault(), Some(FaultCode::InjectionBounds));
            let (place, speed) = (bench.position_mm.abs(), bench.velocity_mm_s.abs());
            assert!(place < far_mm + 0.1, "{place}");
            // The speed is filtered over 8 ticks, and half a count is allowed for.
            assert!(speed < fast_mm_s + 12.0, "{speed}");
            bench.steps(3_000);
            assert!(matches!(bench.rig.state.safety(), SafetyState::Faulted(_)));
        }
    }
}

#[test]
fn every_monitor_but_the_following_error_watches_an_open_loop() {
    let settings = with_x(|x| {
        x.homing = None;
        x.limits.travel_mm = Some(TravelSettings {
            negative: -3.0,
            positive: 200.0,
        });
    });
    let provoke = |change: fn(&mut Bench<f32>)| {
        let mut bench = Bench::<f32>::new(&settings, &PlanSettings::default());
        bench.rig.state.set_homed(AxisName::X, true);
        bench.begin(&request(true), &[0; 3_000]);
        bench.tick();
        for _ in 0..2_500 {
            change(&mut bench);
            bench.tick();
            if let Some(fault) = bench.fault() {
                return Some((fault, bench.outputs.enabled));
            }
        }
        None
    };
    assert_eq!(
        provoke(|bench| bench.rig.inputs.switches = Switches::EMERGENCY_STOP),
        Some((FaultCode::EmergencyStop, false))
    );
    assert_eq!(
        provoke(|bench| bench.rig.inputs.readings[0].valid = false),
        Some((FaultCode::EncoderInvalid, false))
    );
    assert_eq!(
        provoke(|bench| bench.rig.inputs.deadline_missed = true),
        Some((FaultCode::DeadlineMissed, false))
    );
    assert_eq!(
        provoke(|bench| bench.rig.inputs.link_lost = true),
        Some((FaultCode::LinkLost, true))
    );
    let creep = |bench: &mut Bench<f32>| {
        let count = &mut bench.rig.inputs.readings[0].count;
        *count = count.wrapping_sub(4);
    };
    // 20 mm/s towards smaller positions: the travel of the axis ends before that of the request.
    let (fault, enabled) = provoke(creep).unwrap();
    assert!(
        matches!(
            fault,
            FaultCode::PredictedSoftLimit | FaultCode::TravelExceeded
        ),
        "{fault:?}"
    );
    assert!(enabled);
    assert_eq!(
        provoke(|bench| {
            bench.rig.inputs.switches =
                Switches::NONE.with_axis(AxisName::X, AxisSwitches::NEGATIVE_LIMIT);
            let count = &mut bench.rig.inputs.readings[0].count;
            *count = count.wrapping_sub(1);
        }),
        Some((FaultCode::NegativeLimitSwitch, true))
    );
}

#[test]
fn a_stop_and_a_disable_end_it() {
    for open_loop in [false, true] {
        let mut bench = bench();
        bench.begin(&request(open_loop), &[400; 1_000]);
        bench.steps(100);
        bench.rig.inputs.command = Some(Command::Stop);
        bench.steps(1_500);
        assert!(!bench.rig.state.is_injecting() && !bench.rig.state.is_running());
        assert!(bench.rig.state.safety().is_enabled(), "{:?}", bench.fault());
        // What is left of it is not taken up again.
        assert!(!bench.rig.state.wants_voltage());

        bench.begin(&request(open_loop), &[400; 1_000]);
        bench.steps(50);
        bench.rig.inputs.command = Some(Command::Disable);
        assert_eq!(bench.step(), Outputs::default());
        assert!(!bench.rig.state.is_injecting());
        assert_eq!(bench.mode(), MotionMode::Hold);
    }
}
