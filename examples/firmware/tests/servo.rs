//! The axis of the page, on a simulated mass.

use quadrant_law::reference::{HarmonicSettings, Motion, MotionSettings};
use quadrant_law::safety::FaultCode;
use quadrant_law::units::DacCode;
use quadrant_law_example::{SCALE, Servo};

/// A mass of 69 390 mm/s^2 a volt, with viscous friction.
#[derive(Default)]
struct Mass {
    position_mm: f64,
    velocity_mm_s: f64,
}

impl Mass {
    fn count(&self) -> u32 {
        (self.position_mm / SCALE.resolution_mm).round() as i32 as u32
    }

    fn step(&mut self, word: Option<DacCode>) {
        let volts = word.map_or(0.0, |word| word.to_volts(10.0));
        self.velocity_mm_s += (69_390.0 * volts - 144.8 * self.velocity_mm_s) * SCALE.period_s();
        self.position_mm += self.velocity_mm_s * SCALE.period_s();
    }
}

#[test]
fn the_axis_of_the_page_is_driven_when_enabled_and_follows_a_motion() {
    let mut servo = Servo::new().expect("valid");
    let sine = HarmonicSettings::with_velocity(5.0, 10.0, 1.0, 0.5);
    let motion = Motion::build(&MotionSettings::Harmonic(sine), SCALE);
    let mut mass = Mass::default();
    assert_eq!(servo.tick(&motion, mass.count(), false), None);
    // Pushed while it is off: it holds from where it is.
    mass.position_mm = 0.05;
    assert_eq!(servo.tick(&motion, mass.count(), false), None);
    assert_eq!(servo.tick(&motion, mass.count(), true), Some(DacCode::ZERO));
    servo.run();
    let mut farthest_mm = 0.0_f64;
    for _ in 0..50_000 {
        let word = servo.tick(&motion, mass.count(), true);
        assert!(word.is_some(), "{:?}", servo.fault());
        mass.step(word);
        farthest_mm = farthest_mm.max(mass.position_mm.abs());
    }
    assert!(farthest_mm > 4.0, "{farthest_mm}");
}

#[test]
fn a_fault_switches_the_axis_of_the_page_off_until_it_is_acknowledged() {
    let mut servo = Servo::new().expect("valid");
    let mut tick = |count, enable| servo.tick(&Motion::Hold, count, enable);
    assert_eq!(tick(0, false), None);
    assert_eq!(tick(0, true), Some(DacCode::ZERO));
    let pushed_back = tick(1, true).expect("driven");
    assert!(pushed_back.0 < 0, "{pushed_back:?}");
    // 2 mm in a tick.
    assert_eq!(tick(4_000, true), None);
    for _ in 0..100 {
        assert_eq!(tick(4_000, true), None);
    }
    assert_eq!(servo.fault(), Some(FaultCode::Overspeed));
    servo.acknowledge();
    assert_eq!(servo.tick(&Motion::Hold, 4_000, true), Some(DacCode::ZERO));
    assert_eq!(servo.fault(), None);
}
