//! Voltages that excite an axis: multisine, band-limited random, logarithmic sweep.
//!
//! Source: Pintelon and Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed., 2012, ch. 5.

use std::f64::consts::TAU;
use std::fmt;

use num_complex::Complex64;
use quadrant_written::Brief;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rustfft::FftPlanner;

/// The kinds of excitation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Waveform {
    /// Periodic, a sine at each line, with random phases: no leakage, and its scatter from period to period is the noise.
    #[default]
    Multisine,
    /// Noise within the band, never repeated.
    Random,
    /// A sine whose frequency rises by equal factors in equal times, once a period.
    Sweep,
}

impl fmt::Display for Waveform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Multisine => "multisine",
            Self::Random => "random",
            Self::Sweep => "sweep",
        })
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excitation {
    pub waveform: Waveform,
    /// RMS, V; above zero.
    pub rms_v: f64,
    /// Lowest and highest frequency, Hz.
    pub band_hz: (f64, f64),
    /// Frequency up to which a multisine's amplitudes rise in proportion to frequency, Hz: an axis moves in proportion to
    /// the inverse frequency there and would run away. Zero for equal amplitudes.
    pub rise_hz: f64,
    /// Duration of a period, or of a block of a random signal, s: the inverse of the frequency resolution.
    pub period_s: f64,
    /// Decides phases and noise.
    pub seed: u64,
}

/// A band without a line that is excited.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "the band of {} to {} Hz holds no line of the excitation, which has one every {} Hz, the inverse of its period of {period_s} s: \
     widen the band, or lengthen the period",
    .band_hz.0, .band_hz.1, Brief(1.0 / .period_s)
)]
pub struct NoLine {
    /// Lowest and highest frequency, Hz.
    pub band_hz: (f64, f64),
    /// Period of the excitation, s.
    pub period_s: f64,
}

impl Excitation {
    /// Checks that the band holds a line.
    ///
    /// # Errors
    /// A band that lies between two lines.
    pub fn check_lines(&self) -> Result<(), NoLine> {
        if self.lines().is_empty() {
            return Err(NoLine {
                band_hz: self.band_hz,
                period_s: self.period_s,
            });
        }
        Ok(())
    }

    /// Samples in a period at a rate.
    pub fn period(&self, rate_hz: f64) -> usize {
        ((self.period_s * rate_hz).round() as usize).max(2)
    }

    /// The lines of a period that are excited, as multiples of the inverse period: all within the band for a sweep,
    /// all but the outermost for a random one, whose leakage is one-sided there; log-spaced ones for a multisine, so that
    /// each has the power to be seen.
    pub fn lines(&self) -> Vec<usize> {
        let first = (self.band_hz.0 * self.period_s).ceil().max(1.0) as usize;
        let last = (self.band_hz.1 * self.period_s).floor() as usize;
        match self.waveform {
            Waveform::Multisine => {}
            Waveform::Random => return (first + 1..last).collect(),
            Waveform::Sweep => return (first..=last).collect(),
        }
        let mut lines = Vec::new();
        let mut next = first;
        while next <= last {
            lines.push(next);
            next = (next + 1).max((next as f64 * LINE_RATIO).round() as usize);
        }
        lines
    }

    /// `periods` of the excitation at `rate_hz`, V.
    pub fn samples(&self, rate_hz: f64, periods: usize) -> Vec<f64> {
        let period = self.period(rate_hz);
        let signal: Vec<f64> = match self.waveform {
            Waveform::Multisine => repeated(&self.multisine(period), periods),
            Waveform::Sweep => repeated(&self.sweep(period, rate_hz), periods),
            Waveform::Random => self.random(period * periods, rate_hz),
        };
        let square: f64 = signal.iter().map(|v| v * v).sum();
        let scale = self.rms_v / (square / signal.len() as f64).sqrt();
        signal.iter().map(|v| v * scale).collect()
    }

    fn multisine(&self, period: usize) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let mut spectrum = vec![Complex64::ZERO; period];
        for line in self.lines() {
            let frequency = line as f64 / self.period_s;
            let amplitude = if frequency < self.rise_hz {
                frequency / self.rise_hz
            } else {
                1.0
            };
            spectrum[line] = Complex64::from_polar(amplitude, TAU * random.random::<f64>());
        }
        real_part(&mut spectrum)
    }

    fn random(&self, samples: usize, rate_hz: f64) -> Vec<f64> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let mut spectrum = vec![Complex64::ZERO; samples];
        let line = |frequency: f64| (frequency * samples as f64 / rate_hz).round() as usize;
        for value in &mut spectrum[line(self.band_hz.0).max(1)..=line(self.band_hz.1)] {
            // Exponentially distributed power and uniform phase: normal noise.
            let power = -(1.0 - random.random::<f64>()).ln();
            *value = Complex64::from_polar(power.sqrt(), TAU * random.random::<f64>());
        }
        real_part(&mut spectrum)
    }

    fn sweep(&self, period: usize, rate_hz: f64) -> Vec<f64> {
        let (low, high) = self.band_hz;
        let duration = period as f64 / rate_hz;
        let factor = (high / low).ln();
        (0..period)
            .map(|index| {
                let share = index as f64 / period as f64;
                let turns = low * duration / factor * ((factor * share).exp() - 1.0);
                (TAU * turns).sin()
            })
            .collect()
    }
}

/// Ratio of neighbouring lines of a multisine, where the resolution allows it.
const LINE_RATIO: f64 = 1.08;

fn repeated(period: &[f64], periods: usize) -> Vec<f64> {
    period
        .iter()
        .copied()
        .cycle()
        .take(period.len() * periods)
        .collect()
}

/// The real part of the signal with this spectrum.
fn real_part(spectrum: &mut [Complex64]) -> Vec<f64> {
    FftPlanner::new()
        .plan_fft_inverse(spectrum.len())
        .process(spectrum);
    spectrum.iter().map(|value| value.re).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 10e3;

    fn excitation(waveform: Waveform) -> Excitation {
        Excitation {
            waveform,
            rms_v: 0.4,
            band_hz: (2.0, 300.0),
            rise_hz: 0.0,
            period_s: 1.0,
            seed: 7,
        }
    }

    fn power_within(signal: &[f64], band_hz: (f64, f64)) -> f64 {
        let mut spectrum: Vec<Complex64> = signal.iter().map(|v| Complex64::from(*v)).collect();
        FftPlanner::new()
            .plan_fft_forward(signal.len())
            .process(&mut spectrum);
        let frequency = |index: usize| index as f64 * RATE_HZ / signal.len() as f64;
        let half = &spectrum[..signal.len() / 2];
        let all: f64 = half.iter().map(Complex64::norm_sqr).sum();
        let inside: f64 = half
            .iter()
            .enumerate()
            .filter(|(index, _)| (band_hz.0..=band_hz.1).contains(&frequency(*index)))
            .map(|(_, value)| value.norm_sqr())
            .sum();
        inside / all
    }

    #[test]
    fn every_waveform_has_its_rms_and_stays_in_its_band() {
        for waveform in [Waveform::Multisine, Waveform::Random, Waveform::Sweep] {
            let signal = excitation(waveform).samples(RATE_HZ, 4);
            assert_eq!(signal.len(), 40_000);
            let mean_square = signal.iter().map(|v| v * v).sum::<f64>() / signal.len() as f64;
            assert!((mean_square.sqrt() - 0.4).abs() < 1e-9);
            let least = if waveform == Waveform::Sweep {
                0.95
            } else {
                1.0 - 1e-9
            };
            let inside = power_within(&signal, (2.0, 300.0));
            assert!(inside >= least, "{waveform}: {inside}");
        }
    }

    #[test]
    fn a_multisine_repeats_itself_and_has_a_low_crest() {
        let signal = excitation(Waveform::Multisine).samples(RATE_HZ, 2);
        assert_eq!(signal[..10_000], signal[10_000..]);
        let crest = signal.iter().fold(0.0_f64, |most, v| most.max(v.abs())) / 0.4;
        assert!(crest < 4.0, "{crest}");
    }

    #[test]
    fn the_seed_decides_the_signal() {
        let one = excitation(Waveform::Random);
        let other = Excitation { seed: 8, ..one };
        assert_eq!(one.samples(RATE_HZ, 1), one.samples(RATE_HZ, 1));
        assert_ne!(one.samples(RATE_HZ, 1), other.samples(RATE_HZ, 1));
    }
}
