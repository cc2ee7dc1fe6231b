//! Ends of the travel: limit switches and soft limits stop an axis on its way out, and let it come back.

use proptest::prelude::*;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::reference::{MotionSettings, PointToPointSettings, Ramp, Velocity};
use quadrant_law::safety::travel::{Travel, TravelState};
use quadrant_law::safety::{AxisSwitches, FaultCode, SafetyState, Switches};
use quadrant_law::units::Position;
use quadrant_settings::{LossReaction, PlanSettings, StageSettings, TravelSettings};

use crate::safety_faults::{follow, moving, sines};
use quadrant_test_support::{Rig, repeatable, with_x};

const RESOLUTION_MM: f64 = 5e-4;

fn by(distance_mm: f64, velocity_mm_s: f64) -> PlanSettings {
    let mut plan = PlanSettings::default();
    plan.motions[0] = MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm,
        max_velocity_mm_s: velocity_mm_s,
        max_acceleration_mm_s2: 2000.0,
        max_jerk_mm_s3: 1e5,
    });
    plan
}

fn travel(positive: f64) -> StageSettings {
    with_x(|axis| {
        axis.limits.travel_mm = Some(TravelSettings {
            negative: -positive,
            positive,
        });
    })
}

/// Follows exactly until the stage stands or is off; where the reference went at most, mm.
fn to_the_end(rig: &mut Rig<f32>) -> f64 {
    let mut furthest: f64 = 0.0;
    let mut standing = 0;
    for _ in 0..100_000 {
        let reference = rig.state.axes()[0].telemetry().reference;
        rig.inputs.readings[0] = EncoderReading::of((reference.0 >> 16) as u32);
        rig.tick();
        if rig.state.safety().drives() {
            let reference = rig.state.axes()[0].telemetry().reference;
            furthest = furthest.max(reference.to_mm(RESOLUTION_MM).abs());
        }
        let over = match rig.state.safety() {
            SafetyState::Stopping(_) => false,
            SafetyState::Faulted(_) => true,
            _ => {
                standing += u32::from(!rig.state.is_running());
                // The feedback's reference is behind by the preview.
                standing > 50
            }
        };
        if over {
            return furthest;
        }
    }
    panic!("it never ends");
}

/// Goes over to another plan and runs it.
fn run(rig: &mut Rig<f32>, settings: &StageSettings, plan: &PlanSettings) {
    rig.plan = plan.build(settings).expect("valid");
    rig.command(Command::Run);
    assert!(rig.state.is_running(), "{:?}", rig.state.safety());
}

fn homed(settings: &StageSettings) -> Rig<f32> {
    let mut rig = Rig::<f32>::new(settings, &PlanSettings::default());
    rig.state.set_homed(AxisName::X, true);
    rig.tick();
    rig.command(Command::Enable);
    rig
}

proptest! {
    #![proptest_config(repeatable(60))]

    #[test]
    fn a_motion_out_of_the_travel_stops_before_it(
        positive in 1.0f64..50.0,
        beyond in 1.0f64..100.0,
        velocity in 10.0f64..250.0,
        backward in any::<bool>(),
    ) {
        let settings = travel(positive);
        let mut rig = homed(&settings);
        let distance = positive + beyond;
        run(&mut rig, &settings, &by(if backward { -distance } else { distance }, velocity));
        let furthest = to_the_end(&mut rig);
        let fault = rig.state.safety().fault().expect("found");
        prop_assert_eq!((fault.code, fault.axis), (FaultCode::PredictedSoftLimit, Some(AxisName::X)));
        // Half a millimetre of following error is allowed beyond.
        prop_assert!(furthest <= positive + 0.5, "{furthest} mm of {positive} mm");
        // And not much is given away: the bound of the stopping distance is no more than 20 ticks of travel too long.
        let given_away = velocity * 60e-4 + 0.05;
        prop_assert!(furthest >= positive + 0.5 - given_away, "{furthest} mm of {positive} mm");
    }

    #[test]
    fn a_motion_that_ends_on_the_limit_is_no_fault(
        positive in 1.0f64..50.0,
        velocity in 10.0f64..250.0,
        backward in any::<bool>(),
    ) {
        let settings = travel(positive);
        let mut rig = homed(&settings);
        run(&mut rig, &settings, &by(if backward { -positive } else { positive }, velocity));
        let furthest = to_the_end(&mut rig);
        prop_assert!(rig.state.safety().is_enabled());
        prop_assert!((furthest - positive).abs() < 1e-6, "{furthest} mm");
    }
}

#[test]
fn the_travel_is_in_force_only_when_homed() {
    let settings = travel(1.0);
    let mut rig = homed(&settings);
    rig.state.set_homed(AxisName::X, false);
    run(&mut rig, &settings, &by(5.0, 100.0));
    to_the_end(&mut rig);
    assert!(rig.state.safety().is_enabled());
    assert!(!rig.state.axes()[0].is_homed());
}

#[test]
fn beyond_the_travel_an_axis_can_come_back_but_not_go_further() {
    let settings = travel(1.0);
    let mut rig = homed(&settings);
    rig.state.set_homed(AxisName::X, false);
    run(&mut rig, &settings, &by(5.0, 100.0));
    to_the_end(&mut rig);
    rig.state.set_homed(AxisName::X, true);
    // It was inside since it was enabled only while that was not in force: no fault at rest.
    for _ in 0..100 {
        assert!(rig.tick().enabled);
    }
    run(&mut rig, &settings, &by(1.0, 10.0));
    to_the_end(&mut rig);
    let fault = rig.state.safety().fault().expect("further out");
    assert_eq!(fault.code, FaultCode::PredictedSoftLimit);
    rig.command(Command::ResetFault);
    rig.command(Command::Enable);
    run(&mut rig, &settings, &by(-4.2, 100.0));
    to_the_end(&mut rig);
    assert!(rig.state.safety().is_enabled(), "{:?}", rig.state.safety());
    // Back inside, the measured position counts again.
    while rig.state.safety().is_enabled() {
        rig.inputs.readings[0].count += 10;
        rig.tick();
    }
    let fault = rig.state.safety().fault().expect("pushed out");
    assert_eq!(fault.code, FaultCode::TravelExceeded);
}

#[test]
fn a_pressed_limit_switch_lets_an_axis_away_and_not_further() {
    for (switch, code, out) in [
        (
            AxisSwitches::POSITIVE_LIMIT,
            FaultCode::PositiveLimitSwitch,
            5.0,
        ),
        (
            AxisSwitches::NEGATIVE_LIMIT,
            FaultCode::NegativeLimitSwitch,
            -5.0,
        ),
    ] {
        let settings = StageSettings::simulated();
        let mut rig = homed(&settings);
        run(&mut rig, &settings, &by(out, 100.0));
        for _ in 0..300 {
            let reference = rig.state.axes()[0].telemetry().reference;
            rig.inputs.readings[0] = EncoderReading::of((reference.0 >> 16) as u32);
            assert!(rig.tick().enabled);
        }
        rig.inputs.switches = Switches::NONE.with_axis(AxisName::X, switch);
        to_the_end(&mut rig);
        let fault = rig.state.safety().fault().expect("pressed");
        assert_eq!((fault.code, fault.axis), (code, Some(AxisName::X)));
        // On the switch: enabling is possible, going on is not, going back is.
        rig.command(Command::ResetFault);
        assert!(rig.command(Command::Enable).enabled);
        run(&mut rig, &settings, &by(out, 100.0));
        to_the_end(&mut rig);
        assert_eq!(rig.state.safety().fault().expect("again").code, code);
        rig.command(Command::ResetFault);
        rig.command(Command::Enable);
        run(&mut rig, &settings, &by(-out, 100.0));
        to_the_end(&mut rig);
        assert!(rig.state.safety().is_enabled());
    }
}

#[test]
fn a_switch_of_an_axis_that_stands_is_no_fault() {
    let mut rig = homed(&StageSettings::simulated());
    let both = AxisSwitches::NEGATIVE_LIMIT.with(AxisSwitches::POSITIVE_LIMIT);
    for axis in AxisName::ALL {
        rig.inputs.switches = Switches::NONE.with_axis(axis, both.with(AxisSwitches::HOME));
        assert!(rig.tick().enabled);
    }
}

#[test]
fn bad_inputs_keep_the_stage_from_being_enabled_and_are_named() {
    type Spoil = fn(&mut Rig<f32>);
    let cases: [(FaultCode, Spoil); 5] = [
        (FaultCode::EmergencyStop, |rig| {
            rig.inputs.switches = Switches::EMERGENCY_STOP
        }),
        (FaultCode::AmplifierFault, |rig| {
            rig.inputs.switches =
                Switches::NONE.with_axis(AxisName::Y, AxisSwitches::AMPLIFIER_FAULT);
        }),
        (FaultCode::OutputMismatch, |rig| {
            rig.inputs.switches =
                Switches::NONE.with_axis(AxisName::Y, AxisSwitches::OUTPUT_MISMATCH);
        }),
        (FaultCode::StaleSample, |rig| {
            rig.inputs.readings[1].fresh = false
        }),
        (FaultCode::EncoderInvalid, |rig| {
            rig.inputs.readings[1].valid = false
        }),
    ];
    for (code, spoil) in cases {
        let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &sines());
        // From the start, and again once there were good inputs.
        for state in [SafetyState::Start, SafetyState::Disabled] {
            for _ in 0..10 {
                spoil(&mut rig);
                assert!(!rig.command(Command::Enable).enabled, "{code:?}");
                assert_eq!(rig.state.safety(), state);
                let interlock = rig.state.interlock().expect("named");
                let axis = (code != FaultCode::EmergencyStop).then_some(AxisName::Y);
                assert_eq!((interlock.code, interlock.axis), (code, axis));
            }
            rig.inputs.switches = Switches::NONE;
            rig.tick();
            assert_eq!(rig.state.safety(), SafetyState::Disabled);
            assert_eq!(rig.state.interlock(), None);
        }
        assert!(rig.command(Command::Enable).enabled);
    }
}

#[test]
fn a_fault_that_switches_off_ends_a_stop_and_leaves_the_first_fault() {
    let mut rig = moving(&StageSettings::simulated());
    rig.inputs.link_lost = true;
    assert!(rig.tick().enabled);
    follow(&mut rig);
    rig.inputs.switches = Switches::EMERGENCY_STOP;
    assert!(!rig.tick().enabled);
    let SafetyState::Faulted(fault) = rig.state.safety() else {
        panic!("{:?}", rig.state.safety());
    };
    assert_eq!(fault.code, FaultCode::LinkLost);
}

#[test]
fn disabling_ends_a_stop_and_keeps_its_fault() {
    let mut rig = moving(&StageSettings::simulated());
    rig.inputs.link_lost = true;
    rig.tick();
    follow(&mut rig);
    assert!(!rig.command(Command::Disable).enabled);
    assert!(
        matches!(rig.state.safety(), SafetyState::Faulted(fault) if fault.code == FaultCode::LinkLost)
    );
}

#[test]
fn a_lost_link_that_holds_can_be_followed_by_a_motion() {
    let mut settings = StageSettings::simulated();
    settings.streaming.link_lost = LossReaction::Hold;
    let mut rig = moving(&settings);
    for _ in 0..1000 {
        follow(&mut rig);
        // As long as it lasts.
        rig.inputs.link_lost = true;
        assert!(rig.tick().enabled);
    }
    assert!(!rig.state.is_running());
    assert_eq!(
        rig.state.held().expect("a fault is reported").code,
        FaultCode::LinkLost
    );
    rig.command(Command::Run);
    assert!(rig.state.is_running(), "{:?}", rig.state.safety());
    assert_eq!(rig.state.held(), None);
}

#[test]
fn a_lost_link_is_nothing_to_an_axis_that_stands() {
    let mut rig = homed(&StageSettings::simulated());
    rig.inputs.link_lost = true;
    assert!(rig.tick().enabled);
    assert_eq!(rig.state.safety(), SafetyState::Enabled);
}

/// A travel of +-10 mm for references of up to 100 mm/s that grow by up to 2000 mm/s^2, and the ramp of its stops.
fn ten_mm() -> (Travel, Ramp<f32>, Position) {
    let scale = StageSettings::simulated().motion_scale(0);
    let ramp = Ramp::new(4000.0, 1e6, scale);
    let mm = |value| Position::from_mm(value, scale.resolution_mm);
    let growth = mm(2000.0 * 1e-8);
    (
        Travel::new(mm(-10.0), mm(10.0), mm(100.0 * 1e-4), growth, &ramp),
        ramp,
        growth,
    )
}

#[test]
fn the_measured_position_counts_wherever_the_reference_is() {
    let (travel, ramp, _) = ten_mm();
    let mm = |value| Position::from_mm(value, 5e-4);
    for side in [1.0, -1.0] {
        let mut state = TravelState::default();
        let mut step =
            |measured| travel.step(&mut state, &ramp, Position::ZERO, Position::ZERO, measured);
        let end = mm(side * 10.0);
        assert_eq!(step(end), Ok(()));
        // The reference stands in the middle.
        let beyond = end + Position(side as i64);
        assert_eq!(step(beyond), Err(FaultCode::TravelExceeded));
    }
}

#[test]
fn the_stop_begins_at_the_speed_that_the_next_tick_may_have() {
    let (travel, ramp, growth) = ten_mm();
    let end = Position::from_mm(10.0, 5e-4);
    let speed = Position::from_mm(50.0 * 1e-4, 5e-4);
    let stop = |speed: Position| ramp.stopping_distance(Velocity::from_displacement(speed)) + speed;
    let (short, long) = (stop(speed), stop(speed + growth));
    assert!(long > short);
    for (distance, expected) in [
        (long, Ok(())),
        (long - Position(1), Err(FaultCode::PredictedSoftLimit)),
        (short, Err(FaultCode::PredictedSoftLimit)),
    ] {
        for side in [1, -1] {
            let (reference, moved) = (
                Position(side * (end - distance).0),
                Position(side * speed.0),
            );
            let found = travel.step(
                &mut TravelState::default(),
                &ramp,
                reference,
                moved,
                reference,
            );
            assert_eq!(found, expected, "{distance:?} {side}");
        }
    }
}

#[test]
fn an_axis_without_soft_limits_goes_either_way_once_it_is_homed() {
    for velocity_mm_s in [20.0, -20.0] {
        let settings = with_x(|x| x.limits.travel_mm = None);
        let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
        rig.tick();
        rig.state.set_homed(AxisName::X, true);
        rig.command(Command::Enable);
        let velocity = settings
            .jog_at(AxisName::X, velocity_mm_s)
            .expect("slow enough");
        rig.command(Command::Jog(AxisName::X, velocity));
        for _ in 0..5000 {
            let reference = rig.state.axes()[0].telemetry().reference;
            rig.inputs.set_counts([(reference.0 >> 16) as u32, 0, 0]);
            rig.tick();
        }
        let measured = rig.state.axes()[0].telemetry().measured.0;
        assert!(
            rig.state.safety().is_enabled(),
            "{velocity_mm_s}: {:?}",
            rig.state.safety()
        );
        assert!(measured.abs() > 5000, "{measured}");
    }
}

#[test]
fn an_axis_that_is_enabled_outside_its_travel_may_stand_there_though_it_was_inside_before() {
    let settings = travel(1.0);
    let mut rig = homed(&settings);
    rig.tick();
    rig.command(Command::Disable);
    for _ in 0..300 {
        rig.inputs.readings[0].count += 10;
        rig.tick();
    }
    rig.tick();
    for _ in 0..100 {
        rig.tick();
    }
    rig.command(Command::Enable);
    for _ in 0..100 {
        assert!(rig.tick().enabled, "{:?}", rig.state.safety());
    }
}
