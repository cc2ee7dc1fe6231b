//! From the channels of a connected axis to the recording of an experiment.

use quadrant_law::units::DacCode;
use quadrant_settings::AxisSettings;
use quadrant_tune::record::Recording;

use super::stop::Injected;
use crate::client::samples::Samples;

/// Units of a reference word in a count.
const UNITS_PER_COUNT: f64 = 256.0;
/// Counts after which a reference word wraps.
const REFERENCE_RANGE: f64 = 16_777_216.0;

/// Data of an experiment beside its samples of reference, position and sum of codes.
pub(super) struct Shape<'a> {
    pub(super) settings: &'a AxisSettings,
    /// Origin of the positions, mm.
    pub(super) origin_mm: f64,
    /// Control periods that it lasts at least.
    pub(super) lasts: usize,
    /// It lasts until a motion has ended.
    pub(super) moves: bool,
    pub(super) injected: Option<&'a Injected>,
}

impl Shape<'_> {
    /// The recording, from the first injected value to the end of injection and motion; nothing if the samples do not reach
    /// so far.
    pub(super) fn recording(&self, samples: &Samples) -> Option<Recording> {
        let every = usize::from(samples.decimation);
        let resolution_mm = self.settings.encoder.resolution_mm;
        let [reference, position, sum] = [0, 1, 2].map(|channel| samples.values(channel));
        // The words hold the low bits: the reference is within half its range of the position.
        let shift = ((position.first()? - reference.first()? / UNITS_PER_COUNT) / REFERENCE_RANGE)
            .round()
            * REFERENCE_RANGE;
        let begin = self.injected.map_or(0, |injected| {
            let before = injected.first_tick.wrapping_sub(samples.first_tick) as i32;
            (before.max(0) as usize).div_ceil(every)
        });
        // A sample's mean takes the sum at the next one.
        let available = sum.len().checked_sub(1)?;
        let last_move = (1..reference.len())
            .rev()
            .find(|&index| reference[index] != reference[index - 1])
            .filter(|_| self.moves);
        let least = match (self.lasts, last_move) {
            // Nothing says when it ends: what there is.
            (0, None) => available,
            _ => begin + self.lasts / every,
        };
        let end = last_move.map_or(least, |index| least.max(index + 1));
        if end > available || begin >= end {
            return None;
        }
        let mut recording = Recording {
            sample_time_s: samples.sample_time_s,
            ..Recording::default()
        };
        for index in begin..end {
            let here_mm = |counts: f64| counts * resolution_mm - self.origin_mm;
            recording.position_mm.push(here_mm(position[index]));
            recording
                .reference_mm
                .push(here_mm(reference[index] / UNITS_PER_COUNT + shift));
            let code = (sum[index + 1] - sum[index]) / every as f64;
            recording.voltage_v.push(self.volts(code));
            let tick = samples.first_tick.wrapping_add((index * every) as u32);
            recording.injection_v.push(self.injected_v(tick, every));
        }
        Some(recording)
    }

    /// The voltage of a converter's word, without what the law adds as the amplifier's offset.
    fn volts(&self, code: f64) -> f64 {
        let amplifier = &self.settings.amplifier;
        let codes_per_volt = DacCode::FULL_SCALE / amplifier.full_scale_v;
        let offset = (amplifier.offset_v * codes_per_volt).round();
        let volts = (code - offset) / codes_per_volt;
        if amplifier.reversed { -volts } else { volts }
    }

    /// The mean of what was injected in the `every` control periods from `tick` on.
    fn injected_v(&self, tick: u32, every: usize) -> f64 {
        let Some(injected) = self.injected else {
            return 0.0;
        };
        let from = tick.wrapping_sub(injected.first_tick) as usize;
        let values = injected.values_v.iter().skip(from).take(every);
        values.sum::<f64>() / every as f64
    }
}

#[cfg(test)]
mod tests {
    use quadrant_link::message::{AxisName, AxisSignal, Channel};
    use quadrant_settings::presets::x_axis;

    use super::*;

    /// Samples every second tick from tick 101 on, of an axis at rest `counts` from its origin.
    fn samples(counts: i32, codes: &[i16]) -> Samples {
        let channels = [
            AxisSignal::Reference,
            AxisSignal::Position,
            AxisSignal::CodeSum,
        ];
        let count = codes.len() / 2 + 1;
        let sums: Vec<u32> = (0..count)
            .map(|index| {
                let before = &codes[..2 * index];
                let sum: i32 = before.iter().map(|&code| i32::from(code)).sum();
                i32::MAX.wrapping_add(sum) as u32
            })
            .collect();
        Samples {
            channels: channels
                .map(|signal| Channel::Axis(AxisName::X, signal))
                .to_vec(),
            sample_time_s: 2e-4,
            decimation: 2,
            first_tick: 101,
            numbers: (0..count as u32).collect(),
            words: vec![
                vec![((i64::from(counts) * 256) as i32) as u32; count],
                vec![counts as u32; count],
                sums,
            ],
        }
    }

    #[test]
    fn voltages_are_means_over_all_ticks_and_positions_do_not_wrap() {
        let mut settings = x_axis();
        settings.amplifier.reversed = true;
        settings.amplifier.offset_v = 0.1;
        let DacCode(offset) = DacCode::from_volts(0.1, settings.amplifier.full_scale_v);
        let codes = [0, 2, 100, 300, -7, -9, 0, 0].map(|code: i16| offset - code);
        let far = 30_000_000;
        let injected = Injected {
            first_tick: 102,
            values_v: vec![1.0, 3.0, 5.0],
        };
        let shape = Shape {
            settings: &settings,
            origin_mm: 0.0,
            lasts: 4,
            moves: false,
            injected: Some(&injected),
        };
        let recording = shape.recording(&samples(far, &codes)).unwrap();
        // From the first sample after the first value: ticks 103 and 104, 105 and 106.
        let volts = settings.amplifier.full_scale_v / DacCode::FULL_SCALE;
        let expected = [200.0 * volts, -8.0 * volts];
        for (found, expected) in recording.voltage_v.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{recording:?}");
        }
        assert_eq!(recording.injection_v, [4.0, 0.0]);
        for place in [&recording.position_mm, &recording.reference_mm] {
            assert!((place[0] - f64::from(far) * settings.encoder.resolution_mm).abs() < 1e-6);
        }
    }

    #[test]
    fn a_recording_that_ends_too_early_is_none() {
        let settings = x_axis();
        let shape = Shape {
            settings: &settings,
            origin_mm: 0.0,
            lasts: 100,
            moves: false,
            injected: None,
        };
        assert_eq!(shape.recording(&samples(0, &[0; 8])), None);
    }
}
