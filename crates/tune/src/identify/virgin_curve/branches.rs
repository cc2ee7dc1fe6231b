//! From a recorded hysteresis to the virgin curve.

use crate::record::Recording;

/// One point of the virgin curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirginPoint {
    /// Displacement from rest, mm.
    pub displacement_mm: f64,
    /// Friction, V.
    pub force_v: f64,
}

/// The virgin curve, averaged over the branches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VirginCurve {
    /// Its points, by rising displacement.
    pub points: Vec<VirginPoint>,
    /// Branches that were averaged.
    pub branches: usize,
}

impl VirginCurve {
    /// The largest friction on it, V.
    pub fn top_v(&self) -> f64 {
        let forces = self.points.iter().map(|point| point.force_v);
        forces.fold(0.0, f64::max)
    }
}

/// Position and voltage without the jitter of encoder and converter.
#[derive(Clone, Debug)]
pub(super) struct Smooth {
    pub(super) sample_time_s: f64,
    pub(super) position_mm: Vec<f64>,
    pub(super) voltage_v: Vec<f64>,
}

/// Time over which signals are averaged, s; twice, so that the average is triangular and centred.
const SMOOTHING_S: f64 = 0.03;
/// The same as a share of a record of quick cycles.
const SMOOTHING_SHARE: f64 = 1e-3;
/// Time between the samples that are kept of them, s: much shorter than the smoothing, and every sample costs the refinement
/// time.
const STEP_S: f64 = 1e-3;
/// Points of the averaged curve.
const POINTS: usize = 120;
/// Distance over the whole travel by which the axis must come back to have turned round.
const MIN_RETURN_SHARE: f64 = 0.2;

impl Smooth {
    pub(super) fn of(recording: &Recording) -> Self {
        let smoothing_s = SMOOTHING_S.min(SMOOTHING_SHARE * recording.duration_s());
        let half = ((0.5 * smoothing_s / recording.sample_time_s).round() as usize).max(1);
        let step = ((STEP_S / recording.sample_time_s).round() as usize).max(1);
        let smooth = |signal: &[f64]| -> Vec<f64> {
            let smooth = centred_mean(&centred_mean(signal, half), half);
            smooth.into_iter().step_by(step).collect()
        };
        Self {
            sample_time_s: recording.sample_time_s * step as f64,
            position_mm: smooth(&recording.position_mm),
            voltage_v: smooth(&recording.voltage_v),
        }
    }

    /// Indices at which the axis turns round.
    pub(super) fn reversals(&self) -> Vec<usize> {
        let (low, high) = range(&self.position_mm);
        let threshold = MIN_RETURN_SHARE * (high - low);
        let mut turns = Vec::new();
        let (mut least, mut most) = (0, 0);
        let mut rising = None;
        for (index, &position) in self.position_mm.iter().enumerate() {
            if position > self.position_mm[most] {
                most = index;
            }
            if position < self.position_mm[least] {
                least = index;
            }
            if rising != Some(false) && position < self.position_mm[most] - threshold {
                turns.push(most);
                rising = Some(false);
                least = index;
            } else if rising != Some(true) && position > self.position_mm[least] + threshold {
                turns.push(least);
                rising = Some(true);
                most = index;
            }
        }
        turns
    }

    /// The virgin curve by the Masing rule, from all branches between reversals but the first.
    pub(super) fn virgin_curve(&self) -> VirginCurve {
        let turns = self.reversals();
        let branches: Vec<Vec<VirginPoint>> = turns
            .windows(2)
            .skip(1)
            .map(|turn| self.branch(turn[0], turn[1]))
            .collect();
        // The curve reaches as far as the shortest branch.
        let reach = branches
            .iter()
            .filter_map(|branch| branch.last().map(|point| point.displacement_mm))
            .fold(f64::INFINITY, f64::min);
        if branches.is_empty() || !reach.is_finite() {
            return VirginCurve::default();
        }
        let points = (1..=POINTS)
            .map(|index| {
                // Denser near zero, where the curve bends most.
                let displacement_mm = reach * (index as f64 / POINTS as f64).powi(2);
                let forces = branches.iter().map(|branch| at(branch, displacement_mm));
                VirginPoint {
                    displacement_mm,
                    force_v: forces.sum::<f64>() / branches.len() as f64,
                }
            })
            .collect();
        VirginCurve {
            points,
            branches: branches.len(),
        }
    }

    /// A branch from its reversal on, both axes halved, made to rise.
    fn branch(&self, from: usize, to: usize) -> Vec<VirginPoint> {
        let (start_mm, start_v) = (self.position_mm[from], self.voltage_v[from]);
        let mut points: Vec<VirginPoint> = Vec::new();
        for index in from..to {
            let displacement_mm = 0.5 * (self.position_mm[index] - start_mm).abs();
            if points
                .last()
                .is_none_or(|last| displacement_mm > last.displacement_mm)
            {
                points.push(VirginPoint {
                    displacement_mm,
                    force_v: 0.5 * (self.voltage_v[index] - start_v).abs(),
                });
            }
        }
        points
    }
}

/// The force of a branch at a displacement.
fn at(branch: &[VirginPoint], displacement_mm: f64) -> f64 {
    let above = branch.partition_point(|point| point.displacement_mm < displacement_mm);
    match (
        above.checked_sub(1).map(|below| branch[below]),
        branch.get(above),
    ) {
        (Some(low), Some(high)) => {
            let span = high.displacement_mm - low.displacement_mm;
            let share = (displacement_mm - low.displacement_mm) / span;
            low.force_v + share * (high.force_v - low.force_v)
        }
        (Some(last), None) => last.force_v,
        (None, first) => first.map_or(0.0, |point| point.force_v),
    }
}

pub(super) fn range(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        })
}

/// The mean over `half` samples on either side; fewer at the ends.
fn centred_mean(signal: &[f64], half: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    for value in signal {
        sum += value;
        sums.push(sum);
    }
    (0..signal.len())
        .map(|index| {
            let half = half.min(index).min(signal.len() - 1 - index);
            let (from, to) = (index - half, index + half + 1);
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}
