//! The meaning of the reference board's words: the board's own file, on the host.

use quadrant::hal::ResetCause;
use quadrant_law::axes::AxisName;
use quadrant_law::safety::{AxisSwitches, Switches};

#[path = "../../src/board/nucleo_f446re/wiring.rs"]
mod wiring;

use wiring::{ENCODER_FILTER, PORT_A_INPUTS, PORT_C_INPUTS, SUPPLY_LOW, reset_cause, switches};

/// Every input: port, pin, and what it says when it is high.
const WIRES: [(char, u32, Switches); 14] = {
    use AxisName::{X, Y, Z};
    const fn of(axis: AxisName, switches: AxisSwitches) -> Switches {
        Switches::NONE.with_axis(axis, switches)
    }
    const LOW: AxisSwitches = AxisSwitches::NEGATIVE_LIMIT;
    const HIGH: AxisSwitches = AxisSwitches::POSITIVE_LIMIT;
    const HOME: AxisSwitches = AxisSwitches::HOME;
    const FAULT: AxisSwitches = AxisSwitches::AMPLIFIER_FAULT;
    [
        ('a', 0, Switches::EMERGENCY_STOP),
        ('a', 1, Switches::of_axes([FAULT; 3])),
        ('a', 8, of(X, FAULT)),
        ('a', 9, of(Y, FAULT)),
        ('a', 10, of(Z, FAULT)),
        ('c', 0, of(X, LOW)),
        ('c', 1, of(X, HIGH)),
        ('c', 2, of(Y, LOW)),
        ('c', 3, of(Y, HIGH)),
        ('c', 4, of(Z, LOW)),
        ('c', 5, of(Z, HIGH)),
        ('c', 10, of(X, HOME)),
        ('c', 11, of(Y, HOME)),
        ('c', 12, of(Z, HOME)),
    ]
};

fn levels(port: char, pin: u32) -> (u16, u16) {
    match port {
        'a' => (1 << pin, 0),
        _ => (0, 1 << pin),
    }
}

#[test]
fn each_wire_that_breaks_sets_its_own_bits() {
    assert_eq!(switches(0, 0), Switches::NONE, "all contacts closed");
    let mut all = Switches::NONE;
    for (port, pin, expected) in WIRES {
        let (port_a, port_c) = levels(port, pin);
        assert_eq!(switches(port_a, port_c), expected, "P{port}{pin}");
        all = all.with(expected);
    }
    assert_eq!(switches(u16::MAX, u16::MAX), all, "all wires broken");
}

#[test]
fn other_pins_say_nothing_and_every_input_has_a_pull_up() {
    let (mut port_a, mut port_c) = (0, 0);
    for (port, pin, _) in WIRES {
        let (a, c) = levels(port, pin);
        port_a |= a;
        port_c |= c;
    }
    assert_eq!((PORT_A_INPUTS, PORT_C_INPUTS), (port_a, port_c));
    assert_eq!(switches(!port_a, !port_c), Switches::NONE);
}

#[test]
fn a_sagging_supply_reads_as_amplifiers_that_are_not_ready() {
    let not_ready = switches(1 << 1, 0);
    assert_eq!(SUPPLY_LOW, not_ready);
    assert_eq!(switches(1, 0).with(SUPPLY_LOW), switches(0b11, 0));
}

#[test]
fn the_more_special_flag_names_the_cause_of_a_reset() {
    let pin = 1 << 26;
    let cases = [
        (0, ResetCause::Unknown),
        (pin, ResetCause::Pin),
        (pin | 1 << 25, ResetCause::BrownOut),
        (pin | 1 << 25 | 1 << 27, ResetCause::PowerOn),
        (pin | 1 << 28, ResetCause::Software),
        (pin | 1 << 29, ResetCause::Watchdog),
        (pin | 1 << 30, ResetCause::Watchdog),
        (pin | 1 << 31, ResetCause::LowPower),
        // The oscillator's bits of the same register say nothing.
        (pin | 0b11, ResetCause::Pin),
    ];
    for (csr, cause) in cases {
        assert_eq!(reset_cause(csr), cause, "{csr:#010x}");
    }
    assert!(ResetCause::Watchdog.is_alarming() && !ResetCause::PowerOn.is_alarming());
}

#[test]
fn encoder_inputs_are_filtered_as_strongly_as_the_fastest_axis_allows() {
    assert_eq!((ENCODER_FILTER.icf, ENCODER_FILTER.rejects_ns), (9, 712));
}
