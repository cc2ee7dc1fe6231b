//! From blocks of samples to a response with coherence and variance.
//!
//! Source: Pintelon and Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed., 2012, ch. 2.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use num_complex::Complex64;
use rayon::prelude::*;
use realfft::{RealFftPlanner, RealToComplex};

use super::super::response::{FrequencyResponse, ResponsePoint};
use crate::record::Recording;

/// Estimator of the response: the quotient of spectra that it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Estimator {
    /// `S_yr / S_ur` with the injected excitation as instrument: free of bias under feedback.
    Instrument,
    /// `S_yu / S_uu`: for open loop, where the voltage is the excitation.
    H1,
}

/// Result of averaging over the blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    pub response: FrequencyResponse,
    /// Blocks that were averaged.
    pub blocks: usize,
    /// Distance of neighbouring lines, Hz.
    pub resolution_hz: f64,
}

/// Sums over the blocks at one line.
#[derive(Clone, Copy, Default)]
struct Sums {
    yr: Complex64,
    ur: Complex64,
    yu: Complex64,
    yy: f64,
    uu: f64,
    rr: f64,
}

/// Estimates the response at `lines` (multiples of the inverse block length, up to half of it) from equally long blocks, each a
/// recording and the range of its samples; at least two blocks.
///
/// Mean and slope are taken off each block, so that a motion at constant velocity is no part of it. A Hann window
/// keeps what is not periodic (the screw's ripple, what is left of a transient) out of distant lines; a block of two
/// periods of a periodic excitation puts its lines two apart, so that the window does not mix them.
pub fn estimate(
    blocks: &[(&Recording, Range<usize>)],
    lines: &[usize],
    estimator: Estimator,
) -> Estimate {
    let [estimate] = estimates(blocks, lines, [estimator]);
    estimate
}

/// As [`estimate`], several from the same spectra.
pub(super) fn estimates<const N: usize>(
    blocks: &[(&Recording, Range<usize>)],
    lines: &[usize],
    estimators: [Estimator; N],
) -> [Estimate; N] {
    let Some((first, range)) = blocks.first() else {
        return estimators.map(|_| Estimate {
            response: FrequencyResponse::default(),
            blocks: 0,
            resolution_hz: f64::NAN,
        });
    };
    let length = range.len();
    let transform = Transform::new(length);
    // Of each block only the lines are kept: an hour's recording has thousands of blocks.
    let spectra: Vec<[Vec<Complex64>; 3]> = blocks
        .par_iter()
        .map_init(
            || transform.workspace(),
            |workspace, (recording, range)| {
                let signals = [
                    &recording.position_mm,
                    &recording.voltage_v,
                    &recording.injection_v,
                ];
                signals.map(|signal| transform.lines(&signal[range.clone()], lines, workspace))
            },
        )
        .collect();
    let resolution_hz = 1.0 / (length as f64 * first.sample_time_s);
    estimators.map(|estimator| {
        let points = lines
            .par_iter()
            .enumerate()
            .map(|(index, &line)| {
                let hold = hold(PI * line as f64 / length as f64);
                let frequency_hz = line as f64 * resolution_hz;
                point(&spectra, index, frequency_hz, hold, estimator)
            })
            .collect();
        Estimate {
            response: FrequencyResponse { points },
            blocks: blocks.len(),
            resolution_hz,
        }
    })
}

/// The response of a zero-order hold at half the angle between samples, over that at zero frequency.
fn hold(half_angle: f64) -> Complex64 {
    Complex64::from_polar(half_angle.sin() / half_angle, -half_angle)
}

/// The response at the line of `index`.
fn point(
    spectra: &[[Vec<Complex64>; 3]],
    index: usize,
    frequency_hz: f64,
    hold: Complex64,
    estimator: Estimator,
) -> ResponsePoint {
    let mut sums = Sums::default();
    for [y, u, r] in spectra {
        let (y, u, r) = (y[index], u[index], r[index]);
        sums.yr += y * r.conj();
        sums.ur += u * r.conj();
        sums.yu += y * u.conj();
        sums.yy += y.norm_sqr();
        sums.uu += u.norm_sqr();
        sums.rr += r.norm_sqr();
    }
    let (sampled, coherence, input_power) = match estimator {
        Estimator::Instrument => (
            sums.yr / sums.ur,
            // A line at which the loop hides the excitation from the voltage is worth no more than one hidden in noise.
            (sums.yr.norm_sqr() / sums.yy).min(sums.ur.norm_sqr() / sums.uu) / sums.rr,
            sums.ur.norm_sqr() / sums.rr,
        ),
        Estimator::H1 => (
            sums.yu / sums.uu,
            sums.yu.norm_sqr() / (sums.yy * sums.uu),
            sums.uu,
        ),
    };
    // What the response does not explain, over the power that it was measured with.
    let unexplained: f64 = spectra
        .iter()
        .map(|[y, u, _]| (y[index] - sampled * u[index]).norm_sqr())
        .sum();
    let freedom = (spectra.len().max(2) - 1) as f64;
    let variance = unexplained / freedom / input_power;
    ResponsePoint {
        frequency_hz,
        response: sampled / hold,
        coherence: coherence.clamp(0.0, 1.0),
        relative_deviation: (0.5 * variance).sqrt() / sampled.norm(),
    }
}

/// Spectra of blocks of one length, at least 2.
pub(super) struct Transform {
    fft: Arc<dyn RealToComplex<f64>>,
    window: Vec<f64>,
}

/// Memory of a thread's transforms.
pub(super) struct Workspace {
    /// The block that is transformed, which the transform overwrites.
    pub(super) block: Vec<f64>,
    /// Its spectrum: the lines from 0 to half the length.
    pub(super) spectrum: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Transform {
    pub(super) fn new(length: usize) -> Self {
        let window = (0..length)
            .map(|index| (PI * index as f64 / length as f64).sin().powi(2))
            .collect();
        Self {
            fft: RealFftPlanner::new().plan_fft_forward(length),
            window,
        }
    }

    pub(super) fn workspace(&self) -> Workspace {
        Workspace {
            block: self.fft.make_input_vec(),
            spectrum: self.fft.make_output_vec(),
            scratch: self.fft.make_scratch_vec(),
        }
    }

    /// Transforms the block of a workspace.
    pub(super) fn run(&self, workspace: &mut Workspace) {
        let Workspace {
            block,
            spectrum,
            scratch,
        } = workspace;
        self.fft
            .process_with_scratch(block, spectrum, scratch)
            .expect("a workspace has the lengths of its transform");
    }

    /// Lines of the spectrum of a block without its mean and slope; each at most half the block's length.
    fn lines(&self, block: &[f64], lines: &[usize], workspace: &mut Workspace) -> Vec<Complex64> {
        let count = block.len() as f64;
        let middle = 0.5 * (count - 1.0);
        let (sum, moment) = block
            .iter()
            .enumerate()
            .fold((0.0, 0.0), |(sum, moment), (index, value)| {
                (sum + value, moment + (index as f64 - middle) * value)
            });
        let mean = sum / count;
        let slope = moment / (count * (count * count - 1.0) / 12.0);
        let values = block.iter().zip(&self.window).enumerate();
        for (windowed, (index, (value, window))) in workspace.block.iter_mut().zip(values) {
            let trend = mean + slope * (index as f64 - middle);
            *windowed = (value - trend) * window;
        }
        self.run(workspace);
        lines.iter().map(|&line| workspace.spectrum[line]).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Lines of the spectrum by the definition of the discrete Fourier transform.
    fn directly(values: &[f64], line: usize) -> Complex64 {
        let terms = values.iter().enumerate().map(|(index, value)| {
            // In whole numbers the angle loses no digits.
            let turns = (index * line % values.len()) as f64 / values.len() as f64;
            Complex64::from_polar(*value, -TAU * turns)
        });
        terms.sum()
    }

    #[test]
    fn a_spectrum_is_that_of_its_definition_within_rounding() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        for length in [32, 61, 999, 1000, 10_000] {
            let values: Vec<f64> = (0..length)
                .map(|_| random.random_range(-1.0..1.0))
                .collect();
            let transform = Transform::new(length);
            let mut workspace = transform.workspace();
            workspace.block.copy_from_slice(&values);
            transform.run(&mut workspace);
            assert_eq!(workspace.spectrum.len(), length / 2 + 1);
            let norm = values.iter().map(|value| value * value).sum::<f64>().sqrt();
            for line in (0..=length / 2).step_by(length.div_ceil(100)) {
                let error = (workspace.spectrum[line] - directly(&values, line)).norm();
                // The rounding of the sum of the definition grows with the length; both stay far below the noise of an encoder.
                assert!(error < 1e-13 * norm, "{length}, {line}: {}", error / norm);
            }
        }
    }

    #[test]
    fn a_workspace_that_was_used_gives_the_same_bits() {
        let block: Vec<f64> = (0..1000)
            .map(|index| f64::from(index % 37).sqrt())
            .collect();
        let transform = Transform::new(block.len());
        let lines: Vec<usize> = (1..=500).collect();
        let mut workspace = transform.workspace();
        let first = transform.lines(&block, &lines, &mut workspace);
        assert_eq!(first, transform.lines(&block, &lines, &mut workspace));
    }
}
