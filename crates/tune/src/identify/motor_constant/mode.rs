//! Passes of an axis that rings with a structural mode.

use std::f64::consts::TAU;

use super::passes::{Pass, fit_columns, integral};
use crate::record::Recording;

/// Lowest and highest frequency of a mode that is tried, Hz.
const MODES_HZ: (f64, f64) = (20.0, 250.0);
/// Number of these frequencies, even on a log scale.
const MODES: usize = 45;
/// Damping ratio of such a mode.
const MODE_DAMPING: f64 = 0.03;
/// Dead times that are tried with it, s.
const MODE_DELAYS_S: [f64; 5] = [0.2e-3, 0.8e-3, 1.5e-3, 2.3e-3, 3.3e-3];
/// Every THINNING-th sample counts: samples are much denser than what the passes hold.
const THINNING: usize = 5;

/// The passes of an axis that rings with a structural mode: what an oscillator does under the same voltage is a further part
/// of the motion, with the frequency that leaves the least over all passes.
pub(super) fn with_mode(
    recording: &Recording,
    spans: &[[usize; 3]],
    lag: usize,
) -> Option<Vec<Pass>> {
    let mut best: Option<(f64, Vec<Pass>)> = None;
    for index in 0..MODES {
        let share = index as f64 / (MODES - 1) as f64;
        let omega = TAU * MODES_HZ.0 * (MODES_HZ.1 / MODES_HZ.0).powf(share);
        let rings: Vec<[Vec<f64>; 2]> = spans
            .iter()
            .map(|&[begin, _, end]| {
                ringing(
                    &recording.voltage_v[begin..end],
                    omega,
                    recording.sample_time_s,
                )
            })
            .collect();
        for delay_s in MODE_DELAYS_S {
            let delay = (delay_s / recording.sample_time_s).round() as usize;
            let fits: Option<Vec<(f64, Pass)>> = spans
                .iter()
                .zip(&rings)
                .map(|(span, ring)| fit_ringing(recording, *span, lag, delay, ring))
                .collect();
            let Some(fits) = fits else { continue };
            let cost: f64 = fits.iter().map(|(cost, _)| cost).sum();
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, fits.into_iter().map(|(_, pass)| pass).collect()));
            }
        }
    }
    best.map(|(_, passes)| passes)
}

/// Deflection and its rate, over the frequency, of an oscillator that rests before the voltage begins.
fn ringing(voltage_v: &[f64], omega: f64, step_s: f64) -> [Vec<f64>; 2] {
    let (mut deflection, mut rate) = (0.0, 0.0);
    let states: Vec<(f64, f64)> = voltage_v
        .iter()
        .map(|voltage| {
            let before = (deflection, rate);
            let turn = omega * step_s;
            rate += turn * (voltage - deflection - 2.0 * MODE_DAMPING * rate);
            deflection += turn * rate;
            before
        })
        .collect();
    let part = |read: fn(&(f64, f64)) -> f64| states.iter().map(read).collect();
    [part(|state| state.0), part(|state| state.1)]
}

/// A pass with a mode in it, and what is left of its motion, squared.
fn fit_ringing(
    recording: &Recording,
    [begin, from, end]: [usize; 3],
    lag: usize,
    delay: usize,
    ring: &[Vec<f64>; 2],
) -> Option<(f64, Pass)> {
    let step_s = recording.sample_time_s;
    let positions = &recording.position_mm[from..end];
    let second = |signal: &[f64]| -> Vec<f64> {
        signal
            .windows(2 * lag + 1)
            .step_by(THINNING)
            .map(|window| window[2 * lag] - 2.0 * window[lag] + window[0])
            .collect()
    };
    let start = from.checked_sub(begin + delay)?;
    let push = integral(&recording.voltage_v[from - delay..end - delay], 0.0, step_s);
    let middle: Vec<f64> = push
        .windows(2)
        .map(|pair| 0.5 * (pair[0] + pair[1]))
        .collect();
    let right = second(positions);
    let columns = [
        second(&integral(&middle, 0.0, step_s)),
        vec![1.0; right.len()],
        second(&integral(positions, positions[0], step_s)),
        second(&ring[0][start..start + positions.len()]),
        second(&ring[1][start..start + positions.len()]),
    ];
    let count = columns.iter().map(Vec::len).fold(right.len(), usize::min);
    let sign = recording.voltage_v[begin].signum();
    fit_columns(&columns, &right[..count], sign, lag as f64 * step_s)
}
