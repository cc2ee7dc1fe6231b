//! The reference that is made of LinuxCNC's command.

use std::f64::consts::TAU;

use quadrant_linuxcnc::reference::{CommandPins, CommandReference, Led, Preview};

const RATE_HZ: f64 = 1e3;
const RESOLUTION_MM: f64 = 5e-4;
const PREVIEW_S: f64 = 1.2e-3;

/// A sine of 2 mm and 1 Hz, mm, at a time, s.
fn sine_mm(time_s: f64) -> f64 {
    2.0 * (TAU * time_s).sin()
}

/// The samples that a reference makes of the sine, tick by tick.
fn led(preview: Preview) -> Vec<Led> {
    let mut reference = CommandReference::new(RESOLUTION_MM, RATE_HZ, preview);
    reference.preview(PREVIEW_S, 2);
    (0..500)
        .map(|tick| {
            let time_s = f64::from(tick) / RATE_HZ;
            let velocity = 2.0 * TAU * (TAU * time_s).cos();
            let pins = CommandPins {
                ahead_mm: sine_mm(time_s),
                velocity_mm_s: velocity,
            };
            reference.step(pins, 0, tick == 0)
        })
        .collect()
}

#[test]
fn the_feedback_gets_the_command_of_the_period_before_and_the_feedforward_what_will_be() {
    for (tick, led) in led(Preview::Extrapolate).iter().enumerate().skip(2) {
        let time_s = tick as f64 / RATE_HZ;
        let now_mm = led.now.unwrap().to_mm(RESOLUTION_MM);
        assert!((now_mm - sine_mm(time_s - 1.0 / RATE_HZ)).abs() < 1e-7);
        // The command is known for the end of this period; an output is held for one, half of it on average.
        let ahead_s = time_s + PREVIEW_S - 0.5 / RATE_HZ;
        let ahead = led.ahead;
        assert!((ahead.position.to_mm(RESOLUTION_MM) - sine_mm(ahead_s)).abs() < 1e-6);
        let velocity = 2.0 * TAU * (TAU * ahead_s).cos();
        assert!((f64::from(ahead.velocity) - velocity).abs() < 5e-3 * TAU);
    }
}

#[test]
fn a_delayed_reference_is_an_older_command_and_guesses_nothing() {
    for (tick, led) in led(Preview::Delay).iter().enumerate().skip(3) {
        assert_eq!(led.now, None);
        let mm = led.ahead.position.to_mm(RESOLUTION_MM);
        assert!((mm - sine_mm((tick as f64 - 2.0) / RATE_HZ)).abs() < 1e-7);
    }
}
