//! Sets of digital inputs, bit by bit.

use quadrant_law::axes::AxisName;
use quadrant_law::safety::{AxisSwitches, Switches};

const EACH: [AxisSwitches; 5] = [
    AxisSwitches::NEGATIVE_LIMIT,
    AxisSwitches::POSITIVE_LIMIT,
    AxisSwitches::HOME,
    AxisSwitches::AMPLIFIER_FAULT,
    AxisSwitches::OUTPUT_MISMATCH,
];

#[test]
fn every_input_has_the_bit_of_the_link_that_is_documented() {
    for (axis, index) in AxisName::ALL.into_iter().zip(0..) {
        for (switches, bit) in EACH.into_iter().zip(0..) {
            let word = 1 << (5 * index + bit);
            let set = Switches::NONE.with_axis(axis, switches);
            assert_eq!(set.bits(), word, "{axis} {switches:?}");
            assert_eq!(Switches::from_bits(word), set);
            let mut axes = [AxisSwitches::default(); 3];
            axes[axis as usize] = switches;
            assert_eq!(Switches::of_axes(axes), set);
        }
    }
    assert_eq!(Switches::EMERGENCY_STOP.bits(), 1 << 15);
    assert_eq!(
        Switches::of_axes([EACH[0], EACH[0], EACH[4]]).bits(),
        0x4021
    );
}

#[test]
fn a_union_has_what_either_has_also_where_both_have_it_and_a_difference_takes_only_its_own_bits() {
    for one in EACH {
        for other in EACH {
            let both = one.with(other);
            assert!(both.has(one) && both.has(other), "{one:?} {other:?}");
            assert!(!both.without(other).has(other));
            assert_eq!(both.without(other).has(one), one != other);
            assert_eq!(one.without(other).with(other), both);
            let sets = [one, other].map(|switches| Switches::of_axes([switches; 3]));
            assert_eq!(sets[0].with(sets[1]), Switches::of_axes([both; 3]));
            assert_eq!(
                sets[0].with_axis(AxisName::Y, other).axis(AxisName::Y),
                both
            );
        }
    }
}

#[test]
fn an_axis_is_at_a_limit_only_by_its_limit_switches() {
    for (switches, at_limit) in EACH.into_iter().zip([true, true, false, false, false]) {
        assert_eq!(switches.at_limit(), at_limit, "{switches:?}");
    }
    assert!(EACH[0].with(EACH[1]).at_limit());
    assert!(!AxisSwitches::default().at_limit());
}

#[test]
fn the_inputs_are_good_unless_an_amplifier_a_converter_or_the_emergency_stop_speaks_against_it() {
    let bad = [false, false, false, true, true];
    assert!(Switches::NONE.are_good());
    assert!(!Switches::EMERGENCY_STOP.are_good());
    for axis in AxisName::ALL {
        for (one, one_bad) in EACH.into_iter().zip(bad) {
            for (other, other_bad) in EACH.into_iter().zip(bad) {
                let set = Switches::NONE.with_axis(axis, one.with(other));
                assert_eq!(set.are_good(), !one_bad && !other_bad, "{axis} {set:?}");
                assert!(!set.with(Switches::EMERGENCY_STOP).are_good());
            }
        }
    }
}
