//! Tracking error and quadrant glitch, as the project defines them.
//!
//! The *tracking error* is reference minus true position over whole cycles, as largest magnitude and RMS.
//!
//! The *quadrant glitch* of one velocity reversal is the largest error magnitude within a window of
//! +-[`GLITCH_WINDOW`] of a cycle around the reversal, over the error level next to it: the mean error magnitude
//! in the two shoulders of the same width on either side of the window. The glitch of a run is the mean over its
//! reversals. An error that is merely large everywhere has no glitch.

/// Half the width of the window around a reversal, and the width of each shoulder, as a fraction of the cycle.
pub const GLITCH_WINDOW: f64 = 0.02;

/// Score of a run of whole cycles; mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    pub largest_mm: f64,
    pub rms_mm: f64,
    /// Mean glitch over the reversals; NaN without a reversal.
    pub glitch_mm: f64,
}

/// The largest magnitude of `errors`.
pub fn largest(errors: &[f64]) -> f64 {
    errors.iter().fold(0.0, |most, error| error.abs().max(most))
}

/// The root of the mean square of `errors`.
pub fn rms(errors: &[f64]) -> f64 {
    let sum: f64 = errors.iter().map(|error| error * error).sum();
    (sum / errors.len() as f64).sqrt()
}

/// Indices at which `reference` turns round.
pub fn reversals(reference: &[f64]) -> Vec<usize> {
    let mut turns = Vec::new();
    let mut direction = 0.0;
    for (index, pair) in reference.windows(2).enumerate() {
        let step = pair[1] - pair[0];
        if step * direction < 0.0 {
            turns.push(index);
        }
        if step != 0.0 {
            direction = step;
        }
    }
    turns
}

/// The glitch at one reversal, or nothing when its shoulders leave the trace. `window` is in samples.
pub fn glitch_at(errors: &[f64], reversal: usize, window: usize) -> Option<f64> {
    let from = reversal.checked_sub(2 * window)?;
    let surroundings = errors.get(from..=reversal + 2 * window)?;
    let (before, rest) = surroundings.split_at(window);
    let (inside, after) = rest.split_at(2 * window + 1);
    let shoulders = before.iter().chain(after).map(|error| error.abs());
    let level = shoulders.sum::<f64>() / (2 * window) as f64;
    Some(largest(inside) - level)
}

/// Scores a trace of whole cycles, `cycle` samples each.
pub fn score(reference: &[f64], errors: &[f64], cycle: usize) -> Score {
    let window = ((cycle as f64 * GLITCH_WINDOW).round() as usize).max(1);
    let glitches: Vec<f64> = reversals(reference)
        .into_iter()
        .filter_map(|reversal| glitch_at(errors, reversal, window))
        .collect();
    Score {
        largest_mm: largest(errors),
        rms_mm: rms(errors),
        glitch_mm: glitches.iter().sum::<f64>() / glitches.len() as f64,
    }
}

/// The largest of some ratios, and their geometric mean.
pub fn worst_and_mean(ratios: &[f64]) -> (f64, f64) {
    let worst = ratios.iter().copied().fold(0.0, f64::max);
    let logarithms: f64 = ratios.iter().map(|ratio| ratio.ln()).sum();
    (worst, (logarithms / ratios.len() as f64).exp())
}

/// The relative change from `before` to `after`, %.
pub fn change_percent(before: f64, after: f64) -> f64 {
    (after / before - 1.0) * 100.0
}

/// One number of a score.
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// Its name in tables.
    pub name: &'static str,
    /// The same, as a caption begins.
    pub title: &'static str,
    /// Reads it, mm.
    pub read: fn(&Score) -> f64,
}

impl Metric {
    /// Largest magnitude of the tracking error.
    pub const LARGEST: Self = Self {
        name: "Largest",
        title: "Largest tracking error",
        read: |score| score.largest_mm,
    };
    /// RMS of the tracking error.
    pub const RMS: Self = Self {
        name: "RMS",
        title: "RMS tracking error",
        read: |score| score.rms_mm,
    };
    /// Quadrant glitch.
    pub const GLITCH: Self = Self {
        name: "Glitch",
        title: "Quadrant glitch",
        read: |score| score.glitch_mm,
    };
    /// All of them.
    pub const ALL: [Self; 3] = [Self::LARGEST, Self::RMS, Self::GLITCH];
    /// The tracking error.
    pub const TRACKING: [Self; 2] = [Self::LARGEST, Self::RMS];
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const CYCLE: usize = 10_000;

    fn reference() -> Vec<f64> {
        (0..2 * CYCLE)
            .map(|k| 30.0 * (TAU * k as f64 / CYCLE as f64).sin())
            .collect()
    }

    #[test]
    fn a_sine_turns_round_twice_in_a_cycle() {
        let turns = reversals(&reference());
        let expected = [2500, 7500, 12_500, 17_500];
        assert_eq!(turns.len(), expected.len());
        for (turn, expected) in turns.into_iter().zip(expected) {
            assert!(turn.abs_diff(expected) <= 1);
        }
    }

    #[test]
    fn a_constant_error_has_no_glitch() {
        let score = score(&reference(), &vec![0.1; 2 * CYCLE], CYCLE);
        assert!(score.glitch_mm.abs() < 1e-12);
        assert!((score.rms_mm - 0.1).abs() < 1e-12);
        assert_eq!(score.largest_mm, 0.1);
    }

    #[test]
    fn the_glitch_is_the_height_of_a_spike_over_its_surroundings() {
        let mut errors = vec![0.02; 2 * CYCLE];
        for turn in [2500, 7500, 12_500, 17_500] {
            errors[turn + 30] = -0.09;
        }
        let score = score(&reference(), &errors, CYCLE);
        assert!((score.glitch_mm - 0.07).abs() < 1e-9);
        assert_eq!(score.largest_mm, 0.09);
    }

    #[test]
    fn a_reversal_too_close_to_the_end_of_the_trace_is_left_out() {
        assert_eq!(glitch_at(&[0.0; 100], 10, 10), None);
        assert!(glitch_at(&[0.0; 100], 50, 10).is_some());
    }
}
