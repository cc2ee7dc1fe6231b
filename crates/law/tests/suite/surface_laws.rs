//! Cascade, sliding mode and NCTF: a PID at small errors, and each its own beyond.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::nctf::CharacteristicPoint;
use quadrant_law::control::pid::{Pid, PidGains};
use quadrant_law::control::surface::SurfaceGains;
use quadrant_law::control::terms::FeedbackInput;
use quadrant_law::control::terms::FeedbackState;
use quadrant_settings::{FeedbackSettings, presets::x_axis};

const PERIOD_S: f64 = 1e-4;

/// The defaults of x with an integral that shows.
fn settings(law: LawKind) -> (FeedbackSettings, PidGains) {
    let mut feedback = x_axis().feedback;
    feedback.law = law;
    let surface = SurfaceGains {
        integral_per_s: 20.0,
        ..SurfaceGains::from_pid(&feedback.pid).expect("real zeros")
    };
    feedback.cascade.as_mut().unwrap().velocity_integral_per_s = 20.0;
    feedback.sliding_mode.as_mut().unwrap().integral_per_s = 20.0;
    feedback.nctf.as_mut().unwrap().integral_per_s = 20.0;
    let gains = surface.to_pid(feedback.pid.derivative_filter_s);
    (feedback, gains)
}

/// An error that starts at zero and swings within 5 um.
fn errors() -> impl Iterator<Item = f64> {
    (0..2000).map(|tick| 5e-3 * (f64::from(tick) * 0.01).sin())
}

#[test]
fn each_is_its_pid_at_small_errors() {
    for law in [LawKind::Cascade, LawKind::SlidingMode, LawKind::Nctf] {
        let (settings, gains) = settings(law);
        let (law_built, pid) = (settings.build(PERIOD_S), Pid::build(&gains, 2.0, PERIOD_S));
        let mut states = (FeedbackState::default(), FeedbackState::default());
        let mut largest = 0.0f64;
        for error in errors() {
            let input = FeedbackInput {
                error,
                velocity: 7.0,
            };
            let ours = law_built.step(&mut states.0, input, 0.0, 10.0).output;
            let its = pid.step(&mut states.1, error, 0.0, 10.0).output;
            largest = largest.max((ours - its).abs());
        }
        // The integral of a difference is a sum's end, not the trapezoid's: half a period of 0.1 mV/tick.
        assert!(largest < 2e-5, "{law:?}: {largest} V");
    }
}

#[test]
fn gains_of_a_surface_and_of_its_pid_belong_together() {
    let surface = SurfaceGains {
        slope_per_s: 180.0,
        gain_v_s_per_mm: 0.006,
        integral_per_s: 12.0,
    };
    let back = SurfaceGains::from_pid(&surface.to_pid(52e-6)).expect("real zeros");
    assert!((back.slope_per_s / 180.0 - 1.0).abs() < 1e-9, "{back:?}");
    assert!((back.gain_v_s_per_mm / 0.006 - 1.0).abs() < 1e-9);
    assert!((back.integral_per_s / 12.0 - 1.0).abs() < 1e-9);
    // Kp^2 < 4 Ki Kd: no two loops in cascade do this.
    let complex = PidGains {
        kp_v_per_mm: 1.0,
        ki_v_per_mm_s: 100.0,
        kd_v_s_per_mm: 0.005,
        derivative_filter_s: 52e-6,
    };
    assert_eq!(SurfaceGains::from_pid(&complex), None);
}

/// The output of a law's first tick that is not a start, from a standing error.
fn standing(settings: &FeedbackSettings, error: f64, velocity: f64) -> f64 {
    let law = settings.build(PERIOD_S);
    let mut state = FeedbackState::default();
    law.take_over(&mut state, error);
    law.step(&mut state, FeedbackInput { error, velocity }, 0.0, 10.0)
        .output
}

#[test]
fn the_cascade_asks_for_no_more_than_its_velocity_limit() {
    let (mut settings, _) = settings(LawKind::Cascade);
    let cascade = settings.cascade.as_mut().unwrap();
    cascade.velocity_integral_per_s = 0.0;
    cascade.velocity_limit_mm_s = 30.0;
    let gain = cascade.velocity_gain_v_s_per_mm;
    // Far out the axis, which follows at 10 mm/s, is asked for 20 mm/s more.
    assert!((standing(&settings, 5.0, 10.0) - 20.0 * gain).abs() < 1e-12);
    assert!((standing(&settings, -5.0, 10.0) + 40.0 * gain).abs() < 1e-12);
}

#[test]
fn without_velocity_feedforward_the_cascade_holds_back() {
    let (mut settings, _) = settings(LawKind::Cascade);
    let cascade = settings.cascade.as_mut().unwrap();
    cascade.velocity_integral_per_s = 0.0;
    cascade.velocity_feedforward = 0.25;
    let (gain, position) = (
        cascade.velocity_gain_v_s_per_mm,
        cascade.position_gain_per_s,
    );
    assert!((standing(&settings, 0.0, 8.0) + 6.0 * gain).abs() < 1e-12);
    // The lag at which nothing is asked for: (1 - g) v / Kv.
    assert!(standing(&settings, 6.0 / position, 8.0).abs() < 1e-12);
}

#[test]
fn sliding_mode_puts_out_no_more_than_its_switching_voltage() {
    let (mut settings, _) = settings(LawKind::SlidingMode);
    settings.sliding_mode.as_mut().unwrap().integral_per_s = 0.0;
    assert_eq!(standing(&settings, 20.0, 0.0), 1.0);
    assert_eq!(standing(&settings, -20.0, 0.0), -1.0);
    // On the edge of the boundary layer.
    let edge = settings.sliding_mode.unwrap();
    let at = standing(&settings, edge.boundary_mm_s / edge.slope_per_s, 0.0);
    assert!((at - 1.0).abs() < 1e-12, "{at}");
}

#[test]
fn nctf_follows_its_characteristic_between_the_points_and_beyond() {
    let (mut settings, _) = settings(LawKind::Nctf);
    let nctf = settings.nctf.as_mut().unwrap();
    nctf.integral_per_s = 0.0;
    let gain = nctf.gain_v_s_per_mm;
    nctf.characteristic.clear();
    for (error_mm, velocity_mm_s) in [(0.5, 100.0), (1.5, 160.0), (4.0, 220.0)] {
        let point = CharacteristicPoint {
            error_mm,
            velocity_mm_s,
        };
        nctf.characteristic.push(point).unwrap();
    }
    for (error, velocity) in [
        (0.01, 2.0),
        (0.25, 50.0),
        (1.0, 130.0),
        (-1.0, -130.0),
        (4.0, 220.0),
        (20.0, 220.0),
    ] {
        let found = standing(&settings, error, 0.0) / gain;
        assert!((found - velocity).abs() < 0.5, "{error} mm: {found} mm/s");
    }
}
