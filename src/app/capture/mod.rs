//! The triggered capture: a ring of samples at up to the full control rate, with what came before the trigger.
//!
//! The slow half arms a [`Capture`] and passes it through a queue to the control interrupt, which steps it after every
//! tick and returns it frozen. Only its present owner may touch it: nothing is shared and nothing locked. A
//! fault triggers an armed capture, whichever trigger it waits for, so that every fault leaves its trace.

mod trigger;

use core::fmt;

use quadrant_link::message::{CaptureCause, CapturePhase, CaptureRecord, Trigger};

use crate::app::telemetry::{Observation, Selection, SelectionError, shown};
use quadrant_law::scalar::Scalar;
use trigger::Watch;

/// Words of the ring: 8 KiB; 1024 samples of two channels are 0.1 s at 10 kHz.
pub const CAPTURE_WORDS: usize = 2048;

/// Largest share of the ring before the trigger, percent: the sample at the trigger has room in any case.
pub const MAX_PRE_TRIGGER_PERCENT: u8 = 100;

/// A refused request to arm a capture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CaptureError {
    /// The channels or the decimation.
    Selection(SelectionError),
    /// The share before the trigger, percent, which is above [`MAX_PRE_TRIGGER_PERCENT`].
    PreTrigger(u8),
    /// The words of the ring, which do not hold one sample.
    Room(usize),
    /// The trigger's level, which is no finite number.
    Level,
}

impl fmt::Display for CaptureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Selection(error) => error.fmt(f),
            Self::PreTrigger(percent) => write!(
                f,
                "pre-trigger: {percent} % of the ring is more than all of it; give 0 to \
                 {MAX_PRE_TRIGGER_PERCENT}"
            ),
            Self::Room(words) => write!(
                f,
                "channels: a ring of {words} words does not hold one sample; select fewer"
            ),
            Self::Level => f.write_str(
                "trigger level: not a finite number; give it in the unit of its channel",
            ),
        }
    }
}

impl core::error::Error for CaptureError {}

impl From<SelectionError> for CaptureError {
    fn from(error: SelectionError) -> Self {
        Self::Selection(error)
    }
}

/// A ring of words, and its trigger.
#[derive(Debug)]
pub struct Capture<'a> {
    words: &'a mut [u32],
    selection: Option<Selection>,
    watch: Watch,
    phase: CapturePhase,
    /// Words of a sample, and of the whole samples that the ring holds.
    sample_words: usize,
    used_words: usize,
    /// Samples kept from before the trigger, and recorded from it on.
    pre_samples: u32,
    post_samples: u32,
    /// Index of the next sample's first word.
    next_word: usize,
    /// Ticks until the next sample.
    wait: u16,
    /// Samples recorded before the trigger, up to `pre_samples`, and from it on.
    before: u32,
    after: u32,
    last_tick: u32,
    trigger_tick: u32,
    cause: CaptureCause,
}

impl<'a> Capture<'a> {
    /// A capture that is not armed, with a ring of the words given: [`CAPTURE_WORDS`] on a board.
    pub const fn new(words: &'a mut [u32]) -> Self {
        Self {
            words,
            selection: None,
            watch: Watch::new(),
            phase: CapturePhase::Idle,
            sample_words: 0,
            used_words: 0,
            pre_samples: 0,
            post_samples: 0,
            next_word: 0,
            wait: 0,
            before: 0,
            after: 0,
            last_tick: 0,
            trigger_tick: 0,
            cause: CaptureCause::Stopped,
        }
    }

    /// Forgets what was recorded and waits for a trigger, with `pre_trigger_percent` (0 to 100) of the ring for what
    /// comes before it; nothing comes before [`Trigger::Now`]. What cannot be armed changes nothing. Slow half only.
    pub fn arm(
        &mut self,
        selection: Selection,
        pre_trigger_percent: u8,
        trigger: Trigger,
    ) -> Result<(), CaptureError> {
        if pre_trigger_percent > MAX_PRE_TRIGGER_PERCENT {
            return Err(CaptureError::PreTrigger(pre_trigger_percent));
        }
        let watch = Watch::arm(trigger).ok_or(CaptureError::Level)?;
        let sample_words = selection.channels().len();
        let room = self.words.len() / sample_words;
        if room == 0 {
            return Err(CaptureError::Room(self.words.len()));
        }
        let most_before = match trigger {
            Trigger::Now => 0,
            _ => room * usize::from(pre_trigger_percent) / 100,
        };
        self.selection = Some(selection);
        self.watch = watch;
        self.phase = CapturePhase::Armed;
        self.sample_words = sample_words;
        self.used_words = room * sample_words;
        self.pre_samples = most_before.min(room - 1) as u32;
        self.post_samples = room as u32 - self.pre_samples;
        self.next_word = 0;
        self.wait = 0;
        self.before = 0;
        self.after = 0;
        Ok(())
    }

    /// After a tick: watches for the trigger and records, if a sample is due. Says whether this tick froze the ring. At
    /// most [`MAX_CHANNELS`](quadrant_link::message::MAX_CHANNELS) + 1 reads; a capture that is not armed costs a comparison.
    #[inline(always)]
    pub fn step<S: Scalar, const N: usize>(&mut self, seen: &Observation<'_, S, N>) -> bool {
        match self.phase {
            CapturePhase::Armed | CapturePhase::Triggered => self.advance(seen),
            CapturePhase::Idle | CapturePhase::Frozen => false,
        }
    }

    #[inline(never)]
    fn advance<S: Scalar, const N: usize>(&mut self, seen: &Observation<'_, S, N>) -> bool {
        if self.phase == CapturePhase::Armed
            && let Some(cause) = self.watch.step(seen)
        {
            self.phase = CapturePhase::Triggered;
            self.cause = cause;
            self.trigger_tick = seen.tick();
        }
        if let Some(wait) = self.wait.checked_sub(1) {
            self.wait = wait;
            return false;
        }
        self.store(seen);
        if self.phase == CapturePhase::Armed {
            self.before = self.before.saturating_add(1).min(self.pre_samples);
            return false;
        }
        self.after = self.after.saturating_add(1);
        let frozen = self.after >= self.post_samples;
        if frozen {
            self.phase = CapturePhase::Frozen;
        }
        frozen
    }

    #[inline(always)]
    fn store<S: Scalar, const N: usize>(&mut self, seen: &Observation<'_, S, N>) {
        let Some(selection) = &self.selection else {
            return;
        };
        self.wait = selection.decimation().saturating_sub(1);
        if let Some(room) = self.words.get_mut(self.next_word..) {
            selection.read(seen, room);
        }
        self.last_tick = seen.tick();
        let next = self.next_word.saturating_add(self.sample_words);
        self.next_word = if next < self.used_words { next } else { 0 };
    }

    /// Freezes what there is, without a trigger. Says whether it was recording.
    pub fn stop(&mut self) -> bool {
        let recording = matches!(self.phase, CapturePhase::Armed | CapturePhase::Triggered);
        if recording {
            if self.phase == CapturePhase::Armed {
                self.cause = CaptureCause::Stopped;
                self.trigger_tick = self.last_tick;
            }
            self.phase = CapturePhase::Frozen;
        }
        recording
    }

    /// Returns its progress.
    pub const fn phase(&self) -> CapturePhase {
        self.phase
    }

    /// Returns the recorded selection, once it has been armed.
    pub const fn selection(&self) -> Option<&Selection> {
        self.selection.as_ref()
    }

    /// Describes the samples, if it is frozen. Slow half only.
    pub fn record(&self) -> Option<CaptureRecord> {
        let selection = self.selection.as_ref()?;
        (self.phase == CapturePhase::Frozen).then(|| {
            let samples = self.samples();
            let span = samples.saturating_sub(1) * u32::from(selection.decimation());
            CaptureRecord {
                samples,
                trigger_sample: self.before,
                first_tick: self.last_tick.wrapping_sub(span),
                trigger_tick: self.trigger_tick,
                cause: self.cause,
            }
        })
    }

    /// The words of a frozen capture from `offset` on: sample after sample, the oldest first, the channels in the
    /// order of the selection. None unless frozen. `S`: the law's number type. Slow half only.
    pub fn words<S: Scalar>(&self, offset: usize) -> impl ExactSizeIterator<Item = u32> + '_ {
        let channels = self.selection.as_ref().map_or(&[][..], Selection::channels);
        let all = match self.phase {
            CapturePhase::Frozen => self.samples() as usize * self.sample_words,
            _ => 0,
        };
        // The oldest word lies `all` words before the next one.
        let start = self.next_word + self.used_words - all;
        (offset.min(all)..all).map(move |word| {
            let raw = self.words[(start + word) % self.used_words];
            shown::<S>(channels[word % self.sample_words], raw)
        })
    }

    const fn samples(&self) -> u32 {
        self.before + self.after
    }
}
