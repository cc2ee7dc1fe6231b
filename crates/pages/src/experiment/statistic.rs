//! Mean and spread of a quantity over repeated runs.

/// Mean and spread of one quantity over repeated runs, in its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistic {
    /// Mean over the runs.
    pub mean: f64,
    /// Standard deviation of one run; nothing of a single one.
    pub deviation: Option<f64>,
}

impl Statistic {
    /// Of these values, of which there is one at least.
    pub fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self {
            mean,
            deviation: (values.len() > 1).then(|| (squares / (count - 1.0)).sqrt()),
        }
    }

    /// Mean minus and plus one standard deviation; the mean twice for a single run.
    pub fn range(&self) -> (f64, f64) {
        let half = self.deviation.unwrap_or(0.0);
        (self.mean - half, self.mean + half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_is_that_of_a_sample() {
        let statistic = Statistic::of(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(statistic.mean, 2.5);
        assert!((statistic.deviation.unwrap() - (5.0_f64 / 3.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_single_run_has_no_spread() {
        let statistic = Statistic::of(&[7.0]);
        assert_eq!(statistic.deviation, None);
        assert_eq!(statistic.range(), (7.0, 7.0));
    }
}
