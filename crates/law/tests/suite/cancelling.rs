//! Cancelling of a cut's vibration: it takes away what turns with the spindle, stays within its limit in every case, and does
//! nothing where it is left out.

use proptest::prelude::*;
use quadrant_law::axes::AxisName;
use quadrant_law::cancelling::{CancellingSettings, LEAST_MARGIN_DEG, SpindleSpeed};
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::scalar::{Fixed, Scalar};
use quadrant_law::units::DacCode;
use quadrant_settings::cancelling::NominalLoop;
use quadrant_settings::{AxisSettings, Reason, StageSettings};

use crate::learning::{Axis, fixed};
use quadrant_fault_bench::plant::PERIOD_S;
use quadrant_test_support::{Rig, repeatable};

/// Speed at which the teeth of a cutter of two pass at a frequency, rpm.
fn rpm(passing_hz: f64) -> f64 {
    passing_hz / 2.0 * 60.0
}

/// The x axis, cancelling.
fn cancelling(spindle_rpm: f64) -> StageSettings {
    let mut settings = fixed();
    settings.axes[0].feedforward.cancelling = Some(CancellingSettings {
        spindle_rpm,
        ..CancellingSettings::default()
    });
    settings
}

fn part(settings: &mut StageSettings) -> &mut CancellingSettings {
    let part = settings.axes[0].feedforward.cancelling.as_mut();
    part.expect("these settings have it")
}

/// The axis on its sine, shaken by a load of an amplitude, V, and a frequency, Hz.
fn shaken<S: Scalar>(settings: &StageSettings, load: (f64, f64)) -> Axis<S> {
    let mut axis = Axis::on_sine(settings, 1.0);
    axis.shaken = load;
    axis.command(Command::Run);
    axis
}

fn voltage<S: Scalar>(axis: &Axis<S>) -> f64 {
    f64::from(axis.rig.state.axes()[0].cancelling().voltage())
}

/// Largest voltage over a time, V.
fn largest<S: Scalar>(axis: &mut Axis<S>, seconds: f64) -> f64 {
    (0..(seconds / PERIOD_S) as usize).fold(0.0, |most: f64, _| {
        axis.tick();
        most.max(voltage(axis).abs())
    })
}

/// Share of the mean square of the error that cancelling leaves.
fn left<S: Scalar>(settings: &StageSettings, load: (f64, f64)) -> f64 {
    let [with, without] = [settings, &fixed()].map(|settings| {
        let mut axis = shaken::<S>(settings, load);
        axis.run(3.0);
        axis.run(2.0)
    });
    with / without
}

#[test]
fn what_turns_with_the_spindle_is_taken_away_in_every_number_type() {
    let settings = cancelling(rpm(100.0));
    let load = (0.1, 100.0);
    for left in [
        left::<f32>(&settings, load),
        left::<Fixed>(&settings, load),
        left::<f64>(&settings, load),
    ] {
        assert!(left < 0.1, "{left} of the mean square is left");
    }
}

#[test]
fn the_phase_of_the_loop_is_known_at_every_frequency() {
    for (hz, most) in [(20.0, 0.1), (45.0, 0.1), (170.0, 0.1), (333.0, 0.3)] {
        let left = left::<f32>(&cancelling(rpm(hz)), (0.15, hz));
        println!("{hz} Hz: {left}");
        assert!(left < most, "{left} of the mean square is left at {hz} Hz");
    }
}

#[test]
fn once_and_twice_the_teeth_and_the_spindle_itself_are_cancelled_as_far_as_is_asked() {
    // The tool turns at 60 Hz with two teeth.
    for (hz, harmonics) in [(120.0, 1), (60.0, 2), (240.0, 3)] {
        let mut settings = cancelling(rpm(120.0));
        let with = left::<f32>(&settings, (0.15, hz));
        part(&mut settings).harmonics = harmonics;
        let enough = left::<f32>(&settings, (0.15, hz));
        assert!(with < 0.2 && enough < 0.2, "{hz} Hz: {with}, {enough}");
        if harmonics > 1 {
            part(&mut settings).harmonics = harmonics - 1;
            let less = left::<f32>(&settings, (0.15, hz));
            assert!(less > 0.5, "{hz} Hz: {less}");
        }
    }
    // A single tooth: the spindle, and two and three times it.
    let mut single = cancelling(60.0 * 60.0);
    part(&mut single).teeth = 1;
    for hz in [60.0, 120.0, 180.0] {
        let left = left::<f32>(&single, (0.15, hz));
        assert!(left < 0.2, "{hz} Hz: {left}");
    }
}

#[test]
fn without_a_spindle_or_a_voltage_every_word_is_that_of_an_axis_without_cancelling() {
    fn words<S: Scalar>(settings: &StageSettings) -> Vec<DacCode> {
        let mut axis = shaken::<S>(settings, (0.1, 100.0));
        let ticks = (0..20_000).map(|_| {
            axis.tick();
            axis.rig.state.axes()[0].telemetry().code
        });
        ticks.collect()
    }
    let mut without_voltage = cancelling(rpm(100.0));
    part(&mut without_voltage).limit_v = 0.0;
    let still = cancelling(0.0);
    for settings in [&still, &without_voltage] {
        assert!(words::<f32>(settings) == words::<f32>(&fixed()));
        assert!(words::<Fixed>(settings) == words::<Fixed>(&fixed()));
    }
    assert!(words::<f32>(&cancelling(rpm(100.0))) != words::<f32>(&fixed()));
}

#[test]
fn the_speed_that_is_set_counts_until_the_next_and_survives_disabling_and_an_exchange() {
    let set_speed = |axis: &mut Axis<f32>, rpm| {
        let speed = SpindleSpeed::from_rpm(rpm, PERIOD_S);
        axis.rig.state.set_spindle_speed(speed);
    };
    let mut axis = shaken::<f32>(&cancelling(0.0), (0.1, 100.0));
    assert_eq!(largest(&mut axis, 1.0), 0.0);
    set_speed(&mut axis, rpm(100.0));
    axis.run(3.0);
    assert!(largest(&mut axis, 0.5) > 0.05);
    // The output begins again, and the speed is still known.
    axis.rig.inputs.settings_changed[AxisName::X] = true;
    axis.tick();
    assert!(largest(&mut axis, 0.001).abs() < 1e-3);
    axis.run(2.0);
    assert!(largest(&mut axis, 0.5) > 0.05);
    axis.command(Command::Disable);
    axis.run(0.1);
    axis.command(Command::Enable);
    axis.tick();
    assert_eq!(voltage(&axis), 0.0);
    axis.command(Command::Run);
    axis.run(3.0);
    assert!(largest(&mut axis, 0.5) > 0.05);
    set_speed(&mut axis, 0.0);
    axis.run(1.5);
    assert!(largest(&mut axis, 0.5) < 1e-4);
}

#[test]
fn a_ramp_of_the_speed_under_a_cut_harms_little_and_ends_in_cancelling() {
    let load = (0.1, 100.0);
    let mut off = shaken::<f32>(&fixed(), load);
    let largest_window = |axis: &mut Axis<f32>, seconds: f64| {
        (0..(seconds / 0.2) as usize).fold(0.0, |most: f64, _| most.max(axis.run(0.2)))
    };
    let without = largest_window(&mut off, 8.0);
    let mut settings = cancelling(600.0);
    part(&mut settings).ramp_rpm_s = 1000.0;
    let mut axis = shaken::<f32>(&settings, load);
    axis.run(1.0);
    // From 20 to 200 Hz through that of the cut, and back to it.
    for (to_hz, seconds) in [(200.0, 5.4), (20.0, 5.4), (100.0, 2.4)] {
        let speed = SpindleSpeed::from_rpm(rpm(to_hz), PERIOD_S);
        axis.rig.state.set_spindle_speed(speed);
        let most = largest_window(&mut axis, seconds);
        println!("to {to_hz} Hz: {most}, without {without}");
        assert!(most < 2.0 * without);
    }
    axis.run(2.0);
    let at_last = largest_window(&mut axis, 5.0);
    assert!(at_last < 0.1 * without, "{at_last} of {without}");
}

/// Amplitude of the voltage as it is now, V: a turn of the spindle at 20 Hz and more.
fn amplitude<S: Scalar>(axis: &mut Axis<S>) -> f64 {
    largest(axis, 0.05)
}

#[test]
fn what_cancelled_a_cut_is_unlearnt_as_soon_as_it_ends() {
    fn left_after<S: Scalar>(hz: f64) -> f64 {
        let mut axis = shaken::<S>(&cancelling(rpm(hz)), (0.2, hz));
        axis.run(2.0);
        let before = amplitude(&mut axis);
        assert!(before > 0.1, "{before} V at {hz} Hz");
        axis.shaken = (0.0, hz);
        // At the rate of learning more than half of it would be left.
        axis.run(0.1);
        amplitude(&mut axis) / before
    }
    for hz in [20.0, 30.0, 60.0, 100.0] {
        let left = [left_after::<f32>(hz), left_after::<Fixed>(hz)];
        println!("{hz} Hz: {left:?}");
        assert!(
            left.into_iter().all(|left| left < 0.3),
            "{left:?} at {hz} Hz"
        );
    }
}

/// Runs the axis on an encoder that shows the reference, a vibration, mm, and an answer to the voltage at 200 Hz, mm/V, a number of ticks late:
/// the model expects 0.05 mm/V and 25 ticks. Returns the largest deviation of the last 50 ms, mm.
fn answered<S: Scalar>(
    axis: &mut Axis<S>,
    seconds: f64,
    shaken_mm: f64,
    (late, mm_per_v): (usize, f64),
) -> f64 {
    const TURN: usize = 50;
    let resolution_mm = fixed().axes[0].encoder.resolution_mm;
    let ticks = (seconds / PERIOD_S) as usize;
    let mut voltages = [0.0; TURN];
    let mut largest_mm: f64 = 0.0;
    for tick in 0..ticks {
        voltages[tick % TURN] = voltage(axis);
        let turns = tick as f64 / TURN as f64;
        let deviation_mm = mm_per_v * voltages[(tick + TURN - late) % TURN]
            + shaken_mm * (std::f64::consts::TAU * turns).sin();
        let position_mm = axis.seen().reference.to_mm(resolution_mm) + deviation_mm;
        axis.rig.inputs.readings[0].count = (position_mm / resolution_mm).round() as i32 as u32;
        axis.rig.tick();
        if tick + 500 >= ticks {
            largest_mm = largest_mm.max(deviation_mm.abs());
        }
    }
    assert!(axis.rig.state.is_running());
    largest_mm
}

#[test]
fn a_voltage_in_quadrature_to_the_model_is_unlearnt() {
    fn left_after_a_second<S: Scalar>() -> f64 {
        let (late, mm_per_v) = (20, 0.2);
        let mut axis = shaken::<S>(&cancelling(rpm(200.0)), (0.2, 200.0));
        axis.run(2.0);
        let before = amplitude(&mut axis);
        assert!(before > 0.1, "{before} V");
        answered(&mut axis, 1.0, 0.0, (late, mm_per_v)) / mm_per_v / before
    }
    // At the rate of learning, which turns the vector instead, a tenth and more would be left.
    for left in [left_after_a_second::<f32>(), left_after_a_second::<Fixed>()] {
        assert!(left < 0.03, "{left} of the voltage is left");
    }
}

#[test]
fn an_axis_that_responded_in_quadrature_for_long_cancels_again_in_two_seconds() {
    let mut axis = shaken::<f32>(&cancelling(rpm(200.0)), (0.0, 200.0));
    axis.run(0.5);
    let quadrature_mm = answered(&mut axis, 40.0, 0.004, (36, 0.2));
    assert!(quadrature_mm > 0.004, "{quadrature_mm} mm");
    let well_mm = answered(&mut axis, 2.0, 0.004, (25, 0.05));
    assert!(well_mm < 0.002, "{well_mm} mm of 0.004 mm are left");
}

#[test]
fn a_reversal_that_errs_unlearns_little() {
    for hz in [30.0, 60.0, 100.0] {
        let mut axis = Axis::<f32>::on_sine(&cancelling(rpm(hz)), 1.5);
        axis.shaken = (0.15, hz);
        axis.command(Command::Run);
        axis.run(2.0);
        // A reversal every 1.26 s.
        let amplitudes: Vec<f64> = (0..60).map(|_| amplitude(&mut axis)).collect();
        let most = amplitudes.iter().copied().fold(0.0, f64::max);
        let least = amplitudes.iter().copied().fold(most, f64::min);
        println!("{hz} Hz: {least} to {most} V");
        assert!(least > 0.5 * most, "{hz} Hz: {least} to {most} V");
    }
}

#[test]
fn a_speed_that_is_set_wrong_by_a_percent_is_followed_and_not_by_more() {
    fn followed<S: Scalar>(hz: f64, set: f64) -> f64 {
        let [with, without] = [cancelling(set * rpm(hz)), fixed()].map(|settings| {
            let mut axis = shaken::<S>(&settings, (0.1, hz));
            axis.run(5.0);
            axis.run(2.0)
        });
        with / without
    }
    for (hz, set) in [
        (100.0, 1.003),
        (100.0, 1.01),
        (100.0, 0.99),
        (40.0, 1.01),
        (150.0, 0.995),
    ] {
        let left = [followed::<f32>(hz, set), followed::<Fixed>(hz, set)];
        println!("{hz} Hz x {set}: {left:?}");
        assert!(
            left.into_iter().all(|left| left < 0.1),
            "{left:?}, {hz} Hz x {set}"
        );
    }
    let beyond = followed::<f32>(100.0, 1.05);
    assert!(beyond > 0.5, "{beyond}");
}

#[test]
fn a_vector_that_learns_slowly_keeps_to_the_speed_that_is_set() {
    // A sixth of the rate: what it shows while it learns is no rotation.
    let load = (0.3, 500.0);
    let [with, without] = [cancelling(rpm(500.0)), fixed()].map(|settings| {
        let mut axis = shaken::<f32>(&settings, load);
        axis.run(8.0);
        axis.run(2.0)
    });
    assert!(with < 0.02 * without, "{with} of {without}");
}

#[test]
fn what_was_followed_ends_with_the_next_speed_that_is_set() {
    let load = (0.1, 100.0);
    let without = shaken::<f32>(&fixed(), load).run(3.0);
    let mut axis = shaken::<f32>(&cancelling(1.01 * rpm(100.0)), load);
    axis.run(4.0);
    let followed = axis.run(1.0);
    assert!(followed < 0.1 * without, "{followed} of {without}");
    let speed = SpindleSpeed::from_rpm(rpm(100.0), PERIOD_S);
    axis.rig.state.set_spindle_speed(speed);
    let restarted = axis.run(0.5);
    assert!(restarted < 0.1 * without, "{restarted} of {without}");
}

#[test]
fn the_speed_changes_no_faster_than_the_settings_say() {
    let time_to_100_hz = |ramp_rpm_s: f64| {
        let mut settings = cancelling(rpm(20.0));
        part(&mut settings).ramp_rpm_s = ramp_rpm_s;
        part(&mut settings).harmonics = 1;
        let mut axis = shaken::<f32>(&settings, (0.1, 100.0));
        axis.rig
            .state
            .set_spindle_speed(SpindleSpeed::from_rpm(rpm(100.0), PERIOD_S));
        (0..200).find(|_| largest(&mut axis, 0.05) > 0.04)
    };
    let (slow, quick) = (time_to_100_hz(480.0), time_to_100_hz(1e5));
    // 2400 rpm take 5 s.
    assert!(quick.is_some_and(|steps| steps < 12), "{quick:?}");
    assert!(
        slow.is_some_and(|steps| (80..120).contains(&steps)),
        "{slow:?}"
    );
}

#[test]
fn a_jog_and_standstill_fade_it_out() {
    let mut axis = shaken::<f32>(&cancelling(rpm(100.0)), (0.1, 100.0));
    axis.run(2.0);
    assert!(largest(&mut axis, 0.1) > 0.05);
    axis.command(Command::Stop);
    axis.run(1.5);
    assert!(largest(&mut axis, 0.2) < 1e-3);
    let jog = fixed().jog_at(AxisName::X, 5.0).expect("slow enough");
    axis.command(Command::Jog(AxisName::X, jog));
    assert!(largest(&mut axis, 1.0) < 1e-3);
}

#[test]
fn nothing_grows_while_the_output_is_at_its_limit() {
    let mut settings = cancelling(rpm(100.0));
    settings.axes[0].amplifier.output_limit_v = 0.02;
    settings.axes[0].feedback.integral_limit_v = 0.02;
    settings.axes[0].feedback.sliding_mode = None;
    settings.axes[0].limits.following_error_mm = 20.0;
    settings.axes[0].limits.following_error_max_mm = 20.0;
    let mut axis = shaken::<f32>(&settings, (0.3, 100.0));
    // After 0.15 s the encoder shows what the output cannot have caused.
    let most = largest(&mut axis, 0.12);
    assert!(
        axis.rig.state.safety().drives(),
        "{:?}",
        axis.rig.state.safety()
    );
    // The output leaves its limit for some ticks at each change of its sign.
    let free = largest(
        &mut shaken::<f32>(&cancelling(rpm(100.0)), (0.3, 100.0)),
        0.12,
    );
    assert!(most < 0.25 * free, "{most} V, {free} V away from the limit");
}

/// The x axis' loop with another dead time.
fn margin_deg(delay_s: f64, largest_gain: f64, hz: f64) -> f64 {
    let x = &fixed().axes[0];
    let mut plant = x.plant.expect("by default");
    plant.delay_s = delay_s;
    let of = NominalLoop {
        plant: &plant,
        pid: &x.feedback.pid,
        friction: &x.friction.gms,
        breakaway_v: x.friction.mean_breakaway_v(),
        filters: &[],
        largest_gain,
    };
    of.margin_deg(hz, PERIOD_S)
}

#[test]
fn the_margin_falls_with_dead_time_and_with_the_laws_largest_gain() {
    assert!(margin_deg(1.2e-3, 1.0, 100.0) > 60.0);
    // A tenth of the dead time is a right angle.
    assert!(margin_deg(2.5e-3, 1.0, 1000.0) < 5.0);
    assert!(margin_deg(1.2e-3, 1.7, 120.0) < margin_deg(1.2e-3, 1.0, 120.0) - 10.0);
}

#[test]
fn a_frequency_without_margin_or_beyond_the_steps_is_left_alone() {
    let mut settings = cancelling(rpm(900.0));
    part(&mut settings).harmonics = 1;
    let grows = |settings: &StageSettings| largest(&mut shaken::<f32>(settings, (0.3, 900.0)), 1.0);
    assert!(grows(&settings) > 1e-3);
    let x = &mut settings.axes[0];
    x.feedback.pid.kp_v_per_mm *= 0.2;
    x.feedback.pid.kd_v_s_per_mm *= 0.2;
    x.feedback.pid.ki_v_per_mm_s *= 0.02;
    x.plant.as_mut().expect("by default").delay_s = 2.5e-3;
    assert!(margin_deg(2.5e-3, 1.0, 900.0) < LEAST_MARGIN_DEG);
    assert_eq!(grows(&settings), 0.0);
    // Above 1094 Hz at 10 kHz, and below 4.9 Hz.
    for hz in [1100.0, 2500.0, 1e4, 4.8] {
        let mut settings = cancelling(rpm(hz));
        part(&mut settings).harmonics = 1;
        assert_eq!(grows(&settings), 0.0, "{hz} Hz");
    }
}

#[test]
fn every_parameter_changes_the_output() {
    let words = |change: fn(&mut CancellingSettings)| {
        let mut settings = cancelling(rpm(100.0));
        change(part(&mut settings));
        settings.validate(FIRMWARE_ELEMENTS).expect("valid");
        let mut axis = shaken::<f32>(&settings, (0.2, 100.0));
        axis.run(0.5);
        axis.rig
            .state
            .set_spindle_speed(SpindleSpeed::from_rpm(rpm(90.0), PERIOD_S));
        axis.run(0.5);
        axis.rig.state.axes()[0].telemetry().code_sum
    };
    let usual = words(|_| ());
    let changes: [fn(&mut CancellingSettings); 6] = [
        |part| part.spindle_rpm *= 0.97,
        |part| part.ramp_rpm_s = 500.0,
        |part| part.teeth = 3,
        |part| part.harmonics = 2,
        |part| part.rate_per_s *= 0.97,
        |part| part.limit_v = 0.01,
    ];
    for (number, change) in changes.into_iter().enumerate() {
        assert_ne!(words(change), usual, "parameter {number}");
    }
}

#[test]
fn it_needs_a_plant_and_a_pid() {
    let refusal = |change: fn(&mut AxisSettings)| {
        let mut settings = cancelling(0.0);
        change(&mut settings.axes[0]);
        let error = settings.validate(FIRMWARE_ELEMENTS).expect_err("refused");
        (error.field, error.reason)
    };
    assert_eq!(refusal(|x| x.plant = None), ("plant", Reason::Missing));
    assert_eq!(
        refusal(|x| x.feedback.law = LawKind::Cascade),
        ("feedforward.cancelling", Reason::NeedsPid)
    );
}

/// Cancelling on an encoder that shows anything, with a spindle of any speed.
fn hostile<S: Scalar>(steps: &[(i32, u16, u32)]) -> Result<(), TestCaseError> {
    let mut settings = cancelling(rpm(100.0));
    part(&mut settings).rate_per_s = 20.0;
    part(&mut settings).limit_v = 0.02;
    let mut rig = Rig::<S>::that_allows_any_error(settings);
    for &(step, ticks, rpm) in steps {
        let speed = SpindleSpeed::from_rpm(f64::from(rpm), PERIOD_S);
        rig.state.set_spindle_speed(speed);
        rig.show_counts(step, ticks, |axis| {
            let added = axis.cancelling().voltage();
            prop_assert!(added.abs() <= 0.02001, "{added} V");
            prop_assert!(axis.telemetry().output_v().abs() <= 10.001);
            Ok(())
        })?;
    }
    Ok(())
}

proptest! {
    #![proptest_config(repeatable(64))]

    #[test]
    fn the_voltage_stays_within_its_limit_whatever_the_encoder_shows_and_the_spindle_does(
        steps in prop::collection::vec((-60i32..60, 1u16..3000, 0u32..200_000), 1..12)
    ) {
        hostile::<f32>(&steps)?;
        hostile::<Fixed>(&steps)?;
    }
}
