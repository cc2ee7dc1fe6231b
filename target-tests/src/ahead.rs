//! The reference model ahead of the firmware: it closes its own loop, the firmware gets the inputs of many ticks at a time, and
//! the words are compared when they come. They must be equal, so that the inputs are those that the firmware's own words
//! would have led to, up to the first difference; from there on the stage follows the reference model.

use std::collections::VecDeque;

use anyhow::{Result, ensure};
use quadrant_law::stage::Outputs;
use quadrant_lockstep::InputRecord;

use crate::reference_model::{ReferenceModel, Tally};

/// Ticks passed at a time.
const BATCH: u32 = 512;

/// A firmware that answers ticks in their order.
pub(crate) trait Firmware {
    /// Ticks that may be asked now.
    fn room(&self) -> usize;
    /// Asks ticks.
    fn ask(&mut self, inputs: &[InputRecord]) -> Result<()>;
    /// Waits for answers, one at least; none from a firmware that has ended.
    fn answers(&mut self) -> Result<Vec<Outputs>>;
}

/// Runs both for `ticks` ticks and compares all words; `on_compared` is called after each comparison with the ticks compared so
/// far, and with the input and the answer of each of them.
pub(crate) fn run<F: Firmware>(
    model: &mut ReferenceModel,
    firmware: &mut F,
    ticks: u32,
    mut on_compared: impl FnMut(&mut F, u32, &[(InputRecord, Outputs)]) -> Result<()>,
) -> Result<Tally> {
    let mut tally = Tally::default();
    let mut expected = VecDeque::new();
    let (mut asked, mut compared) = (0, 0);
    while compared < ticks {
        while asked < ticks {
            let batch = BATCH.min(ticks - asked);
            if firmware.room() < batch as usize {
                break;
            }
            let (inputs, outputs) = model.run_alone(batch);
            firmware.ask(&inputs)?;
            expected.extend(inputs.into_iter().zip(outputs));
            asked += batch;
        }
        let answers = firmware.answers()?;
        ensure!(
            !answers.is_empty(),
            "the firmware ended before it answered tick {}",
            compared + 1
        );
        let mut answered = Vec::with_capacity(answers.len());
        for ((input, expected), answer) in expected.drain(..answers.len()).zip(answers) {
            compared += 1;
            tally.add(compared, expected, answer);
            answered.push((input, answer));
        }
        on_compared(firmware, compared, &answered)?;
    }
    Ok(tally)
}

#[cfg(test)]
mod tests {
    use quadrant_law::units::DacCode;
    use xtask::image::Scalar;

    use super::*;
    use crate::reference_model;

    /// A firmware with room for some ticks, which answers a few at a time: the reference model's words, but for one.
    struct Answering {
        words: VecDeque<Outputs>,
        inputs: VecDeque<InputRecord>,
        asked: VecDeque<Outputs>,
        room: usize,
        /// Ticks that it answers before it ends.
        left: usize,
    }

    impl Firmware for Answering {
        fn room(&self) -> usize {
            self.room - self.asked.len()
        }

        fn ask(&mut self, inputs: &[InputRecord]) -> Result<()> {
            assert!(inputs.len() <= self.room());
            for input in inputs {
                assert_eq!(Some(*input), self.inputs.pop_front());
            }
            self.asked.extend(self.words.drain(..inputs.len()));
            Ok(())
        }

        fn answers(&mut self) -> Result<Vec<Outputs>> {
            let count = self.asked.len().min(100).min(self.left);
            self.left -= count;
            Ok(self.asked.drain(..count).collect())
        }
    }

    fn model() -> ReferenceModel {
        ReferenceModel::of(Scalar::F32, reference_model::job()).expect("the job is good")
    }

    /// A run of 5000 ticks, of which the firmware answers as many, and one with other words.
    fn run_with(answered: usize, differs: Option<usize>) -> Result<Tally> {
        let (inputs, words) = model().run_alone(5000);
        let mut words = VecDeque::from(words);
        if let Some(tick) = differs {
            words[tick - 1].codes[1] = DacCode(words[tick - 1].codes[1].0 ^ 1);
        }
        let mut firmware = Answering {
            words,
            inputs: inputs.into(),
            asked: VecDeque::new(),
            room: 1300,
            left: answered,
        };
        let mut last = 0;
        let tally = run(&mut model(), &mut firmware, 5000, |_, tick, _| {
            assert!(last < tick);
            last = tick;
            Ok(())
        });
        tally.inspect(|_| assert_eq!(last, 5000))
    }

    #[test]
    fn every_word_of_a_firmware_that_runs_behind_is_compared() {
        let tally = run_with(5000, None).expect("it answers all");
        assert_eq!((tally.words, tally.differ), (15_000, 0));
        assert!(tally.moving > 7_500 && tally.first.is_none(), "{tally:?}");
    }

    #[test]
    fn the_first_tick_whose_words_differ_is_named_however_far_ahead_the_reference_model_is() {
        let (_, words) = model().run_alone(5000);
        for tick in [1, 100, 513, 1300, 4999, 5000] {
            let tally = run_with(5000, Some(tick)).expect("it answers all");
            let (first, ours, theirs) = tally.first.expect("one differs");
            assert_eq!((first as usize, tally.differ), (tick, 1));
            assert_eq!(ours, words[tick - 1]);
            assert_eq!(ours.codes[1].0 ^ 1, theirs.codes[1].0);
        }
    }

    #[test]
    fn a_firmware_that_ends_before_its_last_answer_is_reported() {
        let error = run_with(1000, None).expect_err("it ends").to_string();
        assert_eq!(error, "the firmware ended before it answered tick 1001");
    }
}
