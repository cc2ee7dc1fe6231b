//! The meaning of the words of both STM32 boards: the boards' own files, on the host.

use quadrant::drivers::input_filter::InputFilter;
use quadrant::drivers::reset_flags::ResetFlags;
use quadrant::drivers::switch_inputs::{SUPPLY_LOW, SwitchInputs};
use quadrant::hal::ResetCause;
use quadrant_law::axes::AxisName;
use quadrant_law::safety::{AxisSwitches, Switches};

#[path = "../../src/board/nucleo_f446re/wiring.rs"]
pub(crate) mod nucleo_f446re;
#[path = "../../src/board/nucleo_h743zi2/wiring.rs"]
pub(crate) mod nucleo_h743zi2;

/// An input: true if it is at the first port, its pin, and what it says when it is high.
type Wire = (bool, u32, Switches);

/// A board's words as its page has them.
struct Board {
    name: &'static str,
    inputs: SwitchInputs,
    resets: ResetFlags,
    filter: InputFilter,
    /// Emergency stop, ready, and the first of the faults, at the first port; limits and homes at the second.
    pins: [u32; 5],
    /// Flags of the manual: pin, brown-out, power-on, software, watchdogs, low power.
    flags: [u32; 7],
    /// Strength of the filter: the setting, and the longest pulse that it rejects, ns.
    rejects: (u8, u32),
}

const BOARDS: [Board; 2] = [
    Board {
        name: "nucleo-f446re",
        inputs: nucleo_f446re::INPUTS,
        resets: nucleo_f446re::RESETS,
        filter: nucleo_f446re::ENCODER_FILTER,
        pins: [0, 1, 8, 0, 10],
        flags: [26, 25, 27, 28, 29, 30, 31],
        rejects: (9, 712),
    },
    Board {
        name: "nucleo-h743zi2",
        inputs: nucleo_h743zi2::INPUTS,
        resets: nucleo_h743zi2::RESETS,
        filter: nucleo_h743zi2::ENCODER_FILTER,
        pins: [0, 1, 3, 0, 7],
        flags: [22, 21, 23, 24, 26, 28, 30],
        rejects: (8, 800),
    },
];

/// Every input of a board.
fn wires([stop, ready, fault, limit, home]: [u32; 5]) -> [Wire; 14] {
    use AxisName::{X, Y, Z};
    let of = |axis, switches| Switches::NONE.with_axis(axis, switches);
    const LOW: AxisSwitches = AxisSwitches::NEGATIVE_LIMIT;
    const HIGH: AxisSwitches = AxisSwitches::POSITIVE_LIMIT;
    const HOME: AxisSwitches = AxisSwitches::HOME;
    const FAULT: AxisSwitches = AxisSwitches::AMPLIFIER_FAULT;
    [
        (true, stop, Switches::EMERGENCY_STOP),
        (true, ready, Switches::of_axes([FAULT; 3])),
        (true, fault, of(X, FAULT)),
        (true, fault + 1, of(Y, FAULT)),
        (true, fault + 2, of(Z, FAULT)),
        (false, limit, of(X, LOW)),
        (false, limit + 1, of(X, HIGH)),
        (false, limit + 2, of(Y, LOW)),
        (false, limit + 3, of(Y, HIGH)),
        (false, limit + 4, of(Z, LOW)),
        (false, limit + 5, of(Z, HIGH)),
        (false, home, of(X, HOME)),
        (false, home + 1, of(Y, HOME)),
        (false, home + 2, of(Z, HOME)),
    ]
}

/// The levels of both ports with one pin high.
fn levels(is_first: bool, pin: u32) -> (u16, u16) {
    if is_first {
        (1 << pin, 0)
    } else {
        (0, 1 << pin)
    }
}

#[test]
fn each_wire_that_breaks_sets_its_own_bits() {
    for Board {
        name, inputs, pins, ..
    } in BOARDS
    {
        assert_eq!(inputs.switches(0, 0), Switches::NONE, "all contacts closed");
        let mut all = Switches::NONE;
        for (is_first, pin, expected) in wires(pins) {
            let (first, second) = levels(is_first, pin);
            let read = inputs.switches(first, second);
            assert_eq!(read, expected, "{name}: {is_first} {pin}");
            all = all.with(expected);
        }
        let broken = inputs.switches(u16::MAX, u16::MAX);
        assert_eq!(broken, all, "{name}: all wires broken");
    }
}

#[test]
fn other_pins_say_nothing_and_every_input_has_a_pull_up() {
    for Board {
        name, inputs, pins, ..
    } in BOARDS
    {
        let (mut first, mut second) = (0, 0);
        for (is_first, pin, _) in wires(pins) {
            let (one, other) = levels(is_first, pin);
            first |= one;
            second |= other;
        }
        assert_eq!(inputs.pins(), (first, second), "{name}");
        assert_eq!(inputs.switches(!first, !second), Switches::NONE, "{name}");
    }
}

#[test]
fn a_sagging_supply_reads_as_amplifiers_that_are_not_ready() {
    for Board { name, inputs, .. } in BOARDS {
        assert_eq!(SUPPLY_LOW, inputs.switches(1 << 1, 0), "{name}");
        let stopped = inputs.switches(1, 0).with(SUPPLY_LOW);
        assert_eq!(stopped, inputs.switches(0b11, 0), "{name}");
    }
}

#[test]
fn the_more_special_flag_names_the_cause_of_a_reset() {
    for Board {
        name,
        resets,
        flags,
        ..
    } in BOARDS
    {
        let [pin, brown_out, power_on, software, one, other, low_power] = flags.map(|bit| 1 << bit);
        let cases = [
            (0, ResetCause::Unknown),
            (pin, ResetCause::Pin),
            (pin | brown_out, ResetCause::BrownOut),
            (pin | brown_out | power_on, ResetCause::PowerOn),
            (pin | software, ResetCause::Software),
            (pin | one, ResetCause::Watchdog),
            (pin | other, ResetCause::Watchdog),
            (pin | low_power, ResetCause::LowPower),
            // Other bits of the same register say nothing.
            (pin | 0b11, ResetCause::Pin),
        ];
        for (word, cause) in cases {
            assert_eq!(resets.cause(word), cause, "{name}: {word:#010x}");
        }
    }
    assert!(ResetCause::Watchdog.is_alarming() && !ResetCause::PowerOn.is_alarming());
}

#[test]
fn encoder_inputs_are_filtered_as_strongly_as_the_fastest_axis_allows() {
    for Board {
        name,
        filter,
        rejects,
        ..
    } in BOARDS
    {
        assert_eq!((filter.icf, filter.rejects_ns), rejects, "{name}");
    }
}
