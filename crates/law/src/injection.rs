//! A voltage that a host adds to an axis' output, one value a control period: the excitation of identification.
//!
//! The values come in blocks, ahead of the tick that takes them, and end with the last one or with the first that is not
//! there in time. In closed loop they are added to what the law puts out, before the output limit; in open loop they are
//! all that the amplifier gets, and the reference goes along with the axis, so that the loop can be closed from where the
//! axis is and as fast as it is. `docs/safety.md` has the rules.

use crate::axes::AxisName;
use crate::safety::FaultCode;
use crate::safety::monitor::speed_limit;
use crate::scalar::{Quantity, Scalar};
use crate::units::Position;

/// Values in a block: with two bytes each, no more than the segments of a stream that wait in the same queue.
pub const BLOCK_VALUES: usize = 96;

/// Consecutive values, in the converter's words: 32767 stands for plus full scale.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VoltageBlock {
    values: heapless::Vec<i16, BLOCK_VALUES, u8>,
    /// The injection ends with the last of them.
    last: bool,
}

impl VoltageBlock {
    /// The first [`BLOCK_VALUES`] of `values`. `last`: the injection ends with them.
    pub fn new(values: impl Iterator<Item = i16>, last: bool) -> Self {
        Self {
            values: values.take(BLOCK_VALUES).collect(),
            last,
        }
    }

    /// Number of values, 0 to [`BLOCK_VALUES`].
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// The value at a place, if there is one.
    #[inline(always)]
    pub fn value(&self, place: usize) -> Option<InjectedValue> {
        let word = *self.values.get(place)?;
        Some(InjectedValue {
            word,
            last: self.last && place + 1 == self.values.len(),
        })
    }
}

/// A word to inject, and its place in the injection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InjectedValue {
    /// The word.
    pub word: i16,
    /// The injection ends with it.
    pub last: bool,
}

/// An injection ready for the tick. `StageSettings::injection` of the settings makes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Injection<S: Scalar> {
    axis: AxisName,
    coupling: Coupling,
    volts: S::Gain,
    travel: Position,
    /// Limit of the speed, 2^-8 counts per tick.
    max_speed: u32,
}

/// The relation of an injection to the loop and to the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coupling {
    /// The values are added to the law's output; the axes hold.
    #[default]
    Added,
    /// As [`Self::Added`], while the plan's motions run, which start with it.
    WithPlan,
    /// The values alone drive the amplifier; the other axes hold.
    OpenLoop,
}

impl<S: Scalar> Injection<S> {
    /// An injection into `axis` of words that are `volts_per_word` each. It is broken off when the axis goes farther than
    /// `travel` either way, or faster than `counts_per_tick` and half a count for what quantisation adds. Settings time
    /// only.
    pub fn new(
        axis: AxisName,
        coupling: Coupling,
        volts_per_word: f64,
        travel: Position,
        counts_per_tick: f64,
    ) -> Self {
        Self {
            axis,
            coupling,
            volts: S::gain(volts_per_word, Quantity::Integer, Quantity::Voltage),
            travel,
            max_speed: speed_limit(counts_per_tick),
        }
    }

    /// The axis that the voltage is put out on.
    pub fn axis(&self) -> AxisName {
        self.axis
    }

    /// The relation to the loop and to the plan.
    pub fn coupling(&self) -> Coupling {
        self.coupling
    }
}

/// Progress of an injection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InjectionProgress {
    /// The control tick of the first value, numbered as in a fault.
    pub first_tick: u32,
    /// Values that were put out.
    pub values: u32,
}

/// The memory of an injection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InjectionState<S: Scalar> {
    injection: Option<Injection<S>>,
    running: bool,
    /// The value of the next tick.
    next: Option<InjectedValue>,
    /// The last value has been put out.
    complete: bool,
    /// Position of the axis at the beginning.
    centre: Position,
    progress: InjectionProgress,
}

/// Result of a tick of an injection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum InjectionStep<S> {
    Voltage(S),
    Finished,
    Fault(FaultCode),
}

impl<S: Scalar> InjectionState<S> {
    /// Takes an injection that may begin once its first value is there.
    pub(crate) fn prepare(&mut self, injection: Injection<S>) {
        *self = Self {
            injection: Some(injection),
            ..Self::default()
        };
    }

    /// True if there is an injection: values of none are dropped.
    pub(crate) fn is_prepared(&self) -> bool {
        self.injection.is_some()
    }

    /// True if there is room for a value.
    pub(crate) fn wants_value(&self) -> bool {
        self.is_prepared() && self.next.is_none()
    }

    pub(crate) fn offer(&mut self, value: InjectedValue) {
        self.next = Some(value);
    }

    /// True if it can begin: its first value is there.
    pub(crate) fn is_ready(&self) -> bool {
        self.is_prepared() && !self.running && self.next.is_some()
    }

    /// True while it is under way.
    pub(crate) fn is_running(&self) -> bool {
        self.running
    }

    pub(crate) fn progress(&self) -> InjectionProgress {
        self.progress
    }

    pub(crate) fn injection(&self) -> Option<&Injection<S>> {
        self.injection.as_ref()
    }

    /// Begins at `tick`, the axis being at `here`.
    pub(crate) fn begin(&mut self, tick: u32, here: Position) {
        self.running = true;
        self.centre = here;
        self.progress = InjectionProgress {
            first_tick: tick,
            values: 0,
        };
    }

    /// Ends it, and drops the rest of it; returns what was under way.
    pub(crate) fn end(&mut self) -> Option<Injection<S>> {
        let running = core::mem::take(&mut self.running);
        self.next = None;
        self.complete = false;
        self.injection.take().filter(|_| running)
    }

    /// The voltage of this tick, of an axis at `measured` with a speed in 2^-8 counts per tick.
    pub(crate) fn step(&mut self, measured: Position, speed: i32) -> InjectionStep<S> {
        let Some(injection) = &self.injection else {
            return InjectionStep::Finished;
        };
        let beyond = (measured - self.centre).0.unsigned_abs() > injection.travel.0.unsigned_abs();
        if beyond || speed.unsigned_abs() > injection.max_speed {
            return InjectionStep::Fault(FaultCode::InjectionBounds);
        }
        if self.complete {
            return InjectionStep::Finished;
        }
        let Some(value) = self.next.take() else {
            return InjectionStep::Fault(FaultCode::InjectionUnderrun);
        };
        self.complete = value.last;
        self.progress.values = self.progress.values.wrapping_add(1);
        InjectionStep::Voltage(S::scale_integer(value.word.into(), injection.volts))
    }
}
