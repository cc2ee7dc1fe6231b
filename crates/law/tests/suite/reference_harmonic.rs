//! Sine and circle: exact for an hour, smooth at both ends.

use std::f64::consts::{PI, TAU};

use quadrant_law::reference::{
    HarmonicSettings, Motion, MotionScale, MotionSettings, MotionState, Plane, Sense, circle,
};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_law::units::Position;

const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 10e3,
};
const NANOMETRE: f64 = 1e-6;

fn build<S: Scalar>(settings: HarmonicSettings) -> Motion<S> {
    Motion::build(&MotionSettings::Harmonic(settings), SCALE)
}

/// The fraction of a turn after `ticks` periods of 0.1 ms at a frequency, from the exact value of the `f64`.
fn turns(frequency_hz: f64, ticks: u64) -> f64 {
    let bits = frequency_hz.to_bits();
    let mantissa = u128::from(bits & ((1 << 52) - 1) | 1 << 52);
    let shift = 1075 - (bits >> 52) as i32;
    assert!(
        (53..=60).contains(&shift),
        "a frequency from 1/256 to below 1 Hz"
    );
    let denominator = 10_000u128 << shift;
    let numerator = mantissa * u128::from(ticks) % denominator;
    numerator as f64 / denominator as f64
}

#[test]
fn sine_is_exact_to_a_nanometre_for_an_hour() {
    let settings = HarmonicSettings {
        cycles: None,
        phase_rad: 0.7,
        lead_s: 0.5,
        ..HarmonicSettings::with_velocity(30.0, 10.0, 1.0, 0.5)
    };
    let motion = build::<f32>(settings);
    let mut state = MotionState::default();
    let lead_ticks = 5000;
    // The lead-in covers half of what its time would at full speed.
    let start = settings.phase_rad - TAU * turns(settings.frequency_hz, lead_ticks) / 2.0;
    let mut worst: f64 = 0.0;
    for tick in 1..=36_000_000u64 {
        let sample = motion.step(&mut state);
        if tick > lead_ticks && tick % 499 == 0 {
            let turns = turns(settings.frequency_hz, tick - lead_ticks);
            let angle = settings.phase_rad + TAU * turns;
            let exact = settings.amplitude_mm * (angle.sin() - start.sin());
            let error = sample.position.to_mm(SCALE.resolution_mm) - exact;
            worst = worst.max(error.abs());
        }
    }
    println!("worst error in an hour: {:.3} nm", worst / NANOMETRE);
    assert!(worst < NANOMETRE, "{worst} mm");
}

/// All samples of a motion, to one tick past its end.
fn samples<S: Scalar>(motion: &Motion<S>) -> Vec<[f64; 3]> {
    let mut state = MotionState::default();
    let mut samples = vec![[0.0; 3]];
    let mut push = |state: &mut MotionState| {
        let sample = motion.step(state);
        samples.push([
            sample.position.to_mm(SCALE.resolution_mm),
            sample.velocity.to_f64(Quantity::Velocity),
            sample.acceleration.to_f64(Quantity::Acceleration),
        ]);
    };
    while !motion.finished(&state) {
        push(&mut state);
    }
    push(&mut state);
    samples
}

fn short(phase_rad: f64) -> HarmonicSettings {
    HarmonicSettings {
        phase_rad,
        ..HarmonicSettings::with_velocity(2.0, 50.0, 1.3, 0.03)
    }
}

#[test]
fn velocity_and_acceleration_are_the_derivatives_of_position() {
    let period = 1.0 / SCALE.rate_hz;
    for phase in [0.0, 1.0, PI / 2.0, 4.0] {
        let settings = short(phase);
        let omega = TAU * settings.frequency_hz;
        let samples = samples(&build::<f64>(settings));
        for window in samples.windows(3) {
            let [before, here, after] = [window[0], window[1], window[2]];
            let velocity = (after[0] - before[0]) / (2.0 * period);
            // Half a tick of the largest acceleration: the speed of a tick is that of its middle.
            let acceleration_peak = settings.amplitude_mm * omega * (1.5 / settings.lead_s + omega);
            let tolerance = 0.6 * period * acceleration_peak;
            assert!(
                (velocity - here[1]).abs() < tolerance,
                "{velocity} {here:?}"
            );
            let acceleration = (after[1] - before[1]) / (2.0 * period);
            let jerk = jerk_bound(&settings);
            assert!(
                (acceleration - here[2]).abs() < 1.1 * period * jerk,
                "{acceleration} {here:?}"
            );
        }
    }
}

/// The largest jerk of a sine with smooth leads: the phase speed's own curvature, its slope times the angular speed
/// (three times, by the chain rule), and the sine's jerk.
fn jerk_bound(settings: &HarmonicSettings) -> f64 {
    let omega = TAU * settings.frequency_hz;
    let lead = settings.lead_s;
    settings.amplitude_mm * omega * (6.0 / (lead * lead) + 4.5 * omega / lead + omega * omega)
}

fn check_smooth<S: Scalar>(velocity_rounding: f64, acceleration_rounding: f64) {
    let period = 1.0 / SCALE.rate_hz;
    for phase in [0.0, 1.0, PI / 2.0, 4.0] {
        let settings = short(phase);
        let omega = TAU * settings.frequency_hz;
        let samples = samples(&build::<S>(settings));
        let acceleration = settings.amplitude_mm * omega * (1.5 / settings.lead_s + omega);
        for pair in samples.windows(2) {
            let velocity_step = (pair[1][1] - pair[0][1]).abs();
            assert!(
                velocity_step <= period * acceleration + velocity_rounding,
                "{pair:?}"
            );
            let acceleration_step = (pair[1][2] - pair[0][2]).abs();
            let most = 1.02 * period * jerk_bound(&settings) + acceleration_rounding;
            assert!(
                acceleration_step <= most,
                "{acceleration_step} {most} {pair:?}"
            );
        }
        let travel = samples.iter().map(|s| s[0].abs()).fold(0.0, f64::max);
        assert!(travel > settings.amplitude_mm, "it moves");
        let peak = samples.iter().map(|s| s[1].abs()).fold(0.0, f64::max);
        assert!((peak - 50.0).abs() < 0.01, "it reaches full speed: {peak}");
    }
}

#[test]
fn leads_have_no_step_of_velocity_or_acceleration() {
    check_smooth::<f64>(1e-9, 1e-6);
    check_smooth::<f32>(1e-4, 1e-2);
    check_smooth::<Fixed>(1e-4, 1e-2);
}

#[test]
fn a_fast_lead_keeps_its_acceleration_in_fixed_point() {
    // 1.5 * 250 mm/s / 0.02 s: about 19 m/s^2 along the path, within the format's 32 m/s^2.
    let settings = HarmonicSettings::with_velocity(20.0, 250.0, 1.0, 0.02);
    let exact = samples(&build::<f64>(settings));
    let fixed = samples(&build::<Fixed>(settings));
    let mut peak: f64 = 0.0;
    for (exact, fixed) in exact.iter().zip(&fixed) {
        assert!((exact[2] - fixed[2]).abs() < 0.01, "{exact:?} {fixed:?}");
        peak = peak.max(exact[2].abs());
    }
    assert!(peak > 15_000.0, "{peak}");
}

#[test]
fn a_finished_sine_stays_where_it_ended() {
    let motion = build::<f64>(short(0.0));
    let mut state = MotionState::default();
    let mut last = Position::ZERO;
    while !motion.finished(&state) {
        last = motion.step(&mut state).position;
    }
    for _ in 0..100 {
        let sample = motion.step(&mut state);
        assert!((sample.position - last).0.abs() <= 1);
        assert_eq!(sample.velocity, 0.0);
        assert_eq!(sample.acceleration.abs(), 0.0);
        assert!(motion.finished(&state));
    }
}

#[test]
fn a_sine_begins_where_the_axis_stands() {
    let motion = build::<f64>(short(1.0));
    let origin = Position(123_456_789);
    let mut state = MotionState::start(origin);
    let first = motion.step(&mut state);
    // A ten-thousandth of a second of the lead-in.
    assert!((first.position - origin).to_mm(SCALE.resolution_mm).abs() < NANOMETRE);
}

#[test]
fn circles_stay_on_their_radius_in_any_plane_phase_and_sense() {
    let (radius, feed, turns, lead) = (15.0, 60.0, 1.2, 0.1);
    let mut worst: f64 = 0.0;
    for plane in [Plane::Xy, Plane::Yz, Plane::Zx] {
        for (sense, sign) in [(Sense::CounterClockwise, 1.0), (Sense::Clockwise, -1.0)] {
            for start in [0.0, 0.3, PI / 2.0, 2.0, PI, 5.0, -1.0] {
                let plan = circle(plane, sense, radius, feed, start, turns, lead);
                let (first, second) = plane.axes();
                let third = 3 - first - second;
                assert_eq!(plan[third], MotionSettings::Hold);
                let [one, two] =
                    [first, second].map(|axis| samples(&Motion::<f64>::build(&plan[axis], SCALE)));
                // The start lies half a lead-in before the angle asked for.
                let before = start - sign * 0.5 * lead * feed / radius;
                let centre = [-radius * before.cos(), -radius * before.sin()];
                let lead_ticks = 1000;
                for (tick, (a, b)) in one.iter().zip(&two).enumerate() {
                    let (a0, b0) = (a[0] - centre[0], b[0] - centre[1]);
                    worst = worst.max((a0.hypot(b0) - radius).abs());
                    if tick == lead_ticks {
                        let off = (b0.atan2(a0) - start).sin();
                        assert!(off.abs() * radius < NANOMETRE, "start angle {start}: {off}");
                        let turn = a0 * b[1] - b0 * a[1];
                        assert!((turn * sign / radius - feed).abs() < 1e-3, "{turn}");
                    }
                }
                let cruise = (turns * TAU * radius / feed * 1e4).round() as usize;
                assert_eq!(one.len(), cruise + 2 * lead_ticks + 2);
            }
        }
    }
    println!("worst radial error: {:.3} nm", worst / NANOMETRE);
    assert!(worst < NANOMETRE, "{worst} mm");
}
