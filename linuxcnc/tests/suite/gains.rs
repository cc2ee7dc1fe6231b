//! Gains on the pins.

use std::thread;
use std::time::Duration;

use crate::component::{Component, Parameters, settings};

/// Ticks at about the pace of a thread, until something is so.
fn until(component: &mut Component, is_so: impl Fn(&Component) -> bool) {
    for _ in 0..2_000 {
        component.step(true);
        if is_so(component) {
            return;
        }
        thread::sleep(Duration::from_micros(200));
    }
    panic!("{:?}", component.pins.joints[0].gains);
}

#[test]
fn gains_on_the_pins_are_those_in_force_and_others_act_without_a_jump() {
    let mut component = Component::start(&Parameters::default());
    component.run(20, false);
    let kp = settings().axes[0].feedback.pid.kp_v_per_mm;
    until(&mut component, |component| {
        component.pins.joints[0].gains[0] == kp
    });
    let before = component.outputs()[0];
    component.pins.joints[0].gains[0] = 0.5 * kp;
    for _ in 0..200 {
        component.step(true);
        thread::sleep(Duration::from_micros(200));
    }
    assert_eq!(component.pins.joints[0].gains[0], 0.5 * kp);
    assert!((component.outputs()[0] - before).abs() < 0.3);
    assert!(!component.pins.joints[0].faulted);
    // What validation refuses comes back.
    component.pins.joints[0].gains[0] = -1.0;
    component.step(true);
    until(&mut component, |component| {
        component.pins.joints[0].gains[0] == 0.5 * kp
    });
    component.pins.joints[0].gains[0] = f64::NAN;
    component.step(true);
    until(&mut component, |component| {
        component.pins.joints[0].gains[0] == 0.5 * kp
    });
}

#[test]
fn ff1_is_the_viscous_friction_that_is_fed_forward() {
    let mut component = Component::start(&Parameters::default());
    component.run(20, false);
    let sliding = settings().axes[0].friction.sliding;
    let mean = 0.5 * (sliding.positive.viscous_v_s_per_mm + sliding.negative.viscous_v_s_per_mm);
    until(&mut component, |component| {
        component.pins.joints[0].gains[3] == mean
    });
    let ff1 = 0.01;
    component.pins.joints[0].gains[3] = ff1;
    component.step(true);
    // The command's velocity of the circles, up to 50 mm/s, ahead by the preview.
    let mut largest = 0.0_f64;
    for _ in 0..4_000 {
        component.step(true);
        largest = largest.max(component.pins.joints[0].ff_viscous.abs());
        thread::sleep(Duration::from_micros(100));
    }
    assert_eq!(component.pins.joints[0].gains[3], ff1);
    assert!((largest / (50.0 * ff1) - 1.0).abs() < 0.05, "{largest}");
}
