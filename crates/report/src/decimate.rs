//! Thinning of long traces for drawing.

/// Points one bucket can contribute: the extremes of both coordinates and one gap.
const POINTS_PER_BUCKET: usize = 5;

/// Indices of at most `max_points` samples that draw the same picture as all of them.
///
/// The trace is cut into buckets of equal sample count, and of each the samples that are extreme in either coordinate are
/// kept. Over time this is the first, the last, the lowest and the highest sample of the bucket, so that a
/// quadrant glitch of a single sample survives; on a closed path (hysteresis, circle) the path's turning points do. A bucket
/// with samples that are not finite keeps one of them, which is drawn as a gap. Both slices must have one length; a trace that
/// is short enough is returned whole.
#[must_use]
pub fn decimate(x: &[f64], y: &[f64], max_points: usize) -> Vec<usize> {
    assert_eq!(
        x.len(),
        y.len(),
        "both coordinates of a trace have one length"
    );
    let n = x.len();
    if n <= max_points.max(POINTS_PER_BUCKET) {
        return (0..n).collect();
    }
    let buckets = (max_points / POINTS_PER_BUCKET).max(1);
    let mut kept = Vec::with_capacity(max_points);
    for bucket in 0..buckets {
        let first = kept.len();
        keep_extremes(
            x,
            y,
            bucket * n / buckets..(bucket + 1) * n / buckets,
            &mut kept,
        );
        kept[first..].sort_unstable();
    }
    kept.dedup();
    kept
}

fn keep_extremes(x: &[f64], y: &[f64], bucket: std::ops::Range<usize>, kept: &mut Vec<usize>) {
    let mut gap = None;
    // Lowest and highest in x, lowest and highest in y.
    let mut extremes: Option<[usize; 4]> = None;
    for i in bucket {
        if !(x[i].is_finite() && y[i].is_finite()) {
            gap = gap.or(Some(i));
            continue;
        }
        let [x_low, x_high, y_low, y_high] = extremes.get_or_insert([i; 4]);
        if x[i] < x[*x_low] {
            *x_low = i;
        }
        // A later sample of equal x wins, so that a bucket's last sample is kept where x stands still.
        if x[i] >= x[*x_high] {
            *x_high = i;
        }
        if y[i] < y[*y_low] {
            *y_low = i;
        }
        if y[i] > y[*y_high] {
            *y_high = i;
        }
    }
    kept.extend(extremes.into_iter().flatten());
    kept.extend(gap);
}

#[cfg(test)]
mod tests {
    use super::decimate;

    fn ramp(n: usize) -> Vec<f64> {
        (0..n).map(|i| i as f64 * 1e-4).collect()
    }

    #[test]
    fn short_traces_are_kept_whole() {
        let x = ramp(100);
        assert_eq!(decimate(&x, &x, 100), (0..100).collect::<Vec<_>>());
        assert!(decimate(&[], &[], 100).is_empty());
    }

    #[test]
    fn spikes_of_one_sample_survive() {
        let x = ramp(1_000_000);
        let mut y = vec![0.0; x.len()];
        y[123_456] = 5.0;
        y[123_457] = -7.0;
        y[999_999] = 1.0;
        let kept = decimate(&x, &y, 2_000);
        for spike in [123_456, 123_457, 999_999] {
            assert!(kept.contains(&spike), "sample {spike} was lost");
        }
    }

    #[test]
    fn the_limit_is_kept_and_the_order_is_that_of_the_trace() {
        let x = ramp(54_321);
        let y: Vec<f64> = x.iter().map(|t| (t * 900.0).sin()).collect();
        let kept = decimate(&x, &y, 1_000);
        assert!(kept.len() <= 1_000 && kept.len() > 600);
        assert!(kept.windows(2).all(|w| w[0] < w[1]));
        assert_eq!((kept[0], kept[kept.len() - 1]), (0, 54_320));
    }

    #[test]
    fn closed_paths_keep_their_turning_points_in_both_directions() {
        let angle: Vec<f64> = (0..10_000)
            .map(|i| std::f64::consts::TAU * i as f64 / 1e4)
            .collect();
        let (x, y): (Vec<f64>, Vec<f64>) = angle.iter().map(|a| (a.cos(), a.sin())).unzip();
        let kept = decimate(&x, &y, 200);
        for turn in [2_500, 5_000, 7_500] {
            assert!(kept.contains(&turn), "the turning point {turn} was lost");
        }
    }

    #[test]
    fn gaps_stay_gaps() {
        let x = ramp(10_000);
        let mut y = vec![1.0; x.len()];
        y[4_321] = f64::NAN;
        assert!(decimate(&x, &y, 500).contains(&4_321));
    }
}
