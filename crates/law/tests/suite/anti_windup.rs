//! Recovery from a load that the output limit cannot hold.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::control::feedback::{Feedback, LawKind};
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::surface::SurfaceGains;
use quadrant_law::control::terms::FeedbackInput;
use quadrant_law::control::terms::FeedbackState;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::reference::Velocity;
use quadrant_settings::presets::x_axis;

use quadrant_test_support::{Rig, with_x};

const PERIOD_S: f64 = 1e-4;
const LIMIT_V: f64 = 1.0;
const LOAD_V: f64 = 1.05;
const LOAD_S: f64 = 0.5;

/// The x axis' linear model without its spring, under a PID with a strong integral.
struct Loop {
    law: Feedback<f64>,
    memory: FeedbackState<f64>,
    place_mm: f64,
    velocity_mm_s: f64,
    delay: [f64; 12],
    tick: usize,
}

impl Loop {
    fn new(law: LawKind) -> Self {
        let mut feedback = x_axis().feedback;
        feedback.law = law;
        feedback.integral_limit_v = LIMIT_V;
        feedback.pid = PidGains {
            ki_v_per_mm_s: 40.0,
            ..feedback.pid
        };
        let surface = SurfaceGains::from_pid(&feedback.pid).expect("real zeros");
        let (cascade, sliding, nctf) = (
            feedback.cascade.as_mut().expect("by default"),
            feedback.sliding_mode.as_mut().expect("by default"),
            feedback.nctf.as_mut().expect("by default"),
        );
        for integral in [
            &mut cascade.velocity_integral_per_s,
            &mut sliding.integral_per_s,
            &mut nctf.integral_per_s,
        ] {
            *integral = surface.integral_per_s;
        }
        Self {
            law: feedback.build(PERIOD_S),
            memory: FeedbackState::default(),
            place_mm: 0.0,
            velocity_mm_s: 0.0,
            delay: [0.0; 12],
            tick: 0,
        }
    }

    /// One control period under a load; the error.
    fn step(&mut self, load_v: f64) -> f64 {
        let error = -self.place_mm;
        let input = FeedbackInput {
            error,
            velocity: 0.0,
        };
        let output = self.law.step(&mut self.memory, input, 0.0, LIMIT_V).output;
        let slot = self.tick % self.delay.len();
        let drive = core::mem::replace(&mut self.delay[slot], output) + load_v;
        self.tick += 1;
        for _ in 0..10 {
            let step = PERIOD_S / 10.0;
            self.velocity_mm_s += step * (69_390.0 * drive - 144.8 * self.velocity_mm_s);
            self.place_mm += step * self.velocity_mm_s;
        }
        error
    }

    /// The errors of `seconds` without load.
    fn recover(&mut self, seconds: f64) -> Vec<f64> {
        (0..(seconds / PERIOD_S) as usize)
            .map(|_| self.step(0.0))
            .collect()
    }
}

/// The overshoot past zero and the time in s from which the error stays within 10 um.
fn overshoot_and_settling(errors: &[f64]) -> (f64, f64) {
    let sign = errors[0].signum();
    let overshoot = errors
        .iter()
        .fold(0.0f64, |most, error| most.max(-sign * error));
    let last = errors
        .iter()
        .rposition(|error| error.abs() > 0.01)
        .unwrap_or(0);
    (overshoot, (last + 1) as f64 * PERIOD_S)
}

fn check(law: LawKind) {
    let mut overshoots = vec![];
    for sign in [1.0, -1.0] {
        let mut windup = Loop::new(law);
        for _ in 0..(LOAD_S / PERIOD_S) as usize {
            windup.step(sign * LOAD_V);
        }
        let pushed_mm = windup.place_mm;
        assert!(
            pushed_mm * sign > 5.0,
            "the load overpowers the output: {pushed_mm} mm"
        );
        // The same place and speed with nothing remembered of the load.
        let mut fresh = Loop::new(law);
        (fresh.place_mm, fresh.velocity_mm_s) = (windup.place_mm, windup.velocity_mm_s);
        fresh.law.take_over(&mut fresh.memory, -fresh.place_mm);
        fresh.delay = [-sign * LIMIT_V; 12];

        let (overshoot, settled_s) = overshoot_and_settling(&windup.recover(2.0));
        let (unloaded, unloaded_s) = overshoot_and_settling(&fresh.recover(2.0));
        println!(
            "{law:?}, load {sign:+}: overshoot {overshoot:.3} mm in {settled_s:.3} s, \
             without the load's history {unloaded:.3} mm in {unloaded_s:.3} s"
        );
        assert!(settled_s < 0.5, "{settled_s} s");
        assert!(
            overshoot < unloaded + 0.3 * pushed_mm.abs(),
            "{overshoot} {unloaded}"
        );
        overshoots.push(overshoot);
    }
    assert_eq!(overshoots[0], overshoots[1], "both signs alike");
}

#[test]
fn every_law_recovers_from_a_saturating_load_of_either_sign() {
    for law in LawKind::ALL {
        check(law);
    }
}

#[test]
fn the_integral_stands_while_feedback_and_feedforward_saturate_together() {
    let settings = with_x(|x| {
        x.amplifier.output_limit_v = 0.2;
        (x.feedback.sliding_mode, x.feedback.nctf) = (None, None);
        (x.feedback.cascade, x.feedback.schedule) = (None, None);
        x.feedback.law = LawKind::Pid;
        x.feedback.integral_limit_v = 0.1;
        x.feedback.pid = PidGains {
            kp_v_per_mm: 1.0,
            ki_v_per_mm_s: 10.0,
            kd_v_s_per_mm: 0.0,
            ..x.feedback.pid
        };
        x.feedforward.kind = FeedforwardKind::Static;
    });
    let mut rig = Rig::<f32>::new(&settings, &Default::default());
    rig.tick();
    rig.command(Command::Enable);
    let velocity = Velocity::from_mm_s(20.0, settings.motion_scale(0));
    rig.command(Command::Jog(AxisName::X, velocity));
    let mut before = None;
    for tick in 0..1500i64 {
        for index in 0..3 {
            let reference = rig.state.axes()[index].telemetry().reference;
            // x falls 0.12 mm behind: 0.12 V, beside as much of friction's feedforward.
            let behind = if index == 0 { tick.min(240) } else { 0 };
            rig.inputs.readings[index].count = ((reference.0 >> 16) - behind) as u32;
        }
        assert!(rig.tick().enabled);
        let seen = rig.state.axes()[0].telemetry();
        if tick == 500 {
            assert_eq!(seen.output, 0.2);
            assert!(
                seen.feedback.proportional < 0.15,
                "not by the feedback alone"
            );
            before = Some(seen.feedback.integral);
        }
    }
    let after = rig.state.axes()[0].telemetry().feedback.integral;
    assert_eq!(before, Some(after));
}
