//! Axes that follow another control's pulses: a reversal as clean as by the plan itself.

use std::f64::consts::TAU;

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::reference::{HarmonicSettings, MotionSettings, Plane, Sense, circle};
use quadrant_settings::StageSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::metrics::Score;
use quadrant_sim::plant::StageParameters;
use quadrant_sim::pulse_train::{PulseControl, PulseInput, ReversalPath};

const LEAD_S: f64 = 0.5;
/// Length of a step, mm, and the delay that the page proposes for it, s.
const STEPS: [(f64, f64); 3] = [(1e-3, 6.3e-3), (5e-3, 12.7e-3), (1e-2, 23.9e-3)];

/// Compares spikes and errors with friction fed forward by the plan itself, and by pulses of each control and step; and by pulses without it. Where steps are
/// coarse for a reversal, a `share` of one is allowed.
fn hold_to_the_plan(motions: &[MotionSettings; 3], cycle_s: f64, axes: usize, share: f64) {
    let settings = identified_settings().unwrap().stage;
    let truth = StageParameters::real();
    let path = ReversalPath::new(&settings, motions, cycle_s);
    let lead_ticks = (LEAD_S * settings.rate_hz) as usize;
    let scores = |settings: &StageSettings, input: Option<&PulseInput>| {
        let scores = path.scores(settings, &truth, input, (lead_ticks, 1));
        let scores = &scores.unwrap()[..axes];
        let mean = |read: fn(&Score) -> f64| scores.iter().map(read).sum::<f64>() / axes as f64;
        (
            mean(|score| score.glitch_mm),
            mean(|score| score.largest_mm),
        )
    };
    let (spike_mm, largest_mm) = scores(&settings, None);
    let mut without = settings.clone();
    for axis in &mut without.axes {
        axis.feedforward.kind = FeedforwardKind::None;
    }
    for control in PulseControl::ALL {
        for (step_mm, delay_s) in STEPS {
            let input = PulseInput {
                control,
                step_mm,
                delay_s,
            };
            let (by_pulses_mm, _) = scores(&settings, Some(&input));
            let ratio = by_pulses_mm / spike_mm;
            println!(
                "{}, {step_mm} mm: {ratio:.2} x {spike_mm:.5} mm",
                control.name
            );
            let most_mm = (1.3 * spike_mm).max(spike_mm + share * step_mm);
            assert!(
                by_pulses_mm <= most_mm,
                "{} {step_mm}: {ratio}",
                control.name
            );
            let (_, bare_mm) = scores(&without, Some(&input));
            assert!(bare_mm > 10.0 * largest_mm, "{bare_mm}, {largest_mm}");
        }
    }
}

#[test]
fn a_circle_by_pulses_has_spikes_as_small_as_by_the_plan() {
    let motions = circle(
        Plane::Xy,
        Sense::CounterClockwise,
        10.0,
        25.0,
        TAU / 8.0,
        2.25,
        LEAD_S,
    );
    hold_to_the_plan(&motions, TAU * 10.0 / 25.0, 2, 0.0);
}

#[test]
fn a_slow_reversal_by_pulses_has_a_spike_as_small_as_by_the_plan() {
    let (amplitude_mm, velocity_mm_s) = (1.0, 2.0);
    let sine = HarmonicSettings::with_velocity(amplitude_mm, velocity_mm_s, 2.25, LEAD_S);
    let mut motions = [MotionSettings::Hold; 3];
    motions[0] = MotionSettings::Harmonic(sine);
    hold_to_the_plan(&motions, TAU * amplitude_mm / velocity_mm_s, 1, 0.15);
}

#[test]
fn a_control_makes_the_steps_of_its_path_and_no_more() {
    let path_mm: Vec<f64> = (0..20_000)
        .map(|tick| 5.0 * (1.0 - (TAU * f64::from(tick.min(10_000)) / 1e4).cos()))
        .collect();
    for control in PulseControl::ALL {
        let counts = control.counts(&path_mm, 2e-3, 1e4, 1);
        let delay = (control.latency_s * 1e4).ceil() as usize + 1;
        for tick in delay..path_mm.len() {
            let made_mm = f64::from(counts[tick] as i32) * 2e-3;
            let late_mm = (path_mm[tick] - path_mm[tick - delay]).abs();
            // A segment's chord, and a step.
            let most_mm = late_mm + 3e-3 + 200.0 * control.segment_s * control.segment_s / 8.0;
            assert!(
                (made_mm - path_mm[tick]).abs() < most_mm,
                "{} {tick}",
                control.name
            );
        }
        assert_eq!(counts.last(), Some(&0));
    }
}
