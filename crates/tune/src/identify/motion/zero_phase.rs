//! A Butterworth low-pass without phase: once forwards, once backwards.

use std::f64::consts::PI;

use biquad::{Biquad, Coefficients, DirectForm2Transposed, ToHertz, Type};

/// Samples mirrored at each end, in periods of the cut-off: the filter has forgotten them by then.
const MIRRORED_PERIODS: f64 = 3.0;

/// Filters forwards and backwards with a Butterworth low-pass of an even `order`, cut-off at `cutoff_hz`. The ends are
/// extended by their odd mirror images, as is usual, so that a trend runs on. Signals no longer than the extension, or
/// a cut-off at half the sampling rate and above, come back as they are.
pub fn low_pass(signal: &[f64], sample_time_s: f64, cutoff_hz: f64, order: usize) -> Vec<f64> {
    let mirrored = (MIRRORED_PERIODS / (cutoff_hz * sample_time_s)).ceil() as usize;
    if signal.len() <= mirrored + 1 {
        return signal.to_vec();
    }
    let Some(sections) = sections(sample_time_s, cutoff_hz, order) else {
        return signal.to_vec();
    };
    let (first, last) = (signal[0], signal[signal.len() - 1]);
    let before = (1..=mirrored).rev().map(|k| 2.0 * first - signal[k]);
    let after = (1..=mirrored).map(|k| 2.0 * last - signal[signal.len() - 1 - k]);
    let mut extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
    pass(&sections, &mut extended);
    extended.reverse();
    pass(&sections, &mut extended);
    extended.reverse();
    extended[mirrored..mirrored + signal.len()].to_vec()
}

/// Second-order sections of the low-pass.
fn sections(sample_time_s: f64, cutoff_hz: f64, order: usize) -> Option<Vec<Coefficients<f64>>> {
    (0..order / 2)
        .map(|index| {
            let angle = PI * (2 * index + 1) as f64 / (2 * order) as f64;
            let quality = 0.5 / angle.sin();
            let rate = sample_time_s.recip();
            Coefficients::from_params(Type::LowPass, rate.hz(), cutoff_hz.hz(), quality).ok()
        })
        .collect()
}

/// One pass, started as if the first sample had been there since minus infinity.
fn pass(sections: &[Coefficients<f64>], signal: &mut [f64]) {
    let start = signal.first().copied().unwrap_or(0.0);
    // Section by section a sample would wait for the one before it: so the processor works on several sections at a time.
    let mut filters: Vec<_> = sections
        .iter()
        .map(|section| DirectForm2Transposed::new(*section))
        .collect();
    for value in signal {
        for filter in &mut filters {
            *value = filter.run(*value - start) + start;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, TAU};

    use super::*;

    const PERIOD_S: f64 = 1e-3;

    fn sine(frequency_hz: f64) -> Vec<f64> {
        (0..4000)
            .map(|k| (TAU * frequency_hz * PERIOD_S * f64::from(k)).sin())
            .collect()
    }

    /// Amplitude of a filtered sine, and its phase against the sine, rad.
    fn response(frequency_hz: f64, cutoff_hz: f64, order: usize) -> (f64, f64) {
        let filtered = low_pass(&sine(frequency_hz), PERIOD_S, cutoff_hz, order);
        let (mut re, mut im) = (0.0, 0.0);
        for (k, value) in filtered.iter().enumerate().take(3000).skip(1000) {
            let angle = TAU * frequency_hz * PERIOD_S * k as f64;
            re += value * angle.sin() / 1000.0;
            im += value * angle.cos() / 1000.0;
        }
        (re.hypot(im), im.atan2(re))
    }

    #[test]
    fn both_passes_together_halve_the_power_at_the_cut_off_and_turn_nothing() {
        for order in [2, 4, 8] {
            let (gain, phase) = response(40.0, 40.0, order);
            assert!(
                (gain - FRAC_1_SQRT_2.powi(2)).abs() < 1e-3,
                "{order}: {gain}"
            );
            assert!(phase.abs() < 1e-3, "{order}: {phase}");
        }
    }

    #[test]
    fn order_by_order_less_passes_above_and_more_below() {
        let gains = |hz: f64| [2, 4, 8].map(|order| response(hz, 40.0, order).0);
        let [second, fourth, eighth] = gains(80.0);
        assert!(second > fourth && fourth > eighth && eighth < 1e-3);
        assert!(gains(10.0).iter().all(|gain| (gain - 1.0).abs() < 0.01));
    }

    #[test]
    fn a_trend_runs_on_at_the_ends() {
        let ramp: Vec<f64> = (0..500).map(|k| 0.1 * f64::from(k) + 3.0).collect();
        let filtered = low_pass(&ramp, PERIOD_S, 40.0, 4);
        for (a, b) in ramp.iter().zip(&filtered) {
            assert!((a - b).abs() < 1e-3, "{a}, {b}");
        }
    }

    #[test]
    fn what_is_too_short_comes_back_as_it_is() {
        assert_eq!(
            low_pass(&[1.0, 5.0, 2.0], PERIOD_S, 40.0, 4),
            [1.0, 5.0, 2.0]
        );
    }
}
