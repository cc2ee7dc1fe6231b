//! Learning of the friction feedforward's scale: it finds what the axis has, does no harm, and is still where nothing is
//! to be learnt.

use proptest::prelude::*;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::injection::InjectedValue;
use quadrant_law::learning::{LearningSettings, LearningStatus, MAX_DELAY_TICKS};
use quadrant_law::motion::MotionMode;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_settings::{InjectionSettings, PlanSettings, Reason, StageSettings};

use quadrant_fault_bench::plant::{Death, Encoder, MODEL, PERIOD_S, Plant, Truth};
use quadrant_test_support::{Rig, repeatable, sine_on_x, x_alone};

/// The x axis alone, with a PID that integrates as a commissioned one does.
pub(crate) fn fixed() -> StageSettings {
    x_alone(|x| {
        x.feedback.law = LawKind::Pid;
        x.feedback.pid.ki_v_per_mm_s = 7.9;
        // As the plant has it: no Stribeck effect.
        for model in [
            &mut x.friction.sliding.positive,
            &mut x.friction.sliding.negative,
        ] {
            model.curve.coulomb_v = model.curve.breakaway_v;
        }
    })
}

/// The same, learning.
fn learning() -> StageSettings {
    let mut settings = fixed();
    settings.axes[0].feedforward.learning = Some(LearningSettings::default());
    settings
}

/// A stage whose x axis moves as its output makes it.
pub(crate) struct Axis<S: Scalar> {
    pub(crate) rig: Rig<S>,
    plant: Plant,
    encoder: Encoder,
    /// Force that pushes the axis, V.
    pub(crate) pushed_v: f64,
    /// Amplitude, V, and frequency, Hz, of a load that shakes the axis.
    pub(crate) shaken: (f64, f64),
    ticks: u32,
}

impl<S: Scalar> Axis<S> {
    /// On a slow sine, with so many times the friction that the settings know: the damping of its mass stays.
    pub(crate) fn on_sine(settings: &StageSettings, friction: f64) -> Self {
        Self::on(settings, friction, &sine_on_x(2.0, 5.0))
    }

    fn on(settings: &StageSettings, friction: f64, plan: &PlanSettings) -> Self {
        Self::on_plant(settings, &Truth { friction, ..MODEL }, plan)
    }

    fn on_plant(settings: &StageSettings, truth: &Truth, plan: &PlanSettings) -> Self {
        let mut axis = Self {
            rig: Rig::with_plant(settings, plan),
            plant: Plant::new(truth),
            encoder: Encoder::new(Death::Healthy, 7),
            pushed_v: 0.0,
            shaken: (0.0, 0.0),
            ticks: 0,
        };
        axis.tick();
        axis.rig.inputs.command = Some(Command::Enable);
        axis.tick();
        axis
    }

    pub(crate) fn command(&mut self, command: Command) {
        self.rig.inputs.command = Some(command);
        self.tick();
    }

    pub(crate) fn tick(&mut self) {
        let count = self.encoder.read(self.plant.position_mm, None);
        self.rig.inputs.readings[0].count = count as u32;
        let outputs = self.rig.tick();
        let [x, ..] = *outputs.codes;
        let (amplitude_v, hz) = self.shaken;
        let phase = std::f64::consts::TAU * hz * f64::from(self.ticks) * PERIOD_S;
        self.ticks += 1;
        let load_v = self.pushed_v + amplitude_v * phase.sin();
        self.plant.step(x.to_volts(10.0) + load_v);
    }

    /// Runs for a time; returns the mean square of the error, mm^2.
    pub(crate) fn run(&mut self, seconds: f64) -> f64 {
        let ticks = (seconds / PERIOD_S) as usize;
        let mut sum = 0.0;
        for _ in 0..ticks {
            self.tick();
            let error = self.seen().error.to_f64(Quantity::Length);
            sum += error * error;
        }
        sum / ticks as f64
    }

    pub(crate) fn seen(&self) -> quadrant_law::axis::telemetry::AxisTelemetry<S> {
        *self.rig.state.axes()[0].telemetry()
    }

    fn scale(&self) -> f32 {
        self.rig.state.axes()[0].learning().scale()
    }

    fn status(&self) -> LearningStatus {
        self.rig.state.axes()[0].learning().status()
    }
}

fn learnt<S: Scalar>(friction: f64) -> f32 {
    let mut axis = Axis::<S>::on_sine(&learning(), friction);
    axis.command(Command::Run);
    axis.run(10.0);
    axis.scale()
}

#[test]
fn the_friction_that_the_axis_has_is_learnt_in_every_number_type() {
    for (friction, scale) in [
        (0.5, learnt::<f32>(0.5)),
        (1.0, learnt::<f32>(1.0)),
        (1.5, learnt::<f32>(1.5)),
        (1.5, learnt::<Fixed>(1.5)),
        (1.5, learnt::<f64>(1.5)),
        (2.0, learnt::<f32>(2.0)),
    ] {
        // The drag of its mass, a tenth of what is scaled, does not change.
        let error = f64::from(scale) - friction;
        assert!(error.abs() < 0.1, "{scale} for friction x {friction}");
    }
}

#[test]
fn a_friction_beyond_the_largest_scale_is_met_with_that() {
    let mut settings = learning();
    let gains = &mut settings.axes[0].feedforward.gains;
    (gains.presliding, gains.level, gains.viscous) = (0.2, 0.2, 0.2);
    let mut axis = Axis::<f32>::on_sine(&settings, 1.0);
    axis.command(Command::Run);
    axis.run(20.0);
    assert_eq!(axis.scale(), 2.5);
}

#[test]
fn what_was_learnt_takes_the_error_away() {
    let error = |settings: &StageSettings| {
        let mut axis = Axis::<f32>::on_sine(settings, 1.5);
        axis.command(Command::Run);
        axis.run(5.0);
        axis.run(3.0)
    };
    let (with, without) = (error(&learning()), error(&fixed()));
    assert!(with < 0.05 * without, "{with} mm^2 of {without} mm^2");
}

#[test]
fn the_error_without_feedforward_is_known_with_it() {
    let mut axis = Axis::<f32>::on_sine(&learning(), 1.2);
    axis.command(Command::Run);
    axis.run(5.0);
    let with = axis.run(8.0);
    let learning = axis.rig.state.axes()[0].learning();
    let said = f64::from(learning.error_squares() / learning.error_squares_off()).sqrt();
    let mut off = fixed();
    off.axes[0].feedforward.kind = FeedforwardKind::None;
    let mut axis = Axis::<f32>::on_sine(&off, 1.2);
    axis.command(Command::Run);
    axis.run(5.0);
    let measured = (with / axis.run(8.0)).sqrt();
    assert!(
        (said / measured - 1.0).abs() < 0.25,
        "{said} is said, {measured} measured"
    );
}

#[test]
fn the_error_without_feedforward_is_known_of_a_loop_that_answers_quickly() {
    let quick = |mut settings: StageSettings| {
        let [x, ..] = &mut settings.axes;
        x.plant.as_mut().expect("by default").delay_s *= 0.2;
        x.feedback.pid.kd_v_s_per_mm *= 8.0;
        x.feedback.pid.kp_v_per_mm *= 40.0;
        x.feedback.pid.ki_v_per_mm_s *= 200.0;
        settings
    };
    let truth = Truth {
        delay: 0.2,
        friction: 1.5,
        ..MODEL
    };
    let run = |settings: StageSettings| {
        let mut axis = Axis::<f32>::on_plant(&settings, &truth, &sine_on_x(2.0, 5.0));
        axis.command(Command::Run);
        axis.run(5.0);
        let square = axis.run(8.0);
        let learning = axis.rig.state.axes()[0].learning();
        (
            square,
            learning.error_squares() / learning.error_squares_off(),
        )
    };
    let (with, said) = run(quick(learning()));
    let mut off = quick(fixed());
    off.axes[0].feedforward.kind = FeedforwardKind::None;
    let (without, _) = run(off);
    let (said, measured) = (f64::from(said).sqrt(), (with / without).sqrt());
    println!("{said} is said, {measured} measured");
    assert!((said / measured - 1.0).abs() < 0.25);
}

#[test]
fn the_error_without_feedforward_is_known_while_a_gate_opens_and_closes() {
    // Square of the error as learning forgets it, by a time constant of 2 s, and learning's own of the error and that without.
    let squares = |settings: &StageSettings| {
        let mut axis = Axis::<f32>::on(settings, 1.0, &sine_on_x(20.0, 5.0));
        axis.command(Command::Run);
        let mut sum = 0.0;
        // The gate opens and closes while the axis slides: the first reversal is after six seconds.
        for part in 0..24 {
            axis.shaken = (if part % 2 == 1 { 0.2 } else { 0.0 }, 350.0);
            sum = (-0.25f64 / 2.0).exp() * sum + axis.run(0.25);
        }
        let learning = axis.rig.state.axes()[0].learning();
        (sum, learning.error_squares(), learning.error_squares_off())
    };
    let mut off = fixed();
    off.axes[0].feedforward.kind = FeedforwardKind::None;
    let (without, ..) = squares(&off);
    let (with, said_with, said_without) = squares(&learning());
    let (said, measured) = (f64::from(said_without / said_with), without / with);
    println!("without over with: {said} is said, {measured} measured");
    assert!((said / measured - 1.0).abs() < 0.2);
}

#[test]
fn an_integral_that_is_still_on_its_way_is_not_taken_for_friction() {
    // An integral as slow as the time between reversals, and a force that it has to take up first.
    let pushed = |settings: &StageSettings| {
        let mut settings = settings.clone();
        settings.axes[0].feedback.pid.ki_v_per_mm_s = 0.7;
        let mut axis = Axis::<f32>::on(&settings, 1.0, &sine_on_x(5.0, 10.0));
        axis.pushed_v = 0.03;
        axis.command(Command::Run);
        let mut most: f32 = 0.0;
        let mut squares = 0.0;
        for _ in 0..100 {
            squares += axis.run(0.1);
            most = most.max((axis.scale() - 1.0).abs());
        }
        (squares, most)
    };
    let (fixed, _) = pushed(&fixed());
    let (learning, off_by) = pushed(&learning());
    println!("{fixed} with a fixed scale, {learning} mm^2 learning; off by {off_by}");
    assert!(off_by < 0.2, "the scale was off by {off_by}");
    assert!(
        learning < 1.3 * fixed,
        "{learning} mm^2, {fixed} mm^2 fixed"
    );
}

#[test]
fn the_error_without_feedforward_is_that_of_the_loop_as_stiff_as_the_nonlinear_gain_makes_it() {
    let mut axis = Axis::<f32>::on_sine(&learning(), 3.0);
    let mut stiffer = learning();
    stiffer.axes[0].feedback.law = LawKind::NPid;
    let mut other = Rig::<f32>::with_plant(&stiffer, &sine_on_x(2.0, 5.0));
    for tick in 0..30_000 {
        let command = match tick {
            1 => Some(Command::Enable),
            2 => Some(Command::Run),
            _ => None,
        };
        // What the axis does under the PID is shown to both laws.
        other.inputs.readings = axis.rig.inputs.readings;
        other.inputs.command = command;
        other.tick();
        axis.rig.inputs.command = command;
        axis.tick();
    }
    let off = |rig: &Rig<f32>| rig.state.axes()[0].learning().error_squares_off();
    let (pid, npid) = (off(&axis.rig), off(&other));
    assert!(pid > 0.0 && npid > 0.0);
    assert!(npid < 0.95 * pid, "{npid} mm^2 of {pid} mm^2");
}

#[test]
fn settings_that_do_not_learn_forget_what_was_learnt() {
    let mut axis = Axis::<f32>::on_sine(&learning(), 1.5);
    axis.command(Command::Run);
    axis.run(5.0);
    assert_ne!(axis.scale(), 1.0);
    axis.rig.exchange(&fixed());
    axis.run(0.1);
    assert_eq!(axis.scale(), 1.0);
}

#[test]
fn a_feedforward_that_harms_is_faded_out_and_it_is_said() {
    let mut axis = Axis::<f32>::on_sine(&learning(), 0.05);
    axis.command(Command::Run);
    let mut fading = false;
    for _ in 0..30_000 {
        axis.tick();
        fading |= axis.status() == LearningStatus::Fading;
    }
    assert!(fading);
    assert!(axis.scale() < 0.15, "{}", axis.scale());
}

#[test]
fn what_a_cut_raises_ends_with_it() {
    for shaken in [(0.11, 300.0), (0.2, 350.0)] {
        let mut axis = Axis::<f32>::on_sine(&learning(), 1.0);
        axis.shaken = shaken;
        axis.command(Command::Run);
        let mut gate = 0.0;
        for _ in 0..80_000 {
            axis.tick();
            gate += f64::from(axis.rig.state.axes()[0].learning().gate()) / 8e4;
        }
        let raised = axis.scale();
        axis.shaken = (0.0, 0.0);
        axis.run(0.5);
        let left = axis.scale();
        println!("{shaken:?}: gate {gate}, scale {raised}, then {left}");
        assert!((0.1..0.8).contains(&gate) && raised > 1.1);
        assert!(left < 1.1);
    }
}

#[test]
fn what_was_learnt_before_a_cut_is_right_after_it() {
    let mut axis = Axis::<f32>::on_sine(&learning(), 0.7);
    axis.command(Command::Run);
    axis.run(12.0);
    let before = axis.scale();
    axis.shaken = (0.2, 350.0);
    axis.run(8.0);
    axis.shaken = (0.0, 0.0);
    axis.run(0.5);
    let after = axis.scale();
    assert!((before - after).abs() < 0.03, "{before}, then {after}");
}

#[test]
fn a_scale_that_is_right_stands_still() {
    let mut axis = Axis::<f32>::on_sine(&learning(), 1.3);
    axis.command(Command::Run);
    axis.run(20.0);
    let (mut least, mut most) = (f32::INFINITY, 0.0_f32);
    for _ in 0..2000 {
        axis.run(0.001);
        least = least.min(axis.scale());
        most = most.max(axis.scale());
    }
    assert!(most - least < 2e-3, "{least} to {most}");
}

#[test]
fn nothing_is_learnt_at_rest_or_from_a_jog() {
    let mut axis = Axis::<f32>::on_sine(&learning(), 1.5);
    axis.run(1.0);
    assert_eq!(axis.status(), LearningStatus::AtRest);
    let jog = learning().jog_at(AxisName::X, 5.0).expect("slow enough");
    axis.command(Command::Jog(AxisName::X, jog));
    axis.run(1.0);
    assert_eq!(axis.status(), LearningStatus::OtherMotion);
    assert_eq!(axis.scale(), 1.0);
}

#[test]
fn nothing_is_learnt_while_the_output_is_at_its_limit_and_just_after() {
    let mut settings = learning();
    settings.axes[0].amplifier.output_limit_v = 2.5;
    let mut axis = Axis::<f32>::on(&settings, 1.0, &sine_on_x(5.0, 20.0));
    axis.command(Command::Run);
    axis.run(0.1);
    let mut seen = [false; 2];
    for tick in 0..9_000 {
        if tick == 50 {
            // The encoder shows 50 um too much for a tick: the derivative goes to the limit.
            let count = &mut axis.rig.inputs.readings[0].count;
            *count = count.wrapping_add(100);
            axis.rig.tick();
        }
        axis.tick();
        seen[0] |= axis.status() == LearningStatus::Saturated;
        seen[1] |= axis.status() == LearningStatus::Settling;
        if seen[0] {
            assert_ne!(axis.status(), LearningStatus::Learning);
        }
    }
    assert_eq!(seen, [true; 2], "{:?}", axis.rig.state.safety());
    assert!((axis.scale() - 1.0).abs() < 0.05, "{}", axis.scale());
}

#[test]
fn what_was_learnt_outlives_disabling_and_ends_with_other_settings() {
    let mut axis = Axis::<f32>::on_sine(&learning(), 1.5);
    axis.command(Command::Run);
    axis.run(5.0);
    let before = axis.scale();
    assert!(before > 1.4, "{before}");
    axis.command(Command::Disable);
    axis.run(0.5);
    axis.command(Command::Enable);
    axis.run(0.5);
    assert_eq!(axis.scale(), before);
    // In motion, and with the outputs off.
    axis.rig.inputs.settings_changed[AxisName::X] = true;
    axis.tick();
    axis.run(PERIOD_S * 8.0);
    assert_eq!(axis.scale(), 1.0);
    axis.command(Command::Run);
    axis.run(5.0);
    assert!(axis.scale() > 1.4);
    axis.command(Command::Disable);
    axis.rig.inputs.settings_changed[AxisName::X] = true;
    axis.tick();
    assert_eq!(axis.scale(), 1.0);
}

/// An axis that has learnt and rests, its loop opened with no voltage.
fn opened() -> Axis<f32> {
    let mut axis = Axis::<f32>::on_sine(&learning(), 1.5);
    axis.command(Command::Run);
    axis.run(5.0);
    assert!(axis.scale() > 1.4, "{}", axis.scale());
    axis.command(Command::Stop);
    axis.run(0.5);
    let request = InjectionSettings {
        axis: AxisName::X,
        open_loop: true,
        with_plan: false,
        limit_v: 1.0,
        travel_mm: 10.0,
        max_velocity_mm_s: 50.0,
    };
    let (injection, _) = learning().injection(&request).expect("within");
    axis.rig.state.prepare_injection(injection);
    axis.rig.state.push_injection(InjectedValue {
        word: 0,
        last: false,
    });
    axis.command(Command::StartInjection);
    hold_open(&mut axis, 20, false);
    assert_eq!(axis.rig.state.axes()[0].mode(), MotionMode::OpenLoop);
    axis
}

/// Ticks of the open loop; `last`: it ends with them.
fn hold_open(axis: &mut Axis<f32>, ticks: u32, last: bool) {
    for tick in 1..=ticks {
        if axis.rig.state.wants_voltage() {
            axis.rig.state.push_injection(InjectedValue {
                word: 0,
                last: last && tick == ticks,
            });
        }
        axis.tick();
    }
}

#[test]
fn other_settings_in_an_open_loop_begin_learning_anew() {
    let mut axis = opened();
    axis.rig.inputs.settings_changed[AxisName::X] = true;
    hold_open(&mut axis, 1, false);
    assert_eq!(axis.scale(), 1.0);
}

#[test]
fn learning_goes_on_after_an_open_loop_as_after_enabling() {
    let mut axis = opened();
    let before = axis.scale();
    hold_open(&mut axis, 1, true);
    axis.tick();
    axis.tick();
    assert_ne!(axis.rig.state.axes()[0].mode(), MotionMode::OpenLoop);
    // What was learnt stays; the noise that closed the gate is of before.
    assert_eq!(axis.scale(), before);
    assert_eq!(axis.rig.state.axes()[0].learning().gate(), 1.0);
}

#[test]
fn without_an_integral_nothing_is_taken_from_it() {
    let mut settings = learning();
    settings.axes[0].feedback.pid.ki_v_per_mm_s = 0.0;
    let mut axis = Axis::<f32>::on_sine(&settings, 1.5);
    axis.command(Command::Run);
    axis.run(5.0);
    assert!((axis.scale() - 1.0).abs() > 0.1, "{}", axis.scale());
    assert_eq!(axis.seen().feedback.integral, 0.0);
}

#[test]
fn learning_needs_a_plant_with_a_dead_time_that_it_holds_and_a_pid() {
    let refusal = |change: fn(&mut quadrant_settings::AxisSettings)| {
        let mut settings = learning();
        change(&mut settings.axes[0]);
        let error = settings.validate(FIRMWARE_ELEMENTS).expect_err("refused");
        (error.field, error.reason)
    };
    assert_eq!(refusal(|x| x.plant = None), ("plant", Reason::Missing));
    let (field, reason) = refusal(|x| {
        x.feedback.pid.kp_v_per_mm *= 0.1;
        x.feedback.pid.kd_v_s_per_mm *= 0.1;
        x.plant.as_mut().expect("by default").delay_s = (MAX_DELAY_TICKS + 1) as f64 * PERIOD_S;
    });
    assert_eq!(field, "plant.delay_s");
    assert!(matches!(reason, Reason::OutOfRange { .. }), "{reason:?}");
    assert_eq!(
        refusal(|x| x.feedback.law = LawKind::Cascade),
        ("feedforward.learning", Reason::NeedsPid)
    );
}

/// Learning on an encoder that shows anything; the scale and the gate after each tick.
fn hostile<S: Scalar>(steps: &[(i32, u16)]) -> Result<(), TestCaseError> {
    let mut rig = Rig::<S>::that_allows_any_error(learning());
    // By the guard in a block of 13 ms, but where the gate has opened or closed since the last change.
    let most_change = 1.01 * 0.0132;
    let (mut scale_before, mut gates) = (1.0, (1.0_f32, 1.0_f32));
    for &(step, ticks) in steps {
        rig.show_counts(step, ticks, |axis| {
            let (scale, gate) = (axis.learning().scale(), axis.learning().gate());
            gates = (gates.0.min(gate), gates.1.max(gate));
            if scale != scale_before {
                let change = (scale - scale_before).abs();
                let passed = gates.0 < 0.91 && gates.1 > 0.89;
                prop_assert!(passed || change <= most_change, "by {change} at once");
                (scale_before, gates) = (scale, (gate, gate));
            }
            prop_assert!((0.0..=2.5).contains(&scale), "scale {scale}");
            prop_assert!((-1e-3..=1.001).contains(&gate), "gate {gate}");
            prop_assert!(axis.telemetry().output_v().abs() <= 10.001);
            prop_assert!(axis.learning().error_squares().is_finite());
            prop_assert!(axis.learning().error_squares_off().is_finite());
            Ok(())
        })?;
    }
    Ok(())
}

proptest! {
    #![proptest_config(repeatable(64))]

    #[test]
    fn scale_and_gate_stay_within_their_bounds_whatever_the_encoder_shows(
        steps in prop::collection::vec((-60i32..60, 1u16..3000), 1..12)
    ) {
        hostile::<f32>(&steps)?;
        hostile::<Fixed>(&steps)?;
    }
}
/// RMS error, um, over 20 s of a sine under a load, V and Hz; none if the outputs went off.
fn under_slow_load(
    settings: &StageSettings,
    friction: f64,
    hz: f64,
    load: (f64, f64),
) -> Option<f64> {
    let amplitude_mm = 2.0;
    let velocity_mm_s = std::f64::consts::TAU * hz * amplitude_mm;
    let mut axis = Axis::<f32>::on(settings, friction, &sine_on_x(amplitude_mm, velocity_mm_s));
    axis.shaken = load;
    axis.command(Command::Run);
    axis.run(10.0);
    let square = axis.run(20.0);
    let off = axis.rig.state.safety().fault().is_some();
    (!off).then_some(1e3 * square.sqrt())
}

#[test]
fn a_slow_load_is_not_taken_for_friction() {
    let mut judged = 0;
    for hz in [0.2, 0.5, 1.0, 2.0] {
        for load_v in [0.05, 0.2] {
            for load_hz in [0.2, 0.3, 0.6, 1.0, 1.5, 2.5, 5.0, 10.0] {
                // With the friction that it knows, and with next to none, where no feedforward is best.
                for friction in [1.0, 0.05] {
                    let mut off = fixed();
                    if friction < 0.5 {
                        off.axes[0].feedforward.kind = FeedforwardKind::None;
                    }
                    let run = |settings| under_slow_load(settings, friction, hz, (load_v, load_hz));
                    let (Some(without), Some(with)) = (run(&off), run(&learning())) else {
                        continue;
                    };
                    judged += 1;
                    assert!(
                        with < 1.06 * without,
                        "{hz} Hz under {load_v} V of {load_hz} Hz, friction x {friction}: {with} um, {without} um without"
                    );
                }
            }
        }
    }
    assert!(judged > 100, "{judged} of 128");
}
