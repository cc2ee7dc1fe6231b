//! Gathers control periods into the samples of a recording.

use std::collections::VecDeque;

use crate::record::Recording;

/// Control periods at the end that are kept as they were.
const LATEST: usize = 5000;

/// A recording in the making.
pub(super) struct Recorder {
    recording: Recording,
    decimation: usize,
    ticks: usize,
    /// Control periods of the sample under way.
    within: usize,
    voltage_v: f64,
    injection_v: f64,
    latest: VecDeque<Period>,
}

/// Signals of one control period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Period {
    pub(super) reference_mm: f64,
    pub(super) position_mm: f64,
    pub(super) voltage_v: f64,
    pub(super) injection_v: f64,
}

impl Recorder {
    /// `decimation` control periods at `rate_hz` make a sample.
    pub(super) fn new(decimation: usize, rate_hz: f64) -> Self {
        let decimation = decimation.max(1);
        Self {
            recording: Recording {
                sample_time_s: decimation as f64 / rate_hz,
                ..Recording::default()
            },
            decimation,
            ticks: 0,
            within: 0,
            voltage_v: 0.0,
            injection_v: 0.0,
            latest: VecDeque::with_capacity(LATEST),
        }
    }

    /// Control periods so far.
    pub(super) fn ticks(&self) -> usize {
        self.ticks
    }

    /// Takes a control period among the latest, and not into the recording.
    pub(super) fn note(&mut self, period: Period) {
        if self.latest.len() == LATEST {
            self.latest.pop_front();
        }
        self.latest.push_back(period);
    }

    pub(super) fn push(&mut self, period: Period) {
        self.note(period);
        let Self {
            recording,
            decimation,
            ..
        } = self;
        if self.within == 0 {
            recording.reference_mm.push(period.reference_mm);
            recording.position_mm.push(period.position_mm);
        }
        self.voltage_v += period.voltage_v;
        self.injection_v += period.injection_v;
        self.ticks += 1;
        self.within += 1;
        if self.within == *decimation {
            self.within = 0;
            let count = *decimation as f64;
            recording.voltage_v.push(self.voltage_v / count);
            recording.injection_v.push(self.injection_v / count);
            self.voltage_v = 0.0;
            self.injection_v = 0.0;
        }
    }

    /// The last control periods at `rate_hz`, each a sample.
    pub(super) fn latest(&self, rate_hz: f64) -> Recording {
        let all = |read: fn(&Period) -> f64| self.latest.iter().map(read).collect();
        Recording {
            sample_time_s: 1.0 / rate_hz,
            reference_mm: all(|period| period.reference_mm),
            position_mm: all(|period| period.position_mm),
            voltage_v: all(|period| period.voltage_v),
            injection_v: all(|period| period.injection_v),
            parts: Vec::new(),
        }
    }

    /// The recording, without an incomplete last sample.
    pub(super) fn finish(mut self) -> Recording {
        let complete = self.recording.voltage_v.len();
        self.recording.reference_mm.truncate(complete);
        self.recording.position_mm.truncate(complete);
        self.recording
    }
}
