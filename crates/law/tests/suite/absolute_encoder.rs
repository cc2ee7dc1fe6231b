//! Axes that know their position from the first readings on.

use proptest::prelude::*;
use quadrant_law::admission::{Refusal, StageView, refusal};
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::safety::{FaultCode, SafetyState};
use quadrant_law::units::EncoderCount;
use quadrant_settings::{SerialSettings, StageSettings, TravelSettings};

use quadrant_test_support::{Rig, repeatable, sine_on_x, with_x};

/// 26 bits of 0.5 um: 33.5 m.
const BITS: u32 = 26;
const RESOLUTION_MM: f64 = 5e-4;

fn settings(offset_mm: f64, reversed: bool) -> StageSettings {
    with_x(|axis| {
        axis.homing = None;
        axis.limits.unhomed_mm_s = Some(10.0);
        axis.limits.travel_mm = Some(TravelSettings {
            negative: -100.0,
            positive: 300.0,
        });
        axis.encoder.counter_bits = BITS as u8;
        axis.encoder.reversed = reversed;
        axis.encoder.counts_per_index = None;
        axis.encoder.serial = Some(SerialSettings::default());
        axis.encoder.offset_mm = Some(offset_mm);
    })
}

/// The encoder's count where the axis is at a position.
fn count(position_mm: f64, offset_mm: f64, reversed: bool) -> u32 {
    let shown = ((position_mm + offset_mm) / RESOLUTION_MM).round() as i64;
    let signed = if reversed { -shown } else { shown };
    signed.rem_euclid(1 << BITS) as u32
}

struct Machine(Rig<f32>);

impl Machine {
    fn new(settings: &StageSettings) -> Self {
        Self(Rig::new(settings, &sine_on_x(1.0, 5.0)))
    }

    fn read(&mut self, reading: EncoderReading) {
        self.0.inputs.readings[0] = reading;
        self.0.tick();
    }

    fn show(&mut self, count: u32) {
        self.read(EncoderReading::of(count));
    }

    fn is_homed(&self) -> bool {
        self.0.state.axes()[0].is_homed()
    }

    fn measured(&self) -> EncoderCount {
        self.0.state.axes()[0].telemetry().measured
    }
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn the_second_reading_homes_the_axis_where_it_is_and_it_goes_on_from_there(
        position_mm in -100.0_f64..300.0, offset_mm in -3e4_f64..3e4, reversed: bool, moved in -30_i64..=30,
    ) {
        let mut machine = Machine::new(&settings(offset_mm, reversed));
        let at = (position_mm / RESOLUTION_MM).round();
        let offset = (offset_mm / RESOLUTION_MM).round();
        let show = |moved: i64| count((at + moved as f64) * RESOLUTION_MM, offset * RESOLUTION_MM, reversed);
        machine.show(show(0));
        prop_assert!(!machine.is_homed());
        machine.show(show(0));
        prop_assert!(machine.is_homed());
        prop_assert_eq!(machine.measured(), EncoderCount(at as i64));
        machine.show(show(moved));
        prop_assert_eq!(machine.measured(), EncoderCount(at as i64 + moved));
    }
}

#[test]
fn readings_that_do_not_agree_or_are_not_good_leave_the_axis_unhomed_and_it_starts_no_plan() {
    let here = count(20.0, 7.0, false);
    let invalid = EncoderReading {
        valid: false,
        ..EncoderReading::of(here)
    };
    let stale = EncoderReading {
        fresh: false,
        ..EncoderReading::of(here)
    };
    for other in [EncoderReading::of(here + 100_000), invalid, stale] {
        let mut machine = Machine::new(&settings(7.0, false));
        for _ in 0..20 {
            machine.show(here);
            machine.read(other);
            assert!(!machine.is_homed());
        }
        machine.show(here);
        let view = machine
            .0
            .stage
            .as_ref()
            .view(&machine.0.plan, &machine.0.state);
        let enabled = StageView {
            safety: SafetyState::Enabled,
            ..view
        };
        let refused = refusal(enabled, Command::Run);
        assert_eq!(refused, Some(Refusal::NotHomed(AxisName::X)));
        machine.show(here);
        assert!(machine.is_homed());
        assert_eq!(machine.measured(), EncoderCount(40_000));
    }
}

#[test]
fn an_axis_outside_its_travel_is_homed_once_it_is_inside() {
    let mut machine = Machine::new(&settings(0.0, false));
    // Where an exchanged encoder might be.
    let mut at = count(-140.0, 0.0, false);
    for _ in 0..5 {
        machine.show(at);
        assert!(!machine.is_homed());
    }
    assert_eq!(machine.measured(), EncoderCount(-280_000));
    for _ in 0..3000 {
        at = (at + 30) & ((1 << BITS) - 1);
        machine.show(at);
    }
    assert!(machine.is_homed());
    assert_eq!(machine.measured(), EncoderCount(-190_000));
}

#[test]
fn after_a_fault_of_the_encoder_the_position_comes_back_by_itself() {
    let mut machine = Machine::new(&settings(0.0, false));
    let here = count(50.0, 0.0, false);
    for _ in 0..3 {
        machine.show(here);
    }
    machine.0.command(Command::Enable);
    assert_eq!(machine.0.state.safety(), SafetyState::Enabled);
    machine.read(EncoderReading {
        valid: false,
        ..EncoderReading::of(here)
    });
    let SafetyState::Faulted(fault) = machine.0.state.safety() else {
        panic!("no fault");
    };
    assert_eq!(
        (fault.code, fault.axis),
        (FaultCode::EncoderInvalid, Some(AxisName::X))
    );
    assert!(!machine.is_homed());
    // Moved by hand meanwhile, further than an axis can in a tick.
    let there = count(80.0, 0.0, false);
    machine.show(there);
    assert!(!machine.is_homed());
    machine.show(there);
    assert!(machine.is_homed());
    assert_eq!(machine.measured(), EncoderCount(160_000));
}

#[test]
fn without_an_offset_it_is_homed_as_any_other() {
    let mut settings = settings(0.0, false);
    settings.axes[0].encoder.offset_mm = None;
    let mut machine = Machine::new(&settings);
    for _ in 0..5 {
        machine.show(12_345);
    }
    assert!(!machine.is_homed());
    assert_eq!(machine.measured(), EncoderCount(0));
}
