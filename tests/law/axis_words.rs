//! Built axes as words: what comes back is what was built, and what is none is refused.

use proptest::prelude::*;
use proptest::test_runner::Config;
use quadrant::app::fingerprint;
use quadrant::axes::{AxisName, PerAxis};
use quadrant::axis::Axis;
use quadrant::command::Command;
use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;
use quadrant::law::words::{Window, WordFlaw, Words, WordsError};
use quadrant::scalar::{Fixed, Scalar};
use quadrant::settings::{Machine, StageSettings};
use quadrant::stage::{Inputs, Stage, StageState};

use crate::common::{repeatable, sine_on_x};
use crate::stored_bytes::{ELEMENTS, varied};

type Built<S> = Axis<S, ELEMENTS>;

fn words_of<T: Words>(value: &mut T) -> Vec<u32> {
    let mut words = vec![0; Window::count(value)];
    Window::give(&mut words, 0).pass_over(value).expect("gives");
    words
}

/// Takes words in pieces of a length that no part of an axis has.
fn take<T: Words>(words: &[u32], into: &mut T) -> Result<usize, WordsError> {
    let mut words = words.to_vec();
    let mut count = 0;
    for (number, chunk) in words.chunks_mut(89).enumerate() {
        count = Window::take(chunk, 89 * number).pass_over(into)?;
    }
    Ok(count)
}

/// Takes an axis over another one, checks that it is the one that was built, word by word, and returns it.
fn there_and_back<S: Scalar>(mut built: Built<S>, other: &Built<S>) -> Built<S> {
    let words = words_of(&mut built);
    let mut taken = other.clone();
    assert_eq!(take(&words, &mut taken), Ok(words.len()));
    assert_eq!(taken, built);
    assert_eq!(words_of(&mut taken), words);
    taken
}

fn every_axis_comes_back<S: Scalar>(settings: &StageSettings) {
    let other = StageSettings::simulated().build_axis(AxisName::Y);
    for axis in AxisName::ALL {
        there_and_back(settings.build_axis::<S, ELEMENTS>(axis), &other);
    }
}

proptest! {
    #![proptest_config(Config { max_global_rejects: 20_000, ..repeatable(100) })]

    #[test]
    fn any_axis_comes_back_in_every_number_type(seed: u64) {
        let settings = varied(seed);
        prop_assume!(settings.validate(ELEMENTS).is_ok());
        every_axis_comes_back::<f32>(&settings);
        every_axis_comes_back::<Fixed>(&settings);
        every_axis_comes_back::<f64>(&settings);
        let mut machine = settings.machine();
        let mut taken = Machine::BLANK;
        prop_assert!(take(&words_of(&mut machine), &mut taken).is_ok());
        prop_assert_eq!(taken, machine);
    }

    #[test]
    fn no_words_panic(place: prop::sample::Index, word: u32, counts in any::<[u32; 8]>()) {
        let mut built = StageSettings::simulated().build_axis::<f32, ELEMENTS>(AxisName::X);
        let mut words = words_of(&mut built);
        let place = place.index(words.len());
        words[place] = word;
        let mut taken = Built::<f32>::blank();
        if take(&words, &mut taken).is_ok() {
            let stage = Stage::new(PerAxis::from_fn(|_| taken.clone()), Default::default());
            let mut state = StageState::default();
            let plan = sine_on_x(1.0, 10.0).build(&StageSettings::simulated()).expect("valid");
            for (tick, count) in counts.into_iter().enumerate() {
                let command = [Command::Enable, Command::Run][tick & 1];
                let inputs = Inputs { command: Some(command), ..Inputs::of_counts([count; 3]) };
                stage.tick(&plan, &mut state, &inputs);
            }
        }
    }
}

/// Runs a stage whose x moves as far as a hundredth of what its output says.
fn run<S: Scalar>(axes: PerAxis<Built<S>>, settings: &StageSettings) -> Vec<[i16; 3]> {
    let stage = Stage::new(axes, settings.operation());
    let plan = sine_on_x(1.0, 10.0).build(settings).expect("valid plan");
    let mut state = StageState::default();
    let mut count = 0;
    (0..2_000)
        .map(|tick| {
            let command = match tick {
                100 => Some(Command::Enable),
                110 => Some(Command::Run),
                _ => None,
            };
            let inputs = Inputs {
                command,
                ..Inputs::of_counts([count as u32, 0, 0])
            };
            let codes = stage.tick(&plan, &mut state, &inputs).codes;
            count += i32::from(codes[0].0) / 100;
            codes.map(|code| code.0).into_array()
        })
        .collect()
}

fn words_run_as_what_was_built<S: Scalar>(settings: &StageSettings) {
    let built = PerAxis::from_fn(|axis| settings.build_axis::<S, ELEMENTS>(axis));
    let taken = built
        .clone()
        .map(|axis| there_and_back(axis, &Built::blank()));
    let codes = run(built, settings);
    assert!(codes.iter().any(|codes| codes[0] != 0), "it did not move");
    assert_eq!(run(taken, settings), codes);
}

#[test]
fn every_law_and_feedforward_puts_out_the_same_words() {
    for law in LawKind::ALL {
        for kind in FeedforwardKind::ALL {
            let mut settings = StageSettings::simulated();
            for axis in &mut settings.axes {
                axis.feedback.law = law;
                axis.feedforward.kind = kind;
            }
            if settings.validate(ELEMENTS).is_err() {
                continue;
            }
            words_run_as_what_was_built::<f32>(&settings);
            words_run_as_what_was_built::<Fixed>(&settings);
        }
    }
}

fn refused<T: Words>(words: &[u32], into: &mut T) -> WordFlaw {
    take(words, into).expect_err("refused").flaw
}

#[test]
fn a_word_that_is_none_of_its_type_is_refused() {
    assert_eq!(refused(&[2], &mut false), WordFlaw::Variant);
    assert_eq!(refused(&[2, 0], &mut Some(7_u32)), WordFlaw::Variant);
    assert_eq!(refused(&[256], &mut 0_u8), WordFlaw::TooLarge);
    assert_eq!(refused(&[65_536], &mut 0_u16), WordFlaw::TooLarge);
    let mut list = heapless::Vec::<u32, 2>::new();
    assert_eq!(refused(&[3, 0, 0], &mut list), WordFlaw::TooLarge);
    for number in [f32::NAN, f32::INFINITY, -f32::INFINITY] {
        assert_eq!(
            refused(&[number.to_bits()], &mut 0.0_f32),
            WordFlaw::NotFinite
        );
        let wide = f64::from(number).to_bits();
        let words = [wide as u32, (wide >> 32) as u32];
        assert_eq!(refused(&words, &mut 0.0_f64), WordFlaw::NotFinite);
    }
}

#[test]
fn number_types_differ_in_their_fingerprints() {
    let prints = [
        fingerprint::<f32>(),
        fingerprint::<Fixed>(),
        fingerprint::<f64>(),
    ];
    let [a, b, c] = prints;
    assert!(a != b && b != c && a != c, "{prints:x?}");
    // The room for GMS elements is part of it.
    assert_ne!(Axis::<f32, 4>::LAYOUT, Axis::<f32, 8>::LAYOUT);
}
