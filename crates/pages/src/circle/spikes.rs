//! The spikes at the four reversals of a turn.

use quadrant_law::reference::Sense;

/// The spikes of one turn: where an axis reverses on the plane's first axis, on its second, and opposite of each; mm, outwards
/// positive.
///
/// A spike is the radial deviation within a window about the reversal that is farthest from the level before it: the mean
/// deviation over half a window's width before the window. So it is how far the reversal throws the path, and a deviation
/// that is merely large is none. A path that does not come back within the window (a slow integrator's) counts in full; one
/// that drifts counts by what it drifts. Half the window is 2 % of the turn (7.2 degrees), or 20 ms if that is more (at
/// high feeds a glitch lasts as long as the control loop takes to answer it), at most 6 hundredths of the turn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spikes(pub [f64; 4]);

/// Half the window, as a fraction of the turn: the least and the most.
const HALF_WINDOW: (f64, f64) = (0.02, 0.06);
/// Half the window, s, if it is more than the least fraction.
const HALF_WINDOW_S: f64 = 0.02;

impl Spikes {
    /// Finds the spikes in one turn of deviations, `rate_hz` a second, that begins at 225 degrees.
    pub(super) fn find(deviations: &[f64], sense: Sense, rate_hz: f64) -> Self {
        let turn = deviations.len();
        let share = |share: f64| share * turn as f64;
        let half = (HALF_WINDOW_S * rate_hz)
            .clamp(share(HALF_WINDOW.0), share(HALF_WINDOW.1))
            .round()
            .max(1.0) as usize;
        let mut spikes = [f64::NAN; 4];
        for passed in 0..4 {
            let reversal = turn / 8 + passed * turn / 4;
            let at = match sense {
                Sense::CounterClockwise => (3 + passed) % 4,
                Sense::Clockwise => (2 + 4 - passed) % 4,
            };
            if let Some(spike) = spike_at(deviations, reversal, half) {
                spikes[at] = spike;
            }
        }
        Self(spikes)
    }

    /// Mean height, mm.
    pub fn mean_height_mm(&self) -> f64 {
        self.0.iter().map(|spike| spike.abs()).sum::<f64>() / 4.0
    }

    /// Largest height, mm.
    pub fn largest_mm(&self) -> f64 {
        self.0.iter().fold(0.0, |most, spike| most.max(spike.abs()))
    }
}

/// The spike about one sample, or nothing when its window or the level before it leave the turn.
fn spike_at(deviations: &[f64], reversal: usize, half: usize) -> Option<f64> {
    let from = reversal.checked_sub(2 * half)?;
    let (before, window) = deviations.get(from..=reversal + half)?.split_at(half);
    let level = before.iter().sum::<f64>() / half as f64;
    let heights = window.iter().map(|value| value - level);
    Some(heights.fold(0.0, |most: f64, height| {
        if height.abs() > most.abs() {
            height
        } else {
            most
        }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURN: usize = 40_000;

    #[test]
    fn spikes_are_distinguished_by_axis_sign_and_sense() {
        let mut deviations = vec![0.003; TURN];
        for (passed, height) in [0.001, -0.002, 0.003, -0.004].into_iter().enumerate() {
            deviations[TURN / 8 + passed * TURN / 4 + 20] += height;
        }
        let found = |sense| {
            Spikes::find(&deviations, sense, 1e4)
                .0
                .map(|mm| (1e3 * mm).round())
        };
        assert_eq!(found(Sense::CounterClockwise), [-2.0, 3.0, -4.0, 1.0]);
        assert_eq!(found(Sense::Clockwise), [3.0, -2.0, 1.0, -4.0]);
    }

    #[test]
    fn a_large_deviation_is_no_spike_and_a_step_is_one_in_full() {
        let mut deviations = vec![0.02; TURN];
        let level = Spikes::find(&deviations, Sense::Clockwise, 1e4);
        assert!(level.largest_mm() < 1e-12, "{level:?}");
        // Outwards at the first reversal, 180 degrees, and never back.
        deviations[TURN / 8..].fill(0.05);
        let step = Spikes::find(&deviations, Sense::Clockwise, 1e4);
        assert!(
            (step.0[2] - 0.03).abs() < 1e-12 && step.0[1].abs() < 1e-12,
            "{step:?}"
        );
    }

    #[test]
    fn a_fast_turn_is_searched_over_the_time_the_loop_needs() {
        // 6280 samples: 2 % of the turn is 12.6 ms, and the spike comes 15 ms late.
        let mut deviations = vec![0.0; 6280];
        deviations[6280 / 8 + 150] = 0.002;
        let spikes = Spikes::find(&deviations, Sense::CounterClockwise, 1e4);
        assert!((spikes.0[3] - 0.002).abs() < 1e-6);
    }
}
